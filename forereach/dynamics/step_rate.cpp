#include "forereach/dynamics/step_rate.h"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <string>

#include "forereach/dynamics/evaluate.h"
#include "forereach/dynamics/text_program.h"
#include "forereach/numerics/limits.h"
#include "forereach/numerics/size.h"

FOREREACH_ARITHMETIC_BEGIN

namespace forereach {
namespace {

// x + factor rate, for each state.
std::vector<Symbol> Moved(std::span<const Symbol> x, const Symbol& factor, std::span<const Symbol> rate) {
  std::vector<Symbol> moved;
  for (std::size_t k = 0; k < x.size(); ++k) moved.push_back(x[k] + factor * rate[k]);
  return moved;
}

// The end of the step, as staged_model.h defines it, with its duration h.
std::vector<Symbol> EndOf(const ModelText& text, const ExpressionNames& names, const Symbol& h, ProgramDraft& program) {
  const std::vector<Symbol> x = StatesOf(program);
  const auto rates = [&](std::span<const Symbol> at) { return ValuesAt(at, names, text.equations, program); };
  const std::vector<Symbol> first = rates(x);
  switch (text.integrator) {
    case ModelText::Integrator::kNone: return first;
    case ModelText::Integrator::kEuler: return Moved(x, h, first);
    case ModelText::Integrator::kMidpoint: return Moved(x, h, rates(Moved(x, h / Symbol(2.0), first)));
    case ModelText::Integrator::kRk4: break;
  }
  const std::vector<Symbol> second = rates(Moved(x, h / Symbol(2.0), first)),
                            third = rates(Moved(x, h / Symbol(2.0), second)), fourth = rates(Moved(x, h, third));
  std::vector<Symbol> end;
  for (std::size_t k = 0; k < x.size(); ++k)
    end.push_back(x[k] + h / Symbol(6.0) * (first[k] + Symbol(2.0) * second[k] + Symbol(2.0) * third[k] + fourth[k]));
  return end;
}

}  // namespace

StepRate::StepRate(const ModelText& text) {
  const auto dt = std::ranges::find(text.parameters, "dt", &ModelText::Parameter::name);
  if (dt == text.parameters.end()) throw std::invalid_argument("model " + text.name + ": there is no parameter dt");
  dt_ = ToSize(dt - text.parameters.begin());
  const ExpressionNames names = NamesOf(text);
  ProgramDraft draft(static_cast<int>(names.states.size()),
                     static_cast<int>(names.states.size() + names.inputs.size()));
  const Symbol h = Symbol::Parameter(draft, static_cast<int>(dt_));
  SetValues(EndOf(text, names, h, draft), draft);
  draft.DifferentiateBy(static_cast<int>(dt_));
  program_ = std::make_shared<const ProgramDraft>(std::move(draft));
  const Program program = program_->View();
  needed_.assign(program.nodes.size(), 0);
  for (const int node : program.value) {
    needed_[ToSize(node)] = 1;
    uses_duration_.push_back(!(program.node(node) == Operation{Op::kConstant, -1, -1, 0}));
  }
  MarkOperands(program.nodes, needed_);
  for (const auto& [name, lower, upper] : text.parameters) parameters_.emplace_back(lower, upper);
}

void StepRate::Enclose(std::span<const Interval> box, const Interval& duration,
                       std::span<Interval> rate) const noexcept {
  const Program program = program_->View();
  const std::span parameters(FOREREACH_ON_STACK(Interval, parameters_.size()), parameters_.size());
  std::ranges::copy(parameters_, parameters.begin());
  parameters[dt_] = duration;
  const std::span all(FOREREACH_ON_STACK(Interval, program.size), ToSize(program.size));
  Evaluate<Interval>(program, needed_, std::span<const Interval>(parameters), box, all);
  for (std::size_t k = 0; k < rate.size(); ++k) rate[k] = all[ToSize(program.value[k])];
}

}  // namespace forereach

FOREREACH_ARITHMETIC_END
