#include "torture/torture.h"

#include <algorithm>
#include <memory>
#include <numeric>
#include <optional>
#include <set>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "bus/bus.h"
#include "certifier/gate/candidate_message.h"
#include "certifier/gate/robot_messages.h"
#include "certifier/gate/stamp.h"
#include "certifier/gate/upheld.h"
#include "forereach/certifier_status_t.hpp"
#include "forereach/decision_t.hpp"
#include "forereach/execution_event_t.hpp"
#include "forereach/robot_state_t.hpp"
#include "lcmtypes/grounds.h"
#include "lcmtypes/names.h"
#include "lcmtypes/seal.h"
#include "torture/hostile_messages.h"

namespace forereach {
namespace {

constexpr const char* kSource = "torture";
constexpr double kAnswersWithinS = 0.4;  // of a gate that refuses
constexpr int kHonestTries = 5;
constexpr std::int64_t kJumpUs = 3'600'000'000;

class Torturer final {
 public:
  Torturer(const Config& config, const TortureOptions& options)
      : config_(config), options_(options), bus_(OpenBus(config.bus.url)) {
    if (config.bus.keys) signer_.emplace(*config.bus.keys, config.bus.bus_name());
    report_.is_signed = signer_.has_value();
    const BusOptions& channels = config.bus;
    bus_->Subscribe(Bus::kEveryChannel, [this, speakers = channels.speakers()](const Received& r) {
      if (speakers.contains(r.channel) && is_recording_) heard_[r.channel].assign(r.raw.begin(), r.raw.end());
    });
    bus_->Subscribe(channels.decision, [this](const Received& r) { OnDecision(r); });
    bus_->Subscribe(channels.status, [this](const Received& r) {
      if (const auto status = Decoded<certifier_status_t>(WithoutSignature(r.bytes))) status_ = status;
    });
    bus_->Subscribe(channels.robot_state, [this](const Received& r) {
      const auto state = Decoded<robot_state_t>(WithoutSignature(r.bytes));
      if (state && FaultOf(*state, Model().num_states()).empty()) state_ = state;
    });
    bus_->Subscribe(channels.event, [this](const Received& r) { OnEvent(r); });
  }

  TortureReport Run(const std::function<void()>& progress) {
    Listen(options_.patience_s, [this] { return status_ && state_; });
    report_.gate_heard = status_.has_value();
    report_.robot_heard = state_.has_value();
    if (!status_ && !state_)
      throw ConfigError("{}: neither a gate's heartbeat nor a robot's state is heard", config_.bus.url);
    std::tie(report_.honest, report_.honest_is_judged) = AskHonestly();
    is_recording_ = false;  // what is heard from now on may be its own
    const auto part = [&](const auto& attack) {
      attack();
      if (progress) progress();
    };
    for (const CandidateFlaw& flaw : CandidateFlaws()) part([&] { SendFlawed(flaw); });
    part([this] { SendTwice(); });
    part([this] { JumpClock(); });
    part([this] { Flood(); });
    for (const CertificateFlaw& flaw : CertificateFlaws()) part([&] { SendFlawed(flaw); });
    if (signer_) part([this] { SendAsStranger(); });
    if (signer_) part([this] { UseKeyElsewhere(); });
    const auto [honest, is_judged] = AskHonestly();
    report_.alive =
        report_.honest.empty() ? HearsHeartbeat() : !honest.empty() && is_judged == report_.honest_is_judged;
    CountAnswers();
    return report_;
  }

 private:
  [[nodiscard]] const NominalModel& Model() const { return *config_.problem->model; }

  // ---- What is heard.

