/** The tasks under which logs were recorded: the given one, or the copies that the logger kept next to the logs. */
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "records/log_survey.h"
#include "records/log_trust.h"
#include "task/config.h"

namespace forereach {

/** The tasks of a survey's config digests, in the order of their first appearance. The given task is used for its own
digest; the others are read from `directory` (records/kept_tasks.h). Digests without a task are skipped.
@param given the path of a task file, or empty. @param logs the name of the logs in an error.
@throws BadInput if a task cannot be read; if no decision is of the given task; or, without a given task, if no task is
kept. The text has the config digest with which the log was made, and the place of that task. */
[[nodiscard]] std::vector<Config> TasksOf(const LogSurvey& survey, const std::string& logs,
                                          const std::string& directory, const std::string& given);

/** The same for consecutive logs of one run, after SurveyRun. Kept tasks are read from the directory of the first log.
The tasks have the key that `key` selects. @throws ConfigError also as LogKey::Override. */
[[nodiscard]] std::vector<Config> TasksOf(const std::vector<std::string>& logs, const std::string& given,
                                          const LogKey& key);

/** The channels and the key of a recording: those of the given task; else of the task that is kept next to the logs;
else the defaults.
@param directory of the logs. @param given the path of a task file, or empty.
@throws ConfigError if a task cannot be read, or has a key that the command line does not name. */
[[nodiscard]] BusOptions ChannelsOf(const LogSurvey& survey, const std::string& directory, const std::string& given,
                                    const LogKey& key);

/** Finds the tasks of one run after another. */
class RunTasks final {
 public:
  /** @param given the path of a task file, or empty. @param is_many whether there are several runs: then the given task
  is that of some, and the others have their own. @throws ConfigError if it cannot be read. */
  RunTasks(std::string given, LogKey key, bool is_many);

  /** @throws BadInput as TasksOf. */
  [[nodiscard]] std::vector<Config> Of(const std::vector<std::string>& logs) const;

 private:
  const std::string given_;
  const LogKey key_;
  std::optional<Digest> digest_;  // of the given task, if there are several runs
  const bool is_many_;
};

}  // namespace forereach
