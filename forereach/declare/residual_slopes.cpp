#include "forereach/declare/residual_slopes.h"

#include <stdexcept>
#include <string>

#include "forereach/dynamics/evaluate.h"
#include "forereach/dynamics/text_program.h"

FOREREACH_ARITHMETIC_BEGIN

namespace forereach {
namespace {

int SizeOf(const auto& list) { return static_cast<int>(list.size()); }

}  // namespace

TextSlopes::TextSlopes(const ParametricResidual& residual)
    : ResidualSlopes(SizeOf(residual.names.states), SizeOf(residual.names.states) + SizeOf(residual.names.inputs),
                     SizeOf(residual.names.parameters)),
      program_(MakeProgram(residual.names, residual.values)) {
  if (SizeOf(residual.values) != num_states())
    throw std::invalid_argument("residual: " + std::to_string(residual.values.size()) + " values for " +
                                std::to_string(num_states()) + " states");
  const Program program = program_.View();
  for (const int value : program.value) {
    Row& row = rows_.emplace_back();
    row.needed.resize(program.nodes.size());
    row.needed[ToSize(value)] = 1;
    MarkOperands(program.nodes, row.needed);
    row.occurs.resize(ToSize(num_arguments()));
    for (std::size_t i = 0; i < program.nodes.size(); ++i) {
      const Operation& node = program.nodes[i];
      if (row.needed[i] == 0) continue;
      if (node.op == Op::kVariable) row.occurs[ToSize(node.a)] = true;
      if (node.op == Op::kParameter) row.occurs[ToSize(num_variables() + node.a)] = true;
    }
  }
}

Jet TextSlopes::Enclose(int row, int column, std::span<const Interval> w, std::span<const int> active) const {
  std::vector<Jet> arguments(w.begin(), w.end());
  for (int i = 0; i < SizeOf(active); ++i) {
    const int argument = active[ToSize(i)];
    arguments[ToSize(argument)] = Jet::Argument(w[ToSize(argument)], i, argument == column);
  }
  const Program program = program_.View();
  const std::span<const Jet> all(arguments);
  const auto variables = ToSize(num_variables());
  std::vector<Jet> values(program.nodes.size());
  Evaluate<Jet, Jet>(program, rows_[ToSize(row)].needed, all.subspan(variables), all.first(variables), values);
  return values[ToSize(program.value[ToSize(row)])];
}

std::vector<Interval> ParameterRanges(const ParametricResidual& residual) {
  std::vector<Interval> ranges;
  for (const auto& [name, lower, upper] : residual.names.parameters) ranges.emplace_back(lower, upper);
  return ranges;
}

}  // namespace forereach

FOREREACH_ARITHMETIC_END
