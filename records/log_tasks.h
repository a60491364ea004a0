/** The tasks under which logs were recorded: the given one, or the copies that the logger kept next to the logs. */
#pragma once

#include <string>
#include <vector>

#include "certifier/task/config.h"
#include "records/log_survey.h"
#include "records/log_trust.h"

namespace forereach {

/** The tasks of the config digests that a survey found, in the order in which they came; those of which there is none
are left out. A task that is given stands for its own digest, the others are looked for in `directory`
(records/kept_tasks.h).
@param given path of a task file, or empty.
@param logs what is said of the logs in an error.
@throws BadInput if a task cannot be read; if no decision is of the given task, or without one no task is kept. The text
says which config digest the log was made with, and where that task is. */
[[nodiscard]] std::vector<Config> TasksOf(const LogSurvey& survey, const std::string& logs,
                                          const std::string& directory, const std::string& given);

/** The same of logs that follow one another, after SurveyRun; kept tasks are looked for beside the first. With the key
that counts. @throws ConfigError also as LogKey::Override. */
[[nodiscard]] std::vector<Config> TasksOf(const std::vector<std::string>& logs, const std::string& given,
                                          const LogKey& key);

}  // namespace forereach
