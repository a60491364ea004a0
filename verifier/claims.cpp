#include "verifier/claims.h"

#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "forereach/dynamics/models/named_models.h"
#include "forereach/numerics/size.h"
#include "verifier/containment.h"
#include "verifier/separation.h"

namespace forereach::verifier {
namespace {

// Keeps the first claim that fails. Builds the description of that claim only.
class Claims {
 public:
  Claims(int step, std::optional<Failure>& failure) : step_(step), failure_(failure) {}

  /** Claims that `found` is at most (at least) `bound`. `what` makes the name of the quantity. The claim fails for a
  NaN. Deviations are measured relative to `scale`. */
  template <class What>
  void AtMost(const Real& found, const Real& bound, const Real& scale, What what) {
    Judge(IsAtMost(found, bound), found, bound, scale, "at most", what);
  }
  template <class What>
  void AtLeast(const Real& found, const Real& bound, const Real& scale, What what) {
    Judge(IsAtMost(bound, found), found, bound, scale, "at least", what);
  }
  template <class What>
  void Judge(Answer answer, const Real& found, const Real& bound, const Real& scale, const char* relation, What what) {
    if (failure_ || answer == Answer::kYes) return;
    const std::string held_to = std::string(relation) + ' ' + bound.text();
    failure_ = Failure{step_, what(), found.text(), held_to, answer == Answer::kNo};
    if (const Real excess = abs(found - bound); excess.IsFinite() && !scale.IsZero())
      failure_->excess = (excess / scale).ToDouble();
  }

 private:
  int step_;
  std::optional<Failure>& failure_;
};

class SliceCheck {
 public:
  SliceCheck(const Problem& problem, const Certificate& certificate, const TaskFunctions& functions, const Tube& tube,
             int t, std::optional<Frame>& frame)
      : problem_(problem),
        functions_(functions),
        certificate_(certificate),
        t_(t),
        slice_(tube.slices[ToSize(t)]),
        next_(t + 1 < static_cast<int>(tube.slices.size()) ? &tube.slices[ToSize(t + 1)] : nullptr),
        step_(t < static_cast<int>(tube.steps.size()) ? &tube.steps[ToSize(t)] : nullptr),
        recorded_(certificate.slices.empty() ? nothing_ : certificate.slices[ToSize(t)]),
        frame_(frame),
        claims_(t, failure_) {}

  [[nodiscard]] std::optional<Failure> Run() {
    for (int k = 0; k < slice_.dim() && !failure_; ++k) CheckHull(k);
    if (!failure_ && recorded_.has_generators) CheckGenerators();
    for (int k = 0; step_ && k < slice_.dim() && !failure_; ++k) CheckStep(k);
    if (step_ && !failure_) CheckRates();
    if (!step_ && !certificate_.is_remainder) CheckRest();
    if (!failure_) CheckRadius();
    if (!failure_ && t_ >= certificate_.first_step) CheckLimits();
    if (!failure_ && t_ >= certificate_.first_step) CheckSafety();
    return failure_;
  }

 private:
  [[nodiscard]] const std::string& name(int k) const { return problem_.model->state_names()[ToSize(k)]; }

  void CheckHull(int k) {
    const Real &c = slice_.center[ToSize(k)], r = slice_.HalfWidth(k), lower = c - r, upper = c + r, scale = abs(c) + r;
    const auto contains = [&](const char* which, const Real& below, const Real& above) {
      const auto what = [&] { return std::string(which) + " contains " + name(k) + " of the slice"; };
      claims_.AtMost(below, lower, scale, what);
      claims_.AtLeast(above, upper, scale, what);
    };
    if (recorded_.lower.size() > 0) contains("the recorded hull", recorded_.lower[k], recorded_.upper[k]);
    if (recorded_.center.size() == 0) return;
    const Real center(recorded_.center[k]), half_width(recorded_.half_width[k]);
    contains("the recorded hull", center - half_width, center + half_width);
    if (!recorded_.has_generators) return;
    Real sum;
    for (const double g : recorded_.generators.row(k))
      if (g != 0) sum += Real(std::abs(g));
    claims_.AtMost(sum, half_width, half_width,
                   [&] { return "the recorded generators stay in the recorded hull in " + name(k); });
    contains("the hull of the recorded generators", center - sum, center + sum);
  }

