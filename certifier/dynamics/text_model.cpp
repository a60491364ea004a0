#include "certifier/dynamics/text_model.h"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

#include "certifier/dynamics/expression.h"
#include "certifier/dynamics/program_model.h"
#include "certifier/dynamics/staged_model.h"
#include "certifier/numerics/size.h"
#include "certifier/numerics/text.h"

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

// The names that are known so far, in the order of their values.
class Names final {
 public:
  explicit Names(const ModelText& text) : text_(text) {}
  void Add(const std::string& name, Symbol value) {
    if (!IsName(name)) Refuse(text_, "\"" + name + "\" is no name");
    if (IsReserved(name)) Refuse(text_, "the name " + name + " belongs to the language");
    if (std::ranges::find(names_, name) != names_.end()) Refuse(text_, "the name " + name + " is used twice");
    names_.push_back(name);
    values_.push_back(value);
  }
  [[nodiscard]] Symbol ValueOf(const ExpressionText& expression, ProgramDraft& program) const {
    return Evaluate<Symbol>(ParseExpression(expression, names_), values_,
                            [&](double number) { return Symbol::Constant(program, number); });
  }

 private:
  const ModelText& text_;
  std::vector<std::string> names_;
  std::vector<Symbol> values_;
};

double StepOf(const ModelText& text) {
  const auto dt = std::ranges::find(text.parameters, "dt", &ModelText::Parameter::name);
  if (dt == text.parameters.end()) Refuse(text, "there is no parameter dt, the step in s");
  if (!(dt->lower > 0) || dt->lower != dt->upper) Refuse(text, "dt is not one positive number");
  return dt->lower;
}

std::vector<std::string> NamesOf(const auto& all) {
  std::vector<std::string> names;
  for (const auto& one : all) names.push_back(one.name);
  return names;
}

}  // namespace

std::shared_ptr<const NominalModel> MakeTextModel(const ModelText& text) {
  using Integrator = ModelText::Integrator;
  const std::size_t states = text.states.size();
  RequireCount(text, "states", states, 1, kMaxStates);
  RequireCount(text, "inputs", text.inputs.size(), 0, kMaxInputs);
  if (text.equations.size() != states)
    Refuse(text, std::to_string(text.equations.size()) + " equations for " + std::to_string(states) + " states");
  const double dt = StepOf(text);

  const auto program =
      std::make_shared<ProgramDraft>(static_cast<int>(states), static_cast<int>(states + text.inputs.size()));
  Names names(text);
  std::vector<Symbol> x;
  int variable = 0;
  for (const ModelText::Variable& state : text.states) {
    x.push_back(Symbol::Variable(*program, variable++));
    names.Add(state.name, x.back());
  }
  for (const ModelText::Variable& input : text.inputs) names.Add(input.name, Symbol::Variable(*program, variable++));
  std::vector<Interval> parameters;
  Symbol step;
  for (const auto& [name, lower, upper] : text.parameters) {
    if (!(-kInfinity < lower && lower <= upper && upper < kInfinity))
      Refuse(text, "the parameter " + name + " in [" + ToText(lower) + ", " + ToText(upper) + "] is no finite range");
    const Symbol value = Symbol::Parameter(*program, static_cast<int>(parameters.size()));
    if (name == "dt") step = value;
    names.Add(name, value);
    parameters.emplace_back(lower, upper);
  }
  for (const auto& [name, value] : text.definitions) names.Add(name, names.ValueOf(value, *program));
  std::vector<int> values;
  for (std::size_t k = 0; k < states; ++k) {
    const Symbol value = names.ValueOf(text.equations[k], *program);
    values.push_back((text.integrator == Integrator::kEuler ? x[k] + step * value : value).node());
  }
  program->SetValues(values);
  program->Differentiate();

  ModelNames all{text.name, NamesOf(text.states), NamesOf(text.inputs), NamesOf(text.parameters),
                 std::make_shared<const ModelText>(text)};
  if (text.integrator == Integrator::kNone || text.integrator == Integrator::kEuler)
    return std::make_shared<ProgramModel>(program, std::move(parameters), std::move(all));
  return std::make_shared<StagedModel>(program, dt, std::move(parameters), std::move(all));
}

}  // namespace forereach
