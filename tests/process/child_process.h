/** A process that a test starts, watches and stops. It touches no process but its own child. */
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include <sys/types.h>

#include "tests/scratch.h"

namespace forereach {

/** How long a test waits for something that has to happen before it fails. Generous: it only costs where it fails. */
inline constexpr std::chrono::seconds kPatience{30};
/** How soon a process has to end after SIGTERM. */
inline constexpr std::chrono::seconds kEndsWithin{5};

class ChildProcess final {
 public:
  /** Starts command[0] with the rest as arguments. @throws std::system_error */
  explicit ChildProcess(const std::vector<std::string>& command);
  /** Kills the child if it still runs. */
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  /** True once `text` is on its standard error; false if it ends first or kPatience passes. */
  [[nodiscard]] bool WaitForLog(const std::string& text);

  /** Its exit code once it has ended; nothing if it has not within `patience`, or was ended by a signal. */
  [[nodiscard]] std::optional<int> WaitForExit(std::chrono::milliseconds patience = kPatience);

  /** True if it has ended, however, within `patience`. */
  [[nodiscard]] bool WaitForEnd(std::chrono::milliseconds patience);

  /** Sends it a signal, if it still runs. */
  void Signal(int signal);

  /** Sends SIGTERM, then as WaitForExit within kEndsWithin. */
  [[nodiscard]] std::optional<int> Terminate();

  [[nodiscard]] pid_t pid() const { return pid_; }
  [[nodiscard]] std::string output() const;
  [[nodiscard]] std::string error() const;

 private:
  bool Reap();

  const ScratchDirectory scratch_;
  const std::string output_path_, error_path_;
  pid_t pid_ = -1;
  bool ended_ = false;
  int status_ = 0;
};

/** An argument of env for a program that gets a preloaded library: a build with sanitizers wants to be the first
library. */
[[nodiscard]] std::string SanitizerAfterPreload();

}  // namespace forereach