  void CheckGenerators() {
    const Containment inside = IsInside(slice_, recorded_.center, recorded_.generators);
    if (inside.answer == Answer::kYes) return;
    const int k = inside.coordinate;
    claims_.Judge(inside.answer, inside.found, inside.bound, inside.scale, "at most", [&] {
      return k < 0 ? "the set that the recorded generators span contains the slice"
                   : "the set that the recorded generators span contains the slice, by " + name(k) +
                         " of what differs from them";
    });
  }

  void CheckStep(int k) {
    const auto i = ToSize(k);
    if (recorded_.envelope_lower.size() > 0) {
      const auto& [lower, upper] = step_->envelope[i];
      const Real scale = abs(lower) + abs(upper);
      const auto what = [&] { return "the recorded envelope contains the residual of " + name(k); };
      claims_.AtMost(recorded_.envelope_lower[k], lower, scale, what);
      claims_.AtLeast(recorded_.envelope_upper[k], upper, scale, what);
      claims_.AtMost(recorded_.envelope_lower[k], recorded_.envelope_upper[k], scale,
                     [&] { return "the recorded envelope of " + name(k) + " is not empty"; });
    }
    if (recorded_.remainder.size() > 0) {
      const auto& [lower, upper] = step_->remainder[i];
      const Real half = Real(0.5) * (upper - lower);
      claims_.AtLeast(recorded_.remainder[k], half, half,
                      [&] { return "the recorded remainder covers that of " + name(k); });
    }
  }

  // The recorded range of coordinate k; nothing if no hull is recorded.
  static std::optional<std::pair<Real, Real>> HullOf(const RecordedSlice& recorded, int k) {
    if (recorded.lower.size() > 0) return std::pair(Real(recorded.lower[k]), Real(recorded.upper[k]));
    if (recorded.center.size() == 0) return std::nullopt;
    const Real center(recorded.center[k]), half_width(recorded.half_width[k]);
    return std::pair(center - half_width, center + half_width);
  }

  // Some motion within the declared rates leads from a state of this slice to one of the next.
  void CheckRates() {
    const int heading = problem_.body.heading;
    if (problem_.between && heading >= 0)
      CheckChange(heading, Real(problem_.between->turn_rate) * Real(problem_.between->period));
    const StepTiming& timing = problem_.timing;
    const Real longest = Real(StepOf(*problem_.model)) + Real(2.0) * Real(timing.error);
    for (int k = 0; k < timing.rate_bound.size(); ++k)
      if (std::isfinite(timing.rate_bound[k])) CheckChange(k, Real(timing.rate_bound[k]) * longest);
  }

  // The recorded hulls are compared, as the certifier does: the derived slices may be narrower.
  void CheckChange(int state, const Real& most) {
    if (certificate_.slices.empty()) return;
    const auto here = HullOf(recorded_, state), next = HullOf(certificate_.slices[ToSize(t_ + 1)], state);
    if (!here || !next) return;
    const Real lower = next->first - here->second, upper = next->second - here->first;
    const auto least = [&](const Real& turns) { return max(lower - turns, turns - upper); };
    Real change = least(0.0);
    if (problem_.model->IsAngle(state)) {
      const Real whole = Real(2.0) * Real::Pi();
      if (!CertainlyAtMost(upper, whole) || !CertainlyAtMost(-whole, lower)) return;
      change = min(change, min(least(whole), least(-whole)));
    }
    // The certifier rounds its hulls outward, the change down and the bound up. This is above what that takes.
    const Real rounding = Real(0x1p-40) * (most + here->first.magnitude() + here->second.magnitude() +
                                           next->first.magnitude() + next->second.magnitude());
    claims_.AtMost(change, most + rounding, most, [&] {
      return "the least change of " + name(state) + " from the slice to the next is one that its declared rate allows";
    });
  }

