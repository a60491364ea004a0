/** forereach-fleet: started by `forereach` with the same arguments. */
#include "cli/commands.h"

int main(int argc, char** argv) {
  return forereach::RunCommands(
      {forereach::IngestCommand(), forereach::FleetReportCommand(), forereach::FleetImportCommand()}, argc, argv);
}
