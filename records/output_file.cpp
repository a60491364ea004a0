#include "records/output_file.h"

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <utility>

#include <fcntl.h>
#include <unistd.h>

namespace forereach {

OutputFile::OutputFile(std::string path, std::FILE* stream, bool is_named)
    : path_(std::move(path)), stream_(stream), is_named_(is_named) {}

OutputFile::OutputFile(std::string path) : path_(std::move(path)) {
  const int descriptor = ::open(path_.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (descriptor < 0 && errno == EEXIST)
    throw OutputError(path_ + ": the file exists, and is not changed; choose another name");
  if (descriptor < 0) throw OutputError(path_ + ": " + std::strerror(errno));
  stream_ = ::fdopen(descriptor, "w+b");
  if (!stream_) {
    ::close(descriptor);
    Fail();
  }
}

OutputFile OutputFile::Nameless(const std::string& beside) {
  std::string path = beside + ".XXXXXX";
  const int descriptor = ::mkostemp(path.data(), O_CLOEXEC);
  if (descriptor < 0) throw OutputError(path + ": " + std::strerror(errno));
  ::unlink(path.c_str());
  std::FILE* const stream = ::fdopen(descriptor, "w+b");
  if (!stream) {
    ::close(descriptor);
    throw OutputError(path + ": " + std::strerror(errno));
  }
  return {beside, stream, false};
}

OutputFile::OutputFile(OutputFile&& other) noexcept
    : path_(std::move(other.path_)),
      stream_(std::exchange(other.stream_, nullptr)),
      is_named_(other.is_named_),
      size_(other.size_) {}

OutputFile::~OutputFile() {
  if (!stream_) return;
  std::fclose(stream_);
  if (is_named_) ::unlink(path_.c_str());
}

void OutputFile::Write(std::string_view bytes) {
  if (std::fwrite(bytes.data(), 1, bytes.size(), stream_) != bytes.size()) Fail();
  size_ += static_cast<std::int64_t>(bytes.size());
}

void OutputFile::Close() {
  if (std::fflush(stream_) != 0) Fail();
  if (std::fclose(std::exchange(stream_, nullptr)) == 0) return;
  const int reason = errno;
  if (is_named_) ::unlink(path_.c_str());
  errno = reason;
  Fail();
}

void OutputFile::Fail() const { throw OutputError(path_ + ": cannot be written: " + std::strerror(errno)); }

}  // namespace forereach
