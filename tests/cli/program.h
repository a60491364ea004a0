/** The `forereach` program as a person or a script calls it. */
#pragma once

#include <array>
#include <cstdio>
#include <fstream>
#include <sstream>
#include <string>

#include <sys/wait.h>

namespace forereach {

struct Output {
  int code;
  std::string text;
};

/** Runs in the repository's root; `what` may use the shell's redirections. */
inline Output Forereach(const std::string& what) {
  const std::string command = "cd '" FOREREACH_SOURCE_DIR "' && '" FOREREACH_PROGRAM "' " + what;
  std::FILE* pipe = popen(command.c_str(), "r");
  Output output{-1, {}};
  std::array<char, 4096> buffer;
  while (const std::size_t size = std::fread(buffer.data(), 1, buffer.size(), pipe))
    output.text.append(buffer.data(), size);
  output.code = WEXITSTATUS(pclose(pipe));
  return output;
}

/** The whole of a file. */
inline std::string Read(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

}  // namespace forereach
