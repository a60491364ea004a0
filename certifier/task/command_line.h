/** What every program does with its command line. */
#pragma once

#include <optional>
#include <string>

namespace CLI {
class App;
}

namespace forereach {

inline constexpr int kExitBadInput = 2;

/** Adds --version and parses.
@return nothing if the program is to go on; otherwise its exit code, after the text it owes: 0 after --help and
--version, kExitBadInput after a line that says what is wrong and, for an unknown command or option, what was probably
meant. */
[[nodiscard]] std::optional<int> ParseCommandLine(CLI::App& app, int argc, const char* const* argv);

}  // namespace forereach
