#include "records/log_tasks.h"

#include <algorithm>
#include <filesystem>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "forereach/candidate_plan_t.hpp"
#include "forereach/certified_plan_t.hpp"
#include "forereach/decision_t.hpp"
#include "lcmtypes/candidate_batch.h"
#include "records/log_survey.h"

namespace forereach {
namespace {

constexpr std::size_t kMaxNamed = 4;
constexpr std::size_t kMaxObservations = 1 << 16;

// The task and the observations that a decision or a certified plan names, on whatever channel.
std::optional<std::pair<Digest, Digest>> NamedBy(Bytes message) {
  const auto named = [](const auto& of) {
    return std::pair(GetDigest(of.config_digest), GetDigest(of.observations_digest));
  };
  if (const auto decision = Decoded<decision_t>(message)) return named(*decision);
  if (const auto certified = Decoded<certified_plan_t>(message)) return named(*certified);
  return std::nullopt;
}

}  // namespace

LogTasks::LogTasks(std::vector<std::string> logs, std::shared_ptr<const Config> given, LogKey key, bool must_be_given)
    : logs_(std::move(logs)), given_(std::move(given)), key_(std::move(key)), kept_(KeptTasks::Beside(logs_.front())) {
  RequireLogs(logs_);
  Look(must_be_given && given_);
  if (order_.empty() && given_) found_.push_back(given_);  // candidates, and no decision
}

// Reads the logs up to the message that names the first task.
void LogTasks::Look(bool must_be_given) {
  const auto is_found = [&] {
    return !found_.empty() && (!must_be_given || decisions_.contains(given_->grounds.config));
  };
  LogEvent event;
  for (const std::string& log : logs_) {
    EventLogReader reader(log);
    for (LogStatus status; (status = reader.Next(event)) == LogStatus::kEvent || status == LogStatus::kCorrupt;) {
      if (status == LogStatus::kCorrupt) continue;
      ++events_;
      const auto named = NamedBy(event.message());
      if (!named) {
        candidates_ += Decoded<candidate_plan_t>(event.message()) || Decoded<candidate_batch_t>(event.message());
        continue;
      }
      const auto known = decisions_.find(named->first);
      if (known != decisions_.end()) ++known->second;
      if (known != decisions_.end() || decisions_.size() >= kMaxConfigs) continue;
      decisions_.emplace(named->first, 1);
      order_.push_back(named->first);
      static_cast<void>(Find(named->first));
      if (is_found()) return;
    }
  }
  if (must_be_given && !order_.empty())
    throw ConfigError(
        "{}: is not the task that {} was recorded with: its config digest is {}, the log has {}; a task "
        "that is kept is found without --config",
        given_->path, logs_.front(), ToHex(given_->grounds.config), Describe());
}

const Config& LogTasks::first() const {
  if (!found_.empty()) return *found_.front();
  if (order_.empty())
    throw ConfigError("{}: nothing in it was decided, so nothing names its task: name it with --config FILE",
                      logs_.front());
  throw ConfigError("{}: its task is not kept next to it; name it with --config FILE: its config digest is {}",
                    logs_.front(), Describe());
}

const Config* LogTasks::Find(const Digest& config) {
  const auto known =
      std::ranges::find(found_, config, [](const auto& task) -> const Digest& { return task->grounds.config; });
  if (known != found_.end()) return known->get();
  if (given_ && given_->grounds.config == config) return found_.emplace_back(given_).get();
  if (unknown_.contains(config)) return nullptr;
  auto kept = kept_.Find(config, [&] { return ObservationsOf(config); });
  if (!kept) {
    if (unknown_.size() < kMaxConfigs) unknown_.insert(config);
    return nullptr;
  }
  key_.Override(*kept, "");
  return found_.emplace_back(std::make_shared<const Config>(std::move(*kept))).get();
}

// All that decisions under this task name.
std::set<Digest> LogTasks::ObservationsOf(const Digest& config) const {
  std::set<Digest> observations;
  static_cast<void>(ForEachEvent(logs_, [&](const LogEvent& event, const std::string&) {
    const auto named = NamedBy(event.message());
    if (named && named->first == config && observations.size() < kMaxObservations) observations.insert(named->second);
  }));
  return observations;
}

// The digests of the logs, with how many decisions carry each and where its task is kept.
std::string LogTasks::Describe() const {
  std::string text;
  for (std::size_t i = 0; i < std::min(order_.size(), kMaxNamed); ++i) {
    const std::string place = kept_.PathOf(order_[i]);
    text += fmt::format(
        "{}{} ({} decisions and certified plans{})", i > 0 ? "; " : "", ToHex(order_[i]), decisions_.at(order_[i]),
        std::filesystem::exists(place) ? fmt::format(", kept in {}", place) : ", not kept next to the log");
  }
  return text + (order_.size() > kMaxNamed ? "; and others" : "");
}

void LogTasks::RequirePlans() const {
  if (has_plans()) return;
  throw LogError(
      fmt::format("{}{}{}, and neither a candidate nor a decision; nothing was proposed while it was recorded, or it "
                  "is not of ForeReach",
                  logs_.front(), logs_.size() > 1 ? " and those behind it: " : ": ",
                  events_ == 0 ? "is empty" : fmt::format("holds {} events", events_)));
}

RunTasks::RunTasks(const std::string& given, LogKey key, bool is_many) : key_(std::move(key)), is_many_(is_many) {
  if (given.empty()) return;
  Config task = LoadConfig(given);
  key_.Override(task, given);
  given_ = std::make_shared<const Config>(std::move(task));
}

BusOptions ChannelsOf(const std::vector<std::string>& logs, const std::string& given, const LogKey& key) {
  Config task;
  if (!given.empty()) {
    task = LoadConfig(given, TransitionsFile::kIgnore);
  } else if (KeptTasks::Beside(logs.front()).HasAny()) {
    const LogTasks tasks(logs, nullptr, key, false);
    if (!tasks.found().empty()) return tasks.first().bus;
  }
  key.Override(task, given);
  return task.bus;
}

}  // namespace forereach
