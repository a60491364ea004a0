// Which operation of a text meets its kink or pole.
#include "forereach/dynamics/unbounded.h"

#include "tests/test.h"

#include "forereach/dynamics/models/named_models.h"
#include "forereach/dynamics/text_model.h"
#include "tests/text_models.h"

namespace forereach::unbounded_test {

using Integrator = ModelText::Integrator;

// x follows the equation; v and w are states beside it, u is an input.
ModelText Of(const std::string& x, Integrator integrator = Integrator::kNone, const Lines& definitions = {}) {
  return TextModel({{"w", "w"}, {"x", x}, {"v", "v - 10*dt"}}, {"u"}, {{"dt", 0.1, 0.1}, {"p", -1, 1}}, definitions,
                   integrator);
}

// w in [2, 3], x in [0.5, 0.75].
std::optional<Unbounded> Find(const ModelText& text, const Interval& v, double u = 0, int state = 1) {
  return FindUnbounded(*MakeTextModel(text), std::array{Interval(2, 3), Interval(0.5, 0.75), v, Interval(u)}, state);
}

TEST(FindUnbounded, NamesTheFunctionItsPlaceAndItsArgument) {
  const auto found = Find(Of("x + dt*abs(v)"), {-0.25, 0.5}).value();
  EXPECT_FIELDS(found, (operation, "abs"), (line, 1), (column, 8), (states, std::vector<int>{2}),
                (argument, Interval(-0.25, 0.5)));
}

// v in the box, and the model's function of it.
std::vector<SharpSmoothing> Sharp(const std::string& equation, const Interval& v) {
  return FindSharp(*MakeTextModel(Of(equation)), std::array{Interval(2, 3), Interval(0.5, 0.75), v, Interval(0)});
}

TEST(FindSharp, NamesASmoothingThatIsNarrowerThanTheBoxAndMeetsZero) {
  for (const char* equation : {"x + dt*v*hypot(v, 0.25)", "x - dt*(hypot(0.25, v)*v)", "x + v*sqrt(v^2 + 0.0625)",
                               "x + sqrt(0.0625 + v*v)*v"}) {
    const auto found = Sharp(equation, {-0.5, 1});
    ASSERT_EQ(found.size(), 1u) << equation;
    EXPECT_NEAR(found[0].width, 0.25, 1e-15);
    EXPECT_FIELDS(found[0], (argument, "v"), (range, Interval(-0.5, 1)));
    EXPECT_TRUE(found[0].is_square) << equation;
  }
  EXPECT_EQ(Sharp("x + dt*v*hypot(v, 0.25)", {-0.5, 1})[0].column, 10);
  EXPECT_FALSE(Sharp("x + w*hypot(v, 0.25)", {-0.5, 1})[0].is_square);
  EXPECT_EQ(Sharp("x + w*hypot(v - 0.1, 0.25)", {-0.5, 1})[0].argument, "");
}

TEST(FindSharp, IsSilentWhereTheBoxIsNarrowOrAwayFromZero) {
  EXPECT_TRUE(Sharp("x + v*hypot(v, 0.25)", {-0.25, 0.25}).empty());
  EXPECT_EQ(Sharp("x + v*hypot(v, 0.25)", {-0.25, 0.26}).size(), 1u);
  EXPECT_TRUE(Sharp("x + v*hypot(v, 0.25)", {0x1p-30, 1}).empty());
  EXPECT_TRUE(Sharp("x + hypot(v, w) + hypot(1, 2) + sqrt(v + 4) + sqrt(v^2 + w) + hypot(v, 0)", {0x1p-30, 1}).empty());
  EXPECT_TRUE(Sharp("x + signed_square(v)", {-1, 1}).empty());
}

struct Case {
  const char *equation, *operation;
  Interval meets, misses;  // of v
  friend void PrintTo(const Case& of, std::ostream* out) { *out << of.equation; }
};

class OfAnOperation : public testing::TestWithParam<Case> {};

TEST_P(OfAnOperation, IsFoundOnlyWhereItMayMeetItsKinkOrPole) {
  const auto& [equation, operation, meets, misses] = GetParam();
  EXPECT_EQ(Find(Of(equation), meets).value().operation, operation);
  EXPECT_FALSE(Find(Of(equation), misses));
}

constexpr double kBelow = -0x1p-30, kAbove = 0x1p-30;

INSTANTIATE_TEST_SUITE_P(
    Operations, OfAnOperation,
    testing::Values(
        Case{"x/v", "/", {0, 1}, {kAbove, 1}}, Case{"x/v", "/", {-1, 0}, {-1, kBelow}},
        Case{"v^-2", "^", {-1, 1}, {kAbove, 1}}, Case{"v^0.5", "^", {0, 1}, {kAbove, 1}},
        Case{"x^v^0.5", "^", {0, 1}, {kAbove, 1}}, Case{"sqrt(v)", "sqrt", {0, 1}, {kAbove, 1}},
        Case{"log(v)", "log", {kBelow, 1}, {kAbove, 1}}, Case{"abs(v)", "abs", {0, 1}, {kAbove, 1}},
        Case{"asin(v)", "asin", {0.5, 1}, {0.5, 1 + kBelow}}, Case{"acos(v)", "acos", {-1, 0.5}, {-1 + kAbove, 0.5}},
        Case{"tan(v)", "tan", {1, 2}, {1, 1.5}}, Case{"min(x, v)", "min", {0.75, 1}, {0.75 + kAbove, 1}},
        Case{"max(v, x)", "max", {0, 0.5}, {0, 0.5 + kBelow}}, Case{"atan2(v, x - 1)", "atan2", {0, 1}, {kAbove, 1}},
        Case{"hypot(v, x - 0.5)", "hypot", {0, 1}, {kAbove, 1}}, Case{"exp(v)", "exp", {0, 1000}, {0, 700}}));

TEST(FindUnbounded, FindsNothingWhereEverythingIsBounded) {
  EXPECT_FALSE(Find(Of("x + abs(v)*sin(w)/w + sqrt(2 + x) + atan2(v, w)"), {1, 2}));
  EXPECT_FALSE(Find(Of("x + abs(u) + abs(p)"), {-1, 1})) << "what depends on no state has no derivative by one";
  EXPECT_FALSE(Find(Of("x", Integrator::kNone, {{"unused", "1/v"}}), {-1, 1}));
  EXPECT_FALSE(FindUnbounded(*MakeKinematicBicycle(0.1, 2), std::vector<Interval>(8, Interval(-1, 1)), 2));
  EXPECT_FALSE(Find(Of("1/v"), {-1, 1}, 0, -1));
}

TEST(FindUnbounded, NamesTheOperationInCompiledEquations) {
  const auto found = FindUnbounded(*MakeKinematicBicycle(0.1, 2), std::vector<Interval>(8, Interval(-9, 9)), 2).value();
  EXPECT_FIELDS(found, (operation, "tan"), (states, std::vector<int>{5}));
}

TEST(FindUnbounded, APoleInAnInputOrAParameterCounts) {
  EXPECT_EQ(Find(Of("x/u"), {1, 2})->operation, "/");
  EXPECT_EQ(Find(Of("x + 1/p"), {1, 2})->operation, "/");
  EXPECT_FALSE(Find(Of("x/u"), {1, 2}, 0.5));
}

TEST(FindUnbounded, NamesTheFirstInTheOrderOfTheTextAndThroughDefinitions) {
  EXPECT_EQ(Find(Of("sqrt(abs(v))"), {-1, 1})->operation, "abs");
  EXPECT_EQ(Find(Of("1/x + 1/v + sqrt(v)"), {-1, 1})->column, 8);
  const auto found = Find(Of("x + a*b", Integrator::kNone, {{"a", "1/w"}, {"b", "2*log(v)"}}), {-1, 1}).value();
  EXPECT_FIELDS(found, (operation, "log"), (column, 3));
}

TEST(FindUnbounded, TheAskedStateComesFirst) {
  ModelText text = Of("abs(v)");
  text.equations[0].text = "sqrt(v)";
  EXPECT_EQ(Find(text, {-1, 1}, 0, 0)->operation, "sqrt");
  EXPECT_EQ(Find(text, {-1, 1}, 0, 1)->operation, "abs");
  EXPECT_EQ(Find(text, {-1, 1}, 0, 2)->operation, "sqrt") << "v itself has none";
}

// v' = v - 1, so v falls through zero within the step.
TEST(FindUnbounded, FindsAKinkInALaterStageOfTheStep) {
  for (const Integrator integrator : {Integrator::kMidpoint, Integrator::kRk4}) {
    const auto found = Find(Of("abs(v)", integrator), {0.02, 0.08}).value();
    EXPECT_EQ(found.operation, "abs");
    EXPECT_LT(found.argument.lower, 0);
    EXPECT_FALSE(Find(Of("abs(v)", integrator), {2, 3}));
  }
  EXPECT_FALSE(Find(Of("abs(v)", Integrator::kEuler), {0.02, 0.08})) << "Euler's step looks at its beginning only";
}

}  // namespace forereach::unbounded_test
