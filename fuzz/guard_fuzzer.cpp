// The guard under any plans, states and times: what it executes was sealed, signed where there is a key, finite, in
// The guard under any plans, states and times: what it executes was sealed, signed where there is a key, finite, in
// time, and newer than the last; where a jitter is declared, each step is within it; each state it let pass lies in its
// slice; nothing happens while it is halted; and no control is given that a withdrawal has taken back.
#include <cmath>

#include "fuzz/fuzz.h"
#include "tests/robot/sealed_plan.h"

namespace forereach {
namespace {

constexpr std::int64_t kStart = kPlanStart, kStepUs = kPlanStepUs, kJitterUs = 3000;

const KeyRing& Keys(bool ours) {
  static const KeyRing keys = MakeKeyRing("ours", DigestOf("ours")), other = MakeKeyRing("other", DigestOf("other"));
  return ours ? keys : other;
}

// With the key it has a domain too, which the small plan reaches exactly.
GuardOptions Options(bool with_key) {
  GuardOptions options{2, 1, kStepUs, DigestOf("config"), DigestOf("model")};
  if (!with_key) return options;
  options.keys = Keys(true);
  options.bus_name = "bus";
  options.domain = GuardDomain{{-12, -5}, {12, 5}, {-3}, {3}};
  return options;
}

// Makes something of it odd that a guard looks at.
void Distort(FuzzedDataProvider& input, certified_plan_t& certified) {
  candidate_plan_t& plan = certified.plan;
  const auto entry = [&](auto& slices) -> double& {
    return slices[input.ConsumeIntegralInRange(0, 4)][input.ConsumeIntegralInRange(0, 2)];
  };
  switch (input.ConsumeIntegralInRange(0, 18)) {
    case 0: entry(certified.slice_lower) = AnyNumber(input); return;
    case 1: entry(certified.slice_upper) = AnyNumber(input); return;
    case 2: certified.expires_utime = AnyInteger(input, certified.expires_utime, kStepUs); return;
    case 3: plan.start_utime = AnyInteger(input, plan.start_utime, kStepUs); return;
    case 4: plan.num_steps = AnySmall(input, 129); return;
    case 5: plan.progress_steps = AnySmall(input, 4); return;
    case 6: plan.num_states = AnySmall(input, 16); return;
    case 7: plan.num_inputs = AnySmall(input, 8); return;
    case 8: plan.step_us = AnyInteger(input, plan.step_us, 1); return;
    case 9: plan.plan_id = AnyInteger(input, plan.plan_id, 8); return;
    case 10: plan.initial_center[input.ConsumeIntegralInRange(0, 2)] = AnyNumber(input); return;
    case 11: plan.initial_half_width[input.ConsumeIntegralInRange(0, 2)] = AnyNumber(input); return;
    case 12:
      plan.control[input.ConsumeIntegralInRange(0, 3)][input.ConsumeIntegralInRange(0, 1)] = AnyNumber(input);
      return;
    case 13: certified.config_digest[input.ConsumeIntegralInRange(0, 31)] ^= 1; return;
    case 14: certified.model_digest[input.ConsumeIntegralInRange(0, 31)] ^= 1; return;
    case 15: certified.observations_digest[input.ConsumeIntegralInRange(0, 31)] ^= 1; return;
    case 16: certified.transitions_digest[input.ConsumeIntegralInRange(0, 31)] ^= 1; return;
    case 17: certified.state_error[input.ConsumeIntegralInRange(0, 2)] = AnyNumber(input); return;
    case 18: certified.step_error_us = AnyInteger(input, certified.step_error_us, kJitterUs); return;
  }
}

// A plan that passes, damaged or not; or one that was damaged and then sealed.
std::vector<std::uint8_t> AnyPlan(FuzzedDataProvider& input) {
  static const std::vector<std::vector<std::uint8_t>> sealed = [] {
    std::vector<std::vector<std::uint8_t>> plans;
    for (int id = 1; id <= 8; ++id) plans.push_back(Sealed(SmallPlan(id, id % 2 == 0 ? kJitterUs : -1)));
    return plans;
  }();
  if (input.ConsumeIntegralInRange(0, 31) == 31) return AnyBytes(input, 64);
  std::vector<std::uint8_t> bytes = sealed[input.ConsumeIntegralInRange<std::size_t>(0, sealed.size() - 1)];
  Damage(input, bytes);
  if (!input.ConsumeBool()) return bytes;
  auto plan = Decoded<certified_plan_t>(bytes);
  if (!plan) return bytes;
  for (int left = NumOdd(input); left > 0; --left) Distort(input, *plan);
  return Sealed(*plan);
}

class Session final {
 public:
  explicit Session(bool with_key) : guard_(Options(with_key)), with_key_(with_key) {}

