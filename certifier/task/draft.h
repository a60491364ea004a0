/** A task file's content while it is read. */
#pragma once

#include <string>
#include <vector>

#include "certifier/task/config.h"

namespace forereach {

/** What names and sizes in the schema stand for. Where it is not known, everything fits. */
struct SchemaScope {
  std::vector<std::string> states, inputs, variables;
  int safety_dim = 0;
};

/** Begins with all defaults; each key's row (schema.h) adds what the key says. */
struct TaskDraft {
  Config config;  ///< Without problem and digests.
  Problem problem;
  SchemaScope scope;
  std::string transitions;  ///< Path.
};

}  // namespace forereach
