#include "forereach/dynamics/text_model.h"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

#include "forereach/dynamics/angles.h"
#include "forereach/dynamics/expression.h"
#include "forereach/dynamics/program_model.h"
#include "forereach/dynamics/staged_model.h"
#include "forereach/dynamics/stages.h"
#include "forereach/dynamics/text_program.h"
#include "forereach/numerics/size.h"
#include "forereach/numerics/text.h"

namespace forereach {
namespace {

[[noreturn]] void Refuse(const ModelText& text, const std::string& what) {
  throw std::invalid_argument("model " + text.name + ": " + what);
}

void RequireCount(const ModelText& text, const char* what, std::size_t count, int least, int most) {
  if (count >= ToSize(least) && count <= ToSize(most)) return;
  Refuse(text, std::to_string(count) + " " + what + " are outside [" + std::to_string(least) + ", " +
                   std::to_string(most) + "]");
}

double StepOf(const ModelText& text) {
  const auto dt = std::ranges::find(text.parameters, "dt", &ModelText::Parameter::name);
  if (dt == text.parameters.end()) Refuse(text, "there is no parameter dt, the step in s");
  if (!(dt->lower > 0) || dt->lower != dt->upper) Refuse(text, "dt is not one positive number");
  return dt->lower;
}

std::vector<std::string> NamesIn(const auto& all) {
  std::vector<std::string> names;
  for (const auto& one : all) names.push_back(one.name);
  return names;
}

// Replaces the rates x' by the next states x + dt x'.
void AddEulerStep(const ModelText& text, ProgramDraft& program) {
  const auto dt = std::ranges::find(text.parameters, "dt", &ModelText::Parameter::name) - text.parameters.begin();
  const Symbol step = Symbol::Parameter(program, static_cast<int>(dt));
  std::vector<int> next;
  for (const int rate : program.View().value) {
    const Symbol x = Symbol::Variable(program, static_cast<int>(next.size()));
    next.push_back((x + step * Symbol(&program, rate)).node());
  }
  program.SetValues(next);
}

std::vector<int> AnglesOf(const ModelText& text, const Program& program) {
  std::vector<int> angles;
  for (const std::string& name : text.angles) {
    const auto state = std::ranges::find(text.states, name, &ModelText::Variable::name);
    if (state == text.states.end()) Refuse(text, "angles: " + name + " is no state");
    angles.push_back(static_cast<int>(state - text.states.begin()));
  }
  std::ranges::sort(angles);
  try {
    RequireAngles(program, angles, NamesIn(text.states), HasStages(text.integrator));
  } catch (const TurnError& error) {
    const ExpressionText& equation = text.equations[ToSize(error.equation())];
    throw ExpressionError(equation.line, equation.column, error.what());
  } catch (const std::invalid_argument& error) {
    Refuse(text, error.what());
  }
  return angles;
}

}  // namespace

std::shared_ptr<const NominalModel> MakeTextModel(const ModelText& text) {
  const std::size_t states = text.states.size();
  RequireCount(text, "states", states, 1, kMaxStates);
  RequireCount(text, "inputs", text.inputs.size(), 0, kMaxInputs);
  if (text.equations.size() != states)
    Refuse(text, std::to_string(text.equations.size()) + " equations for " + std::to_string(states) + " states");
  const double dt = StepOf(text);

  const ExpressionNames names = NamesOf(text);
  const auto program = std::make_shared<ProgramDraft>(MakeProgram(names, text.equations));
  if (text.integrator == ModelText::Integrator::kEuler) AddEulerStep(text, *program);
  try {
    program->Differentiate();
  } catch (const std::invalid_argument&) {
    RequireDerivatives(names, text.equations);  // says where there is none
    throw;
  }

  // No compiled model has such a name: what is known of those by their names is not known of this one.
  ModelNames all{text.name + " (text)",
                 names.states,
                 names.inputs,
                 NamesIn(text.parameters),
                 std::make_shared<const ModelText>(text),
                 AnglesOf(text, program->View())};
  std::vector<Interval> parameters;
  for (const ModelText::Parameter& parameter : text.parameters)
    parameters.emplace_back(parameter.lower, parameter.upper);
  if (!HasStages(text.integrator))
    return std::make_shared<ProgramModel>(program, std::move(parameters), std::move(all));
  return std::make_shared<StagedModel>(program, dt, std::move(parameters), std::move(all));
}

}  // namespace forereach
