// Candidates through the gate, under any of four tasks: each gets one decision, and a certified plan comes only with the
// outcome CERTIFIED, sealed, and of a candidate that a certificate can be about.
#include <cmath>

#include "certifier/gate/gate.h"
#include "fuzz/fuzz.h"
#include "lcmtypes/seal.h"
#include "tests/gate/small_task.h"

namespace {

using namespace forereach;

std::vector<Config> Tasks() {
  Config shadow = SmallTask(), open = SmallTask();
  shadow.gate.shadow = true;
  open.obstacles.clear();
  return {SmallTask(), FalsifiedTask(), shadow, open};
}

bool IsProper(const candidate_plan_t& plan) {
  bool proper = plan.num_states == 4 && plan.num_inputs == 2 && 1 <= plan.num_steps && plan.num_steps <= 128;
  for (int k = 0; proper && k < 4; ++k)
    proper = std::isfinite(plan.initial_center[k]) && std::isfinite(plan.initial_half_width[k]) && plan.initial_half_width[k] >= 0;
  for (int t = 0; proper && t < plan.num_steps; ++t) proper = std::abs(plan.control[t][0]) <= 3 && std::abs(plan.control[t][1]) <= 3;
  return proper;
}

void RequireCertificate(const GateAnswer& answer, Bytes bytes) {
  const certified_plan_t& certified = *answer.certified;
  Require(answer.decision.outcome == decision_t::CERTIFIED && answer.decision.cause == decision_t::CAUSE_NONE);
  Require(Encode(certified.plan) == std::vector(bytes.begin(), bytes.end()) && IsProper(certified.plan));
  Require(FindSealFaults(certified).empty());
  Require(certified.expires_utime >= answer.decision.utime && certified.plan.start_utime >= answer.decision.utime);
  for (int t = 0; t <= certified.plan.num_steps; ++t)
    for (int k = 0; k < 4; ++k)
      Require(std::isfinite(certified.slice_lower[t][k]) && certified.slice_lower[t][k] <= certified.slice_upper[t][k] &&
              std::isfinite(certified.slice_upper[t][k]));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::vector<Config> tasks = Tasks();
  FuzzedDataProvider input(data, size);
  const std::size_t task = input.ConsumeIntegralInRange<std::size_t>(0, tasks.size() - 1);
  Gate gate(tasks[task]);
  std::int64_t now = kNow, decided = 0;
  for (; input.remaining_bytes() > 0 && decided < 8; ++decided) {
    now += input.ConsumeIntegralInRange<std::int64_t>(-1'000'000, 1'000'000);
    const std::vector<std::uint8_t> bytes = Damaged(input, Candidate(input.ConsumeIntegralInRange(1, 8), OddNumber(input), now));
    const GateAnswer answer = gate.Decide(bytes, now);
    Require(answer.decision.sequence == decided && answer.decision.utime == now);
    Require(GetDigest(answer.decision.plan_digest) == DigestOf(bytes));
    Require(answer.certified.has_value() == (answer.decision.outcome == decision_t::CERTIFIED));
    Require(answer.decision.cause != decision_t::CAUSE_INTERNAL_ERROR);
    if (!answer.certified) continue;
    Require(task != 1 && task != 2);  // the data contradict the declaration; shadow mode
    RequireCertificate(answer, bytes);
  }
  Require(gate.Status(now).candidates == decided);
  return 0;
}
