#include "verifier/jet.h"

#include <algorithm>
#include <stdexcept>

#include "forereach/numerics/size.h"
#include "verifier/ranges.h"

namespace forereach::verifier {
namespace {

bool ContainsZero(const Real& a) { return !CertainlyBelow(0.0, a) && !CertainlyBelow(a, 0.0); }

// Without them, zero times infinity would be neither finite nor infinite.
Real Times(const Real& a, const Real& b) { return a.IsFinite() && b.IsFinite() ? a * b : Real::Everything(); }
Real Over(const Real& a, const Real& b) {
  return a.IsFinite() && b.IsFinite() && !ContainsZero(b) ? a / b : Real::Everything();
}

template <class Function>
Sparse Each(const Sparse& entries, const Function& function) {
  Sparse result;
  result.reserve(entries.size());
  for (const auto& [key, value] : entries) result.emplace_back(key, function(value));
  return result;
}
Sparse Scaled(const Real& factor, const Sparse& entries) {
  return Each(entries, [&](const Real& value) { return Times(factor, value); });
}
Sparse Negated(const Sparse& entries) {
  return Each(entries, [](const Real& value) { return -value; });
}

// Calls with each key of either, and the entries there; null: none.
template <class Function>
void ForUnion(const Sparse& a, const Sparse& b, const Function& function) {
  for (auto i = a.begin(), j = b.begin(); i != a.end() || j != b.end();) {
    const bool has_a = i != a.end() && (j == b.end() || i->first <= j->first);
    const bool has_b = j != b.end() && (i == a.end() || j->first <= i->first);
    function(has_a ? i->first : j->first, has_a ? &i->second : nullptr, has_b ? &j->second : nullptr);
    if (has_a) ++i;
    if (has_b) ++j;
  }
}

Sparse Sum(const Sparse& a, const Sparse& b) {
  Sparse sum;
  ForUnion(a, b,
           [&](int key, const Real* x, const Real* y) { sum.emplace_back(key, x && y ? *x + *y : *(x ? x : y)); });
  return sum;
}

// The entries, and zeros for the other keys.
Sparse Padded(const Sparse& entries, const Sparse& keys) {
  Sparse padded;
  ForUnion(entries, keys, [&](int key, const Real* x, const Real*) { padded.emplace_back(key, x ? *x : Real(0.0)); });
  return padded;
}

Sparse UnknownUnion(const Sparse& a, const Sparse& b) {
  Sparse unknown;
  ForUnion(a, b, [&](int key, const Real*, const Real*) { unknown.emplace_back(key, Real::Everything()); });
  return unknown;
}

// All second derivatives by variables of the entries.
Sparse UnknownPairs(const Sparse& first) {
  Sparse unknown;
  for (auto i = first.begin(); i != first.end(); ++i)
    for (auto j = i; j != first.end(); ++j)
      unknown.emplace_back(JetArithmetic::Key(i->first, j->first), Real::Everything());
  return unknown;
}

// A sum of entries in any order.
class Terms {
 public:
  void Add(const Sparse& entries) { terms_.insert(terms_.end(), entries.begin(), entries.end()); }
  void AddScaled(const Real& factor, const Sparse& entries) {
    for (const auto& [key, value] : entries) terms_.emplace_back(key, Times(factor, value));
  }
  /** g_i h_j in row i <= column j, times 1 or -1. */
  void AddProducts(const Sparse& g, const Sparse& h, bool negative = false) {
    for (const auto& [i, by_row] : g)
      for (const auto& [j, by_column] : h) {
        if (i > j) continue;
        const Real product = Times(by_row, by_column);
        terms_.emplace_back(JetArithmetic::Key(i, j), negative ? -product : product);
      }
  }
  /** factor g_i g_j. */
  void AddSquare(const Real& factor, const Sparse& g) {
    for (auto i = g.begin(); i != g.end(); ++i)
      for (auto j = i; j != g.end(); ++j) {
        const Real product = Times(i->second, j->second);
        terms_.emplace_back(JetArithmetic::Key(i->first, j->first), Times(factor, product));
      }
  }

