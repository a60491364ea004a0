#include "verifier/rate_check.h"

#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "forereach/numerics/size.h"
#include "verifier/equations.h"

namespace forereach::verifier {
namespace {

using Ranges = std::vector<Real>;  // of z

// The argument without whose width the range of f_k is narrowest; box.size() if all are points.
std::size_t ArgumentThatMatters(const Equations& equations, int k, const Ranges& box) {
  std::size_t best = box.size();
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < box.size(); ++i) {
    if (IsPoint(box[i])) continue;
    Ranges without = box;
    without[i] = box[i].middle();
    const Real rate = equations.Flow(without)[ToSize(k)];
    const double width = rate.IsFinite() ? (rate.upper() - rate.lower()).ToDouble() : least;
    if (best == box.size() || width < least) best = i, least = width;
  }
  return best;
}

// Whether f_k lies between two numbers all over a box.
Answer LiesWithin(const Equations& equations, int k, const Real& least, const Real& most, const Ranges& whole,
                  int most_boxes) {
  std::vector<Ranges> open{whole};
  for (int boxes = 0; !open.empty(); ++boxes) {
    if (boxes == most_boxes) return Answer::kUnknown;
    Ranges box = std::move(open.back());
    open.pop_back();
    const Real rate = equations.Flow(box)[ToSize(k)];
    if (CertainlyAtMost(least, rate) && CertainlyAtMost(rate, most)) continue;
    Ranges point;
    for (const Real& range : box) point.push_back(range.middle());
    const Real there = equations.Flow(point)[ToSize(k)];
    if (there.IsFinite() && (CertainlyBelow(there, least) || CertainlyBelow(most, there))) return Answer::kNo;
    const std::size_t cut = ArgumentThatMatters(equations, k, box);
    if (cut == box.size()) return Answer::kUnknown;
    const Real middle = box[cut].middle();
    open.push_back(box);
    open.back()[cut] = Real::FromTo(middle, box[cut].upper());
    box[cut] = Real::FromTo(box[cut].lower(), middle);
    open.push_back(std::move(box));
  }
  return Answer::kYes;
}

}  // namespace

RateVerdict CheckRates(const NominalModel& model, const Domain& domain, double period, const Box& reachable,
                       std::span<const RateClaim> claims, int most_boxes) {
  const Precision precision(128);
  const std::unique_ptr<Equations> equations = EquationsOf(model);
  const auto [first, last] = domain.Corners();
  if (!equations || ToSize(reachable.dim()) != first.size()) return {Answer::kUnknown, 0};
  Ranges within;
  for (int i = 0; i < reachable.dim(); ++i) {
    if (!(reachable.lower()[i] <= first[ToSize(i)] && last[ToSize(i)] <= reachable.upper()[i]))
      return {Answer::kUnknown, 0};
    within.push_back(Real::FromTo(reachable.lower()[i], reachable.upper()[i]));
  }
  for (int k = 0; k < model.num_states(); ++k) {
    const Real least = (Real(reachable.lower()[k]) - Real(first[ToSize(k)])) / Real(period),
               most = (Real(reachable.upper()[k]) - Real(last[ToSize(k)])) / Real(period);
    if (LiesWithin(*equations, k, least.upper(), most.lower(), within, most_boxes) != Answer::kYes)
      return {Answer::kUnknown, k};
    for (const RateClaim& claim : claims) {
      if (claim.state != k) continue;
      const Answer answer = LiesWithin(*equations, k, -Real(claim.bound), Real(claim.bound), within, most_boxes);
      if (answer != Answer::kYes) return {answer, k};
    }
  }
  return {};
}

}  // namespace forereach::verifier
