/** Reads files whose paths come from outside, with a limit on their size.

Only regular files are read. A pipe, a socket, a device or a directory is an error, and opening it does not wait. A read
from a stalled mount does wait; a caller that must not wait reads in its own thread (bus/reloading.h). */
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
  /** @param most_bytes the largest size accepted. @param named_by prefix of each message: the place that names the
  file.
  @throws ConfigError with file and cause if the file cannot be opened, is not regular, or is larger. */
  InputFile(const std::string& path, std::int64_t most_bytes, std::string named_by = "");

  /** Reads the next bytes, at most `most`, and returns their number; 0 at the end of the file.
  @throws ConfigError if reading fails or the file has grown beyond the limit. */
  [[nodiscard]] std::size_t Read(char* to, std::size_t most);

 private:
  [[noreturn]] void Fail(const std::string& what) const;
  void RequireAtMost(std::int64_t bytes) const;

  const std::string path_, named_by_;
  const std::int64_t most_bytes_;
  std::int64_t read_ = 0;
  const Descriptor descriptor_;
};

/** The content of a regular file. @throws ConfigError as InputFile does. */
[[nodiscard]] std::string ReadWhole(const std::string& path, std::int64_t most_bytes, const std::string& named_by = "");

/** The first bytes of a regular file of any size, at most `bytes`. @throws ConfigError as InputFile does. */
[[nodiscard]] std::string ReadBeginning(const std::string& path, std::size_t bytes);

/** Writes all of `bytes` to an open file from `offset` on. False on failure; errno says why. */
[[nodiscard]] bool WriteAt(int descriptor, std::string_view bytes, std::int64_t offset);

/** Has the disk confirm the names of a directory's files. False on failure; errno says why. */
[[nodiscard]] bool ConfirmDirectory(const std::string& path);

}  // namespace forereach
