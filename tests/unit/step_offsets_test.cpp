// Which errors of steps a problem may declare, and what a step adds for them.
#include "forereach/reach/step_offsets.h"

#include "tests/test.h"

#include "forereach/certify/certifier.h"
#include "forereach/certify/explain.h"
#include "forereach/dynamics/models/named_models.h"
#include "forereach/dynamics/text_model.h"
#include "tests/text_models.h"
#include "tests/worlds.h"

namespace forereach::step_offsets_test {

// x' = v for 0.125 s, and u sets v at once.
std::shared_ptr<const NominalModel> Cart() {
  return MakeTextModel(TextModel({{"x", "x + dt*v"}, {"v", "v + u"}}, {"u"}, {{"dt", 0.125, 0.125}}));
}

void ExpectRefusedTiming(const NominalModel& model, const StepTiming& timing, const std::string& what) {
  EXPECT_THAT([&] { StepOffsets(model, timing); }, ThrowsMessage<std::invalid_argument>(HasSubstr(what)));
}

TEST(StepOffsets, AreRefusedWhereTheyAreOutOfRange) {
  const auto model = MakePointMass(0.125);
  EXPECT_NO_THROW(StepOffsets(*model, {.error = std::nextafter(0.0625, 0.0)}));
  ExpectRefusedTiming(*model, {.error = 0.0625}, "is not below half of the step");
  ExpectRefusedTiming(*model, {.error = -0x1p-30}, "negative");
  ExpectRefusedTiming(*model, {.error = kInfinity}, "not finite");
  ExpectRefusedTiming(*model, {.error = std::nan("")}, "not finite");
  ExpectRefusedTiming(*model, {.error = 0.01, .set_at_steps = {4}}, "4 is no state");
  ExpectRefusedTiming(*model, {.error = 0.01, .rate_bound = Vec({1, 2})}, "2 entries, must be 4");
  ExpectRefusedTiming(*model, {.error = 0.01, .rate_bound = Vec({1, 1, -1, 1})}, "negative");
  ExpectRefusedTiming(*model, {.error = 0.01, .rate_bound = Vec({1, 1, std::nan(""), 1})}, "rate bound");
}

TEST(StepOffsets, NeedToKnowHowEachStateMovesWithTime) {
  const auto model = Cart();
  EXPECT_NO_THROW(StepOffsets(*model, {}));
  ExpectRefusedTiming(*model, {.error = 0.01}, "how v moves with time");
  EXPECT_NO_THROW(StepOffsets(*model, {.error = 0.01, .set_at_steps = {1}}));
  EXPECT_NO_THROW(StepOffsets(*model, {.error = 0.01, .rate_bound = Vec({kInfinity, 3})}));
}

// A cart at 2 m/s: its position is off by 2 m/s times the last offset, however many steps there were, and v only by
// what is declared of its rate, which does add up.
TEST(StepOffsets, AddUpOnlyWhereNothingSaysHowTheyAreRelated) {
  Problem problem = WorldOf(Cart(), Within(Vec({99, 9})), Within(Vec({1})));
  problem.projection = Eigen::MatrixXd::Identity(1, 2);
  problem.transitions = {Eigen::MatrixXd::Zero(1, 3), Eigen::MatrixXd::Zero(1, 2)};
  problem.timing = {.error = 0x1p-6, .set_at_steps = {1}};
  const Eigen::MatrixXd controls = Eigen::MatrixXd::Zero(1, 8);
  const Plan plan{controls.data(), 1, 8, 1};
  const Zonotope start = Zonotope::FromBox(Vec({0, 2}), Vec({0, 0}));
  const auto half_width = [&](int t, int k) {
    const Certifier certifier(std::make_shared<Problem>(problem));
    Tube tube;
    const Decision decision = certifier.Certify(plan, start, {}, tube);
    EXPECT_EQ(decision.outcome, Outcome::kCertified);
    EXPECT_THAT(Explain(decision, problem), testing::EndsWith("; steps up to 0.015625 s off their times"));
    return tube.half_width(t)[ToSize(k)];
  };
  EXPECT_EQ(half_width(0, 0), 0);
  for (const int t : {1, 2, 8}) {
    EXPECT_NEAR(half_width(t, 0), 2 * 0x1p-6, 1e-12) << t;
    EXPECT_NEAR(half_width(t, 1), 0, 1e-12) << t;
  }
  problem.timing = {.error = 0x1p-6, .rate_bound = Vec({2, 0})};
  for (const int t : {1, 2, 8}) EXPECT_NEAR(half_width(t, 0), (2 * t - 1) * 2 * 0x1p-6, 1e-12) << t;
}

// 16 states, the highest order, and the column of the offset: the most columns that a step can have.
TEST(StepOffsets, TheLargestSetsHaveRoom) {
  std::vector<std::pair<std::string, std::string>> states;
  for (int k = 0; k < kMaxStates; ++k)
    states.push_back(
        {"x" + std::to_string(k), "x" + std::to_string(k) + " + dt*x" + std::to_string((k + 1) % 16) + "*x0"});
  Problem problem = WorldOf(MakeTextModel(TextModel(states, {"u"}, {{"dt", 0.125, 0.125}})),
                            Within(Eigen::VectorXd::Constant(16, 99)), Within(Vec({1})));
  problem.projection = Eigen::MatrixXd::Identity(2, 16);
  problem.transitions = {Eigen::MatrixXd::Zero(1, 17), Eigen::MatrixXd::Zero(1, 16)};
  problem.declaration.noise_bound.setConstant(1e-3);
  problem.timing.error = 0.01;
  const Certifier certifier(std::make_shared<Problem>(problem));
  const Eigen::MatrixXd controls = Eigen::MatrixXd::Zero(1, 4);
  Tube tube;
  const Zonotope start(Eigen::VectorXd::Ones(16), 0.001 * Eigen::MatrixXd::Random(16, 80));
  ASSERT_EQ(certifier.Certify({controls.data(), 1, 4, 1}, start, {}, tube).outcome, Outcome::kCertified);
  for (int t = 1; t <= 4; ++t) EXPECT_EQ(tube.slice(t).num_generators(), 81) << t;
}

}  // namespace forereach::step_offsets_test
