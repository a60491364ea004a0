/** Opening files so that what is wrong is said. */
#pragma once

#include <fstream>
#include <string>

namespace forereach {

/** @param named_by goes before the message: the place that names the file. @throws ConfigError with file and cause. */
[[nodiscard]] std::ifstream OpenForReading(const std::string& path, const std::string& named_by = "");

}  // namespace forereach
