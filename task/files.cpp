#include "task/files.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <limits>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "task/config_error.h"

namespace forereach {
namespace {

std::string Reason() { return fmt::format("cannot be read: {}", std::generic_category().message(errno)); }

std::string KindOf(mode_t mode) {
  if (S_ISDIR(mode)) return "is a directory, not a file";
  if (S_ISFIFO(mode)) return "is a pipe, not a regular file";
  if (S_ISCHR(mode) || S_ISBLK(mode)) return "is a device, not a regular file";
  return "is not a regular file";
}

std::string SizeText(std::int64_t bytes) {
  return bytes % kMegabyte == 0 ? fmt::format("{} MiB", bytes / kMegabyte) : fmt::format("{} bytes", bytes);
}

}  // namespace

InputFile::InputFile(const std::string& path, std::int64_t most_bytes, std::string named_by)
    : path_(path),
      named_by_(std::move(named_by)),
      most_bytes_(most_bytes),
      // A pipe without a writer would make a blocking open wait.
      descriptor_(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY)) {
  struct stat status {};
  if (descriptor_.get() < 0 && errno == ENXIO) Fail(KindOf(0));  // a socket
  if (descriptor_.get() < 0 || ::fstat(descriptor_.get(), &status) != 0) Fail(Reason());
  if (!S_ISREG(status.st_mode)) Fail(KindOf(status.st_mode));
  RequireAtMost(status.st_size);
}

std::size_t InputFile::Read(char* to, std::size_t most) {
  ssize_t count;
  do count = ::read(descriptor_.get(), to, most);
  while (count < 0 && errno == EINTR);
  if (count < 0) Fail(fmt::format("reading failed after {} bytes: {}", read_, std::generic_category().message(errno)));
  // Again: a file may grow while it is read.
  RequireAtMost(read_ += count);
  return static_cast<std::size_t>(count);
}

void InputFile::Fail(const std::string& what) const { throw ConfigError("{}{}: {}", named_by_, path_, what); }

void InputFile::RequireAtMost(std::int64_t bytes) const {
  if (bytes > most_bytes_)
    Fail(fmt::format("is larger than {}, the most that is read of such a file", SizeText(most_bytes_)));
}

std::string ReadWhole(const std::string& path, std::int64_t most_bytes, const std::string& named_by) {
  InputFile file(path, most_bytes, named_by);
  std::string text;
  std::array<char, 1 << 16> chunk;
  while (const std::size_t count = file.Read(chunk.data(), chunk.size())) text.append(chunk.data(), count);
  return text;
}

std::string ReadBeginning(const std::string& path, std::size_t bytes) {
  InputFile file(path, std::numeric_limits<std::int64_t>::max());
  std::string text(bytes, '\0');
  std::size_t size = 0;
  while (const std::size_t count = file.Read(text.data() + size, bytes - size)) size += count;
  text.resize(size);
  return text;
}

bool WriteAt(int descriptor, std::string_view bytes, std::int64_t offset) {
  while (!bytes.empty()) {
    const ssize_t count = ::pwrite(descriptor, bytes.data(), bytes.size(), offset);
    if (count < 0 && errno == EINTR) continue;
    if (count == 0) errno = EIO;
    if (count <= 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(count));
    offset += count;
  }
  return true;
}

bool ConfirmDirectory(const std::string& path) {
  const Descriptor directory(::open(path.empty() ? "." : path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (directory.get() < 0) return false;
  return ::fsync(directory.get()) == 0 || errno == EINVAL;  // EINVAL: this file system knows no such thing
}

}  // namespace forereach
