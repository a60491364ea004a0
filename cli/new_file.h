/** Files that a command with --force writes for a person. */
#pragma once

#include <string>

namespace forereach {

/** For a command whose work takes long: fails as WriteNewFile would now, if the file exists. @throws OutputError. */
void RequireNewFile(const std::string& path, bool force);

/** Writes a file that does not exist yet; with `force`, in the place of one that does. Whole, or not at all.
@throws OutputError. */
void WriteNewFile(const std::string& path, const std::string& text, bool force);

}  // namespace forereach