  // The last slice: both the derived and the recorded one are at rest.
  void CheckRest() {
    for (const RestBound& bound : problem_.rest) {
      if (failure_) return;
      const int k = bound.coordinate;
      const Real most(bound.tolerance), &c = slice_.center[ToSize(k)], r = slice_.HalfWidth(k);
      const auto stands = [&](const char* which, const Real& lower, const Real& upper) {
        const auto what = [&] { return "the plan ends standing: " + name(k) + " of " + which; };
        claims_.AtMost(upper, most, most, what);
        claims_.AtLeast(lower, -most, most, what);
      };
      stands("the last slice", c - r, c + r);
      if (recorded_.lower.size() > 0) stands("the last recorded hull", recorded_.lower[k], recorded_.upper[k]);
      if (recorded_.center.size() > 0)
        stands("the last recorded slice", Real(recorded_.center[k]) - Real(recorded_.half_width[k]),
               Real(recorded_.center[k]) + Real(recorded_.half_width[k]));
    }
  }

  void CheckRadius() {
    if (!recorded_.radius) return;
    const Real radius = ProjectedSlice(slice_, problem_.projection).Radius();
    claims_.AtLeast(*recorded_.radius, radius, radius,
                    [] { return std::string("the recorded radius covers the projected slice"); });
  }

  // One that uses an input is not claimed where none is applied. It is false only if some state of the slice exceeds
  // it.
  void CheckLimits() {
    if (problem_.limits.empty()) return;
    std::vector<Real> input(ToSize(problem_.model->num_inputs()));
    for (std::size_t l = 0; step_ && l < input.size(); ++l) {
      const auto i = static_cast<Eigen::Index>(l);
      const Real planned(certificate_.controls(i, t_)),
          error(problem_.declaration.VariableError(slice_.dim() + static_cast<int>(l)));
      input[l] = Real::FromTo(planned - error, planned + error);
    }
    const std::vector<Enclosed> functions = functions_.limits.Over(slice_, input);
    for (std::size_t i = 0; i < functions.size() && !failure_; ++i) {
      if (!step_ && functions_.limits.UsesInput(i)) continue;
      const Limit& limit = problem_.limits[i];
      const Bounds reached = RangeOver(slice_, functions[i]);
      const auto what = [&] { return "the slice keeps the limit " + limit.name; };
      for (const double sign : {1.0, -1.0}) {
        const double bound = sign > 0 ? limit.at_most : limit.at_least;
        if (!std::isfinite(bound) || failure_) continue;
        const Real& found = sign > 0 ? reached.upper : reached.lower;
        Answer answer = sign > 0 ? IsAtMost(found, bound) : IsAtMost(bound, found);
        if (answer != Answer::kYes) {
          const Real somewhere = functions_.limits.At(Farthest(functions[i], sign, input))[i];
          answer = (sign > 0 ? CertainlyBelow(bound, somewhere) : CertainlyBelow(somewhere, bound)) ? Answer::kNo
                                                                                                    : Answer::kUnknown;
        }
        claims_.Judge(answer, found, bound, abs(found) + Real(std::abs(bound)), sign > 0 ? "at most" : "at least",
                      what);
      }
    }
  }

