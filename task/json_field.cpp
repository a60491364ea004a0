#include "task/json_field.h"

#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forereach/numerics/text.h"
#include "task/config_error.h"
#include "task/json_text.h"

namespace forereach {

void JsonField::Fail(const std::string& what) const {
  throw ConfigError("{}: {}{}", file_, name_.empty() ? "" : name_ + ": ", what);
}

void JsonField::FailAs(const std::string& kind) const {
  Fail(fmt::format("{} is {}", JsonText(json_).substr(0, 40), kind));
}

JsonField JsonField::operator[](const std::string& name) const {
  if (!json_.is_object()) FailAs("no object");
  const auto found = json_.find(name);
  if (found == json_.end()) Fail(fmt::format("has no {}", name));
  return {file_, fmt::format("{}{}{}", name_, name_.empty() ? "" : ".", name), *found};
}

JsonField JsonField::operator[](std::size_t i) const { return {file_, fmt::format("{}[{}]", name_, i), json_.at(i)}; }

void JsonField::RequireFields(const std::set<std::string>& names) const {
  for (const std::string& name : names) static_cast<void>((*this)[name]);
  for (const auto& [name, value] : json_.items())
    if (!names.contains(name)) Fail(fmt::format("has a field {} that does not belong there", name));
}

std::size_t JsonField::Count() const {
  if (!json_.is_array()) FailAs("no list");
  return json_.size();
}

void JsonField::RequireCount(std::size_t count) const {
  if (Count() != count) Fail(fmt::format("has {} entries, has to have {}", Count(), count));
}

std::string JsonField::Text() const {
  if (!json_.is_string()) FailAs("no text");
  return json_.get<std::string>();
}

bool JsonField::Bool() const {
  if (!json_.is_boolean()) FailAs("neither true nor false");
  return json_.get<bool>();
}

int JsonField::Integer(int lower, int upper) const {
  if (!json_.is_number_integer() || json_ < lower || json_ > upper)
    FailAs(fmt::format("no integer in [{}, {}]", lower, upper));
  return json_.get<int>();
}

double JsonField::Number(double above) const {
  if (!json_.is_number() || !std::isfinite(json_.get<double>()) || !(json_.get<double>() > above))
    FailAs(fmt::format("outside ({}, inf)", ToText(above)));
  return json_.get<double>();
}

Eigen::VectorXd JsonField::Numbers(std::size_t count, double above) const {
  RequireCount(count);
  Eigen::VectorXd numbers(static_cast<Eigen::Index>(count));
  for (std::size_t i = 0; i < count; ++i) numbers[static_cast<Eigen::Index>(i)] = (*this)[i].Number(above);
  return numbers;
}

}  // namespace forereach
