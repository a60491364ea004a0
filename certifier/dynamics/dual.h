/** Forward second-order differentiation: a number that carries its first and second derivatives with respect to the
D variables of z, over any scalar T (double, Interval).

Derivatives that are zero because of how the expression is built are not stored as numbers: bit masks say which exist.
So an affine expression has no second derivatives at all, and a sparse one costs what its non-zeros cost. */
#pragma once

#include <array>
#include <bit>
#include <bitset>
#include <cmath>
#include <cstdint>

#include "certifier/numerics/interval.h"

namespace forereach {

/** Value, derivative and second derivative of a function of one variable, tan(x) and so on, at x. */
template <class T>
struct UnaryJet {
  T value, first, second;
};

inline double sqr(double x) { return x * x; }

template <class T, int D, bool WithHessian = true>
class Dual {
 public:
  using Pairs = std::bitset<D*(D + 1) / 2>;

  Dual() = default;
  Dual(double constant) : value_(constant) {}  // NOLINT: a number is a constant expression

  /** The variable z_index, equal to `value`. */
  [[nodiscard]] static Dual Variable(T value, int index) {
    Dual x;
    x.value_ = value;
    x.active_ = 1u << index;
    x.gradient_[static_cast<std::size_t>(index)] = T(1);
    return x;
  }

  [[nodiscard]] const T& value() const { return value_; }
  [[nodiscard]] bool HasGradient(int i) const { return active_ >> i & 1u; }
  [[nodiscard]] const T& gradient(int i) const { return gradient_[static_cast<std::size_t>(i)]; }
  [[nodiscard]] bool HasHessian(int i, int j) const { return curved_[Pair(i, j)]; }
  [[nodiscard]] const T& hessian(int i, int j) const { return hessian_[Pair(i, j)]; }

  friend Dual operator+(const Dual& a, const Dual& b) {
    Dual sum = a;
    sum.value_ = a.value_ + b.value_;
    ForEachBit(b.active_, [&](int i) { sum.AddGradient(i, b.gradient(i)); });
    if constexpr (WithHessian) b.ForEachPair([&](int i, int j) { sum.AddHessian(i, j, b.hessian(i, j)); });
    return sum;
  }

  friend Dual operator-(const Dual& a) { return a.Apply({-a.value_, T(-1), T(0)}, false); }
  friend Dual operator-(const Dual& a, const Dual& b) { return a + -b; }

  friend Dual operator*(const Dual& a, const Dual& b) {
    Dual product;
    product.value_ = a.value_ * b.value_;
    ForEachBit(a.active_, [&](int i) { product.AddGradient(i, a.gradient(i) * b.value_); });
    ForEachBit(b.active_, [&](int i) { product.AddGradient(i, b.gradient(i) * a.value_); });
    if constexpr (WithHessian) {
      a.ForEachPair([&](int i, int j) { product.AddHessian(i, j, a.hessian(i, j) * b.value_); });
      b.ForEachPair([&](int i, int j) { product.AddHessian(i, j, b.hessian(i, j) * a.value_); });
      ForEachBit(a.active_, [&](int i) {
        ForEachBit(b.active_, [&](int j) {
          const T cross = a.gradient(i) * b.gradient(j);
          product.AddHessian(i, j, i == j ? cross + cross : cross);
        });
      });
    }
    return product;
  }

  friend Dual operator/(const Dual& a, const Dual& b) {
    const T inverse = T(1) / b.value_;
    const T square = inverse * inverse;
    return a * b.Apply({inverse, -square, T(2) * square * inverse});
  }

  friend Dual sin(const Dual& x) {
    using std::cos, std::sin;
    const T s = sin(x.value_), c = cos(x.value_);
    return x.Apply({s, c, -s});
  }
  friend Dual cos(const Dual& x) {
    using std::cos, std::sin;
    const T s = sin(x.value_), c = cos(x.value_);
    return x.Apply({c, -s, -c});
  }
  friend Dual tan(const Dual& x) {
    using std::tan;
    const T t = tan(x.value_);
    return x.Apply({t, T(1) + sqr(t), TanSecond(t)});
  }

 private:
  static constexpr std::size_t Pair(int i, int j) {
    const int low = i < j ? i : j, high = i < j ? j : i;
    return static_cast<std::size_t>(high * (high + 1) / 2 + low);
  }

  template <class Visit>
  static void ForEachBit(std::uint32_t mask, Visit visit) {
    for (; mask != 0; mask &= mask - 1) visit(std::countr_zero(mask));
  }

  template <class Visit>
  void ForEachPair(Visit visit) const {
    if (curved_.none()) return;
    ForEachBit(active_, [&](int i) {
      ForEachBit(active_, [&](int j) {
        if (i <= j && HasHessian(i, j)) visit(i, j);
      });
    });
  }

  // 2 t (1 + t^2) increases in t: over an interval the ends span it.
  static double TanSecond(double t) { return 2 * t * (1 + t * t); }
  static Interval TanSecond(const Interval& t) {
    if (!t.IsFinite()) return Interval::Entire();
    const auto at = [](double end) { return Interval(2) * Interval(end) * (Interval(1) + sqr(Interval(end))); };
    return {at(t.lower).lower, at(t.upper).upper};
  }

  void AddGradient(int i, const T& derivative) {
    T& slot = gradient_[static_cast<std::size_t>(i)];
    slot = HasGradient(i) ? slot + derivative : derivative;
    active_ |= 1u << i;
  }

  void AddHessian(int i, int j, const T& derivative) {
    const std::size_t pair = Pair(i, j);
    hessian_[pair] = curved_[pair] ? hessian_[pair] + derivative : derivative;
    curved_[pair] = true;
  }

  // The chain rule.
  Dual Apply(const UnaryJet<T>& f, bool curved = true) const {
    Dual result;
    result.value_ = f.value;
    ForEachBit(active_, [&](int i) { result.AddGradient(i, f.first * gradient(i)); });
    if constexpr (WithHessian) {
      ForEachPair([&](int i, int j) { result.AddHessian(i, j, f.first * hessian(i, j)); });
      if (curved) {
        ForEachBit(active_, [&](int i) {
          ForEachBit(active_, [&](int j) {
            if (i <= j) result.AddHessian(i, j, f.second * gradient(i) * gradient(j));
          });
        });
      }
    }
    return result;
  }

  T value_{};
  std::uint32_t active_ = 0;
  Pairs curved_;
  std::array<T, D> gradient_;                  // entry i is set where bit i of active_ is
  std::array<T, D*(D + 1) / 2> hessian_;       // entry p is set where bit p of curved_ is
};

}  // namespace forereach
