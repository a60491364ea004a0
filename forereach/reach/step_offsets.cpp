#include "forereach/reach/step_offsets.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "forereach/dynamics/models/named_models.h"
#include "forereach/numerics/require.h"
#include "forereach/numerics/size.h"
#include "forereach/numerics/text.h"
#include "forereach/sets/order_reduction.h"

namespace forereach {

StepOffsets::StepOffsets(const NominalModel& model, const StepTiming& timing, const Eigen::VectorXd& disturbance)
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
  const double most = MulUp(2, error_);
  duration_ = {SubDown(period_, most), AddUp(period_, most)};
  std::ranges::copy(disturbance, disturbance_.begin());
  const std::optional<ModelText> text = TextOf(model);
  if (text) rate_.emplace(*text);
  for (int k = 0; k < n; ++k) {
    const auto i = ToSize(k);
    const bool is_declared = bound.size() > 0 && bound[k] < kInfinity;
    Require(bound.size() == 0 || bound[k] >= 0,
            "rate bound: " + ToText(bound.size() == 0 ? 0 : bound[k]) + " is negative or no number");
    kind_[i] = std::ranges::count(timing.set_at_steps, k) > 0 ? Kind::kBySoftware
               : is_declared                                  ? Kind::kDeclared
                                                              : Kind::kByEquations;
    if (is_declared) rate_bound_[i] = bound[k];
    Require(
        kind_[i] != Kind::kByEquations || (rate_ && rate_->UsesDuration(k)),
        "step error: how " + model.state_names()[i] +
            " moves with time is not in the model's equations, which do not use dt: declare model.rate_bound, or say "
            "in model.set_at_steps that software sets it");
  }
}

int StepOffsets::Enclose(std::span<const PlainInterval> hull, const ResidualBounds& residual, bool is_first,
                         OffsetSpread& spread) const noexcept {
  std::array<Interval, kMaxVariables> box;
  for (std::size_t l = 0; l < hull.size(); ++l) box[l] = Interval(NextDown(hull[l].lower), NextUp(hull[l].upper));
  std::array<Interval, kMaxStates> rate;
  if (rate_) rate_->Enclose({box.data(), hull.size()}, duration_, {rate.data(), states_});
  // |j_{t+1} - j_t| / E at most.
  const double ends = is_first ? 1 : 2;
  spread.column.fill(0);
  spread.half_width = disturbance_;
  for (std::size_t k = 0; k < states_; ++k) {
    double& half_width = spread.half_width[k];
    if (kind_[k] == Kind::kBySoftware) continue;
    if (kind_[k] == Kind::kDeclared) {
      half_width = AddUp(half_width, MulUp(ends, MulUp(error_, rate_bound_[k])));
      continue;
    }
    const Interval moved = Interval(error_) * rate[k];
    if (!moved.IsFinite()) return static_cast<int>(k);
    spread.column[k] = moved.Middle();
    const double unexpected =
        AddUp(std::max(std::abs(residual.lower[k]), std::abs(residual.upper[k])), disturbance_[k]);
    const double part = DivUp(MulUp(error_, unexpected), period_);
    half_width = AddUp(half_width, MulUp(ends, AddUp(moved.DistanceUpper(spread.column[k]), part)));
  }
  return -1;
}

void StepOffsets::SubtractFromLast(const OffsetSpread& spread, Zonotope& image, ImageSums& sums) noexcept {
  const std::size_t last = ToSize(image.num_generators() - 1);
  for (int k = 0; k < image.dim(); ++k) {
    const double d = spread.column[ToSize(k)];
    if (d == 0) continue;
    double& entry = image.mutable_row(k)[last];
    entry -= d;
    image.mutable_slack(k) = AddUp(image.slack(k), MulUp(2 * kUnitRoundoff, std::abs(entry)));
    Lanes sum = AllLanes(0);
    const std::span<const double> row = image.padded_row(k);
    for (std::size_t j = 0; j < row.size(); j += kLaneCount) sum += Abs(LoadLanes(&row[j]));
    sums.row[ToSize(k)] = Sum(sum);
  }
  ScoreColumns(image, sums.scores);
}

void StepOffsets::Append(const OffsetSpread& spread, Zonotope& next, double* half_width) noexcept {
  const int last = next.num_generators();
  next.Resize(last, last + 1);
  for (int k = 0; k < next.dim(); ++k) {
    const double d = spread.column[ToSize(k)];
    next.mutable_row(k)[last] = d;
    half_width[k] = AddUp(half_width[k], std::abs(d));
  }
}

}  // namespace forereach
