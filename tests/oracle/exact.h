/** Judges of the certifier's bounds: rational numbers (GMP), in which every finite double is exact, and 256-bit
floating point (MPFR) for what is not rational. */
#pragma once

#include <gmpxx.h>
#include <mpfr.h>

#include <cmath>
#include <limits>
#include <ostream>
#include <span>
#include <vector>

#include "forereach/numerics/interval.h"
#include "forereach/sets/zonotope.h"

namespace forereach::exact {

using Rational = mpq_class;

/** x <= bound and bound <= x, where the bound may be infinite; NaN bounds nothing. */
[[nodiscard]] inline bool AtMost(const Rational& x, double bound) {
  return std::isfinite(bound) ? x <= Rational(bound) : bound > 0;
}
[[nodiscard]] inline bool AtLeast(const Rational& x, double bound) {
  return std::isfinite(bound) ? x >= Rational(bound) : bound < 0;
}
[[nodiscard]] inline bool Inside(const Rational& x, const Interval& bounds) {
  return AtLeast(x, bounds.lower) && AtMost(x, bounds.upper);
}

/** The least double >= x; infinity above the largest double. */
[[nodiscard]] inline double Ceiling(const Rational& x) {
  if (x > Rational(kMaxDouble)) return kInfinity;
  if (x <= Rational(-kMaxDouble)) return -kMaxDouble;
  double bound = x.get_d();
  while (Rational(bound) < x) bound = std::nextafter(bound, kInfinity);
  while (bound > -kMaxDouble && Rational(std::nextafter(bound, -kInfinity)) >= x)
    bound = std::nextafter(bound, -kInfinity);
  return bound;
}
/** The largest double <= x. */
[[nodiscard]] inline double Floor(const Rational& x) { return -Ceiling(-x); }

/** A number of 256 bits; each operation rounds once, to nearest. */
class Real {
 public:
  Real() : Real(0.0) {}
  Real(double x) {  // NOLINT: as numbers do
    mpfr_init2(value_, 256);
    mpfr_set_d(value_, x, MPFR_RNDN);
  }
  explicit Real(const Rational& x) : Real() { mpfr_set_q(value_, x.get_mpq_t(), MPFR_RNDN); }
  Real(const Real& other) : Real() { mpfr_set(value_, other.value_, MPFR_RNDN); }
  Real& operator=(const Real& other) {
    mpfr_set(value_, other.value_, MPFR_RNDN);
    return *this;
  }
  ~Real() { mpfr_clear(value_); }

  friend Real operator+(const Real& a, const Real& b) { return Apply(mpfr_add, a, b); }
  friend Real operator-(const Real& a, const Real& b) { return Apply(mpfr_sub, a, b); }
  friend Real operator*(const Real& a, const Real& b) { return Apply(mpfr_mul, a, b); }
  friend Real operator/(const Real& a, const Real& b) { return Apply(mpfr_div, a, b); }
  friend Real operator-(const Real& a) { return Apply(mpfr_neg, a); }
  friend Real sin(const Real& a) { return Apply(mpfr_sin, a); }
  friend Real cos(const Real& a) { return Apply(mpfr_cos, a); }
  friend Real tan(const Real& a) { return Apply(mpfr_tan, a); }
  friend Real sqrt(const Real& a) { return Apply(mpfr_sqrt, a); }
  friend Real exp(const Real& a) { return Apply(mpfr_exp, a); }
  friend Real log(const Real& a) { return Apply(mpfr_log, a); }
  friend Real log1p(const Real& a) { return Apply(mpfr_log1p, a); }
  friend Real asin(const Real& a) { return Apply(mpfr_asin, a); }
  friend Real acos(const Real& a) { return Apply(mpfr_acos, a); }
  friend Real atan(const Real& a) { return Apply(mpfr_atan, a); }
  friend Real atan2(const Real& y, const Real& x) { return Apply(mpfr_atan2, y, x); }
  friend Real tanh(const Real& a) { return Apply(mpfr_tanh, a); }
  friend Real pow(const Real& a, int n) {
    Real result;
    mpfr_pow_si(result.value_, a.value_, n, MPFR_RNDN);
    return result;
  }
  friend Real abs(const Real& a) { return Apply(mpfr_abs, a); }
  Real& operator+=(const Real& b) {
    mpfr_add(value_, value_, b.value_, MPFR_RNDN);
    return *this;
  }

  friend bool operator<(const Real& a, const Real& b) { return mpfr_less_p(a.value_, b.value_) != 0; }
  friend bool operator<=(const Real& a, const Real& b) { return mpfr_lessequal_p(a.value_, b.value_) != 0; }
  friend bool operator>(const Real& a, const Real& b) { return b < a; }
  friend bool operator>=(const Real& a, const Real& b) { return b <= a; }
  friend bool operator==(const Real& a, const Real& b) { return mpfr_equal_p(a.value_, b.value_) != 0; }

  /** The nearest double. */
  [[nodiscard]] double ToDouble() const { return mpfr_get_d(value_, MPFR_RNDN); }
  [[nodiscard]] long double ToLongDouble() const { return mpfr_get_ld(value_, MPFR_RNDN); }
  [[nodiscard]] static Real Pi() {
    Real pi;
    mpfr_const_pi(pi.value_, MPFR_RNDN);
    return pi;
  }

  friend std::ostream& operator<<(std::ostream& out, const Real& x) { return out << x.ToDouble(); }

 private:
  template <class Function>
  static Real Apply(Function f, const Real& a, const Real& b) {
    Real result;
    f(result.value_, a.value_, b.value_, MPFR_RNDN);
    return result;
  }
  template <class Function>
  static Real Apply(Function f, const Real& a) {
    Real result;
    f(result.value_, a.value_, MPFR_RNDN);
    return result;
  }

  mpfr_t value_;
};

[[nodiscard]] inline bool Inside(const Real& x, const Interval& bounds) {
  return Real(bounds.lower) <= x && x <= Real(bounds.upper);
}

/** max {d . z : z in Z}. */
[[nodiscard]] inline Rational Support(const Zonotope& set, std::span<const double> direction) {
  Rational value = 0;
  for (int k = 0; k < set.dim(); ++k)
    value += Rational(direction[static_cast<std::size_t>(k)]) * Rational(set.center(k));
  for (int j = 0; j < set.num_generators(); ++j) {
    Rational along = 0;
    for (int k = 0; k < set.dim(); ++k)
      along += Rational(direction[static_cast<std::size_t>(k)]) * Rational(set.generator(k, j));
    value += abs(along);
  }
  for (int k = 0; k < set.dim(); ++k)
    value += abs(Rational(direction[static_cast<std::size_t>(k)])) * Rational(set.slack(k));
  return value;
}

/** sum_j |G_kj| + s_k. */
[[nodiscard]] inline Rational HalfWidth(const Zonotope& set, int k) {
  Rational sum(set.slack(k));
  for (const double g : set.row(k)) sum += abs(Rational(g));
  return sum;
}

}  // namespace forereach::exact

namespace forereach {

using exact::Rational, exact::Real, exact::AtLeast, exact::AtMost, exact::Ceiling, exact::Floor, exact::Inside;

}  // namespace forereach
