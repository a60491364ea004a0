/** A task that is text in memory. */
#pragma once

#include <string>

#include "task/config.h"

namespace forereach {

/** As LoadConfig, of this text. @param path names the text in messages and is the task's path; the files that the text
names are relative to its directory. It need not exist.
@param data takes the place of the text's transitions if it is given; messages name it as `data`, and its rows as lines
of a file: the first is line 2. @throws ConfigError as LoadConfig does, and if the data have other sizes than the model,
no row, or a number that is not finite. */
[[nodiscard]] Config ConfigOfText(const std::string& path, const std::string& text, const Transitions* data = nullptr);

}  // namespace forereach