  void OnDecision(const Received& received) {
    const auto decision = Decoded<decision_t>(WithoutSignature(received.bytes));
    if (!decision) return;
    const bool is_judged =
        decision->outcome == decision_t::CERTIFIED || decision->outcome == decision_t::ABSTAIN_DOMAIN ||
        decision->outcome == decision_t::ABSTAIN_SAFETY || decision->outcome == decision_t::ABSTAIN_FALSIFIED ||
        decision->cause == decision_t::CAUSE_SHADOW;
    const auto asked = asked_.find(GetDigest(decision->plan_digest));
    if (asked == asked_.end()) return;
    ++(is_judged ? asked->second.judged : asked->second.refused);
    asked->second.text = fmt::format("{}, {}", OutcomeName(decision->outcome), CauseName(decision->cause));
  }

  // What a guard does only if it believes a message of this program.
  void OnEvent(const Received& received) {
    const auto event = Decoded<execution_event_t>(WithoutSignature(received.bytes));
    if (!event) return;
    const bool is_forged =
        event->kind == execution_event_t::WITHDRAWN && event->value == static_cast<double>(kForgedSequence);
    if (forged_plans_.contains(event->plan_id) && event->kind == execution_event_t::REFUSED) ++refused_by_guard_;
    if ((forged_plans_.contains(event->plan_id) && event->kind != execution_event_t::REFUSED) || is_forged ||
        (attacks_guard_ && (event->kind == execution_event_t::HALTED || event->kind == execution_event_t::RESET)))
      obeyed_.push_back(GetText(event->message));
  }

  void Listen(
      double seconds, const std::function<bool()>& done = [] { return false; }) {
    const auto until = WallClockUs() + static_cast<std::int64_t>(seconds * 1e6);
    do bus_->Dispatch(10);
    while (!done() && WallClockUs() < until);
  }

  // ---- What is sent.

  // From a point beside the robot, where no guard starts it, or beside where the task begins; without controls, or the
  // nearest to none.
  candidate_plan_t Honest() {
    const NominalModel& model = Model();
    const Box& inputs = config_.problem->domain.input;
    const Eigen::VectorXd control =
        inputs.lower().cwiseMax(Eigen::VectorXd::Zero(model.num_inputs()).cwiseMin(inputs.upper()));
    Eigen::VectorXd center = (config_.initial_set.lower() + config_.initial_set.upper()) / 2;
    if (state_) center = Eigen::Map<const Eigen::VectorXd>(state_->state, model.num_states());
    const Box& states = config_.problem->domain.state;
    center += 0.01 * ((states.lower() + states.upper()) / 2 - center) + 1e-3 * (states.upper() - states.lower());
    candidate_plan_t candidate{};
    candidate.utime = WallClockUs();
    candidate.sequence = sequence_++;
    // Above those of an earlier run, which the gate may remember.
    candidate.plan_id = last_plan_id_ = std::max(last_plan_id_ + 1, candidate.utime);
    SetText(candidate.source, kSource);
    candidate.step_us = Microseconds(config_.robot.step_period_ms);
    candidate.start_utime = candidate.utime + 4 * candidate.step_us + Microseconds(config_.gate.decision_budget_ms);
    SetPlan(candidate, center, Eigen::VectorXd::Zero(model.num_states()), control.replicate(1, 4));
    return candidate;
  }

  // A message of this program: signed, where it has a key, at this time.
  void Send(const std::string& channel, Bytes message, std::int64_t signed_at_us = 0) {
    const auto signed_message =
        signer_ ? signer_->Sign(Role::kPlanner, channel, message, signed_at_us != 0 ? signed_at_us : WallClockUs())
                : RawMessage(message.begin(), message.end());
    SendRaw(channel, signed_message);
  }
  void SendRaw(const std::string& channel, Bytes bytes) {
    bus_->Publish(channel, bytes);
    ++row_->sent;
  }

  TortureRow& Begin(const std::string& attack) {
    row_ = &report_.rows.emplace_back();
    row_->attack = attack;
    return *row_;
  }

