/** What the programs that measure processes share: a node in a process of its own, and one JSON document at the end. */
#pragma once

#include <cerrno>
#include <csignal>
#include <exception>
#include <functional>
#include <iostream>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <nlohmann/json.hpp>

#include "bus/node.h"
#include "command_line/command_line.h"

namespace forereach::bench {

/** A bus on a port of this process's own, one of eight. */
[[nodiscard]] inline std::string PortUrl(int which) {
  return "udpm://239.255.76.67:" + std::to_string(10'000 + (getpid() * 8 + which) % 20'000) + "?ttl=0";
}

/** A child process that runs a node until this object goes. It writes nothing on standard output, which is the
measurement's; with `is_silent` nothing at all. */
class Child {
 public:
  Child(const std::string& url, bool is_silent, const std::function<std::unique_ptr<Node>(Bus&)>& make)
      : process_(fork()) {
    if (process_ < 0) throw std::runtime_error("fork failed");
    if (process_ > 0) return;
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    for (const int output : {STDOUT_FILENO, STDERR_FILENO})
      if (output == STDOUT_FILENO || is_silent) dup2(open("/dev/null", O_WRONLY), output);
    try {
      const std::unique_ptr<Bus> bus = OpenBus(url);
      const std::unique_ptr<Node> node = make(*bus);
      RunNode(*node, *bus);
    } catch (const std::exception& error) {
      std::cerr << program_invocation_short_name << ": " << error.what() << "\n";
    }
    _exit(0);
  }
  ~Child() {
    kill(process_, SIGTERM);
    waitpid(process_, nullptr, 0);
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

 private:
  pid_t process_;
};

/** A program: prints what `measure` gives, or says on standard error why there is none. @return its exit code. */
inline int Print(const Command& program, int argc, char** argv, const std::function<nlohmann::json()>& measure) {
  if (const std::optional<int> code = ParseCommandLine(program, argc, argv)) return *code;
  try {
    std::cout << measure().dump(2) << std::endl;
    return 0;
  } catch (const std::exception& error) {
    std::cerr << program.name << ": " << error.what() << "\n";
    return 1;
  }
}

}  // namespace forereach::bench
