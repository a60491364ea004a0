#include <iostream>

#include "cli/commands.h"
#include "task/schema.h"

namespace forereach {

Command KeysCommand() {
  return {.name = "keys", .purpose = "Print every key of a task file: unit, range, default and meaning", .run = [] {
            std::cout << SchemaMarkdown();
            return 0;
          }};
}

}  // namespace forereach
