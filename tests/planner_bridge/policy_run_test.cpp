// A learned policy on the bus: it proposes, the gate certifies or abstains, and the robot executes what is certified.
#include "tests/test.h"

#include "certifier/process/certifier_node.h"
#include "lcmtypes/candidate_batch.h"
#include "planner_bridge/planner_node.h"
#include "planner_bridge/policy_proposer.h"
#include "planner_bridge/reference.h"
#include "simulator/sim_node.h"
#include "tests/messages.h"
#include "tests/planner_bridge/tasks.h"

namespace forereach::policy_run_test {

const std::string kTask = FOREREACH_SOURCE_DIR "/config/policy.yaml";

/** What the bus carried in one run on a simulated clock. */
struct Traffic {
  std::vector<candidate_plan_t> candidates;
  std::vector<candidate_batch_t> batches;
  std::vector<decision_t> decisions;
  std::set<std::int64_t> certified, executed;
  nlohmann::json planner, robot;
};

Traffic RunTask(const Config& config) {
  Traffic traffic;
  std::int64_t now = 1'700'000'000'000'000;
  const Clock clock = [&now] { return now; };
  const auto bus = OpenBus("memq://", clock);
  std::ostringstream planner_out, robot_out;
  CertifierNode certifier(config, *bus, {clock, clock});
  PlannerNode planner(config, *bus, planner_out);
  RobotSimNode robot(config, *bus, robot_out);
  bus->Subscribe(config.bus.candidate, [&](const Received& received) {
    if (IsBatch(received.bytes)) return traffic.batches.push_back(Decoded<candidate_batch_t>(received.bytes).value());
    traffic.candidates.push_back(Decoded<candidate_plan_t>(received.bytes).value());
  });
  std::vector<certified_plan_t> certified;
  std::vector<robot_state_t> states;
  Hear(*bus, config.bus.decision, traffic.decisions);
  Hear(*bus, config.bus.certified, certified);
  Hear(*bus, config.bus.robot_state, states);
  for (const auto last = now + 60'000'000; !robot.done() && now < last; now += 1000)
    for (Node* node : std::initializer_list<Node*>{&robot, &planner, &certifier}) {
      node->Tick(now);
      while (bus->Dispatch(0) > 0) {
      }
    }
  for (const certified_plan_t& plan : certified) traffic.certified.insert(plan.plan.plan_id);
  for (const robot_state_t& state : states)
    if (state.mode == robot_state_t::EXECUTING) traffic.executed.insert(state.executing_plan_id);
  traffic.planner = nlohmann::json::parse(planner.Summary());
  traffic.robot = nlohmann::json::parse(robot.Summary());
  return traffic;
}

TEST(PolicyRun, ThePolicyProposesTheGateDecidesAndOnlyCertifiedPlansAreDriven) {
  const Config config = LoadConfig(kTask);
  const Traffic traffic = RunTask(config);
  ASSERT_FALSE(traffic.candidates.empty());
  EXPECT_EQ(traffic.decisions.size(), traffic.candidates.size());
  std::set<std::int64_t> decided_certified;
  int abstentions = 0;
  for (const decision_t& decision : traffic.decisions)
    if (decision.outcome == decision_t::CERTIFIED)
      decided_certified.insert(decision.plan_id);
    else
      ++abstentions;
  EXPECT_GT(abstentions, 0) << "a course on which the policy runs into nothing shows nothing";
  EXPECT_EQ(decided_certified, traffic.certified);
  EXPECT_FALSE(traffic.executed.empty());
  EXPECT_TRUE(std::ranges::includes(traffic.certified, traffic.executed));
  EXPECT_FIELDS(traffic, (robot["contacts"], 0), (robot["steps_inside_slice"], traffic.robot["steps_executed"]),
                (robot["goal_reached"], true), (planner["proposed"], traffic.candidates.size()));
}

TEST(PolicyRun, ManySamplesAreSentInBatchesWithOneDecisionEach) {
  Config config = LoadConfig(kTask);
  config.planner.policy_samples = 100;
  const Traffic traffic = RunTask(config);
  ASSERT_FALSE(traffic.batches.empty());
  EXPECT_FIELDS(traffic, (decisions.size(), traffic.batches.size() + traffic.candidates.size()),
                (planner["proposed"], traffic.decisions.size()), (planner["messages_ignored"], 0));
  std::map<std::int64_t, int> size_by_first, index_by_certified;
  for (const candidate_batch_t& batch : traffic.batches) {
    EXPECT_EQ(WhyNoBatch(batch), "");
    size_by_first[batch.plan_id] = batch.num_candidates;
  }
  for (const std::int64_t plan_id : traffic.certified) {
    const auto batch = std::prev(size_by_first.upper_bound(plan_id));
    EXPECT_LT(plan_id - batch->first, batch->second) << "it is one of a batch";
    index_by_certified[plan_id] = static_cast<int>(plan_id - batch->first);
  }
  EXPECT_TRUE(std::ranges::any_of(index_by_certified, [](const auto& entry) { return entry.second > 0; }));
  EXPECT_TRUE(std::ranges::includes(traffic.certified, traffic.executed));
  EXPECT_FIELDS(traffic, (robot["contacts"], 0), (robot["steps_inside_slice"], traffic.robot["steps_executed"]),
                (robot["goal_reached"], true));
}

// A policy of two proposals for each start stands before the first obstacle. Every repair is a candidate like all.
TEST(PolicyRun, WithRepairsItReachesTheGoalWhereItStopsWithout) {
  for (const int samples : {1, 2}) {  // two are sent as a batch
    SCOPED_TRACE(samples);
    Config config = LoadConfig(kTask);
    config.planner.candidates = 2 / samples;
    config.planner.policy_samples = samples;
    EXPECT_EQ(RunTask(config).robot["goal_reached"], false);
    config.planner.repairs = true;
    const Traffic traffic = RunTask(config);
    EXPECT_FIELDS(traffic, (robot["goal_reached"], true), (robot["stops"], 0), (robot["contacts"], 0),
                  (robot["steps_inside_slice"], traffic.robot["steps_executed"]));
    EXPECT_GT(traffic.planner["repairs"], 0);
    EXPECT_EQ(traffic.decisions.size(), traffic.candidates.size() + traffic.batches.size());
    EXPECT_TRUE(std::ranges::includes(traffic.certified, traffic.executed));
  }
}

TEST(PolicyRun, TwoRunsAreIdentical) {
  const Config config = LoadConfig(kTask);
  const Traffic one = RunTask(config), two = RunTask(config);
  EXPECT_EQ(one.robot, two.robot);
  ASSERT_EQ(one.candidates.size(), two.candidates.size());
  for (std::size_t i = 0; i < one.candidates.size(); ++i)
    EXPECT_EQ(Encode(one.candidates[i]), Encode(two.candidates[i])) << i;
}

// With an obstacle right ahead the policy goes on proposing, and nothing is driven.
TEST(PolicyRun, WhereNothingCanBeCertifiedNothingIsDriven) {
  Config config = LoadConfig(kTask);
  config.obstacles = {Obstacle::Circle(Vec({6, 0}), 5.8)};
  config.robot.time_limit_s = 3;
  const Traffic traffic = RunTask(config);
  EXPECT_GT(traffic.candidates.size(), 10u);
  EXPECT_FIELDS(traffic, (certified.empty(), true), (executed.empty(), true), (robot["contacts"], 0));
}

PlanRequest AtFiveMetresPerSecond() {
  PlanRequest request;
  request.state = Vec({0, 0, 0, 5, 0, 0});
  return request;
}

TEST(PolicyProposer, ItsPlansAreThePolicysBlocksAndEndInAStop) {
  const Config config = LoadConfig(kTask);
  const Policy policy = LoadPolicy(config.planner.policy);
  PolicyProposer proposer(config, policy);
  PlanRequest request = AtFiveMetresPerSecond();
  const auto proposal = proposer.Propose(request).value();
  EXPECT_EQ(proposal.progress_steps, config.planner.progress_steps);
  EXPECT_NEAR(proposal.states(3, proposal.states.cols() - 1), 0, 1e-9);
  // The goal is straight ahead: (7 - 5) m/s more over a block, wheels straight.
  const NominalModel& model = *config.problem->model;
  const Reference reference = MakeReference(model, Vec({0, 0, 0, 5, 1, 0}), policy.num_steps());
  EXPECT_EQ(proposal.controls.leftCols(8), policy.Act(Features(request.state, reference)).leftCols(8));

  std::set<double> directions;  // each attempt goes another way
  for (request.attempt = 1; request.attempt <= PolicyProposer::kFan; ++request.attempt)
    directions.insert(proposer.Propose(request)->states(2, 8));
  EXPECT_EQ(directions.size(), static_cast<std::size_t>(PolicyProposer::kFan));
  EXPECT_FALSE(proposer.Propose(request));
}

TEST(PolicyProposer, SamplesReferencesFirstAndThenOtherWaysToBrake) {
  Config config = LoadConfig(kTask);
  const Policy policy = LoadPolicy(config.planner.policy);
  PlanRequest request = AtFiveMetresPerSecond();
  std::vector<Eigen::MatrixXd> alone;
  PolicyProposer one(config, policy);
  ASSERT_EQ(one.ProposeMany(request).size(), 1u);
  for (request.attempt = 0; request.attempt <= PolicyProposer::kFan; ++request.attempt)
    alone.push_back(one.Propose(request)->controls);
  request.attempt = 0;
  config.planner.policy_samples = 64;
  PolicyProposer many(config, policy);
  ASSERT_EQ(many.motion().num_tails(), 5);
  const std::vector<Proposal> samples = many.ProposeMany(request);
  ASSERT_EQ(samples.size(), 64u) << "13 blocks, and 5 ways to brake of each but the last";
  const auto are_same = [](const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
    return a.cols() == b.cols() && a == b;
  };
  for (std::size_t i = 0; i < alone.size(); ++i) EXPECT_EQ(samples[i].controls, alone[i]) << i;
  for (std::size_t i = 13; i < 26; ++i)
    EXPECT_EQ(samples[i].controls.leftCols(8), samples[i - 13].controls.leftCols(8)) << i;
  for (std::size_t i = 13; i < 23; ++i)  // the slow ones brake straight ahead in every way
    EXPECT_FALSE(are_same(samples[i].controls, samples[i - 13].controls)) << i;
  for (const Proposal& sample : samples) EXPECT_NEAR(sample.states(3, sample.states.cols() - 1), 0, 1e-9);
  request.attempt = 1;
  EXPECT_FALSE(are_same(many.ProposeMany(request)[0].controls, samples[0].controls))
      << "another attempt, other samples";
}

TEST(PolicyProposer, LeavesOutBlocksThatExceedALimit) {
  Config config = LoadConfig(kTask);
  const Policy policy = LoadPolicy(config.planner.policy);
  PlanRequest request = AtFiveMetresPerSecond();
  const auto proposed = [&](const char* that, double at_most) {
    Own(config.problem).limits = {{.name = "it", .that = {that, 1, 1}, .at_most = at_most}};
    return PolicyProposer(config, policy).Propose(request).has_value();
  };
  EXPECT_TRUE(proposed("v", 9));
  EXPECT_FALSE(proposed("v", 5.5)) << "it accelerates to 7 m/s";
  EXPECT_TRUE(proposed("abs(jerk)", 10));
  EXPECT_FALSE(proposed("abs(jerk)", 0.1));
}

// A file has finite weights; their sums may be infinite, or no number.
TEST(PolicyProposer, ProposesNothingThatIsNotFinite) {
  const Config config = LoadConfig(kTask);
  Policy policy = LoadPolicy(config.planner.policy);
  PlanRequest request = AtFiveMetresPerSecond();
  ASSERT_TRUE(PolicyProposer(config, policy).Propose(request));
  policy.layers.back().weight.setConstant(1.7e308);
  EXPECT_FALSE(PolicyProposer(config, policy).Propose(request));
  for (Eigen::Index j = 0; j < policy.layers.back().weight.cols(); j += 2) policy.layers.back().weight.col(j) *= -1;
  EXPECT_FALSE(PolicyProposer(config, policy).Propose(request));
}

TEST(PolicyProposer, RefusesWhatDoesNotFit) {
  const Config config = LoadConfig(kTask);
  const Policy policy = LoadPolicy(config.planner.policy);
  const auto refusal = [&](const Config& task, const Policy& other) {
    return Thrown<std::invalid_argument>([&] { const PolicyProposer proposer(task, other); });
  };
  EXPECT_EQ(refusal(config, policy), "");
  EXPECT_EQ(
      refusal(PointMass(), policy),
      "planner.policy: is for the model kinematic_bicycle dt=0.1 wheelbase=2.5, the task's is point_mass dt=0.15");
  Config long_blocks = config;
  long_blocks.planner.progress_steps = 21;
  EXPECT_EQ(refusal(long_blocks, policy), "planner.policy: its blocks have 20 steps, planner.progress_steps is 21");
  Config no_goal = config;
  no_goal.planner.goal = {};
  EXPECT_EQ(refusal(no_goal, policy),
            "planner.goal: missing: where to go, an entry for each of the 2 safety coordinates");
  Policy fewer = policy;
  fewer.input = {Eigen::VectorXd::Zero(4), Eigen::VectorXd::Ones(4)};
  EXPECT_EQ(refusal(config, fewer), "planner.policy: has 4 features, has to have 12");
}

}  // namespace forereach::policy_run_test
