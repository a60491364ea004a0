// Candidates through the gate, under any of five tasks: each gets one decision, and a certified plan comes only with
// the outcome CERTIFIED, sealed, of a candidate that a certificate can be about, and with slices that its nominal run
// is in. Where obstacles move, the nominal run is clear of them at the times of the plan.
#include <algorithm>
#include <cmath>
#include <memory>

#include "certifier/gate/gate.h"
#include "forereach/safety/clearance.h"
#include "fuzz/candidates.h"
#include "lcmtypes/candidate_batch.h"
#include "lcmtypes/seal.h"

namespace forereach {
namespace {

std::vector<Config> Tasks() {
  Config shadow = SmallTask(), open = SmallTask();
  shadow.gate.shadow = true;
  open.obstacles.clear();
  Config timed = SmallTask();
  timed.gate.max_clock_error_ms = 20;
  ObstacleMotion motion;
  motion.stamp_us = kNow;
  motion.velocity.y() = -1;
  motion.growth = motion.growth_rate = 0.01;
  timed.obstacles.push_back(Obstacle::Circle(Eigen::Vector2d(0.75, 2.5), 0.2).Moving(motion));
  motion.until_us = kNow + 1'000'000;
  timed.obstacles.push_back(Obstacle::Circle(Eigen::Vector2d(0.4, 2), 0.2).Moving(motion));
  return {SmallTask(), FalsifiedTask(), shadow, open, timed};
}

constexpr std::size_t kNeverCertify[] = {1, 2};  // the data contradict the declaration; shadow mode

bool IsProper(const candidate_plan_t& plan) {
  bool proper = plan.num_states == 4 && plan.num_inputs == 2 && 1 <= plan.num_steps && plan.num_steps <= 128;
  for (int k = 0; proper && k < 4; ++k)
    proper = std::isfinite(plan.initial_center[k]) && std::isfinite(plan.initial_half_width[k]) &&
             plan.initial_half_width[k] >= 0;
  for (int t = 0; proper && t < plan.num_steps; ++t)
    proper = std::abs(plan.control[t][0]) <= 3 && std::abs(plan.control[t][1]) <= 3;
  return proper;
}

// What rounds where the run is computed is far below this; a slice is as exact as its rounding outward.
void RequireNominalRunInside(const certified_plan_t& certified, const NominalModel& model) {
  constexpr double kSlack = 1e-9;
  const candidate_plan_t& plan = certified.plan;
  double z[6], next[4];
  std::copy_n(plan.initial_center, 4, next);
  for (int t = 0; t <= plan.num_steps; ++t) {
    for (int k = 0; k < 4; ++k)
      Require(certified.slice_lower[t][k] - kSlack <= next[k] && next[k] <= certified.slice_upper[t][k] + kSlack);
    if (t == plan.num_steps) return;
    std::copy_n(next, 4, z);
    std::copy_n(plan.control[t], 2, z + 4);
    model.Evaluate({z, 6}, {next, 4});
  }
}

// Of obstacles that stand, too.
void RequireNominalRunClear(const certified_plan_t& certified, const Config& task) {
  if (!task.gate.max_clock_error_ms) return;
  const candidate_plan_t& plan = certified.plan;
  Require(1 <= plan.step_us && plan.step_us <= 150'000);
  double z[6], next[4];
  std::copy_n(plan.initial_center, 4, next);
  for (int t = 0; t <= plan.num_steps; ++t) {
    for (const Obstacle& obstacle : task.obstacles)
      for (const std::int64_t error : {-20'000, 0, 20'000})
        Require(ApproximateDistance(obstacle, BodyPart{{{next[0], next[1], 0}}, 0},
                                    plan.start_utime + t * plan.step_us + error) > 0);
    if (t == plan.num_steps) return;
    std::copy_n(next, 4, z);
    std::copy_n(plan.control[t], 2, z + 4);
    task.problem->model->Evaluate({z, 6}, {next, 4});
  }
}

void RequireCertificate(const GateAnswer& answer, Bytes bytes, const Config& task) {
  const certified_plan_t& certified = *answer.certified;
  Require(answer.decision.outcome == decision_t::CERTIFIED && answer.decision.cause == decision_t::CAUSE_NONE);
  Require(Encode(certified.plan) == std::vector(bytes.begin(), bytes.end()) && IsProper(certified.plan));
  Require(FindSealFaults(certified).empty());
  Require(certified.expires_utime >= answer.decision.utime && certified.plan.start_utime >= answer.decision.utime);
  for (int t = 0; t <= certified.plan.num_steps; ++t)
    for (int k = 0; k < 4; ++k)
      Require(std::isfinite(certified.slice_lower[t][k]) &&
              certified.slice_lower[t][k] <= certified.slice_upper[t][k] && std::isfinite(certified.slice_upper[t][k]));
  RequireNominalRunInside(certified, *task.problem->model);
  RequireNominalRunClear(certified, task);
}

std::vector<std::unique_ptr<Gate>> GatesFor(const std::vector<Config>& tasks) {
  std::vector<std::unique_ptr<Gate>> gates;
  for (const Config& task : tasks) gates.push_back(std::make_unique<Gate>(task));
  return gates;
}

// Some candidates of a batch, and something odd about their number and steps.
candidate_batch_t AnyBatch(FuzzedDataProvider& input, std::int64_t now_us) {
  candidate_batch_t batch{};
  for (int left = input.ConsumeIntegralInRange(0, 4); left > 0; --left)
    static_cast<void>(Append(batch, AnyCandidate(input, now_us)));
  for (int left = NumOdd(input); left > 0; --left) {
    switch (input.ConsumeIntegralInRange(0, 4)) {
      case 0: batch.num_candidates = input.ConsumeIntegral<std::int16_t>(); break;
      case 1: batch.num_steps[input.ConsumeIntegralInRange(0, 4)] = AnySmall(input, 129); break;
      case 2: batch.progress_steps[input.ConsumeIntegralInRange(0, 4)] = AnySmall(input, 11); break;
      case 3: batch.control[input.ConsumeIntegralInRange(0, 80)] = AnyNumber(input); break;
      case 4: batch.plan_id = AnyInteger(input, batch.plan_id, 2000); break;
    }
  }
  return batch;
}

}  // namespace

bool Try(Bytes data) {
  static const std::vector<Config> tasks = Tasks();
  static const auto gates = GatesFor(tasks), fresh_gates = GatesFor(tasks);  // dearer to make than to ask
  FuzzedDataProvider input(data.data(), data.size());
  const std::size_t task = input.ConsumeIntegralInRange<std::size_t>(0, tasks.size() - 1);
  Gate& gate = *gates[task];
  gate.Inherit(*fresh_gates[task]);  // forgets the last execution, in which candidates could change nothing else
  std::int64_t now = kNow, decided = 0, certified = 0;
  for (; input.remaining_bytes() > 0 && decided < 8; ++decided) {
    now += input.ConsumeBool() ? input.ConsumeIntegralInRange<std::int64_t>(-1'000'000, 1'000'000) : 0;
    const std::vector<std::uint8_t> message = input.ConsumeIntegralInRange(0, 4) < 4
                                                  ? Damaged(input, AnyCandidate(input, now))
                                                  : Damaged(input, AnyBatch(input, now));
    const GateAnswer answer = gate.Decide(message, now);
    Require(answer.decision.sequence == decided && answer.decision.utime == now);
    const Digest plan = GetDigest(answer.decision.plan_digest);
    Require(PlanDigest(Bytes(CandidateIn(message, plan))) == plan);
    const std::vector<std::uint8_t> bytes = CandidateIn(message, plan);
    Require(answer.certified.has_value() == (answer.decision.outcome == decision_t::CERTIFIED));
    Require(answer.decision.cause != decision_t::CAUSE_INTERNAL_ERROR);
    if (!answer.certified) continue;
    Require(std::ranges::count(kNeverCertify, task) == 0);
    RequireCertificate(answer, bytes, tasks[task]);
    ++certified;
  }
  Require(gate.Status(now).candidates == decided);
  return certified > 0;
}

}  // namespace forereach