  Sparse Gather() {
    std::ranges::sort(terms_, {}, &std::pair<int, Real>::first);
    Sparse sum;
    for (auto& term : terms_) {
      if (!sum.empty() && sum.back().first == term.first)
        sum.back().second += term.second;
      else
        sum.push_back(std::move(term));
    }
    return sum;
  }

 private:
  Sparse terms_;
};

// Over the range of a function that may be either.
Sparse HullOf(const Sparse& a, const Sparse& b) {
  static const Real zero(0.0);
  Sparse hull;
  ForUnion(a, b, [&](int key, const Real* x, const Real* y) {
    const Real &one = x ? *x : zero, &other = y ? *y : zero;
    hull.emplace_back(key, one.IsFinite() && other.IsFinite() ? Hull(one, other) : Real::Everything());
  });
  return hull;
}

Real ValueOf(const Tape::Operation& operation, const Real& a, const Real& b) {
  switch (operation.op) {
    case Op::kVariable:
    case Op::kParameter:
    case Op::kNumber: break;
    case Op::kAdd: return a + b;
    case Op::kSubtract: return a - b;
    case Op::kMultiply: return a * b;
    case Op::kDivide: return Over(a, b);
    case Op::kNegate: return -a;
    case Op::kPower: return power(a, operation.index);
    case Op::kSin: return sin(a);
    case Op::kCos: return cos(a);
    case Op::kTan: return tan(a);
    case Op::kAsin: return asin(a);
    case Op::kAcos: return acos(a);
    case Op::kAtan: return atan(a);
    case Op::kSqrt: return sqrt(a);
    case Op::kExp: return exp(a);
    case Op::kLog: return log(a);
    case Op::kTanh: return tanh(a);
    case Op::kAbs: return abs(a);
    case Op::kSignedSquare: return SignedSquare(a);
    case Op::kAtan2: return atan2(a, b);
    case Op::kMin: return min(a, b);
    case Op::kMax: return max(a, b);
    case Op::kSoftplus: return CertainlyBelow(0.0, b) ? SoftRamp(a, b) : Real::Everything();
    case Op::kSmoothGate: return Gate(a);
  }
  return Real::Everything();
}

// Derivatives of one operation from those of its operands.
class Rules {
 public:
  explicit Rules(bool second) : second_(second) {}

  [[nodiscard]] Jet Derive(const Tape::Operation& operation, Real value, const Jet& a) const;
  [[nodiscard]] Jet Derive(const Tape::Operation& operation, Real value, const Jet& a, const Jet& b) const;

 private:
  // The chain rule for f(a): f' a_j, and f' a_ij + f'' a_i a_j.
  [[nodiscard]] Jet Chain(Real value, const Real& slope, const Real& bend, const Jet& a) const {
    Jet result{std::move(value), Scaled(slope, a.first), {}};
    if (!second_) return result;
    Terms terms;
    terms.AddScaled(slope, a.second);
    terms.AddSquare(bend, a.first);
    result.second = terms.Gather();
    return result;
  }

  // A function whose derivatives are q_j = n_j / d: (n_ij - q_j d_i) / d, where `add` adds n_ij, given all q_j.
  template <class Add>
  [[nodiscard]] Jet Quotient(Real value, const Sparse& numerator, const Real& divisor, const Sparse& divisor_first,
                             const Add& add) const {
    const auto divided = [&](const Real& entry) { return Over(entry, divisor); };
    Jet result{std::move(value), Each(numerator, divided), {}};
    if (!second_) return result;
    Terms terms;
    add(terms, result.first);
    terms.AddProducts(divisor_first, result.first, true);
    result.second = Each(terms.Gather(), divided);
    return result;
  }
  // The same with n_j = a_j.
  [[nodiscard]] Jet Quotient(Real value, const Jet& a, const Real& divisor, const Sparse& divisor_first) const {
    return Quotient(std::move(value), a.first, divisor, divisor_first,
                    [&](Terms& terms, const Sparse&) { terms.Add(a.second); });
  }

