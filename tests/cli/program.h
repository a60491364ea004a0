/** The `forereach` program as a person or a script calls it. */
#pragma once

#include <fstream>
#include <sstream>
#include <string>

#include "tests/paths.h"
#include "tests/shell.h"

namespace forereach {

/** Runs in the repository's root; `what` may use the shell's redirections. */
inline Output Forereach(const std::string& what) {
  return Shell("cd '" FOREREACH_SOURCE_DIR "' && '" FOREREACH_PROGRAM "' " + what);
}

/** The whole of a file. */
inline std::string Read(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

}  // namespace forereach
