#include "command_line/command_line.h"

#include <algorithm>
#include <cmath>
#include <iostream>
#include <sstream>
#include <type_traits>

#include <CLI/CLI.hpp>

#include "command_line/nearest.h"

namespace forereach {
namespace {

std::vector<std::string> OptionNames(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options())
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  return names;
}

std::vector<std::string> CommandNames(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; }))
    names.push_back(command->get_name());
  return names;
}

// Replaces control characters: an argument may contain any bytes.
std::string Shown(std::string text) {
  std::ranges::replace_if(
      text, [](unsigned char c) { return c < 0x20 || c == 0x7f; }, '?');
  return text;
}

// The error for the first argument that no option took, with the nearest name. Empty if all were taken.
std::string UnknownArgument(const CLI::App& app) {
  const std::vector<std::string> left = app.remaining(true);
  const auto chosen = app.get_subcommands();
  const CLI::App& command = chosen.empty() ? app : *chosen.front();
  const std::string of = chosen.empty() ? "" : " of " + command.get_name();
  const std::vector<std::string> commands = CommandNames(command);
  for (const std::string& argument : left) {
    if (argument.starts_with("-") && argument.size() > 1) {
      const std::string name = argument.substr(0, argument.find('='));
      return "unknown option " + Shown(name) + of + "; " + Suggestion(name, OptionNames(command));
    }
    if (!commands.empty()) return "unknown command " + Shown(argument) + "; " + Suggestion(argument, commands);
  }
  return left.empty() ? "" : "unexpected argument " + Shown(left.front()) + of;
}

// The first option that was given an empty value, which no option of ours takes. Empty if there is none.
std::string EmptyOption(const CLI::App& app) {
  for (const CLI::Option* option : app.get_options())
    if (option->get_expected_max() > 0 && std::ranges::count(option->results(), "") > 0)
      return option->get_name() + ": the value is empty; write a " + option->get_type_name();
  for (const CLI::App* command : app.get_subcommands())
    if (const std::string empty = EmptyOption(*command); !empty.empty()) return empty;
  return "";
}

// "--plan: 1 required FILE.csv missing", "--config: At Most 1 required but received 2".
std::string Describe(const CLI::ParseError& error) {
  const std::string text = Shown(error.what());
  if (!dynamic_cast<const CLI::ArgumentMismatch*>(&error)) return text;
  const std::string option = text.substr(0, text.find(':'));
  return option + (text.ends_with("missing") ? ": its value is missing" : ": is given too often");
}

int Refuse(const CLI::App& app, const std::string& why) {
  std::cerr << app.get_name() << ": " << why << "\nRun with --help for more information." << std::endl;
  return kExitBadInput;
}

template <typename T>
struct ValueOf {
  using type = T;
};
template <typename T>
struct ValueOf<std::optional<T>> {
  using type = T;
};

// Bounds are numbers such as 1, 4294967295 and 1e-12: a whole one is printed with all its digits.
std::string Text(double bound) {
  std::ostringstream text;
  text.precision(std::rint(bound) == bound && std::abs(bound) < 1e15 ? 15 : 6);
  text << bound;
  return text.str();
}

template <typename T>
CLI::Validator Inside(const NumberRange& range) {
  const std::string lower = Text(range.lower), upper = Text(range.upper);
  return {[=](const std::string& text) {
            T value{};
            const bool good = CLI::detail::lexical_cast(text, value) && range.lower <= static_cast<double>(value) &&
                              static_cast<double>(value) <= range.upper;
            return good ? std::string() : "Value " + text + " not in range " + lower + " to " + upper;
          },
          std::string(CLI::detail::type_name<T>()) + " in [" + lower + " - " + upper + "]"};
}

template <typename T>
CLI::Option* AddValue(CLI::App& app, const Option& declared, T& variable) {
  if constexpr (std::is_same_v<T, bool>) {
    return app.add_flag(declared.name, variable, declared.help);
  } else {
    CLI::Option* option = app.add_option(declared.name, variable, declared.help);
    using Value = typename ValueOf<T>::type;
    if constexpr (std::is_arithmetic_v<Value>)
      if (declared.range) option->check(Inside<Value>(*declared.range));
    if constexpr (std::is_arithmetic_v<T> || std::is_same_v<T, std::string>) option->capture_default_str();
    // One value each time it is given: the next argument may be a file.
    if constexpr (std::is_same_v<T, std::vector<std::string>>)
      if (declared.name.starts_with("--")) option->allow_extra_args(false);
    return option;
  }
}

void AddOptions(CLI::App& app, const std::vector<Option>& options) {
  for (const Option& declared : options) {
    CLI::Option* option =
        std::visit([&](auto* variable) { return AddValue(app, declared, *variable); }, declared.variable);
    if (!declared.type.empty()) option->type_name(declared.type);
    if (!declared.one_of.empty()) option->check(CLI::IsMember(declared.one_of));
    option->required(declared.required);
  }
  for (const Option& declared : options) {
    if (!declared.needs.empty()) app.get_option(declared.name)->needs(app.get_option(declared.needs));
    if (!declared.excludes.empty()) app.get_option(declared.name)->excludes(app.get_option(declared.excludes));
  }
}

void Add(CLI::App& app, const Command& command) {
  app.footer(command.footer);
  AddOptions(app, command.options);
  if (!command.options.empty()) app.fallthrough();  // inherited by the commands that are added after it
  for (const Command& each : command.commands) Add(*app.add_subcommand(each.name, each.purpose), each);
  if (command.commands.empty()) return;
  app.require_subcommand(1);
}

}  // namespace

std::optional<int> ParseCommandLine(const Command& program, int argc, const char* const* argv) {
  CLI::App app(program.purpose, program.name);
  Add(app, program);
  app.set_version_flag("--version", program.name + " " FOREREACH_VERSION, "Print name and version");
  try {
    app.parse(argc, argv);
    if (const std::string empty = EmptyOption(app); !empty.empty()) return Refuse(app, empty);
    if (program.chosen) *program.chosen = app.get_subcommands().front()->get_name();
    return std::nullopt;
  } catch (const CLI::ParseError& error) {
    const std::string unknown = UnknownArgument(app);
    if (error.get_exit_code() == 0 && unknown.empty()) return app.exit(error);
    return Refuse(app, unknown.empty() ? Describe(error) : unknown);
  }
}

}  // namespace forereach
