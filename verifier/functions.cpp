#include "verifier/functions.h"

#include <algorithm>
#include <map>

#include "forereach/numerics/size.h"
#include "verifier/expressions.h"
#include "verifier/jet.h"

namespace forereach::verifier {
namespace {

void Define(const std::string& name, int place, Names& names) {
  if (IsReserved(name)) throw ExpressionError("the language has a meaning of its own for the name " + name);
  if (!names.try_emplace(name, place).second) throw ExpressionError("the name " + name + " has two meanings");
}

Real PlusMinus(const Real& end) { return Real::FromTo(-end, end); }

// number = point + rest, and rest times factor goes to the bend.
void Split(const Real& number, const Real& factor, Real& point, Real& bend) {
  if (!number.IsFinite()) {
    bend = Real::Everything();
    return;
  }
  point = number.middle();
  bend += (number - point) * factor;
}

}  // namespace

Formulas FormulasOf(std::span<const std::string> variables, std::span<const std::string> parameters,
                    std::span<const ModelText::Definition> definitions, std::span<const ExpressionText> expressions) {
  Formulas formulas;
  Names names;
  int variable = 0, parameter = 0;
  for (const std::string& name : variables) Define(name, formulas.tape.Add({Op::kVariable, -1, -1, variable++}), names);
  for (const std::string& name : parameters)
    Define(name, formulas.tape.Add({Op::kParameter, -1, -1, parameter++}), names);
  for (const ModelText::Definition& named : definitions)
    Define(named.name, Parse(named.value, names, formulas.tape), names);
  for (const ExpressionText& expression : expressions)
    formulas.results.push_back(Parse(expression, names, formulas.tape));
  return formulas;
}

Functions::Functions(const NominalModel& model, std::span<const ExpressionText> expressions) {
  if (expressions.empty()) return;  // the names of a model need not fit the language
  static const std::vector<ModelText::Definition> kNone;
  const std::vector<std::string> variables = model.variable_names();
  formulas_ = FormulasOf(variables, model.parameter_names(),
                         model.text() == nullptr ? kNone : model.text()->definitions, expressions);
  for (const auto& range : model.parameter_ranges()) parameters_.emplace_back(range.lower, range.upper);
  for (const int result : formulas_.results) {
    const std::vector<int> last_use = formulas_.tape.LastUses(std::span(&result, 1));
    bool uses_input = false;
    for (int i = 0; i < formulas_.tape.size(); ++i) {
      const Tape::Operation& operation = formulas_.tape.at(i);
      uses_input |= last_use[ToSize(i)] >= 0 && operation.op == Op::kVariable && operation.index >= model.num_states();
    }
    uses_input_.push_back(uses_input);
  }
}

std::vector<Real> Functions::Parameters() const {
  std::vector<Real> ranges;
  for (const auto& [lower, upper] : parameters_) ranges.push_back(Real::FromTo(lower, upper));
  return ranges;
}

std::vector<Real> Functions::At(std::span<const Real> z) const {
  const std::vector<Real> parameters = Parameters();
  return Evaluate(formulas_.tape, formulas_.results, RealArithmetic(z, parameters));
}

std::vector<Enclosed> Functions::Over(const Slice& slice, std::span<const Real> input) const {
  using Order = JetArithmetic::Order;
  const std::size_t n = slice.center.size();
  const std::vector<Real> parameters = Parameters();
  std::vector<Real> center = slice.center, half_width, box;
  for (std::size_t l = 0; l < n; ++l) {
    half_width.push_back(slice.HalfWidth(static_cast<int>(l)));
    box.push_back(center[l] + PlusMinus(half_width[l]));
  }
  for (std::vector<Real>* z : {&center, &box}) z->insert(z->end(), input.begin(), input.end());
  const auto jets = [&](std::span<const Real> z, Order order) {
    return Evaluate(formulas_.tape, formulas_.results, JetArithmetic(z, parameters, static_cast<int>(n), order));
  };
  const std::vector<Jet> at_center = jets(center, Order::kFirst), over_box = jets(box, Order::kSecond);
  std::vector<Enclosed> functions;
  for (std::size_t k = 0; k < at_center.size(); ++k) {
    Enclosed function{Real(), std::vector<Real>(n), Real(), over_box[k].value};
    Split(at_center[k].value, 1.0, function.value, function.bend);
    for (const auto& [l, slope] : at_center[k].first) {
      const Real& r = half_width[ToSize(l)];
      if (!r.IsZero()) Split(slope, PlusMinus(r), function.slope[ToSize(l)], function.bend);
    }
    for (const auto& [key, second] : over_box[k].second) {
      const std::size_t i = ToSize(key / JetArithmetic::kStride), l = ToSize(key % JetArithmetic::kStride);
      if (half_width[i].IsZero() || half_width[l].IsZero()) continue;
      const Real product = half_width[i] * half_width[l];
      if (second.IsFinite())
        function.bend += second * (i == l ? Real::FromTo(Real(), Real(0.5) * product) : PlusMinus(product));
      else
        function.bend = Real::Everything();
    }
    functions.push_back(std::move(function));
  }
  return functions;
}

Bounds RangeOver(const Slice& slice, const Enclosed& function) {
  Real spread;
  for (const std::vector<Real>& column : slice.columns) {
    Real along;
    for (std::size_t l = 0; l < column.size(); ++l)
      if (!column[l].IsZero() && !function.slope[l].IsZero()) along += function.slope[l] * column[l];
    spread += abs(along);
  }
  const Real reached = function.value + function.bend + PlusMinus(spread.upper());
  return {max(reached.lower(), function.range.lower()), min(reached.upper(), function.range.upper())};
}

}  // namespace forereach::verifier
