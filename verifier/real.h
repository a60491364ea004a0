/** The verifier's arithmetic: a real number enclosed between two multiprecision numbers (MPFI).

The result of an operation is an interval that contains the exact result for all numbers in the operands. Exponents have
62 bits, so in practice no result overflows or is subnormal. */
#pragma once

#include <mpfi.h>

#include <cstdint>
#include <string>
#include <utility>

namespace forereach::verifier {

/** During its lifetime, this thread's new numbers have `bits` bits. The default is 256. */
class Precision final {
 public:
  explicit Precision(int bits) : before_(std::exchange(bits_, bits)) {}
  ~Precision() { bits_ = before_; }
  Precision(const Precision&) = delete;
  Precision& operator=(const Precision&) = delete;

  [[nodiscard]] static int bits() { return bits_; }

 private:
  static thread_local int bits_;
  int before_;
};

class Real final {
 public:
  Real() : Real(0.0) {}
  /** The point x, exactly. */
  Real(double x);  // NOLINT: as numbers do
  /** The point n, exactly. @pre Precision::bits() >= 64. */
  [[nodiscard]] static Real Integer(std::int64_t n);
  [[nodiscard]] static Real Pi();
  Real(const Real& other);
  Real(Real&& other) noexcept { *value_ = std::exchange(*other.value_, Empty()); }
  Real& operator=(const Real& other);
  Real& operator=(Real&& other) noexcept {
    std::swap(*value_, *other.value_);
    return *this;
  }
  ~Real() {
    if (value_->left._mpfr_d != nullptr) Release();
  }

  /** The interval from the lower end of a to the upper end of b. @pre a <= b. */
  [[nodiscard]] static Real FromTo(const Real& a, const Real& b);
  /** All real numbers: what is known of a number that has no finite enclosure. */
  [[nodiscard]] static Real Everything();

  /** The ends, as point intervals. */
  [[nodiscard]] Real lower() const;
  [[nodiscard]] Real upper() const;
  /** A point between the ends. */
  [[nodiscard]] Real middle() const;
  /** The largest absolute value. */
  [[nodiscard]] Real magnitude() const;

  [[nodiscard]] bool IsZero() const { return mpfi_is_zero(value_) > 0; }
  [[nodiscard]] bool IsFinite() const { return mpfi_bounded_p(value_) != 0; }
  /** The double nearest to the middle times 2^shift. Not a bound. */
  [[nodiscard]] double ToDouble(long shift = 0) const;
  /** The e with |x| < 2^e for the upper end of |x|; the least possible number for zero. */
  [[nodiscard]] long exponent() const;
  /** The middle in decimal with 17 digits; without a finite enclosure, a sentence that says so. */
  [[nodiscard]] std::string text() const;

  Real& operator+=(const Real& other);
  Real& operator-=(const Real& other);

  friend Real operator+(const Real& a, const Real& b);
  friend Real operator-(const Real& a, const Real& b);
  friend Real operator*(const Real& a, const Real& b);
  friend Real operator/(const Real& a, const Real& b);
  friend Real operator-(const Real& a);
  friend Real sqr(const Real& a);
  friend Real sqrt(const Real& a);
  friend Real abs(const Real& a);
  friend Real exp(const Real& a);
  /** log(1 + a). */
  friend Real log1p(const Real& a);
  friend Real log(const Real& a);
  /** Everything from 2^kMaxAngleExponent on: the work to reduce an angle grows with its exponent. tan: also over a
  pole. */
  static constexpr long kMaxAngleExponent = 16384;
  friend Real sin(const Real& a);
  friend Real cos(const Real& a);
  friend Real tan(const Real& a);
  friend Real asin(const Real& a);
  friend Real acos(const Real& a);
  friend Real atan(const Real& a);
  friend Real tanh(const Real& a);
  /** The angle of (x, y) in (-pi, pi). Everything if the box meets {y = 0, x <= 0}: there it jumps or is undefined. */
  friend Real atan2(const Real& y, const Real& x);
  /** a^n. Everything if n < 0 and a contains zero. */
  friend Real power(const Real& a, int n);
  /** The larger and the smaller of two numbers. */
  friend Real max(const Real& a, const Real& b);
  friend Real min(const Real& a, const Real& b);

  /** Whether every number in a is at most (below) every number in b. Then the exact numbers are too. */
  friend bool CertainlyAtMost(const Real& a, const Real& b);
  friend bool CertainlyBelow(const Real& a, const Real& b);

 private:
  struct Uninitialized {};
  explicit Real(Uninitialized);
  void Release();
  static __mpfi_struct Empty() { return {}; }

  mpfi_t value_;
};

/** Whether it holds one number. */
[[nodiscard]] inline bool IsPoint(const Real& range) { return CertainlyAtMost(range.upper(), range.lower()); }

}  // namespace forereach::verifier
