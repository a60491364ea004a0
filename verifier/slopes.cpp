#include "verifier/slopes.h"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "forereach/numerics/size.h"
#include "verifier/jet.h"

namespace forereach::verifier {
namespace {

// The entry with a key, or null.
const Real* Find(const Sparse& entries, int key) {
  const auto found = std::ranges::lower_bound(entries, key, {}, &std::pair<int, Real>::first);
  return found != entries.end() && found->first == key ? &found->second : nullptr;
}

}  // namespace

// Parameters are variables of the tape, too: there are derivatives by them.
Slopes::Slopes(const ParametricResidual& residual)
    : num_variables_(static_cast<int>(residual.names.states.size() + residual.names.inputs.size())) {
  if (residual.values.size() != residual.names.states.size())
    throw std::invalid_argument("a residual has one value for each state");
  std::vector<std::string> arguments = residual.names.states;
  arguments.insert(arguments.end(), residual.names.inputs.begin(), residual.names.inputs.end());
  for (const ModelText::Parameter& parameter : residual.names.parameters) arguments.push_back(parameter.name);
  formulas_ = FormulasOf(arguments, {}, residual.names.definitions, residual.values);
}

std::vector<std::pair<int, int>> Slopes::Entries() const {
  std::vector<std::pair<int, int>> entries;
  for (std::size_t row = 0; row < formulas_.results.size(); ++row) {
    std::vector<bool> needed(ToSize(formulas_.tape.size())), occurs(ToSize(num_variables_));
    needed[ToSize(formulas_.results[row])] = true;
    for (int i = formulas_.tape.size() - 1; i >= 0; --i) {
      const Tape::Operation& operation = formulas_.tape.at(i);
      if (!needed[ToSize(i)]) continue;
      if (operation.op == Op::kVariable && operation.index < num_variables_) occurs[ToSize(operation.index)] = true;
      for (const int operand : {operation.a, operation.b})
        if (operand >= 0) needed[ToSize(operand)] = true;
    }
    for (std::size_t column = 0; column < occurs.size(); ++column)
      if (occurs[column]) entries.emplace_back(row, column);
  }
  return entries;
}

Slope Slopes::At(int row, int column, std::span<const Real> w, bool with_gradient) const {
  std::vector<bool> varies(w.size());
  for (std::size_t i = 0; i < w.size(); ++i) varies[i] = with_gradient && !IsPoint(w[i]);
  std::vector<bool> by = varies;
  by[ToSize(column)] = true;
  const JetArithmetic arithmetic(w, {}, by,
                                 with_gradient ? JetArithmetic::Order::kSecond : JetArithmetic::Order::kFirst);
  const std::vector<int> result{formulas_.results[ToSize(row)]};
  const Jet jet = Evaluate(formulas_.tape, result, arithmetic).front();
  const auto entry = [&](const Sparse& entries, int key) {
    const Real* const found = Find(entries, key);
    return found == nullptr ? Real(0.0) : *found;
  };
  Slope slope{entry(jet.first, column), {}};
  if (!with_gradient) return slope;
  slope.gradient.resize(w.size());
  for (int i = 0; i < static_cast<int>(w.size()); ++i)
    if (varies[ToSize(i)])
      slope.gradient[ToSize(i)] = entry(jet.second, JetArithmetic::Key(std::min(i, column), std::max(i, column)));
  return slope;
}

}  // namespace forereach::verifier
