#include "certifier/declare/flow.h"

#include <stdexcept>
#include <string>

#include "certifier/dynamics/evaluate.h"
#include "certifier/dynamics/models.h"
#include "certifier/dynamics/text_program.h"
#include "certifier/numerics/size.h"

FOREREACH_ARITHMETIC_BEGIN

namespace forereach {

Flow::Flow(const ExpressionNames& names, std::span<const ExpressionText> rates) : program_(MakeProgram(names, rates)) {
  const Program program = program_.View();
  if (rates.size() != ToSize(program.states))
    throw std::invalid_argument(std::to_string(rates.size()) + " rates for " + std::to_string(program.states) +
                                " states");
  if (program.variables > Jet::kMaxArguments)
    throw std::invalid_argument(std::to_string(program.variables) + " states and inputs, at most " +
                                std::to_string(Jet::kMaxArguments) + " are possible");
  needed_.resize(program.nodes.size());
  for (const int value : program.value) needed_[ToSize(value)] = 1;
  MarkOperands(program.nodes, needed_);
  for (const auto& [name, lower, upper] : names.parameters) parameters_.emplace_back(Interval(lower, upper));
}

void Flow::Evaluate(std::span<const Jet> z, std::span<Jet> rates) const {
  const Program program = program_.View();
  std::vector<Jet> values(program.nodes.size());
  forereach::Evaluate<Jet, Jet>(program, needed_, parameters_, z, values);
  for (std::size_t k = 0; k < rates.size(); ++k) rates[k] = values[ToSize(program.value[k])];
}

void Flow::Enclose(std::span<const Interval> z, Derivatives& out) const {
  std::vector<Jet> arguments, rate(ToSize(program_.View().states)), change(rate.size());
  for (std::size_t l = 0; l < z.size(); ++l) arguments.push_back(Jet::Argument(z[l], static_cast<int>(l), false));
  Evaluate(arguments, rate);
  // A Jet's slope is its derivative along one direction. Here this is the flow: dx_l/ds = f_l, du/ds = 0.
  for (std::size_t l = 0; l < rate.size(); ++l) {
    arguments[l].slope = rate[l].value;
    arguments[l].curvature = rate[l].gradient;
    arguments[l].size = static_cast<int>(z.size());
  }
  Evaluate(arguments, change);
  for (std::size_t k = 0; k < rate.size(); ++k) {
    out.first[k] = {rate[k].value, rate[k].gradient};
    out.second[k] = {change[k].slope, change[k].curvature};
  }
}

std::unique_ptr<Flow> MakeFlow(const NominalModel& model) {
  const std::vector<ExpressionText> rates = RatesOf(model);
  return rates.empty() ? nullptr : std::make_unique<Flow>(NamesOf(model), rates);
}

}  // namespace forereach

FOREREACH_ARITHMETIC_END
