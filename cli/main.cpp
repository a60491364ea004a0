#include <optional>

#include <CLI/CLI.hpp>

#include "certifier/task/process.h"
#include "cli/commands.h"

int main(int argc, char** argv) {
  using namespace forereach;
  CLI::App app("ForeReach certifies planned control sequences before a robot executes them.", "forereach");
  app.footer(
      "Try:\n  forereach certify --config config/bicycle.yaml --plan config/plans/bicycle_certified.csv\n"
      "  forereach doctor\n  forereach certify --help");
  app.require_subcommand(1);
  Action action;
  AddCertifyCommand(app, action);
  AddPlanCommand(app, action);
  AddDeclareCommand(app, action);
  AddVerifyCommand(app, action);
  AddReplayCommand(app, action);
  AddReportCommand(app, action);
  AddCheckLogCommand(app, action);
  AddRunCommand(app, action);
  AddObstaclesCommand(app, action);
  AddDoctorCommand(app, action);
  AddKeysCommand(app, action);
  AddBusCommands(app, action);
  if (const std::optional<int> code = ParseCommandLine(app, argc, argv)) return *code;
  SetUpLog("forereach");
  return Guarded("forereach", action);
}
