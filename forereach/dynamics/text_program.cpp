#include "forereach/dynamics/text_program.h"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <utility>

#include "forereach/dynamics/evaluate.h"
#include "forereach/dynamics/expression.h"
#include "forereach/numerics/limits.h"
#include "forereach/numerics/size.h"
#include "forereach/numerics/text.h"

FOREREACH_ARITHMETIC_BEGIN

namespace forereach {
namespace {

// The names that are known so far, in the order of their values.
class Known final {
 public:
  void Add(const std::string& name, Symbol value) {
    if (!IsName(name)) throw std::invalid_argument("\"" + name + "\" is no name");
    if (IsReserved(name)) throw std::invalid_argument("the name " + name + " belongs to the language");
    if (!names_.Add(name)) throw std::invalid_argument("the name " + name + " is used twice");
    values_.push_back(value);
  }
  // What is wrong with a definition is said with its place.
  void Define(const ModelText::Definition& definition, ProgramDraft& program) {
    const Symbol value = ValueOf(definition.value, program);
    AtPlaceOf(definition.value, [&] { Add(definition.name, value); });
  }
  [[nodiscard]] Symbol ValueOf(const ExpressionText& text, ProgramDraft& program) const {
    const Expression expression = ParseExpression(text, names_);
    Symbol value;
    AtPlaceOf(text, [&] {
      value = Evaluate<Symbol>(expression, values_, [&](double number) { return Symbol::Constant(program, number); });
    });
    return value;
  }

 private:
  template <class Action>
  static void AtPlaceOf(const ExpressionText& text, const Action& act) try {
    act();
  } catch (const std::invalid_argument& error) {
    throw ExpressionError(text.line, text.column, error.what());
  }

  NameList names_;
  std::vector<Symbol> values_;
};

void RequireAtMost(std::size_t count, int most, const char* what) {
  if (count > ToSize(most))
    throw std::invalid_argument(std::to_string(count) + " " + what + " are more than " + std::to_string(most));
}

}  // namespace

ExpressionNames NamesOf(const NominalModel& model) {
  ExpressionNames names{model.state_names(), model.input_names(), {}, {}};
  for (std::size_t p = 0; p < model.parameter_names().size(); ++p) {
    const Interval& range = model.parameter_ranges()[p];
    names.parameters.push_back({model.parameter_names()[p], range.lower, range.upper});
  }
  if (model.text() != nullptr) names.definitions = model.text()->definitions;
  return names;
}

ExpressionNames NamesOf(const ModelText& text) {
  ExpressionNames names{{}, {}, text.parameters, text.definitions};
  for (const ModelText::Variable& state : text.states) names.states.push_back(state.name);
  for (const ModelText::Variable& input : text.inputs) names.inputs.push_back(input.name);
  return names;
}

std::vector<Symbol> ValuesAt(std::span<const Symbol> states, const ExpressionNames& names,
                             std::span<const ExpressionText> expressions, ProgramDraft& program) {
  Known known;
  for (std::size_t k = 0; k < states.size(); ++k) known.Add(names.states[k], states[k]);
  int variable = static_cast<int>(states.size()), parameter = 0;
  for (const std::string& name : names.inputs) known.Add(name, Symbol::Variable(program, variable++));
  for (const auto& [name, lower, upper] : names.parameters) {
    if (!(-kInfinity < lower && lower <= upper && upper < kInfinity))
      throw std::invalid_argument("the parameter " + name + " in [" + ToText(lower) + ", " + ToText(upper) +
                                  "] is no finite range");
    known.Add(name, Symbol::Parameter(program, parameter++));
  }
  for (const ModelText::Definition& definition : names.definitions) known.Define(definition, program);
  std::vector<Symbol> values;
  for (const ExpressionText& expression : expressions) values.push_back(known.ValueOf(expression, program));
  return values;
}

std::vector<Symbol> StatesOf(ProgramDraft& program) {
  std::vector<Symbol> states;
  for (int k = 0; k < program.View().states; ++k) states.push_back(Symbol::Variable(program, k));
  return states;
}

void SetValues(std::span<const Symbol> values, ProgramDraft& program) {
  std::vector<int> nodes;
  for (const Symbol& value : values) nodes.push_back(value.node());
  program.SetValues(nodes);
}

ProgramDraft MakeProgram(const ExpressionNames& names, std::span<const ExpressionText> expressions) {
  RequireAtMost(names.states.size(), kMaxStates, "states");
  RequireAtMost(names.inputs.size(), kMaxInputs, "inputs");
  const std::size_t states = names.states.size();
  ProgramDraft program(static_cast<int>(states), static_cast<int>(states + names.inputs.size()));
  SetValues(ValuesAt(StatesOf(program), names, expressions, program), program);
  return program;
}

void RequireDerivatives(const ExpressionNames& names, std::span<const ExpressionText> expressions) {
  NameList known;
  for (const auto* variables : {&names.states, &names.inputs})
    for (const std::string& name : *variables) static_cast<void>(known.Add(name));
  for (const ModelText::Parameter& parameter : names.parameters) static_cast<void>(known.Add(parameter.name));
  const std::size_t given = known.all().size();
  for (const ModelText::Definition& definition : names.definitions) static_cast<void>(known.Add(definition.name));
  std::vector<bool> is_used(names.definitions.size());
  const auto require = [&](const ExpressionText& text) {
    for (const Expression::Node& node : ParseExpression(text, known).nodes) {
      if (node.kind == Expression::Kind::kName && ToSize(node.a) >= given) is_used[ToSize(node.a) - given] = true;
      if (node.kind != Expression::Kind::kCall) continue;
      if (node.function == Function::kSoftplus || node.function == Function::kSmoothGate)
        throw ExpressionError(node.line, node.column,
                              "softplus and smooth_gate are for residuals and the planner's laws: the model, limits "
                              "and places need derivatives");
    }
  };
  for (const ExpressionText& expression : expressions) require(expression);
  for (std::size_t i = names.definitions.size(); i-- > 0;)  // each uses only those before it
    if (is_used[i]) require(names.definitions[i].value);
}

TextFunction::TextFunction(const ExpressionNames& names, std::span<const ExpressionText> expressions)
    : program_(std::make_shared<const ProgramDraft>(MakeProgram(names, expressions))) {
  const Program program = program_->View();
  needed_.assign(program.nodes.size(), 0);
  for (const int node : program.value) needed_[ToSize(node)] = 1;
  MarkOperands(program.nodes, needed_);
  for (const auto& [name, lower, upper] : names.parameters) parameters_.push_back(lower + (upper - lower) / 2);
}

void TextFunction::Evaluate(std::span<const double> z, std::span<long double> values) const noexcept {
  const Program program = program_->View();
  std::array<long double, kMaxVariables> wide;
  std::ranges::copy(z, wide.begin());
  const std::span all(FOREREACH_ON_STACK(long double, program.size), ToSize(program.size));
  forereach::Evaluate<long double>(program, needed_, std::span<const double>(parameters_), {wide.data(), z.size()},
                                   all);
  for (std::size_t k = 0; k < values.size(); ++k) values[k] = all[ToSize(program.value[k])];
}

}  // namespace forereach

FOREREACH_ARITHMETIC_END
