// Policy files, the output of a policy, and its inputs.
#include "planner_bridge/policy.h"

#include <Eigen/Geometry>

#include "tests/test.h"

#include "planner_bridge/reference.h"
#include "tests/planner_bridge/tasks.h"

namespace forereach::policy_test {

using Json = nlohmann::json;

Json Read(const std::string& path) { return Json::parse(std::ifstream(path)); }

// Two features, a hidden layer of one, two steps of one input.
Policy Small() {
  return {.model = "small",
          .num_inputs = 1,
          .input = {Vec({1, 2}), Vec({2, 4})},
          .output = {Vec({0.5, -0.5}), Vec({3, 7})},
          .layers = {{Eigen::RowVector2d(0.3, -0.1), Vec({0.25})}, {Eigen::Vector2d(2, -1), Vec({0.1, 1.0 / 3})}}};
}

TEST(Policy, ComputesTheDocumentedFormula) {
  const Eigen::MatrixXd block = Small().Act(Vec({5, 4}));
  const double h = std::tanh(0.3 * (5 - 1) / 2.0 - 0.1 * (4 - 2) / 4.0 + 0.25);
  ASSERT_EQ(block.rows(), 1);
  ASSERT_EQ(block.cols(), 2);
  EXPECT_DOUBLE_EQ(block(0, 0), 0.5 + 3 * (2 * h + 0.1));
  EXPECT_DOUBLE_EQ(block(0, 1), -0.5 + 7 * (-h + 1.0 / 3));
}

TEST(Policy, ComesBackFromItsFileToTheLastBit) {
  const ScratchDirectory scratch;
  const std::string path = scratch / "policy.json";
  SavePolicy(path, Small());
  const Policy again = LoadPolicy(path);
  EXPECT_EQ(again.Act(Vec({0.1, 0.7})), Small().Act(Vec({0.1, 0.7})));
  EXPECT_FIELDS(again, (model, "small"), (num_steps(), 2));
  EXPECT_THROW(SavePolicy("/nowhere/policy.json", Small()), PolicyError);
}

struct BadFile {
  const char* pointer;  // what is changed
  Json value;           // to what; null: taken away
  const char* message;
};

TEST(Policy, EveryBadFieldIsNamedWithValueAndBound) {
  const ScratchDirectory scratch;
  const std::string path = scratch / "policy.json";
  SavePolicy(path, Small());
  const Json good = Read(path);
  for (const BadFile& bad : std::initializer_list<BadFile>{
           {"/format", "other", "format: other has to be forereach-policy"},
           {"/format", 1, "format: 1 is no text"},
           {"/version", 2, "version: 2 is no integer in [1, 1]"},
           {"/activation", "relu", "activation: relu has to be tanh"},
           {"/inputs", 9, "inputs: 9 is no integer in [1, 8]"},
           {"/steps", 0, "steps: 0 is no integer in [1, 128]"},
           {"/steps", 1.5, "steps: 1.5 is no integer in [1, 128]"},
           {"/sizes", Json::array({2}), "sizes: has 1 entries, has to have 2 to 9"},
           {"/sizes/1", 5000, "sizes[1]: 5000 is no integer in [1, 1024]"},
           {"/sizes/2", 3, "sizes: ends with 3, has to end with inputs times steps, 2"},
           {"/input/offset", Json::array({1}), "input.offset: has 1 entries, has to have 2"},
           {"/input/offset", "x", "input.offset: \"x\" is no list"},
           {"/output/scale/1", 0, "output.scale[1]: 0 is outside (0, inf)"},
           {"/output/scale/0", "a", "output.scale[0]: \"a\" is outside (0, inf)"},
           {"/layers/0/weight/0/1", nullptr, "layers[0].weight[0]: has 1 entries, has to have 2"},
           {"/layers/1/bias", nullptr, "layers[1]: has no bias"},
           {"/layers/1/more", 1, "layers[1]: has a field more that does not belong there"},
           {"/layers/1", nullptr, "layers: has 1 entries, has to have 2"},
           {"/model", nullptr, "has no model"},
           {"", Json::array(), "[] is no object"}}) {
    Json json = good;
    const Json::json_pointer at(bad.pointer);
    if (!bad.value.is_null())
      json[at] = bad.value;
    else if (Json& parent = json.at(at.parent_pointer()); parent.is_array())
      parent.erase(std::stoul(at.back()));
    else
      parent.erase(at.back());
    std::ofstream(path) << json;
    EXPECT_THAT([&] { static_cast<void>(LoadPolicy(path)); }, ThrowsMessage<PolicyError>(path + ": " + bad.message))
        << bad.pointer << " " << bad.value;
  }
  std::ofstream(path) << good;
  EXPECT_NO_THROW(static_cast<void>(LoadPolicy(path)));
}

TEST(Policy, AFieldOfAMillionListsInOneAnotherIsRefused) {
  const ScratchDirectory scratch;
  const std::string path = scratch / "policy.json";
  SavePolicy(path, Small());
  const std::string deep = std::string(1'000'000, '[') + std::string(1'000'000, ']'),
                    text = Replaced(forereach::Read(path), "\"forereach-policy\"", deep);
  std::ofstream(path) << text;
  EXPECT_THROW(static_cast<void>(LoadPolicy(path)), PolicyError);
}

TEST(Policy, WhatIsNoJsonIsRefusedWithItsFile) {
  const ScratchDirectory scratch;
  const std::string path = scratch / "policy.json";
  for (const char* text : {"", "{", "{\"format\": 1e999}", "\xff"}) {
    std::ofstream(path) << text;
    EXPECT_THAT([&] { static_cast<void>(LoadPolicy(path)); }, ThrowsMessage<PolicyError>(StartsWith(path + ": ")))
        << text;
  }
  EXPECT_THROW(static_cast<void>(LoadPolicy("/nowhere/policy.json")), PolicyError);
}

TEST(Reference, IsFeasibleAndHoldsItsAccelerationAndSteering) {
  const auto model = MakeKinematicBicycle(0.1, 2.5);
  const Eigen::MatrixXd states = MakeReference(*model, Vec({1, 2, 0.3, 5, 1, 0.1}), 20).states;
  ASSERT_EQ(states.cols(), 21);
  EXPECT_NEAR(states(3, 20), 5 + 20 * 0.1, 1e-12);
  EXPECT_EQ(states(4, 20), 1);
  EXPECT_EQ(states(5, 20), 0.1);
}

TEST(Reference, FeaturesDoNotDependOnPositionAndHeading) {
  const auto model = MakeKinematicBicycle(0.1, 2.5);
  const Eigen::VectorXd start = Vec({0, 0, 0, 5, 1, 0.1}), off = Vec({0.1, -0.2, 0.05, 0.3, -0.4, 0.01});
  const double turn = 0.7;
  Eigen::VectorXd moved = start, moved_off = off;
  moved.head<3>() = Vec({3, -4, turn});
  moved_off.head<2>() = Eigen::Rotation2Dd(turn) * off.head<2>();
  const Eigen::VectorXd here = Features(start + off, MakeReference(*model, start, 20));
  const Eigen::VectorXd there = Features(moved + moved_off, MakeReference(*model, moved, 20));
  ASSERT_EQ(here.size(), kFeatures);
  EXPECT_LT((here - there).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_LT((here.head<6>() - (start + off)).cwiseAbs().maxCoeff(), 1e-12);
}

// The checked-in policy does what it was taught: it gets where the reference ends.
TEST(ShippedPolicy, FollowsReferencesOfASlowRobot) {
  const Policy policy = LoadPolicy(FOREREACH_SOURCE_DIR "/config/policies/bicycle.json");
  const auto model = MakeKinematicBicycle(0.1, 2.5);
  EXPECT_EQ(policy.model, model->description());
  ASSERT_EQ(policy.num_features(), kFeatures);
  ASSERT_EQ(policy.num_steps(), 20);
  for (const double speed : {0.0, 3.0, 7.0})
    for (const double steering : {-0.1, 0.0, 0.1}) {
      const Eigen::VectorXd state = Vec({0, 0, 0, speed, 0, 0});
      const Reference reference = MakeReference(*model, Vec({0, 0, 0, speed, 1, steering}), 20);
      const Eigen::MatrixXd states = Rollout(*model, state, policy.Act(Features(state, reference)));
      const Eigen::VectorXd miss = (states.rightCols<1>() - reference.states.rightCols<1>()).cwiseAbs();
      EXPECT_LT(miss.head<2>().norm(), 1.2) << speed << " " << steering;
      EXPECT_LT(miss[3], 0.6) << speed << " " << steering;
    }
}

}  // namespace forereach::policy_test
