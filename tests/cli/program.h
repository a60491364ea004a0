/** The `forereach` program as a person or a script calls it. */
#pragma once

#include "tests/library_texts.h"
#include "tests/paths.h"
#include "tests/shell.h"

namespace forereach {

/** Runs in the repository's root; `what` may use the shell's redirections. Nothing that it prints is a library's text.
 */
inline Output Forereach(const std::string& what) {
  Output output = Shell("cd '" FOREREACH_SOURCE_DIR "' && '" FOREREACH_PROGRAM "' " + what);
  ExpectNoTextOfALibrary(output.text);
  return output;
}

}  // namespace forereach
