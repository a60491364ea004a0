// The nearest plan to a refused one that can be certified.
#include "tests/test.h"

#include "certifier/gate/gate.h"
#include "certifier/gate/repair.h"
#include "lcmtypes/seal.h"
#include "tests/certifier/small_task.h"

namespace forereach::repair_test {

constexpr int kProgress = 6, kAskedSteps = 10;

// The small task of a robot that brakes as hard as it has to, and has to be at rest at the end.
Config BrakingTask() {
  Config config = SmallTask();
  Own(config.problem).rest = {{2, 0.1}, {3, 0.1}};
  config.laws.stop = {{{"-vx/0.15", 1, 1}, {"-vy/0.15", 1, 1}}};
  config.laws.at_rest = {{2, 0.01}, {3, 0.01}};
  config.planner.tail_steps = 40;
  return config;
}

struct RepairTest : testing::Test {
  void Begin(Config config) {
    config_ = std::move(config);
    gate_.emplace(config_);
  }
  void Change(const std::function<void(Problem&)>& change) {
    Problem& problem = Own(config_.problem);
    change(problem);
    gate_.emplace(config_);
  }

  // Six steps with this acceleration along px, and then as hard a stop as the robot can.
  candidate_plan_t Asking(double acceleration, double sideways = 0) {
    candidate_plan_t candidate = Candidate(++id_, acceleration);
    candidate.repair = 1;
    candidate.num_steps = kProgress + 15;
    double vx = candidate.initial_center[2] + 0.15 * kProgress * acceleration,
           vy = candidate.initial_center[3] + 0.15 * kProgress * sideways;
    for (int t = 0; t < candidate.num_steps; ++t) {
      const bool brakes = t >= kProgress;
      candidate.control[t][0] = brakes ? std::clamp(-vx / 0.15, -3.0, 3.0) : acceleration;
      candidate.control[t][1] = brakes ? std::clamp(-vy / 0.15, -3.0, 3.0) : sideways;
      if (brakes) vx += 0.15 * candidate.control[t][0], vy += 0.15 * candidate.control[t][1];
    }
    return candidate;
  }

  std::optional<advice_t> RepairOf(
      const candidate_plan_t& candidate, const std::function<bool()>& goes_on = [] { return true; }) {
    decision_ = gate_->Decide(Encode(candidate), kNow).decision;
    return gate_->Repair(candidate, decision_, goes_on);
  }

  // As its planner does.
  GateAnswer Sent(const advice_t& advice) {
    candidate_plan_t candidate = advice.proposal;
    candidate.utime = kNow;
    candidate.plan_id = ++id_;
    return gate_->Decide(Encode(candidate), kNow);
  }

  // The positions of the nominal plan, after the point mass's equations.
  static std::vector<Eigen::Vector2d> PlacesOf(const candidate_plan_t& plan) {
    Eigen::Vector4d x = Eigen::Map<const Eigen::Vector4d>(plan.initial_center);
    std::vector<Eigen::Vector2d> places{x.head<2>()};
    const auto model = MakePointMass(0.15);
    for (int t = 0; t < plan.num_steps; ++t) {
      Eigen::VectorXd z(6);
      z << x, plan.control[t][0], plan.control[t][1];
      model->Evaluate({z.data(), 6}, {x.data(), 4});
      places.emplace_back(x.head<2>());
    }
    return places;
  }

