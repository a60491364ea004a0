// Declared bounds on residuals as text against the residuals themselves in 256 bits: no two points differ by more. The
// verifier confirms each cover, and none of a bound below a slope that was found.
#include "tests/test.h"

#include "forereach/dynamics/expression.h"
#include "tests/declare/families.h"
#include "tests/oracle/any_expression.h"
#include "tests/oracle/exact.h"
#include "tests/oracle/traced_random.h"
#include "verifier/cover_check.h"

namespace forereach::declared_slopes_test {

constexpr Interval kParameter(0.5, 0.75);

Real ValueOf(const std::string& text, const std::array<Real, 4>& arguments) {
  const std::vector<std::string> names{"x", "y", "u", "c"};
  return Evaluate<Real>(ParseExpression({text}, names), arguments, [](double number) { return Real(number); });
}

// A number from an interval, often one of its ends.
double Within(Random& random, const Interval& range) {
  return random.Coin(0.2)   ? range.lower
         : random.Coin(0.2) ? range.upper
                            : std::clamp(random.Uniform(range.lower, range.upper), range.lower, range.upper);
}

// |r(z) - r(z')| <= sum_l L_l |z_l - z'_l| for pairs near and far.
void ExpectDeclared(Random& random, const std::string& text, const Domain& domain,
                    const std::vector<SlopeBound>& bounds) {
  const std::vector<Interval> ranges = domain.Ranges();
  for (int trial = 0; trial < 60; ++trial) {
    const double theta = Within(random, kParameter), reach = std::ldexp(1.0, -random.Integer(0, 40));
    std::array<Real, 4> z, other;
    Real allowed = 0;
    z[3] = other[3] = theta;
    for (std::size_t l = 0; l < ranges.size(); ++l) {
      const double at = Within(random, ranges[l]);
      const double beside = random.Coin(0.3) ? at : at + reach * (Within(random, ranges[l]) - at);
      z[l] = at;
      other[l] = std::clamp(beside, ranges[l].lower, ranges[l].upper);
      if (bounds[l].upper > 0) allowed += Real(bounds[l].upper) * abs(z[l] - other[l]);
    }
    EXPECT_LE(abs(ValueOf(text, z) - ValueOf(text, other)), allowed * Real(1 + 0x1p-50) + Real(0x1p-200)) << text;
  }
}

verifier::Answer Checked(const Family& family, const SlopeBound& bound) {
  return verifier::CoverChecker(family.domain, family.residual)
      .Check({0, bound.column, bound.upper, bound.cover})
      .answer;
}

// The cover with every leaf's bound lowered to less than a slope that was found.
SlopeBound Narrowed(SlopeBound bound) {
  bound.upper = bound.lower * (1 - 1e-3);
  for (Cover::Node& node : bound.cover.nodes)
    if (node.argument < 0) node.number = std::min(node.number, bound.upper);
  return bound;
}

struct Count {
  int bounded = 0, checked = 0, confirmed = 0, refuted = 0, narrowed = 0;
};

void Examine(Random& random, const std::string& text, double half_width, Count& count) {
  SCOPED_TRACE(text);
  const Family family = Made(Square(half_width), text, "0", kParameter);
  std::vector<SlopeBound> bounds;
  for (int column = 0; column < 3; ++column) bounds.push_back(family.Bound(0, column, {1e-2, 600}));
  if (!std::ranges::all_of(bounds, [](const SlopeBound& bound) { return bound.upper < kInfinity; })) return;
  ++count.bounded;
  ExpectDeclared(random, text, family.domain, bounds);
  const auto& bound = bounds[random.Bits() % 3];
  if (!family.slopes.Occurs(0, bound.column)) return;
  const verifier::Answer answer = Checked(family, bound);
  EXPECT_NE(answer, verifier::Answer::kNo);
  ++count.checked;
  count.confirmed += answer == verifier::Answer::kYes;
  if (!(bound.lower > 0)) return;
  ++count.narrowed;
  const verifier::Answer narrowed = Checked(family, Narrowed(bound));
  EXPECT_NE(narrowed, verifier::Answer::kYes);
  count.refuted += narrowed == verifier::Answer::kNo;
}

TEST(DeclaredSlopes, OfEachFunctionBoundItAndAreConfirmed) {
  TracedRandom random(1741);
  const std::vector<std::string> texts{
      "-c*x*abs(x)", "max(x, c*y) - min(x*y, u)", "c*sin(2*x)*cos(y) + tan(x/2)", "asin(x/2)*acos(y/3) + atan(3*u)",
      "atan2(x, y + 3)", "sqrt(x + 2)*log(y + 2) + exp(c*u)", "tanh(x/c) + hypot(x, 0.1)*u", "sqrt(x^2 + y^2 + 0.01)",
      "softplus(x - y, c)*smooth_gate(2*u - c)", "softplus(abs(x) - c, 0.1) + x^3/(1 + y^2)",
      "(x + 1.5)^-2 + 2^y + x^0 + (y + 2)^c", "abs(abs(x) - c)*max(min(y, c), -c)", "c*(0.3 - x)*(0.3 - x)",
      // Largest at a kink, where a box ends.
      "max(0.5, x)/(3 + x) + x", "x - min(x, -0.5)/(3 - x)", "abs(x - 0.5)/(3 + x) + x"};
  Count count;
  for (const std::string& text : texts)
    for (int i = 0; i < 3; ++i) Examine(random, text, 1, count);
  EXPECT_FIELDS(count, (bounded, 3 * static_cast<int>(texts.size())), (confirmed, count.checked));
  EXPECT_GT(count.confirmed, 20);
  EXPECT_EQ(count.refuted, count.narrowed);
}

TEST(DeclaredSlopes, OfRandomExpressionsBoundThemAndAreConfirmed) {
  const std::vector<std::string> leaves{"x", "y", "u", "c", "0.5", "2", "x", "y"};
  Count count;
  for (TracedRandom random(1742); random.Again(320);) Examine(random, AnyExpression(random, leaves, 4, true), 1, count);
  EXPECT_GT(count.bounded, 120);
  EXPECT_GT(count.checked, 80);
  EXPECT_GE(50 * count.confirmed, 49 * count.checked);
  EXPECT_GE(20 * count.refuted, 19 * count.narrowed);
  EXPECT_GT(count.narrowed, 60);
}

}  // namespace forereach::declared_slopes_test
