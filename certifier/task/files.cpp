#include "certifier/task/files.h"

#include <cerrno>
#include <filesystem>
#include <system_error>

#include "certifier/task/config.h"

namespace forereach {

std::ifstream OpenForReading(const std::string& path, const std::string& named_by) {
  // A directory opens, and then reads as an empty file.
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) throw ConfigError(named_by + path + ": is a directory, not a file");
  errno = 0;
  std::ifstream in(path, std::ios::binary);
  if (!in) throw ConfigError(named_by + path + ": cannot be read: " + std::generic_category().message(errno));
  return in;
}

}  // namespace forereach
