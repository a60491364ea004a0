#include "verifier/real.h"

#include <array>
#include <limits>

namespace forereach::verifier {

thread_local int Precision::bits_ = 256;

namespace {

// Numbers come and go by the million: a few are kept for the next, all of one precision. It has no constructor and no
// destructor of its own, since each use of a thread's object that has one asks first whether it was made.
struct Pool {
  static constexpr std::size_t kMost = 512;
  std::array<__mpfi_struct, kMost> numbers;
  std::size_t count;
  int bits;
  bool closed;  // a number may outlive its thread's pool

  void Clear() {
    while (count > 0) mpfi_clear(&numbers[--count]);
  }
};
constinit thread_local Pool pool{};

struct PoolCloser {
  ~PoolCloser() {
    pool.Clear();
    pool.closed = true;
    mpfr_free_cache2(MPFR_FREE_LOCAL_CACHE);  // the library's cache of this thread
  }
  void Use() {}  // so that there is one in this thread
};
thread_local PoolCloser pool_closer;

}  // namespace

Real::Real(Uninitialized) {
  const int bits = Precision::bits();
  if (pool.closed || pool.bits != bits || pool.count == 0)
    mpfi_init2(value_, bits);
  else
    *value_ = pool.numbers[--pool.count];
}

void Real::Release() {
  if (pool.closed) return mpfi_clear(value_);
  if (pool.bits != Precision::bits()) {
    pool_closer.Use();
    pool.Clear();
    pool.bits = Precision::bits();
  }
  if (pool.count == Pool::kMost || mpfi_get_prec(value_) != static_cast<mpfr_prec_t>(pool.bits))
    mpfi_clear(value_);
  else
    pool.numbers[pool.count++] = *value_;
}

Real::Real(double x) : Real(Uninitialized{}) { mpfi_set_d(value_, x); }
Real Real::Integer(std::int64_t n) {
  Real result{Uninitialized{}};
  mpfi_set_si(result.value_, n);
  return result;
}
Real Real::Pi() {
  Real result{Uninitialized{}};
  mpfi_const_pi(result.value_);
  return result;
}
Real::Real(const Real& other) : Real(Uninitialized{}) { mpfi_set(value_, other.value_); }
Real& Real::operator=(const Real& other) {
  if (this != &other) *this = Real(other);
  return *this;
}

Real Real::FromTo(const Real& a, const Real& b) {
  Real result{Uninitialized{}};
  mpfr_set(&result.value_->left, &a.value_->left, MPFR_RNDD);
  mpfr_set(&result.value_->right, &b.value_->right, MPFR_RNDU);
  return result;
}

Real Real::Everything() {
  Real result{Uninitialized{}};
  mpfr_set_inf(&result.value_->left, -1);
  mpfr_set_inf(&result.value_->right, 1);
  return result;
}

Real Real::lower() const {
  Real result{Uninitialized{}};
  mpfi_set_fr(result.value_, &value_->left);
  return result;
}
Real Real::upper() const {
  Real result{Uninitialized{}};
  mpfi_set_fr(result.value_, &value_->right);
  return result;
}
Real Real::middle() const {
  Real result{Uninitialized{}};
  mpfi_mid(&result.value_->left, value_);
  mpfr_set(&result.value_->right, &result.value_->left, MPFR_RNDU);
  return result;
}
Real Real::magnitude() const { return abs(*this).upper(); }

double Real::ToDouble(long shift) const {
  Real scaled{Uninitialized{}};
  if (shift >= 0)
    mpfi_mul_2exp(scaled.value_, value_, static_cast<unsigned long>(shift));
  else
    mpfi_div_2exp(scaled.value_, value_, static_cast<unsigned long>(-shift));
  return mpfi_get_d(scaled.value_);
}

long Real::exponent() const {
  const Real size = magnitude();
  if (size.IsZero()) return std::numeric_limits<long>::min();
  return size.IsFinite() ? mpfr_get_exp(&size.value_->right) : std::numeric_limits<long>::max();
}

std::string Real::text() const {
  if (!IsFinite()) return "no finite enclosure (a pole, the edge of a domain, or an angle of 2^16384 or more)";
  char digits[64];
  const Real number = middle();
  mpfr_snprintf(digits, sizeof digits, "%.17Rg", &number.value_->left);
  return digits;
}

Real& Real::operator+=(const Real& other) {
  mpfi_add(value_, value_, other.value_);
  return *this;
}
Real& Real::operator-=(const Real& other) {
  mpfi_sub(value_, value_, other.value_);
  return *this;
}

#define FOREREACH_BINARY(name, function)         \
  Real name(const Real& a, const Real& b) {      \
    Real result{Real::Uninitialized{}};          \
    function(result.value_, a.value_, b.value_); \
    return result;                               \
  }
#define FOREREACH_UNARY(name, function) \
  Real name(const Real& a) {            \
    Real result{Real::Uninitialized{}}; \
    function(result.value_, a.value_);  \
    return result;                      \
  }
FOREREACH_BINARY(operator+, mpfi_add)
FOREREACH_BINARY(operator-, mpfi_sub)
FOREREACH_BINARY(operator*, mpfi_mul)
FOREREACH_BINARY(operator/, mpfi_div)
FOREREACH_UNARY(operator-, mpfi_neg)
FOREREACH_UNARY(sqr, mpfi_sqr)
FOREREACH_UNARY(sqrt, mpfi_sqrt)
FOREREACH_UNARY(abs, mpfi_abs)
FOREREACH_UNARY(exp, mpfi_exp)
FOREREACH_UNARY(log1p, mpfi_log1p)
FOREREACH_UNARY(log, mpfi_log)
FOREREACH_UNARY(asin, mpfi_asin)
FOREREACH_UNARY(acos, mpfi_acos)
FOREREACH_UNARY(atan, mpfi_atan)
FOREREACH_UNARY(tanh, mpfi_tanh)
#undef FOREREACH_BINARY
#undef FOREREACH_UNARY
#define FOREREACH_OF_ANGLE(name, function)                                     \
  Real name(const Real& a) {                                                   \
    if (!(a.exponent() <= Real::kMaxAngleExponent)) return Real::Everything(); \
    Real result{Real::Uninitialized{}};                                        \
    function(result.value_, a.value_);                                         \
    return result;                                                             \
  }
FOREREACH_OF_ANGLE(sin, mpfi_sin)
FOREREACH_OF_ANGLE(cos, mpfi_cos)
FOREREACH_OF_ANGLE(tan, mpfi_tan)
#undef FOREREACH_OF_ANGLE

Real max(const Real& a, const Real& b) {
  Real result{Real::Uninitialized{}};
  mpfr_max(&result.value_->left, &a.value_->left, &b.value_->left, MPFR_RNDD);
  mpfr_max(&result.value_->right, &a.value_->right, &b.value_->right, MPFR_RNDU);
  return result;
}
Real min(const Real& a, const Real& b) {
  Real result{Real::Uninitialized{}};
  mpfr_min(&result.value_->left, &a.value_->left, &b.value_->left, MPFR_RNDD);
  mpfr_min(&result.value_->right, &a.value_->right, &b.value_->right, MPFR_RNDU);
  return result;
}

// Seen from a point outside, the directions to a box lie between those to its corners.
Real atan2(const Real& y, const Real& x) {
  const bool right = mpfr_sgn(&x.value_->left) > 0;
  const bool above = mpfr_sgn(&y.value_->left) > 0, below = mpfr_sgn(&y.value_->right) < 0;
  if (!x.IsFinite() || !y.IsFinite() || !(right || above || below)) return Real::Everything();
  const auto corner = [](const __mpfr_struct& height, const __mpfr_struct& width) {
    Real angle{Real::Uninitialized{}};
    mpfr_atan2(&angle.value_->left, &height, &width, MPFR_RNDD);
    mpfr_atan2(&angle.value_->right, &height, &width, MPFR_RNDU);
    return angle;
  };
  const __mpfi_struct &v = *y.value_, &h = *x.value_;
  const Real corners[] = {corner(v.left, h.left), corner(v.left, h.right), corner(v.right, h.left),
                          corner(v.right, h.right)};
  return Real::FromTo(min(min(corners[0], corners[1]), min(corners[2], corners[3])),
                      max(max(corners[0], corners[1]), max(corners[2], corners[3])));
}

Real power(const Real& a, int n) {
  if (n < 0) {
    const bool positive = mpfr_sgn(&a.value_->left) > 0, negative = mpfr_sgn(&a.value_->right) < 0;
    return positive || negative ? Real(1.0) / power(a, -n) : Real::Everything();
  }
  const Real base = n % 2 == 0 ? abs(a) : a;  // x^n increases with the base
  Real result{Real::Uninitialized{}};
  mpfr_pow_ui(&result.value_->left, &base.value_->left, static_cast<unsigned long>(n), MPFR_RNDD);
  mpfr_pow_ui(&result.value_->right, &base.value_->right, static_cast<unsigned long>(n), MPFR_RNDU);
  return result;
}

bool CertainlyAtMost(const Real& a, const Real& b) { return mpfr_lessequal_p(&a.value_->right, &b.value_->left) != 0; }
bool CertainlyBelow(const Real& a, const Real& b) { return mpfr_less_p(&a.value_->right, &b.value_->left) != 0; }

}  // namespace forereach::verifier
