/** Random numbers that are the same with every standard library, unlike std::*_distribution's. One generator for each
thing that is drawn, keyed by its use, so results do not depend on the order of the draws. */
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <numbers>
#include <random>

namespace forereach::research {

class Random final {
 public:
  /** The same key gives the same numbers. */
  explicit Random(std::initializer_list<std::uint64_t> key) : bits_(Mix(key)) {}

  /** In [lower, upper]. */
  [[nodiscard]] double Uniform(double lower, double upper) {
    return std::min(lower + (upper - lower) * (static_cast<double>(bits_() >> 11) * 0x1p-53), upper);
  }
  /** One of lower .. upper, to within 2^-50 equally likely. */
  [[nodiscard]] int Integer(int lower, int upper) {
    return std::min(lower + static_cast<int>(Uniform(0, upper - lower + 1)), upper);
  }
  [[nodiscard]] bool Coin() { return (bits_() >> 63) != 0; }
  /** N(0, 1), by Box and Muller. */
  [[nodiscard]] double Normal() {
    const double u = Uniform(0x1p-60, 1), angle = Uniform(0, 2 * std::numbers::pi);
    return std::sqrt(-2 * std::log(u)) * std::cos(angle);
  }
  /** N(0, scale^2) given that it lies in [-cut, cut]. @pre cut >= scale >= 0 */
  [[nodiscard]] double TruncatedNormal(double scale, double cut) {
    for (;;)
      if (const double x = scale * Normal(); std::abs(x) <= cut) return x;
  }

 private:
  // SplitMix64's finalizer, over the key's words.
  static std::uint64_t Mix(std::initializer_list<std::uint64_t> key) {
    std::uint64_t hash = 0;
    for (const std::uint64_t word : key) {
      hash += word + 0x9e3779b97f4a7c15;
      hash = (hash ^ (hash >> 30)) * 0xbf58476d1ce4e5b9;
      hash = (hash ^ (hash >> 27)) * 0x94d049bb133111eb;
      hash ^= hash >> 31;
    }
    return hash;
  }

  std::mt19937_64 bits_;
};

}  // namespace forereach::research
