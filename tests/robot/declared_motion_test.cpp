// Motions that break by a little what a task declares of a step's duration: the guard stops them, and no others.
#include "tests/test.h"

#include "certifier/gate/gate.h"
#include "forereach/dynamics/text_model.h"
#include "robot/guard.h"
#include "task/config.h"
#include "tests/text_models.h"
#include "tests/worlds.h"

namespace forereach::declared_motion_test {

constexpr std::int64_t kNow = 1'700'000'000'000'000, kStart = kNow + 1'000'000, kStepUs = 125'000, kErrorUs = 15'625;
constexpr double kHair = 1e-12;

// x' = v for 1/8 s; the residual of x is 1/16 at dt and declared to grow with no more than the square of the duration;
// software sets v to v + u. Boundaries may be 1/64 s off their times, an eighth of a step.
struct DurationOfAStep : testing::Test {
  DurationOfAStep() {
    Problem problem =
        WorldOf(MakeTextModel(TextModel({{"x", "x + dt*v"}, {"v", "v + u"}}, {"u"}, {{"dt", 0.125, 0.125}})),
                Within({99, 9}), Within({1}));
    problem.projection = Eigen::MatrixXd::Identity(1, 2);
    problem.transitions = {Eigen::MatrixXd::Zero(1, 3), Vec({0.0625, 0}).transpose()};
    problem.declaration.state_error = Vec({0, 0});
    problem.timing = {.error = 0x1p-6, .set_at_steps = {1}};
    config_.period = 0.125;
    config_.gate.step_error_ms = kErrorUs / 1e3;
    config_.gate.needs_robot_state = false;
    config_.gate.obstacles = ObstaclesSource::kTask;
    config_.says_between = true;
    config_.grounds = GroundsOf(DigestOf(std::string_view("cart")), problem, {});
    config_.problem = std::make_shared<const Problem>(std::move(problem));
  }

  // The answer to this state after one step of u = 1 from (0, 2), which lasted so much longer than dt.
  GuardVerdict After(std::int64_t longer_us, double x, double v) {
    candidate_plan_t candidate{.utime = kNow,
                               .plan_id = 1,
                               .start_utime = kStart,
                               .step_us = kStepUs,
                               .num_states = 2,
                               .num_inputs = 1,
                               .num_steps = 1,
                               .progress_steps = 1};
    candidate.initial_center[1] = 2;
    candidate.control[0][0] = 1;
    const GateAnswer answer = Gate(config_).Decide(Encode(candidate), kNow);
    EXPECT_TRUE(answer.certified) << GetText(answer.decision.message);
    Guard guard({2, 1, kStepUs, {}, {}});
    EXPECT_TRUE(guard.Accept(Encode(answer.certified.value()), kNow).ok());
    EXPECT_TRUE(guard.TryStart(kStart, kStart, std::array{0.0, 2.0}).ok());
    return guard.Check(1, std::array{x, v}, kStart + kStepUs + longer_us);
  }
  // Where x ends if the residual grows with this power of the duration.
  static double End(std::int64_t longer_us, double power) {
    const double duration = static_cast<double>(kStepUs + longer_us) / 1e6;
    return 2 * duration + 0.0625 * std::pow(duration / 0.125, power);
  }

  Config config_;
};

TEST_F(DurationOfAStep, EndsInItsSliceIfTheResidualGrowsAsDeclared) {
  for (const std::int64_t longer_us : {kErrorUs, std::int64_t{0}, -kErrorUs})
    for (const double power : {1.0, 1.5, 2.0}) {
      const GuardVerdict verdict = After(longer_us, End(longer_us, power), 3);
      EXPECT_TRUE(verdict.is_inside()) << verdict.message;
    }
}

TEST_F(DurationOfAStep, IsStoppedIfTheResidualGrowsFaster) {
  const auto expect_stopped = [&](std::int64_t longer_us, double x) {
    EXPECT_FIELDS(After(longer_us, x, 3), (cause, GuardCause::kOutsideSlice), (coordinate, 0));
  };
  expect_stopped(kErrorUs, End(kErrorUs, 2) + kHair);
  expect_stopped(kErrorUs, End(kErrorUs, 3));
  expect_stopped(-kErrorUs, End(-kErrorUs, 3));
}

TEST_F(DurationOfAStep, IsStoppedIfTimeMovesAStateThatSoftwareIsSaidToSet) {
  const double x = End(kErrorUs, 1), integrated = 2 + (0.125 + 0x1p-6) / 0.125;
  for (const double v : {3 + kHair, integrated})
    EXPECT_FIELDS(After(kErrorUs, x, v), (cause, GuardCause::kOutsideSlice), (coordinate, 1));
}

}  // namespace forereach::declared_motion_test
