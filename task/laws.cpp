#include "task/laws.h"

#include <algorithm>
#include <utility>

#include <fmt/core.h>

#include "forereach/dynamics/expression.h"

namespace forereach {
namespace {

std::vector<std::string> Desired() { return {kDesiredHeading, kDesiredSpeed, kDesiredClimb}; }

// All names but those of definitions.
std::vector<std::string> Given(const ExpressionNames& names) {
  std::vector<std::string> given = names.states;
  given.insert(given.end(), names.inputs.begin(), names.inputs.end());
  for (const ModelText::Parameter& parameter : names.parameters) given.push_back(parameter.name);
  return given;
}

// @throws ExpressionError if a definition uses a name that nobody knows, or has the name of something else.
void CheckDefinitions(const NominalModel& model, const Laws& laws) {
  const ExpressionNames names = NamesOf(model);
  NameList known(Given(names));
  for (const std::string& name : Desired()) static_cast<void>(known.Add(name));
  for (const ModelText::Definition& definition : names.definitions) static_cast<void>(known.Add(definition.name));
  for (const ModelText::Definition& definition : laws.definitions) {
    if (known.Find(definition.name) >= 0)
      throw ExpressionError(definition.value.line, definition.value.column,
                            fmt::format("the name {} is used twice", definition.name));
    static_cast<void>(ParseExpression(definition.value, known));
    static_cast<void>(known.Add(definition.name));
  }
}

// The names for a law with these in the place of inputs. Definitions that use another name are left out: all are right,
// so it is a name that a law cannot know, as that of an input.
ExpressionNames NamesFor(const NominalModel& model, const Laws& laws, std::vector<std::string> inputs) {
  CheckDefinitions(model, laws);
  ExpressionNames names = NamesOf(model);
  names.inputs = std::move(inputs);
  std::vector<ModelText::Definition> definitions = std::move(names.definitions);
  definitions.insert(definitions.end(), laws.definitions.begin(), laws.definitions.end());
  names.definitions.clear();
  NameList known(Given(names));
  for (ModelText::Definition& definition : definitions) {
    try {
      static_cast<void>(ParseExpression(definition.value, known));
    } catch (const ExpressionError&) {
      continue;
    }
    static_cast<void>(known.Add(definition.name));
    names.definitions.push_back(std::move(definition));
  }
  return names;
}

}  // namespace

TextFunction MakeStopLaw(const NominalModel& model, const Laws& laws, const Law& law) {
  return {NamesFor(model, laws, {}), law};
}

TextFunction MakeSpeed(const NominalModel& model, const Laws& laws) {
  return {NamesFor(model, laws, {}), std::vector<ExpressionText>{laws.speed.value()}};
}

TextFunction MakeHints(const NominalModel& model, const Laws& laws) {
  return {NamesFor(model, laws, Desired()), laws.hints};
}

}  // namespace forereach
