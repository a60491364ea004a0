// The guard under any plans, states and times: what it executes was sealed, signed where there is a key, finite, in time,
// and newer than the last; each state it let pass lies in its slice; and nothing happens while it is halted.
#include <cmath>

#include "fuzz/fuzz.h"
#include "robot/guard.h"
#include "tests/robot/sealed_plan.h"

namespace {

using namespace forereach;

constexpr std::int64_t kStart = 1'000'000'000'000, kStepUs = 40'000;
constexpr Key256 kKey{1, 2, 3}, kOtherKey{4};

// Two states, one input, three steps. X0 = (1 +- 0.5, -2 +- 0.25); slice t = [-10 - t, 10 + t] x [-5, 5].
certified_plan_t Plan(std::int64_t id) {
  certified_plan_t certified{};
  candidate_plan_t& plan = certified.plan;
  plan.plan_id = id;
  plan.start_utime = kStart;
  plan.step_us = kStepUs;
  plan.num_states = 2;
  plan.num_inputs = 1;
  plan.num_steps = 3;
  plan.initial_center[0] = 1;
  plan.initial_center[1] = -2;
  plan.initial_half_width[0] = 0.5;
  plan.initial_half_width[1] = 0.25;
  certified.expires_utime = kStart + kStepUs;
  for (int t = 0; t <= 3; ++t) {
    certified.slice_lower[t][0] = -10 - t;
    certified.slice_upper[t][0] = 10 + t;
    certified.slice_lower[t][1] = -5;
    certified.slice_upper[t][1] = 5;
  }
  return certified;
}

class Session final {
 public:
  explicit Session(bool with_key) : guard_({2, 1, kStepUs, {}, {}, with_key ? std::optional(kKey) : std::nullopt}), with_key_(with_key) {}

  void Step(FuzzedDataProvider& input) {
    switch (input.ConsumeIntegralInRange(0, 5)) {
      case 0: return Accept(input);
      case 1: return TryStart(input);
      case 2:
      case 3: return Check(input);
      case 4: return guard_.Finish();
      case 5: return input.ConsumeBool() ? guard_.Halt() : guard_.Reset();
    }
  }

  void RequireConsistent() const { Require(!guard_.halted() || (!guard_.pending() && !guard_.executing())); }

 private:
  void Accept(FuzzedDataProvider& input) {
    std::vector<std::uint8_t> bytes = Damaged(input, Plan(input.ConsumeIntegralInRange(1, 8)));
    if (auto plan = Decoded<certified_plan_t>(bytes); plan && input.ConsumeBool()) bytes = Sealed(*plan);
    const bool is_sealed = IsSealed(bytes), was_halted = guard_.halted();
    const bool is_signed = input.ConsumeBool();
    if (is_signed) bytes = signer_.Sign("PLAN_CERTIFIED", bytes, kStart);
    else if (input.ConsumeBool()) bytes = forger_.Sign("PLAN_CERTIFIED", bytes, kStart);
    const std::int64_t now = Time(input);
    const GuardVerdict verdict = guard_.Accept(bytes, now);
    Require(verdict.ok() == verdict.message.empty() && verdict.cause != GuardCause::kInternalError);
    if (!verdict.ok()) return;
    const certified_plan_t& plan = *guard_.pending();
    Require(is_sealed && !was_halted && is_signed == with_key_);
    Require(plan.plan.plan_id > last_id_ && now <= plan.expires_utime);
    last_id_ = plan.plan.plan_id;
    RequireSane(plan);
  }

  static bool IsSealed(Bytes bytes) {
    const auto plan = Decoded<certified_plan_t>(bytes);
    return plan && FindSealFaults(*plan).empty();
  }

  static void RequireSane(const certified_plan_t& plan) {
    Require(plan.plan.num_states == 2 && plan.plan.num_inputs == 1 && 1 <= plan.plan.num_steps && plan.plan.num_steps <= 128);
    for (int t = 0; t < plan.plan.num_steps; ++t) Require(std::isfinite(plan.plan.control[t][0]));
    for (int t = 0; t <= plan.plan.num_steps; ++t)
      for (int k = 0; k < 2; ++k) Require(std::isfinite(plan.slice_lower[t][k]) && plan.slice_lower[t][k] <= plan.slice_upper[t][k]);
  }

  void TryStart(FuzzedDataProvider& input) {
    const std::int64_t boundary = Time(input);
    const std::vector<double> state = State(input);
    if (!guard_.TryStart(boundary, state).ok()) return;
    const certified_plan_t* plan = guard_.executing();
    Require(plan && !guard_.pending() && std::abs(plan->plan.start_utime - boundary) <= kStepUs / 2 && boundary <= plan->expires_utime);
    RequireInSlice(*plan, 0, state);
    step_ = 0;
  }

  void Check(FuzzedDataProvider& input) {
    const int step = input.ConsumeBool() ? step_ + 1 : input.ConsumeIntegral<int>();
    const std::vector<double> state = State(input);
    const bool ok = guard_.Check(step, state).ok();
    Require(ok == (guard_.executing() != nullptr));  // after any refusal nothing is executing
    if (!ok) return;
    Require(step == ++step_);
    RequireInSlice(*guard_.executing(), step, state);
  }

  static void RequireInSlice(const certified_plan_t& plan, int step, const std::vector<double>& state) {
    Require(state.size() == 2 && step <= plan.plan.num_steps);
    for (std::size_t k = 0; k < 2; ++k) Require(plan.slice_lower[step][k] <= state[k] && state[k] <= plan.slice_upper[step][k]);
  }

  static std::int64_t Time(FuzzedDataProvider& input) {
    return input.ConsumeBool() ? kStart + input.ConsumeIntegralInRange<std::int64_t>(-2 * kStepUs, 2 * kStepUs) : input.ConsumeIntegral<std::int64_t>();
  }

  static std::vector<double> State(FuzzedDataProvider& input) {
    std::vector<double> state{1, -2};
    if (input.ConsumeBool()) state.resize(input.ConsumeIntegralInRange<std::size_t>(0, 20));
    if (!state.empty() && input.ConsumeBool()) state[input.ConsumeIntegralInRange<std::size_t>(0, state.size() - 1)] = OddNumber(input);
    return state;
  }

  Guard guard_;
  const bool with_key_;
  Signer signer_{kKey, "certifier", kStart}, forger_{kOtherKey, "certifier", kStart};
  std::int64_t last_id_ = INT64_MIN;
  int step_ = 0;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzedDataProvider input(data, size);
  Session session(input.ConsumeBool());
  for (int step = 0; step < 32 && input.remaining_bytes() > 0; ++step) {
    session.Step(input);
    session.RequireConsistent();
  }
  return 0;
}
