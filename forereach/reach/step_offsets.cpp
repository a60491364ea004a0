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
#include "forereach/sets/zonotope.h"

namespace forereach {

namespace {

// Above the rounding of the sums and products below: docs/soundness.md, 3.15.
constexpr double kOffsetRelative = 0x1p-43, kOffsetSmallest = 0x1p-1000;
// Of the sum of a row: above the rounding of that sum, from which one entry is taken.
constexpr double kSumRelative = 0x1p-46;

constexpr std::array<double, kMaxStates> kZeros{};

// sum_l |slope_kl| r_l where the residual's bounds have a slope: what they leave out.
[[gnu::noinline]] void AddSlopes(const StepSoFar& step, std::array<double, kMaxStates>& most) noexcept {
  most = {};
  for (int k = 0; k < step.slice.dim(); ++k)
    for (int l = 0; l < step.slice.dim(); ++l)
      most[ToSize(k)] = AddUp(most[ToSize(k)],
                              MulUp(std::abs(step.residual.slope[ToSize(k)][ToSize(l)]), step.half_width[ToSize(l)]));
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
    if (rate->IsProportional(k) && AddSlopesOf(model.program(), k)) {
      by_step_[i] = share;
    } else {
      by_intervals[i] = 1;
      by_intervals_.push_back(k);
    }
  }
  if (!by_intervals_.empty()) rate_ = rate->Of(by_intervals);
}

bool StepOffsets::AddSlopesOf(const Program& program, int k) {
  bool has_own = false;
  for (int e = 0; e < program.num_first; ++e) {
    const Program::First& entry = program.jacobian[ToSize(e)];
    if (entry.row != k || entry.column >= program.states) continue;
    const bool is_own = entry.column == k;
    has_own = has_own || is_own;
    if (is_own && entry.is_one) continue;
    const auto index = [](int i) { return static_cast<unsigned short>(i); };
    slopes_.push_back({index(k), index(entry.column), index(e), is_own ? 1.0 : 0.0});
  }
  return has_own;
}

void StepOffsets::Add(const StepSoFar& step, OffsetSpread& spread, Zonotope& image, ImageSums& sums,
                      InstructionSet instructions) const noexcept {
  const auto add = [&]<std::size_t kStates>() {
    Dispatch<&StepOffsets::AddInline<kStates>>(instructions, *this, step, spread, image, sums);
  };
  if (states_ == 6) return add.operator()<6>();
  if (states_ == 4) return add.operator()<4>();
  return add.operator()<0>();
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
// `away` is sum_l |J - I|_kl r_l, and `left` what stays of the offset before.
template <std::size_t kStates>
void StepOffsets::AddInline(const StepSoFar& step, OffsetSpread& spread, Zonotope& image,
                            ImageSums& sums) const noexcept {
  const std::size_t n = kStates > 0 ? kStates : states_, last = ToSize(image.num_generators()) - 1;
  PerState middle, around, away, sloped;
  const bool is_by_step = by_intervals_.empty();
  if (!is_by_step) middle = around = {}, EncloseByIntervals(step.hull, middle, around);
  const double* const middles = is_by_step ? kZeros.data() : middle.data();
  const double* const arounds = is_by_step ? kZeros.data() : around.data();
  if (step.residual.has_slope) AddSlopes(step, sloped);
  const double* const slopes = step.residual.has_slope ? sloped.data() : kZeros.data();
  for (std::size_t k = 0; k < n; k += kLaneCount) StoreLanes(AllLanes(0), &away[k]);
  for (const auto& [row, column, entry, own] : slopes_)
    away[row] += std::abs(step.expansion.jacobian[entry] - own) * step.half_width[column];
  const Lanes ends = AllLanes(step.is_first ? 1 : 2);  // |j_{t+1} - j_t| / E at most
  const PerState& growths = step.is_first ? growth_once_ : growth_twice_;
  for (std::size_t k = 0; k < n; k += kLaneCount) {
    const Lanes value = LoadLanes(&step.expansion.value[k]), center = LoadLanes(step.slice.centers() + k),
                moved = LoadLanes(&step.remainder.center[k]), by_step = LoadLanes(&by_step_[k]);
    const Lanes column = by_step * ((value - center) + moved) + LoadLanes(middles + k);
    const Lanes most =
        Max(Abs(LoadLanes(&step.residual.lower[k])), Abs(LoadLanes(&step.residual.upper[k]))) + LoadLanes(slopes + k);
    const Lanes remainder = LoadLanes(&step.remainder.half_width[k]);
    const Lanes reach = LoadLanes(&away[k]) + LoadLanes(&step.error.value[k]) + LoadLanes(&step.error.image[k]) +
                        remainder + AllLanes(4 * kUnitRoundoff) * (Abs(value) + Abs(center) + Abs(moved)) +
                        LoadLanes(step.of_inputs + k);
    Lanes left = AllLanes(0), sum = LoadLanes(&sums.row[k]);
    if (!step.is_first) {
      const auto at = [&](std::size_t i) __attribute__((always_inline)) {
        return k + i < n ? image.padded_row(static_cast<int>(k + i))[last] : 0;
      };
      const Lanes image_of_last{at(0), at(1), at(2), at(3)};
      left = Abs(image_of_last - column);
      sum = (sum - Abs(image_of_last)) + AllLanes(kSumRelative) * sum;
    }
    const Lanes growth = LoadLanes(&growths[k]), w = LoadLanes(step.unexpected + k);
    const Lanes off = by_step * reach + AllLanes(4 * kUnitRoundoff) * Abs(column) + LoadLanes(arounds + k);
    Lanes added = ends * (off + LoadLanes(&declared_[k])) + growth * (most + w) + left + remainder;
    added = added + growth > AllLanes(0) ? added * AllLanes(1 + kOffsetRelative) + AllLanes(kOffsetSmallest) : added;
    StoreLanes(sum + Abs(column), &sums.row[k]);
    StoreLanes(column, &spread.column[k]);
    StoreLanes(LoadLanes(step.disturbance + k) + added, &spread.half_width[k]);
  }
  if (!step.is_first) ArraysOf(image).Truncate<static_cast<int>(kStates)>(static_cast<int>(last));
}

}  // namespace forereach
