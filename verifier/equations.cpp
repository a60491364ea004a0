// The equations of a text: one tape from z to x+, the integrator's stages included.
#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>
#include <utility>

#include "forereach/dynamics/models/named_models.h"
#include "forereach/numerics/size.h"
#include "verifier/equations.h"
#include "verifier/expressions.h"
#include "verifier/functions.h"
#include "verifier/jet.h"

namespace forereach::verifier {
namespace {

// The model's equations, each one on the line of its state. `as_variable`: a parameter that is the last variable.
Formulas FormulasOf(const ModelText& model, const std::string& as_variable = "") {
  std::vector<std::string> variables, parameters;
  for (const auto* const group : {&model.states, &model.inputs})
    for (const ModelText::Variable& named : *group) variables.push_back(named.name);
  for (const ModelText::Parameter& named : model.parameters)
    if (named.name != as_variable) parameters.push_back(named.name);
  if (!as_variable.empty()) variables.push_back(as_variable);
  return verifier::FormulasOf(variables, parameters, model.definitions, model.equations);
}

// One evaluation of the rates: at x + before dt k, with the rates k of the evaluation before. Its own rates count in x+
// with weight dt. Both are fractions.
struct Stage {
  std::pair<int, int> before, weight;
};

std::vector<Stage> StagesOf(ModelText::Integrator integrator) {
  switch (integrator) {
    case ModelText::Integrator::kNone: return {};
    case ModelText::Integrator::kEuler: return {{{0, 1}, {1, 1}}};
    case ModelText::Integrator::kMidpoint: return {{{0, 1}, {0, 1}}, {{1, 2}, {1, 1}}};
    case ModelText::Integrator::kRk4: return {{{0, 1}, {1, 6}}, {{1, 2}, {1, 3}}, {{1, 2}, {1, 3}}, {{1, 1}, {1, 6}}};
  }
  throw ExpressionError("the integrator is unknown");
}

// For Evaluate: values with their derivatives along one direction, of variables that have such already.
class AlongArithmetic final {
 public:
  using Number = Jet;

  explicit AlongArithmetic(std::span<const Real> parameters)
      : jets_({}, parameters, std::vector<bool>{true}, JetArithmetic::Order::kFirst) {}

  /** With these variables, which must outlive the result. */
  [[nodiscard]] AlongArithmetic At(std::span<const Jet> variables) const {
    AlongArithmetic at = *this;
    at.variables_ = variables;
    return at;
  }
  [[nodiscard]] Jet Apply(const Tape::Operation& operation, const Jet* a, const Jet* b) const {
    return operation.op == Op::kVariable ? variables_[ToSize(operation.index)] : jets_.Apply(operation, a, b);
  }
  [[nodiscard]] Jet Product(const Jet& a, const Jet& b) const { return jets_.Apply({.op = Op::kMultiply}, &a, &b); }
  [[nodiscard]] static std::vector<Real> Slopes(const std::vector<Jet>& jets) {
    std::vector<Real> slopes;
    for (const Jet& jet : jets) slopes.push_back(jet.first.empty() ? Real() : jet.first[0].second);
    return slopes;
  }

 private:
  JetArithmetic jets_;
  std::span<const Jet> variables_;
};

// For Evaluate: how a number scales with the duration, the last variable.
class ScalingArithmetic final {
 public:
  struct Number {
    std::optional<int> degree;  // it is proportional to this power of the duration
    int state = -1;             // it is this variable plus what is of degree 1
  };

  explicit ScalingArithmetic(int duration) : duration_(duration) {}

  [[nodiscard]] Number Apply(const Tape::Operation& operation, const Number* a, const Number* b) const {
    const auto is_moved = [](const Number* x, const Number* by) { return x->state >= 0 && by->degree == 1; };
    switch (operation.op) {
      case Op::kVariable: return operation.index == duration_ ? Number{1} : Number{0, operation.index};
      case Op::kAdd:
        if (is_moved(a, b)) return {{}, a->state};
        return is_moved(b, a) ? Number{{}, b->state} : Equal(*a, *b);
      case Op::kSubtract: return is_moved(a, b) ? Number{{}, a->state} : Equal(*a, *b);
      case Op::kMultiply: return a->degree && b->degree ? Power(*a->degree + *b->degree) : Number();
      case Op::kDivide: return a->degree && b->degree ? Power(*a->degree - *b->degree) : Number();
      case Op::kNegate: return {a->degree};
      default: return (a == nullptr || a->degree == 0) && (b == nullptr || b->degree == 0) ? Number{0} : Number();
    }
  }

