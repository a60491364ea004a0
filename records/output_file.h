/** A file that a command writes for other programs. Its name appears when all of it is on the disk, so a killed command
leaves no half file under it. */
#pragma once

#include <cstdint>
#include <cstdio>
#include <string>
#include <string_view>

#include "lcmtypes/bad_input.h"

namespace forereach {

/** A file cannot be written; the text names it and the reason. */
class OutputError : public BadInput {
 public:
  using BadInput::BadInput;
};

/** Until Close the file is PATH.part-XXXXXX, which the destructor removes; after a kill it stays. */
class OutputFile final {
 public:
  enum class Existing { kKept, kReplaced };

  /** @param existing with kKept, a file that is there is an error and is not changed, also if it appears before Close.
  With kReplaced, what is there and no file (a directory, a pipe, a device) is one.
  @throws OutputError if the file exists or cannot be created. */
  explicit OutputFile(std::string path, Existing existing = Existing::kKept);
  /** A file without a name, in the directory of `beside`, for data that do not fit into memory. @throws OutputError. */
  [[nodiscard]] static OutputFile Nameless(const std::string& beside);
  ~OutputFile();
  OutputFile(OutputFile&& other) noexcept;
  OutputFile& operator=(OutputFile&&) = delete;

  /** @throws OutputError, for example on a full disk. */
  void Write(std::string_view bytes);
  /** Adds the content of a file, or what is behind its first line. @throws OutputError, BadInput. */
  void WriteContentOf(const std::string& path, bool without_first_line = false);
  /** Bytes written so far. */
  [[nodiscard]] std::int64_t size() const { return size_; }
  /** The file gets its name, after the disk has confirmed its content. @throws OutputError if that fails. */
  void Close();

  /** For libraries and for reading back what was written. */
  [[nodiscard]] std::FILE* stream() { return stream_; }
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  OutputFile(std::string path, std::FILE* stream);
  [[noreturn]] void Fail() const;
  [[noreturn]] void FailExists() const;
  void Name() const;

  std::string path_, part_;  // no part: it has no name
  Existing existing_ = Existing::kKept;
  std::FILE* stream_ = nullptr;
  std::int64_t size_ = 0;
};

/** Gives a finished file another name, by a link or a copy. @throws OutputError if that file exists. */
void GiveName(const std::string& file, const std::string& path);

/** For a command whose work takes long: fails as WriteNewFile would now, if the file exists. @throws OutputError. */
void RequireNewFile(const std::string& path, bool force);

/** Writes a file that does not exist yet; with `force`, in the place of one that does. Whole, or not at all.
@throws OutputError. */
void WriteNewFile(const std::string& path, const std::string& text, bool force);

}  // namespace forereach
