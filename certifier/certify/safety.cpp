#include "certifier/certify/safety.h"

#include <algorithm>
#include <array>

#include "certifier/numerics/size.h"

namespace forereach {
namespace {

Hull Shifted(Hull hull, const std::array<Interval, kMaxSafetyDim>& shift, int dim) noexcept {
  for (std::size_t k = 0; k < ToSize(dim); ++k) {
    const Interval center = Interval(hull.center[k]) - shift[k];
    hull.center[k] = center.Middle();
    hull.half_width[k] = AddUp(hull.half_width[k], center.DistanceUpper(hull.center[k]));
  }
  return hull;
}

// The closest approach found so far.
struct Closest {
  double clearance = kInfinity;
  int step = -1, obstacle = -1, part = -1;
  Separation separation{kInfinity, 0};

  void Consider(const PartSeparation& found, int t, int o) noexcept {
    Consider(found, found.separation.clearance(), t, o);
  }
  void Consider(const PartSeparation& found, double its_clearance, int t, int o) noexcept {
    if (its_clearance < clearance) *this = {its_clearance, t, o, found.part, found.separation};
  }
};

Decision Judged(Outcome outcome, const Closest& closest) {
  Decision decision;
  decision.outcome = outcome;
  decision.obstacle = closest.obstacle;
  decision.part = closest.part;
  decision.closest_step = closest.step;
  decision.margin = closest.separation.distance;
  decision.threshold = closest.separation.threshold;
  if (outcome == Outcome::kSafety) {
    decision.cause = Cause::kObstacle;
    decision.step = closest.step;
  }
  return decision;
}

bool IsBetter(const Separation& a, const Separation& b) noexcept {
  return a.threshold == b.threshold ? a.distance > b.distance : a.clearance() > b.clearance();
}

// A bound for the whole body is one for its closest part.
PartSeparation Better(const PartSeparation& by_parts, const PartSeparation& other) noexcept {
  if (IsBetter(by_parts.separation, other.separation)) return by_parts;
  return {other.separation, other.part < 0 ? by_parts.part : other.part};
}

}  // namespace

// What is known of a tube in one unit. The places are enclosed when they are first needed, once for each sample: those
// of sample t are kept in the half t % 2 of the scratch memory.
class SafetyTest::Unit {
 public:
  Unit(const SafetyTest& test, const Schedule& schedule, const Tube& tube, std::span<Zonotope> places) noexcept
      : test_(test), schedule_(schedule), tube_(tube), places_(places) {}

  void Enter(int t) noexcept {
    hulls_[0] = t == last_ && t != first_ ? hulls_[1] : HullAt(t);
    first_ = t;
    last_ = t + (placement().sweeps() ? 1 : 0);
    hull_ = hulls_[0];
    if (last_ == first_) return;
    hulls_[1] = HullAt(last_);
    hull_ = Join(hulls_[0], hulls_[1], placement().dim());
  }

  // By the interval hulls of the frame and a ball around the body: sound, not tight.
  [[nodiscard]] PartSeparation ByHulls(const Obstacle& obstacle, const Encounter& meeting) const noexcept {
    const Hull& seen = meeting.moves ? Seen(hulls_[0], hulls_[1], meeting) : hull_;
    return {SeparateHulls(seen, obstacle, AddUp(meeting.growth, placement().reach())), -1};
  }

  // By the interval hulls of the parts, or as given if that is better.
  [[nodiscard]] PartSeparation ByParts(const PartSeparation& by_hulls, const Obstacle& obstacle,
                                       const Encounter& meeting) noexcept {
    if (placement().is_point()) return by_hulls;
    const auto& first = PartsAt(first_);
    const auto& last = first_ == last_ ? first : PartsAt(last_);
    const auto separate = [&](std::size_t i, double added) {
      return SeparateHulls(Seen(first[i], last[i], meeting), obstacle, added);
    };
    return Better(ClosestPart(meeting, separate), by_hulls);
  }

  // The better of the bound by hulls and that of the best directions.
  [[nodiscard]] PartSeparation Best(const PartSeparation& by_hulls, const Obstacle& obstacle,
                                    const Encounter& meeting) noexcept {
    const auto separate = [&](std::size_t i, double added) { return SeparatePart(i, obstacle, added, meeting); };
    return Better(ClosestPart(meeting, separate), by_hulls);
  }

  [[nodiscard]] Encounter MeetIn(const Obstacle& obstacle) const noexcept {
    return obstacle.motion() ? Meet(*obstacle.motion(), schedule_, first_, last_) : Encounter{};
  }

 private:
  [[nodiscard]] const Placement& placement() const { return test_.placement_; }

  // The least of separate(part, what its distance has to exceed the obstacle's radius by).
  template <class Separate>
  [[nodiscard]] PartSeparation ClosestPart(const Encounter& meeting, Separate separate) const noexcept {
    PartSeparation closest{{kInfinity, 0}, -1};
    const auto parts = placement().parts();
    for (std::size_t i = 0; i < parts.size(); ++i) {
      const Separation found = separate(i, AddUp(parts[i].radius, meeting.growth));
      if (i == 0 || IsBetter(closest.separation, found)) closest = {found, static_cast<int>(i)};
    }
    return closest;
  }

  [[nodiscard]] Hull HullAt(int t) const noexcept {
    return placement().EncloseHull(tube_.slice(t), tube_.half_width(t));
  }

  // The hull of both samples, seen from the obstacle.
  [[nodiscard]] Hull Seen(const Hull& first, const Hull& last, const Encounter& meeting) const noexcept {
    const int p = placement().dim();
    if (!meeting.moves) return first_ == last_ ? first : Join(first, last, p);
    const Hull seen = Shifted(first, meeting.shift[0], p);
    return first_ == last_ ? seen : Join(seen, Shifted(last, meeting.shift[1], p), p);
  }

