#include "cli/new_file.h"

#include <cerrno>
#include <cstring>

#include <fcntl.h>

#include "bus/descriptor.h"
#include "certifier/task/config_error.h"
#include "certifier/task/files.h"

namespace forereach {

void WriteNewFile(const std::string& path, const std::string& text, bool force) {
  const Descriptor file(open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | (force ? O_TRUNC : O_EXCL), 0666));
  if (file.get() < 0 && errno == EEXIST)
    throw ConfigError(path + ": the file exists, and is not changed; choose another name, or write --force");
  if (file.get() < 0 || !WriteAt(file.get(), text, 0)) throw ConfigError(path + ": " + std::strerror(errno));
}

}  // namespace forereach
