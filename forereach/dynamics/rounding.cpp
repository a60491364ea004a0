#include "forereach/dynamics/rounding.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "forereach/dynamics/evaluate.h"
#include "forereach/numerics/size.h"

namespace forereach {
namespace {

constexpr double kHalfUlp = kUnitRoundoff, kSubnormal = 0x1p-1070;

// Twice the error of one rounding, since `size` is that of the exact value. docs/soundness.md, 3.3, derives the bounds
// of this file.
double Rounding(double size) { return AddUp(MulUp(size, 2 * kHalfUlp), kSubnormal); }

double FiniteOrInfinity(double error) { return error < kInfinity ? error : kInfinity; }

// Error bounds of one node, at a point and over a box.
struct Error {
  double point = 0, box = 0;

  template <class Bound>
  static Error Each(const Error& a, Bound bound) {
    return {bound(a.point), bound(a.box)};
  }
  template <class Bound>
  static Error Both(const Error& a, const Error& b, Bound bound) {
    return {bound(a.point, b.point), bound(a.box, b.box)};
  }
};

class Analysis {
 public:
  Analysis(const Program& program, std::span<const double> parameters, std::span<const Interval> domain)
      : program_(program), range_(ToSize(program.size)), error_(range_.size()) {
    const std::vector<unsigned char> all(range_.size(), 1);
    Evaluate<Interval>(program, all, parameters, domain, std::span(range_));
    for (int i = 0; i < program.size; ++i)
      error_[ToSize(i)] = Error::Each(ErrorOf(program.node(i)), [](double error) { return FiniteOrInfinity(error); });
  }

  [[nodiscard]] const Error& error(int node) const { return error_[ToSize(node)]; }
  /** The largest exact absolute value over the domain. */
  [[nodiscard]] double Size(int node) const { return range_[ToSize(node)].Magnitude(); }

