// Which states are angles of a model's equations.
#include "forereach/dynamics/angles.h"

#include "tests/test.h"

#include "forereach/dynamics/models/named_models.h"
#include "forereach/dynamics/text_model.h"
#include "tests/oracle/traced_random.h"
#include "tests/text_models.h"

namespace forereach::angles_test {

using Integrator = ModelText::Integrator;

// q is the angle; x follows the given equation.
ModelText Of(const std::string& x, const std::string& q, Integrator integrator = Integrator::kNone) {
  ModelText text = TextModel({{"x", x}, {"q", q}}, {"u"}, {{"dt", 0.5, 0.5}, {"k", 2, 2}, {"one", 1, 1}},
                             {{"h", "q/2"}}, integrator);
  text.angles = {"q"};
  return text;
}

class IsAnAngle : public testing::TestWithParam<const char*> {};

// f0(z + 2 pi e) = f0(z) + 2 pi e, as far as doubles show.
TEST_P(IsAnAngle, AStateWhoseTurnChangesNothingElseIsAccepted) {
  TracedRandom random(651);
  for (const Integrator integrator : {Integrator::kNone, Integrator::kEuler, Integrator::kMidpoint, Integrator::kRk4}) {
    const bool is_rate = integrator != Integrator::kNone;
    const auto model = MakeTextModel(Of(GetParam(), is_rate ? "u*cos(q)" : "q + dt*u", integrator));
    ASSERT_EQ(model->angles(), std::vector<int>{1});
    EXPECT_TRUE(model->IsAngle(1));
    EXPECT_FALSE(model->IsAngle(0));
    for (int trial = 0; trial < 20; ++trial) {
      std::array z{random.Uniform(0.1, 1), random.Uniform(-3, 3), random.Uniform(-1, 1)};
      std::array<double, 2> next, turned;
      model->Evaluate(z, next);
      z[1] += 2 * std::numbers::pi;
      model->Evaluate(z, turned);
      ASSERT_NEAR(turned[0], next[0], 1e-12);
      ASSERT_NEAR(turned[1], next[1] + 2 * std::numbers::pi, 1e-12);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Equations, IsAnAngle,
                         testing::Values("x", "x + dt*cos(q)", "x*sin(q)^2 + cos(3*q - 1)", "sin(h + h)", "sin(4*h)",
                                         "x + sin(q - u)", "exp(cos(-q))/(2 + sin(q + k*u))",
                                         "atan2(sin(q), cos(q) + 2)", "(q - q)*x + x", "sin(q*3)", "0.1*tan(h)",
                                         "0.1*tan((q + x)/2)", "sin(q/0.25)*x"));

class IsNoAngle : public testing::TestWithParam<const char*> {};

TEST_P(IsNoAngle, AStateThatIsNoAngleIsRefusedWithTheEquation) {
  for (const Integrator integrator : {Integrator::kNone, Integrator::kEuler, Integrator::kRk4})
    EXPECT_THAT([&] { return MakeTextModel(Of(GetParam(), integrator == Integrator::kNone ? "q" : "u", integrator)); },
                ThrowsMessage<std::invalid_argument>(HasSubstr("angles: q: the equation of x is not seen")));
}

INSTANTIATE_TEST_SUITE_P(Equations, IsNoAngle,
                         testing::Values("q", "x + q", "x*q", "sin(h)", "cos(q/3)", "sin(0.1*q)", "sin(k*q)", "q^2",
                                         "abs(q)", "sin(q*x)", "max(q, 0)", "sin(sqrt(q^2 + 1))", "tan(q/4)",
                                         "sin(q*0.1*10)", "sin(q/0.1)", "sin(x/q)", "q/q"));

TEST(Angles, RefuseAnEquationThatDoesNotAddToTheAngle) {
  for (const char* good : {"q", "q + dt*u", "u + q", "2*q - q", "q + sin(q)"})
    EXPECT_NO_THROW(MakeTextModel(Of("x", good))) << good;
  for (const char* wrong : {"u", "2*q", "-q", "one*q", "q + x*q", "0.5*q + 0.25*q"})
    EXPECT_THAT([&] { return MakeTextModel(Of("x", wrong)); },
                ThrowsMessage<std::invalid_argument>(HasSubstr("angles: q: the equation of q is not seen")));
  EXPECT_THAT([] { return MakeTextModel(Of("1", "q", Integrator::kEuler)); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("the equation of q")))
      << "a rate that is the angle";
}

TEST(Angles, TheCompiledBicycleTakesTheHeadingAlone) {
  EXPECT_EQ(MakeKinematicBicycle(0.1, 2, {2})->angles(), std::vector<int>{2});
  EXPECT_TRUE(MakeKinematicBicycle(0.1, 2)->angles().empty());
  for (const int wrong : {3, 4, 6, -1})  // delta stands in a tangent alone

    EXPECT_THROW(MakeKinematicBicycle(0.1, 2, {wrong}), std::invalid_argument) << wrong;
  EXPECT_THROW(MakeKinematicBicycle(0.1, 2, {2, 2}), std::invalid_argument);
  EXPECT_EQ(MakeKinematicBicycle(0.1, 2, {2})->description(), "kinematic_bicycle dt=0.1 wheelbase=2; angles theta");
  EXPECT_EQ(MakeKinematicBicycle(0.1, 2)->description(), "kinematic_bicycle dt=0.1 wheelbase=2");
}

TEST(Angles, RefuseNamesThatAreNoStates) {
  ModelText text = Of("x", "q");
  text.angles = {"u"};
  EXPECT_THROW(MakeTextModel(text), std::invalid_argument);
  text.angles = {"q", "q"};
  EXPECT_THROW(MakeTextModel(text), std::invalid_argument);
  text.angles = {"q", "x"};  // where x is does not matter to its equations either
  EXPECT_EQ(MakeTextModel(text)->angles(), (std::vector<int>{0, 1}));
}

}  // namespace forereach::angles_test
