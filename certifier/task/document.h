/** A YAML file and the places in it, checked against the schema. */
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "certifier/task/schema.h"

namespace forereach {

struct SchemaScope;

class Document final {
 public:
  /** Reads and parses. @throws ConfigError if it cannot, also for anything but one YAML document. */
  explicit Document(const std::string& path);
  ~Document();

  /** Called with each value that is good, by its row and key, after everything inside it. */
  using Visitor = std::function<void(const Key& row, const std::string& key)>;
  /** Checks everything against the schema in one pass. A map's keys are checked before its values, and its values in
  the schema's order. Keys that were visited may be read, also by the visitor.
  @param scope is looked at again for each value, so the visitor may fill it.
  @throws ConfigError naming file, line, key, value and bound of the first thing that is wrong. */
  void Check(const SchemaScope& scope, const Visitor& visit);

  [[nodiscard]] const std::string& path() const { return path_; }
  /** The file's bytes. */
  [[nodiscard]] const std::string& text() const { return text_; }

  /** How many entries a list has, 0 if it is absent. */
  [[nodiscard]] int Count(std::string_view key) const;
  /** The keys of a map in the file's order, none if it is absent. */
  [[nodiscard]] std::vector<std::string> KeysOf(std::string_view key) const;

  // The value at a key that is present and has this type in the schema.
  [[nodiscard]] double Number(std::string_view key) const;
  [[nodiscard]] std::string Text(std::string_view key) const;
  [[nodiscard]] Eigen::VectorXd Vector(std::string_view key) const;
  [[nodiscard]] std::vector<Eigen::VectorXd> Vectors(std::string_view key) const;
  [[nodiscard]] std::vector<std::string> Names(std::string_view key) const;

  // The same, by the type of the member that takes it.
  void Read(std::string_view key, double& value) const;
  void Read(std::string_view key, int& value) const;
  void Read(std::string_view key, std::string& value) const;
  void Read(std::string_view key, std::vector<double>& value) const;
  void Read(std::string_view key, std::optional<double>& value) const;

  /** "file:line: key: ": the place of a key, or of the map it is missing from. */
  [[nodiscard]] std::string Place(std::string_view key) const;
  /** @throws ConfigError Place(key) + what. */
  [[noreturn]] void Fail(std::string_view key, const std::string& what) const;

 private:
  struct Tree;

  std::string path_, text_;
  std::unique_ptr<Tree> tree_;
};

}  // namespace forereach
