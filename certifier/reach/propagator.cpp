#include "certifier/reach/propagator.h"

#include <algorithm>
#include <cmath>

namespace forereach {
namespace {

// Above the rounding of the few dozen operations that make up a slack.
constexpr double kRelative = 0x1p-43, kTiny = 0x1p-1050;

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
  const std::vector<Interval> box = DomainBox(domain);
  error_ = BoundExpansionError(model.program(), model.parameters(), box);
  plain_ = IsNegligible(error_, model.program(), box);
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
  for (std::size_t k = 0; k < static_cast<std::size_t>(model_.num_states()); ++k) {
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

StepResult Propagator::Step(const Zonotope& slice, std::span<const double> input, StepRecord& record, Zonotope& next,
                            double* next_half_width) const noexcept {
  using Status = StepResult::Status;
  const auto n = static_cast<std::size_t>(slice.dim()), variables = n + input.size();
  const double* half_width = record.half_width.data();
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
  if (plain_) {
    Expansion expansion;
    model_.Expand({center.data(), variables}, {hull.data(), variables}, expansion);
    return Advance(slice, input, expansion, error_, record, next, next_half_width);
  }
  return StepByIntervals(slice, input, {center.data(), variables}, {hull.data(), variables}, record, next, next_half_width);
}

StepResult Propagator::StepByIntervals(const Zonotope& slice, std::span<const double> input,
                                       std::span<const double> center, std::span<const PlainInterval> hull,
                                       StepRecord& record, Zonotope& next, double* next_half_width) const noexcept {
  Expansion expansion;
  ExpansionError error;
  ExpandByIntervals(center, hull, expansion, error);
  return Advance(slice, input, expansion, error, record, next, next_half_width);
}

StepResult Propagator::Advance(const Zonotope& slice, std::span<const double> input, const Expansion& expansion,
                               const ExpansionError& error, StepRecord& record, Zonotope& next,
                               double* next_half_width) const noexcept {
  using Status = StepResult::Status;
  const auto n = static_cast<std::size_t>(slice.dim());
  const double* half_width = record.half_width.data();
  remainder_.Enclose(slice, half_width, expansion.hessian.data(), error.hessian.data(), record.remainder);
  for (std::size_t k = 0; k < n; ++k)
    if (!std::isfinite(record.remainder.half_width[k])) return {Status::kNoFiniteEnclosure, {}, static_cast<int>(k)};

  residual_.Enclose({slice, input, {half_width, n}}, record.envelope);
  ImageSums sums;
  model_.Map(expansion, error, slice, half_width, next, sums);
  // Above the rounding of a sum of all generators, twice.
  const double inflation = 1 + (4.0 * slice.num_generators() + 64) * kUnitRoundoff;
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
    next_half_width[k] = (sums.row[k] + record.remainder.half_width[k] + residual_half_width[k] + slack) * inflation;
    if (!std::isfinite(next_center + next_half_width[k])) return {Status::kNoFiniteEnclosure, {}, static_cast<int>(k)};
  }
  AppendAndReduce(next, sums.scores, {record.remainder.half_width.data(), n}, {residual_half_width.data(), n}, order_);
  return {};
}

}  // namespace forereach
