#include "forereach/reach/step_offsets.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <string>

#include "forereach/dynamics/models/named_models.h"
#include "forereach/numerics/require.h"
#include "forereach/numerics/size.h"
#include "forereach/numerics/text.h"
#include "forereach/sets/order_reduction.h"
#include "forereach/sets/zonotope.h"

namespace forereach {

namespace {

// Above the rounding of the sums and products below, that of the image's slack included: docs/soundness.md, 3.15.
constexpr double kOffsetRelative = 0x1p-43, kOffsetSmallest = 0x1p-1000;

// sum_l |slope_kl| r_l where the residual's bounds have a slope: what they leave out.
[[gnu::noinline]] void AddSlopes(const StepSoFar& step, std::array<double, kMaxStates>& most) noexcept {
  for (int k = 0; k < step.slice.dim(); ++k)
    for (int l = 0; l < step.slice.dim(); ++l)
      most[ToSize(k)] = AddUp(most[ToSize(k)],
                              MulUp(std::abs(step.residual.slope[ToSize(k)][ToSize(l)]), step.half_width[ToSize(l)]));
}

// One pass over an image and the slice that it is of. Sets away[k] to sum_j |image_kj - slice_kj| in plain arithmetic.
// Unless the step is the first, subtracts `column` from the last generator, and sets the image's sums anew.
FOREREACH_INLINE void Compare(const Zonotope& slice, const double* column, bool is_first, Zonotope& image,
                              ImageSums& sums, double* away) {
  const auto count = ToSize(image.num_generators());
  const std::size_t size = image.padded_size(), block = size - std::min(size, kLaneCount), last = count - block - 1;
  const LaneMask is_last = AtLane(last);
  Lanes column_sum = AllLanes(0), largest = AllLanes(0);
  for (int k = 0; k < image.dim(); ++k) {
    double* const row = image.mutable_row(k);
    const double* const before = slice.padded_row(k).data();
    Lanes difference = AllLanes(0), sum = AllLanes(0), four = AllLanes(0);
    for (std::size_t j = 0; j < size; j += kLaneCount) {
      sum += Abs(four);
      four = LoadLanes(row + j);
      difference += Abs(four - LoadLanes(before + j));
    }
    away[k] = Sum(difference);
    if (is_first) continue;
    four = is_last ? four - AllLanes(column[k]) : four;
    StoreLanes(four, row + block);
    const Lanes absolute = Abs(four);
    sums.row[ToSize(k)] = Sum(sum + absolute);
    image.mutable_slack(k) += 2 * kUnitRoundoff * absolute[last];
    column_sum += absolute;
    largest = Max(largest, absolute);
  }
  if (!is_first) sums.scores.Rewrite(block, count, column_sum, largest);
}

}  // namespace

StepOffsets::StepOffsets(const NominalModel& model, const StepTiming& timing)
    : error_(timing.error), states_(ToSize(model.num_states())) {
  const int n = model.num_states();
  const Eigen::VectorXd& bound = timing.rate_bound;
  Require(error_ >= 0 && error_ < kInfinity, "step error: " + ToText(error_) + " s is negative or not finite");
  Require(bound.size() == 0 || bound.size() == n,
          "rate bound: " + std::to_string(bound.size()) + " entries, must be " + std::to_string(n) + " or none");
  for (const int k : timing.set_at_steps)
    Require(0 <= k && k < n, "set at steps: " + std::to_string(k) + " is no state of the model");
  if (AreZero()) return;
  period_ = StepOf(model);
  Require(error_ < period_ / 2, "step error: " + ToText(error_) + " s is not below half of the step, " +
                                    ToText(period_) + " s: steps could change their order");
  const double most = MulUp(2, error_), share = DivUp(error_, period_);
  duration_ = {SubDown(period_, most), AddUp(period_, most)};
  const std::shared_ptr<const StepRate> rate = RateOf(model);
  std::vector<unsigned char> by_intervals(states_, 0);
  for (int k = 0; k < n; ++k) {
    const auto i = ToSize(k);
    const bool is_declared = bound.size() > 0 && bound[k] < kInfinity;
    Require(bound.size() == 0 || bound[k] >= 0,
            "rate bound: " + ToText(bound.size() == 0 ? 0 : bound[k]) + " is negative or no number");
    if (std::ranges::count(timing.set_at_steps, k) > 0) continue;
    if (is_declared) {
      declared_[i] = MulUp(error_, bound[k]);
      continue;
    }
    const auto require = [&](bool is_said, const std::string& why) {
      Require(is_said, "step error: how " + model.state_names()[i] +
                           " moves with time is not in the model's equations, " + why +
                           ": declare model.rate_bound, or say in model.set_at_steps that software sets it");
    };
    require(rate && rate->UsesDuration(k), "which do not use dt");
    require(rate->BeginsAtState(k),
            "which with dt = 0 do not leave it as it is, so that some number in them holds for "
            "one duration only");
    growth_once_[i] = rate->Growth(share);
    growth_twice_[i] = rate->Growth(MulUp(2, share));
    if (rate->IsProportional(k)) {
      by_step_[i] = share;
    } else {
      by_intervals[i] = 1;
      by_intervals_.push_back(k);
    }
  }
  if (!by_intervals_.empty()) rate_ = rate->Of(by_intervals);
}

int StepOffsets::Add(const StepSoFar& step, OffsetSpread& spread, Zonotope& image, ImageSums& sums,
                     InstructionSet instructions) const noexcept {
  return Dispatch<&StepOffsets::AddInline>(instructions, *this, step, spread, image, sums);
}

void StepOffsets::EncloseByIntervals(std::span<const PlainInterval> hull, PerState& middle,
                                     PerState& reach) const noexcept {
  std::array<Interval, kMaxVariables> box;
  for (std::size_t l = 0; l < hull.size(); ++l) box[l] = Interval(NextDown(hull[l].lower), NextUp(hull[l].upper));
  std::array<Interval, kMaxStates> rate;
  rate_->Enclose({box.data(), hull.size()}, duration_, {rate.data(), states_});
  for (const int k : by_intervals_) {
    const Interval moved = Interval(error_) * rate[ToSize(k)];
    middle[ToSize(k)] = moved.Middle();
    reach[ToSize(k)] = moved.IsFinite() ? moved.DistanceUpper(middle[ToSize(k)]) : kInfinity;
  }
}

// Of each state, f0(z) - z lies within `reach` of p = f0~ - c + m, the middle of E g is share p, and d is that rounded.
int StepOffsets::AddInline(const StepSoFar& step, OffsetSpread& spread, Zonotope& image,
                           ImageSums& sums) const noexcept {
  PerState middle{}, around{}, away, most;
  if (!by_intervals_.empty()) EncloseByIntervals(step.hull, middle, around);
  for (std::size_t k = 0; k < states_; k += kLaneCount) {
    const Lanes moved = (LoadLanes(&step.expansion.value[k]) - LoadLanes(step.slice.centers() + k)) +
                        LoadLanes(&step.remainder.center[k]);
    const Lanes by_step = LoadLanes(&by_step_[k]);
    StoreLanes(by_step > AllLanes(0) ? by_step * moved : LoadLanes(&middle[k]), &spread.column[k]);
    StoreLanes(Max(Abs(LoadLanes(&step.residual.lower[k])), Abs(LoadLanes(&step.residual.upper[k]))), &most[k]);
  }
  if (step.residual.has_slope) AddSlopes(step, most);
  Compare(step.slice, spread.column.data(), step.is_first, image, sums, away.data());
  const Lanes ends = AllLanes(step.is_first ? 1 : 2);  // |j_{t+1} - j_t| / E at most
  const PerState& growths = step.is_first ? growth_once_ : growth_twice_;
  const auto is_finite = [&](std::size_t k) __attribute__((always_inline)) {
    const Lanes value = Abs(LoadLanes(&step.expansion.value[k])) + Abs(LoadLanes(step.slice.centers() + k)) +
                        Abs(LoadLanes(&step.remainder.center[k]));
    const Lanes reach = LoadLanes(&away[k]) + LoadLanes(&step.error.value[k]) + LoadLanes(image.slacks() + k) +
                        LoadLanes(step.slice.slacks() + k) + LoadLanes(&step.remainder.half_width[k]) +
                        AllLanes(4 * kUnitRoundoff) * value + LoadLanes(step.of_inputs + k);
    const Lanes growth = LoadLanes(&growths[k]), by_step = LoadLanes(&by_step_[k]), w = LoadLanes(step.unexpected + k);
    const Lanes column = Abs(LoadLanes(&spread.column[k]));
    const Lanes off =
        by_step > AllLanes(0) ? by_step * reach + AllLanes(4 * kUnitRoundoff) * column : LoadLanes(&around[k]);
    Lanes added = ends * (off + LoadLanes(&declared_[k])) + growth * (LoadLanes(&most[k]) + w);
    added = growth > AllLanes(0) ? added * AllLanes(1 + kOffsetRelative) + AllLanes(kOffsetSmallest) : added;
    StoreLanes(LoadLanes(step.disturbance + k) + added, &spread.half_width[k]);
    return column + added < AllLanes(kInfinity);
  };
  if (HoldsForFirst(states_, is_finite)) return -1;
  for (std::size_t k = 0; k < states_; ++k)
    if (!(std::abs(spread.column[k]) + spread.half_width[k] < kInfinity)) return static_cast<int>(k);
  return 0;
}

void StepOffsets::Append(const OffsetSpread& spread, Zonotope& next, double* half_width) noexcept {
  const auto last = ToSize(next.num_generators()), lane = last % kLaneCount, block = last - lane;
  const LaneMask is_last = AtLane(lane);
  next.Reset(next.dim(), next.num_generators() + 1);
  for (int k = 0, n = next.dim(); k < n; ++k) {
    double* const at = next.mutable_row(k) + block;
    const Lanes kept = lane == 0 ? AllLanes(0) : FirstLanes(LoadLanes(at), lane, 0);
    StoreLanes(is_last ? AllLanes(spread.column[ToSize(k)]) : kept, at);
  }
  for (std::size_t k = 0; k < ToSize(next.dim()); k += kLaneCount) {
    const Lanes sum = LoadLanes(half_width + k) + Abs(LoadLanes(&spread.column[k]));
    StoreLanes(sum * AllLanes(1 + 4 * kUnitRoundoff), half_width + k);
  }
}

}  // namespace forereach
