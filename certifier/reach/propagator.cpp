#include "certifier/reach/propagator.h"

#include <algorithm>
#include <cmath>

namespace forereach {
namespace {

// Above the rounding of the few dozen operations that make up a slack.
constexpr double kRelative = 0x1p-44, kTiny = 0x1p-1050;

// The plain expansion is used where its error, in the units of the state, is negligible everywhere in the domain.
constexpr double kLargestError = 1e-6;

std::vector<Interval> DomainBox(const Domain& domain) {
  std::vector<Interval> box;
  for (const Box* part : {&domain.state, &domain.input})
    for (int l = 0; l < part->dim(); ++l) box.emplace_back(part->lower()[l], part->upper()[l]);
  return box;
}

bool IsNegligible(const ExpansionError& error, const Program& program, const std::vector<Interval>& domain) {
  const auto small = [](double e) { return e <= kLargestError; };
  bool all = std::all_of(error.value.begin(), error.value.begin() + program.states, small);
  for (std::size_t e = 0; e < static_cast<std::size_t>(program.num_first); ++e) {
    const double reach = domain[static_cast<std::size_t>(program.jacobian[e].column)].Magnitude();
    all &= error.jacobian[e] == 0 || small(error.jacobian[e] * reach);
  }
  return all && std::all_of(error.hessian.begin(), error.hessian.begin() + program.num_second, small);
}

}  // namespace

Propagator::Propagator(const NominalModel& model, const Domain& domain, const ResidualEnclosure& residual,
                       int zonotope_order, Method method)
    : model_(model), domain_(domain), residual_(residual), order_(zonotope_order), remainder_(model.program(), method) {
  const Program& program = model.program();
  rows_.resize(static_cast<std::size_t>(program.states));
  for (std::size_t e = 0; e < static_cast<std::size_t>(program.num_first); ++e) {
    const Program::First& entry = program.jacobian[e];
    if (entry.column < program.states)
      rows_[static_cast<std::size_t>(entry.row)].weights.push_back({static_cast<std::size_t>(entry.column), e});
  }
  for (Row& row : rows_)
    row.copies = row.weights.size() == 1 && program.IsOne(program.jacobian[row.weights[0].entry].node);
  const std::vector<Interval> box = DomainBox(domain);
  error_ = BoundExpansionError(program, model.parameters(), box);
  plain_ = IsNegligible(error_, program, box);
}

void Propagator::HalfWidths(const Zonotope& slice, double* half_width) noexcept {
  const double inflation = 1 + 2.0 * (slice.num_generators() + 4) * kUnitRoundoff;
  for (int k = 0; k < slice.dim(); ++k) {
    const std::span<const double> row = slice.padded_row(k);
    Lanes sum = AllLanes(0);
    for (std::size_t j = 0; j < row.size(); j += kLanes) sum += Abs(LoadLanes(&row[j]));
    half_width[k] = (Sum(sum) + slice.slack(k)) * inflation;
  }
}

void Propagator::ExpandByIntervals(std::span<const double> center, std::span<const PlainInterval> hull, Expansion& expansion,
                                   ExpansionError& error) const noexcept {
  Linearization nominal;
  model_.Linearize(center, nominal);
  for (std::size_t k = 0; k < rows_.size(); ++k) {
    expansion.value[k] = nominal.value[k].Middle();
    error.value[k] = nominal.value[k].DistanceUpper(expansion.value[k]);
  }
  for (std::size_t e = 0; e < static_cast<std::size_t>(nominal.count); ++e) {
    expansion.jacobian[e] = nominal.entries[e].value.Middle();
    error.jacobian[e] = nominal.entries[e].value.DistanceUpper(expansion.jacobian[e]);
  }
  HessianEnclosure hessian;
  std::array<Interval, kMaxVariables> box;
  for (std::size_t l = 0; l < hull.size(); ++l) box[l] = Interval(NextDown(hull[l].lower), NextUp(hull[l].upper));
  model_.EncloseHessian({box.data(), hull.size()}, hessian);
  for (std::size_t e = 0; e < static_cast<std::size_t>(hessian.count); ++e) {
    const Interval& range = hessian.entries[e].second_derivative;
    expansion.hessian[e] = {range.lower, range.upper};
    error.hessian[e] = 0;
  }
}

void Propagator::MapGenerators(const Zonotope& slice, const double* half_width, const Expansion& expansion,
                               const ExpansionError& error, Zonotope& next) const noexcept {
  next.Reset(slice.dim(), slice.num_generators());
  const std::size_t padded = slice.padded_size();
  for (std::size_t k = 0; k < rows_.size(); ++k) {
    const Row& row = rows_[k];
    double* to = next.mutable_row(static_cast<int>(k));
    if (row.weights.empty()) {
      std::fill_n(to, padded, 0.0);
      continue;
    }
    // Each sum of products is off by less than this times the sum of the products' sizes.
    const double relative = row.copies ? 0 : (2 * static_cast<double>(row.weights.size()) + 2) * kUnitRoundoff;
    double slack = 0;
    bool first = true;
    for (const Weight& weight : row.weights) {
      const double j = expansion.jacobian[weight.entry], r = half_width[weight.column];
      const double* from = slice.padded_row(static_cast<int>(weight.column)).data();
      const Lanes factor = AllLanes(j);
      if (first)
        for (std::size_t i = 0; i < padded; i += kLanes) StoreLanes(factor * LoadLanes(from + i), to + i);
      else
        for (std::size_t i = 0; i < padded; i += kLanes) StoreLanes(LoadLanes(to + i) + factor * LoadLanes(from + i), to + i);
      first = false;
      slack += std::abs(j) * (slice.slack(static_cast<int>(weight.column)) + relative * r) + error.jacobian[weight.entry] * r;
    }
    next.mutable_slack(static_cast<int>(k)) = row.copies ? slack : slack * (1 + kRelative) + kTiny;
  }
}

StepResult Propagator::Step(const Zonotope& slice, std::span<const double> input, Zonotope& next,
                            StepRecord& record) const noexcept {
  using Status = StepResult::Status;
  const auto n = static_cast<std::size_t>(slice.dim()), variables = n + input.size();
  double* half_width = record.half_width.data();
  HalfWidths(slice, half_width);
  std::array<double, kMaxVariables> center;
  std::array<PlainInterval, kMaxVariables> hull;
  for (std::size_t l = 0; l < n; ++l) {
    center[l] = slice.center(static_cast<int>(l));
    hull[l] = {center[l] - half_width[l], center[l] + half_width[l]};
  }
  for (std::size_t l = n; l < variables; ++l) hull[l] = {center[l] = input[l - n], input[l - n]};

  if (const DomainExit exit = FindExit(domain_, {center.data(), variables}, {half_width, n});
      exit.kind != DomainExit::Kind::kNone)
    return {Status::kDomainExit, exit, -1};

  Expansion expansion;
  ExpansionError interval_error;
  const ExpansionError& error = plain_ ? error_ : interval_error;
  if (plain_)
    model_.Expand({center.data(), variables}, {hull.data(), variables}, expansion);
  else
    ExpandByIntervals({center.data(), variables}, {hull.data(), variables}, expansion, interval_error);
  remainder_.Enclose(slice, half_width, expansion.hessian.data(), error.hessian.data(), record.remainder);
  for (std::size_t k = 0; k < n; ++k)
    if (!std::isfinite(record.remainder.half_width[k])) return {Status::kNoFiniteEnclosure, {}, static_cast<int>(k)};

  residual_.Enclose({slice, input, {half_width, n}}, record.envelope);
  MapGenerators(slice, half_width, expansion, error, next);
  std::array<double, kMaxStates> residual_half_width;
  for (std::size_t k = 0; k < n; ++k) {
    const double lower = record.envelope.lower[k], upper = record.envelope.upper[k];
    if (lower > upper) return {Status::kInconsistent, {}, static_cast<int>(k)};
    const double middle = (lower + upper) / 2, moved = record.remainder.center[k];
    const double next_center = expansion.value[k] + (middle + moved);
    residual_half_width[k] = (upper - lower) / 2;
    // The middles, half-widths and the center itself are rounded.
    const double size = std::abs(expansion.value[k]) + std::abs(lower) + std::abs(upper) + std::abs(moved);
    const double rounding = lower == 0 && upper == 0 && moved == 0 ? 0 : 4 * kUnitRoundoff * size + kTiny;
    double& slack = next.mutable_slack(static_cast<int>(k));
    slack = (slack + error.value[k] + rounding) * (1 + kRelative);
    next.mutable_center(static_cast<int>(k)) = next_center;
    if (!std::isfinite(next_center + residual_half_width[k] + slack))
      return {Status::kNoFiniteEnclosure, {}, static_cast<int>(k)};
  }
  AppendAndReduce(next, {record.remainder.half_width.data(), n}, {residual_half_width.data(), n}, order_);
  return {};
}

}  // namespace forereach