  void Step(FuzzedDataProvider& input) {
    switch (input.ConsumeIntegralInRange(0, 6)) {
      case 0: return Check(input);
      case 1: return TryStart(input);
      case 2: return Accept(input);
      case 3: return guard_.Finish();
      case 4: return guard_.Reset();
      case 5: return guard_.Halt();
      case 6: return Withdraw(input);
    }
  }

  [[nodiscard]] bool has_executed() const { return has_executed_; }
  void RequireConsistent() const {
    Require(!guard_.halted() || (!guard_.pending() && !guard_.executing()));
    Require(!guard_.control().empty() == (guard_.executing() && step_ < std::min(standing_, NumSteps())));
  }

 private:
  // With the guard's key where it has one, or otherwise, or as before.
  struct Message {
    std::vector<std::uint8_t> bytes;
    bool is_signed = false;
  };
  void Receive(FuzzedDataProvider& input) {
    const int how = input.ConsumeIntegralInRange(0, 3);
    if (how == 3) return;
    message_ = {AnyPlan(input), with_key_ == (how == 0)};
    const auto sign = [&](Signer& signer, Role role) {
      return signer.Sign(role, "PLAN_CERTIFIED", message_.bytes, kStart);
    };
    if (how == 2)
      message_ = {input.ConsumeBool() ? sign(forger_, Role::kCertifier) : sign(signer_, Role::kPlanner), false};
    if (message_.is_signed) message_.bytes = sign(signer_, Role::kCertifier);
  }

  [[nodiscard]] int NumSteps() const { return guard_.executing() ? guard_.executing()->plan.num_steps : 0; }

  // Whatever has been learned.
  static bool RestOnTheSame(certified_plan_t one, const certified_plan_t& other) {
    SetDigest(one.observations_digest, GetDigest(other.observations_digest));
    return GroundsOf(one) == GroundsOf(other) &&
           GetDigest(one.transitions_digest) == GetDigest(other.transitions_digest);
  }

