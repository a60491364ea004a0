#include <iostream>
#include <memory>

#include "cli/commands.h"
#include "task/schema.h"

namespace forereach {

Command KeysCommand() {
  const auto as_schema = std::make_shared<bool>(false);
  return {.name = "keys",
          .purpose = "Print every key of a task file: unit, range, default and meaning",
          .footer =
              "An editor that speaks YAML's language server checks a file that begins with\n"
              "  # yaml-language-server: $schema=task.schema.json\n"
              "after  forereach keys --schema > task.schema.json",
          .options = {{"--schema", as_schema.get(), "", "Print a JSON Schema instead, for editors"}},
          .run = [as_schema] {
            std::cout << (*as_schema ? SchemaJson() + "\n" : SchemaMarkdown());
            return 0;
          }};
}

}  // namespace forereach
