/** forereach-offline: started by `forereach` with the same arguments. */
#include "cli/commands.h"

int main(int argc, char** argv) {
  using namespace forereach;
  return RunCommands(
      {CertifyCommand(), InitCommand(), ImportCommand(), ImportWorldCommand(), CheckCommand(), FitCommand(),
       ExportModelCommand(), PlanCommand(), DeclareCommand(), VerifyCommand(), ReplayCommand(), MergeCommand(),
       AdviseCommand(), ReportCommand(), ExportCommand(), LogCommand(), CheckLogCommand(), RunCommand()},
      argc, argv);
}
