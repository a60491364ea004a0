#include "cli/commands.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "bus/process.h"

namespace forereach {

int RunCommands(std::vector<Command> commands, int argc, char** argv) {
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
