/** The `forereach` program as a person or a script calls it. */
#pragma once

#include "tests/paths.h"
#include "tests/scratch.h"
#include "tests/shell.h"

namespace forereach {

/** Runs in the repository's root; `what` may use the shell's redirections. */
inline Output Forereach(const std::string& what) {
  return Shell("cd '" FOREREACH_SOURCE_DIR "' && '" FOREREACH_PROGRAM "' " + what);
}

}  // namespace forereach
