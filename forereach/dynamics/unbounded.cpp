#include "forereach/dynamics/unbounded.h"

#include <algorithm>
#include <cstdint>
#include <string_view>
#include <utility>

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

// Whether the parts of an expression that end at two of its nodes are the same text.
bool IsSame(const Expression& expression, int one, int other) {  // NOLINT(misc-no-recursion): as deep as the text
  const Expression::Node &a = expression.nodes[ToSize(one)], &b = expression.nodes[ToSize(other)];
  if (a.kind != b.kind || a.number != b.number || (a.kind == Kind::kCall && a.function != b.function)) return false;
  if (a.kind == Kind::kNumber || a.kind == Kind::kName) return a.a == b.a;
  if (!IsSame(expression, a.a, b.a)) return false;
  return a.kind == Kind::kWholePower || a.b < 0 ? a.b == b.b : IsSame(expression, a.b, b.b);
}

// Whether the part at `node` is the part at `factor`, or a product with it.
bool HasFactor(const Expression& expression, int node, int factor) {  // NOLINT(misc-no-recursion): as deep as the text
  if (IsSame(expression, node, factor)) return true;
  const Expression::Node& product = expression.nodes[ToSize(node)];
  return product.kind == Kind::kMultiply &&
         (HasFactor(expression, product.a, factor) || HasFactor(expression, product.b, factor));
}

// Whether the node stands in a product with the part at `factor`. A node is an operand of a later one.
bool IsMultipliedBy(const Expression& expression, std::size_t node, int factor) {
  auto at = static_cast<int>(node);
  for (std::size_t i = node + 1; i < expression.nodes.size(); ++i) {
    const Expression::Node& product = expression.nodes[i];
    if (product.kind != Kind::kMultiply || (product.a != at && product.b != at)) continue;
    if (HasFactor(expression, product.a == at ? product.b : product.a, factor)) return true;
    at = static_cast<int>(i);
  }
  return false;
}

// The smoothing that a node is, over the ranges of all nodes.
std::optional<SharpSmoothing> SmoothingAt(const Expression& expression, std::size_t i, std::span<const Value> values,
                                          const NameList& names) {
  const std::vector<Expression::Node>& nodes = expression.nodes;
  const auto is_constant = [&](int node) { return values[ToSize(node)].states == 0; };
  const auto of = [&](int argument, const Interval& width) -> std::optional<SharpSmoothing> {
    const Interval& range = values[ToSize(argument)].range;
    if (!range.Contains(0) || !(0 < width.lower && width.upper < range.HalfWidthUpper())) return std::nullopt;
    SharpSmoothing sharp{NameOf(nodes[i]), nodes[i].line, nodes[i].column, "", width.upper, range};
    if (nodes[ToSize(argument)].kind == Kind::kName) sharp.argument = names.all()[ToSize(nodes[ToSize(argument)].a)];
    sharp.is_square = IsMultipliedBy(expression, i, argument);
    return sharp;
  };
  if (nodes[i].kind != Kind::kCall) return std::nullopt;
  if (nodes[i].function == Function::kHypot) {
    const int width = is_constant(nodes[i].a) ? nodes[i].a : nodes[i].b;
    const int argument = width == nodes[i].a ? nodes[i].b : nodes[i].a;
    return is_constant(width) && !is_constant(argument) ? of(argument, abs(values[ToSize(width)].range)) : std::nullopt;
  }
  const Expression::Node& sum = nodes[ToSize(nodes[i].a)];
  if (nodes[i].function != Function::kSqrt || sum.kind != Kind::kAdd) return std::nullopt;
  const int square = is_constant(sum.a) ? sum.b : sum.a, rest = square == sum.a ? sum.b : sum.a;
  const Expression::Node& power = nodes[ToSize(square)];
  const bool is_square = (power.kind == Kind::kWholePower && power.b == 2) ||
                         (power.kind == Kind::kMultiply && IsSame(expression, power.a, power.b));
  return is_square && is_constant(rest) && !is_constant(square) ? of(power.a, sqrt(values[ToSize(rest)].range))
                                                                : std::nullopt;
}

// @param sharp if not null, gets what is found in the expression.
Value Evaluate(const Expression& expression, std::span<const Value> names, const NameList& known,
               std::vector<SharpSmoothing>* sharp) {
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
  for (std::size_t i = 0; sharp != nullptr && i < values.size(); ++i)
    if (auto found = SmoothingAt(expression, i, values, known)) sharp->push_back(std::move(*found));
  return values.back();
}

// The equations over a box of variables.
std::vector<Value> Equations(const ModelText& text, const NominalModel& model, std::span<const Interval> box,
                             std::vector<SharpSmoothing>* sharp = nullptr) {
  NameList names(model.variable_names());
  std::vector<Value> values;
  for (int l = 0; l < model.num_variables(); ++l)
    values.push_back({box[ToSize(l)], l < model.num_states() ? std::uint32_t{1} << l : 0, {}});
  for (const auto& [name, lower, upper] : text.parameters) {
    values.push_back({Interval(lower, upper), 0, {}});
    static_cast<void>(names.Add(name));
  }
  for (const auto& [name, value] : text.definitions) {
    values.push_back(Evaluate(ParseExpression(value, names), values, names, sharp));
    static_cast<void>(names.Add(name));
  }
  std::vector<Value> equations;
  for (const ExpressionText& equation : text.equations)
    equations.push_back(Evaluate(ParseExpression(equation, names), values, names, sharp));
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

std::vector<SharpSmoothing> FindSharp(const NominalModel& model, std::span<const Interval> box) {
  std::vector<SharpSmoothing> sharp;
  if (const std::optional<ModelText> text = TextOf(model)) static_cast<void>(Equations(*text, model, box, &sharp));
  return sharp;
}

}  // namespace forereach
