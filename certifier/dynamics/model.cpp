#include "certifier/dynamics/model.h"

#include <array>
#include <utility>

#include "certifier/numerics/text.h"

namespace forereach {

NominalModel::NominalModel(const Program& program, std::vector<Interval> parameters, ModelNames names)
    : program_(program), ranges_(std::move(parameters)), names_(std::move(names)) {
  for (const Interval& range : ranges_) middles_.push_back(range.Middle());
}

std::vector<std::string> NominalModel::variable_names() const {
  std::vector<std::string> names = names_.states;
  names.insert(names.end(), names_.inputs.begin(), names_.inputs.end());
  return names;
}

namespace {

// How an expression is laid out in its file does not matter. No two names or numbers stand side by side in one.
std::string WithoutBlanks(std::string text) {
  std::erase_if(text, [](char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; });
  return text;
}

}  // namespace

// Parameters without a range as for a compiled model. Units are for people.
std::string NominalModel::description() const {
  std::string text = names_.name;
  for (std::size_t p = 0; p < ranges_.size(); ++p) {
    const auto& [lower, upper] = ranges_[p];
    text += " " + names_.parameters[p] + "=" +
            (lower == upper ? ToText(lower) : "[" + ToText(lower) + "," + ToText(upper) + "]");
  }
  if (names_.text == nullptr) return text;
  const auto add_names = [&](const char* kind, const std::vector<std::string>& names) {
    text += std::string("; ") + kind;
    for (const std::string& name : names) text += " " + name;
  };
  add_names("states", names_.states);
  add_names("inputs", names_.inputs);
  for (const auto& [name, value] : names_.text->definitions)
    text += "; let " + name + " = " + WithoutBlanks(value.text);
  constexpr std::array kKinds{"next", "euler", "midpoint", "rk4"};
  for (std::size_t k = 0; k < names_.states.size(); ++k)
    text += std::string("; ") + kKinds[static_cast<std::size_t>(names_.text->integrator)] + " " + names_.states[k] +
            " = " + WithoutBlanks(names_.text->equations[k].text);
  return text;
}

}  // namespace forereach
