#include "forereach/dynamics/step_rate.h"

#include <algorithm>
#include <array>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

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

// How each node of a program scales with the parameter h: as h^degree for all h > 0, or in no way that is known.
// docs/soundness.md, 3.15.
class Scaling final {
 public:
  Scaling(const Program& program, int h) : program_(program) {
    for (const Operation& n : program.nodes) degree_.push_back(DegreeOf(n, h));
  }

  // Whether the node is z_k plus terms of degree 1.
  [[nodiscard]] bool IsProportional(int node, int k) const {
    const Operation& n = program_.node(node);
    const auto moves = [&](int i) { return degree_[ToSize(i)] == 1; };
    switch (n.op) {
      case Op::kVariable: return n.a == k;
      case Op::kAdd: return (moves(n.b) && IsProportional(n.a, k)) || (moves(n.a) && IsProportional(n.b, k));
      case Op::kSubtract: return moves(n.b) && IsProportional(n.a, k);
      default: return false;
    }
  }

 private:
  using Degree = std::optional<int>;

  [[nodiscard]] Degree DegreeOf(const Operation& n, int h) const {
    const Degree a = n.has_first() ? degree_[ToSize(n.a)] : Degree(0);
    const Degree b = n.has_second() ? degree_[ToSize(n.b)] : Degree(0);
    if (!a || !b) return {};
    switch (n.op) {
      case Op::kParameter: return n.a == h ? 1 : 0;
      case Op::kAdd:
      case Op::kSubtract: return *a == *b ? a : Degree();
      case Op::kMultiply: return Bounded(*a + *b);
      case Op::kDivide: return Bounded(*a - *b);
      case Op::kNegate: return a;
      default: return *a == 0 && *b == 0 ? a : Degree();
    }
  }

  static Degree Bounded(int degree) { return -9 <= degree && degree <= 9 ? Degree(degree) : Degree(); }

  const Program& program_;
  std::vector<Degree> degree_;
};

// What is left of each node of a program in a step of no duration, h = 0: a number, or a node without h that it equals.
// docs/soundness.md, 3.15.
class WithoutDuration final {
 public:
  WithoutDuration(const Program& program, int h) : program_(program) {
    for (int i = 0; i < program.size; ++i) {
      const Operation& n = program.node(i);
      uses_h_.push_back(n.op == Op::kParameter ? n.a == h
                                               : (n.has_first() && Uses(n.a)) || (n.has_second() && Uses(n.b)));
      left_.push_back(Uses(i) ? LeftOf(n) : n.op == Op::kConstant ? Left{i, n.constant} : Left{i, {}});
      is_finite_.push_back(!Uses(i) || left_[ToSize(i)].IsKnown() || StaysFinite(n));
    }
  }

  [[nodiscard]] bool Uses(int node) const { return uses_h_[ToSize(node)]; }

  // Whether the node is z_k.
  [[nodiscard]] bool IsVariable(int node, int k) const {
    const int same = left_[ToSize(node)].node;
    return same >= 0 && program_.node(same) == Operation{Op::kVariable, k, -1, 0};
  }

 private:
  struct Left {
    int node = -1;
    std::optional<double> number;

    [[nodiscard]] bool IsKnown() const { return node >= 0 || number; }
    [[nodiscard]] bool Is(double value) const { return number == value; }
  };

  [[nodiscard]] Left LeftOf(const Operation& n) const {
    const Left none, zero{-1, 0}, a = n.has_first() ? left_[ToSize(n.a)] : none,
                                  b = n.has_second() ? left_[ToSize(n.b)] : none;
    switch (n.op) {
      case Op::kParameter: return zero;
      case Op::kAdd: return a.Is(0) ? b : b.Is(0) ? a : Same(n, a, b);
      case Op::kSubtract:
        if (b.Is(0)) return a;
        return (a.node >= 0 && a.node == b.node) || (a.number && a.number == b.number) ? zero : Same(n, a, b);
      case Op::kMultiply:
        if ((a.Is(0) && is_finite_[ToSize(n.b)]) || (b.Is(0) && is_finite_[ToSize(n.a)])) return zero;
        return a.Is(1) ? b : b.Is(1) ? a : Same(n, a, b);
      case Op::kDivide:
        if (a.Is(0) && !Uses(n.b)) return zero;
        return b.Is(1) ? a : Same(n, a, b);
      case Op::kPower: return a.Is(0) && n.b > 0 ? zero : Same(n, a, b);
      case Op::kCos:
      case Op::kExp: return a.Is(0) ? Left{-1, 1} : Same(n, a, b);
      case Op::kNegate:
      case Op::kSquare:
      case Op::kSin:
      case Op::kTan:
      case Op::kSqrt:
      case Op::kAsin:
      case Op::kAtan:
      case Op::kTanh:
      case Op::kAbs:
      case Op::kSignedSquare: return a.Is(0) ? zero : Same(n, a, b);
      default: return Same(n, a, b);
    }
  }

