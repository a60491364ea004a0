/** Closed intervals of reals with outward rounding: a result contains every value of the operation on points of its
operands.

A result computed from an interval that is not finite is not finite either, so a caller can check IsFinite once at the
end. `lower <= upper` always holds. There is no empty interval. */
#pragma once

#include <algorithm>
#include <cmath>

#include "forereach/numerics/directed.h"

FOREREACH_ARITHMETIC_BEGIN

namespace forereach {

struct Interval {
  double lower, upper;

  Interval() = default;
  constexpr Interval(double value) : lower(value), upper(value) {}  // NOLINT: a number is an interval
  constexpr Interval(double lower_bound, double upper_bound) : lower(lower_bound), upper(upper_bound) {}

  [[nodiscard]] static constexpr Interval Entire() { return {-kInfinity, kInfinity}; }

  [[nodiscard]] bool IsFinite() const { return lower > -kInfinity && upper < kInfinity; }
  [[nodiscard]] bool Contains(double x) const { return lower <= x && x <= upper; }

  /** A double in the interval: the midpoint up to rounding. */
  [[nodiscard]] double Middle() const {
    const double middle = lower / 2 + upper / 2;
    return std::clamp(middle, lower, upper);
  }
  /** An upper bound on |x - y| over all x in the interval. */
  [[nodiscard]] double DistanceUpper(double y) const { return std::max(SubUp(upper, y), SubUp(y, lower)); }
  /** An upper bound on half the width. */
  [[nodiscard]] double HalfWidthUpper() const { return AddUp(HalfUp(upper), HalfUp(-lower)); }
  /** The largest |x| over all x in the interval, exactly. */
  [[nodiscard]] double Magnitude() const { return std::max(std::abs(lower), std::abs(upper)); }

  Interval operator-() const { return {-upper, -lower}; }
  Interval& operator+=(const Interval& b) { return *this = *this + b; }

  friend Interval operator+(const Interval& a, const Interval& b) {
    return Checked(AddDown(a.lower, b.lower), AddUp(a.upper, b.upper));
  }
  friend Interval operator-(const Interval& a, const Interval& b) { return a + -b; }

  friend Interval operator*(const Interval& a, const Interval& b) {
    if (!a.IsFinite() || !b.IsFinite()) return Entire();
    if (a.lower >= 0) {
      return Checked(MulDown(b.lower >= 0 ? a.lower : a.upper, b.lower),
                     MulUp(b.upper >= 0 ? a.upper : a.lower, b.upper));
    }
    if (a.upper <= 0) return -(-a * b);
    if (b.lower >= 0 || b.upper <= 0) return b * a;
    return Checked(std::min(MulDown(a.lower, b.upper), MulDown(a.upper, b.lower)),
                   std::max(MulUp(a.lower, b.lower), MulUp(a.upper, b.upper)));
  }

  friend Interval operator/(const Interval& a, const Interval& b) {
    if (!a.IsFinite() || !b.IsFinite() || b.Contains(0)) return Entire();
    if (b.upper < 0) return -(a / -b);
    return Checked(DivDown(a.lower, a.lower >= 0 ? b.upper : b.lower),
                   DivUp(a.upper, a.upper >= 0 ? b.lower : b.upper));
  }

  friend bool operator==(const Interval&, const Interval&) = default;

 private:
  // Turns overflow and NaN into the entire line.
  static Interval Checked(double lower_bound, double upper_bound) {
    const Interval result(lower_bound, upper_bound);
    return lower_bound <= upper_bound ? result : Entire();
  }
};

/** The least interval that contains both. */
[[nodiscard]] inline Interval Join(const Interval& a, const Interval& b) {
  return {std::min(a.lower, b.lower), std::max(a.upper, b.upper)};
}

/** A result of the C library moved outward by two doubles. The exact value is within one unit in the last place of the
result (glibc's manual, "Known Maximum Errors"). */
[[nodiscard]] inline double WidenUp(double x) { return NextUp(NextUp(x)); }
[[nodiscard]] inline double WidenDown(double x) { return NextDown(NextDown(x)); }

/** {x^2}. */
[[nodiscard]] inline Interval sqr(const Interval& x) {
  if (!x.IsFinite()) return Interval::Entire();
  const double far = x.Magnitude();
  const double near = x.Contains(0) ? 0 : std::min(std::abs(x.lower), std::abs(x.upper));
  return {MulDown(near, near), MulUp(far, far)};
}

/** The true ranges, widened by the error bound of the C library's functions (elementary.cpp). sin and cos give [-1, 1]
if the argument is too large to reduce. tan gives [-inf, inf] if the interval may contain a pole. Arguments are in
radians. */
[[nodiscard]] Interval sin(const Interval& x);
[[nodiscard]] Interval cos(const Interval& x);
[[nodiscard]] Interval tan(const Interval& x);

}  // namespace forereach

FOREREACH_ARITHMETIC_END