  [[nodiscard]] Jet Negative(const Jet& a) const { return {-a.value, Negated(a.first), Negated(a.second)}; }

  [[nodiscard]] Jet SumOf(Real value, const Jet& a, const Jet& b) const {
    return {std::move(value), Sum(a.first, b.first), Sum(a.second, b.second)};
  }

  // a_j b + a b_j.
  [[nodiscard]] Jet Product(Real value, const Jet& a, const Jet& b) const {
    Jet result{std::move(value), Sum(Scaled(b.value, a.first), Scaled(a.value, b.first)), {}};
    if (!second_) return result;
    Terms terms;
    terms.AddScaled(b.value, a.second);
    terms.AddScaled(a.value, b.second);
    terms.AddProducts(a.first, b.first);
    terms.AddProducts(b.first, a.first);
    result.second = terms.Gather();
    return result;
  }

  // (a_j - q b_j) / b.
  [[nodiscard]] Jet Ratio(const Real& q, const Jet& a, const Jet& b) const {
    return Quotient(q, Sum(a.first, Scaled(-q, b.first)), b.value, b.first, [&](Terms& terms, const Sparse& slopes) {
      terms.Add(a.second);
      terms.AddScaled(-q, b.second);
      terms.AddProducts(slopes, b.first, true);
    });
  }

  [[nodiscard]] Jet Power(Real value, const Jet& a, int n) const {
    if (n == 0) return {std::move(value), {}, {}};
    if (n == 1) return a;
    return Chain(std::move(value), Real::Integer(n) * power(a.value, n - 1),
                 Real::Integer(n * (n - 1)) * power(a.value, n - 2), a);
  }

  // a_j / (2 s).
  [[nodiscard]] Jet SquareRoot(const Real& root, const Jet& a) const {
    const Sparse twice_slopes = Each(a.first, [&](const Real& slope) { return Over(slope, root); });
    return Quotient(root, a, Real(2.0) * root, twice_slopes);
  }

  // a_j / c with c = sqrt(1 - a^2), c_j = -a a_j / c.
  [[nodiscard]] Jet Arcsine(Real value, const Jet& a) const {
    const Real cosine = sqrt(Real(1.0) - sqr(a.value));
    const Sparse cosine_slopes = Each(a.first, [&](const Real& slope) { return Over(-Times(a.value, slope), cosine); });
    return Quotient(std::move(value), a, cosine, cosine_slopes);
  }

  // a_j / (1 + a^2).
  [[nodiscard]] Jet Arctangent(Real value, const Jet& a) const {
    const Real size = Real(1.0) + sqr(a.value);
    return Quotient(std::move(value), a, size, Scaled(Real(2.0) * a.value, a.first));
  }

  // (b a_j - a b_j) / (a^2 + b^2).
  [[nodiscard]] Jet Angle(Real value, const Jet& a, const Jet& b) const {
    const Real two(2.0);
    const Sparse numerator = Sum(Scaled(b.value, a.first), Scaled(-a.value, b.first));
    const Sparse size_slopes = Sum(Scaled(two * a.value, a.first), Scaled(two * b.value, b.first));
    return Quotient(std::move(value), numerator, sqr(a.value) + sqr(b.value), size_slopes,
                    [&](Terms& terms, const Sparse&) {
                      terms.AddScaled(b.value, a.second);
                      terms.AddScaled(-a.value, b.second);
                      terms.AddProducts(b.first, a.first);
                      terms.AddProducts(a.first, b.first, true);
                    });
  }

