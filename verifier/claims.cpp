#include "verifier/claims.h"

#include <algorithm>
#include <cmath>

#include "verifier/separation.h"

namespace forereach::verifier {
namespace {

std::size_t Index(Eigen::Index k) { return static_cast<std::size_t>(k); }

// Collects claims a <= b and keeps the first that fails.
class Claims {
 public:
  Claims(int step, std::optional<Failure>& failure) : step_(step), failure_(failure) {}

  /** `found` has to be at most (with least = true: at least) `bound`. A NaN bounds nothing. */
  void AtMost(const std::string& what, const Real& found, const Real& bound) {
    Judge(IsAtMost(found, bound), what, found, bound);
  }
  void AtLeast(const std::string& what, const Real& found, const Real& bound) {
    Judge(IsAtMost(bound, found), what, found, bound);
  }
  void Judge(Answer answer, const std::string& what, const Real& found, const Real& bound) {
    if (failure_ || answer == Answer::kYes) return;
    failure_ = Failure{step_, what, found.text(), bound.text(), answer == Answer::kNo};
    const Real scale = max(abs(found), abs(bound)), excess = abs(found - bound);
    if (scale.IsFinite() && !scale.IsZero()) failure_->excess = (excess / scale).ToDouble();
  }
  /** The same, with the size that a deviation is to be seen against. */
  void JudgeAgainst(Answer answer, const std::string& what, const Real& found, const Real& bound, const Real& scale) {
    const bool first = !failure_;
    Judge(answer, what, found, bound);
    if (first && failure_ && !scale.IsZero()) failure_->excess = (abs(found - bound) / scale).ToDouble();
  }

 private:
  int step_;
  std::optional<Failure>& failure_;
};

class SliceCheck {
 public:
  SliceCheck(const Problem& problem, const Certificate& certificate, const Tube& tube, int t)
      : problem_(problem), certificate_(certificate), slice_(tube.slices[Index(t)]),
        step_(t < static_cast<int>(tube.steps.size()) ? &tube.steps[Index(t)] : nullptr),
        recorded_(certificate.slices.empty() ? nothing_ : certificate.slices[Index(t)]), claims_(t, failure_) {}

  [[nodiscard]] std::optional<Failure> Run() {
    for (int k = 0; k < slice_.dim() && !failure_; ++k) CheckHull(k);
    for (int k = 0; step_ && k < slice_.dim() && !failure_; ++k) CheckStep(k);
    if (!failure_) CheckSafety();
    return failure_;
  }

 private:
  [[nodiscard]] const std::string& name(int k) const { return problem_.model->state_names()[Index(k)]; }

  void Contains(const std::string& what, int k, const Real& lower, const Real& upper) {
    const Real &c = slice_.center[Index(k)], r = slice_.HalfWidth(k), scale = abs(c) + r;
    claims_.JudgeAgainst(IsAtMost(lower, c - r), what + " contains " + name(k) + " of the slice", lower, c - r, scale);
    claims_.JudgeAgainst(IsAtMost(c + r, upper), what + " contains " + name(k) + " of the slice", upper, c + r, scale);
  }

  void CheckHull(int k) {
    if (recorded_.lower.size() > 0) Contains("the recorded hull", k, recorded_.lower[k], recorded_.upper[k]);
    if (recorded_.center.size() == 0) return;
    const Real center(recorded_.center[k]), half_width(recorded_.half_width[k]);
    Contains("the recorded hull", k, center - half_width, center + half_width);
    if (!recorded_.has_generators) return;
    Real sum;
    for (const double g : recorded_.generators.row(k)) sum += Real(std::abs(g));
    claims_.AtMost("the recorded generators stay in the recorded hull in " + name(k), sum, half_width);
    Contains("the hull of the recorded generators", k, center - sum, center + sum);
  }

  void CheckStep(int k) {
    const auto i = Index(k);
    if (recorded_.envelope_lower.size() > 0) {
      const auto& [lower, upper] = step_->envelope[i];
      const std::string what = "the recorded envelope contains the residual of " + name(k);
      claims_.AtMost(what, recorded_.envelope_lower[k], lower);
      claims_.AtLeast(what, recorded_.envelope_upper[k], upper);
    }
    if (recorded_.remainder.size() > 0) {
      const auto& [lower, upper] = step_->remainder[i];
      claims_.AtLeast("the recorded remainder covers that of " + name(k), recorded_.remainder[k], Real(0.5) * (upper - lower));
    }
  }

  void CheckSafety() {
    const ProjectedSlice projected(slice_, problem_.projection);
    if (recorded_.radius)
      claims_.AtLeast("the recorded radius covers the projected slice", *recorded_.radius, projected.Radius());
    for (std::size_t o = 0; o < certificate_.obstacles.size(); ++o) {
      const double claimed = o < recorded_.clearance.size() ? recorded_.clearance[o] : 0;
      const std::string obstacle = "obstacle " + std::to_string(o);
      if (!(claimed >= 0) || (claimed == 0 && !recorded_.clearance.empty()))
        claims_.Judge(Answer::kNo, "the record claims to be clear of " + obstacle, claimed, 0.0);
      if (failure_) return;
      Real best;
      const Answer answer = IsClear(projected, certificate_.obstacles[o], claimed, best);
      claims_.Judge(answer, "the slice keeps clear of " + obstacle + (claimed > 0 ? " by what is recorded" : ""), best, claimed);
    }
  }

  inline static const RecordedSlice nothing_{};
  const Problem& problem_;
  const Certificate& certificate_;
  const Slice& slice_;
  const Step* step_;
  const RecordedSlice& recorded_;
  std::optional<Failure> failure_;
  Claims claims_;
};

}  // namespace

std::optional<Failure> FindFalseClaim(const Problem& problem, const Certificate& certificate, const Tube& tube) {
  for (int t = 0; t < static_cast<int>(tube.slices.size()); ++t)
    if (auto failure = SliceCheck(problem, certificate, tube, t).Run()) return failure;
  return std::nullopt;
}

}  // namespace forereach::verifier
