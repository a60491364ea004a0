/** A checked value of a task file with its place. A cheap handle, valid as long as its document. */
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "forereach/dynamics/model_text.h"

namespace forereach {

class Field final {
 public:
  struct Node;  ///< Defined in document.cpp.
  explicit Field(const Node& node) : node_(&node) {}

  /** Its path in the document, such as `task.obstacles[0].circle`, and the last name of it. */
  [[nodiscard]] const std::string& key() const;
  [[nodiscard]] const std::string& name() const;
  /** The path of its file. */
  [[nodiscard]] const std::string& file() const;

  /** Whether a map has this key. */
  [[nodiscard]] bool Has(std::string_view name) const { return Find(name) != nullptr; }
  /** The value of a key of a map. @pre Has(name). */
  [[nodiscard]] Field operator[](std::string_view name) const;
  /** @pre 0 <= i < Count(). */
  [[nodiscard]] Field operator[](Eigen::Index i) const;
  /** The number of values of a map or list; 0 of anything else. */
  [[nodiscard]] int Count() const;
  /** The values of a map or list in the file's order. */
  [[nodiscard]] std::vector<Field> Entries() const;
  /** The same of a key of a map; none if it is absent. */
  [[nodiscard]] std::vector<Field> Entries(std::string_view name) const;
  /** The keys of a map in the file's order. */
  [[nodiscard]] std::vector<std::string> Keys() const;

  // The value. @pre its row has this type.
  [[nodiscard]] double Number() const;
  [[nodiscard]] std::string Text() const;
  [[nodiscard]] Eigen::VectorXd Vector() const;
  [[nodiscard]] std::vector<Eigen::VectorXd> Vectors() const;
  [[nodiscard]] std::vector<std::string> Names() const;
  /** With its line and column. The text has line breaks and blanks where the file has them, so that the place of each
  character follows from that of the first. */
  [[nodiscard]] ExpressionText Expression() const;

  // The same, selected by the type of `value`.
  void Read(double& value) const { value = Number(); }
  void Read(int& value) const { value = static_cast<int>(Number()); }
  void Read(std::string& value) const { value = Text(); }
  void Read(std::vector<double>& value) const;
  void Read(std::optional<double>& value) const { value = Number(); }

  /** "file:line: key: " */
  [[nodiscard]] std::string Place() const;
  /** @throws ConfigError Place() + what. */
  [[noreturn]] void Fail(const std::string& what) const;
  /** The same for a key of this map. If it is absent, the line is that of the map. */
  [[noreturn]] void Fail(std::string_view name, const std::string& what) const;

 private:
  [[nodiscard]] const Node* Find(std::string_view name) const;

  const Node* node_;
};

}  // namespace forereach
