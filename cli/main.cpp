#include <cerrno>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <span>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <unistd.h>

#include "cli/commands.h"
#include "cli/log_commands.h"
#include "cli/offline.h"

namespace forereach {
namespace {

// Becomes forereach-offline; returns only if that cannot be started.
int RunOffline(char** argv) {
  std::error_code error;
  const std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe", error);
  if (error) {
    std::cerr << "forereach: /proc/self/exe: " << error.message() << std::endl;
    return 1;
  }
  const std::filesystem::path program = self.parent_path() / FOREREACH_OFFLINE;
  execv(program.c_str(), argv);
  std::cerr << "forereach: " << program.lexically_normal().string() << ": " << std::strerror(errno) << std::endl;
  return 1;
}

}  // namespace
}  // namespace forereach

int main(int argc, char** argv) {
  using namespace forereach;
  std::vector<Command> commands{CertifyCommand()};
  using Offline = std::span<const OfflineCommand>;
  for (const Offline offline : {Offline(kOfflineCommands), Offline(kLogCommands)})
    for (const OfflineCommand& each : offline) {
      if (argc > 1 && std::string(argv[1]) == each.name) return RunOffline(argv);
      commands.push_back({.name = each.name, .purpose = each.purpose, .run = [argv] { return RunOffline(argv); }});
    }
  for (Command& each : std::vector{ObstaclesCommand(), DoctorCommand(), KeysCommand(), StatusCommand(), TailCommand(),
                                   ResetCommand(), ReloadCommand(), KeygenCommand()})
    commands.push_back(std::move(each));
  return RunCommands(std::move(commands), argc, argv);
}
