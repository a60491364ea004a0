#include "logger/follower.h"

#include <cerrno>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <vector>

#include <sys/prctl.h>
#include <unistd.h>

#include "task/config_error.h"

namespace forereach {
namespace {

std::string FleetProgram() {
  std::error_code error;
  const std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe", error);
  const std::string program = (self.parent_path() / FOREREACH_FLEET).lexically_normal().string();
  if (error || access(program.c_str(), X_OK) != 0)
    throw ConfigError("--database: {} is not there: it is in the package forereach-fleet", program);
  return program;
}

// Between fork and exec: only calls that are safe there. The parent may have ended already, or ends before the program
// waits for the signal: so it stays pending until then.
[[noreturn]] void Become(char* const* arguments, pid_t parent) {
  sigset_t end;
  sigemptyset(&end);
  sigaddset(&end, SIGTERM);
  sigprocmask(SIG_BLOCK, &end, nullptr);
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (getppid() != parent) raise(SIGTERM);
  close_range(STDERR_FILENO + 1, ~0U, 0);  // the bus and the log's lock
  dup2(STDERR_FILENO, STDOUT_FILENO);
  execv(arguments[0], arguments);
  _exit(127);
}

}  // namespace

void StartFollower(const std::string& directory, const std::string& database, const std::string& robot) {
  std::vector<std::string> command{FleetProgram(), "ingest", directory, "--follow", "--database", database};
  if (!robot.empty()) command.insert(command.end(), {"--robot", robot});
  std::vector<char*> arguments;
  for (std::string& each : command) arguments.push_back(each.data());
  arguments.push_back(nullptr);
  // A process of its own: a database that does not answer must not hold up the log.
  const pid_t parent = getpid(), child = fork();
  if (child == 0) Become(arguments.data(), parent);
  if (child < 0) throw ConfigError("--database: no process can be started: {}", std::strerror(errno));
}

}  // namespace forereach
