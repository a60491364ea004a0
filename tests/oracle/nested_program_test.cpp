// Pairs of intervals against rationals, and programs over nested boxes against 256 bits and against interval.h.
#include "forereach/dynamics/nested_program.h"

#include "tests/test.h"

#include "forereach/dynamics/text_program.h"
#include "forereach/numerics/interval_pair.h"
#include "tests/oracle/any_text.h"
#include "tests/oracle/in_reals.h"
#include "tests/oracle/traced_random.h"

namespace forereach::nested_program_test {

using exact::Real;
using Four = std::array<double, kLaneCount>;

Four Result(char operation, const Interval& a, const Interval& b, const Interval& c, const Interval& d) {
  const Lanes x = PairOf(a, b), y = PairOf(c, d);
  Four result{};
  switch (operation) {
    case '+': StoreLanes(Plus(x, y), result.data()); break;
    case '-': StoreLanes(Plus(x, Swapped(y)), result.data()); break;
    case '*': StoreLanes(Times(x, y), result.data()); break;
    case '/': StoreLanes(Times(x, Reciprocal(y)), result.data()); break;
    default: StoreLanes(SquareOf(x), result.data());
  }
  return result;
}

// Contains the range of the operation, and hardly more; not finite where there is none.
void ExpectRange(char operation, const Interval& a, const Interval& b, const double* pair) {
  SCOPED_TRACE(testing::Message() << "[" << a.lower << ", " << a.upper << "] " << operation << " [" << b.lower << ", "
                                  << b.upper << "]");
  const Interval range = LoadInterval(pair);
  if (operation == '/' && b.Contains(0)) {
    ASSERT_FALSE(range.IsFinite());
    return;
  }
  if (!(std::abs(range.lower) < kModerate && std::abs(range.upper) < kModerate)) return;  // then nothing is claimed
  std::vector<Rational> ends;
  for (const double x : {a.lower, a.upper})
    for (const double y : {b.lower, b.upper}) {
      const Rational p(x), q(y);
      switch (operation) {
        case '+': ends.emplace_back(p + q); break;
        case '-': ends.emplace_back(p - q); break;
        case '*': ends.emplace_back(p * q); break;
        case '/': ends.emplace_back(p / q); break;
        default: ends.emplace_back(p * p);
      }
    }
  if (operation == 's' && a.Contains(0)) ends.emplace_back(0);
  const auto [least, largest] = std::ranges::minmax(ends);
  ASSERT_LE(Rational(range.lower), least);
  ASSERT_GE(Rational(range.upper), largest);
  const auto is_near = [](const Rational& x, double bound) {
    return abs(x - Rational(bound)) <= abs(x) * Rational(0x1p-50) + Rational(0x1p-98);
  };
  ASSERT_TRUE(is_near(least, range.lower));
  ASSERT_TRUE(is_near(largest, range.upper));
}

TEST(IntervalPair, OperationsContainTheExactRangeAndHardlyMore) {
  TracedRandom random(7201);
  const auto any = [&] {
    const Interval x = random.AnyInterval();
    return std::abs(x.lower) < kModerate && std::abs(x.upper) < kModerate ? x : Interval(0);
  };
  for (int trial = 0; trial < 20000; ++trial)
    for (const char operation : {'+', '-', '*', '/', 's'}) {
      const Interval a = any(), b = any(), c = any(), d = any();
      const Four result = Result(operation, a, b, c, d);
      ExpectRange(operation, a, c, result.data());
      ExpectRange(operation, b, d, result.data() + 2);
      if (HasFatalFailure()) return;
    }
}

TEST(IntervalPair, WhatIsNotANumberIsNotModerate) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double strange : {nan, kInfinity, -kInfinity, kModerate, -0x1p300})
    for (std::size_t lane = 0; lane < kLaneCount; ++lane) {
      Four x{1, 2, 3, 4};
      x[lane] = strange;
      EXPECT_EQ(BitsOf(IsModerate(LoadLanes(x.data()))), 15u & ~(1u << lane));
    }
}

