/** The tasks under which logs were recorded: the given one, or the copies that the logger kept next to the logs. */
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "records/kept_tasks.h"
#include "records/log_trust.h"
#include "task/config.h"

namespace forereach {

/** The tasks of one run, each found when a message names it. What names no known task is passed over.
Cost: the logs are read up to the first message that names one; to their end only if there is none, if that is not the
given one, or if several versions of a task's transitions are kept. */
class LogTasks final {
 public:
  static constexpr std::size_t kMaxConfigs = 256;  ///< Limits the memory that invented digests can use.

  /** @param logs consecutive files of one run. Kept tasks are read from the directory of the first
  (records/kept_tasks.h). @param given may be null. @param must_be_given whether a decision has to be of that task, if
  there are decisions. @throws BadInput if a log is none, or a task cannot be read or has a key that the command line
  does not name; with must_be_given, if no decision is of the given task. The texts have the config digests of the logs,
  and the places of their tasks. */
  LogTasks(std::vector<std::string> logs, std::shared_ptr<const Config> given, LogKey key, bool must_be_given);

  /** The first task that a decision or certified plan names. If there is neither, the given task.
  @throws ConfigError if that is no task. */
  [[nodiscard]] const Config& first() const;
  /** Null if there is none. @pre config is not the digest of a task that cannot be read. @throws as the constructor. */
  [[nodiscard]] const Config* Find(const Digest& config);
  /** Those that were found, in this order. */
  [[nodiscard]] const std::vector<std::shared_ptr<const Config>>& found() const { return found_; }

  /** Whether a decision or a certified plan is in the logs. */
  [[nodiscard]] bool has_decisions() const { return !order_.empty(); }
  /** Whether there is a candidate, a decision or a certified plan. */
  [[nodiscard]] bool has_plans() const { return has_decisions() || candidates_ > 0; }
  /** @throws LogError unless has_plans(). */
  void RequirePlans() const;

 private:
  void Look(bool must_be_given);
  [[nodiscard]] std::set<Digest> ObservationsOf(const Digest& config) const;
  [[nodiscard]] std::string Describe() const;

  const std::vector<std::string> logs_;
  const std::shared_ptr<const Config> given_;
  const LogKey key_;
  const KeptTasks kept_;
  std::vector<std::shared_ptr<const Config>> found_;
  std::set<Digest> unknown_;
  // What was seen up to the first task: events, candidates, and config digests with their decisions and certified
  // plans.
  std::int64_t events_ = 0, candidates_ = 0;
  std::map<Digest, std::int64_t> decisions_;
  std::vector<Digest> order_;  // of first appearance
};

/** Finds the tasks of one run after another. */
class RunTasks final {
 public:
  /** @param given the path of a task file, or empty. @param is_many whether there are several runs: then the given task
  is that of some, and the others have their own. @throws ConfigError if it cannot be read. */
  RunTasks(const std::string& given, LogKey key, bool is_many);

  /** @throws BadInput as LogTasks. */
  [[nodiscard]] LogTasks Of(const std::vector<std::string>& logs) const { return {logs, given_, key_, !is_many_}; }
  [[nodiscard]] bool is_many() const { return is_many_; }

 private:
  std::shared_ptr<const Config> given_;
  const LogKey key_;
  const bool is_many_;
};

/** The channels and the key of a recording: those of the given task; else of the task that is kept next to the logs;
else the defaults.
@param given the path of a task file, or empty.
@throws ConfigError if a task cannot be read, or has a key that the command line does not name. */
[[nodiscard]] BusOptions ChannelsOf(const std::vector<std::string>& logs, const std::string& given, const LogKey& key);

}  // namespace forereach