  // How an honest candidate is answered; and whether it was judged, as no attack may be. A loaded gate may
  // answer too late for the start; then another one is sent.
  std::pair<std::string, bool> AskHonestly() {
    TortureRow unused;
    row_ = &unused;
    for (int more = kHonestTries;; --more) {
      const auto bytes = Encode(Honest());
      const Asked& asked = asked_[PlanDigest(Bytes(bytes))];
      Send(config_.bus.candidate, bytes);
      Listen(options_.patience_s, [&] { return !asked.text.empty(); });
      const bool is_late = asked.text.starts_with(OutcomeName(decision_t::ABSTAIN_DEADLINE));
      if (more == 1 || asked.judged > 0 || !is_late) return {asked.text, asked.judged > 0};
    }
  }

  bool HearsHeartbeat() {
    status_.reset();
    Listen(options_.patience_s, [this] { return status_.has_value(); });
    return status_.has_value();
  }

  // Notes a candidate of this attack, of which no more copies than `may_be_judged` may be judged.
  void Expect(Bytes candidate, int may_be_judged) {
    Asked& asked = asked_[PlanDigest(candidate)];
    asked.attack = report_.rows.size();
    asked.may_be_judged = may_be_judged;
  }

  // A slow gate may have answered after the attack.
  void CountAnswers() {
    for (const auto& [digest, asked] : asked_) {
      if (asked.attack == 0) continue;
      TortureRow& row = report_.rows[asked.attack - 1];
      row.refused += asked.refused;
      if (asked.judged <= asked.may_be_judged) continue;
      row.through += asked.judged - asked.may_be_judged;
      row.remark = fmt::format("judged: {}", asked.text);
    }
  }

  void SendFlawed(const CandidateFlaw& flaw) {
    Begin(fmt::format("to the gate: {}", flaw.name));
    const std::size_t count = flaw.make(Honest(), WallClockUs()).size();
    for (std::size_t i = 0; i < count; ++i) {
      const RawMessage message = flaw.make(Honest(), WallClockUs())[i];  // each with a plan_id of its own
      Expect(message, 0);
      Send(config_.bus.candidate, message);
      Listen(0.002);
    }
    Listen(kAnswersWithinS);
  }

  void SendTwice() {
    Begin("to the gate: the same candidate twice");
    for (int i = 0; i < 5; ++i) {
      const auto message = Encode(Honest());
      Expect(message, 1);
      for (int j = 0; j < 2; ++j) Send(config_.bus.candidate, message);
      Listen(0.02);
    }
    Listen(kAnswersWithinS);
  }

  void JumpClock() {
    Begin("to the gate: a clock that jumps by an hour");
    for (int i = 0; i < 12; ++i) {
      const std::int64_t jump = i % 3 == 0 ? 0 : i % 3 == 1 ? kJumpUs : -kJumpUs;
      candidate_plan_t candidate = Honest();
      candidate.utime += jump;
      candidate.start_utime += jump;
      const auto message = Encode(candidate);
      Expect(message, jump == 0 ? 1 : 0);
      Send(config_.bus.candidate, message, candidate.utime);
      Listen(0.02);
    }
    Listen(kAnswersWithinS);
  }

  // Each is a candidate like all: what counts is that the gate is there afterwards.
  void Flood() {
    TortureRow& row = Begin("to the gate: a flood of candidates");
    for (int i = 0; i < options_.flood; ++i) {
      Send(config_.bus.candidate, Encode(Honest()));
      // Its own queue must not overflow with the answers.
      if (i % 16 == 0) bus_->Dispatch(0);
    }
    if (!report_.gate_heard || HearsHeartbeat()) return;
    ++row.through;
    row.remark = "no heartbeat afterwards";
  }

