/** A value of a JSON document with its place in it, for readers that take a document only if it is as described.

Each function throws ConfigError, "file: layers[1].bias: ...", unless the value is what the function's name says. */
#pragma once

#include <limits>
#include <set>
#include <string>
#include <utility>

#include <Eigen/Core>
#include <nlohmann/json_fwd.hpp>

namespace forereach {

class JsonField final {
 public:
  static constexpr double kAny = -std::numeric_limits<double>::infinity();

  /** A document. @param file its name in errors. Both have to outlive this object and all that are made from it. */
  JsonField(const std::string& file, const nlohmann::json& json) : JsonField(file, "", json) {}

  [[noreturn]] void Fail(const std::string& what) const;

  /** A member of an object; an entry of a list. */
  [[nodiscard]] JsonField operator[](const std::string& name) const;
  [[nodiscard]] JsonField operator[](std::size_t i) const;

  /** It is an object with these members and no other. */
  void RequireFields(const std::set<std::string>& names) const;
  /** The length of a list. */
  [[nodiscard]] std::size_t Count() const;
  void RequireCount(std::size_t count) const;

  [[nodiscard]] std::string Text() const;
  [[nodiscard]] bool Bool() const;
  [[nodiscard]] int Integer(int lower, int upper) const;
  /** Finite and above `above`. */
  [[nodiscard]] double Number(double above = kAny) const;
  [[nodiscard]] Eigen::VectorXd Numbers(std::size_t count, double above = kAny) const;

  [[nodiscard]] const nlohmann::json& json() const { return json_; }
  [[nodiscard]] const std::string& name() const { return name_; }

 private:
  JsonField(const std::string& file, std::string name, const nlohmann::json& json)
      : file_(file), name_(std::move(name)), json_(json) {}

  [[noreturn]] void FailAs(const std::string& kind) const;

  const std::string& file_;
  const std::string name_;
  const nlohmann::json& json_;
};

}  // namespace forereach
