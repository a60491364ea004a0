#include "cli/new_file.h"

#include <cerrno>
#include <cstring>
#include <filesystem>

#include <fcntl.h>
#include <unistd.h>

#include "bus/descriptor.h"
#include "task/config_error.h"
#include "task/files.h"

namespace forereach {
namespace {

[[noreturn]] void FailExists(const std::string& path) {
  throw ConfigError(path + ": the file exists, and is not changed; choose another name, or write --force");
}

[[noreturn]] void Fail(const std::string& path) {
  if (errno == EEXIST) FailExists(path);
  throw ConfigError(path + ": " + std::strerror(errno));
}

// False where the file system has no files without a name.
bool WriteWhole(const std::string& path, const std::string& text) {
  const std::string directory = std::filesystem::path(path).parent_path().string();
  const Descriptor file(open(directory.empty() ? "." : directory.c_str(), O_WRONLY | O_TMPFILE | O_CLOEXEC, 0666));
  if (file.get() < 0) return false;
  const std::string name = "/proc/self/fd/" + std::to_string(file.get());
  if (!WriteAt(file.get(), text, 0)) Fail(path);
  if (linkat(AT_FDCWD, name.c_str(), AT_FDCWD, path.c_str(), AT_SYMLINK_FOLLOW) == 0) return true;
  if (errno != ENOENT && errno != EOPNOTSUPP) Fail(path);  // without /proc it has no name to be linked by
  return false;
}

}  // namespace

void RequireNewFile(const std::string& path, bool force) {
  if (!force && std::filesystem::exists(std::filesystem::symlink_status(path))) FailExists(path);
}

void WriteNewFile(const std::string& path, const std::string& text, bool force) {
  if (!force && WriteWhole(path, text)) return;
  const Descriptor file(open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | (force ? O_TRUNC : O_EXCL), 0666));
  if (file.get() < 0) Fail(path);
  if (WriteAt(file.get(), text, 0)) return;
  const int error = errno;
  if (!force) unlink(path.c_str());
  errno = error;
  Fail(path);
}

}  // namespace forereach