  // The domain's box for slices, and a start in its corner, where the robot is not.
  certified_plan_t Forged() {
    const Domain& domain = config_.problem->domain;
    const int n = Model().num_states();
    certified_plan_t certified{};
    certified.plan = Honest();
    const Eigen::VectorXd half = Eigen::VectorXd::Constant(n, 0);
    std::ranges::copy(domain.state.lower(), certified.plan.initial_center);
    std::ranges::copy(half, certified.plan.initial_half_width);
    certified.utime = certified.plan.utime;
    certified.expires_utime = certified.utime + 1'000'000;
    for (int t = 0; t <= certified.plan.num_steps; ++t) {
      std::ranges::copy(domain.state.lower(), certified.slice_lower[t]);
      std::ranges::copy(domain.state.upper(), certified.slice_upper[t]);
    }
    SetUpheld(certified, UpheldUnder(*config_.problem, config_.gate));
    SetGrounds(certified, config_.grounds);
    forged_plans_.insert(certified.plan.plan_id);
    return certified;
  }

  void SendFlawed(const CertificateFlaw& flaw) {
    TortureRow& row = Begin(fmt::format("to the guard: a certificate {}", flaw.name));
    for (int i = 0; i < 3; ++i) {
      const certified_plan_t certified = flaw.make(Forged(), WallClockUs());
      forged_plans_.insert(certified.plan.plan_id);
      Send(config_.bus.certified, Encode(certified));
      Listen(0.02);
    }
    CountObeyed(row);
  }

  void CountObeyed(TortureRow& row) {
    Listen(kAnswersWithinS);
    row.refused += std::exchange(refused_by_guard_, 0);
    row.through += std::ssize(obeyed_);
    if (!obeyed_.empty()) row.remark = fmt::format("obeyed: {}", obeyed_.front());
    obeyed_.clear();
  }

  void SendAsStranger() {
    Begin("to the gate: without a signature, signed an hour ago or ahead, again, altered");
    for (const std::int64_t when : {std::int64_t{0}, -kJumpUs, kJumpUs}) {
      const auto message = Encode(Honest());
      Expect(message, 0);
      if (when == 0)
        SendRaw(config_.bus.candidate, message);
      else
        Send(config_.bus.candidate, message, WallClockUs() + when);
      Listen(0.02);
    }
    const auto message = Encode(Honest());
    auto signed_message = signer_->Sign(Role::kPlanner, config_.bus.candidate, message, WallClockUs());
    Expect(message, 1);
    for (int i = 0; i < 2; ++i) SendRaw(config_.bus.candidate, signed_message);
    signed_message[signed_message.size() / 3] ^= 1;
    Expect(WithoutSignature(signed_message), 0);
    SendRaw(config_.bus.candidate, signed_message);
    Listen(kAnswersWithinS);
  }

  // Every channel that is not the planner's: what would do harm, unsigned and signed with the planner's key; and what
  // was heard there, again and altered.
  void UseKeyElsewhere() {
    TortureRow& row = Begin("to all: the planner's key on other roles' channels, replays, alterations");
    const certifier_status_t before = status_.value_or(certifier_status_t{});
    attacks_guard_ = true;
    const certified_plan_t forged = Sealed(Forged());
    auto harmful = HarmfulMessages(config_.bus, heard_, &forged, WallClockUs());
    harmful[config_.bus.certified] = Encode(forged);
    harmful.erase(config_.bus.candidate);
    for (const auto& [channel, message] : harmful) {
      SendRaw(channel, message);
      Send(channel, message);
      if (!heard_.contains(channel)) continue;
      RawMessage recorded = heard_.at(channel);
      SendRaw(channel, recorded);
      recorded[recorded.size() / 2] ^= 1;
      SendRaw(channel, recorded);
    }
    CountObeyed(row);
    attacks_guard_ = false;
    if (!report_.gate_heard) return;
    if (!HearsHeartbeat()) return Through(row, "no heartbeat afterwards");
    if (status_->version != before.version || status_->failed_reloads != before.failed_reloads)
      Through(row, "the gate has reloaded its task");
    if (status_->fault != before.fault) Through(row, "the gate has latched a fault");
    if (status_->obstacles_in_force == 0 && before.obstacles_in_force > 0)
      Through(row, "the gate takes it that nothing is there");
  }

