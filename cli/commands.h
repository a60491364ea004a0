/** The subcommands of `forereach`. Each adds its options to the command line and, if it is the one called, leaves in
`action` what to do; the action's result is the exit code: 0 as hoped, 1 not, 2 bad input. */
#pragma once

#include <functional>

namespace CLI {
class App;
}

namespace forereach {

/** What commands say of their LOG arguments. */
inline constexpr const char* kLogs = "LCM event log; several if the run was recorded in several, in their order";
/** What they say of --config. */
inline constexpr const char* kTaskOfLogs =
    "The task file it was recorded with; by default the one that the logger kept beside the log, in tasks/";

using Action = std::function<int()>;

void AddCertifyCommand(CLI::App& app, Action& action);
void AddPlanCommand(CLI::App& app, Action& action);
void AddDeclareCommand(CLI::App& app, Action& action);
void AddVerifyCommand(CLI::App& app, Action& action);
void AddReplayCommand(CLI::App& app, Action& action);
void AddReportCommand(CLI::App& app, Action& action);
void AddCheckLogCommand(CLI::App& app, Action& action);
void AddRunCommand(CLI::App& app, Action& action);
void AddObstaclesCommand(CLI::App& app, Action& action);
void AddDoctorCommand(CLI::App& app, Action& action);
void AddKeysCommand(CLI::App& app, Action& action);
/** status, reset, reload and keygen. */
void AddBusCommands(CLI::App& app, Action& action);

}  // namespace forereach
