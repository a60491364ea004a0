#include "forereach/declare/flow.h"

#include <stdexcept>
#include <string>

#include "forereach/dynamics/evaluate.h"
#include "forereach/dynamics/models/named_models.h"
#include "forereach/dynamics/text_program.h"
#include "forereach/numerics/size.h"

FOREREACH_ARITHMETIC_BEGIN

namespace forereach {

namespace {

std::vector<ExpressionText> Joined(std::span<const ExpressionText> first, std::span<const ExpressionText> last) {
  std::vector<ExpressionText> all(first.begin(), first.end());
  all.insert(all.end(), last.begin(), last.end());
  return all;
}

// Adds to the values of the rates f and of the places g the derivatives of these along the flow: sum over l of dg/dx_l
// f_l.
void DifferentiateAlongTheFlow(ProgramDraft& program) {
  program.Differentiate();
  const Program view = program.View();
  const auto states = ToSize(view.states);
  std::vector<int> values(view.value.begin(), view.value.end());
  const std::vector<Program::First> jacobian(view.jacobian.begin(), view.jacobian.end());  // the program grows
  std::vector<Symbol> along(values.size() - states, Symbol::Constant(program, 0));
  for (const Program::First& entry : jacobian) {
    if (ToSize(entry.row) < states || entry.column >= view.states) continue;
    Symbol& sum = along[ToSize(entry.row) - states];
    const Symbol slope(&program, entry.node), rate(&program, values[ToSize(entry.column)]);
    sum = sum + slope * rate;
  }
  for (const Symbol& sum : along) values.push_back(sum.node());
  program.SetValues(values);
}

// The derivative along the flow. What may be undefined has none.
RangeWithSlopes SlopeOf(const Jet& jet) {
  return {jet.value.IsFinite() ? jet.slope : Interval::Entire(), jet.curvature};
}

}  // namespace

Flow::Flow(const ExpressionNames& names, std::span<const ExpressionText> rates, std::span<const ExpressionText> places)
    : program_(MakeProgram(names, Joined(rates, places))), num_places_(places.size()) {
  const Program program = program_.View();
  if (rates.size() != ToSize(program.states))
    throw std::invalid_argument(std::to_string(rates.size()) + " rates for " + std::to_string(program.states) +
                                " states");
  if (program.variables > Jet::kMaxArguments)
    throw std::invalid_argument(std::to_string(program.variables) + " states and inputs, at most " +
                                std::to_string(Jet::kMaxArguments) + " are possible");
  if (num_places_ > 0) DifferentiateAlongTheFlow(program_);
  const Program whole = program_.View();
  needed_.resize(whole.nodes.size());
  for (const int value : whole.value) needed_[ToSize(value)] = 1;
  MarkOperands(whole.nodes, needed_);
  for (const auto& [name, lower, upper] : names.parameters) parameters_.emplace_back(Interval(lower, upper));
}

std::vector<Jet> Flow::Evaluate(std::span<const Jet> z) const {
  const Program program = program_.View();
  std::vector<Jet> values(program.nodes.size()), wanted;
  forereach::Evaluate<Jet, Jet>(program, needed_, parameters_, z, values);
  for (const int value : program.value) wanted.push_back(values[ToSize(value)]);
  return wanted;
}

void Flow::Enclose(std::span<const Interval> z, Derivatives& out) const {
  std::vector<Jet> arguments;
  for (std::size_t l = 0; l < z.size(); ++l) arguments.push_back(Jet::Argument(z[l], static_cast<int>(l), false));
  const std::vector<Jet> rate = Evaluate(arguments);
  const auto states = ToSize(program_.View().states);
  // A Jet's slope is its derivative along one direction. Here this is the flow: dx_l/ds = f_l, du/ds = 0.
  for (std::size_t l = 0; l < states; ++l) {
    arguments[l].slope = rate[l].value;
    arguments[l].curvature = rate[l].gradient;
    arguments[l].size = static_cast<int>(z.size());
  }
  const std::vector<Jet> change = Evaluate(arguments);
  for (std::size_t k = 0; k < states; ++k) {
    out.first[k] = {rate[k].value, rate[k].gradient};
    out.second[k] = SlopeOf(change[k]);
  }
  out.places.clear();
  for (std::size_t i = states; i < states + num_places_; ++i) {
    out.places.push_back(SlopeOf(change[num_places_ + i]));
    if (!change[i].value.IsFinite()) out.places.back().value = Interval::Entire();
  }
}

std::unique_ptr<Flow> MakeFlow(const NominalModel& model, std::span<const ExpressionText> places) {
  const std::vector<ExpressionText> rates = RatesOf(model);
  return rates.empty() ? nullptr : std::make_unique<Flow>(NamesOf(model), rates, places);
}

}  // namespace forereach

FOREREACH_ARITHMETIC_END
