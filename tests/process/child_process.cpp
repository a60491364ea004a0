#include "tests/process/child_process.h"

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <system_error>
#include <thread>

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

namespace forereach {
namespace {

constexpr std::chrono::milliseconds kPoll{5};

// In the child, between fork and exec: only calls that are safe there.
[[noreturn]] void Become(char* const* arguments, const char* output, const char* error) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);  // a test that crashes leaves nothing behind
  dup2(open(output, O_WRONLY | O_TRUNC), STDOUT_FILENO);
  dup2(open(error, O_WRONLY | O_TRUNC), STDERR_FILENO);
  execv(arguments[0], arguments);
  _exit(127);
}

}  // namespace

ChildProcess::ChildProcess(const std::vector<std::string>& command)
    : output_path_(scratch_.Write("output", "")), error_path_(scratch_.Write("error", "")) {
  std::vector<char*> arguments;
  for (const std::string& argument : command) arguments.push_back(const_cast<char*>(argument.c_str()));
  arguments.push_back(nullptr);
  pid_ = fork();
  if (pid_ < 0) throw std::system_error(errno, std::generic_category(), "fork");
  if (pid_ == 0) Become(arguments.data(), output_path_.c_str(), error_path_.c_str());
}

ChildProcess::~ChildProcess() {
  if (!Reap()) {
    kill(pid_, SIGKILL);
    waitpid(pid_, &status_, 0);
  }
}

bool ChildProcess::Reap() {
  if (!ended_ && waitpid(pid_, &status_, WNOHANG) == pid_) ended_ = true;
  return ended_;
}

bool ChildProcess::WaitForLog(const std::string& text) {
  const auto deadline = std::chrono::steady_clock::now() + kPatience;
  while (std::chrono::steady_clock::now() < deadline) {
    const bool ended = Reap();
    if (error().find(text) != std::string::npos) return true;
    if (ended) return false;
    std::this_thread::sleep_for(kPoll);
  }
  return false;
}

bool ChildProcess::WaitForEnd(std::chrono::milliseconds patience) {
  const auto deadline = std::chrono::steady_clock::now() + patience;
  while (!Reap() && std::chrono::steady_clock::now() < deadline) std::this_thread::sleep_for(kPoll);
  return ended_;
}

void ChildProcess::Signal(int signal) {
  if (!Reap()) kill(pid_, signal);
}

std::optional<int> ChildProcess::WaitForExit(std::chrono::milliseconds patience) {
  if (!WaitForEnd(patience) || !WIFEXITED(status_)) return std::nullopt;
  return WEXITSTATUS(status_);
}

std::optional<int> ChildProcess::Terminate() {
  Signal(SIGTERM);
  return WaitForExit(kEndsWithin);
}

std::string ChildProcess::output() const { return Read(output_path_); }

std::string ChildProcess::error() const { return Read(error_path_); }

std::string SanitizerAfterPreload() {
  const char* others = std::getenv("ASAN_OPTIONS");
  return std::string("ASAN_OPTIONS=verify_asan_link_order=0:") + (others ? others : "");
}

}  // namespace forereach
