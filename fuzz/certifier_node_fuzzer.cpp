// Every inbound type in any order through the certifier's node: each candidate is answered once, a certified plan goes
// out right before its decision, and none while a fault is latched or the robot's state or the obstacles are not known.
// A withdrawal names a plan that was certified, with fewer controls than the withdrawals of it before, unless it
// repeats the last one; or a plan that the robot says it executes. An advice is on a plan that was just abstained on.
#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "bus/log.h"
#include "certifier/process/certifier_node.h"
#include "fuzz/candidates.h"
#include "fuzz/small_bus.h"
#include "lcmtypes/seal.h"

namespace forereach {
namespace {

/** Hands each message to its subscriber at once, and looks at what the node sends. */
class WitnessBus final : public Bus {
 public:
  using Bus::Publish;
  void Subscribe(const std::string& channel, Handler handler) override { handlers_[channel] = std::move(handler); }
  int Dispatch(int) override { return 0; }
  std::int64_t dropped() const override { return 0; }

  bool Publish(const std::string& channel, Bytes bytes) override {
    if (channel == "PLAN_CERTIFIED") {
      Require(!certified_ && may_certify);
      certified_ = Decoded<certified_plan_t>(bytes);
      Require(certified_ && FindSealFaults(*certified_).empty());
      has_certified = true;
      standing_[GetDigest(certified_->certificate_digest)] = certified_->plan.num_steps + 1;
    } else if (channel == "PLAN_DECISION") {
      TakeDecision(Decoded<decision_t>(bytes));
    } else if (channel == "PLAN_WITHDRAWN") {
      TakeWithdrawal(Decoded<withdrawal_t>(bytes));
    } else if (channel == "PLAN_ADVICE") {
      TakeAdvice(Decoded<advice_t>(bytes));
    }
    return true;
  }

  void Deliver(const std::string& channel, Bytes bytes, std::int64_t now_us) {
    if (channel == "PLAN_CANDIDATE") ++unanswered_[PlanDigest(bytes)];
    handlers_.at(channel)({channel, bytes, now_us, bytes});
  }

  void RequireAllAnswered() const {
    Require(!certified_);
    for (const auto& [digest, count] : unanswered_) Require(count == 0);
  }

  bool may_certify = false, has_certified = false;

 private:
  void TakeDecision(const std::optional<decision_t>& decision) {
    Require(decision.has_value() && unanswered_[GetDigest(decision->plan_digest)]-- > 0);
    Require(certified_.has_value() == (decision->outcome == decision_t::CERTIFIED));
    Require(!certified_ || GetDigest(certified_->plan_digest) == GetDigest(decision->plan_digest));
    Require(decision->cause != decision_t::CAUSE_INTERNAL_ERROR);
    certified_.reset();
    abstained_.reset();
    if (decision->outcome == decision_t::ABSTAIN_SAFETY || decision->outcome == decision_t::ABSTAIN_DOMAIN)
      abstained_ = GetDigest(decision->plan_digest);
  }

  void TakeAdvice(const std::optional<advice_t>& advice) {
    Require(advice.has_value() && advice->sequence == advices_++);
    Require(abstained_ && GetDigest(advice->plan_digest) == *abstained_);
    abstained_.reset();
    Require(0 <= advice->num_changes && advice->num_changes <= 8);
    const candidate_plan_t& proposal = advice->proposal;
    if (advice->changed == 0) return Require(proposal.num_steps == 0 && HasSense(*advice));
    Require(0 < advice->changed && advice->changed < 8 && advice->num_changes == 0 && advice->nearness[0] >= 0);
    Require(1 <= proposal.num_steps && proposal.num_steps <= 128 && proposal.progress_steps <= proposal.num_steps);
    for (int t = 0; t < proposal.num_steps; ++t)
      for (int k = 0; k < 2; ++k) Require(std::abs(proposal.control[t][k]) <= 3);  // the box of the small task
  }

  static bool HasSense(const advice_t& advice) {
    return std::ranges::all_of(advice.change, advice.change + advice.num_changes, [](const advice_change_t& change) {
      return change.index >= 0 && change.value > 0 && std::isfinite(change.value);
    });
  }

