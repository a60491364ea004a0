#include "forereach/reach/propagator.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "forereach/numerics/size.h"
#include "forereach/residual/lipschitz_row.h"
#include "forereach/sets/order_reduction.h"
#include "forereach/sets/zonotope.h"

namespace forereach {
namespace {

// Above the rounding of the operations that make up a slack, those of RowSlack among them: docs/soundness.md, 2, 3.7.
constexpr double kRelative = 0x1p-43, kSmallest = 0x1p-1050;

// The plain expansion is used where its error, in the units of the state, is negligible everywhere in the domain.
constexpr double kLargestError = 1e-6;

// An axis of the residual up to this part of half the domain is of the size of rounding errors: what is left of bounds
// that data determine. It is no generator, which would displace another in the reduction.
constexpr double kNegligible = 0x1p-40;

bool IsNegligible(const Program& program, const StepError& error) {
  const auto all_small = [](const auto& errors, int count) {
    return std::ranges::all_of(std::span(errors).first(ToSize(count)), [](double e) { return e <= kLargestError; });
  };
  return all_small(error.value, program.states) && all_small(error.image, program.states) &&
         all_small(error.remainder, program.num_second);
}

// The axes k with J e_k = e_k everywhere, a bit for each.
unsigned LastingAxes(const Program& program) {
  unsigned lasting = (1u << program.states) - 1;
  std::array<int, kMaxStates> entries{};
  for (int e = 0; e < program.num_first; ++e) {
    const Program::First& entry = program.jacobian[ToSize(e)];
    if (entry.column >= program.states) continue;
    if (++entries[ToSize(entry.column)] > 1 || entry.row != entry.column || !entry.is_one)
      lasting &= ~(1u << entry.column);
  }
  for (int k = 0; k < program.states; ++k)
    if (entries[ToSize(k)] == 0) lasting &= ~(1u << k);
  return lasting;
}

}  // namespace

Propagator::Propagator(const NominalModel& model, const Domain& domain, const ResidualEnclosure& residual,
                       const Eigen::VectorXd& disturbance, int zonotope_order, Method method,
                       InstructionSet instructions, const StepTiming& timing, ActedInputs inputs,
                       std::shared_ptr<const GrowingDisturbance> growing, unsigned separable,
                       std::shared_ptr<const RegionGrid> regions)
    : model_(model),
      domain_(domain, inputs.error),
      residual_(residual),
      inputs_(std::move(inputs)),
      growing_(std::move(growing)),
      regions_(std::move(regions)),
      offsets_(model, timing),
      order_(zonotope_order),
      method_(method),
      instructions_(instructions) {
  if (!regions_) std::ranges::copy(disturbance, unexpected_.begin());
  for (std::size_t k = 0; k < ToSize(model.num_states()) && !inputs_.AreExact(); ++k)
    unexpected_[k] = AddUp(unexpected_[k], inputs_.of_residual[k]);
  const std::vector<Interval> box = domain.Ranges();
  // The hull of every slice that passes the domain check has at most half the domain's width, so one table of errors
  // holds for all steps: docs/soundness.md, 3.6.
  std::vector<double> half_width(box.size(), 0.0);
  for (std::size_t l = 0; l < ToSize(domain.state.dim()); ++l) half_width[l] = box[l].HalfWidthUpper();
  error_ = BoundStepError(model.program(), model.BoundError(box), half_width);
  plain_ = IsNegligible(model.program(), error_);
  lasting_ = LastingAxes(model.program()) & separable;
  for (std::size_t k = 0; k < ToSize(model.num_states()); ++k) negligible_[k] = kNegligible * half_width[k];
}

void Propagator::HalfWidths(const Zonotope& slice, double* half_width) noexcept {
  // An even multiple of the unit roundoff: the factor is a double. docs/soundness.md, 2, counts the roundings.
  const double inflation = 1 + 2.0 * (slice.num_generators() + 4) * kUnitRoundoff;
  for (int k = 0; k < slice.dim(); ++k) {
    const std::span<const double> row = slice.padded_row(k);
    Lanes sum = AllLanes(0);
    for (std::size_t j = 0; j < row.size(); j += kLaneCount) sum += Abs(LoadLanes(&row[j]));
    half_width[k] = (Sum(sum) + slice.slack(k)) * inflation;
  }
}

void Propagator::Disturb(std::span<const PlainInterval> hull, Disturbed& all) const noexcept {
  const auto n = ToSize(model_.num_states());
  std::ranges::copy(hull, all.hull.begin());
  std::array<Interval, kMaxVariables> box;
  for (std::size_t l = 0; l < hull.size(); ++l) box[l] = Interval(NextDown(hull[l].lower), NextUp(hull[l].upper));
  for (std::size_t l = n; l < hull.size(); ++l) {
    const double e = inputs_.AreExact() ? 0 : inputs_.error[static_cast<Eigen::Index>(l - n)];
    box[l] = Interval(hull[l].lower) + Interval(-e, e);
    all.hull[l] = {box[l].lower, box[l].upper};
  }
  all.of_model = all.by_all = {};
  if (!inputs_.AreExact()) inputs_.Spread(model_, {box.data(), hull.size()}, all.of_model);
  all.unexpected = unexpected_;
  std::array<Interval, kMaxStates> sizes;
  if (growing_) growing_->Enclose({box.data(), hull.size()}, sizes);
  RegionGrid::Box at;
  for (std::size_t l = 0; l < hull.size(); ++l) at.lower[l] = box[l].lower, at.upper[l] = box[l].upper;
  for (std::size_t k = 0; k < n; ++k) {
    if (growing_) all.unexpected[k] = AddUp(unexpected_[k], sizes[k].upper);
    if (regions_)
      all.unexpected[k] = AddUp(all.unexpected[k], regions_->LargestBound(RegionBound::kDisturbance, k, at));
    all.by_all[k] = AddUp(all.unexpected[k], all.of_model[k]);
  }
}

namespace {

// A center and the hull around it.
struct Surroundings {
  std::array<double, kMaxVariables> center;
  std::array<PlainInterval, kMaxVariables> hull;

