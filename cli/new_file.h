/** Files that a command writes for a person. */
#pragma once

#include <string>

namespace forereach {

/** For a command whose work takes long: fails as WriteNewFile would now, if the file exists. @throws ConfigError. */
void RequireNewFile(const std::string& path, bool force);

/** Writes a file that does not exist yet; with `force`, over one that does. @throws ConfigError, and then an existing
file is unchanged unless `force`. */
void WriteNewFile(const std::string& path, const std::string& text, bool force);

}  // namespace forereach
