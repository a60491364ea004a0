/** Seeded random inputs for property tests. FOREREACH_TEST_SEED=N in the environment shifts every seed, so a test can
be run on fresh inputs; a TracedRandom prints the seed that reproduces a failure. */
#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <random>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "forereach/numerics/interval.h"
#include "forereach/sets/zonotope.h"

namespace forereach {

[[nodiscard]] inline std::span<const double> View(const Eigen::VectorXd& vector) {
  return {vector.data(), static_cast<std::size_t>(vector.size())};
}

/** Upper bounds on the half-widths of a set's hull. */
[[nodiscard]] inline std::vector<double> HalfWidths(const Zonotope& set) {
  std::vector<double> half_width;
  for (int k = 0; k < set.dim(); ++k) half_width.push_back(set.HalfWidthUpper(k));
  return half_width;
}

class Random {
 public:
  explicit Random(std::uint64_t seed) {
    const char* shift = std::getenv("FOREREACH_TEST_SEED");
    seed_ = seed + (shift ? std::strtoull(shift, nullptr, 10) : 0);
    engine_.seed(seed_);
  }

  [[nodiscard]] std::string trace() const { return "seed " + std::to_string(seed_); }

  std::uint64_t Bits() { return engine_(); }
  /** 0 .. count - 1. */
  int Below(int count) { return static_cast<int>(engine_() % static_cast<std::uint64_t>(count)); }
  int Integer(int lowest, int highest) { return lowest + Below(highest - lowest + 1); }
  bool Coin(double probability = 0.5) { return Uniform(0, 1) < probability; }
  double Uniform(double lower, double upper) {
    return lower + (upper - lower) * (static_cast<double>(engine_() >> 11) * 0x1p-53);
  }
  double Sign() { return Coin() ? 1 : -1; }

  /** A finite double: any bit pattern, a moderate one, one of few bits, or one where arithmetic changes its rules. */
  double Double() {
    static constexpr std::array special{0.0,
                                        -0.0,
                                        1.0,
                                        -1.0,
                                        0x1p-1074,
                                        -0x1p-1074,
                                        0x1p-1022,
                                        -0x1p-1022,
                                        0x1.fffffffffffffp-1023,
                                        0x1.fffffffffffffp+1023,
                                        -0x1.fffffffffffffp+1023,
                                        0x1p+1023,
                                        0x1p-960,
                                        0x1.fffffffffffffp-961,
                                        0x1p-537,
                                        0x1p-480,
                                        0x1p-538,
                                        0x1.0000000000001p0,
                                        0x1.fffffffffffffp-1,
                                        3.0,
                                        0x1p53,
                                        0x1p511,
                                        0x1p512,
                                        1e300,
                                        -1e300,
                                        1e-300,
                                        -1e-300,
                                        0.1,
                                        -1.0 / 3};
    switch (Below(8)) {
      case 0: return special[static_cast<std::size_t>(Below(static_cast<int>(special.size())))];
      case 1:
      case 2: {
        const double any = std::bit_cast<double>(Bits());
        return std::isfinite(any) ? any : 1.0;
      }
      case 3: return std::ldexp(Sign() * Integer(0, 64), Integer(-6, 6));
      case 4: return std::ldexp(Uniform(-2, 2), Integer(-1074, -940));
      default: return std::ldexp(Uniform(-2, 2), Integer(-40, 40));
    }
  }

  /** Often a close relative of x, so that differences cancel. */
  double Near(double x) {
    switch (Below(6)) {
      case 0: return x;
      case 1: return -x;
      case 2: return std::nextafter(x, kMaxDouble);
      case 3: return -std::nextafter(x, -kMaxDouble);
      case 4: {
        const double scaled = x * Uniform(-2, 2);
        return std::isfinite(scaled) ? scaled : x;
      }
      default: return Double();
    }
  }

  Interval AnyInterval() {
    const double a = Double(), b = Near(a);
    return {std::min(a, b), std::max(a, b)};
  }

  Eigen::VectorXd Vector(int size, double scale = 1) {
    return Eigen::VectorXd::NullaryExpr(size, [&] { return Uniform(-scale, scale); });
  }
  Eigen::MatrixXd Matrix(int rows, int columns, double scale = 1) {
    return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return Uniform(-scale, scale); });
  }

  Zonotope AnyZonotope(int dim, int num_generators, double scale = 1) {
    return Zonotope(Vector(dim, scale), Matrix(dim, num_generators, scale));
  }

 private:
  std::uint64_t seed_ = 0;
  std::mt19937_64 engine_;
};

}  // namespace forereach
