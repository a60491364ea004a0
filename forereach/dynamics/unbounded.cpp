#include "forereach/dynamics/unbounded.h"

#include <algorithm>
#include <cstdint>
#include <string_view>

#include "forereach/dynamics/expression.h"
#include "forereach/dynamics/models/named_models.h"
#include "forereach/dynamics/stages.h"
#include "forereach/dynamics/text_program.h"
#include "forereach/numerics/elementary.h"
#include "forereach/numerics/size.h"

namespace forereach {
namespace {

using Kind = Expression::Kind;

// A range, the states on which it depends, and the first operation of it that is not bounded.
struct Value {
  Interval range;
  std::uint32_t states = 0;
  std::optional<Unbounded> cause;
};

// What must not be there, for a function.
std::optional<Interval> Obstruction(Function function, const Interval& a, const Interval& b) {
  const auto if_true = [](bool meets, const Interval& argument) {
    return meets ? std::optional(argument) : std::nullopt;
  };
  switch (function) {
    case Function::kTan: return if_true(!tan(a).IsFinite(), a);
    case Function::kAsin:
    case Function::kAcos: return if_true(!(-1 < a.lower && a.upper < 1), a);
    case Function::kSqrt:
    case Function::kLog: return if_true(!(a.lower > 0), a);
    case Function::kAbs: return if_true(a.Contains(0), a);
    case Function::kMin:
    case Function::kMax: return if_true((a - b).Contains(0), a - b);
    case Function::kAtan2: return if_true(a.Contains(0) && b.lower <= 0, a);
    case Function::kHypot: return if_true(a.Contains(0) && b.Contains(0), a);
    default: return std::nullopt;
  }
}

std::optional<Interval> Obstruction(const Expression::Node& node, const Interval& a, const Interval& b) {
  switch (node.kind) {
    case Kind::kDivide: return b.Contains(0) ? std::optional(b) : std::nullopt;
    case Kind::kPower: return a.lower > 0 ? std::nullopt : std::optional(a);
    case Kind::kWholePower: return node.b < 0 && a.Contains(0) ? std::optional(a) : std::nullopt;
    case Kind::kCall: return Obstruction(node.function, a, b);
    default: return std::nullopt;
  }
}

std::string NameOf(const Expression::Node& node) {
  switch (node.kind) {
    case Kind::kNegate:
    case Kind::kSubtract: return "-";
    case Kind::kAdd: return "+";
    case Kind::kMultiply: return "*";
    case Kind::kDivide: return "/";
    case Kind::kPower:
    case Kind::kWholePower: return "^";
    case Kind::kCall: {
      const auto named = std::ranges::find(Functions(), node.function, &NamedFunction::function);
      return std::string(named->name);
    }
    case Kind::kNumber:
    case Kind::kName: break;
  }
  return "";
}

std::vector<int> StatesIn(std::uint32_t mask) {
  std::vector<int> states;
  for (int k = 0; k < 32; ++k)
    if (mask >> k & 1U) states.push_back(k);
  return states;
}

// Of an operation, its operands known. What depends on no state has no derivative by one, so only its value counts.
Value Apply(const Expression::Node& node, std::span<const Value> earlier, std::span<const Interval> ranges) {
  const bool has_second = node.kind != Kind::kWholePower && node.b >= 0;
  const Value &a = earlier[ToSize(node.a)], &b = earlier[ToSize(has_second ? node.b : node.a)];
  Value value{internal::ValueOf<Interval>(node, ranges), a.states | b.states, a.cause ? a.cause : b.cause};
  if (value.cause) return value;
  const std::optional<Interval> argument =
      value.states != 0 ? Obstruction(node, a.range, b.range) : std::optional<Interval>();
  if (argument || !value.range.IsFinite())
    value.cause = {NameOf(node), node.line, node.column, StatesIn(value.states), argument.value_or(a.range)};
  return value;
}

Value Evaluate(const Expression& expression, std::span<const Value> names) {
  std::vector<Value> values;
  std::vector<Interval> ranges;
  for (const Expression::Node& node : expression.nodes) {
    if (node.kind == Kind::kNumber)
      values.push_back({Interval(node.number), 0, {}});
    else if (node.kind == Kind::kName)
      values.push_back(names[ToSize(node.a)]);
    else
      values.push_back(Apply(node, values, ranges));
    ranges.push_back(values.back().range);
  }
  return values.back();
}

// The equations over a box of variables.
std::vector<Value> Equations(const ModelText& text, const NominalModel& model, std::span<const Interval> box) {
  NameList names(model.variable_names());
  std::vector<Value> values;
  for (int l = 0; l < model.num_variables(); ++l)
    values.push_back({box[ToSize(l)], l < model.num_states() ? std::uint32_t{1} << l : 0, {}});
  for (const auto& [name, lower, upper] : text.parameters) {
    values.push_back({Interval(lower, upper), 0, {}});
    static_cast<void>(names.Add(name));
  }
  for (const auto& [name, value] : text.definitions) {
    values.push_back(Evaluate(ParseExpression(value, names), values));
    static_cast<void>(names.Add(name));
  }
  std::vector<Value> equations;
  for (const ExpressionText& equation : text.equations)
    equations.push_back(Evaluate(ParseExpression(equation, names), values));
  return equations;
}

std::optional<Unbounded> CauseIn(const std::vector<Value>& equations, int state) {
  if (const auto& cause = equations[ToSize(state)].cause) return cause;
  const auto found = std::ranges::find_if(equations, [](const Value& value) { return value.cause.has_value(); });
  return found == equations.end() ? std::nullopt : found->cause;
}

}  // namespace

std::optional<Unbounded> FindUnbounded(const NominalModel& model, std::span<const Interval> box, int state) {
  const std::optional<ModelText> text = TextOf(model);
  if (!text || state < 0 || state >= model.num_states()) return std::nullopt;
  std::vector<Interval> argument(box.begin(), box.end());
  std::vector<Value> rates;
  for (const StageEvaluation& evaluation : EvaluationsOf(text->integrator)) {
    for (std::size_t k = 0; k < rates.size(); ++k)
      argument[k] = box[k] + evaluation.before.Of<Interval>(StepOf(model)) * rates[k].range;
    rates = Equations(*text, model, argument);
    if (const auto cause = CauseIn(rates, state)) return cause;
  }
  return std::nullopt;
}

}  // namespace forereach