// The rates of a text, with their derivatives; boxes around a point, and parameters in their ranges.
struct Rates {
  ProgramDraft draft;
  std::vector<Interval> parameters;

  explicit Rates(const ModelText& text) : draft(MakeProgram(NamesOf(text), text.equations)) {
    draft.Differentiate();
    for (const ModelText::Parameter& parameter : text.parameters)
      parameters.emplace_back(parameter.lower, parameter.upper);
  }
};

double EndOrInside(Random& random, const Interval& x) {
  return random.Coin()   ? std::clamp(random.Uniform(x.lower, x.upper), x.lower, x.upper)
         : random.Coin() ? x.lower
                         : x.upper;
}

class NestedProgramTest : public testing::TestWithParam<InstructionSet> {};

// Soundness without slack, up to what 256 bits round; and as tight as the arithmetic of interval.h, node by node.
TEST_P(NestedProgramTest, BoundsWhatIsNeededOverBothBoxes) {
  if (!IsSupported(GetParam())) GTEST_SKIP();
  TracedRandom random(7202);
  int compared = 0, unbounded = 0;
  for (int trial = 0; trial < 1500; ++trial) {
    const Rates rates(random.Coin(0.2) ? KinkedText(random) : AnyText(random));
    const Program program = rates.draft.View();
    const NestedProgram nested(program, rates.parameters);
    const double outer_reach = random.Coin(0.1) ? 0 : std::ldexp(random.Uniform(0, 4), -random.Integer(0, 40)),
                 inner_reach = random.Coin()   ? 0
                               : random.Coin() ? outer_reach
                                               : std::min(outer_reach, 1e-14);
    std::vector<Interval> inner, outer;
    std::vector<double> values(nested.size());
    for (int l = 0; l < program.variables; ++l) {
      const double center = random.Uniform(-1.5, 1.5);
      inner.emplace_back(center - inner_reach, center + inner_reach);
      outer.push_back(Join(inner.back(), {center - outer_reach, center + outer_reach}));
      StoreLanes(PairOf(inner.back(), outer.back()), &values[4 * static_cast<std::size_t>(l)]);
    }
    nested.Begin(values.data());
    const auto is_moderate = nested.Evaluate(true, values.data(), GetParam());
    ++(is_moderate.outer ? compared : unbounded);
    const auto for_each = [&](bool over_outer, auto visit) {
      const auto at = [&](int node, int place) { visit(node, LoadInterval(&values[static_cast<std::size_t>(place)])); };
      const int shift = over_outer ? 2 : 0;
      for (const int node : program.value) at(node, nested.PairPlace(node) + shift);
      for (const auto& entry : program.jacobian) at(entry.node, nested.PairPlace(entry.node) + shift);
      for (const auto& entry : program.hessian)
        if (over_outer) at(entry.node, nested.OuterPlace(entry.node));
    };
    for (const bool over_outer : {false, true}) {
      if (!(over_outer ? is_moderate.outer : is_moderate.inner)) continue;
      const std::vector<Interval>& box = over_outer ? outer : inner;
      for (int sample = 0; sample < 3; ++sample) {
        std::vector<Real> z;
        std::vector<double> parameters;
        for (const Interval& x : box) z.emplace_back(EndOrInside(random, x));
        for (const Interval& range : rates.parameters) parameters.push_back(EndOrInside(random, range));
        const std::vector<Real> exact = InReals(program, parameters, z);
        for_each(over_outer, [&](int node, const Interval& range) {
          const Real& x = exact[static_cast<std::size_t>(node)];
          const Real allowance = Real(0x1p-200) * (abs(x) + Real(1));
          ASSERT_TRUE(x >= Real(range.lower) - allowance && x <= Real(range.upper) + allowance)
              << "node " << node << ": " << x << " in [" << range.lower << ", " << range.upper << "]";
        });
        if (HasFatalFailure()) return;
      }
      std::vector<Interval> old(static_cast<std::size_t>(program.size));
      const std::vector<unsigned char> all(old.size(), 1);
      Evaluate<Interval, Interval>(program, all, rates.parameters, box, old);
      // Rounding is not magnified, and a sine has at most one extremum.
      bool is_comparable = true;
      for (std::size_t i = 0; i < old.size(); ++i) {
        is_comparable = is_comparable && !(old[i].IsFinite() && old[i].Magnitude() > 1e3);
        if (program.nodes[i].op == Op::kSin || program.nodes[i].op == Op::kTan)
          is_comparable = is_comparable && old[static_cast<std::size_t>(program.nodes[i].a)].HalfWidthUpper() < 1.4;
      }
      if (!is_comparable) continue;
      for_each(over_outer, [&](int node, const Interval& range) {
        const Interval& before = old[static_cast<std::size_t>(node)];
        ASSERT_GE(range.lower, before.lower - 1e-6) << "node " << node;
        ASSERT_LE(range.upper, before.upper + 1e-6) << "node " << node;
      });
      if (HasFatalFailure()) return;
    }
  }
  EXPECT_GT(compared, 300);
  EXPECT_GT(unbounded, 100);
}

