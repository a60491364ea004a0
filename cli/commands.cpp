#include "cli/commands.h"

#include <algorithm>
#include <iterator>
#include <optional>
#include <utility>

#include "bus/process.h"
#include "cli/offline.h"

namespace forereach {

int RunCommands(std::vector<Command> commands, int argc, char** argv) {
  for (Command& command : commands)
    if (const auto known = std::ranges::find(kOfflineCommands, command.name, &OfflineCommand::name);
        command.purpose.empty() && known != std::end(kOfflineCommands))
      command.purpose = known->purpose;
  std::string chosen;
  const Command program{
      .name = "forereach",
      .purpose = "ForeReach certifies planned control sequences before a robot executes them.",
      .footer =
          "Try:\n  forereach certify --config config/bicycle.yaml --plan config/plans/bicycle_certified.csv\n"
          "  forereach doctor\n  forereach certify --help",
      .commands = std::move(commands),
      .chosen = &chosen};
  if (const std::optional<int> code = ParseCommandLine(program, argc, argv)) return *code;
  return Guarded("forereach", std::ranges::find(program.commands, chosen, &Command::name)->run);
}

}  // namespace forereach
