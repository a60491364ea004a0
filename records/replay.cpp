#include "records/replay.h"

#include <algorithm>
#include <deque>
#include <filesystem>
#include <map>
#include <memory>
#include <utility>

#include "certifier/gate/gate.h"
#include "certifier/task/key.h"
#include "forereach/certified_plan_t.hpp"
#include "forereach/decision_t.hpp"
#include "lcmtypes/names.h"
#include "lcmtypes/seal.h"
#include "records/event_log.h"
#include "records/log_authenticator.h"
#include "records/restarts.h"

namespace forereach {
namespace {

std::string DescribeDecision(const decision_t& decision) {
  std::string text(OutcomeName(decision.outcome));
  text += ", cause " + std::string(CauseName(decision.cause));
  return text + ", step " + std::to_string(decision.step);
}

// Empty if they agree.
std::string Difference(const decision_t& recorded, const decision_t& replayed) {
  if (recorded.outcome != replayed.outcome || recorded.cause != replayed.cause || recorded.step != replayed.step)
    return "recorded " + DescribeDecision(recorded) + "; replayed " + DescribeDecision(replayed);
  const auto differs = [](const auto& a, const auto& b) { return GetDigest(a) != GetDigest(b); };
  if (differs(recorded.config_digest, replayed.config_digest)) return "another config";
  if (differs(recorded.model_digest, replayed.model_digest)) return "another model";
  if (differs(recorded.declaration_digest, replayed.declaration_digest)) return "another declaration";
  if (differs(recorded.observations_digest, replayed.observations_digest)) return "other observations";
  if (differs(recorded.obstacles_digest, replayed.obstacles_digest)) return "other obstacles";
  return {};
}

// What no replay can give again.
bool IsCircumstance(const decision_t& decision) {
  switch (decision.cause) {
    case decision_t::CAUSE_PAIRWISE:  // by what the certifier was told by its latch file: no pair of its own
      return decision.step < 0 && decision.first_observation < 0;
    case decision_t::CAUSE_QUEUE_FULL:
    case decision_t::CAUSE_OVERRUN:
    case decision_t::CAUSE_NOT_ARMED:
    case decision_t::CAUSE_FAULT:
    case decision_t::CAUSE_LATCH_UNWRITABLE:
    case decision_t::CAUSE_NO_OBSTACLES: return true;
    default: return false;
  }
}

class Replayer {
 public:
  explicit Replayer(const std::vector<Config>& tasks)
      : tasks_(tasks),
        config_(tasks.front()),
        now_(&config_),
        authenticator_(config_.bus, PublicKeysOf(config_.bus)),
        logged_obstacles_(config_) {
    Restart();
  }

  // `log` names the file where there are several.
  void Feed(const LogEvent& event, const std::string& log) {
    if (!authenticator_.IsAuthentic(event)) return;
    const std::string name = log + "event " + std::to_string(event.number);
    if (event.channel == config_.bus.obstacles || event.channel == config_.bus.transition) {
      if (event.channel == config_.bus.transition || ChangesObstacles(event))
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

  // The task of a config digest; where there is one task it stands for all.
  [[nodiscard]] const Config* TaskOf(const Digest& digest) const {
    if (tasks_.size() == 1) return &config_;
    const auto found = std::ranges::find(tasks_, digest, &Config::digest);
    return found == tasks_.end() ? nullptr : &*found;
  }

  void SetTask(const Digest& digest) {
    if (const Config* task = TaskOf(digest)) now_ = task;
  }

  // The whole set is sent again and again: only what is another set than before has to be kept.
  bool ChangesObstacles(const LogEvent& event) {
    const Digest before = logged_obstacles_.digest();
    return logged_obstacles_.Update(event.message(), event.utime).empty() && logged_obstacles_.digest() != before;
  }

  void Restart() {
    gate_ = std::make_unique<Gate>(*now_);
    logged_obstacles_ = ObstaclesInForce(*now_);
    changes_.clear();
    last_sequence_ = -1;
  }

  void Reload() {
    while (!changes_.empty()) TakeChange();
    const std::unique_ptr<Gate> before = std::exchange(gate_, std::make_unique<Gate>(*now_));
    gate_->Inherit(*before);
    ObstaclesInForce after(*now_);
    after.Inherit(logged_obstacles_);
    logged_obstacles_ = std::move(after);
  }

  void FeedStatus(const LogEvent& event) {
    const Restarts::Kind kind = restarts_.Notice(event.message());
    if (kind == Restarts::Kind::kNone) return;
    const bool is_known = std::exchange(reloaded_ahead_, false) && now_->digest == restarts_.config();
    SetTask(restarts_.config());
    if (kind == Restarts::Kind::kBegin) Restart();
    if (kind == Restarts::Kind::kReload && !is_known) Reload();
  }

  // A decision may be the first word of a reload.
  void FollowReload(const Config& task) {
    if (&task == now_) return;
    now_ = &task;
    Reload();
    reloaded_ahead_ = true;
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
    const Config* task = TaskOf(GetDigest(recorded->config_digest));
    if (!task)
      return Differ(candidate.name, recorded->plan_id,
                    "decided under another task, of config digest " + ToHex(GetDigest(recorded->config_digest)) +
                        ", which is not kept next to the log");
    FollowReload(*task);
    CatchUp(*recorded);
    if (IsCircumstance(*recorded)) {
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
    const Digest obstacles = GetDigest(recorded.obstacles_digest),
                 observations = GetDigest(recorded.observations_digest);
    while (!changes_.empty() &&
           (gate_->obstacles_digest() != obstacles || gate_->observations_digest() != observations))
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

  const std::vector<Config>& tasks_;
  const Config& config_;         // of channels and key
  const Config* now_;            // in force
  bool reloaded_ahead_ = false;  // of the heartbeat that will tell of it
  LogAuthenticator authenticator_;
  std::unique_ptr<Gate> gate_;
  ObstaclesInForce logged_obstacles_;                   // by all that was logged so far
  std::map<Digest, std::deque<Candidate>> candidates_;  // not decided yet
  std::deque<Change> changes_;                          // logged, and perhaps not yet seen by the certifier
  Restarts restarts_;
  std::int64_t last_sequence_ = -1;
  ReplayResult result_;
};

}  // namespace

ReplayResult Replay(const std::vector<std::string>& logs, const Config& config) {
  return Replay(logs, std::vector<Config>{config});
}

ReplayResult Replay(const std::vector<std::string>& logs, const std::vector<Config>& tasks) {
  Replayer replayer(tasks);
  const auto name = [&logs](const std::string& log) {
    return logs.size() == 1 ? "" : std::filesystem::path(log).filename().string() + " ";
  };
  const LogDamage damage =
      ForEachEvent(logs, [&](const LogEvent& event, const std::string& log) { replayer.Feed(event, name(log)); });
  return replayer.Finish(damage.places);
}

}  // namespace forereach