  Config config_;
  std::optional<Gate> gate_;
  decision_t decision_{};
  std::int64_t id_ = 0;
};

struct BrakingRepairTest : RepairTest {
  BrakingRepairTest() { Begin(BrakingTask()); }
};

TEST_F(BrakingRepairTest, ProposesAPlanThatTheGateCertifies) {
  for (const double acceleration : {2.0, 2.3, 2.6, 3.0}) {
    const candidate_plan_t candidate = Asking(acceleration);
    const auto advice = RepairOf(candidate);
    ASSERT_EQ(decision_.cause, decision_t::CAUSE_OBSTACLE) << acceleration;
    ASSERT_TRUE(advice && advice->changed != 0) << acceleration;
    EXPECT_TRUE(Sent(*advice).certified) << acceleration;
    EXPECT_EQ(std::tuple(advice->plan_id, advice->candidate_utime, GetDigest(advice->plan_digest)),
              std::tuple(candidate.plan_id, candidate.utime, PlanDigest(candidate)));
    EXPECT_EQ(GroundsOf(*advice), gate_->grounds());
    EXPECT_EQ(advice->num_changes, 0);
    const candidate_plan_t& proposal = advice->proposal;
    EXPECT_EQ(std::tuple(proposal.utime, proposal.sequence, proposal.plan_id, proposal.repair), std::tuple(0, 0, 0, 0))
        << "its sender sets them";
    EXPECT_EQ(std::tuple(proposal.start_utime, proposal.step_us, GetText(proposal.source)),
              std::tuple(candidate.start_utime, candidate.step_us, GetText(candidate.source)));
    EXPECT_TRUE(std::ranges::equal(proposal.initial_center, candidate.initial_center));
    EXPECT_TRUE(std::ranges::equal(proposal.initial_half_width, candidate.initial_half_width));
  }
}

TEST_F(BrakingRepairTest, SaysHowFarThePlansAreApart) {
  const candidate_plan_t candidate = Asking(2);
  const auto advice = RepairOf(candidate);
  ASSERT_TRUE(advice && advice->changed != 0);
  const auto before = PlacesOf(candidate), after = PlacesOf(advice->proposal);
  std::array<double, 2> nearness{};
  for (std::size_t t = 0; t < std::max(before.size(), after.size()); ++t) {
    const double distance = (before[std::min(t, before.size() - 1)] - after[std::min(t, after.size() - 1)]).norm();
    if (t <= kProgress) nearness[0] = std::max(nearness[0], distance);
    nearness[1] = std::max(nearness[1], distance);
  }
  EXPECT_NEAR(advice->nearness[0], nearness[0], 1e-12);
  EXPECT_NEAR(advice->nearness[1], nearness[1], 1e-12);
  EXPECT_LE(nearness[0], nearness[1]);
}

TEST_F(BrakingRepairTest, IsNearerThanAStopAtOnce) {
  const candidate_plan_t candidate = Asking(2);
  const auto advice = RepairOf(candidate);
  ASSERT_TRUE(advice && advice->changed != 0);
  const RobotMotion motion(config_, Braking::kPlanned);
  Eigen::MatrixXd stop;
  ASSERT_TRUE(motion.Brake({candidate.initial_center, 4}, 0, 40, stop));
  candidate_plan_t stops = candidate;
  stops.num_steps = static_cast<std::int16_t>(stop.cols());
  stops.progress_steps = 0;
  for (int t = 0; t < stops.num_steps; ++t) std::ranges::copy(stop.col(t), stops.control[t]);
  ASSERT_TRUE(Sent({.proposal = stops}).certified) << "a stop is a repair, too";
  EXPECT_LT(advice->nearness[0], 0.8 * (PlacesOf(candidate)[kProgress] - PlacesOf(stops).back()).norm());
}

// What it tries first, on a way that bends: it stays on this way, and gets less far.
TEST_F(BrakingRepairTest, DrivesItsOwnWaySlowerFirst) {
  const candidate_plan_t candidate = Asking(2.2, 1);
  ASSERT_TRUE(RepairOf(candidate));
  std::optional<advice_t> first;
  for (int most = 1; !first || first->changed == 0; ++most) {
    ASSERT_LT(most, 1000);
    int count = 0;
    first = gate_->Repair(candidate, decision_, [&] { return ++count <= most; });
  }
  EXPECT_EQ(first->changed, kSlower);
  const auto before = PlacesOf(candidate), after = PlacesOf(first->proposal);
  for (int t = 1; t <= kProgress; ++t) {
    double beside = kInfinity;
    for (int i = 0; i <= 100 * kProgress; ++i) {
      const auto step = static_cast<std::size_t>(i / 100);
      const double part = i % 100 / 100.0;
      const Eigen::Vector2d on_way = (1 - part) * before[step] + part * before[step + 1];
      beside = std::min(beside, (on_way - after[static_cast<std::size_t>(t)]).norm());
    }
    EXPECT_LT(beside, 0.02) << t;
  }
  EXPECT_LT(after[kProgress].norm(), before[kProgress].norm() - 0.05);
}

// To where it was heading, and so the plan keeps most of its way.
TEST_F(BrakingRepairTest, PushesAPlanPastAnObstacleThatItGrazes) {
  config_.obstacles = {Obstacle::Circle(Eigen::Vector2d(1.2, -0.45), 0.5)};
  Begin(config_);
  const auto advice = RepairOf(Asking(1));
  ASSERT_EQ(decision_.cause, decision_t::CAUSE_OBSTACLE);
  ASSERT_TRUE(advice);
  EXPECT_EQ(advice->changed & kPushed, kPushed);
  EXPECT_LT(advice->nearness[0], 0.25);
  EXPECT_GT(PlacesOf(advice->proposal)[kProgress].x(), 1.2) << "it has passed it";
  EXPECT_TRUE(Sent(*advice).certified);
}

TEST_F(BrakingRepairTest, DrivesSlowerWhereALimitBoundsTheSpeed) {
  Change([](Problem& problem) {
    problem.limits = {{.name = "speed squared", .that = {"vx^2 + vy^2", 1, 1}, .at_most = 2}};
  });
  const candidate_plan_t candidate = Asking(0.6);
  const auto advice = RepairOf(candidate);
  ASSERT_EQ(decision_.cause, decision_t::CAUSE_LIMIT);
  ASSERT_TRUE(advice);
  EXPECT_NE(advice->changed & (kSlower | kPushed), 0);
  EXPECT_LT(advice->nearness[0], 0.2);
  EXPECT_TRUE(Sent(*advice).certified);
}

TEST_F(BrakingRepairTest, GivesAPlanThatDoesNotStopItsTail) {
  candidate_plan_t candidate = Asking(0.2);
  candidate.num_steps = candidate.progress_steps = kProgress;
  const auto advice = RepairOf(candidate);
  ASSERT_EQ(decision_.cause, decision_t::CAUSE_NO_STOP);
  ASSERT_TRUE(advice && advice->changed != 0);
  EXPECT_LT(advice->nearness[0], 0.05) << "it does what it did, and then stops";
  EXPECT_TRUE(Sent(*advice).certified);
}

TEST_F(BrakingRepairTest, BringsInputsBackIntoTheirBox) {
  const auto advice = RepairOf(Asking(3.5));
  ASSERT_EQ(decision_.cause, decision_t::CAUSE_DOMAIN_EXIT);
  ASSERT_TRUE(advice && advice->changed != 0);
  for (int t = 0; t < advice->proposal.num_steps; ++t) EXPECT_LE(std::abs(advice->proposal.control[t][0]), 3);
  EXPECT_TRUE(Sent(*advice).certified);
}

TEST_F(BrakingRepairTest, KeepsAStateInItsDomain) {
  Change([](Problem& problem) { problem.domain.state = Within({20, 20, 1.6, 1.6}); });
  const auto advice = RepairOf(Asking(1));
  ASSERT_EQ(decision_.cause, decision_t::CAUSE_DOMAIN_EXIT);
  ASSERT_TRUE(advice && advice->changed != 0);
  EXPECT_TRUE(Sent(*advice).certified);
}

TEST_F(BrakingRepairTest, HasNoneWhereEvenTheStartIsRefused) {
  config_.obstacles = {Obstacle::Circle(Eigen::Vector2d(0, 0), 0.5)};
  Begin(config_);
  const auto advice = RepairOf(Asking(1));
  ASSERT_TRUE(advice) << "and says so";
  EXPECT_EQ(std::tuple(advice->changed, advice->num_changes, advice->nearness[0], advice->nearness[1]),
            std::tuple(0, 0, 0.0, 0.0));
  EXPECT_EQ(Encode(advice->proposal), Encode(candidate_plan_t{}));
}

TEST_F(BrakingRepairTest, IsGivenOnlyToAnAbstentionUnderTheSameGroundsThatAskedForIt) {
  const auto always = [] { return true; };
  candidate_plan_t candidate = Asking(2);
  ASSERT_TRUE(RepairOf(candidate));
  const decision_t refused = decision_;
  decision_t other = refused;
  other.obstacles_digest[0] ^= 1;
  EXPECT_FALSE(gate_->Repair(candidate, other, always));
  other = refused;
  ++other.step;
  EXPECT_FALSE(gate_->Repair(candidate, other, always));
  for (const std::int16_t outcome :
       {decision_t::CERTIFIED, decision_t::REJECTED, decision_t::ABSTAIN_FALSIFIED, decision_t::ABSTAIN_DEADLINE}) {
    other = refused;
    other.outcome = outcome;
    EXPECT_FALSE(gate_->Repair(candidate, other, always)) << outcome;
  }
  for (const int wish : {0, 2, -1}) {
    candidate.repair = static_cast<std::int16_t>(wish);
    EXPECT_FALSE(gate_->Repair(candidate, refused, always)) << wish;
  }
  candidate.repair = 1;
  for (const int steps : {129, -1, 0}) {
    candidate_plan_t wrong = candidate;
    wrong.num_steps = static_cast<std::int16_t>(steps);
    EXPECT_FALSE(gate_->Repair(wrong, refused, always)) << steps;
  }
  for (const int progress : {-1, 22}) {
    candidate_plan_t wrong = candidate;
    wrong.progress_steps = static_cast<std::int16_t>(progress);
    EXPECT_FALSE(gate_->Repair(wrong, refused, always)) << progress;
  }
  EXPECT_TRUE(gate_->Repair(candidate, refused, always));
}

// However many times it may go on, what it gives is certified, and more time gives nothing farther.
TEST_F(BrakingRepairTest, GivesTheBestSoFarWhenItHasToEnd) {
  const candidate_plan_t candidate = Asking(2.5);
  int asked = 0;
  const auto all = RepairOf(candidate, [&] { return ++asked > 0; });
  ASSERT_TRUE(all && all->changed != 0);
  EXPECT_LT(asked, 2000);
  double nearness = kInfinity;
  for (int most = 0; most <= asked; most += 1 + most / 4) {
    int count = 0;
    const auto advice = gate_->Repair(candidate, decision_, [&] { return ++count <= most; });
    EXPECT_LE(count, most + 1) << "nothing is tried after that";
    EXPECT_EQ(advice.has_value(), most > 0) << most;
    if (!advice || advice->changed == 0) continue;
    EXPECT_TRUE(Sent(*advice).certified) << most;
    EXPECT_LE(advice->nearness[0], nearness) << most;
    nearness = advice->nearness[0];
  }
  EXPECT_LE(all->nearness[0], nearness);
  const auto again = gate_->Repair(candidate, decision_, [] { return true; }).value();
  EXPECT_EQ(Encode(again.proposal), Encode(all->proposal)) << "the same each time";
}

// Nobody says how it brakes.
TEST_F(RepairTest, OnlyPushesAPlanWithoutALawOfBraking) {
  Begin(SmallTask());
  const auto advice = RepairOf(Asking(2));
  ASSERT_EQ(decision_.cause, decision_t::CAUSE_OBSTACLE);
  ASSERT_TRUE(advice);
  EXPECT_FIELDS(*advice, (changed, kPushed), (proposal.num_steps, kProgress + 15));
  EXPECT_TRUE(Sent(*advice).certified);
}

// What moves it away from the obstacle leaves it with a speed at its end, and the next push takes that away again.
TEST_F(RepairTest, WithoutALawOfBrakingItsPushesKeepTheEndAtRest) {
  Config config = BrakingTask();
  config.laws.stop.clear();
  Begin(config);
  const auto advice = RepairOf(Asking(2));
  ASSERT_EQ(decision_.cause, decision_t::CAUSE_OBSTACLE);
  ASSERT_TRUE(advice);
  EXPECT_EQ(advice->changed, kPushed);
  EXPECT_TRUE(Sent(*advice).certified);
}

}  // namespace forereach::repair_test
