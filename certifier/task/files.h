/** Reading files that people name, so that no file can hang the process or fill its memory.

Only regular files are read: a pipe, a socket, a device or a directory is an error, and opening one does not wait. A
read from a mount that stalls still waits; whoever may not wait reads in a thread of its own (bus/reloading.h). */
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "bus/descriptor.h"

namespace forereach {

inline constexpr std::int64_t kMegabyte = 1 << 20;
inline constexpr std::int64_t kLargestTaskFile = 16 * kMegabyte;
inline constexpr std::int64_t kLargestJsonFile = 1024 * kMegabyte;
inline constexpr std::int64_t kLargestCsvFile = 16'384 * kMegabyte;

/** A regular file, open for reading from its beginning to its end. */
class InputFile final {
 public:
  /** @param named_by goes before each message: the place that names the file. @param most_bytes in the file.
  @throws ConfigError with file and cause if it is no regular file, cannot be opened, or is larger. */
  InputFile(const std::string& path, std::int64_t most_bytes, std::string named_by = "");

  /** The next bytes, at most so many; 0 at the end. @throws ConfigError if reading fails or the file has grown larger.
   */
  [[nodiscard]] std::size_t Read(char* to, std::size_t most);

 private:
  [[noreturn]] void Fail(const std::string& what) const;
  void RequireAtMost(std::int64_t bytes) const;

  const std::string path_, named_by_;
  const std::int64_t most_bytes_;
  std::int64_t read_ = 0;
  const Descriptor descriptor_;
};

/** All of a regular file. Same errors. */
[[nodiscard]] std::string ReadWhole(const std::string& path, std::int64_t most_bytes, const std::string& named_by = "");

/** Its first bytes, at most so many; the size of the file does not count. Same errors. */
[[nodiscard]] std::string ReadBeginning(const std::string& path, std::size_t bytes);

/** Writes all of `bytes` to an open file from `offset` on. False on failure; errno says why. */
[[nodiscard]] bool WriteAt(int descriptor, std::string_view bytes, std::int64_t offset);

/** Has the disk confirm the names of a directory's files. False on failure; errno says why. */
[[nodiscard]] bool ConfirmDirectory(const std::string& path);

}  // namespace forereach