  // Of two functions of which either may be the larger one.
  [[nodiscard]] Jet Kinked(Real value, const Sparse& first, const Sparse& other) const {
    Jet result{std::move(value), HullOf(first, other), {}};
    if (second_) result.second = UnknownPairs(result.first);
    return result;
  }
  // Over a box that the kink only borders on, the derivatives are those of the operand inside. At a point of the kink
  // either operand may be the one inside.
  [[nodiscard]] Jet Larger(Real value, const Jet& a, const Jet& b) const {
    const bool first = CertainlyAtMost(b.value, a.value), second = CertainlyAtMost(a.value, b.value);
    if (first == second) return Kinked(std::move(value), a.first, b.first);
    return first ? Chosen(a, b) : Chosen(b, a);
  }
  // `a`, with zeros for the derivatives that it would have at the kink: which entries there are does not depend on the
  // box.
  [[nodiscard]] Jet Chosen(const Jet& a, const Jet& other) const {
    Jet result{a.value, Padded(a.first, other.first), {}};
    if (second_) result.second = Padded(a.second, UnknownPairs(result.first));
    return result;
  }

  // With u = x / t: s x_j + e t_j, where s_u = m / t, and the second derivatives are m / t times 1, -u and u^2.
  [[nodiscard]] Jet Softplus(Real value, const Jet& x, const Jet& t) const {
    const Real u = x.value / t.value, by_x = Logistic(u), by_t = SoftRampByTemperature(u);
    Jet result{std::move(value), Sum(Scaled(by_x, x.first), Scaled(by_t, t.first)), {}};
    if (!second_) return result;
    const Real bend = LogisticSlope(u) / t.value;
    Terms terms, mixed;
    terms.AddScaled(by_x, x.second);
    terms.AddScaled(by_t, t.second);
    terms.AddSquare(bend, x.first);
    terms.AddSquare(sqr(u) * bend, t.first);
    mixed.AddProducts(x.first, t.first);
    mixed.AddProducts(t.first, x.first);
    terms.AddScaled(-u * bend, mixed.Gather());
    result.second = terms.Gather();
    return result;
  }

