#include "research/chunks/blocks.h"

#include <cmath>

#include "planner_bridge/reference.h"
#include "research/chunks/demonstrations.h"
#include "research/random.h"

namespace forereach::research {
namespace {

enum : std::uint64_t { kForChunk = 0x6368756e, kForCorridor = 0x636f7272 };

System MakeChunkSystem() {
  System system = BicycleSystem();
  system.name = "bicycle_chunks";
  system.horizon = kBlockSteps;
  system.support_scale.resize(6);
  system.support_scale << 40, 40, system.domain.state.upper()[2], 25, 3, 0.5;  // the paper's
  return system;
}

// What the policy does on an errand, within the domain's inputs.
Eigen::MatrixXd BlockFor(const Errand& errand) {
  const Box& inputs = ChunkSystem().domain.input;
  Eigen::MatrixXd block = ShippedPolicy().Act(Features(errand.state, errand.reference));
  for (auto column : block.colwise()) column = column.cwiseMax(inputs.lower()).cwiseMin(inputs.upper());
  return block;
}

int LargestDivisorUpToRoot(int count) {
  int divisor = 1;
  for (int d = 2; d * d <= count; ++d)
    if (count % d == 0) divisor = d;
  return divisor;
}

double Mark(double lower, double upper, int i, int count) {
  return std::lerp(lower, upper, count == 1 ? 0.5 : static_cast<double>(i) / (count - 1));
}

}  // namespace

const System& ChunkSystem() {
  static const System system = MakeChunkSystem();
  return system;
}

const Policy& ShippedPolicy() {
  static const Policy policy = LoadPolicy(FOREREACH_SOURCE_DIR "/config/policies/bicycle.json");
  return policy;
}

Scenario MakeChunkScenario(Group group, int seed, int index) {
  Random random{kForChunk, static_cast<std::uint64_t>(group), static_cast<std::uint64_t>(seed),
                static_cast<std::uint64_t>(index)};
  const Errand errand = DrawErrand(group, random);
  const Eigen::MatrixXd block = BlockFor(errand);
  const int k = random.Integer(9, 12);
  const bool safe = group == Group::kA || index % 2 == 0;
  const double aside = safe ? 1 + random.Uniform(0.5, 2.5) : random.Uniform(0, 0.8);
  const bool left = group == Group::kB || (group == Group::kA && random.Coin());  // the outside of the curve
  return {errand.state, block, PlaceBeside(ChunkSystem(), errand.state, block, k, left ? aside : -aside, 1)};
}

Eigen::MatrixXd GridPoints(int count) {
  const Box& region = ChunkSystem().data_region;
  const int speeds = LargestDivisorUpToRoot(count), angles = count / speeds;
  Eigen::MatrixXd points = Eigen::MatrixXd::Zero(count, region.dim());
  for (int i = 0; i < count; ++i) {
    points(i, 3) = Mark(region.lower()[3], region.upper()[3], i / angles, speeds);
    points(i, 5) = Mark(region.lower()[5], region.upper()[5], i % angles, angles);
  }
  return points;
}

Eigen::MatrixXd PolicyPoints(int seed, int count) {
  const System& system = ChunkSystem();
  Eigen::MatrixXd points(count, system.model->num_variables());
  for (int i = 0; i < count; ++i) {
    Random random{kForCorridor, static_cast<std::uint64_t>(seed), static_cast<std::uint64_t>(i)};
    const Errand errand = DrawErrand(kGroups[i % 3], random);
    const Eigen::MatrixXd block = BlockFor(errand);
    const int t = random.Integer(0, kBlockSteps - 1);
    points.row(i) << Rollout(*system.model, errand.state, block).col(t).transpose(), block.col(t).transpose();
  }
  return points;
}

}  // namespace forereach::research
