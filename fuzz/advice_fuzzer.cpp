// Advice as anybody may send it, through what a planner makes of it: what it keeps away from becomes less only where
// it is eased, is never a NaN, and stays within what the type can name.

#include "fuzz/fuzz.h"
#include "planner_bridge/lessons.h"

namespace forereach {
namespace {

constexpr int kLimits = 3, kStates = 4;

void Distort(FuzzedDataProvider& input, advice_t& advice) {
  advice_change_t& change = advice.change[input.ConsumeIntegralInRange(0, 7)];
  switch (input.ConsumeIntegralInRange(0, 6)) {
    case 0: change.value = AnyNumber(input); return;
    case 1: change.clearance = AnyNumber(input); return;
    case 2: change.kind = AnySmall(input, 4); return;
    case 3: change.index = AnySmall(input, kStates); return;
    case 4: change.step = AnySmall(input, 128); return;
    case 5: advice.num_changes = AnySmall(input, 9); return;
    case 6: change.direction[0] = AnyNumber(input); return;
  }
}

// One that says something of all three kinds, unless the input wants another.
advice_t AnyAdvice(FuzzedDataProvider& input) {
  advice_t advice{};
  advice.num_changes = 8;
  for (int i = 0; i < 8; ++i) {
    advice_change_t& change = advice.change[i];
    change.kind = static_cast<std::int16_t>(1 + i % 3);
    change.index = static_cast<std::int16_t>(i % kLimits);
    change.step = static_cast<std::int16_t>(i);
    change.value = 0.25;
    change.clearance = change.kind == advice_change_t::OBSTACLE ? 1.5 : 0;
  }
  for (int left = NumOdd(input); left > 0; --left) Distort(input, advice);
  return advice;
}

// All that a planner keeps away from, and is not to lose.
std::vector<double> Kept(const Lessons& lessons) {
  std::vector<double> kept{lessons.clearance()};
  kept.insert(kept.end(), lessons.limit_margin().begin(), lessons.limit_margin().end());
  const Eigen::VectorXd margin =
      lessons.DomainMargin(Eigen::VectorXd::Constant(kStates, 0.05), Eigen::MatrixXd::Identity(2, kStates));
  kept.insert(kept.end(), margin.begin(), margin.end());
  for (const ObstacleClearance& own : lessons.obstacle_clearance()) kept.push_back(own.clearance);
  return kept;
}

}  // namespace

bool Try(Bytes data) {
  FuzzedDataProvider input(data.data(), data.size());
  Lessons lessons(PlannerOptions{}, kLimits);
  bool heeded = false;
  for (int i = 0; i < 16 && input.remaining_bytes() > 0; ++i) {
    const std::vector<double> before = Kept(lessons);
    const auto advice = Decoded<advice_t>(Damaged(input, AnyAdvice(input)));
    const bool changes = advice && lessons.Heed(*advice);
    heeded = heeded || changes;
    const std::vector<double> after = Kept(lessons);
    Require(changes || after == before);
    Require(before.size() <= after.size() && lessons.obstacle_clearance().size() <= 32768);
    Require(lessons.limit_margin().size() == kLimits);
    for (std::size_t k = 0; k < after.size(); ++k) Require(after[k] >= (k < before.size() ? before[k] : 0));
    if (!input.ConsumeBool()) continue;
    lessons.Ease();
    const std::vector<double> eased = Kept(lessons);
    for (std::size_t k = 0; k < after.size(); ++k) Require(0 <= eased[k] && eased[k] <= after[k]);
  }
  return heeded;
}

}  // namespace forereach
