#include "certifier/reach/propagator.h"

#include <cmath>

namespace forereach {
namespace {

// The slice stacked with its input: center, half-widths and hull of Z_t.
struct Query {
  std::array<double, kMaxVariables> center, half_width;
  std::array<Interval, kMaxVariables> hull;
  std::size_t size;

  Query(const Zonotope& slice, std::span<const double> input) : size(static_cast<std::size_t>(slice.dim()) + input.size()) {
    const auto n = static_cast<std::size_t>(slice.dim());
    for (std::size_t l = 0; l < size; ++l) {
      center[l] = l < n ? slice.center(static_cast<int>(l)) : input[l - n];
      half_width[l] = l < n ? slice.HalfWidthUpper(static_cast<int>(l)) : 0;
      hull[l] = {SubDown(center[l], half_width[l]), AddUp(center[l], half_width[l])};
    }
  }
};

// q_k >= 1/2 r^T B_k r, Eq. (qt-formula). Returns the first output without a finite bound, or -1.
int Remainder(const HessianEnclosure& hessian, const Query& query, std::span<double> remainder) noexcept {
  std::ranges::fill(remainder, 0.0);
  for (int e = 0; e < hessian.count; ++e) {
    const auto& entry = hessian.entries[static_cast<std::size_t>(e)];
    const auto i = static_cast<std::size_t>(entry.row), j = static_cast<std::size_t>(entry.column);
    if (!entry.second_derivative.IsFinite()) return entry.output;
    const double once = entry.row == entry.column ? 0.5 : 1;  // off the diagonal both (i, j) and (j, i) count
    const double term =
        MulUp(MulUp(query.half_width[i], entry.second_derivative.Magnitude()), MulUp(once, query.half_width[j]));
    double& q = remainder[static_cast<std::size_t>(entry.output)];
    q = AddUp(q, term);
  }
  for (std::size_t k = 0; k < remainder.size(); ++k)
    if (!std::isfinite(remainder[k])) return static_cast<int>(k);
  return -1;
}

// Removes the generators that are zero in every coordinate.
void DropZeroColumns(Zonotope& set) noexcept {
  int kept = 0;
  for (int j = 0; j < set.num_generators(); ++j) {
    bool zero = true;
    for (int k = 0; k < set.dim(); ++k) zero &= set.generator(k, j) == 0;
    if (zero) continue;
    if (kept != j)
      for (int k = 0; k < set.dim(); ++k)
        set.mutable_row(k)[static_cast<std::size_t>(kept)] = set.generator(k, j);
    ++kept;
  }
  set.Reset(set.dim(), kept);
}

}  // namespace

StepResult Propagator::Step(const Zonotope& slice, std::span<const double> input, Zonotope& next,
                            StepRecord& record) const noexcept {
  using Status = StepResult::Status;
  const int n = slice.dim();
  const Query query(slice, input);
  const std::span<const Interval> hull(query.hull.data(), query.size);

  if (const DomainExit exit = FindExit(domain_, hull); exit.kind != DomainExit::Kind::kNone)
    return {Status::kDomainExit, exit, -1};

  HessianEnclosure hessian;
  model_.EncloseHessian(hull, hessian);
  const std::span<double> remainder(record.remainder.data(), static_cast<std::size_t>(n));
  if (const int k = Remainder(hessian, query, remainder); k >= 0) return {Status::kNoFiniteEnclosure, {}, k};

  residual_.Enclose({slice, input, {query.half_width.data(), static_cast<std::size_t>(n)}}, record.envelope);

  Linearization nominal;
  model_.Linearize({query.center.data(), query.size}, nominal);
  std::array<double, kMaxStates> half_width;  // h, and all rounding
  for (int k = 0; k < n; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const double lower = record.envelope.lower[i], upper = record.envelope.upper[i];
    if (lower > upper) return {Status::kInconsistent, {}, k};
    const Interval successor = nominal.value[i] + Interval(lower, upper);
    if (!successor.IsFinite() || std::isnan(lower + upper)) return {Status::kNoFiniteEnclosure, {}, k};
    next.mutable_center(k) = successor.Middle();
    half_width[i] = successor.DistanceUpper(next.center(k));
  }
  MapGenerators(nominal.jacobian(), slice, query.half_width, n, next, half_width);
  DropZeroColumns(next);
  for (int k = 0; k < n; ++k) next.AppendAxis(k, remainder[static_cast<std::size_t>(k)]);
  for (int k = 0; k < n; ++k) {
    if (!std::isfinite(half_width[static_cast<std::size_t>(k)])) return {Status::kNoFiniteEnclosure, {}, k};
    next.AppendAxis(k, half_width[static_cast<std::size_t>(k)]);
  }
  ReduceOrder(next, order_);
  return {};
}

}  // namespace forereach