  [[nodiscard]] const std::array<Hull, kMaxBodyParts>& PartsAt(int t) noexcept {
    const std::size_t half = ToSize(t % 2);
    if (parts_of_[half] != t)
      placement().EncloseParts(tube_.slice(t), tube_.half_width(t), parts_[half].data(), test_.instructions_);
    parts_of_[half] = t;
    return parts_[half];
  }

  [[nodiscard]] const Zonotope* PlacesAt(int t) noexcept {
    const std::size_t half = ToSize(t % 2);
    Zonotope* places = places_.data() + half * ToSize(placement().num_points());
    if (sample_[half] != t) placement().Enclose(tube_.slice(t), tube_.half_width(t), places, test_.instructions_);
    sample_[half] = t;
    return places;
  }

  [[nodiscard]] Separation SeparatePart(std::size_t number, const Obstacle& obstacle, double added,
                                        const Encounter& meeting) noexcept {
    const Placement::Part& part = placement().parts()[number];
    std::array<Piece, kMaxPieces> pieces;
    std::size_t count = 0;
    for (int t = first_; t <= last_; ++t) {
      const Zonotope* places = PlacesAt(t);
      for (int i = part.first; i < part.first + part.count; ++i)
        pieces[count++] = {&places[i], placement().turn(i), meeting.shift[ToSize(t - first_)]};
    }
    return forereach::Separate({pieces.data(), count}, obstacle, added, test_.instructions_);
  }

  const SafetyTest& test_;
  const Schedule& schedule_;
  const Tube& tube_;
  std::span<Zonotope> places_;
  std::array<int, 2> sample_{-1, -1}, parts_of_{-1, -1};
  std::array<std::array<Hull, kMaxBodyParts>, 2> parts_;
  int first_ = -1, last_ = -1;
  std::array<Hull, 2> hulls_;
  Hull hull_;
};

SafetyTest::SafetyTest(const Problem& problem)
    : placement_(problem.projection, problem.body, problem.between, problem.model->num_states()),
      instructions_(problem.instructions) {}

PartSeparation SafetyTest::Separate(const Tube& tube, int t, const Obstacle& obstacle, const Schedule& schedule) const {
  std::vector<Zonotope> places(2 * ToSize(placement_.num_points()));
  Unit unit(*this, schedule, tube, places);
  unit.Enter(t);
  const Encounter meeting = unit.MeetIn(obstacle);
  if (!meeting.is_there) return {{kInfinity, 0}, -1};
  return unit.Best(unit.ByParts(unit.ByHulls(obstacle, meeting), obstacle, meeting), obstacle, meeting);
}

// Interval hulls settle what is far away. What they do not prove, and then what they leave as possibly closest, is
// settled by the best direction.
Decision SafetyTest::Judge(std::span<const Obstacle> obstacles, const Schedule& schedule, Tube& tube,
                           int first) const noexcept {
  Closest by_hull, closest;
  double next_by_hull = kInfinity;  // the second smallest clearance by hulls
  Unit unit(*this, schedule, tube, tube.places_);
  const int count = static_cast<int>(obstacles.size()), units = NumUnits(tube);
  for (int t = first; t < units; ++t) {
    unit.Enter(t);
    for (int o = 0; o < count; ++o) {
      const Obstacle& obstacle = obstacles[ToSize(o)];
      const Encounter meeting = unit.MeetIn(obstacle);
      if (!meeting.is_there) continue;
      PartSeparation by_hulls = unit.ByHulls(obstacle, meeting);
      if (!by_hulls.separation.IsProven()) by_hulls = unit.ByParts(by_hulls, obstacle, meeting);
      if (by_hulls.separation.IsProven()) {
        const double clearance = by_hulls.separation.clearance();
        next_by_hull = std::min(next_by_hull, std::max(clearance, by_hull.clearance));
        by_hull.Consider(by_hulls, clearance, t, o);
        continue;
      }
      const PartSeparation best = unit.Best(by_hulls, obstacle, meeting);
      if (!best.separation.IsProven())
        return Judged(Outcome::kSafety, {best.separation.clearance(), t, o, best.part, best.separation});
      closest.Consider(best, t, o);
    }
  }
  if (by_hull.clearance < closest.clearance) {
    const Obstacle& obstacle = obstacles[ToSize(by_hull.obstacle)];
    unit.Enter(by_hull.step);
    closest.Consider(unit.Best({by_hull.separation, by_hull.part}, obstacle, unit.MeetIn(obstacle)), by_hull.step,
                     by_hull.obstacle);
  }
  for (int t = first; t < units && next_by_hull < closest.clearance; ++t) {
    unit.Enter(t);
    for (int o = 0; o < count; ++o) {
      const Obstacle& obstacle = obstacles[ToSize(o)];
      const Encounter meeting = unit.MeetIn(obstacle);
      if (!meeting.is_there || (t == closest.step && o == closest.obstacle)) continue;
      const auto is_farther = [&](const PartSeparation& found) {
        return found.separation.clearance() >= closest.clearance;
      };
      PartSeparation by_hulls = unit.ByHulls(obstacle, meeting);
      if (is_farther(by_hulls)) continue;
      by_hulls = unit.ByParts(by_hulls, obstacle, meeting);
      if (by_hulls.separation.IsProven() && !is_farther(by_hulls))
        closest.Consider(unit.Best(by_hulls, obstacle, meeting), t, o);
    }
  }
  return Judged(Outcome::kCertified, closest);
}

}  // namespace forereach
