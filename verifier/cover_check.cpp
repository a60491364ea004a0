#include "verifier/cover_check.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "forereach/numerics/size.h"

namespace forereach::verifier {
namespace {

constexpr int kCoverBits = 128;  // the width of a box, not rounding, decides how tight its bound is
// A leaf's bound may take finer boxes here than it took there: at most so many halvings.
constexpr int kMostCuts = 24;

using Ranges = std::vector<Real>;

Real Width(const Real& range) { return range.upper() - range.lower(); }

std::string Text(const Real& x) { return x.text(); }
std::string Text(double x) {
  std::array<char, 32> text;
  return {text.data(), std::to_chars(text.data(), text.data() + text.size(), x).ptr};
}

// One claim's derivative, its domain and its arguments w = (z, theta).
class ClaimCheck {
 public:
  ClaimCheck(const Domain& domain, const Slopes& slopes, const SlopeClaim& claim, const Ranges& whole)
      : domain_(domain), slopes_(slopes), claim_(claim), whole_(whole) {}

  [[nodiscard]] CoverVerdict Walk(const std::function<void()>& checked) const {
    std::vector<std::pair<int, Ranges>> open{{0, whole_}};
    while (!open.empty()) {
      const auto [index, box] = std::move(open.back());
      open.pop_back();
      const Cover::Node& node = claim_.cover.nodes[ToSize(index)];
      if (node.argument >= 0) {
        if (const std::string fault = FaultOf(node, index, box); !fault.empty()) return {Answer::kNo, fault};
        const auto argument = ToSize(node.argument);
        const Real at(node.number);
        open.emplace_back(node.below, box).second[argument] = Real::FromTo(box[argument].lower(), at);
        open.emplace_back(node.above, box).second[argument] = Real::FromTo(at, box[argument].upper());
      } else {
        const CoverVerdict verdict = Leaf(node, box);
        if (verdict.answer != Answer::kYes) return verdict;
        if (checked) checked();
      }
    }
    return {};
  }

 private:
  [[nodiscard]] std::string FaultOf(const Cover::Node& node, int index, const Ranges& box) const {
    const int size = static_cast<int>(claim_.cover.nodes.size());
    if (node.argument >= static_cast<int>(box.size())) return "a cut across an argument that there is not";
    const auto is_part = [&](int part) { return index < part && part < size; };
    if (!is_part(node.below) || !is_part(node.above)) return "a part of the domain is missing";
    const Real& range = box[ToSize(node.argument)];
    if (!std::isfinite(node.number) || !CertainlyAtMost(range.lower(), node.number) ||
        !CertainlyAtMost(node.number, range.upper()))
      return "a cut at " + Text(node.number) + ", outside of its box from " + Text(range.lower()) + " to " +
             Text(range.upper());
    return {};
  }

  [[nodiscard]] CoverVerdict Leaf(const Cover::Node& node, const Ranges& box) const {
    if (node.outside) {
      if (LiesOutside(box)) return {};
      return {Answer::kNo, "a box said to lie outside the domain was not shown to"};
    }
    if (!(node.number <= claim_.bound))
      return {Answer::kNo, "a box has the bound " + Text(node.number) + ", above the declared " + Text(claim_.bound)};
    return Holds(node.number, box, kMostCuts);
  }

  // Whether |slope| <= bound over the box. If one evaluation does not decide, the box is cut further.
  [[nodiscard]] CoverVerdict Holds(double bound, const Ranges& box, int cuts) const {
    if (LiesOutside(box)) return {};
    Trial trial{-1, box};
    const Slope slope = SlopeOver(box, true);
    if (IsAtMostOver(box, slope, bound, 1, trial) && IsAtMostOver(box, slope, bound, -1, trial)) return {};
    for (const Ranges& near : {trial.point, box})
      if (const auto witness = CounterExample(bound, near)) return *witness;
    if (cuts == 0 || trial.cut < 0) return {Answer::kUnknown, "a box's bound " + Text(bound) + " could not be shown"};
    const auto argument = ToSize(trial.cut);
    const Real middle = box[argument].middle();
    Ranges half = box;
    half[argument] = Real::FromTo(box[argument].lower(), middle);
    if (const CoverVerdict verdict = Holds(bound, half, cuts - 1); verdict.answer != Answer::kYes) return verdict;
    half[argument] = Real::FromTo(middle, box[argument].upper());
    return Holds(bound, half, cuts - 1);
  }

  // What was learnt where a bound could not be shown: the argument that cost most, and a point where the slope is
  // large.
  struct Trial {
    int cut;
    Ranges point;
  };

  // Whether sign * slope <= bound over the box, by its range, or after the arguments in which it is monotone have moved
  // to where it is largest, or expanded around a point of the others. @param slope over the box.
  [[nodiscard]] bool IsAtMostOver(const Ranges& box, Slope slope, double bound, double sign, Trial& trial) const {
    Ranges rest = box;
    while (true) {
      if (CertainlyAtMost(Real(sign) * slope.value, bound)) return true;
      bool moved = false;
      for (std::size_t i = 0; i < rest.size(); ++i) {
        if (IsPoint(rest[i]) || i >= slope.gradient.size() || slope.gradient[i].IsZero()) continue;
        const Real rise = Real(sign) * slope.gradient[i];
        const bool up = CertainlyAtMost(0.0, rise), down = CertainlyAtMost(rise, 0.0);
        if (!up && !down) continue;
        rest[i] = up ? rest[i].upper() : rest[i].lower();
        moved = true;
      }
      if (!moved) return ExpandsTo(rest, slope, bound, sign, trial);
      slope = SlopeOver(rest, true);
    }
  }