  // Of a plan that AnyPlan may have made, by its certificate or by its id alone.
  void Withdraw(FuzzedDataProvider& input) {
    certified_plan_t plan = SmallPlan(input.ConsumeIntegralInRange(1, 8));
    Seal(plan);
    withdrawal_t message{};
    message.plan_id = plan.plan.plan_id;
    message.expires_utime = plan.expires_utime;
    message.valid_steps = AnySmall(input, 4);
    const int kind = input.ConsumeIntegralInRange(0, 3);
    message.cause = kind == 2 ? withdrawal_t::UNKNOWN_PLAN : withdrawal_t::OBSTACLE;
    if (kind == 0) SetDigest(message.certificate_digest, GetDigest(plan.certificate_digest));
    if (kind == 3) SetDigest(message.certificate_digest, DigestOf("another"));
    SetGrounds(message, GroundsOf(plan));
    if (kind == 2) SetDigest(message.observations_digest, GetDigest(plan.transitions_digest));
    const int how = input.ConsumeIntegralInRange(0, 2);
    std::vector<std::uint8_t> bytes = Encode(message);
    if (how == 2) Damage(input, bytes);
    const bool is_signed = with_key_ == (how != 1);
    if (is_signed) bytes = signer_.Sign(Role::kCertifier, "PLAN_WITHDRAWN", bytes, kStart);
    const auto before = guard_.executing() ? guard_.standing_steps() : std::nullopt;
    const auto* const executing = guard_.executing();
    const bool was_pending = guard_.pending() != nullptr;
    const GuardWithdrawal answer = guard_.Withdraw(bytes, kStart);
    Require(answer.verdict.ok() == answer.verdict.message.empty() &&
            answer.verdict.cause != GuardCause::kInternalError && guard_.executing() == executing);
    const auto after = executing ? guard_.standing_steps() : std::nullopt;
    if (!answer.verdict.ok()) return Require(after == before && was_pending == (guard_.pending() != nullptr));
    Require(is_signed == with_key_);
    Require(!before || (after && *after <= *before));
    if (how == 2) {  // its content may be another
      if (after) standing_ = *after;
      if (last_id_) last_id_.reset();
      return;
    }
    const bool has_its_id = executing && executing->plan.plan_id == plan.plan.plan_id;
    const bool names = kind == 0   ? executing && Encode(*executing) == Encode(plan)
                       : kind == 2 ? has_its_id && !RestOnTheSame(*executing, plan)
                                   : kind == 1 && has_its_id;
    if (names) standing_ = std::min(standing_, std::clamp<int>(message.valid_steps, 0, NumSteps()));
    Require(after.value_or(standing_) == standing_);
    if (kind != 2 && last_id_) last_id_ = std::max(*last_id_, plan.plan.plan_id);
    if (kind != 2) last_expiry_ = std::max(last_expiry_, plan.expires_utime);
  }

  void Accept(FuzzedDataProvider& input) {
    Receive(input);
    const bool was_halted = guard_.halted();
    const std::int64_t now = AnyInteger(input, kStart, 2 * kStepUs);
    const GuardVerdict verdict = guard_.Accept(message_.bytes, now);
    Require(verdict.ok() == verdict.message.empty() && verdict.cause != GuardCause::kInternalError);
    if (!verdict.ok()) return;
    const certified_plan_t& plan = *guard_.pending();
    Require(!was_halted && message_.is_signed == with_key_);
    const Bytes inside = WithoutSignature(message_.bytes);
    Require(Encode(plan) == std::vector(inside.begin(), inside.end()) && FindSealFaults(plan).empty());
    Require(GetDigest(plan.config_digest) == DigestOf("config") && GetDigest(plan.model_digest) == DigestOf("model"));
    Require((!last_id_ || plan.plan.plan_id > *last_id_ || now > last_expiry_) && now <= plan.expires_utime);
    last_id_ = plan.plan.plan_id;
    last_expiry_ = std::max(last_expiry_, plan.expires_utime);
    RequireSane(plan);
    if (with_key_) RequireInDomain(plan);
  }

  static void RequireInDomain(const certified_plan_t& plan) {
    for (int t = 0; t < plan.plan.num_steps; ++t) {
      Require(std::abs(plan.plan.control[t][0]) <= 3);
      Require(-12 <= plan.slice_lower[t][0] && plan.slice_upper[t][0] <= 12);
      Require(-5 <= plan.slice_lower[t][1] && plan.slice_upper[t][1] <= 5);
    }
  }

  static void RequireSane(const certified_plan_t& plan) {
    Require(plan.plan.num_states == 2 && plan.plan.num_inputs == 1 && 1 <= plan.plan.num_steps &&
            plan.plan.num_steps <= 128);
    for (int t = 0; t < plan.plan.num_steps; ++t) Require(std::isfinite(plan.plan.control[t][0]));
    for (int t = 0; t <= plan.plan.num_steps; ++t)
      for (int k = 0; k < 2; ++k)
        Require(std::isfinite(plan.slice_lower[t][k]) && plan.slice_lower[t][k] <= plan.slice_upper[t][k]);
  }