  FOREREACH_INLINE Surroundings(std::size_t n, const Zonotope& slice, const double* half_width,
                                std::span<const double> input) {
    for (std::size_t k = 0; k < n; k += kLaneCount) {
      const Lanes c = LoadLanes(slice.centers() + k), r = LoadLanes(half_width + k), lower = c - r, upper = c + r;
      StoreLanes(c, &center[k]);
      StoreLanes(__builtin_shufflevector(lower, upper, 0, 4, 1, 5), &hull[k].lower);
      StoreLanes(__builtin_shufflevector(lower, upper, 2, 6, 3, 7), &hull[k + 2].lower);
    }
    for (std::size_t l = 0; l < input.size(); ++l) {
      center[n + l] = input[l];
      hull[n + l] = {input[l], input[l]};
    }
  }
};

// Adds up centers, half-widths and slacks of the successor, four coordinates at a time. False unless all are finite and
// no envelope is inverted. The middles, the half-widths and the center itself are rounded; so are the sums.
// @param negligible up to this length, an axis of the residual is of the size of rounding errors: part of the slack.
// @param of_remainder half-widths with axes of their own. @param box_half_width is set to half the residual's
// width plus the disturbance: one axis for both.
FOREREACH_INLINE bool Join(std::size_t n, const Expansion& expansion, const StepError& error, const StepRecord& record,
                           const ImageSums& sums, const double* of_remainder, const double* disturbance,
                           const double* negligible, Zonotope& next, double* box_half_width,
                           double* next_half_width) noexcept {
  // With room for what the reduction, which comes later, adds by its own inflation: docs/soundness.md, 2.
  const Lanes inflation = AllLanes(1 + (4.0 * next.num_generators() + 64) * kUnitRoundoff);
  return HoldsForFirst(
      n, [&](std::size_t k) __attribute__((always_inline)) {
        const Lanes lower = LoadLanes(&record.envelope.lower[k]), upper = LoadLanes(&record.envelope.upper[k]);
        const Lanes value = LoadLanes(&expansion.value[k]), moved = LoadLanes(&record.remainder.center[k]);
        const Lanes disturbed = LoadLanes(disturbance + k);
        const Lanes width = (upper - lower) * AllLanes(0.5) + disturbed;
        const LaneMask is_axis = width > LoadLanes(negligible + k);
        const Lanes half = is_axis ? width : AllLanes(0);
        const Lanes center = value + ((lower + upper) * AllLanes(0.5) + moved);
        const Lanes added = Abs(lower) + Abs(upper) + Abs(moved) + disturbed;
        // docs/soundness.md, 3.7. Where nothing is added to f0(c), nothing is rounded.
        const Lanes rounding = AllLanes(4 * kUnitRoundoff) * (Abs(value) + added) + AllLanes(kSmallest);
        Lanes slack = LoadLanes(ArraysOf(next).mutable_slacks() + k) + (is_axis ? AllLanes(0) : width);
        if constexpr (kCountsRounding)
          slack = (slack + (LoadLanes(&error.value[k]) + (added > AllLanes(0) ? rounding : AllLanes(0)))) *
                  AllLanes(1 + kRelative);
        const Lanes hull = (LoadLanes(&sums.row[k]) + LoadLanes(of_remainder + k) + half + slack) * inflation;
        StoreLanes(half, box_half_width + k);
        StoreLanes(center, ArraysOf(next).mutable_centers() + k);
        StoreLanes(slack, ArraysOf(next).mutable_slacks() + k);
        StoreLanes(hull, next_half_width + k);
        return (Abs(center) + hull < AllLanes(kInfinity)) & (lower <= upper);
      });
}

// Adds slope * (x - c), x in the slice, to an image whose center is left alone: A G to the generators, and to the slack
// |A| s and what rounding took, a sum of n products and one number in each entry.
[[gnu::noinline]] void AddSlope(const ResidualBounds& bounds, const Zonotope& slice, Zonotope& next,
                                ImageSums& sums) noexcept {
  const int n = slice.dim();
  for (int k = 0; k < n; ++k) {
    const auto& slope = bounds.slope[ToSize(k)];
    std::array<int, kMaxStates> columns;
    std::size_t count = 0;
    for (int l = 0; l < n; ++l)
      if (slope[ToSize(l)] != 0) columns[count++] = l;
    if (count == 0) continue;
    const std::span<const int> sloped(columns.data(), count);
    double* row = ArraysOf(next).mutable_row(k);
    Lanes magnitudes = AllLanes(0), spread = AllLanes(0);
    for (std::size_t j = 0; j < slice.padded_size(); j += kLaneCount) {
      Lanes sum = LoadLanes(row + j);
      magnitudes += Abs(sum);
      for (const int l : sloped) {
        const Lanes part = AllLanes(slope[ToSize(l)]) * LoadLanes(&slice.padded_row(l)[j]);
        magnitudes += Abs(part);
        sum += part;
      }
      StoreLanes(sum, row + j);
      spread += Abs(sum);
    }
    double slack = next.slack(k);
    for (const int l : sloped) slack = AddUp(slack, MulUp(std::abs(slope[ToSize(l)]), slice.slack(l)));
    // At most (n + 1) kMaxGenerators / 4 + 3 roundings of the sum of magnitudes.
    const double magnitude = MulUp(Sum(magnitudes), 1 + kRelative);
    ArraysOf(next).mutable_slack(k) = AddUp(slack, PlainErrorUpper(magnitude, n + 2, 2 * n * slice.num_generators()));
    sums.row[ToSize(k)] = Sum(spread);
  }
}

// Appends d, the generator of the last boundary's offset.
template <std::size_t kStates>
FOREREACH_INLINE void AppendOffset(std::size_t n, const OffsetSpread& offset, Zonotope& next) {
  const int last = next.num_generators();
  ArraysOf(next).Extend<static_cast<int>(kStates)>(last + 1);
  for (std::size_t k = 0; k < n; ++k) ArraysOf(next).mutable_row(static_cast<int>(k))[last] = offset.column[k];
}

// Why the successor could not be joined. An inverted envelope is a contradiction: its ends are bounds in real
// arithmetic.
[[gnu::noinline]] StepResult Failed(const StepRecord& record, const Zonotope& next,
                                    const double* next_half_width) noexcept {
  using Status = StepResult::Status;
  for (int k = 0; k < next.dim(); ++k) {
    const auto i = ToSize(k);
    if (record.envelope.lower[i] > record.envelope.upper[i]) return {Status::kInconsistent, {}, k};
    if (!(std::abs(next.center(k)) + next_half_width[i] < kInfinity)) return {Status::kNoFiniteEnclosure, {}, k};
  }
  return {Status::kNoFiniteEnclosure, {}, 0};
}

// A remainder that is not finite: names its first such coordinate.
[[gnu::noinline]] StepResult Failed(const Remainder& remainder) noexcept {
  const auto* infinite = std::ranges::find_if_not(remainder.half_width, [](double x) { return std::isfinite(x); });
  return {StepResult::Status::kNoFiniteEnclosure, {}, static_cast<int>(infinite - remainder.half_width.begin())};
}

}  // namespace

StepResult Propagator::Step(const Zonotope& slice, std::span<const double> input, StepRecord& record, Zonotope& next,
                            double* next_half_width, bool is_first) const noexcept {
  const auto step = [&]<std::size_t kStates, std::size_t kInputs>() {
    return Dispatch<&Propagator::StepInline<kStates, kInputs>>(instructions_, *this, slice, input, record, next,
                                                               next_half_width, is_first);
  };
  if (input.size() == 2 && slice.dim() == 6) return step.operator()<6, 2>();
  if (input.size() == 2 && slice.dim() == 4) return step.operator()<4, 2>();
  return step.operator()<0, 0>();
}

template <std::size_t kStates, std::size_t kInputs>
StepResult Propagator::StepInline(const Zonotope& slice, std::span<const double> input, StepRecord& record,
                                  Zonotope& next, double* next_half_width, bool is_first) const noexcept {
  const double* half_width = record.half_width.data();
  const std::size_t n = kStates > 0 ? kStates : ToSize(slice.dim());
  if constexpr (kInputs > 0) input = input.first(kInputs);
  // The domain comes first: error_ and the bounds of the envelope hold inside it only.
  if (const DomainExit exit = domain_.FindExit<kStates>(slice.centers(), half_width, input);
      exit.kind != DomainExit::Kind::kNone)
    return {StepResult::Status::kDomainExit, exit, -1};
  const Surroundings around(n, slice, half_width, input);
  const std::size_t variables = n + input.size();
  const std::span<const double> center(around.center.data(), variables);
  const std::span<const PlainInterval> hull(around.hull.data(), variables);
  if (!plain_) return StepByIntervals(slice, input, center, hull, record, next, next_half_width, is_first);
  Expansion expansion;
  model_.Expand(center, hull, expansion, instructions_);
  return Advance<kStates>(slice, input, hull, expansion, error_, record, next, next_half_width, is_first);
}

StepResult Propagator::StepByIntervals(const Zonotope& slice, std::span<const double> input,
                                       std::span<const double> center, std::span<const PlainInterval> hull,
                                       StepRecord& record, Zonotope& next, double* next_half_width,
                                       bool is_first) const noexcept {
  std::array<Interval, kMaxVariables> point, box;
  for (std::size_t l = 0; l < hull.size(); ++l) {
    point[l] = center[l];
    box[l] = Interval(NextDown(hull[l].lower), NextUp(hull[l].upper));
  }
  Expansion expansion;
  ExpansionError error;
  model_.EncloseExpansion({point.data(), hull.size()}, {box.data(), hull.size()}, expansion, error);
  std::array<double, kMaxVariables> half_width{};
  std::copy_n(record.half_width.begin(), slice.dim(), half_width.begin());
  return Advance<0>(slice, input, hull, expansion, BoundStepError(model_.program(), error, half_width), record, next,
                    next_half_width, is_first);
}

template <std::size_t kStates>
StepResult Propagator::Advance(const Zonotope& slice, std::span<const double> input,
                               std::span<const PlainInterval> hull, const Expansion& expansion, const StepError& error,
                               StepRecord& record, Zonotope& next, double* next_half_width,
                               bool is_first) const noexcept {
  const std::size_t n = kStates > 0 ? kStates : ToSize(slice.dim());
  const double* half_width = record.half_width.data();
  model_.EncloseRemainder(method_, slice, half_width, expansion.hessian.data(), error.remainder.data(),
                          record.remainder, instructions_);
  const auto is_finite = [&](std::size_t k) __attribute__((always_inline)) {
    return Abs(LoadLanes(&record.remainder.half_width[k])) < AllLanes(kInfinity);
  };
  if (!HoldsForFirst(n, is_finite)) return Failed(record.remainder);

  record.envelope.has_slope = false;
  residual_.Enclose({slice, input, {half_width, n}}, record.envelope);
  ImageSums sums;
  model_.Map(expansion, error, slice, next, sums, instructions_);
  if (record.envelope.has_slope) AddSlope(record.envelope, slice, next, sums);
  OffsetSpread offset;
  static constexpr std::array<double, kMaxStates> kNothing{};
  Disturbed disturbed;
  const bool is_punctual = offsets_.AreZero(), is_constant = inputs_.AreExact() && !growing_ && !regions_;
  if (!is_constant) Disturb(hull, disturbed);
  const double* const disturbance = is_constant ? unexpected_.data() : disturbed.by_all.data();
  if (!is_punctual) {
    const StepSoFar step{slice,
                         is_constant ? hull : std::span<const PlainInterval>(disturbed.hull.data(), hull.size()),
                         half_width,
                         expansion,
                         error,
                         record.remainder,
                         record.envelope,
                         is_constant ? unexpected_.data() : disturbed.unexpected.data(),
                         is_constant ? kNothing.data() : disturbed.of_model.data(),
                         disturbance,
                         is_first};
    offsets_.Add(step, offset, next, sums, instructions_);
  }
  std::array<double, kMaxStates> box_half_width;
  const double* const added = is_punctual ? disturbance : offset.half_width.data();
  const double* const of_remainder = is_punctual ? record.remainder.half_width.data() : kNothing.data();
  if (!Join(n, expansion, error, record, sums, of_remainder, added, negligible_.data(), next, box_half_width.data(),
            next_half_width))
    return Failed(record, next, next_half_width);
  AxesInSlack& held = ArraysOf(next).mutable_axes_in_slack();
  if (is_punctual) {
    held = slice.axes_in_slack();
  } else {  // n axes count, whichever there are: docs/soundness.md, 3.15
    unsigned missing = 0;
    for (std::size_t k = 0; k < n; k += kLaneCount)
      missing |= BitsOf(LoadLanes(&box_half_width[k]) == AllLanes(0)) << k;
    held.count = std::popcount(missing & ((1u << n) - 1));
  }
  const unsigned lasting = record.envelope.has_slope ? 0 : lasting_;
  AppendAndReduce(next, of_remainder, box_half_width.data(), order_, lasting, instructions_);
  if (!is_punctual) AppendOffset<kStates>(n, offset, next);
  return {};
}

}  // namespace forereach