  [[nodiscard]] bool ExpandsTo(const Ranges& rest, const Slope& slope, double bound, double sign, Trial& trial) const {
    Ranges& point = trial.point = rest;
    Real excess(0.0), most(-1.0);
    bool is_finite = true;
    for (std::size_t i = 0; i < rest.size(); ++i) {
      if (IsPoint(rest[i])) continue;
      point[i] = rest[i].middle();
      if (i >= slope.gradient.size() || slope.gradient[i].IsZero()) continue;
      // Rises of at most up to the right and down to the left; the point where both cost the same costs least.
      const Real rise = Real(sign) * slope.gradient[i];
      const Real up = rise.upper(), down = (-rise).upper();
      if (!rise.IsFinite()) {  // a kink or a pole: the widest such argument is cut
        const Real share = Width(rest[i]) / Width(whole_[i]);
        if (is_finite || CertainlyBelow(most, share)) trial.cut = static_cast<int>(i), most = share;
        is_finite = false;
        continue;
      }
      point[i] = (rest[i].lower() + Width(rest[i]) * (up / (up + down))).middle();
      if (!CertainlyAtMost(rest[i].lower(), point[i]) || !CertainlyAtMost(point[i], rest[i].upper()))
        point[i] = rest[i].middle();
      const Real cost = max(up * (rest[i].upper() - point[i]), down * (point[i] - rest[i].lower())).upper();
      excess += cost;
      if (!is_finite || (trial.cut >= 0 && !CertainlyBelow(most, cost))) continue;
      trial.cut = static_cast<int>(i);
      most = cost;
    }
    return is_finite && CertainlyAtMost(Real(sign) * SlopeOver(point, false).value + excess, bound);
  }

  // The middle of a box, if it is in the domain and the slope there is above the bound.
  [[nodiscard]] std::optional<CoverVerdict> CounterExample(double bound, const Ranges& box) const {
    Ranges point = box;
    for (Real& w : point) w = w.middle();
    const Real size = abs(SlopeOver(point, false).value);
    if (!CertainlyBelow(bound, size) || !LiesInside(point)) return std::nullopt;
    return CoverVerdict{Answer::kNo,
                        "a box's bound is " + Text(bound) + ", but the slope is " + Text(size) + " at a point of it"};
  }

  [[nodiscard]] Slope SlopeOver(const Ranges& w, bool with_gradient) const {
    return slopes_.At(claim_.row, claim_.column, w, with_gradient);
  }

  // ---- The domain's inequalities and balls.

  [[nodiscard]] Real ValueOver(const Domain::Inequality& inequality, const Ranges& box) const {
    Real sum(0.0);
    for (Eigen::Index l = 0; l < inequality.coefficients.size(); ++l)
      sum += Real(inequality.coefficients[l]) * box[ToSize(l)];
    return sum;
  }
  [[nodiscard]] Real SquaredDistanceOver(const Domain::Ball& ball, const Ranges& box) const {
    Real sum(0.0);
    for (Eigen::Index i = 0; i < ball.center.size(); ++i)
      sum += sqr(box[ToSize(ball.coordinates[ToSize(i)])] - Real(ball.center[i]));
    return sum;
  }

  [[nodiscard]] bool LiesOutside(const Ranges& box) const {
    return std::ranges::any_of(domain_.inequalities,
                               [&](const auto& i) { return CertainlyBelow(i.bound, ValueOver(i, box)); }) ||
           std::ranges::any_of(domain_.balls, [&](const auto& ball) {
             return CertainlyBelow(sqr(Real(ball.radius)), SquaredDistanceOver(ball, box));
           });
  }
  [[nodiscard]] bool LiesInside(const Ranges& point) const {
    return std::ranges::all_of(domain_.inequalities,
                               [&](const auto& i) { return CertainlyAtMost(ValueOver(i, point), i.bound); }) &&
           std::ranges::all_of(domain_.balls, [&](const auto& ball) {
             return CertainlyAtMost(SquaredDistanceOver(ball, point), sqr(Real(ball.radius)));
           });
  }

  const Domain& domain_;
  const Slopes& slopes_;
  const SlopeClaim& claim_;
  const Ranges& whole_;
};

}  // namespace

CoverChecker::CoverChecker(const Domain& domain, const ParametricResidual& residual)
    : domain_(domain), residual_(residual), slopes_(residual) {}

CoverVerdict CoverChecker::Check(const SlopeClaim& claim, const std::function<void()>& checked) const {
  const auto known = Entries();
  if (std::ranges::count(known, std::pair(claim.row, claim.column)) == 0)
    return {Answer::kNo, "a claim on a derivative that is zero"};
  if (!std::isfinite(claim.bound)) return {Answer::kNo, "the declared bound is not finite"};
  if (claim.cover.nodes.empty()) return {Answer::kNo, "a part of the domain is missing"};
  const Precision precision(kCoverBits);
  Ranges whole;
  for (const Box* part : {&domain_.state, &domain_.input})
    for (Eigen::Index l = 0; l < part->dim(); ++l) whole.push_back(Real::FromTo(part->lower()[l], part->upper()[l]));
  for (const auto& [name, lower, upper] : residual_.names.parameters) whole.push_back(Real::FromTo(lower, upper));
  return ClaimCheck(domain_, slopes_, claim, whole).Walk(checked);
}

}  // namespace forereach::verifier