 private:
  [[nodiscard]] Error ErrorOf(const Operation& n) const {
    const double infinity = kInfinity;
    switch (n.op) {
      case Op::kVariable:  // the ends of a hull, center +- half-width, are rounded
        return {0, Rounding(range_[ToSize(n.a)].Magnitude())};
      case Op::kParameter:
      case Op::kConstant: return {};
      case Op::kNegate: return error(n.a);
      case Op::kAdd:
      case Op::kSubtract: {
        const double size = AddUp(Size(n.a), Size(n.b));
        return Error::Both(error(n.a), error(n.b), [&](double a, double b) {
          const double errors = AddUp(a, b);
          return AddUp(errors, Rounding(AddUp(size, errors)));
        });
      }
      case Op::kMultiply:
        return Error::Both(error(n.a), error(n.b),
                           [&](double a, double b) { return Product(Size(n.a), a, Size(n.b), b); });
      case Op::kSquare:
      case Op::kSignedSquare:
        return Error::Both(error(n.a), error(n.a),
                           [&](double a, double b) { return Product(Size(n.a), a, Size(n.a), b); });
      case Op::kDivide:
        return Error::Both(error(n.a), error(n.b), [&](double a, double b) { return Quotient(n.a, a, n.b, b); });
      case Op::kSin:
      case Op::kCos: {
        // Both are 1-Lipschitz; the C library's are within an ulp; a range takes some ten operations on numbers <= 1
        // and the width of its argument.
        if (!(Size(n.a) <= 0x1p20)) return {infinity, infinity};
        return {AddUp(error(n.a).point, 0x1p-50), AddUp(AddUp(error(n.a).box, Rounding(4 * Size(n.a))), 0x1p-46)};
      }
      case Op::kTan: {
        const double t = range_[ToSize(&n - program_.nodes.data())].Magnitude();
        // The slope bounds the effect of the angle's error only if that error is small.
        if (!(Size(n.a) <= 0x1p20 && t < 0x1p10 && error(n.a).point <= 0x1p-30 && error(n.a).box <= 0x1p-30))
          return {infinity, infinity};
        // The slope is 1 + t^2. At a point, tan is sine over cosine, and the cosine is at least 1 / sqrt(1 + t^2). Over
        // a box it is a quotient of numbers of size (1 + t)^2 with a denominator of the same size.
        const double slope = AddUp(1, MulUp(t, t)), wide = MulUp(MulUp(1 + t, 1 + t), MulUp(slope, 4));
        const double turns = AddUp(error(n.a).box, Rounding(4 * Size(n.a)));
        return {AddUp(MulUp(MulUp(2, slope), error(n.a).point), MulUp(wide, 0x1p-50)),
                AddUp(MulUp(wide, turns), MulUp(wide, 0x1p-44))};
      }
      case Op::kTanCurvature: {  // slope 2 + 6 t^2
        const double t = AddUp(Size(n.a), error(n.a).box), slope = AddUp(2, MulUp(6, MulUp(t, t)));
        return {infinity, AddUp(MulUp(slope, error(n.a).box), Rounding(MulUp(4 * t, slope)))};
      }
      case Op::kPower:
        return Smooth(n, kUnits + 2.0 * std::abs(n.b),
                      [&](const Interval& a) { return Interval(n.b) * pow(a, n.b - 1); });
      case Op::kSqrt: return Smooth(n, kUnits, [](const Interval& a) { return Interval(0.5) / sqrt(a); });
      case Op::kExp: return Smooth(n, kUnits, [](const Interval& a) { return exp(a); });
      case Op::kLog: return Smooth(n, kUnits, [](const Interval& a) { return Interval(1) / a; });
      case Op::kAsin:
      case Op::kAcos:
        return Smooth(n, kUnits, [](const Interval& a) { return Interval(1) / sqrt(Interval(1) - sqr(a)); });
      case Op::kAtan: return Smooth(n, kUnits, [](const Interval& a) { return Interval(1) / (Interval(1) + sqr(a)); });
      case Op::kTanh: return Smooth(n, kUnits, [](const Interval& a) { return Interval(1) - sqr(tanh(a)); });
      case Op::kAtan2:
        return Error::Both(error(n.a), error(n.b), [&](double a, double b) {
          const Interval y = Widened(n.a, a), x = Widened(n.b, b);
          if (!cut(y, x).IsFinite()) return infinity;
          return WithUnits(n, Moved(Interval(1) / sqrt(sqr(x) + sqr(y)), AddUp(a, b)), kUnits);
        });
      case Op::kAbs: return error(n.a);
      case Op::kMin:
      case Op::kMax: return Error::Both(error(n.a), error(n.b), [](double a, double b) { return std::max(a, b); });
      case Op::kSign:
      case Op::kStep:
      case Op::kKink:  // exact where no rounding carries the operand to the kink
        return Error::Each(error(n.a), [&](double a) { return kink(Widened(n.a, a)).IsFinite() ? 0 : infinity; });
      case Op::kSlopeOfAbs: return {infinity, error(n.a).box <= kNearZero ? 0 : infinity};
      case Op::kCut:
        return Error::Both(error(n.a), error(n.b), [&](double a, double b) {
          return cut(Widened(n.a, a), Widened(n.b, b)).IsFinite() ? 0 : infinity;
        });
      case Op::kSoftplus:
      case Op::kSmoothGate: break;
    }
    return {infinity, infinity};
  }

  // Units in the last place of the result by which a function may be off: at most 3 at a point, where it is the C
  // library's, and 11 over a box, where its ends are moved outward.
  static constexpr double kUnits = 16;

  // All that an operand with this error may be.
  [[nodiscard]] Interval Widened(int node, double error) const {
    return range_[ToSize(node)] + Interval(-error, error);
  }

  static double Moved(const Interval& slope, double error) { return error == 0 ? 0 : MulUp(slope.Magnitude(), error); }

  // The error of a result that is off by `moved` and then by so many units in the last place.
  [[nodiscard]] double WithUnits(const Operation& n, double moved, double units) const {
    const double size = range_[ToSize(&n - program_.nodes.data())].Magnitude();
    return AddUp(moved, MulUp(units, Rounding(AddUp(size, moved))));
  }

  // A differentiable function: by the mean-value theorem, over all that its operand may be.
  template <class Slope>
  [[nodiscard]] Error Smooth(const Operation& n, double units, Slope slope) const {
    return Error::Each(error(n.a), [&](double a) { return WithUnits(n, Moved(slope(Widened(n.a, a)), a), units); });
  }

