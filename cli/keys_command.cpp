#include <iostream>

#include <CLI/CLI.hpp>

#include "certifier/task/schema.h"
#include "cli/commands.h"

namespace forereach {

void AddKeysCommand(CLI::App& app, Action& action) {
  CLI::App* command = app.add_subcommand("keys", "Print every key of a task file: unit, range, default and meaning");
  command->callback([&action] {
    action = [] {
      std::cout << SchemaMarkdown();
      return 0;
    };
  });
}

}  // namespace forereach
