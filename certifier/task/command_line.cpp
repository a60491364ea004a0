#include "certifier/task/command_line.h"

#include <algorithm>
#include <iostream>
#include <vector>

#include <CLI/CLI.hpp>

#include "certifier/task/nearest.h"

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

// An argument may hold any bytes; those that would drive a terminal are not printed.
std::string Shown(std::string text) {
  std::ranges::replace_if(
      text, [](unsigned char c) { return c < 0x20 || c == 0x7f; }, '?');
  return text;
}

// Of the first argument that nobody took: what it is not, and what was probably meant. Empty if all were taken.
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

int Refuse(const CLI::App& app, const std::string& why) {
  std::cerr << app.get_name() << ": " << why << "\nRun with --help for more information." << std::endl;
  return kExitBadInput;
}

}  // namespace

std::optional<int> ParseCommandLine(CLI::App& app, int argc, const char* const* argv) {
  app.set_version_flag("--version", app.get_name() + " " FOREREACH_VERSION, "Print name and version");
  try {
    app.parse(argc, argv);
    if (const std::string empty = EmptyOption(app); !empty.empty()) return Refuse(app, empty);
    return std::nullopt;
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    const std::string unknown = UnknownArgument(app);
    return Refuse(app, unknown.empty() ? Shown(error.what()) : unknown);
  }
}

}  // namespace forereach
