/** A YAML file that is checked against the schema and read into a draft, with the place of each value for error
messages. */
#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "task/field.h"
#include "task/schema.h"

namespace forereach {

class Document final {
 public:
  /** Reads and parses a file. @param named_by prefix of the message that it cannot be read: the place that names it.
  @throws ConfigError if it cannot be read, or is not exactly one YAML document. */
  explicit Document(const std::string& path, const std::string& named_by = "");
  /** Parses this text as if it stood in the file. @throws ConfigError if it is not exactly one YAML document. */
  [[nodiscard]] static Document OfText(std::string path, std::string text) {
    return {std::move(path), Text{std::move(text)}};
  }
  ~Document();

  /** Checks the whole document in one pass: the keys of a map before its values, its values in the schema's order. Each
  value that passed its check is given to its row's reader; a map or list comes after everything in it.
  @param draft its scope is looked at again for each value, since readers fill it. @param schema the rows of such a
  file.
  @throws ConfigError with file, line, key, value and bound of the first error. */
  void Read(TaskDraft& draft, std::span<const Key> schema = Schema());

  [[nodiscard]] const std::string& path() const { return path_; }
  /** The file's bytes. */
  [[nodiscard]] const std::string& text() const { return text_; }

  /** The whole document. @pre Read. */
  [[nodiscard]] Field root() const;
  /** "file:line: key: " for a key such as `task.obstacles[0].circle`; if it is absent, the line of the map or list that
  lacks it. @pre Read. */
  [[nodiscard]] std::string Place(std::string_view key) const;
  /** @throws ConfigError Place(key) + what. */
  [[noreturn]] void Fail(std::string_view key, const std::string& what) const;

 private:
  struct Text {
    std::string bytes;
  };
  Document(std::string path, Text text);

  std::string path_, text_;
  std::unique_ptr<Field::Node> root_;
};

}  // namespace forereach
