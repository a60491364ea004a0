/** A YAML file that is checked against the schema, with the line of each value for error messages. */
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "forereach/dynamics/model_text.h"
#include "task/schema.h"

namespace forereach {

struct SchemaScope;

class Document final {
 public:
  /** Reads and parses a file. @param named_by prefix of the message that it cannot be read: the place that names it.
  @throws ConfigError if it cannot be read, or is not exactly one YAML document. */
  explicit Document(const std::string& path, const std::string& named_by = "");
  ~Document();

  /** Receives each value that passed its check, by its row and its key. A map or list comes after everything in it. */
  using Visitor = std::function<void(const Key& row, const std::string& key)>;
  /** Checks the whole document in one pass: the keys of a map before its values, its values in the schema's order. A
  visited key may be read, also by the visitor.
  @param scope is read again for each value, so the visitor may fill it. @param schema the rows of such a file.
  @throws ConfigError with file, line, key, value and bound of the first error. */
  void Check(const SchemaScope& scope, const Visitor& visit, std::span<const Key> schema = Schema());

  [[nodiscard]] const std::string& path() const { return path_; }
  /** The file's bytes. */
  [[nodiscard]] const std::string& text() const { return text_; }

  /** The number of entries of a list; 0 if it is absent. */
  [[nodiscard]] int Count(std::string_view key) const;
  /** The keys of a map in the file's order; none if it is absent. */
  [[nodiscard]] std::vector<std::string> KeysOf(std::string_view key) const;

  // The value of a key. @pre the key is present and has this type in the schema.
  [[nodiscard]] double Number(std::string_view key) const;
  [[nodiscard]] std::string Text(std::string_view key) const;
  [[nodiscard]] Eigen::VectorXd Vector(std::string_view key) const;
  [[nodiscard]] std::vector<Eigen::VectorXd> Vectors(std::string_view key) const;
  [[nodiscard]] std::vector<std::string> Names(std::string_view key) const;
  /** With its line and column. The text has line breaks and blanks where the file has them, so that the place of each
  character follows from that of the first. */
  [[nodiscard]] ExpressionText Expression(std::string_view key) const;

  // The same, selected by the type of `value`.
  void Read(std::string_view key, double& value) const;
  void Read(std::string_view key, int& value) const;
  void Read(std::string_view key, std::string& value) const;
  void Read(std::string_view key, std::vector<double>& value) const;
  void Read(std::string_view key, std::optional<double>& value) const;

  /** "file:line: key: " for a key that is present; otherwise the line of the map that lacks it. */
  [[nodiscard]] std::string Place(std::string_view key) const;
  /** @throws ConfigError Place(key) + what. */
  [[noreturn]] void Fail(std::string_view key, const std::string& what) const;

 private:
  struct Tree;

  std::string path_, text_;
  std::unique_ptr<Tree> tree_;
};

}  // namespace forereach