  bool second_;
};

Jet Rules::Derive(const Tape::Operation& operation, Real value, const Jet& a) const {
  const Real one(1.0);
  switch (operation.op) {
    case Op::kNegate: return Negative(a);
    case Op::kPower: return Power(std::move(value), a, operation.index);
    case Op::kSin: return Chain(value, cos(a.value), -value, a);
    case Op::kCos: return Chain(value, -sin(a.value), -value, a);
    case Op::kTan: return Chain(value, one + sqr(value), TangentBend(value), a);
    case Op::kAsin: return Arcsine(std::move(value), a);
    case Op::kAcos: return Arcsine(std::move(value), Negative(a));  // acos(a) = pi/2 + asin(-a)
    case Op::kAtan: return Arctangent(std::move(value), a);
    case Op::kSqrt: return SquareRoot(value, a);
    case Op::kExp: return Chain(value, value, value, a);
    case Op::kLog: return Quotient(std::move(value), a, a.value, a.first);
    case Op::kTanh: {
      const Real slope = one - sqr(value);
      return Chain(value, slope, Real(-2.0) * value * slope, a);
    }
    case Op::kSignedSquare: return Chain(std::move(value), Real(2.0) * abs(a.value), Real(2.0) * Sign(a.value), a);
    case Op::kAbs: return Larger(std::move(value), a, Negative(a));
    case Op::kSmoothGate: return Chain(std::move(value), GateSlope(a.value), GateBend(a.value), a);
    default: break;
  }
  throw std::logic_error("an operation of one operand without a rule for its derivatives");
}

Jet Rules::Derive(const Tape::Operation& operation, Real value, const Jet& a, const Jet& b) const {
  switch (operation.op) {
    case Op::kAdd: return SumOf(std::move(value), a, b);
    case Op::kSubtract: return SumOf(std::move(value), a, Negative(b));
    case Op::kMultiply: return Product(std::move(value), a, b);
    case Op::kDivide: return Ratio(value, a, b);
    case Op::kAtan2: return Angle(std::move(value), a, b);
    case Op::kMax: return Larger(std::move(value), a, b);
    case Op::kMin: return Negative(Larger(-value, Negative(a), Negative(b)));
    case Op::kSoftplus: return Softplus(std::move(value), a, b);
    default: break;
  }
  throw std::logic_error("an operation of two operands without a rule for its derivatives");
}

}  // namespace

Real RealArithmetic::Apply(const Tape::Operation& operation, const Real* a, const Real* b) const {
  if (operation.op == Op::kVariable) return variables_[ToSize(operation.index)];
  if (operation.op == Op::kParameter) return parameters_[ToSize(operation.index)];
  if (operation.op == Op::kNumber) return operation.number;
  if (!a->IsFinite() || (b && !b->IsFinite())) return Real::Everything();
  Real value = ValueOf(operation, *a, b ? *b : *a);
  return value.IsFinite() ? std::move(value) : Real::Everything();
}

Jet JetArithmetic::Apply(const Tape::Operation& operation, const Jet* a, const Jet* b) const {
  Jet result;
  result.value = values_.Apply(operation, a ? &a->value : nullptr, b ? &b->value : nullptr);
  if (operation.op == Op::kVariable && ToSize(operation.index) < by_.size() && by_[ToSize(operation.index)])
    result.first.emplace_back(operation.index, 1.0);
  if (a == nullptr || (a->first.empty() && (b == nullptr || b->first.empty()))) return result;
  const bool second = order_ == Order::kSecond;
  if (!result.value.IsFinite()) {
    result.first = UnknownUnion(a->first, b ? b->first : Sparse());
    if (second) result.second = UnknownPairs(result.first);
    return result;
  }
  const Rules rules(second);
  return b ? rules.Derive(operation, std::move(result.value), *a, *b)
           : rules.Derive(operation, std::move(result.value), *a);
}

namespace {

// The product of centers and radii, which contains that of the intervals.
Real CentredTimes(const Real& a, const Real& b) {
  if (!a.IsFinite() || !b.IsFinite()) return Real::Everything();
  const Real a_center = a.middle(), b_center = b.middle();
  const Real a_radius = (a - a_center).magnitude(), b_radius = (b - b_center).magnitude();
  const Real center = a_center * b_center;
  const Real radius = abs(a_center) * b_radius + a_radius * (abs(b_center) + b_radius);
  return Real::FromTo(center - radius, center + radius);
}

Sparse CentredScaled(const Real& factor, const Sparse& entries) {
  return Each(entries, [&](const Real& value) { return CentredTimes(factor, value); });
}

// a_i b_j + b_i a_j, or a_i a_j if both are the same.
Sparse SymmetricProducts(const Sparse& a, const Sparse& b) {
  Sparse terms;
  const auto add = [&](const Sparse& rows, const Sparse& columns) {
    for (const auto& [i, by_row] : rows)
      for (const auto& [j, by_column] : columns)
        if (i <= j) terms.emplace_back(JetArithmetic::Key(i, j), CentredTimes(by_row, by_column));
  };
  add(a, b);
  if (&a != &b) add(b, a);
  Terms sum;
  sum.Add(terms);
  return sum.Gather();
}

}  // namespace

Jet Compose(const Jet& outer, std::span<const Jet> inner, JetArithmetic::Order order) {
  Jet result{outer.value, {}, {}};
  Terms first, second;
  for (const auto& [l, slope] : outer.first) first.Add(CentredScaled(slope, inner[ToSize(l)].first));
  result.first = first.Gather();
  if (order == JetArithmetic::Order::kFirst) return result;
  for (const auto& [l, slope] : outer.first) second.Add(CentredScaled(slope, inner[ToSize(l)].second));
  for (const auto& [key, bend] : outer.second)
    second.Add(CentredScaled(bend, SymmetricProducts(inner[ToSize(key / JetArithmetic::kStride)].first,
                                                     inner[ToSize(key % JetArithmetic::kStride)].first)));
  result.second = second.Gather();
  return result;
}

Jet AddScaled(const Jet& a, const Real& factor, const Jet& b) {
  return {a.value + Times(factor, b.value), Sum(a.first, Scaled(factor, b.first)),
          Sum(a.second, Scaled(factor, b.second))};
}

}  // namespace forereach::verifier
