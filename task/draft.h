/** The content of a task file while it is being read. */
#pragma once

#include <string>
#include <vector>

#include "task/config.h"

namespace forereach {

/** The values of the names and sizes in the schema. While `states` is empty, every name and size fits. */
struct SchemaScope {
  std::vector<std::string> states, inputs, variables;
  int safety_dim = 0;
};

/** Starts with all defaults. The reader of each key's row (schema.h) sets its members. */
struct TaskDraft {
  Config config;  ///< Without problem and digests.
  Problem problem;
  SchemaScope scope;
  std::string transitions;      ///< Path.
  std::vector<RestBound> rest;  ///< task.rest, whether plans have to end so or not.
  /** The model file that `model.file` names, and its bytes. If `path` is not empty before the file is read, it is read
  instead of the one that is named. */
  struct {
    std::string path, bytes;
  } model_file;
};

}  // namespace forereach