  static void Through(TortureRow& row, const std::string& what) {
    ++row.through;
    row.remark = what;
  }

  struct Asked {
    std::size_t attack = 0;  // counted from 1; 0: an honest one
    int may_be_judged = 0, judged = 0, refused = 0;
    std::string text;  // of the last answer
  };

  const Config& config_;
  const TortureOptions options_;
  const std::unique_ptr<Bus> bus_;  // it looks at no signature
  std::optional<Signer> signer_;
  TortureReport report_;
  TortureRow* row_ = nullptr;  // under way
  bool is_recording_ = true, attacks_guard_ = false;
  std::int64_t sequence_ = 0, last_plan_id_ = 0, refused_by_guard_ = 0;
  std::map<Digest, Asked> asked_;
  std::map<std::string, RawMessage> heard_;
  std::optional<certifier_status_t> status_;
  std::optional<robot_state_t> state_;
  std::set<std::int64_t> forged_plans_;
  std::vector<std::string> obeyed_;
};

void RequireLoopback(const BusOptions& bus, const std::string& beyond_loopback) {
  const bool stays = !bus.url.starts_with("udpm://") || ParseMulticastUrl(bus.url).ttl == 0;
  if (stays || beyond_loopback == bus.bus_name()) return;
  throw ConfigError(
      "{}: leaves this machine (ttl is not 0). To torture other machines on purpose, add --beyond-loopback {}", bus.url,
      bus.bus_name());
}

}  // namespace

std::int64_t TortureReport::through() const {
  return std::accumulate(rows.begin(), rows.end(), std::int64_t{0},
                         [](std::int64_t sum, const TortureRow& row) { return sum + row.through; });
}

std::string ToText(const TortureReport& report) {
  std::string text = fmt::format("{:<76}{:>7}{:>9}{:>9}\n", "attack", "sent", "refused", "through");
  for (const TortureRow& row : report.rows)
    text += fmt::format("{:<76}{:>7}{:>9}{:>9}{}\n", row.attack, row.sent, row.refused, row.through,
                        row.remark.empty() ? "" : "  " + row.remark);
  text += fmt::format("gate: {}; an honest candidate before: {}; afterwards the gate is {}\n",
                      report.gate_heard ? "heard" : "not heard", report.honest.empty() ? "no answer" : report.honest,
                      report.alive ? "there" : "NOT there");
  text += fmt::format("robot: {}\n", report.robot_heard ? "heard" : "not heard: nothing is said about a guard");
  if (!report.honest_is_judged)
    text += "the honest candidate was not judged, so the gate may have refused the others for that reason, too\n";
  if (!report.is_signed)
    text += "UNSIGNED: well-formed forgeries were not tried; whoever sends one moves, stops or resets this robot\n";
  return text + fmt::format("{} got through\n", report.through());
}

nlohmann::json ToJson(const TortureReport& report) {
  nlohmann::json json{{"signed", report.is_signed},
                      {"gate_heard", report.gate_heard},
                      {"robot_heard", report.robot_heard},
                      {"honest", report.honest},
                      {"honest_is_judged", report.honest_is_judged},
                      {"alive", report.alive},
                      {"through", report.through()},
                      {"attacks", nlohmann::json::array()}};
  for (const TortureRow& row : report.rows)
    json["attacks"].push_back({{"attack", row.attack},
                               {"sent", row.sent},
                               {"refused", row.refused},
                               {"through", row.through},
                               {"remark", row.remark}});
  return json;
}

std::size_t TortureSteps(const Config& config) {
  return CandidateFlaws().size() + 3 + CertificateFlaws().size() + (config.bus.keys ? 2 : 0);
}

TortureReport Torture(const Config& config, const TortureOptions& options, const std::function<void()>& progress) {
  RequireLoopback(config.bus, options.beyond_loopback);
  return Torturer(config, options).Run(progress);
}

}  // namespace forereach
