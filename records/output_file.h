/** A file that an export writes: never a file that is there already, and none is left behind if the export fails. */
#pragma once

#include <cstdint>
#include <cstdio>
#include <string>
#include <string_view>

#include "lcmtypes/bad_input.h"

namespace forereach {

/** An export's file cannot be written; the text names it and the reason. */
class OutputError : public BadInput {
 public:
  using BadInput::BadInput;
};

/** The destructor removes a file that was not closed. */
class OutputFile final {
 public:
  /** Creates the file. @throws OutputError if it exists or cannot be created. */
  explicit OutputFile(std::string path);
  /** A file without a name, in the directory of `beside`, for data that do not fit into memory. @throws OutputError. */
  [[nodiscard]] static OutputFile Nameless(const std::string& beside);
  ~OutputFile();
  OutputFile(OutputFile&& other) noexcept;
  OutputFile& operator=(OutputFile&&) = delete;

  /** @throws OutputError, for example on a full disk. */
  void Write(std::string_view bytes);
  /** Bytes written so far. */
  [[nodiscard]] std::int64_t size() const { return size_; }
  /** The file stays. @throws OutputError if not all of it could be written. */
  void Close();

  /** For libraries and for reading back what was written. */
  [[nodiscard]] std::FILE* stream() { return stream_; }
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  OutputFile(std::string path, std::FILE* stream, bool is_named);
  [[noreturn]] void Fail() const;

  std::string path_;
  std::FILE* stream_ = nullptr;
  bool is_named_ = true;
  std::int64_t size_ = 0;
};

}  // namespace forereach
