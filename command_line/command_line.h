/** The command line of a program, declared as data: what options there are, what each may be, where its value goes. */
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace forereach {

inline constexpr int kExitBadInput = 2;

/** Where the value of an option goes. What it holds before parsing is the option's default. A bool makes a flag, a
vector an option that may be repeated. The option of an empty optional has no default. */
using Variable = std::variant<bool*, int*, unsigned*, std::int64_t*, std::uint64_t*, double*, std::string*,
                              std::optional<int>*, std::optional<double>*, std::vector<std::string>*>;

/** A closed range. A value outside it, or one that is not a number of the variable's type, is refused. */
struct NumberRange {
  double lower = 0, upper = 0;
};

/** {name, variable, type, help} or {name, variable, type, help, range}, and what the functions below say of it. */
struct Option {
  std::string name{};   ///< "--config"; without dashes the name of a positional argument.
  Variable variable{};  ///< Must outlive ParseCommandLine.
  std::string type{};   ///< The name of its value in help, for example FILE; by default the kind of number, or TEXT.
  std::string help{};
  std::optional<NumberRange> range{};  ///< Of a number.
  bool required = false;
  std::vector<std::string> one_of{};  ///< The words that it may be; empty: any text.
  std::string needs{}, excludes{};    ///< The name of another option of this command.
};

/** @name The same option, with more said of it. */
///@{
[[nodiscard]] inline Option Required(Option option) { return option.required = true, option; }
[[nodiscard]] inline Option OneOf(std::vector<std::string> words, Option option) {
  return option.one_of = std::move(words), option;
}
[[nodiscard]] inline Option Needing(std::string other, Option option) {
  return option.needs = std::move(other), option;
}
[[nodiscard]] inline Option Excluding(std::string other, Option option) {
  return option.excludes = std::move(other), option;
}
///@}

/** A program, or one of the commands of a program. */
struct Command {
  std::string name{};
  std::string purpose{};
  std::string footer{};  ///< The end of its help: notes and examples.
  std::vector<Option> options{};
  std::function<int()> run{};       ///< Runs the chosen command. @return its exit code.
  std::vector<Command> commands{};  ///< If there are any, the user has to choose exactly one.
  std::string* chosen = nullptr;    ///< Receives the name of the chosen command.
};

/** Parses the arguments and sets the options. Every program also has --help and --version, every command --help. The
program's own options are also accepted behind the command.
@return nothing if the program should continue; otherwise its exit code: 0 after it has printed the text of --help or
--version, kExitBadInput after it has printed the error and, for an unknown command or option, the nearest name. */
[[nodiscard]] std::optional<int> ParseCommandLine(const Command& program, int argc, const char* const* argv);

}  // namespace forereach
