#include "cli/replay.h"

#include <deque>
#include <filesystem>
#include <map>
#include <optional>

#include "certifier/gate/gate.h"
#include "forereach/certified_plan_t.hpp"
#include "forereach/decision_t.hpp"
#include "lcmtypes/names.h"
#include "lcmtypes/seal.h"
#include "logger/event_log.h"

namespace forereach {
namespace {

struct Recorded {
  decision_t decision;
  std::string event;
};

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

class Replayer {
 public:
  explicit Replayer(const Config& config) : config_(config) { gate_.emplace(config); }

  // A first pass: which decision each candidate's bytes were given, in order.
  void Collect(const LogEvent& event, const std::string& log) {
    if (event.channel != config_.bus.decision) return;
    if (const auto decision = Decoded<decision_t>(event.data))
      recorded_[GetDigest(decision->plan_digest)].push_back({*decision, NameOf(event, log)});
  }

  void Feed(const LogEvent& event, const std::string& log) {
    if (event.channel == config_.bus.obstacles) {
      static_cast<void>(gate_->UpdateObstacles(event.data, event.utime));
    } else if (event.channel == config_.bus.candidate) {
      FeedCandidate(event, NameOf(event, log));
    } else if (event.channel == config_.bus.certified) {
      CheckSeal(event, NameOf(event, log));
    }
  }

  ReplayResult Finish(std::int64_t corruptions) {
    result_.corruptions = corruptions;
    for (const auto& [digest, decisions] : recorded_)
      for (const Recorded& recorded : decisions)
        Differ(recorded.event, recorded.decision.plan_id, "decided, but its candidate is not in the log");
    return std::move(result_);
  }

 private:
  // `log` names the file where there are several.
  static std::string NameOf(const LogEvent& event, const std::string& log) {
    return log + "event " + std::to_string(event.number);
  }

  void FeedCandidate(const LogEvent& event, const std::string& name) {
    ++result_.candidates;
    auto& waiting = recorded_[DigestOf(event.data)];
    std::optional<Recorded> recorded;
    if (!waiting.empty()) {
      recorded = waiting.front();
      waiting.pop_front();
      if (recorded->decision.sequence < last_sequence_) gate_.emplace(config_);  // the certifier was started again
      last_sequence_ = recorded->decision.sequence;
    }
    const decision_t replayed = gate_->Decide(event.data, event.utime).decision;
    if (!recorded) return Differ(name, replayed.plan_id, "no decision recorded; replayed " + InWords(replayed));
    if (recorded->decision.cause == decision_t::CAUSE_QUEUE_FULL) {
      ++result_.displaced;
      return;
    }
    const std::string difference = Difference(recorded->decision, replayed);
    if (difference.empty())
      ++result_.agreed;
    else
      Differ(name, replayed.plan_id, difference);
  }

  void CheckSeal(const LogEvent& event, const std::string& name) {
    const auto certified = Decoded<certified_plan_t>(event.data);
    if (!certified) return Differ(name, -1, "not a certified_plan_t");
    for (const SealFault& fault : FindSealFaults(*certified))
      Differ(name, certified->plan.plan_id,
             "the seal does not hold: " + fault.field + " is " + fault.found + ", it has to be " + fault.expected);
  }

  void Differ(const std::string& event, std::int64_t plan_id, const std::string& what) {
    result_.differences.push_back(event + ", plan " + std::to_string(plan_id) + ": " + what);
  }

  const Config& config_;
  std::optional<Gate> gate_;
  std::map<Digest, std::deque<Recorded>> recorded_;
  std::int64_t last_sequence_ = -1;
  ReplayResult result_;
};

}  // namespace

ReplayResult Replay(const std::vector<std::string>& logs, const Config& config) {
  Replayer replayer(config);
  const auto name = [&logs](const std::string& log) {
    return logs.size() == 1 ? "" : std::filesystem::path(log).filename().string() + " ";
  };
  ForEachEvent(logs, [&](const LogEvent& event, const std::string& log) { replayer.Collect(event, name(log)); });
  const LogDamage damage =
      ForEachEvent(logs, [&](const LogEvent& event, const std::string& log) { replayer.Feed(event, name(log)); });
  return replayer.Finish(damage.places);
}

}  // namespace forereach
