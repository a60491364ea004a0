#include "forereach/certify/pieces.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <utility>

#include "forereach/numerics/size.h"

namespace forereach {
namespace {

// A box around `sides`, rounded outward.
void SetBox(std::span<const Interval> sides, Zonotope& set) noexcept {
  const int n = static_cast<int>(sides.size());
  ArraysOf(set).Reset(n, 0);
  for (int k = 0; k < n; ++k) {
    ArraysOf(set).mutable_center(k) = sides[ToSize(k)].Middle();
    ArraysOf(set).mutable_slack(k) = 0;
  }
  for (int k = 0; k < n; ++k) ArraysOf(set).AppendAxis(k, sides[ToSize(k)].DistanceUpper(set.center(k)));
}

double Width(const Interval& side) { return side.upper - side.lower; }

// Both parts are closed and have the middle, so they cover the set.
template <class Part>
std::pair<Part, Part> Halved(const Part& part, std::size_t k) {
  std::pair<Part, Part> halves{part, part};
  halves.first.box[k].upper = halves.second.box[k].lower = part.box[k].Middle();
  ++halves.first.halvings[k], ++halves.second.halvings[k];
  return halves;
}

double Clearance(const Decision& decision) { return decision.margin - decision.threshold; }

}  // namespace

Decision Pieces::Try(const Call& call, const Part& part) noexcept {
  // Out of time is no certificate.
  if (!call.goes_on()) return {};
  ++trials_;
  SetBox({part.box.data(), ToSize(dim_)}, set_);
  const Decision decision = call.certifier.Certify(call.plan, set_, call.obstacles, tube_);
  // A plan that is judged again while it is driven has passed the steps before `first`: what touches there is past.
  if (decision.outcome != Outcome::kSafety || decision.step >= call.first) return decision;
  return call.certifier.JudgeSafety(call.plan, call.obstacles, tube_, call.first);
}

// By the coordinates that the failed test depends on: an obstacle's by the places of the body alone.
bool Pieces::Rank(const Call& call, const Part& all, const Decision& whole, const Tube& tube) noexcept {
  const Problem& problem = call.certifier.problem();
  const int t = std::min(whole.step + (problem.between ? 1 : 0), tube.length());
  const auto counts = [&](int j) {
    const bool has_places = std::ranges::any_of(problem.body.parts, [](const auto& p) { return !p.places.empty(); });
    return whole.cause != Cause::kObstacle || has_places || j == problem.body.heading ||
           !problem.projection.col(j).isZero(0);
  };
  gain_ = {};
  for (std::size_t k = 0; k < ToSize(dim_); ++k) {
    if (!(Width(all.box[k]) > 0)) continue;
    States both;
    bool is_complete = true;
    const auto [lower, upper] = Halved(all, k);
    for (const Part* half : {&lower, &upper}) {
      if (Try(call, *half).outcome == Outcome::kNone) return false;
      is_complete = is_complete && tube_.length() >= t;
      for (int j = 0; j < dim_ && is_complete; ++j)
        both[ToSize(j)] = half == &lower ? tube_.hull(t, j) : Join(both[ToSize(j)], tube_.hull(t, j));
    }
    for (int j = 0; j < dim_ && is_complete; ++j)
      if (const double before = Width(tube.hull(t, j)); counts(j) && before > 0)
        gain_[k] += std::max(0.0, 1 - Width(both[ToSize(j)]) / before);
  }
  return std::ranges::any_of(gain_, [](double gain) { return gain > 0; });
}

// Whether a small part fails from its middle alone. Smaller parts around it then fail, too, but for rounding.
bool Pieces::IsHopeless(const Call& call, Part part) noexcept {
  constexpr int kLarge = 3;
  if (std::accumulate(part.halvings.begin(), part.halvings.end(), 0) < kLarge) return false;
  for (Interval& side : part.box) side = side.Middle();
  return Try(call, part).outcome != Outcome::kCertified;
}

void Pieces::Widen(int steps) noexcept {
  const bool is_first = cuts_.empty() || std::ranges::none_of(cuts_, [](const PieceCut& cut) { return cut.state < 0; });
  for (int t = 1; t <= steps; ++t)
    for (int k = 0; k < dim_; ++k) {
      Interval& hull = hulls_[ToSize(t)][ToSize(k)];
      // What is attested is the hull of the pieces' slices: x_t lies in one of them (soundness 3.21).
      hull = is_first ? tube_.hull(t, k) : Join(hull, tube_.hull(t, k));
    }
}

Decision Pieces::Certify(const Certifier& certifier, const Plan& plan, const Zonotope& initial_set,
                         const ObstacleView& obstacles, const Decision& whole, int most,
                         const std::function<bool()>& goes_on, Tube& tube, int first) noexcept {
  const Call call{certifier, plan, obstacles, first, goes_on};
  dim_ = initial_set.dim();
  trials_ = 0;
  cuts_.clear();
  Part all;
  for (int k = 0; k < dim_; ++k) all.box[ToSize(k)] = initial_set.Hull(k);
  if (whole.outcome != Outcome::kSafety || !Rank(call, all, whole, tube)) return {};

  Decision closest;
  std::size_t count = 1, waiting = 1;
  waiting_[0] = all;
  while (waiting > 0) {
    const Part part = waiting_[--waiting];
    const bool is_whole = count == 1;  // known to fail
    const Decision decision = is_whole ? whole : Try(call, part);
    if (decision.outcome == Outcome::kCertified) {
      Widen(plan.num_steps);
      cuts_.push_back({});
      const bool capped = closest.capped || decision.capped;
      if (closest.outcome == Outcome::kNone || Clearance(decision) < Clearance(closest)) closest = decision;
      closest.capped = capped;
      continue;
    }
    const auto gain = [&](std::size_t k) { return std::ldexp(gain_[k], -part.halvings[k]); };
    std::size_t best = 0;
    for (std::size_t k = 1; k < ToSize(dim_); ++k)
      if (gain(k) > gain(best)) best = k;
    const double at = part.box[best].Middle();
    // Neighbouring doubles have no double between them: cutting on would not end.
    const bool can_halve = part.box[best].lower < at && at < part.box[best].upper;
    if (decision.outcome != Outcome::kSafety || ++count > ToSize(most) || !can_halve) return {};
    if (IsHopeless(call, part)) return {};
    cuts_.push_back({static_cast<int>(best), at});
    const auto [lower, upper] = Halved(part, best);
    waiting_[waiting++] = upper;
    waiting_[waiting++] = lower;
  }

  tube.length_ = plan.num_steps;
  for (std::size_t t = 1; t <= ToSize(plan.num_steps); ++t) {
    SetBox({hulls_[t].data(), ToSize(dim_)}, tube.slices_[t]);
    Propagator::HalfWidths(tube.slices_[t], tube.steps_[t].half_width.data());
  }
  return closest;
}

Decision CertifyInPieces(const Certifier& certifier, const Plan& plan, const Zonotope& initial_set,
                         const ObstacleView& obstacles, int most, Tube& tube) {
  const Decision whole = certifier.Certify(plan, initial_set, obstacles, tube);
  if (whole.outcome != Outcome::kSafety || most < 2) return whole;
  const Decision in_pieces = std::make_unique<Pieces>()->Certify(
      certifier, plan, initial_set, obstacles, whole, most, [] { return true; }, tube);
  return in_pieces.outcome == Outcome::kCertified ? in_pieces : whole;
}

}  // namespace forereach
