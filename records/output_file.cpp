#include "records/output_file.h"

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <limits>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <fmt/core.h>
#include <sys/stat.h>
#include <unistd.h>

#include "task/files.h"

namespace forereach {
namespace {

// An open file with a new name that begins with `path`; -1 on failure. Its permissions are those of any new file.
int OpenPart(const std::string& path, std::string& part) {
  part = path + ".part-XXXXXX";
  const int descriptor = ::mkostemp(part.data(), O_CLOEXEC);
  if (descriptor < 0) return descriptor;
  // Once: threads that asked at the same time would leave the process without a mask.
  static const mode_t mask = [] {
    const mode_t given = ::umask(0);
    ::umask(given);
    return given;
  }();
  static_cast<void>(::fchmod(descriptor, 0666 & ~mask));
  return descriptor;
}

bool Exists(const std::string& path) {
  std::error_code error;
  return std::filesystem::exists(std::filesystem::symlink_status(path, error));
}

}  // namespace

OutputFile::OutputFile(std::string path, std::FILE* stream) : path_(std::move(path)), stream_(stream) {}

OutputFile::OutputFile(std::string path, Existing existing) : path_(std::move(path)), existing_(existing) {
  std::error_code error;
  if (existing_ == Existing::kKept && Exists(path_)) FailExists();
  if (Exists(path_) && !std::filesystem::is_regular_file(path_, error))
    throw OutputError(fmt::format("{}: is no file that can be replaced; choose another name", path_));
  const int descriptor = OpenPart(path_, part_);
  if (descriptor < 0) Fail();
  stream_ = ::fdopen(descriptor, "w+b");
  if (stream_) return;
  ::close(descriptor);
  ::unlink(part_.c_str());
  Fail();
}

OutputFile OutputFile::Nameless(const std::string& beside) {
  std::string part;
  const int descriptor = OpenPart(beside, part);
  if (descriptor < 0) throw OutputError(fmt::format("{}: {}", part, std::strerror(errno)));
  ::unlink(part.c_str());
  std::FILE* const stream = ::fdopen(descriptor, "w+b");
  if (!stream) {
    ::close(descriptor);
    throw OutputError(fmt::format("{}: {}", part, std::strerror(errno)));
  }
  return {beside, stream};
}

OutputFile::OutputFile(OutputFile&& other) noexcept
    : path_(std::move(other.path_)),
      part_(std::move(other.part_)),
      existing_(other.existing_),
      stream_(std::exchange(other.stream_, nullptr)),
      size_(other.size_) {}

OutputFile::~OutputFile() {
  if (!stream_) return;
  std::fclose(stream_);
  if (!part_.empty()) ::unlink(part_.c_str());
}

void OutputFile::Write(std::string_view bytes) {
  if (std::fwrite(bytes.data(), 1, bytes.size(), stream_) != bytes.size()) Fail();
  size_ += static_cast<std::int64_t>(bytes.size());
}

void OutputFile::WriteContentOf(const std::string& path, bool without_first_line) {
  InputFile file(path, std::numeric_limits<std::int64_t>::max());
  std::vector<char> block(1 << 20);
  while (const std::size_t bytes = file.Read(block.data(), block.size())) {
    std::string_view text(block.data(), bytes);
    if (without_first_line) {
      const std::size_t end = text.find('\n');
      if (end == std::string_view::npos) continue;
      text.remove_prefix(end + 1);
      without_first_line = false;
    }
    Write(text);
  }
}

void OutputFile::Close() {
  if (std::fflush(stream_) != 0 || ::fsync(::fileno(stream_)) != 0) Fail();
  if (!part_.empty()) Name();
  std::fclose(std::exchange(stream_, nullptr));
}

void OutputFile::Name() const {
  if (existing_ == Existing::kKept) {
    if (::renameat2(AT_FDCWD, part_.c_str(), AT_FDCWD, path_.c_str(), RENAME_NOREPLACE) == 0) return;
    if (errno == EEXIST) FailExists();
    if (errno != EINVAL && errno != ENOSYS) Fail();  // otherwise the file system cannot do both at once
    if (Exists(path_)) FailExists();
  }
  if (::rename(part_.c_str(), path_.c_str()) != 0) Fail();
}

void OutputFile::Fail() const {
  throw OutputError(fmt::format("{}: cannot be written: {}", path_, std::strerror(errno)));
}
void OutputFile::FailExists() const {
  throw OutputError(fmt::format("{}: the file exists, and is not changed; choose another name", path_));
}

void GiveName(const std::string& file, const std::string& path) {
  if (::link(file.c_str(), path.c_str()) == 0) return;
  OutputFile copy(path);  // another file system, one without links, or a file that is there
  copy.WriteContentOf(file);
  copy.Close();
}

void RequireNewFile(const std::string& path, bool force) {
  if (!force && Exists(path))
    throw OutputError(
        fmt::format("{}: the file exists, and is not changed; choose another name, or write --force", path));
}

void WriteNewFile(const std::string& path, const std::string& text, bool force) {
  RequireNewFile(path, force);
  OutputFile file(path, force ? OutputFile::Existing::kReplaced : OutputFile::Existing::kKept);
  file.Write(text);
  file.Close();
}

}  // namespace forereach
