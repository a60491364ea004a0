#include <cerrno>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <unistd.h>

#include "cli/commands.h"
#include "cli/offline.h"

namespace forereach {
namespace {

constexpr const char* kPrograms[] = {FOREREACH_OFFLINE, FOREREACH_LIVE, FOREREACH_FLEET, FOREREACH_DEMO};

// Becomes another program, by its path from this one's directory; returns only if it cannot be started.
int Become(const char* path, char** argv) {
  std::error_code error;
  const std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe", error);
  if (error) {
    std::cerr << "forereach: /proc/self/exe: " << error.message() << std::endl;
    return 1;
  }
  const std::filesystem::path program = self.parent_path() / path;
  execv(program.c_str(), argv);
  const int why = errno;
  const char* const package =
      why == ENOENT && path == std::string_view(FOREREACH_FLEET) ? "; it is in the package forereach-fleet" : "";
  std::cerr << "forereach: " << program.lexically_normal().string() << ": " << std::strerror(why) << package
            << std::endl;
  return 1;
}

// `report --database` and `import --database` are of the fleet, too.
bool NamesStore(int argc, char** argv) {
  for (int i = 1; i < argc; ++i)
    if (std::string_view(argv[i]).starts_with("--database")) return true;
  return false;
}

}  // namespace
}  // namespace forereach

int main(int argc, char** argv) {
  using namespace forereach;
  std::vector<Command> commands;
  for (const OfflineCommand& each : kOfflineCommands) {
    const std::string_view name = each.name;
    const bool is_of_fleet = (name == "report" || name == "import") && NamesStore(argc, argv);
    const char* const program = kPrograms[static_cast<int>(is_of_fleet ? OfflineProgram::kFleet : each.program)];
    if (argc > 1 && name == argv[1]) return Become(program, argv);
    commands.push_back({.name = each.name, .run = [=] { return Become(program, argv); }});
  }
  for (Command& each : std::vector{ObstaclesCommand(), DoctorCommand(), KeysCommand(), StatusCommand(), TailCommand(),
                                   TortureCommand(), ResetCommand(), ReloadCommand(), KeygenCommand()})
    commands.push_back(std::move(each));
  return RunCommands(std::move(commands), argc, argv);
}
