/** A command as a shell runs it. */
#pragma once

#include <array>
#include <cstdio>
#include <string>

#include <sys/wait.h>

namespace forereach {

struct Output {
  int code;          ///< -1 if a signal ended it, or if it could not be run.
  std::string text;  ///< Of standard output.
};

inline Output Shell(const std::string& command) {
  Output output{-1, {}};
  std::FILE* pipe = popen(command.c_str(), "r");
  if (!pipe) return output;
  std::array<char, 4096> buffer;
  while (const std::size_t size = std::fread(buffer.data(), 1, buffer.size(), pipe))
    output.text.append(buffer.data(), size);
  const int status = pclose(pipe);
  if (WIFEXITED(status)) output.code = WEXITSTATUS(status);
  return output;
}

}  // namespace forereach