 private:
  static Number Equal(const Number& a, const Number& b) { return a.degree == b.degree ? Number{a.degree} : Number(); }
  static Number Power(int degree) { return -9 <= degree && degree <= 9 ? Number{degree} : Number(); }

  int duration_;
};

class TextEquations final : public Equations {
 public:
  explicit TextEquations(const ModelText& model)
      : formulas_(FormulasOf(model)), stages_(StagesOf(model.integrator)), num_states_(model.states.size()) {
    for (const auto& [name, lower, upper] : model.parameters) {
      if (!(lower <= upper) || !std::isfinite(lower) || !std::isfinite(upper))
        throw ExpressionError("the parameter " + name + " has to lie between two finite numbers");
      if (name == "dt") dt_ = static_cast<int>(parameters_.size());
      parameters_.emplace_back(lower, upper);
    }
    if (!stages_.empty() && dt_ < 0) throw ExpressionError("an integrator needs the parameter dt");
    if (dt_ < 0) return;
    formulas_in_dt_ = FormulasOf(model, "dt");
    scaling_ = Evaluate(formulas_in_dt_.tape, formulas_in_dt_.results,
                        ScalingArithmetic(static_cast<int>(model.states.size() + model.inputs.size())));
  }

  bool IsExact() const override {
    return std::ranges::all_of(parameters_, [](const auto& range) { return range.first == range.second; });
  }

  std::vector<Real> Value(std::span<const Real> z) const override {
    const std::vector<Real> parameters = Parameters();
    if (stages_.empty()) return Evaluate(formulas_.tape, formulas_.results, RealArithmetic(z, parameters));
    std::vector<Real> at(z.begin(), z.end()), next(z.begin(), z.begin() + static_cast<std::ptrdiff_t>(num_states_)),
        rates;
    for (const Stage& stage : stages_) {
      const Real before = Length(stage.before), weight = Length(stage.weight);
      for (std::size_t k = 0; k < rates.size(); ++k) at[k] = z[k] + before * rates[k];
      rates = Evaluate(formulas_.tape, formulas_.results, RealArithmetic(at, parameters));
      for (std::size_t k = 0; k < num_states_; ++k) next[k] += weight * rates[k];
    }
    return next;
  }

  std::vector<FirstDerivative> First(std::span<const Real> z) const override {
    const std::vector<Jet> jets = Step(z, z.size(), JetArithmetic::Order::kFirst);
    std::vector<FirstDerivative> derivatives;
    for (std::size_t k = 0; k < num_states_; ++k)
      for (const auto& [variable, value] : jets[k].first)
        if (!value.IsZero()) derivatives.push_back({static_cast<int>(k), variable, value});
    return derivatives;
  }

  std::vector<SecondDerivative> Second(std::span<const Real> z) const override {
    const std::vector<Jet> jets = Step(z, num_states_, JetArithmetic::Order::kSecond);
    std::vector<SecondDerivative> derivatives;
    for (std::size_t k = 0; k < num_states_; ++k)
      for (const auto& [key, value] : jets[k].second)
        derivatives.push_back({static_cast<int>(k), key / JetArithmetic::kStride, key % JetArithmetic::kStride, value});
    std::ranges::sort(derivatives, {}, [](const SecondDerivative& d) { return std::tuple(d.output, d.column, d.row); });
    return derivatives;
  }

