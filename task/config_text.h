/** A task that is text in memory. */
#pragma once

#include <string>

#include "task/config.h"

namespace forereach {

/** As LoadConfig, of this text. @param path names the text in messages and is the task's path; the files that the text
names are relative to its directory. It need not exist. @throws ConfigError as LoadConfig does. */
[[nodiscard]] Config ConfigOfText(const std::string& path, const std::string& text);

}  // namespace forereach
