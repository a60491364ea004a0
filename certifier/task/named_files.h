/** The files that a task file names: data that belongs to the task, but not to the file's own bytes. */
#pragma once

#include <string>

#include "certifier/task/config.h"

namespace forereach {

/** Paths. Empty: the task names none. A key file is none of these: it is a secret, and no data. */
struct NamedFiles {
  std::string transitions, policy;
};

/** What a task file names, relative to its own place. @throws ConfigError if it is no task file. */
[[nodiscard]] NamedFiles FilesNamedBy(const std::string& path);

/** As the other LoadConfig, but reads the files of `instead` where the task file names one; those that are empty it
takes from where the task file says. @throws ConfigError likewise. */
[[nodiscard]] Config LoadConfig(const std::string& path, const NamedFiles& instead);

}  // namespace forereach