  // Forward along h: x+ = x + h sum_s w_s k_s, with the rates k_s at x + h b_s k_{s-1}.
  std::vector<Real> Rate(std::span<const Real> z, const Real& duration) const override {
    std::vector<Real> parameters = Parameters();
    if (dt_ >= 0) parameters.erase(parameters.begin() + dt_);
    const AlongArithmetic along(parameters);
    const Jet h{duration, {{0, 1.0}}, {}};
    std::vector<Jet> at;
    for (const Real& coordinate : z) at.push_back({coordinate, {}, {}});
    at.push_back(h);
    const auto evaluate = [&] { return Evaluate(formulas_in_dt_.tape, formulas_in_dt_.results, along.At(at)); };
    if (stages_.empty()) return AlongArithmetic::Slopes(evaluate());
    std::vector<Jet> rates, sum(num_states_);
    for (const Stage& stage : stages_) {
      const auto [before, weight] = std::pair(Fraction(stage.before), Fraction(stage.weight));
      for (std::size_t k = 0; k < rates.size(); ++k)
        at[k] = AddScaled({z[k], {}, {}}, before, along.Product(h, rates[k]));
      rates = evaluate();
      for (std::size_t k = 0; k < num_states_; ++k) sum[k] = AddScaled(sum[k], weight, rates[k]);
    }
    for (Jet& moved : sum) moved = along.Product(h, moved);
    return AlongArithmetic::Slopes(sum);
  }

  std::vector<Real> Flow(std::span<const Real> z) const override {
    return stages_.empty() ? Rate(z, 0.0)
                           : Evaluate(formulas_.tape, formulas_.results, RealArithmetic(z, Parameters()));
  }

  // Of an integrator only Euler's x + dt x', if the rate x' does not use dt.
  bool IsProportional(int k) const override {
    if (scaling_.empty() || stages_.size() > 1) return false;
    return stages_.empty() ? scaling_[ToSize(k)].state == k : scaling_[ToSize(k)].degree == 0;
  }

 private:
  [[nodiscard]] std::vector<Real> Parameters() const {
    std::vector<Real> ranges;
    for (const auto& [lower, upper] : parameters_) ranges.push_back(Real::FromTo(lower, upper));
    return ranges;
  }
  // dt times the fraction `part`, its numerator and denominator.
  [[nodiscard]] Real Length(const std::pair<int, int>& part) const {
    const auto& [lower, upper] = parameters_[ToSize(dt_)];
    return Real::FromTo(lower, upper) * Real::Integer(part.first) / Real::Integer(part.second);
  }
  [[nodiscard]] static Real Fraction(const std::pair<int, int>& part) {
    return Real::Integer(part.first) / Real::Integer(part.second);
  }

  // x+ with its derivatives by the first `count` variables. Each stage's arguments are jets, whose derivatives those of
  // the rates by the arguments are composed with.
  [[nodiscard]] std::vector<Jet> Step(std::span<const Real> z, std::size_t count, JetArithmetic::Order order) const {
    const std::vector<Real> parameters = Parameters();
    const auto formulas = [&](std::span<const Real> at) {
      const JetArithmetic arithmetic(at, parameters, static_cast<int>(count), order);
      return Evaluate(formulas_.tape, formulas_.results, arithmetic);
    };
    if (stages_.empty()) return formulas(z);
    std::vector<Jet> start;
    for (std::size_t l = 0; l < z.size(); ++l) {
      start.push_back({z[l], {}, {}});
      if (l < count) start[l].first.emplace_back(static_cast<int>(l), 1.0);
    }
    std::vector<Jet> argument = start, next = start, rates;
    std::vector<Real> at(z.begin(), z.end());
    for (const Stage& stage : stages_) {
      const Real before = Length(stage.before), weight = Length(stage.weight);
      for (std::size_t k = 0; k < rates.size(); ++k) {
        argument[k] = AddScaled(start[k], before, rates[k]);
        at[k] = argument[k].value;
      }
      rates = formulas(at);
      for (Jet& rate : rates) rate = Compose(rate, argument, order);
      for (std::size_t k = 0; k < num_states_; ++k) next[k] = AddScaled(next[k], weight, rates[k]);
    }
    return next;
  }

  Formulas formulas_, formulas_in_dt_;
  std::vector<ScalingArithmetic::Number> scaling_;
  std::vector<Stage> stages_;
  std::size_t num_states_;
  std::vector<std::pair<double, double>> parameters_;
  int dt_ = -1;  // its place among them
};

}  // namespace

std::unique_ptr<Equations> EquationsOf(const ModelText& model) {
  if (model.states.empty() || model.equations.size() != model.states.size())
    throw ExpressionError("a model has states and an equation for each");
  return std::make_unique<TextEquations>(model);
}

std::unique_ptr<Equations> EquationsOf(const NominalModel& model) {
  const std::optional<ModelText> text = TextOf(model);
  return text ? EquationsOf(*text) : nullptr;
}

}  // namespace forereach::verifier