  // z = (x, u) for a state of the slice that lies far along the function's slope, or against it.
  [[nodiscard]] std::vector<Real> Farthest(const Enclosed& function, double sign,
                                           const std::vector<Real>& input) const {
    std::vector<Real> z = slice_.center;
    for (const std::vector<Real>& column : slice_.columns) {
      Real along;
      for (std::size_t l = 0; l < column.size(); ++l) along += function.slope[l].middle() * column[l];
      const bool is_against = CertainlyBelow((sign > 0 ? along : -along).middle(), 0.0);
      for (std::size_t l = 0; l < column.size(); ++l) z[l] = is_against ? z[l] - column[l] : z[l] + column[l];
    }
    z.insert(z.end(), input.begin(), input.end());
    return z;
  }

  // At this sample, or from this sample to the next; the last sample then belongs to the step before.
  void CheckSafety() {
    if (problem_.between && !next_) return;
    if (!frame_) frame_.emplace(problem_, slice_);
    std::optional<Frame> next;
    if (problem_.between) next.emplace(problem_, *next_);
    const bool is_swept = next.has_value();
    std::vector<std::vector<Sweep>> sweeps;
    for (std::size_t p = 0; p < problem_.body.parts.size(); ++p)
      sweeps.push_back(
          SweepsOf(problem_, problem_.body.parts[p], *frame_, next ? &*next : nullptr, &functions_.places[p]));
    frame_ = std::move(next);
    for (const StayIn& area : certificate_.stay_in)
      for (std::size_t p = 0; p < sweeps.size() && !failure_; ++p) CheckStaysIn(area, sweeps[p], p);
    for (std::size_t o = 0; o < certificate_.obstacles.size() && !failure_; ++o) {
      const std::string name = NameOf(certificate_.obstacles, static_cast<int>(o));
      const double claimed = o < recorded_.clearance.size() ? recorded_.clearance[o] : 0;
      if (!recorded_.clearance.empty() && !(claimed > 0))
        claims_.Judge(Answer::kNo, claimed, 0.0, 1.0, "above",
                      [&] { return "the record claims to be clear of " + name; });
      const Obstacle& obstacle = certificate_.obstacles[o];
      const Passage passage = PassageOf(obstacle, certificate_.schedule, t_, is_swept ? t_ + 1 : t_);
      if (!passage.is_there) continue;
      for (std::size_t p = 0; p < sweeps.size() && !failure_; ++p) {
        Real best;
        const Answer answer = IsClear(sweeps[p], obstacle, claimed, best, passage);
        claims_.Judge(
            answer, best, claimed, abs(best) + Real(obstacle.radius()), claimed > 0 ? "at least" : "above", [&] {
              return std::string(is_swept ? "the motion to the next sample" : "the slice") + " keeps clear of " + name +
                     (sweeps.size() > 1 ? " with part " + std::to_string(p) : "") +
                     (claimed > 0 ? " by what is recorded" : "");
            });
      }
    }
  }

  void CheckStaysIn(const StayIn& area, const std::vector<Sweep>& sweeps, std::size_t part) {
    Real best;
    const Answer answer = IsWithin(sweeps, area.rings, best);
    claims_.Judge(answer, best, 0.0, abs(best), "above",
                  [&] { return "part " + std::to_string(part) + " of the body stays in " + area.name; });
  }

  inline static const RecordedSlice nothing_{};
  const Problem& problem_;
  const TaskFunctions& functions_;
  const Certificate& certificate_;
  const int t_;
  const Slice& slice_;
  const Slice* next_;
  const Step* step_;
  const RecordedSlice& recorded_;
  std::optional<Frame>& frame_;  // of this slice, if the step before made it; then that of the next
  std::optional<Failure> failure_;
  Claims claims_;
};

}  // namespace

std::optional<Failure> FindFalseClaim(const Problem& problem, const Certificate& certificate,
                                      const TaskFunctions& functions, const Tube& tube) {
  std::optional<Frame> frame;
  for (int t = 0; t < static_cast<int>(tube.slices.size()); ++t)
    if (auto failure = SliceCheck(problem, certificate, functions, tube, t, frame).Run()) return failure;
  return std::nullopt;
}

}  // namespace forereach::verifier