  // The same operation on what is left of its operands, where the program has it.
  [[nodiscard]] Left Same(const Operation& n, const Left& a, const Left& b) const {
    constexpr std::size_t kMostNodes = 4096;  // the search is quadratic
    if (a.node < 0 || (n.has_second() && b.node < 0) || program_.nodes.size() > kMostNodes) return {};
    for (int i = 0; i < program_.size; ++i) {
      const Operation& other = program_.node(i);
      const bool is_same_second = !n.has_second() || other.b == b.node;  // of a cosine b is no operand
      if (other.op == n.op && other.a == a.node && is_same_second && (n.op != Op::kPower || other.b == n.b))
        return {i, {}};
    }
    return {};
  }

  // Whether the operation has a value wherever its operands have one.
  [[nodiscard]] bool StaysFinite(const Operation& n) const {
    if (!is_finite_[ToSize(n.a)] || (n.has_second() && !is_finite_[ToSize(n.b)])) return false;
    switch (n.op) {
      case Op::kAdd:
      case Op::kSubtract:
      case Op::kMultiply:
      case Op::kNegate:
      case Op::kSquare:
      case Op::kSin:
      case Op::kCos:
      case Op::kExp:
      case Op::kAtan:
      case Op::kTanh:
      case Op::kAbs:
      case Op::kSignedSquare:
      case Op::kMin:
      case Op::kMax: return true;
      case Op::kPower: return n.b > 0;
      case Op::kDivide: return !Uses(n.b);
      default: return false;
    }
  }

  const Program& program_;
  std::vector<bool> uses_h_;
  std::vector<Left> left_;
  std::vector<bool> is_finite_;
};

int PowerOf(ModelText::Integrator integrator) {
  switch (integrator) {
    case ModelText::Integrator::kMidpoint: return 3;
    case ModelText::Integrator::kRk4: return 5;
    case ModelText::Integrator::kNone:
    case ModelText::Integrator::kEuler: break;
  }
  return 2;
}

}  // namespace

StepRate::StepRate(const ModelText& text) : power_(PowerOf(text.integrator)) {
  const auto dt = std::ranges::find(text.parameters, "dt", &ModelText::Parameter::name);
  if (dt == text.parameters.end()) throw std::invalid_argument("model " + text.name + ": there is no parameter dt");
  dt_ = ToSize(dt - text.parameters.begin());
  const ExpressionNames names = NamesOf(text);
  ProgramDraft draft(static_cast<int>(names.states.size()),
                     static_cast<int>(names.states.size() + names.inputs.size()));
  const Symbol h = Symbol::Parameter(draft, static_cast<int>(dt_));
  const std::vector<Symbol> end = EndOf(text, names, h, draft);
  const std::vector<Symbol> equations = ValuesAt(StatesOf(draft), names, text.equations, draft);
  SetValues(end, draft);
  const Program step = draft.View();
  const Scaling scaling(step, static_cast<int>(dt_));
  const WithoutDuration without(step, static_cast<int>(dt_));
  // x + h f with f finite where it is finite at all.
  const bool is_integrated = text.integrator != ModelText::Integrator::kNone &&
                             std::ranges::none_of(equations, [&](const Symbol& f) { return without.Uses(f.node()); });
  for (std::size_t k = 0; k < end.size(); ++k) {
    const int node = end[k].node(), state = static_cast<int>(k);
    is_proportional_.push_back(scaling.IsProportional(node, state));
    begins_at_state_.push_back(is_integrated || is_proportional_.back() || without.IsVariable(node, state));
  }
  draft.DifferentiateBy(static_cast<int>(dt_));
  program_ = std::make_shared<const ProgramDraft>(std::move(draft));
  const Program program = program_->View();
  for (const int node : program.value)
    uses_duration_.push_back(!(program.node(node) == Operation{Op::kConstant, -1, -1, 0}));
  Need(std::vector<unsigned char>(end.size(), 1));
  for (const auto& [name, lower, upper] : text.parameters) parameters_.emplace_back(lower, upper);
}

double StepRate::Growth(double share) const noexcept {
  double growth = 0;  // (1 + growth)(1 + share) - 1
  for (int i = 0; i < power_; ++i) growth = AddUp(AddUp(growth, share), MulUp(growth, share));
  return growth;
}

StepRate StepRate::Of(std::span<const unsigned char> states) const {
  StepRate some = *this;
  some.Need(states);
  return some;
}

void StepRate::Need(std::span<const unsigned char> states) {
  const Program program = program_->View();
  states_.clear();
  needed_.assign(program.nodes.size(), 0);
  for (std::size_t k = 0; k < states.size(); ++k) {
    if (states[k] == 0) continue;
    states_.push_back(static_cast<int>(k));
    needed_[ToSize(program.value[k])] = 1;
  }
  MarkOperands(program.nodes, needed_);
}

void StepRate::Enclose(std::span<const Interval> box, const Interval& duration,
                       std::span<Interval> rate) const noexcept {
  const Program program = program_->View();
  const std::span parameters(FOREREACH_ON_STACK(Interval, parameters_.size()), parameters_.size());
  std::ranges::copy(parameters_, parameters.begin());
  parameters[dt_] = duration;
  const std::span all(FOREREACH_ON_STACK(Interval, program.size), ToSize(program.size));
  Evaluate<Interval>(program, needed_, std::span<const Interval>(parameters), box, all);
  for (const int k : states_) rate[ToSize(k)] = all[ToSize(program.value[ToSize(k)])];
}

}  // namespace forereach

FOREREACH_ARITHMETIC_END
