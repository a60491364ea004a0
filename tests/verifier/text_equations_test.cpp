// Equations of a text: against those written by hand, against closed formulas, and where there is no finite enclosure.
#include "tests/test.h"

#include "forereach/dynamics/models/named_models.h"
#include "tests/oracle/any_expression.h"
#include "tests/oracle/traced_random.h"
#include "tests/text_models.h"
#include "tests/verifier/equations_by_hand.h"
#include "verifier/expressions.h"

namespace forereach::verifier::text_equations_test {

using Integrator = ModelText::Integrator;

// x+ = text, with one state x, one input u and a step of 1/8.
ModelText OneState(const std::string& text, Integrator integrator = Integrator::kNone) {
  return TextModel({{"x", text}}, {"u"}, {{"dt", 0.125, 0.125}}, {}, integrator);
}

struct Ranges {
  Real value, first, second;  // zero if not listed

  Ranges(const std::string& text, const Real& x, const Real& u = 0.0) {
    const auto equations = EquationsOf(OneState(text));
    const std::vector<Real> z{x, u};
    value = equations->Value(z)[0];
    for (const FirstDerivative& entry : equations->First(z))
      if (entry.variable == 0) first = entry.value;
    for (const SecondDerivative& entry : equations->Second(z)) second = entry.value;
  }
};

bool Agree(const Real& a, const Real& b) {
  return CertainlyBelow(abs(a - b), Real(0x1p-90) * (Real(1.0) + abs(a) + abs(b)));
}

// Whether a lies in b up to the rounding of 256 bits.
bool Inside(const Real& a, const Real& b) {
  const Real slack = Real(0x1p-200) * (Real(1.0) + b.magnitude());
  return CertainlyAtMost(b.lower() - slack, a.lower()) && CertainlyAtMost(a.upper(), b.upper() + slack);
}
bool AreEqual(const Real& a, const Real& b) { return Inside(a, b) && Inside(b, a); }

void ExpectTheSameEquations(const Equations& text, const Equations& by_hand, int variables) {
  for (TracedRandom random(81); random.Again(50);) {
    std::vector<Real> box;
    for (int l = 0; l < variables; ++l) {
      const double lower = random.Uniform(-1.4, 1), upper = lower + (random.trial() % 2) * random.Uniform(0, 0.5);
      box.push_back(Real::FromTo(lower, upper));
    }
    const auto values = text.Value(box), values_by_hand = by_hand.Value(box);
    ASSERT_EQ(values.size(), values_by_hand.size());
    for (std::size_t k = 0; k < values.size(); ++k) EXPECT_TRUE(AreEqual(values[k], values_by_hand[k])) << k;
    const auto first = text.First(box), first_by_hand = by_hand.First(box);
    ASSERT_EQ(first.size(), first_by_hand.size());
    for (std::size_t i = 0; i < first.size(); ++i) {
      EXPECT_FIELDS(first[i], (output, first_by_hand[i].output), (variable, first_by_hand[i].variable));
      EXPECT_TRUE(AreEqual(first[i].value, first_by_hand[i].value));
    }
    const auto second = text.Second(box), second_by_hand = by_hand.Second(box);
    ASSERT_EQ(second.size(), second_by_hand.size());
    for (std::size_t i = 0; i < second.size(); ++i) {
      EXPECT_FIELDS(second[i], (output, second_by_hand[i].output), (row, second_by_hand[i].row),
                    (column, second_by_hand[i].column));
      EXPECT_TRUE(AreEqual(second[i].value, second_by_hand[i].value));
    }
    const Real duration = Real::FromTo(0.125, random.trial() % 2 == 0 ? 0.125 : 0.1875);
    const auto rate = text.Rate(box, duration), rate_by_hand = by_hand.Rate(box, duration);
    ASSERT_EQ(rate.size(), rate_by_hand.size());
    // Over a box the texts' order of operations may cost some width.
    for (std::size_t k = 0; k < rate.size(); ++k)
      EXPECT_TRUE(random.trial() % 2 == 0 ? AreEqual(rate[k], rate_by_hand[k]) : Inside(rate_by_hand[k], rate[k])) << k;
    const auto flow = text.Flow(box), flow_by_hand = by_hand.Flow(box);
    ASSERT_EQ(flow.size(), flow_by_hand.size());
    for (std::size_t k = 0; k < flow.size(); ++k) EXPECT_TRUE(Inside(flow_by_hand[k], flow[k])) << k;
    for (int k = 0; k < static_cast<int>(rate.size()); ++k)
      EXPECT_EQ(text.IsProportional(k), by_hand.IsProportional(k)) << k;
  }
}

TEST(TextEquations, OfTheBicycleAreThoseWrittenByHand) {
  const BicycleEquations by_hand(0.1, 2.5);
  ExpectTheSameEquations(*EquationsOf(BicycleText(0.1, 2.5)), by_hand, 8);
  ExpectTheSameEquations(*EquationsOf(*MakeKinematicBicycle(0.1, 2.5)), by_hand, 8);
}

TEST(TextEquations, OfThePointMassAreThoseWrittenByHand) {
  const PointMassEquations by_hand(0.15);
  ExpectTheSameEquations(*EquationsOf(PointMassText(0.15)), by_hand, 6);
  ExpectTheSameEquations(*EquationsOf(*MakePointMass(0.15)), by_hand, 6);
}

struct Formula {
  const char* text;
  double from, to;  // where it is smooth
  std::function<Real(const Real&)> value, first, second;
};

const std::vector<Formula>& Formulas() {
  static const Real one(1.0), two(2.0);
  static const std::vector<Formula> formulas{
      {"sin(x)", -9, 9, [](const Real& x) { return sin(x); }, [](const Real& x) { return cos(x); },
       [](const Real& x) { return -sin(x); }},
      {"cos(x)", -9, 9, [](const Real& x) { return cos(x); }, [](const Real& x) { return -sin(x); },
       [](const Real& x) { return -cos(x); }},
      {"tan(x)", -1.5, 1.5, [](const Real& x) { return tan(x); }, [](const Real& x) { return one / sqr(cos(x)); },
       [](const Real& x) { return two * tan(x) / sqr(cos(x)); }},
      {"asin(x)", -0.99, 0.99, [](const Real& x) { return asin(x); },
       [](const Real& x) { return one / sqrt(one - sqr(x)); },
       [](const Real& x) { return x / sqrt((one - sqr(x)) * sqr(one - sqr(x))); }},
      {"acos(x)", -0.99, 0.99, [](const Real& x) { return acos(x); },
       [](const Real& x) { return -one / sqrt(one - sqr(x)); },
       [](const Real& x) { return -x / sqrt((one - sqr(x)) * sqr(one - sqr(x))); }},
      {"atan(x)", -9, 9, [](const Real& x) { return atan(x); }, [](const Real& x) { return one / (one + sqr(x)); },
       [](const Real& x) { return -two * x / sqr(one + sqr(x)); }},
      {"sqrt(x)", 0.01, 9, [](const Real& x) { return sqrt(x); }, [](const Real& x) { return one / (two * sqrt(x)); },
       [](const Real& x) { return -one / (Real(4.0) * x * sqrt(x)); }},
      {"exp(x)", -9, 9, [](const Real& x) { return exp(x); }, [](const Real& x) { return exp(x); },
       [](const Real& x) { return exp(x); }},
      {"log(x)", 0.01, 9, [](const Real& x) { return log(x); }, [](const Real& x) { return one / x; },
       [](const Real& x) { return -one / sqr(x); }},
      {"tanh(x)", -4, 4, [](const Real& x) { return tanh(x); }, [](const Real& x) { return one - sqr(tanh(x)); },
       [](const Real& x) { return -two * tanh(x) * (one - sqr(tanh(x))); }},
      {"signed_square(x)", 0, 9, [](const Real& x) { return sqr(x); }, [](const Real& x) { return two * x; },
       [](const Real&) { return two; }},
      {"signed_square(x)", -9, 0, [](const Real& x) { return -sqr(x); }, [](const Real& x) { return -two * x; },
       [](const Real&) { return -two; }},
      {"abs(x)", 0, 9, [](const Real& x) { return x; }, [](const Real&) { return one; },
       [](const Real&) { return Real(); }},
      {"abs(x)", -9, 0, [](const Real& x) { return -x; }, [](const Real&) { return -one; },
       [](const Real&) { return Real(); }},
      {"max(x^2, -x)", 0, 9, [](const Real& x) { return sqr(x); }, [](const Real& x) { return two * x; },
       [](const Real&) { return two; }},
      {"min(-x^2, x)", 0, 9, [](const Real& x) { return -sqr(x); }, [](const Real& x) { return -two * x; },
       [](const Real&) { return -two; }},
      {"atan2(x, 2)", -9, 9, [](const Real& x) { return atan(x / two); },
       [](const Real& x) { return two / (Real(4.0) + sqr(x)); },
       [](const Real& x) { return -Real(4.0) * x / sqr(Real(4.0) + sqr(x)); }},
      {"atan2(2, x)", -9, 9, [](const Real& x) { return acos(x / sqrt(Real(4.0) + sqr(x))); },
       [](const Real& x) { return -two / (Real(4.0) + sqr(x)); },
       [](const Real& x) { return Real(4.0) * x / sqr(Real(4.0) + sqr(x)); }},
      {"x^7", -2, 2, [](const Real& x) { return x * power(x, 6); },
       [](const Real& x) { return Real(7.0) * power(x, 6); }, [](const Real& x) { return Real(42.0) * power(x, 5); }},
      {"x^-2", 0.1, 9, [](const Real& x) { return one / sqr(x); }, [](const Real& x) { return -two / (x * sqr(x)); },
       [](const Real& x) { return Real(6.0) / sqr(sqr(x)); }},
      {"x^1.5", 0.1, 9, [](const Real& x) { return x * sqrt(x); }, [](const Real& x) { return Real(1.5) * sqrt(x); },
       [](const Real& x) { return Real(0.75) / sqrt(x); }},
      {"2/x", -9, -0.1, [](const Real& x) { return two / x; }, [](const Real& x) { return -two / sqr(x); },
       [](const Real& x) { return Real(4.0) / (x * sqr(x)); }},
      {"hypot(x, 2)", -9, 9, [](const Real& x) { return sqrt(sqr(x) + Real(4.0)); },
       [](const Real& x) { return x / sqrt(sqr(x) + Real(4.0)); },
       [](const Real& x) { return Real(4.0) / ((sqr(x) + Real(4.0)) * sqrt(sqr(x) + Real(4.0))); }},
      {"softplus(x, 2)", -9, 9, [](const Real& x) { return two * log(one + exp(x / two)); },
       [](const Real& x) { return one / (one + exp(-x / two)); },
       [](const Real& x) { return exp(-x / two) / (two * sqr(one + exp(-x / two))); }},
      {"softplus(3, x)", 0.1, 9, [](const Real& x) { return x * log(one + exp(Real(3.0) / x)); },
       [](const Real& x) { return log(one + exp(Real(3.0) / x)) - Real(3.0) / x / (one + exp(Real(-3.0) / x)); },
       [](const Real& x) {
         const Real u = Real(3.0) / x, e = exp(-u);
         return sqr(u) * e / sqr(one + e) / x;
       }},
      {"smooth_gate(x)", 0.01, 9, [](const Real& x) { return exp(-one / x); },
       [](const Real& x) { return exp(-one / x) / sqr(x); },
       [](const Real& x) { return exp(-one / x) * (one - two * x) / sqr(sqr(x)); }},
      {"smooth_gate(x)", -9, 0, [](const Real&) { return Real(); }, [](const Real&) { return Real(); },
       [](const Real&) { return Real(); }}};
  return formulas;
}

TEST(TextEquations, FunctionsAreTheirFormulas) {
  TracedRandom random(82);
  for (const Formula& formula : Formulas()) {
    SCOPED_TRACE(formula.text);
    for (int trial = 0; trial < 50; ++trial) {
      const Real x(random.Uniform(formula.from, formula.to));
      const Ranges at(formula.text, x);
      EXPECT_TRUE(Agree(at.value, formula.value(x))) << x.text();
      EXPECT_TRUE(Agree(at.first, formula.first(x))) << x.text();
      EXPECT_TRUE(Agree(at.second, formula.second(x))) << x.text();
    }
  }
}

// Of a single function the ranges are the least ones: what sampling finds is near both ends.
TEST(TextEquations, FunctionsHaveTheirRangesOverABox) {
  TracedRandom random(83);
  for (const Formula& formula : Formulas()) {
    SCOPED_TRACE(formula.text);
    for (int trial = 0; trial < 20; ++trial) {
      const double a = random.Uniform(formula.from, formula.to), b = random.Uniform(formula.from, formula.to);
      const double lower = std::min(a, b), upper = std::max(a, b);
      const Ranges over(formula.text, Real::FromTo(lower, upper));
      ASSERT_TRUE(over.second.IsFinite());
      for (int sample = 0; sample <= 16; ++sample) {
        const Real x(std::min(upper, lower + (upper - lower) * sample / 16));
        EXPECT_TRUE(Inside(formula.value(x), over.value));
        EXPECT_TRUE(Inside(formula.first(x), over.first));
        EXPECT_TRUE(Inside(formula.second(x), over.second));
      }
    }
  }
}

// Boxes that end just before a kink, pole or cut have a finite enclosure; those that hold it have none.
TEST(TextEquations, NothingIsFiniteAcrossAKinkOrPole) {
  struct Odd {
    const char* text;
    double at, direction;  // `at + direction` is on the smooth side
    bool has_value, has_slope;
  };
  const double pole = 0x1.921fb54442d18p+0;  // below pi / 2
  const Odd cases[] = {{"abs(x)", 0, 1, true, true},
                       {"abs(x)", 0, -1, true, true},
                       {"0*abs(x)", 0, 1, true, true},
                       {"abs(x)^2", 0, 1, true, true},
                       {"max(x, 1)", 1, 1, true, true},
                       {"max(1, x)", 1, -1, true, true},
                       {"min(2*x, 3 - x)", 1, 1, true, true},
                       {"sin(min(x, 0))", 0, -1, true, true},
                       {"sqrt(x)", 0, 1, false, false},
                       {"log(x)", 0, 1, false, false},
                       {"x^0.5", 0, 1, false, false},
                       {"1/x", 0, -1, false, false},
                       {"cos(1/x)", 0, 1, false, false},
                       {"0*(1/x)", 0, 1, false, false},
                       {"x^-3", 0, 1, false, false},
                       {"tan(x)", pole, -1, false, false},
                       {"atan(tan(x))", -pole, 1, false, false},
                       {"asin(x)", 1, -1, false, false},
                       {"acos(x)", -1, 1, false, false},
                       {"atan2(x, -1)", 0, 1, false, false},
                       {"atan2(x, -1)", 0, -1, false, false},
                       {"atan2(0, x)", 0, 1, false, false},
                       {"hypot(x, 0)", 0, 1, true, false},
                       {"softplus(1, x)", 0, 1, false, false}};
  for (const auto& [text, at, direction, has_value, has_slope] : cases) {
    SCOPED_TRACE(text);
    for (const double size : {1e-9, 0.1, 0.5}) {
      const double near = at + direction * 1e-15 * (1 + std::abs(at)), far = at + direction * size;
      const Ranges beside(text, Real::FromTo(std::min(near, far), std::max(near, far)));
      EXPECT_TRUE(beside.value.IsFinite() && beside.first.IsFinite() && beside.second.IsFinite());
      const double across = at - direction * 1e-15 * (1 + std::abs(at));
      const Ranges over(text, Real::FromTo(std::min(across, far), std::max(across, far)));
      EXPECT_FIELDS(over, (value.IsFinite(), has_value), (first.IsFinite(), has_slope));
      EXPECT_FALSE(over.second.IsFinite());
    }
  }
}

// On one side of its kink, the edge included, a function is the smooth function of that side.
TEST(TextEquations, AKinkAtTheEdgeOfTheBoxIsNone) {
  EXPECT_TRUE(Ranges("abs(x)", Real::FromTo(0.0, 1.0)).second.IsZero());
  EXPECT_TRUE(Ranges("abs(x)", Real::FromTo(-1.0, 0.0)).second.IsZero());
  EXPECT_TRUE(Ranges("abs(x^2)", Real::FromTo(-1.0, 1.0)).second.IsFinite());
  EXPECT_FALSE(Ranges("abs(x)", Real::FromTo(-0x1p-1074, 1.0)).second.IsFinite());
  EXPECT_FALSE(Ranges("sqrt(x)", Real::FromTo(0.0, 1.0)).second.IsFinite());
}

TEST(TextEquations, AKinkOfInputsOrParametersAloneIsNone) {
  EXPECT_TRUE(Ranges("x*abs(u)", Real::FromTo(-1.0, 1.0), 0.0).second.IsZero());
  EXPECT_FALSE(Ranges("x/u", 1.0, 0.0).value.IsFinite());
  EXPECT_FALSE(Ranges("x/u", 1.0, 0.0).first.IsFinite());
}

TEST(TextEquations, IntegratorsAreTheirFormulas) {
  const Real h(0.125), one(1.0), u(0.75), x(1.5);
  const Real factors[] = {one - h, one - h + sqr(h) * Real(0.5),
                          one - h + sqr(h) / Real(2.0) - power(h, 3) / Real(6.0) + power(h, 4) / Real(24.0)};
  const Integrator integrators[] = {Integrator::kEuler, Integrator::kMidpoint, Integrator::kRk4};
  for (std::size_t i = 0; i < 3; ++i) {  // x' = u - x: the rest point u moves nothing
    const auto equations = EquationsOf(OneState("u - x", integrators[i]));
    const std::vector<Real> z{x, u};
    EXPECT_TRUE(Agree(equations->Value(z)[0], u + factors[i] * (x - u)));
    const auto first = equations->First(z);
    ASSERT_EQ(first.size(), 2u);
    EXPECT_TRUE(Agree(first[0].value, factors[i]));
    EXPECT_TRUE(Agree(first[1].value, one - factors[i]));
    EXPECT_TRUE(equations->Second(z).empty());
  }
}

// Of the pendulum, stage by stage.
TEST(TextEquations, RungeKuttaTakesItsStagesAtTheRightPlaces) {
  const auto equations = EquationsOf(TextModel({{"angle", "rate"}, {"rate", "u - pull*sin(angle)"}}, {"u"},
                                               {{"dt", 0.2, 0.2}, {"pull", 9.81, 9.81}}, {}, Integrator::kRk4));
  const Real h(0.2), pull(9.81), two(2.0), six(6.0), u(0.3);
  using State = std::array<Real, 2>;
  const auto rates = [&](const State& s) { return State{s[1], u - pull * sin(s[0])}; };
  const auto moved = [](const State& s, const Real& length, const State& k) {
    return State{s[0] + length * k[0], s[1] + length * k[1]};
  };
  const State x{0.4, -0.7}, k1 = rates(x), k2 = rates(moved(x, h / two, k1)), k3 = rates(moved(x, h / two, k2)),
                            k4 = rates(moved(x, h, k3));
  const auto next = equations->Value(std::vector<Real>{x[0], x[1], u});
  for (std::size_t i = 0; i < 2; ++i)
    EXPECT_TRUE(Agree(next[i], x[i] + h / six * (k1[i] + two * k2[i] + two * k3[i] + k4[i])));
}

TEST(TextEquations, ParametersMayBeIntervals) {
  const auto equations = EquationsOf(TextModel({{"x", "x + dt*k*x^2"}}, {}, {{"dt", 0.5, 0.5}, {"k", 2, 3}}));
  const std::vector<Real> z{2.0};
  EXPECT_TRUE(AreEqual(equations->Value(z)[0], Real::FromTo(6.0, 8.0)));
  EXPECT_TRUE(AreEqual(equations->First(z)[0].value, Real::FromTo(5.0, 7.0)));
  EXPECT_TRUE(AreEqual(equations->Second(z)[0].value, Real::FromTo(2.0, 3.0)));
}

TEST(TextEquations, DefinitionsMayUseEarlierOnes) {
  const auto equations =
      EquationsOf(TextModel({{"x", "b + x"}}, {}, {{"dt", 0.5, 0.5}}, {{"a", "dt*x"}, {"b", "a^2 + a"}}));
  EXPECT_EQ(equations->Value(std::vector<Real>{4.0})[0].ToDouble(), 10);
  EXPECT_THROW(
      static_cast<void>(EquationsOf(TextModel({{"x", "b"}}, {}, {{"dt", 0.5, 0.5}}, {{"b", "a"}, {"a", "x"}}))),
      ExpressionError);
}

TEST(TextEquations, OnlyDerivativesThatCanBeNonzeroAreListed) {
  const auto equations =
      EquationsOf(TextModel({{"x", "x + dt*v*cos(q)"}, {"v", "v + dt*u"}, {"q", "q"}}, {"u"}, {{"dt", 0.5, 0.5}}));
  const std::vector<Real> z{1.0, 2.0, 3.0, 4.0};
  EXPECT_EQ(equations->First(z).size(), 6u);
  const auto second = equations->Second(z);
  ASSERT_EQ(second.size(), 2u);
  EXPECT_EQ(std::tie(second[0].output, second[0].row, second[0].column), std::make_tuple(0, 1, 2));
  EXPECT_EQ(std::tie(second[1].output, second[1].row, second[1].column), std::make_tuple(0, 2, 2));
}

TEST(TextEquations, RefuseWhatIsNoModel) {
  const auto refusal = [](const ModelText& model) -> std::string {
    return Thrown<ExpressionError>([&] { static_cast<void>(EquationsOf(model)); });
  };
  const ModelText good = OneState("x + u", Integrator::kEuler);
  EXPECT_EQ(refusal(good), "");
  ModelText model = good;
  model.equations[0] = {"x + w", 4, 20};
  EXPECT_EQ(refusal(model), "line 4, column 24: unknown name w");
  model = good;
  model.equations.clear();
  EXPECT_EQ(refusal(model), "a model has states and an equation for each");
  model = good;
  model.inputs[0].name = "x";
  EXPECT_EQ(refusal(model), "the name x has two meanings");
  model = good;
  model.states[0].name = "sin";
  EXPECT_EQ(refusal(model), "the language has a meaning of its own for the name sin");
  model = good;
  model.parameters[0].name = "period";
  EXPECT_EQ(refusal(model), "an integrator needs the parameter dt");
  for (const auto& [lower, upper] : {std::pair(1.0, 0.5), {std::nan(""), 1.0}, {0.0, HUGE_VAL}}) {
    model = good;
    model.parameters.push_back({"k", lower, upper});
    EXPECT_EQ(refusal(model), "the parameter k has to lie between two finite numbers");
  }
}

// Of functions that have all derivatives everywhere.
const RuledExpression::Rules kSmooth{
    .rules =
        "(A + B); (A - B); A*B; A*B; (A)/(3 + (B)^2); -A; (A)^#; sin(A); cos(A); tan(tanh(A)); "
        "asin(0.9*sin(A)); acos(0.9*tanh(A)); sqrt(1.5 + cos(A)); exp(sin(A)); log(2 + (A)^2); "
        "atan2(A, 2 + sin(B)); hypot(A, 1 + atan(B)^2); (2 + cos(A))^tanh(B)",
    .least_power = 0,
    .largest_power = 4};

class RandomTexts : public testing::TestWithParam<int> {};

TEST_P(RandomTexts, HaveTheDerivativesOfTheirValues) {
  TracedRandom random(900 + static_cast<std::uint64_t>(GetParam()));
  const Real step(0x1p-60);
  for (int trial = 0; trial < 60; ++trial) {
    RuledExpression expression(random, kSmooth, {"x", "y", "u", "0.75", "x", "y", "k"});
    const std::string first_text = expression(4), second_text = expression(3);
    SCOPED_TRACE(first_text + " ; " + second_text);
    const auto equations =
        EquationsOf(TextModel({{"x", first_text}, {"y", second_text}}, {"u"}, {{"dt", 0.25, 0.25}, {"k", 1.25, 1.25}},
                              {}, static_cast<Integrator>(GetParam())));
    std::vector<Real> point, box;
    for (int l = 0; l < 3; ++l) {
      const double lower = random.Uniform(-1, 1), upper = l < 2 ? lower + random.Uniform(0, 0.2) : lower;
      point.emplace_back(random.Uniform(lower, upper));
      box.push_back(Real::FromTo(lower, upper));
    }
    std::array<std::array<Real, 3>, 2> slopes, range_of_slopes;
    std::array<std::array<Real, 4>, 2> bends, range_of_bends;
    for (const auto& entry : equations->First(point))
      slopes[static_cast<std::size_t>(entry.output)][static_cast<std::size_t>(entry.variable)] = entry.value;
    for (const auto& entry : equations->First(box))
      range_of_slopes[static_cast<std::size_t>(entry.output)][static_cast<std::size_t>(entry.variable)] = entry.value;
    for (const auto& entry : equations->Second(point))
      bends[static_cast<std::size_t>(entry.output)][static_cast<std::size_t>(entry.row + entry.column)] = entry.value;
    for (const auto& entry : equations->Second(box))
      range_of_bends[static_cast<std::size_t>(entry.output)][static_cast<std::size_t>(entry.row + entry.column)] =
          entry.value;
    for (std::size_t l = 0; l < 3; ++l) {
      std::vector<Real> above = point, below = point;
      above[l] += step;
      below[l] -= step;
      const auto up = equations->Value(above), down = equations->Value(below);
      for (std::size_t k = 0; k < 2; ++k) {
        const Real quotient = (up[k] - down[k]) / (Real(2.0) * step);
        EXPECT_TRUE(CertainlyBelow(abs(quotient - slopes[k][l]), Real(0x1p-60) * (Real(1.0) + abs(quotient))));
        EXPECT_TRUE(Inside(slopes[k][l], range_of_slopes[k][l]));
        std::array<Real, 3> change;
        for (const auto& entry : equations->First(above))
          if (entry.output == static_cast<int>(k)) change[static_cast<std::size_t>(entry.variable)] += entry.value;
        for (const auto& entry : equations->First(below))
          if (entry.output == static_cast<int>(k)) change[static_cast<std::size_t>(entry.variable)] -= entry.value;
        for (std::size_t j = 0; j < 2 && l < 2; ++j) {
          const Real bend = change[j] / (Real(2.0) * step);
          EXPECT_TRUE(CertainlyBelow(abs(bend - bends[k][l + j]), Real(0x1p-60) * (Real(1.0) + abs(bend))));
          EXPECT_TRUE(Inside(bends[k][l + j], range_of_bends[k][l + j]));
        }
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Integrators, RandomTexts, testing::Range(0, 4));

}  // namespace forereach::verifier::text_equations_test
