#include "cli/replay.h"

#include <deque>
#include <filesystem>
#include <map>
#include <memory>
#include <utility>

#include "certifier/gate/gate.h"
#include "certifier/task/key.h"
#include "cli/restarts.h"
#include "forereach/certified_plan_t.hpp"
#include "forereach/decision_t.hpp"
#include "lcmtypes/names.h"
#include "lcmtypes/seal.h"
#include "logger/event_log.h"
#include "logger/log_authenticator.h"

namespace forereach {
namespace {

std::string InWords(const decision_t& decision) {
  std::string text(OutcomeName(decision.outcome));
  text += ", cause " + std::string(CauseName(decision.cause));
  return text + ", step " + std::to_string(decision.step);
}

// Empty if they agree.
std::string Difference(const decision_t& recorded, const decision_t& replayed) {
  if (recorded.outcome != replayed.outcome || recorded.cause != replayed.cause || recorded.step != replayed.step)
    return "recorded " + InWords(recorded) + "; replayed " + InWords(replayed);
  const auto differs = [](const auto& a, const auto& b) { return GetDigest(a) != GetDigest(b); };
  if (differs(recorded.config_digest, replayed.config_digest)) return "another config";
  if (differs(recorded.model_digest, replayed.model_digest)) return "another model";
  if (differs(recorded.declaration_digest, replayed.declaration_digest)) return "another declaration";
  if (differs(recorded.observations_digest, replayed.observations_digest)) return "other observations";
  if (differs(recorded.obstacles_digest, replayed.obstacles_digest)) return "other obstacles";
  return {};
}

// What no replay can give again.
bool IsCircumstance(std::int16_t cause) {
  switch (cause) {
    case decision_t::CAUSE_QUEUE_FULL:
    case decision_t::CAUSE_OVERRUN:
    case decision_t::CAUSE_NOT_ARMED:
    case decision_t::CAUSE_FAULT:
      return true;
    default:
      return false;
  }
}

class Replayer {
 public:
  explicit Replayer(const Config& config) : config_(config), authenticator_(config.bus, PublicKeysOf(config.bus)) {
    Restart();
  }

  // `log` names the file where there are several.
  void Feed(const LogEvent& event, const std::string& log) {
    if (!authenticator_.IsAuthentic(event)) return;
    const std::string name = log + "event " + std::to_string(event.number);
    if (event.channel == config_.bus.obstacles || event.channel == config_.bus.transition) {
      changes_.push_back({event.channel, {event.message().begin(), event.message().end()}, event.utime});
    } else if (event.channel == config_.bus.candidate) {
      ++result_.candidates;
      candidates_[DigestOf(event.message())].push_back({{event.message().begin(), event.message().end()}, name});
    } else if (event.channel == config_.bus.decision) {
      FeedDecision(event, name);
    } else if (event.channel == config_.bus.status) {
      FeedStatus(event);
    } else if (event.channel == config_.bus.certified) {
      CheckSeal(event, name);
    }
  }

  ReplayResult Finish(std::int64_t corruptions) {
    result_.corruptions = corruptions;
    result_.passed_over.not_authentic = authenticator_.refusals();
    for (const auto& [digest, waiting] : candidates_)
      for (const Candidate& candidate : waiting) Differ(candidate.name, -1, "no decision recorded");
    return std::move(result_);
  }

 private:
  struct Candidate {
    std::vector<std::uint8_t> bytes;
    std::string name;
  };
  struct Change {
    std::string channel;
    std::vector<std::uint8_t> bytes;
    std::int64_t utime;
  };

  void Restart() {
    gate_ = std::make_unique<Gate>(config_);
    changes_.clear();
    last_sequence_ = -1;
  }

  void Reload() {
    while (!changes_.empty()) TakeChange();
    const std::unique_ptr<Gate> before = std::exchange(gate_, std::make_unique<Gate>(config_));
    gate_->Inherit(*before);
  }

  void FeedStatus(const LogEvent& event) {
    const Restarts::Kind kind = restarts_.Notice(event.message());
    if (kind == Restarts::Kind::kBegin) Restart();
    if (kind == Restarts::Kind::kReload) Reload();
  }

  void FeedDecision(const LogEvent& event, const std::string& name) {
    const auto recorded = Decoded<decision_t>(event.message());
    if (!recorded) return;
    if (recorded->sequence < last_sequence_) Restart();
    last_sequence_ = recorded->sequence;
    auto& waiting = candidates_[GetDigest(recorded->plan_digest)];
    if (waiting.empty()) return Differ(name, recorded->plan_id, "decided, but its candidate is not in the log");
    const Candidate candidate = std::move(waiting.front());
    waiting.pop_front();
    CatchUp(*recorded);
    if (IsCircumstance(recorded->cause)) {
      static_cast<void>(gate_->Refuse(candidate.bytes, recorded->utime, recorded->cause, ""));
      ++result_.circumstances;
      return;
    }
    const std::string difference = Difference(*recorded, gate_->Decide(candidate.bytes, recorded->utime).decision);
    if (difference.empty())
      ++result_.agreed;
    else
      Differ(candidate.name, recorded->plan_id, difference);
  }

  // What had changed before the decision was made, which is at most what is logged before it.
  void CatchUp(const decision_t& recorded) {
    const Digest obstacles = GetDigest(recorded.obstacles_digest), observations = GetDigest(recorded.observations_digest);
    while (!changes_.empty() && (gate_->obstacles_digest() != obstacles || gate_->observations_digest() != observations))
      TakeChange();
  }

  void TakeChange() {
    const Change& change = changes_.front();
    if (change.channel == config_.bus.obstacles)
      static_cast<void>(gate_->UpdateObstacles(change.bytes, change.utime));
    else
      static_cast<void>(gate_->Learn(change.bytes));
    changes_.pop_front();
  }

  void CheckSeal(const LogEvent& event, const std::string& name) {
    const auto certified = Decoded<certified_plan_t>(event.message());
    if (!certified) {
      ++result_.passed_over.undecodable;
      return;
    }
    for (const SealFault& fault : FindSealFaults(*certified))
      Differ(name, certified->plan.plan_id,
             "the seal does not hold: " + fault.field + " is " + fault.found + ", it has to be " + fault.expected);
  }

  void Differ(const std::string& event, std::int64_t plan_id, const std::string& what) {
    result_.differences.push_back(event + ", plan " + std::to_string(plan_id) + ": " + what);
  }

  const Config& config_;
  LogAuthenticator authenticator_;
  std::unique_ptr<Gate> gate_;
  std::map<Digest, std::deque<Candidate>> candidates_;  // not decided yet
  std::deque<Change> changes_;                          // logged, and perhaps not yet seen by the certifier
  Restarts restarts_;
  std::int64_t last_sequence_ = -1;
  ReplayResult result_;
};

}  // namespace

ReplayResult Replay(const std::vector<std::string>& logs, const Config& config) {
  Replayer replayer(config);
  const auto name = [&logs](const std::string& log) {
    return logs.size() == 1 ? "" : std::filesystem::path(log).filename().string() + " ";
  };
  const LogDamage damage =
      ForEachEvent(logs, [&](const LogEvent& event, const std::string& log) { replayer.Feed(event, name(log)); });
  return replayer.Finish(damage.places);
}

}  // namespace forereach
