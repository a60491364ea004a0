#include "records/log_tasks.h"

#include <algorithm>
#include <filesystem>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "records/kept_tasks.h"

namespace forereach {
namespace {

constexpr std::size_t kMaxNamed = 4;

// The digests of the survey, with how many decisions carry each and where its task is kept.
std::string DescribeTask(const LogSurvey& survey, const KeptTasks& kept) {
  std::string text;
  for (std::size_t i = 0; i < std::min(survey.order.size(), kMaxNamed); ++i) {
    const Digest& digest = survey.order[i];
    const bool is_kept = std::filesystem::exists(kept.PathOf(digest));
    text += fmt::format("{}{} ({} decisions and certified plans{})", i > 0 ? "; " : "", ToHex(digest),
                        survey.configs.at(digest).decisions,
                        (is_kept ? ", kept in " + kept.PathOf(digest) : ", not kept next to the log"));
  }
  return text + (survey.order.size() > kMaxNamed ? "; and others" : "");
}

}  // namespace

std::vector<Config> TasksOf(const LogSurvey& survey, const std::string& logs, const std::string& directory,
                            const std::string& given) {
  const KeptTasks kept(directory);
  std::optional<Config> task;
  if (!given.empty()) task = LoadConfig(given);
  if (survey.order.empty()) {  // candidates, and no decision
    if (!task)
      throw ConfigError(logs + ": nothing in it was decided, so nothing names its task: name it with --config FILE");
    return {*task};
  }
  if (task && !survey.configs.contains(task->grounds.config))
    throw ConfigError(given + ": is not the task that " + logs + " was recorded with: its config digest is " +
                      ToHex(task->grounds.config) + ", the log has " + DescribeTask(survey, kept) +
                      "; a task that is kept is found without --config");
  std::vector<Config> tasks;
  for (const Digest& digest : survey.order)
    if (task && task->grounds.config == digest)
      tasks.push_back(*task);
    else if (auto found = kept.Find(digest, survey.configs.at(digest).observations))
      tasks.push_back(std::move(*found));
  if (tasks.empty())
    throw ConfigError(logs + ": its task is not kept next to it; name it with --config FILE: its config digest is " +
                      DescribeTask(survey, kept));
  return tasks;
}

std::vector<Config> TasksOf(const std::vector<std::string>& logs, const std::string& given, const LogKey& key) {
  const std::string directory = std::filesystem::path(logs.front()).parent_path().string();
  std::vector<Config> tasks = TasksOf(SurveyRun(logs), logs.front(), directory, given);
  key.Override(tasks, given);
  return tasks;
}

BusOptions ChannelsOf(const LogSurvey& survey, const std::string& directory, const std::string& given,
                      const LogKey& key) {
  std::vector<Config> task;
  if (!given.empty()) {
    task.push_back(LoadConfig(given, TransitionsFile::kIgnore));
  } else {
    const KeptTasks kept(directory);
    for (auto digest = survey.order.begin(); digest != survey.order.end() && task.empty(); ++digest)
      if (auto found = kept.Find(*digest, survey.configs.at(*digest).observations)) task.push_back(std::move(*found));
  }
  if (task.empty()) task.emplace_back();
  key.Override(task, given);
  return task.front().bus;
}

RunTasks::RunTasks(std::string given, LogKey key, bool is_many)
    : given_(std::move(given)), key_(std::move(key)), is_many_(is_many) {
  if (is_many && !given_.empty()) digest_ = LoadConfig(given_).grounds.config;
}

std::vector<Config> RunTasks::Of(const std::vector<std::string>& logs) const {
  if (!is_many_) return TasksOf(logs, given_, key_);
  const LogSurvey survey = Survey(logs, LogOrder::kAny);
  const std::string directory = std::filesystem::path(logs.front()).parent_path().string();
  const bool is_given = digest_ && (survey.order.empty() || survey.configs.contains(*digest_));
  std::vector<Config> tasks = TasksOf(survey, logs.front(), directory, is_given ? given_ : "");
  key_.Override(tasks, given_);
  return tasks;
}

}  // namespace forereach