INSTANTIATE_TEST_SUITE_P(Each, NestedProgramTest,
                         testing::Values(InstructionSet::kBaseline, InstructionSet::kAvx2, InstructionSet::kAvx512));

// What only second derivatives need does not spoil the first ones, nor the outer box what is known over the inner one.
TEST(NestedProgram, SaysOverWhichBoxItHasNoBound) {
  const auto evaluate = [](const std::string& equation, const Interval& inner, const Interval& outer, bool second) {
    const Rates rates(TextModel({{"x", equation}}, {}, {{"dt", 0.1, 0.1}}));
    const NestedProgram nested(rates.draft.View(), rates.parameters);
    std::vector<double> values(nested.size());
    StoreLanes(PairOf(inner, outer), values.data());
    nested.Begin(values.data());
    const auto is = nested.Evaluate(second, values.data());
    return std::pair(is.inner, is.outer);
  };
  EXPECT_EQ(evaluate("log(x)", 1, {0.5, 2}, true), std::pair(true, true));
  EXPECT_EQ(evaluate("log(x)", 1, {0, 2}, true), std::pair(true, false));
  EXPECT_EQ(evaluate("log(x)", 0, {0, 2}, true), std::pair(false, false));
  EXPECT_EQ(evaluate("tan(x)", 1.5, {1.4, 1.57}, true), std::pair(true, true));
  EXPECT_EQ(evaluate("tan(x)", 1.5, {1.4, 1.58}, true), std::pair(true, false));
  EXPECT_EQ(evaluate("sin(x)", 1e7, {0, 1e7}, true), std::pair(true, true));
  EXPECT_EQ(evaluate("abs(x)", 1, {-1, 2}, true), std::pair(true, false));
  EXPECT_EQ(evaluate("abs(x)", 1, {-1, 2}, false), std::pair(true, true));
  EXPECT_EQ(evaluate("x*1e60", 1, {1, 1e50}, true), std::pair(true, false));
  EXPECT_EQ(evaluate("x + 1e91", 1, 1, true), std::pair(false, false));
}

// The outer box of w exp(1000 w) has one end that is a number, and is none: it chooses no center for the inner one's
// sine.
TEST(NestedProgram, KnowsTheSineOverTheInnerBoxWhereTheOuterOneHasNoBound) {
  const std::string w = "max((x - 1)*4503599627370496, 0)";
  const Rates rates(
      TextModel({{"x", "sin(8.9*(" + w + "*exp(1000*" + w + ")) + p)"}}, {}, {{"dt", 0.1, 0.1}, {"p", 0, 1.9}}));
  const NestedProgram nested(rates.draft.View(), rates.parameters);
  std::vector<double> values(nested.size());
  StoreLanes(PairOf(1, {1, std::nextafter(1.0, 2.0)}), values.data());
  nested.Begin(values.data());
  EXPECT_FALSE(nested.Evaluate(true, values.data()).outer);
  const Interval sine = LoadInterval(&values[static_cast<std::size_t>(nested.PairPlace(rates.draft.View().value[0]))]);
  EXPECT_FIELDS(sine, (Contains(1), true), (Contains(0), true));
}

}  // namespace forereach::nested_program_test