  static double Product(double size_a, double a, double size_b, double b) {
    const double across = AddUp(AddUp(MulUp(size_a, b), MulUp(size_b, a)), MulUp(a, b));
    return AddUp(across, Rounding(MulUp(AddUp(size_a, a), AddUp(size_b, b))));
  }

  // |a~ / b~ - a / b| <= (a + |a / b| b) / |b~|, with the plain quotient made of two roundings.
  [[nodiscard]] double Quotient(int numerator, double a, int denominator, double b) const {
    const Interval& divisor = range_[ToSize(denominator)];
    if (divisor.Contains(0)) return kInfinity;
    const double smallest = SubDown(std::min(std::abs(divisor.lower), std::abs(divisor.upper)), b);
    if (!(smallest > 0)) return kInfinity;
    const double quotient = DivUp(AddUp(Size(numerator), a), smallest);
    return AddUp(AddUp(DivUp(a, smallest), DivUp(MulUp(quotient, b), smallest)), Rounding(MulUp(4, quotient)));
  }

  const Program& program_;
  std::vector<Interval> range_;
  std::vector<Error> error_;
};

}  // namespace

ExpansionError ExpansionError::None(const Program& program) {
  ExpansionError error;
  std::fill_n(error.value.begin(), program.states, kInfinity);
  for (auto* of_first : {&error.jacobian, &error.jacobian_size})
    std::fill_n(of_first->begin(), program.num_first, kInfinity);
  std::fill_n(error.hessian.begin(), program.num_second, kInfinity);
  return error;
}

ExpansionError BoundExpansionError(const Program& program, std::span<const double> parameters,
                                   std::span<const Interval> domain) {
  const Analysis analysis(program, parameters, domain);
  ExpansionError error;
  for (std::size_t k = 0; k < ToSize(program.states); ++k) error.value[k] = analysis.error(program.value[k]).point;
  for (std::size_t e = 0; e < ToSize(program.num_first); ++e) {
    error.jacobian[e] = analysis.error(program.jacobian[e].node).point;
    error.jacobian_size[e] = AddUp(analysis.Size(program.jacobian[e].node), error.jacobian[e]);
  }
  for (std::size_t e = 0; e < ToSize(program.num_second); ++e)
    error.hessian[e] = analysis.error(program.hessian[e].node).box;
  return error;
}

// Inlined operations: each step by intervals calls it.
[[gnu::flatten]] StepError BoundStepError(const Program& program, const ExpansionError& error,
                                          std::span<const double> half_width) noexcept {
  constexpr double kUnderflow = 0x1p-1050;
  const double of_exact = MulUp(1 + 0x1p-44, kUnderflow);
  StepError step;  // its lists are long: only what the program lists is set
  step.value = error.value;
  std::array<int, kMaxStates> entries{};
  std::array<bool, kMaxStates> copies{};
  const auto is_state = [&](const Program::First& entry) { return entry.column < program.states; };
  for (std::size_t e = 0; e < ToSize(program.num_first); ++e) {
    const Program::First& entry = program.jacobian[e];
    if (!is_state(entry)) continue;
    const auto k = ToSize(entry.row);
    copies[k] = entries[k]++ == 0 && entry.is_one;
  }
  for (std::size_t e = 0; e < ToSize(program.num_first); ++e) {
    const Program::First& entry = program.jacobian[e];
    const auto k = ToSize(entry.row);
    if (!is_state(entry) || copies[k]) continue;
    const double gamma = (2.0 * entries[k] + 2) * kUnitRoundoff;
    const double off = AddUp(error.jacobian[e], MulUp(gamma, error.jacobian_size[e]));
    step.image[k] = AddUp(AddUp(step.image[k], MulUp(off, half_width[ToSize(entry.column)])), kUnderflow);
  }
  for (std::size_t e = 0; e < ToSize(program.num_second); ++e) {
    step.remainder[e] = of_exact;
    if (error.hessian[e] == 0) continue;
    const Program::Second& entry = program.hessian[e];
    const double product = MulUp(half_width[ToSize(entry.row)], half_width[ToSize(entry.column)]);
    step.remainder[e] = MulUp(1 + 0x1p-44, AddUp(MulUp(error.hessian[e], product), kUnderflow));
  }
  return step;
}

}  // namespace forereach
