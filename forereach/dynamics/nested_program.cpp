#include "forereach/dynamics/nested_program.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <compare>
#include <tuple>

#include "forereach/dynamics/evaluate.h"
#include "forereach/dynamics/expand.h"
#include "forereach/numerics/interval_pair.h"
#include "forereach/numerics/size.h"

FOREREACH_ARITHMETIC_BEGIN

namespace forereach {
namespace {

bool IsGiven(Op op) { return op == Op::kVariable || op == Op::kParameter || op == Op::kConstant; }

bool IsAngleFunction(Op op) { return op == Op::kSin || op == Op::kCos || op == Op::kTan; }

// Two nodes over the outer box, or one over both.
template <bool kNested>
FOREREACH_INLINE Lanes LoadPair(const double* values, int one, int other) {
  if constexpr (kNested) return LoadLanes(values + one);
  return Lanes{values[one], values[one + 1], values[other], values[other + 1]};
}

struct Tangent {
  double value, error;
};

// Of a sine and a cosine that are each off by at most `off`, less than half the cosine.
Tangent TangentOf(double sine, double cosine, double off) {
  const double value = sine / cosine, size = std::abs(value);
  return {value, off * (1 + size) / (std::abs(cosine) - off) * (1 + 0x1p-40) + size * 0x1p-51};
}

// Sine, cosine and tangent over an interval that holds `center` or is next to it, from their values there: to[0] and
// to[1] of each. docs/soundness.md, 3.3, bounds what is added.
void Turn(const Interval& x, double center, double s, double c, double size, double* sine, double* cosine,
          double* tangent) noexcept {
  const auto store = [](double lower, double upper, double* to) {
    to[0] = std::min(-lower, 1.0);
    to[1] = std::min(upper, 1.0);
  };
  const auto store_tangent = [&](const Tangent& lower, const Tangent& upper) {
    if (tangent == nullptr) return;
    tangent[0] = lower.error - lower.value;
    tangent[1] = upper.error + upper.value;
  };
  const Tangent none{0, kInfinity};
  const double reach = std::max(x.upper - center, center - x.lower);
  if (reach <= 0x1p-40) {  // no point is further away
    const double off = reach + 0x1p-50;
    store(s - off, s + off, sine);
    store(c - off, c + off, cosine);
    const Tangent t = std::abs(c) > 2 * off ? TangentOf(s, c, off) : none;
    return store_tangent(t, t);
  }
  const internal::Wave wave(s, c, internal::Turns(center, {x.lower, x.upper}));
  const double off = 0x1p-46 + size * 0x1p-50;
  const PlainInterval sines = wave.SineRange(), cosines = wave.CosineRange();
  store(sines.lower - off, sines.upper + off, sine);
  store(cosines.lower - off, cosines.upper + off, cosine);
  if (cosines.lower > 2 * off || cosines.upper < -2 * off)  // no pole: the tangent increases from one end to the other
    store_tangent(TangentOf(wave.sines[0], wave.cosines[0], off), TangentOf(wave.sines[1], wave.cosines[1], off));
  else
    store_tangent(none, none);
}

// The same over both boxes, with one call of the library.
void Turn(const double* angle, double* sine, double* tangent) noexcept {
  double* const cosine = sine + kLaneCount;
  const Interval inner = LoadInterval(angle), outer = LoadInterval(angle + 2);
  if (BitsOf(Abs(LoadLanes(angle)) <= AllLanes(0x1p20)) != 15) {  // also where one of four is no number
    std::fill_n(sine, 2 * kLaneCount, 1.0);
    if (tangent != nullptr) std::fill_n(tangent, kLaneCount, kInfinity);
    return;
  }
  const double size = std::max(inner.Magnitude(), outer.Magnitude());
  // In both; in the inner one also where the outer one has no bound, and may be anything.
  const double center =
      std::clamp(std::clamp(inner.Middle(), outer.lower, std::max(outer.lower, outer.upper)), inner.lower, inner.upper);
  const double s = std::sin(center), c = std::cos(center);
  Turn(inner, center, s, c, size, sine, cosine, tangent);
  Turn(outer, center, s, c, size, sine + 2, cosine + 2, tangent == nullptr ? nullptr : tangent + 2);
}

// The functions of interval.h and elementary.h.
Interval RangeOfFunction(Op op, const Interval& a, const Interval& b, int exponent) noexcept {
  switch (op) {
    case Op::kPower: return pow(a, exponent);
    case Op::kSqrt: return sqrt(a);
    case Op::kExp: return exp(a);
    case Op::kLog: return log(a);
    case Op::kAsin: return asin(a);
    case Op::kAcos: return acos(a);
    case Op::kAtan: return atan(a);
    case Op::kAtan2: return atan2(a, b);
    case Op::kTanh: return tanh(a);
    case Op::kAbs: return abs(a);
    case Op::kMin: return min(a, b);
    case Op::kMax: return max(a, b);
    case Op::kSign:
    case Op::kSlopeOfAbs: return sign(a);
    case Op::kStep: return step(a);
    case Op::kKink: return kink(a);
    case Op::kCut: return cut(a, b);
    case Op::kSoftplus: return Softplus(a, b);
    case Op::kSmoothGate: return SmoothGate(a);
    default: return Interval::Entire();
  }
}

}  // namespace

NestedProgram::NestedProgram(const Program& program, std::span<const Interval> parameters) {
  const std::vector<unsigned char> needed = Choose(program);
  place_.assign(needed.size(), -1);
  given_at_ = size_ = 4 * ToSize(program.variables);
  for (std::size_t i = 0; i < needed.size(); ++i) {
    const Operation& n = program.nodes[i];
    if (!IsGiven(n.op)) continue;
    is_nested_[i] = 1;
    if (n.op == Op::kVariable) {
      place_[i] = 4 * n.a;
      continue;
    }
    place_[i] = Take(4);
    const Interval value = n.op == Op::kParameter ? parameters[ToSize(n.a)] : Interval(n.constant);
    given_.insert(given_.end(), {-value.lower, value.upper, -value.lower, value.upper});
    given_is_moderate_ = given_is_moderate_ && value.Magnitude() < kModerate;
  }
  Arrange(program, needed, true, nested_);
  Arrange(program, needed, false, outer_);
}

int NestedProgram::Take(std::size_t count) {
  size_ += count;
  return static_cast<int>(size_ - count);
}

// The nodes that are needed; and in is_nested_ those over both boxes: what values and first derivatives need, and the
// functions of an angle with what they need.
std::vector<unsigned char> NestedProgram::Choose(const Program& program) {
  is_nested_.assign(ToSize(program.size), 0);
  for (const int node : program.value) is_nested_[ToSize(node)] = 1;
  for (const Program::First& entry : program.jacobian) is_nested_[ToSize(entry.node)] = 1;
  std::vector<unsigned char> needed = is_nested_;
  for (const Program::Second& entry : program.hessian) needed[ToSize(entry.node)] = 1;
  MarkOperands(program.nodes, needed);
  for (std::size_t i = 0; i < needed.size(); ++i) {
    const Operation& n = program.nodes[i];
    if (needed[i] == 0 || !IsAngleFunction(n.op)) continue;
    const std::size_t sine = n.op == Op::kSin ? i : ToSize(n.b);
    for (const std::size_t together : {i, sine, sine + 1}) needed[together] = is_nested_[together] = 1;
  }
  MarkOperands(program.nodes, is_nested_);
  return needed;
}

// Orders the nodes by how many operations on these nodes one behind the other they need, then by operation.
void NestedProgram::Arrange(const Program& program, std::span<const unsigned char> needed, bool nested,
                            std::vector<Run>& runs) {
  struct Item {
    int level;
    Op op;
    int exponent, node;
    auto operator<=>(const Item&) const = default;
  };
  std::vector<int> level(needed.size(), 0), tangent(needed.size(), -1);
  std::vector<Item> items;
  for (std::size_t i = 0; i < needed.size(); ++i) {
    const Operation& n = program.nodes[i];
    if (needed[i] == 0 || IsGiven(n.op) || (is_nested_[i] != 0) != nested) continue;
    level[i] = 1 + std::max(level[ToSize(n.a)], n.has_second() ? level[ToSize(n.b)] : 0);
    if (n.op == Op::kTan) tangent[ToSize(n.b)] = static_cast<int>(i);
    if (n.op != Op::kTan && n.op != Op::kCos)
      items.push_back({level[i], n.op, n.op == Op::kPower ? n.b : 0, static_cast<int>(i)});
  }
  std::ranges::sort(items);
  const std::size_t width = nested ? 4 : 2;
  for (auto item = items.begin(); item != items.end();) {
    const auto end = std::find_if(item, items.end(), [&](const Item& other) {
      return std::tuple(other.level, other.op, other.exponent) != std::tuple(item->level, item->op, item->exponent);
    });
    Run run{item->op, item->exponent, static_cast<int>(operands_.size()), 0, static_cast<int>(size_)};
    const auto first = item;
    for (; item != end; ++item) {
      const auto i = ToSize(item->node);
      place_[i] = Take(width);
      if (item->op == Op::kSin) place_[i + 1] = Take(width);
    }
    for (const Item& one : std::span(first, end)) {
      const auto i = ToSize(one.node);
      const Operation& n = program.nodes[i];
      const auto place_of = [&](int node) { return nested ? PairPlace(node) : OuterPlace(node); };
      int other = -1;
      if (n.op != Op::kSin)
        other = place_of(n.has_second() ? n.b : n.a);
      else if (tangent[i] >= 0)
        other = place_[ToSize(tangent[i])] = Take(width);
      operands_.push_back({place_of(n.a), other});
    }
    if (!nested && (end - first) % 2 != 0) {  // the last one once more
      operands_.push_back(operands_.back());
      Take(width);
    }
    run.last = static_cast<int>(operands_.size());
    runs.push_back(run);
  }
}

void NestedProgram::Begin(double* values) const noexcept { std::ranges::copy(given_, values + given_at_); }

template <bool kNested>
LaneMask NestedProgram::EvaluateRuns(const std::vector<Run>& runs, double* values) const noexcept {
  constexpr int kStep = kNested ? 1 : 2;  // nodes in a vector
  LaneMask is_moderate = AllLanes(0) == AllLanes(0);
  for (const Run& run : runs) {
    double* to = values + run.place;
    const auto each = [&](auto operate) __attribute__((always_inline)) {
      const Operands* const last = operands_.data() + run.last;
      for (const Operands* o = operands_.data() + run.first; o != last; o += kStep, to += kLaneCount) {
        const Lanes x = operate(LoadPair<kNested>(values, o[0].a, o[kStep - 1].a),
                                LoadPair<kNested>(values, o[0].b, o[kStep - 1].b));
        is_moderate &= IsModerate(x);
        StoreLanes(x, to);
      }
    };
    switch (run.op) {
      case Op::kAdd:
        each([](const Lanes& a, const Lanes& b) __attribute__((always_inline)) { return Plus(a, b); });
        break;
      case Op::kSubtract:
        each([](const Lanes& a, const Lanes& b) __attribute__((always_inline)) { return Plus(a, Swapped(b)); });
        break;
      case Op::kMultiply:
        each([](const Lanes& a, const Lanes& b) __attribute__((always_inline)) { return Times(a, b); });
        break;
      case Op::kDivide:
        each([](const Lanes& a, const Lanes& b) __attribute__((always_inline)) { return Times(a, Reciprocal(b)); });
        break;
      case Op::kNegate:
        each([](const Lanes& a, const Lanes&) __attribute__((always_inline)) { return Swapped(a); });
        break;
      case Op::kSquare:
        each([](const Lanes& a, const Lanes&) __attribute__((always_inline)) { return SquareOf(a); });
        break;
      case Op::kSignedSquare:  // increasing and odd, as is the next
        each([](const Lanes& a, const Lanes&) __attribute__((always_inline)) { return ProductUp(a * Abs(a)); });
        break;
      case Op::kTanCurvature:
        each([](const Lanes& a, const Lanes&) __attribute__((always_inline)) {
          return ProductUp(AllLanes(2) * a * (AllLanes(1) + a * a), 0x1p-50);
        });
        break;
      case Op::kSin:
        for (int i = run.first; i < run.last; ++i, to += 2 * kLaneCount) {
          const Operands& o = operands_[ToSize(i)];
          double* const tangent = o.b < 0 ? nullptr : values + o.b;
          Turn(values + o.a, to, tangent);
          if (tangent != nullptr) is_moderate &= IsModerate(LoadLanes(tangent));
        }
        break;
      default:
        each([&](const Lanes& a, const Lanes& b) __attribute__((always_inline)) {
          std::array<double, kLaneCount> x, y;
          StoreLanes(a, x.data());
          StoreLanes(b, y.data());
          const auto range = [&](std::size_t i) {
            return RangeOfFunction(run.op, LoadInterval(&x[i]), LoadInterval(&y[i]), run.exponent);
          };
          return PairOf(range(0), range(2));
        });
    }
  }
  return is_moderate;
}

NestedProgram::Moderate NestedProgram::EvaluateInline(bool second, double* values) const noexcept {
  const unsigned nested = BitsOf(EvaluateRuns<true>(nested_, values));
  const unsigned outer = second ? BitsOf(EvaluateRuns<false>(outer_, values)) : 15;
  return {given_is_moderate_ && (nested & 3) == 3, given_is_moderate_ && nested >> 2 == 3 && outer == 15};
}

NestedProgram::Moderate NestedProgram::Evaluate(bool second, double* values,
                                                InstructionSet instructions) const noexcept {
  return Dispatch<&NestedProgram::EvaluateInline>(instructions, *this, second, values);
}

}  // namespace forereach

FOREREACH_ARITHMETIC_END
