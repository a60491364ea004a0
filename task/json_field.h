/** A value of a JSON document with its place, for strict readers: a document with a missing, unknown or wrong member is
refused.

Each function throws ConfigError, "file: layers[1].bias: ...", if the value has another type, size or range. */
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

  /** A document. @param file its name in errors. Both must outlive this object and all objects made from it. */
  JsonField(const std::string& file, const nlohmann::json& json) : JsonField(file, "", json) {}

  [[noreturn]] void Fail(const std::string& what) const;

  /** A member of an object. */
  [[nodiscard]] JsonField operator[](const std::string& name) const;
  /** An entry of a list. @pre i < Count(). */
  [[nodiscard]] JsonField operator[](std::size_t i) const;

  /** Requires an object with exactly these members. */
  void RequireFields(const std::set<std::string>& names) const;
  /** The length of a list. */
  [[nodiscard]] std::size_t Count() const;
  void RequireCount(std::size_t count) const;

  [[nodiscard]] std::string Text() const;
  [[nodiscard]] bool Bool() const;
  [[nodiscard]] int Integer(int lower, int upper) const;
  /** A finite number > `above`. */
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
