#include <algorithm>
#include <optional>
#include <string>

#include "certifier/task/process.h"
#include "cli/commands.h"

int main(int argc, char** argv) {
  using namespace forereach;
  std::string chosen;
  const Command program{
      .name = "forereach",
      .purpose = "ForeReach certifies planned control sequences before a robot executes them.",
      .footer =
          "Try:\n  forereach certify --config config/bicycle.yaml --plan config/plans/bicycle_certified.csv\n"
          "  forereach doctor\n  forereach certify --help",
      .commands = {CertifyCommand(), PlanCommand(), DeclareCommand(), VerifyCommand(), ReplayCommand(), ReportCommand(),
                   CheckLogCommand(), RunCommand(), ObstaclesCommand(), DoctorCommand(), KeysCommand(), StatusCommand(),
                   ResetCommand(), ReloadCommand(), KeygenCommand()},
      .chosen = &chosen};
  if (const std::optional<int> code = ParseCommandLine(program, argc, argv)) return *code;
  SetUpLog("forereach");
  return Guarded("forereach", std::ranges::find(program.commands, chosen, &Command::name)->run);
}