  void TryStart(FuzzedDataProvider& input) {
    const std::int64_t boundary = AnyInteger(input, kStart, 2 * kStepUs);
    const std::vector<double> state = State(input);
    const std::int64_t now = AnyInteger(input, kStart, 2 * kStepUs);
    if (!guard_.TryStart(boundary, now, state).ok()) return;
    const certified_plan_t* plan = guard_.executing();
    Require(plan && !guard_.pending() && Apart(plan->plan.start_utime, boundary) <= kStepUs / 2 &&
            now <= plan->expires_utime);
    RequireInSlice(*plan, 0, state);
    Require(IsOnTime(*plan, 0, boundary) && IsOnTime(*plan, 0, now));
    step_ = 0;
    standing_ = 128;
  }

  void Check(FuzzedDataProvider& input) {
    const int step = input.ConsumeBool() ? input.ConsumeIntegral<int>() : step_ + 1;
    const std::vector<double> state = State(input);
    const std::int64_t now = AnyInteger(input, kStart + (step_ + 1) * kStepUs, 2 * kStepUs);
    const bool ok = guard_.Check(step, state, now).ok();
    Require(ok == (guard_.executing() != nullptr));  // after any refusal nothing is executing
    if (!ok) return;
    Require(step == ++step_ && step <= standing_);
    RequireInSlice(*guard_.executing(), step, state);
    Require(IsOnTime(*guard_.executing(), step, now));
    has_executed_ = true;
  }

  static void RequireInSlice(const certified_plan_t& plan, int step, const std::vector<double>& state) {
    Require(state.size() == 2 && step <= plan.plan.num_steps);
    for (std::size_t k = 0; k < 2; ++k)
      Require(plan.slice_lower[step][k] <= state[k] + plan.state_error[k] &&
              state[k] - plan.state_error[k] <= plan.slice_upper[step][k]);
  }

  // In wider arithmetic. No time is later than the last one of 64 bits.
  static bool IsOnTime(const certified_plan_t& plan, int step, std::int64_t now) {
    const __int128 due = plan.plan.start_utime + static_cast<__int128>(step) * plan.plan.step_us;
    const __int128 late = now - std::min<__int128>(due, INT64_MAX);
    return plan.step_error_us < 0 || (-plan.step_error_us <= late && late <= plan.step_error_us);
  }

  static std::uint64_t Apart(std::int64_t a, std::int64_t b) {
    return static_cast<std::uint64_t>(std::max(a, b)) - static_cast<std::uint64_t>(std::min(a, b));
  }

  static std::vector<double> State(FuzzedDataProvider& input) {
    std::vector<double> state{1, -2};
    if (input.ConsumeBool()) state.resize(input.ConsumeIntegralInRange<std::size_t>(0, 20));
    if (!state.empty() && input.ConsumeBool())
      state[input.ConsumeIntegralInRange<std::size_t>(0, state.size() - 1)] = AnyNumber(input);
    return state;
  }

  Guard guard_;
  const bool with_key_;
  Signer signer_{Keys(true), "bus", 1}, forger_{Keys(false), "bus", 2};
  std::optional<std::int64_t> last_id_;
  std::int64_t last_expiry_ = INT64_MIN;
  Message message_;
  int step_ = 0;
  int standing_ = 128;  // controls of the executing plan
  bool has_executed_ = false;
};

}  // namespace

bool Try(Bytes data) {
  FuzzedDataProvider input(data.data(), data.size());
  Session session(input.ConsumeBool());
  for (int step = 0; step < 32 && input.remaining_bytes() > 0; ++step) {
    session.Step(input);
    session.RequireConsistent();
  }
  return session.has_executed();
}

}  // namespace forereach
