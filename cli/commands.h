/** The subcommands of `forereach`. Each one's exit code: 0 as hoped, 1 not, 2 bad input. */
#pragma once

#include <string>
#include <vector>

#include "command_line/command_line.h"

namespace forereach {

/** The help text for LOG arguments. */
inline constexpr const char* kLogs = "LCM event log; several if the run was recorded in several, in their order";
/** The same where several runs may be read. */
inline constexpr const char* kRuns =
    "LCM event logs, decision databases, or directories of logs or of a database, with their subdirectories";
/** The help text for --config. */
inline constexpr const char* kTaskOfLogs =
    "The task file of the recording; by default the one that the logger kept next to the log, in tasks/";
/** The same where a decision may be read, too. */
inline constexpr const char* kTaskOfRecords =
    "The task file; by default the one that a decision names, or that the logger kept next to a log, in tasks/";

inline constexpr const char* kDatabaseAddress =
    "The fleet's store, postgresql://[USER@]HOST[:PORT]/DATABASE; a password belongs into ~/.pgpass";

// Options that several commands share.
[[nodiscard]] inline Option ConfigOption(std::string& path, const char* help = "Task file (YAML)") {
  return Required({"--config", &path, "FILE", help});
}
/** The same for a command on one task, which may also stand alone: `forereach check TASK`. */
[[nodiscard]] inline Option TaskOption(std::string& path, const char* help = "Task file (YAML)") {
  return Required({"TASK,--config", &path, "FILE", help});
}
[[nodiscard]] inline Option JsonFlag(bool& json, const char* help = "One JSON document on standard output") {
  return {"--json", &json, "", help};
}
[[nodiscard]] inline Option JobsOption(unsigned& jobs) { return {"--jobs", &jobs, "", "Threads", NumberRange{1, 256}}; }

[[nodiscard]] Command CertifyCommand();
[[nodiscard]] Command InitCommand();
[[nodiscard]] Command CheckCommand();
[[nodiscard]] Command ExportModelCommand();
[[nodiscard]] Command PlanCommand();
[[nodiscard]] Command ImportCommand();
[[nodiscard]] Command ImportWorldCommand();
[[nodiscard]] Command FitCommand();
[[nodiscard]] Command DeclareCommand();
[[nodiscard]] Command VerifyCommand();
[[nodiscard]] Command ReplayCommand();
[[nodiscard]] Command MergeCommand();
[[nodiscard]] Command AdviseCommand();
[[nodiscard]] Command ReportCommand();
[[nodiscard]] Command CheckLogCommand();
[[nodiscard]] Command ExportCommand();
[[nodiscard]] Command FleetImportCommand();
[[nodiscard]] Command FleetReportCommand();
[[nodiscard]] Command IngestCommand();
[[nodiscard]] Command LogCommand();
[[nodiscard]] Command RunCommand();
[[nodiscard]] Command ObstaclesCommand();
[[nodiscard]] Command DoctorCommand();
[[nodiscard]] Command KeysCommand();
[[nodiscard]] Command StatusCommand();
[[nodiscard]] Command ResetCommand();
[[nodiscard]] Command ReloadCommand();
[[nodiscard]] Command KeygenCommand();
[[nodiscard]] Command LiveCommand();
[[nodiscard]] Command TailCommand();
[[nodiscard]] Command TortureCommand();

/** Runs the one of the commands that the command line chooses. Those of cli/offline.h have their purpose there. @return
 * the program's exit code. */
[[nodiscard]] int RunCommands(std::vector<Command> commands, int argc, char** argv);

}  // namespace forereach