  void TakeWithdrawal(const std::optional<withdrawal_t>& withdrawal) {
    Require(withdrawal.has_value() && withdrawal->sequence == withdrawals_++ && withdrawal->valid_steps >= 0);
    const bool is_stranger = GetDigest(withdrawal->certificate_digest) == Digest{};
    Require(is_stranger || withdrawal->cause != withdrawal_t::UNKNOWN_PLAN);
    if (is_stranger) return Require(withdrawal->valid_steps == 0);
    const auto standing = standing_.find(GetDigest(withdrawal->certificate_digest));
    Require(standing != standing_.end() && withdrawal->valid_steps <= standing->second);
    standing->second = withdrawal->valid_steps;
  }

  std::map<std::string, Handler> handlers_;
  std::map<Digest, int> standing_;  // controls, by certificate; of a whole one: one more than it has
  std::int64_t withdrawals_ = 0, advices_ = 0;
  std::optional<Digest> abstained_;  // the plan of the last decision, if it may be advised on
  std::map<Digest, int> unanswered_;
  std::optional<certified_plan_t> certified_;
};

command_t Command(std::int64_t now) {
  command_t command{};
  command.utime = now;
  command.kind = command_t::RESET;  // RELOAD reads a file in a thread of its own: config_fuzzer.cpp
  return command;
}

class Session final {
 public:
  explicit Session(const Config& config) : node_(config, bus_, {[this] { return now_; }, [this] { return steady_; }}) {}

  void Step(FuzzedDataProvider& input) {
    ++step_;
    switch (input.ConsumeIntegralInRange(0, 8)) {
      case 0: return Tick();
      case 1: return bus_.Deliver("ROBOT_STATE", Damaged(input, RobotState(input, step_, now_)), now_);
      case 2: return bus_.Deliver("PLAN_CANDIDATE", Damaged(input, AnyCandidate(input, now_)), now_);
      case 3: return bus_.Deliver("TRANSITION", Damaged(input, Transition(input, now_)), now_);
      case 4: return bus_.Deliver("OBSTACLES", Damaged(input, AnyObstacles(input, step_, now_)), now_);
      case 5: return DeliverCommand(Damaged(input, Command(now_)));
      case 6: return Wait(input);
      case 7: return bus_.Deliver("OBSTACLES", Damaged(input, AnyMoving(input, step_, now_)), now_);
      case 8: return bus_.Deliver("EXECUTION_EVENT", Damaged(input, AnAnswer(input)), now_);
    }
  }

  void Finish() {
    while (node_.busy()) Tick();
    bus_.RequireAllAnswered();
  }

  [[nodiscard]] bool has_certified() const { return bus_.has_certified; }

 private:
  void DeliverCommand(const std::vector<std::uint8_t>& bytes) {
    const auto command = Decoded<command_t>(bytes);
    if (!command || command->kind != command_t::RELOAD) bus_.Deliver("COMMAND", bytes, now_);
  }

  void Wait(FuzzedDataProvider& input) {
    const std::int64_t by = input.ConsumeIntegralInRange(0, 1'500'000);
    steady_ += by;
    now_ += by + (input.ConsumeBool() ? 0 : input.ConsumeIntegralInRange(-400'000, 400'000));
  }

  void Tick() {
    // A fault that this tick finds is latched before candidates are looked at, so it may only take the right away.
    bus_.may_certify = node_.watch().state() == Watch::State::kArmed;
    node_.Tick(now_);
  }

  std::int64_t now_ = kNow, steady_ = 0, step_ = 0;
  WitnessBus bus_;
  CertifierNode node_;
};

std::vector<Config> Tasks() {
  Config watchful = SmallTask(), stubborn = SmallTask();
  watchful.gate.needs_robot_state = true;
  stubborn.gate.learns = false;
  stubborn.gate.queue = 1;
  Config seeing = SmallTaskOnTheBus();
  seeing.gate.obstacles_lost_ms = 1000;
  seeing.gate.needs_robot_state = true;
  Config timed = seeing;
  timed.gate.max_clock_error_ms = 20;
  Config advising = timed;
  advising.gate.needs_robot_state = false;
  advising.gate.advises = true;
  return {watchful, SmallTask(), stubborn, seeing, timed, advising};
}

}  // namespace

bool Try(Bytes data) {
  static const std::vector<Config> tasks = [] {
    logging::Silence();
    return Tasks();
  }();
  FuzzedDataProvider input(data.data(), data.size());
  Session session(tasks[input.ConsumeIntegralInRange<std::size_t>(0, tasks.size() - 1)]);
  for (int step = 0; step < 64 && input.remaining_bytes() > 0; ++step) session.Step(input);
  session.Finish();
  return session.has_certified();
}

}  // namespace forereach
