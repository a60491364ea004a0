#include "forereach/certify/safety.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <functional>
#include <span>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "forereach/certify/tube.h"
#include "forereach/dynamics/angles.h"
#include "forereach/dynamics/evaluate.h"
#include "forereach/dynamics/text_program.h"
#include "forereach/numerics/instruction_set.h"
#include "forereach/numerics/lanes.h"
#include "forereach/numerics/size.h"
#include "forereach/safety/obstacle_index.h"
#include "forereach/safety/occupancy_grid.h"
#include "forereach/safety/standing_cores.h"

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

// The hulls at both samples of a unit, which are one object if it has one sample, seen from an obstacle that moves.
Hull Seen(const Hull& first, const Hull& last, const Encounter& meeting, int dim) noexcept {
  const Hull at_first = Shifted(first, meeting.shift[0], dim);
  return &first == &last ? at_first : Join(at_first, Shifted(last, meeting.shift[1], dim), dim);
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
    if (Yields(its_clearance, t, o)) *this = {its_clearance, t, o, found.part, found.separation};
  }
  // To what is closer, or as close and comes before.
  [[nodiscard]] bool Yields(double its_clearance, int t, int o) const noexcept {
    return its_clearance < clearance || (its_clearance == clearance && std::tie(t, o) < std::tie(step, obstacle));
  }
};

// A unit and an obstacle that are proven to be apart.
struct Pair {
  PartSeparation bound;
  Separation boxed;  // by a box around the body; not proven if the hulls do
  double clearance;
  int step, obstacle;
  bool is_direct;  // by the best of what is cheaper than a search

  [[nodiscard]] bool IsProven() const noexcept { return bound.separation.IsProven() || boxed.IsProven(); }
  void Improve(const PartSeparation& found) noexcept {
    bound = found;
    clearance = std::max(found.separation.clearance(), boxed.clearance());
    is_direct = true;
  }
};

// The pairs of least clearance, as many as there is room for.
class Nearest {
 public:
  void Add(const Separation& found, int part, int t, int o, bool is_direct, const Separation& boxed = {}) noexcept {
    const double clearance = std::max(found.clearance(), boxed.clearance());
    if (count_ == pairs_.size()) {
      left_out_ = std::min(left_out_, std::max(pairs_[farthest_].clearance, clearance));
      if (!(clearance < pairs_[farthest_].clearance)) return;
    }
    Pair* pair = &pairs_[count_ == pairs_.size() ? farthest_ : count_++];
    // Member by member: a load that spans several stores waits for all of them.
    pair->bound.separation = found;
    pair->bound.part = part;
    pair->boxed = boxed;
    pair->clearance = clearance;
    pair->step = t;
    pair->obstacle = o;
    pair->is_direct = is_direct;
    if (count_ == pairs_.size())
      farthest_ = ToSize(std::ranges::max_element(pairs_, {}, &Pair::clearance) - pairs_.begin());
  }

  /** The first of those with the least clearance; null if there is none. */
  [[nodiscard]] Pair* Least() noexcept {
    Pair* least = count_ > 0 ? pairs_.data() : nullptr;
    for (Pair& pair : pairs()) {
      if (pair.clearance > least->clearance) continue;
      if (pair.clearance < least->clearance ||
          std::tie(pair.step, pair.obstacle) < std::tie(least->step, least->obstacle))
        least = &pair;
    }
    return least;
  }
  /** The least clearance for which there was no room. */
  [[nodiscard]] double left_out() const { return left_out_; }
  /** Keeps what is no further than `clearance`, but not `other`: by step, then by obstacle. */
  [[nodiscard]] std::span<Pair> InOrder(double clearance, const Pair* other) noexcept {
    std::size_t kept = 0;
    for (const Pair& pair : pairs())
      if (pair.clearance <= clearance && &pair != other) pairs_[kept++] = pair;
    count_ = kept;
    std::ranges::sort(pairs(), [](const Pair& a, const Pair& b) {
      return std::tie(a.step, a.obstacle) < std::tie(b.step, b.obstacle);
    });
    return pairs();
  }

 private:
  [[nodiscard]] std::span<Pair> pairs() noexcept { return {pairs_.data(), count_}; }

  std::array<Pair, 12> pairs_;
  std::size_t count_ = 0, farthest_ = 0;  // the latter once all are in use
  double left_out_ = kInfinity;
};

Decision Judged(Outcome outcome, const Closest& closest, const ConvexNumbers& numbers) {
  Decision decision;
  decision.outcome = outcome;
  if (closest.obstacle >= 0) {
    const ConvexNumbers::Place place = numbers.PlaceOf(closest.obstacle);
    decision.obstacle = place.obstacle;
    decision.block = place.block;
  }
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

// With one threshold the distances are compared: clearances are rounded and may tie.
bool IsBetter(const Separation& a, const Separation& b) noexcept {
  return a.threshold == b.threshold ? a.distance > b.distance : a.clearance() > b.clearance();
}

// The larger number, or NaN if there is one: NaN proves nothing and may not get lost.
double Larger(double a, double b) noexcept { return b <= a ? a : std::isnan(a) ? a : b; }

Eigen::Vector3d Spatial(const Eigen::VectorXd& y) noexcept {
  Eigen::Vector3d spatial = Eigen::Vector3d::Zero();
  for (Eigen::Index k = 0; k < y.size(); ++k) spatial[k] = y[k];
  return spatial;
}

// The better of two bounds. One for the whole body is told of its closest part: by the same clearance, against the
// distance that this part has to keep. Without a part only where that would lose the proof by a last bit.
PartSeparation Better(const PartSeparation& by_parts, const PartSeparation& other, std::size_t parts) noexcept {
  if (IsBetter(by_parts.separation, other.separation)) return by_parts;
  if (other.part >= 0) return other;
  if (parts == 1) return {other.separation, by_parts.part};
  const double kept = by_parts.separation.threshold;
  const Separation of_part{AddDown(other.separation.clearance(), kept), kept};
  if (of_part.IsProven() != other.separation.IsProven()) return other;
  return {of_part, by_parts.part};
}

}  // namespace

// What is known of a tube in one unit. Samples are observed and places enclosed when they are first needed, once for
// each sample t, and kept in the half t % 2 of the memory.
class SafetyTest::Unit {
 public:
  Unit(const SafetyTest& test, const Schedule& schedule, const Tube& tube, std::span<Zonotope> places) noexcept
      : test_(test), schedule_(schedule), tube_(tube), places_(places) {}

  void Enter(int t) noexcept {
    first_ = t;
    last_ = t + (placement().sweeps() ? 1 : 0);
  }
  void EncloseHulls() noexcept {
    if (first_ == last_) return EncloseHull(first_, hull_);
    if (first_ == hulls_until_)
      hulls_[0] = hulls_[1];
    else
      EncloseHull(first_, hulls_[0]);
    EncloseHull(last_, hulls_[1]);
    hulls_until_ = last_;
    hull_ = Join(hulls_[0], hulls_[1], placement().dim());
  }

  // Of the frame, at all samples of the unit. @pre EncloseHulls.
  [[nodiscard]] const Hull& hull() const noexcept { return hull_; }
  // Likewise, at its first one and at its last one.
  [[nodiscard]] const Hull& first_hull() const noexcept { return first_ == last_ ? hull_ : hulls_[0]; }
  [[nodiscard]] const Hull& last_hull() const noexcept { return first_ == last_ ? hull_ : hulls_[1]; }

  // By the interval hulls of the frame and a ball around the body: sound, not tight. @pre EncloseHulls.
  [[nodiscard]] Separation ByHulls(const Obstacle& obstacle, const Encounter& meeting) const noexcept {
    const Hull& seen = meeting.moves ? Seen(first_hull(), last_hull(), meeting, placement().dim()) : hull_;
    return SeparateHulls(seen, obstacle, AddUp(meeting.growth, placement().reach()));
  }

  // A hull around all parts of the body, by their supports along the axes. @pre Enter.
  [[nodiscard]] Hull EncloseBody() noexcept {
    Hull hull{};
    for (int k = 0; k < placement().dim(); ++k) {
      const auto farthest = [&](double sign) {
        double support = -kInfinity;
        for (int t = first_; t <= last_; ++t)
          for (const Placement::Part& part : placement().parts()) {
            const Eigen::Vector3d axis = sign * Eigen::Vector3d::Unit(k);
            const double found = placement().SupportUpper(SampleAt(t), part, axis, test_.instructions_);
            support = Larger(support, AddUp(found, part.radius));
          }
        return support;
      };
      const double upper = farthest(1), lower = -farthest(-1);
      const bool is_finite = std::isfinite(lower) && std::isfinite(upper) && lower <= upper;
      const Interval range = is_finite ? Interval(lower, upper) : Interval::Entire();
      hull.center[ToSize(k)] = is_finite ? range.Middle() : 0;
      hull.half_width[ToSize(k)] = is_finite ? range.DistanceUpper(hull.center[ToSize(k)]) : kInfinity;
    }
    return hull;
  }

  // A box around the body, as EncloseBody's, is tighter than a ball around it, but says nothing new of a ball, nor of
  // what moves.
  template <class Body>
  [[nodiscard]] Separation ByBox(const Obstacle& obstacle, const Body& body) const noexcept {
    return placement().is_at_frame() || obstacle.motion() ? Separation{} : SeparateHulls(body(), obstacle);
  }

  // By one direction for each part, from its middle to the obstacle, or as given if that is better.
  [[nodiscard]] PartSeparation ByDirections(const PartSeparation& by_hulls, const Obstacle& obstacle,
                                            const Encounter& meeting) noexcept {
    if (placement().is_at_frame()) return by_hulls;
    return Better(ByDirections(obstacle, meeting), by_hulls, placement().parts().size());
  }
  // Without hulls, and wherever the body is.
  [[nodiscard]] PartSeparation ByDirections(const Obstacle& obstacle, const Encounter& meeting) noexcept {
    const auto separate = [&](std::size_t i, double added) {
      const Eigen::Vector3d d = Towards(obstacle, placement().parts()[i], meeting);
      double support = -kInfinity;
      for (int t = first_; t <= last_; ++t) support = Larger(support, Support(t, placement().parts()[i], d, meeting));
      return Separation{DistanceLower(obstacle, d, support), AddUp(obstacle.radius(), added)};
    };
    return ClosestPart(meeting, separate);
  }

  // The better of the bound by hulls and that of the best directions.
  // Above the clearance `enough` it need not be the best.
  [[nodiscard]] PartSeparation Best(const PartSeparation& by_hulls, const Obstacle& obstacle, const Encounter& meeting,
                                    double enough = kInfinity) noexcept {
    return Better(BestOfParts(obstacle, meeting, enough), by_hulls, placement().parts().size());
  }
  [[nodiscard]] PartSeparation BestOfParts(const Obstacle& obstacle, const Encounter& meeting, double enough) noexcept {
    const auto separate = [&](std::size_t i, double added) {
      return SeparatePart(i, obstacle, added, meeting, enough);
    };
    return ClosestPart(meeting, separate);
  }

  // How the obstacle meets the unit; the reference is valid until the next call.
  [[nodiscard]] const Encounter& MeetIn(const Obstacle& obstacle) noexcept {
    static constexpr Encounter kStands;
    return obstacle.motion() ? meeting_ = Meet(*obstacle.motion(), schedule_, first_, last_) : kStands;
  }

  // Of the body at sample t.
  void EnclosePose(int t, Placement::Pose& pose) noexcept {
    if (placement().has_expressions()) return placement().PoseOver(SampleAt(t), pose, test_.instructions_);
    placement().PoseOver(tube_.slice(t), tube_.half_width(t), pose, test_.instructions_);
  }

 private:
  [[nodiscard]] const Placement& placement() const { return test_.placement_; }

  // The least of separate(part, what its distance has to exceed the obstacle's radius by).
  template <class Separate>
  [[nodiscard]] PartSeparation ClosestPart(const Encounter& meeting, Separate separate) const noexcept {
    const auto parts = placement().parts();
    Separation closest = separate(0, AddUp(parts[0].radius, meeting.growth));
    int part = 0;
    for (std::size_t i = 1; i < parts.size(); ++i) {
      const Separation found = separate(i, AddUp(parts[i].radius, meeting.growth));
      if (!IsBetter(closest, found)) continue;
      closest = found;
      part = static_cast<int>(i);
    }
    return {closest, part};
  }

  void EncloseHull(int t, Hull& hull) noexcept {
    if (placement().has_expressions()) return placement().EncloseHull(SampleAt(t), hull);
    placement().EncloseHull(tube_.slice(t), tube_.half_width(t), hull);
  }

  [[nodiscard]] const Placement::Sample& SampleAt(int t) noexcept {
    const std::size_t half = ToSize(t % 2);
    if (observed_[half] != t) placement().Observe(tube_.slice(t), tube_.half_width(t), samples_[half]);
    observed_[half] = t;
    return samples_[half];
  }

  [[nodiscard]] const Zonotope* PlacesAt(int t) noexcept {
    const std::size_t half = ToSize(t % 2);
    Zonotope* places = places_.data() + half * ToSize(placement().num_points());
    if (placed_[half] != t) placement().Enclose(SampleAt(t), places, test_.instructions_);
    placed_[half] = t;
    return places;
  }

  // The gap between the boxes around the middles of a part's points and around the core; if they meet, from middle to
  // middle. Any direction proves something; this one most of what there is, if the slices are small.
  [[nodiscard]] Eigen::Vector3d Towards(const Obstacle& obstacle, const Placement::Part& part,
                                        const Encounter& meeting) noexcept {
    if (obstacle.kind() == Obstacle::Kind::kHalfSpace) return Spatial(obstacle.points()[0]);
    std::array<double, kMaxSafetyDim> lower, upper;
    lower.fill(kInfinity);
    upper.fill(-kInfinity);
    const auto p = ToSize(placement().dim());
    for (int t = first_; t <= last_; ++t) {
      const Placement::Sample& sample = SampleAt(t);
      for (int i = part.first; i < part.first + part.count; ++i)
        for (std::size_t k = 0; k < p; ++k) {
          const double middle = placement().middle(sample, i, k) - meeting.shift[ToSize(t - first_)][k].lower;
          lower[k] = std::min(lower[k], middle);
          upper[k] = std::max(upper[k], middle);
        }
    }
    Eigen::Vector3d gap = Eigen::Vector3d::Zero();
    const auto set = [&](auto size) {
      bool meets = true;
      for (std::size_t k = 0; k < p; ++k) {
        const auto i = static_cast<Eigen::Index>(k);
        gap[i] = size(obstacle.lower()[i] - upper[k], obstacle.upper()[i] - lower[k]);
        meets &= gap[i] == 0;
      }
      return !meets;
    };
    if (!set([](double below, double above) { return std::max(below, 0.0) + std::min(above, 0.0); }))
      set(std::plus<>());
    return gap;
  }

  // The support of a part at one sample along d, seen from the obstacle.
  [[nodiscard]] double Support(int t, const Placement::Part& part, const Eigen::Vector3d& d,
                               const Encounter& meeting) noexcept {
    const double support = placement().SupportUpper(SampleAt(t), part, d, test_.instructions_);
    if (!meeting.moves) return support;
    Interval shifted(0);
    for (int k = 0; k < placement().dim(); ++k)
      shifted += Interval(d[k]) * meeting.shift[ToSize(t - first_)][ToSize(k)];
    return SubUp(support, shifted.lower);
  }

  [[nodiscard]] Separation SeparatePart(std::size_t number, const Obstacle& obstacle, double added,
                                        const Encounter& meeting, double enough) noexcept {
    const Placement::Part& part = placement().parts()[number];
    auto* const pieces = FOREREACH_ON_STACK(Piece, 2 * part.count);
    std::size_t count = 0;
    for (int t = first_; t <= last_; ++t) {
      const Zonotope* places = PlacesAt(t);
      for (int i = part.first; i < part.first + part.count; ++i)
        pieces[count++] = {&places[i], placement().turn(i), meeting.shift[ToSize(t - first_)]};
    }
    return forereach::Separate({pieces, count}, obstacle, added, test_.instructions_, enough);
  }

  const SafetyTest& test_;
  const Schedule& schedule_;
  const Tube& tube_;
  std::span<Zonotope> places_;
  std::array<int, 2> observed_{-1, -1}, placed_{-1, -1};
  std::array<Placement::Sample, 2> samples_;
  int first_ = -1, last_ = -1, hulls_until_ = -1;
  std::array<Hull, 2> hulls_{};  // at both samples, where there are two
  Hull hull_;                    // of both
  Encounter meeting_;
};

Placement PlacementOf(const Problem& problem) {
  const NominalModel& model = *problem.model;
  if (!model.angles().empty() && problem.body.HasPlaces()) {
    const std::vector<ExpressionText> all = problem.body.Coordinates();
    const ProgramDraft program = MakeProgram(NamesOf(model), all);
    for (std::size_t i = 0; i < all.size(); ++i)
      RequireSameAfterTurns(program.View(), static_cast<int>(i), all[i], "body: the place " + all[i].text,
                            model.angles(), model.state_names());
  }
  return {problem.projection, problem.body, problem.between, problem.model->num_states(),
          problem.body.HasPlaces() ? NamesOf(*problem.model) : ExpressionNames{}};
}

SafetyTest::SafetyTest(const Problem& problem)
    : placement_(PlacementOf(problem)), instructions_(problem.instructions) {}

int SafetyTest::NumUnits(const Tube& tube) const { return tube.length() + (placement_.sweeps() ? 0 : 1); }

PartSeparation SafetyTest::Separate(const Tube& tube, int t, const Obstacle& obstacle, const Schedule& schedule) const {
  std::vector<Zonotope> places(2 * ToSize(placement_.num_points()));
  Unit unit(*this, schedule, tube, places);
  unit.Enter(t);
  unit.EncloseHulls();
  const Encounter& meeting = unit.MeetIn(obstacle);
  if (!meeting.is_there) return {{kInfinity, 0}, -1};
  const auto separate = [&](const Obstacle& convex) {
    const PartSeparation by_hulls{unit.ByHulls(convex, meeting), -1};
    const PartSeparation best = unit.Best(unit.ByDirections(by_hulls, convex, meeting), convex, meeting);
    if (best.separation.IsProven()) return best;
    const Separation boxed = unit.ByBox(convex, [&] { return unit.EncloseBody(); });  // as a judgement
    return boxed.IsProven() ? PartSeparation{boxed, -1} : best;
  };
  if (!obstacle.grid()) return separate(obstacle);
  PartSeparation closest{{kInfinity, 0}, -1};
  static_cast<void>(obstacle.grid()->LeastDistance(unit.hull(), [&](const Obstacle& block) {
    const PartSeparation found = separate(block);
    if (!IsBetter(found.separation, closest.separation)) closest = found;
    return AddUp(found.separation.clearance(), placement_.reach());  // no block further from the hull is nearer
  }));
  return closest;
}

// Interval hulls settle what is far away, and single directions what is near. What they do not prove, and then what
// they leave as possibly closest, is settled by the best direction. Any of these bounds proves a pair apart
// (docs/soundness.md, 3.9); the order saves time, and the last pass finds the closest pair for the report. The outcome
// does not depend on the order in which pairs are seen; of pairs as close as searches are exact an index may tell
// others.
class SafetyTest::Judgement {
 public:
  Judgement(const SafetyTest& test, const ObstacleView& obstacles, const Schedule& schedule, Tube& tube, int first,
            const Decision& before) noexcept
      : test_(test),
        obstacles_(obstacles),
        first_(first),
        units_(test.NumUnits(tube)),
        tube_(tube),
        schedule_(schedule),
        numbers_(obstacles.index() == nullptr ? ConvexNumbers(obstacles.all()) : obstacles.index()->numbers()),
        touched_(units_),
        unit_(test, schedule, tube, tube.places_) {
    if (before.obstacle >= 0)
      closest_.Consider({{before.margin, before.threshold}, before.part}, before.closest_step,
                        numbers_.NumberOf({before.obstacle, before.block}));
  }

  [[nodiscard]] Decision Run() noexcept {
    if (first_ < units_) {
      obstacles_.index() == nullptr ? SeeAll() : SeeNear(*obstacles_.index());
      if (touched_ < units_) {
        const Separation& touch = touch_.separation;
        return Judged(Outcome::kSafety, {touch.clearance(), touched_, touched_obstacle_, touch_.part, touch}, numbers_);
      }
      FindClosest();
    }
    return Judged(Outcome::kCertified, closest_, numbers_);
  }

 private:
  [[nodiscard]] bool is_at_frame() const { return test_.placement_.is_at_frame(); }
  // By its number.
  [[nodiscard]] const Obstacle& obstacle(int o) const { return numbers_.Find(obstacles_.all(), o); }
  // Whether an earlier pair may touch, so that this one does not count.
  [[nodiscard]] bool IsAfterTouch(int t, int o) const noexcept {
    return std::tie(touched_, touched_obstacle_) < std::tie(t, o);
  }

  void SeeAll() noexcept {
    if (is_at_frame()) {
      EncloseHulls();
      const auto units = std::span(hulls_).first(ToSize(units_ - first_));
      cores_.Take(obstacles_.all(), test_.placement_.dim(), test_.placement_.reach(),
                  bounds_.size() / units.size() / kLaneCount * kLaneCount);
      cores_.Bound(units, bounds_.data(), test_.instructions_);
    }
    for (int t = first_; t < units_ && touched_ == units_; ++t) {
      std::span<double> cores(BoundsOf(t), cores_.size());
      const bool all_proven = std::ranges::find(cores, -kInfinity) == cores.end();
      if (all_proven && std::ssize(cores) == numbers_.size()) continue;
      unit_.Enter(t);
      unit_.EncloseHulls();
      for (int o = all_proven ? static_cast<int>(cores.size()) : 0; o < numbers_.size() && touched_ == units_; ++o) {
        if (o < std::ssize(cores)) {
          if (cores[ToSize(o)] > -kInfinity) continue;
          cores[ToSize(o)] = kInfinity;  // seen now, and not again
        }
        See(t, o);
      }
    }
  }
  // Of the cores in unit t.
  [[nodiscard]] double* BoundsOf(int t) noexcept { return bounds_.data() + ToSize(t - first_) * cores_.stride(); }

  void EncloseHulls() noexcept {
    if (has_boxes()) {
      for (int t = first_; t < units_; ++t) hulls_[ToSize(t - first_)] = HullOfPoses(t);
      return;
    }
    for (int t = first_; t < units_; ++t) {
      unit_.Enter(t);
      unit_.EncloseHulls();
      hulls_[ToSize(t - first_)] = unit_.hull();
      poses_[ToSize(t - first_)].frame = unit_.first_hull();
    }
    poses_[ToSize(units_ - 1 + span() - first_)].frame = unit_.last_hull();
  }
  // As Unit::hull. @pre EncloseBodies.
  [[nodiscard]] Hull HullOfPoses(int t) const noexcept {
    const std::size_t i = ToSize(t - first_);
    return span() == 0 ? poses_[i].frame : Join(poses_[i].frame, poses_[i + 1].frame, test_.placement_.dim());
  }

  // What has no end in each unit; the others where the index finds them near.
  void SeeNear(const ObstacleIndex& index) noexcept {
    if (has_boxes()) EncloseBodies();
    if (!has_boxes() || index.has_moving() || !index.everywhere().empty()) EncloseHulls();
    MeasureHulls();
    Dispatch<&Judgement::FindNearest>(test_.instructions_, *this, index);
    SeeNear(index, first_, units_);
    if (index.has_moving()) SeeMoving(index);
    if (!index.everywhere().empty()) SeeEverywhere(index);
  }

  // First what is nearest by its hull, then what is not further than that turns out to be.
  void SeeMoving(const ObstacleIndex& index) noexcept {
    struct {
      int t = -1, o = -1;
      Separation by_hulls;
      double clearance = kInfinity;
    } nearest;
    const auto find_nearest = [&](int t, int o) {
      const Encounter& meeting = MeetIn(t, o);
      if (!meeting.is_there) return;
      const Separation found = ByHulls(t, o, meeting);
      if (const double clearance = found.clearance(); !(clearance >= nearest.clearance))
        nearest = {t, o, found, clearance};
    };
    if (touched_ == units_)
      ForEachNearMoving(
          index, [&] { return std::min(nearest.clearance, closest_.clearance); }, find_nearest);
    if (nearest.o >= 0) {
      See(nearest.t, nearest.o, nearest.by_hulls);
      ConsiderLeast();
    }
    ForEachNearMoving(
        index, [&] { return touched_ < units_ ? 0 : closest_.clearance; },
        [&](int t, int o) {
          if (t != nearest.t || o != nearest.o) SeeByHulls(t, o);
        });
  }
  template <class Within, class Visit>
  void ForEachNearMoving(const ObstacleIndex& index, const Within& within, const Visit& visit) noexcept {
    const int units = std::min(touched_ + 1, units_) - first_;  // what comes after a touch does not count
    tree_.Build(std::span(hulls_).first(ToSize(units)), test_.placement_.dim());
    index.ForEachNearMoving(tree_, {schedule_, first_, span()}, test_.placement_.reach(), within,
                            [&](int i, int o) { visit(first_ + i, o); });
  }
  const Encounter& MeetIn(int t, int o) noexcept {
    unit_.Enter(t);
    return unit_.MeetIn(obstacle(o));
  }
  // As Unit::ByHulls, of the hulls that are kept.
  [[nodiscard]] Separation ByHulls(int t, int o, const Encounter& meeting) const noexcept {
    if (!meeting.moves) return ByHulls(t, o);
    const std::size_t i = ToSize(t - first_);
    const Placement& placement = test_.placement_;
    const Hull seen = Seen(poses_[i].frame, poses_[i + ToSize(span())].frame, meeting, placement.dim());
    return SeparateHulls(seen, obstacle(o), AddUp(meeting.growth, placement.reach()));
  }
  void SeeByHulls(int t, int o) noexcept {
    if (const Encounter& meeting = MeetIn(t, o); meeting.is_there) See(t, o, ByHulls(t, o, meeting));
  }

  // What has no end: first what is nearest to the whole tube, then what is nearer than that turns out to be.
  void SeeEverywhere(const ObstacleIndex& index) noexcept {
    const auto all = index.everywhere();
    Hull tube = hulls_[0];
    for (int t = first_ + 1; t < units_; ++t) tube = Join(tube, hulls_[ToSize(t - first_)], test_.placement_.dim());
    const std::size_t count = std::min(all.size(), bounds_.size());
    for (std::size_t i = 0; i < count; ++i) bounds_[i] = ClearanceOfAll(tube, obstacle(all[i]));
    const auto see = [&](const auto& is_near) {
      for (int t = first_; t <= std::min(touched_, units_ - 1); ++t)
        for (std::size_t i = 0; i < all.size(); ++i)
          if (is_near(i)) SeeByHulls(t, all[i]);
    };
    const auto known = std::span(bounds_).first(count);
    const std::size_t nearest = ToSize(std::ranges::min_element(known) - known.begin());
    if (known[nearest] == kInfinity && all.size() == count) return;  // none is there
    see([&](std::size_t i) { return i == nearest; });
    ConsiderLeast();
    const double far = WithTolerance(index, closest_.clearance);
    see([&](std::size_t i) { return i != nearest && !IsFurther(i, far); });
  }
  // Of those that have no end, the i-th: in every unit.
  [[nodiscard]] bool IsFurther(std::size_t i, double distance) const noexcept {
    return i < bounds_.size() && bounds_[i] > distance;
  }

  // A lower bound on the clearance of an obstacle in all units; infinite if it is nowhere in that time.
  [[nodiscard]] double ClearanceOfAll(const Hull& tube, const Obstacle& other) const noexcept {
    const double reach = test_.placement_.reach();
    if (!other.motion()) return SeparateHulls(tube, other, reach).clearance();
    const Encounter meeting = Meet(*other.motion(), schedule_, first_, units_ - 1 + span());
    if (!meeting.is_there) return kInfinity;
    const int p = test_.placement_.dim();
    const Hull seen = Join(Shifted(tube, meeting.shift[0], p), Shifted(tube, meeting.shift[1], p), p);
    return SeparateHulls(seen, other, AddUp(meeting.growth, reach)).clearance();
  }

  void EncloseBodies() noexcept {
    const Placement& placement = test_.placement_;
    Hull after{};
    for (int t = units_ - 1 + span(); t >= first_; --t) {
      const std::size_t i = ToSize(t - first_);
      unit_.EnclosePose(t, poses_[i]);
      const Hull body = placement.EncloseBody(poses_[i], test_.instructions_);
      if (t < units_) bodies_[i] = span() == 0 ? body : AroundBoth(body, after);
      after = body;
    }
  }
  // In plain arithmetic: BoxTree and WithTolerance allow for its rounding. Infinite hulls have no center.
  [[nodiscard]] static Hull AroundBoth(const Hull& a, const Hull& b) noexcept {
    Hull both;
    for (std::size_t k = 0; k < kMaxSafetyDim; ++k) {
      const double lower = std::min(a.center[k] - a.half_width[k], b.center[k] - b.half_width[k]),
                   upper = std::max(a.center[k] + a.half_width[k], b.center[k] + b.half_width[k]);
      both.center[k] = 0.5 * (lower + upper);
      both.half_width[k] = 0.5 * (upper - lower);
    }
    return both;
  }

  // Without initializers: a list of many costs nothing until they are found.
  struct Near {
    int t, o;
    double gap;  // a lower bound on the distance, about; no NaN
    bool is_refined;
  };

  // What BoxTree asks about a unit. The outline is sketched when it is first needed.
  struct Outline;
  struct SideGaps {
    Judgement* judgement;
    int t;
    const Outline* outline = nullptr;

    FOREREACH_INLINE Lanes operator()(const BoxTree::Four& boxes) noexcept {
      if (outline == nullptr && judgement->has_sides_ && judgement->IsKnown(t)) outline = &judgement->SketchBody(t);
      return outline == nullptr ? AllLanes(-1) : judgement->GapAcrossSides(*outline, boxes);
    }
  };
  [[nodiscard]] SideGaps GapOf(int t) noexcept { return {this, t}; }

  // All pairs that may touch or be the closest, those that may touch in the order of time. If there are too many, fewer
  // units at once.
  void SeeNear(const ObstacleIndex& index, int from, int to) noexcept {
    std::array<Near, 256> near;
    const std::size_t count =
        Dispatch<&Judgement::Gather>(test_.instructions_, *this, index, from, to, std::span<Near>(near));
    if (count > near.size()) {
      const int middle = (from + to) / 2;
      SeeNear(index, from, middle);
      return touched_ == units_ ? SeeNear(index, middle, to) : void();
    }
    const auto found = std::span(near).first(count);
    for (Near& pair : found)
      if (!(pair.gap > WithTolerance(index, 0)) && !std::exchange(pair.is_refined, true)) Refine(pair, kInfinity);
    const auto others =
        std::partition(found.begin(), found.end(), [&](const Near& a) { return !(a.gap > WithTolerance(index, 0)); });
    std::sort(found.begin(), others,
              [](const Near& a, const Near& b) { return std::tie(a.t, a.o) < std::tie(b.t, b.o); });
    for (auto pair = found.begin(); pair != others; ++pair) {
      if (IsAfterTouch(pair->t, pair->o)) return;
      SettleNear(index, *pair);
    }
    if (touched_ < units_) return;
    // The nearest first: they leave few of the others, most of them not even refined.
    for (auto rest = found; !rest.empty();) {
      Near& nearest = *std::ranges::min_element(rest, {}, &Near::gap);
      if (nearest.gap > WithTolerance(index, farthest())) return;
      if (!std::exchange(nearest.is_refined, true)) {
        Refine(nearest, WithTolerance(index, farthest()));
        continue;
      }
      ConsiderOrSearch(index, nearest);
      std::swap(nearest, rest.front());
      rest = rest.subspan(1);
    }
  }
  // How many there are; more than there is room for: not all. Of a single unit those without room are dealt with.
  [[nodiscard]] static std::size_t Gather(Judgement& judgement, const ObstacleIndex& index, int from, int to,
                                          std::span<Near> near) noexcept {
    std::size_t count = 0;
    const double reach = judgement.has_boxes() ? 0 : judgement.test_.placement_.reach();
    const auto gather = [&](int t) {
      const bool is_refinable = judgement.IsRefinable(t);
      judgement.ForEachNear(
          index, t, [&] { return count > near.size() ? -kInfinity : judgement.farthest(); },
          [&](int o, double least) {
            if (count > near.size()) return;
            Near pair{t, o, least - reach, !is_refinable};
            if (t == judgement.approached_.t && o == judgement.approached_.o)
              pair = judgement.approached_;
            else if (pair.gap < judgement.nearest_gap_)
              judgement.Approach(pair);
            if (count < near.size())
              near[count++] = pair;
            else if (to - from > 1)
              ++count;
            else
              judgement.Judge(index, pair);
          });
    };
    for (int t = from; t < to && count <= near.size(); ++t) gather(t);
    return count;
  }
  // Bounds the distance of the closest pair by this one's.
  void Approach(Near& pair) noexcept {
    nearest_gap_ = pair.gap;
    if (!std::exchange(pair.is_refined, true))
      Refine(pair, farthest());
    else
      farthest_ = std::min(farthest_, DistanceUpper(pair.t, obstacle(pair.o)));
    approached_ = pair;
  }
  // A pair that is about as near as any, of each second unit: the next one is near it.
  static void FindNearest(Judgement& judgement, const ObstacleIndex& index) noexcept {
    double least = kInfinity;
    Near nearest{-1, -1, 0, true};
    for (int t = judgement.units_ - 1; t >= judgement.first_; t -= 2)
      if (const BoxTree::Found found = index.FindNear(judgement.hull(t), judgement.GapOf(t)); found.square < least) {
        least = found.square;
        nearest = {t, found.box, 0, !judgement.IsRefinable(t)};
      }
    if (nearest.o < 0) return;
    nearest.gap = std::sqrt(least) - (judgement.has_boxes() ? 0 : judgement.test_.placement_.reach());
    judgement.Approach(nearest);
  }
  [[gnu::noinline]] void Judge(const ObstacleIndex& index, const Near& pair) noexcept {
    SettleNear(index, pair);
    ConsiderOrSearch(index, pair);
  }
  // Of the search.
  [[nodiscard]] const Hull& hull(int t) const noexcept { return (has_boxes() ? bodies_ : hulls_)[ToSize(t - first_)]; }
  void MeasureHulls() noexcept {
    for (int t = first_; t < units_; ++t)
      if (const double size = BoxTree::SizeOf(hull(t), test_.placement_.dim()); !(size <= size_) && !std::isnan(size_))
        size_ = size;
  }

  // What is further is not the closest.
  [[nodiscard]] double farthest() const noexcept { return std::min(closest_.clearance, farthest_); }
  // How many samples a unit has besides its first one.
  [[nodiscard]] int span() const { return span_; }
  // Whether boxes around the body are searched; otherwise hulls of its places, with its reach.
  [[nodiscard]] bool has_boxes() const { return !is_at_frame(); }

  // More than a search for the best direction may lose of a distance.
  [[nodiscard]] double WithTolerance(const ObstacleIndex& index, double distance) const noexcept {
    constexpr double kSearchTolerance = 1e-5;
    constexpr double kRounding = 0x1p-40;
    return std::max(distance, 0.0) * (1 + kSearchTolerance) +
           kSearchTolerance * (index.size() + test_.placement_.reach()) + kRounding * size_;
  }

  // Calls visit(o, least) for a unit. Unless all of the body is at the frame, what is left out is further by more than
  // a search may lose.
  template <class Within, class Visit>
  void ForEachNear(const ObstacleIndex& index, int t, const Within& within, const Visit& visit) noexcept {
    index.ForEachNear(
        hull(t), has_boxes() ? 0 : test_.placement_.reach(),
        [&] { return is_at_frame() ? within() : WithTolerance(index, within()); }, visit, GapOf(t));
  }

  // The distance of some point of the body in the middle of a slice from some point of the obstacle, from above.
  [[nodiscard]] double DistanceUpper(int t, const Obstacle& other) const noexcept {
    const Placement& placement = test_.placement_;
    const bool is_box = other.kind() == Obstacle::Kind::kBox;
    const auto distance = [&](const std::array<double, kMaxSafetyDim>& y) {
      double square = 0;
      for (int k = 0; k < placement.dim(); ++k) {
        const double a = y[ToSize(k)], lower = other.lower()[k], upper = other.upper()[k];
        const double away = is_box ? std::max({lower - a, a - upper, 0.0}) : other.hull().front()[k] - a;
        square += away * away;
      }
      return std::sqrt(square);
    };
    const Placement::Pose& pose = poses_[ToSize(t - first_)];
    const auto point = [&](int i) {
      return std::array{pose.middle[0][ToSize(i)], pose.middle[1][ToSize(i)], pose.middle[2][ToSize(i)]};
    };
    const Eigen::Vector3d center = (other.lower() + other.upper()) / 2;
    double least = kInfinity;
    if (!has_boxes()) {
      if (is_at_frame()) least = distance(pose.frame.center) - placement.parts().front().radius;
    } else {
      for (const Placement::Part& part : placement.parts()) {
        const int last = part.first + part.count - 1;
        auto from = point(last);
        for (int i = part.first; i <= last; ++i) {  // the point of a side next to the obstacle's middle
          const auto to = point(i);
          double along = 0, square = 0;
          for (std::size_t k = 0; k < ToSize(placement.dim()); ++k) {
            along += (center[static_cast<Eigen::Index>(k)] - from[k]) * (to[k] - from[k]);
            square += (to[k] - from[k]) * (to[k] - from[k]);
          }
          const double share = square > 0 ? std::clamp(along / square, 0.0, 1.0) : 1;
          for (std::size_t k = 0; k < to.size(); ++k) from[k] += share * (to[k] - from[k]);
          least = std::min(least, distance(from) - part.radius);
          from = to;
        }
      }
    }
    return WithRounding(least - other.radius());
  }
  // From above.
  [[nodiscard]] double WithRounding(double distance) const noexcept {
    constexpr double kRounding = 1e-12;
    return distance + kRounding * (size_ + std::abs(distance) + test_.placement_.reach());
  }

  // As Settle, of a pair that may touch. What is proven here may be the closest.
  void SettleNear(const ObstacleIndex& index, const Near& pair) noexcept {
    const int t = pair.t, o = pair.o;
    if (pair.gap > WithTolerance(index, 0) || IsAfterTouch(t, o)) return;
    const Separation by_hulls = ByHulls(t, o);
    if (by_hulls.IsProven()) return;
    unit_.Enter(t);
    const PartSeparation direct = unit_.ByDirections({by_hulls, -1}, obstacle(o), {});
    if (!direct.separation.IsProven() && !ByBox(t, o).IsProven()) Search(direct, t, o);
  }

  // Of what stands, with an index.
  [[nodiscard]] Separation ByHulls(int t, int o) const noexcept {
    return SeparateHulls(has_boxes() ? HullOfPoses(t) : hulls_[ToSize(t - first_)], obstacle(o),
                         test_.placement_.reach());
  }

  // @pre unit t is entered, with its hulls.
  void See(int t, int o) noexcept {
    const Encounter& meeting = unit_.MeetIn(obstacle(o));
    if (meeting.is_there) See(t, o, unit_.ByHulls(obstacle(o), meeting));
  }
  void See(int t, int o, const Separation& by_hulls) noexcept {
    if (by_hulls.IsProven())
      nearest_.Add(by_hulls, -1, t, o, is_at_frame());
    else
      Settle(t, o, by_hulls);
  }

  // A pair that hulls do not prove apart.
  void Settle(int t, int o, const Separation& by_hulls) noexcept {
    if (IsAfterTouch(t, o)) return;
    if (const Separation boxed = ByBox(t, o); boxed.IsProven()) return nearest_.Add(by_hulls, -1, t, o, false, boxed);
    unit_.Enter(t);
    const Encounter& meeting = unit_.MeetIn(obstacle(o));
    const PartSeparation direct = unit_.ByDirections({by_hulls, -1}, obstacle(o), meeting);
    if (direct.separation.IsProven()) return nearest_.Add(direct.separation, direct.part, t, o, true);
    Search(direct, t, o);
  }

  // What no cheap bound proves.
  void Search(const PartSeparation& direct, int t, int o) noexcept {
    const PartSeparation best = unit_.Best(direct, obstacle(o), unit_.MeetIn(obstacle(o)));
    if (best.separation.IsProven()) return closest_.Consider(best, t, o);
    if (IsAfterTouch(t, o)) return;
    touched_ = t;
    touched_obstacle_ = o;
    touch_ = best;
  }

  [[nodiscard]] Separation ByBox(int t, int o) noexcept {
    return unit_.ByBox(obstacle(o), [&]() -> const Hull& {
      EncloseBody(t);
      return tight_bodies_[ToSize(t - first_)];
    });
  }
  void EncloseBody(int t) noexcept {
    const std::size_t i = ToSize(t - first_);
    if (std::exchange(has_body_[i], true)) return;
    unit_.Enter(t);
    tight_bodies_[i] = unit_.EncloseBody();
  }

  [[nodiscard]] bool IsCloser(const Pair& pair) const noexcept {
    return closest_.Yields(pair.clearance, pair.step, pair.obstacle);
  }
  void Direct(Pair& pair) noexcept {
    unit_.Enter(pair.step);
    pair.Improve(unit_.ByDirections(pair.bound, obstacle(pair.obstacle), unit_.MeetIn(obstacle(pair.obstacle))));
  }
  void Consider(const Pair& pair) noexcept {
    unit_.Enter(pair.step);
    PartSeparation best =
        unit_.Best(pair.bound, obstacle(pair.obstacle), unit_.MeetIn(obstacle(pair.obstacle)), Enough());
    if (!best.separation.IsProven() && pair.boxed.IsProven()) best = {pair.boxed, -1};
    closest_.Consider(best, pair.step, pair.obstacle);
  }
  // A clearance above which a pair is not the closest: none as close is lost.
  [[nodiscard]] double Enough() const noexcept {
    return closest_.clearance + 1e-9 * (1 + std::abs(closest_.clearance));
  }
  // What no cheap bound proves has been considered before.
  void ConsiderIfCloser(Pair& pair) noexcept {
    if (IsCloser(pair) && !pair.is_direct) Direct(pair);
    if (IsCloser(pair) && pair.IsProven()) Consider(pair);
  }
  // Of what stands, with an index: in the order of their cost. False if nothing proves the pair apart.
  [[nodiscard]] bool ConsiderNear(const ObstacleIndex& index, const Near& pair) noexcept {
    const int t = pair.t, o = pair.o;
    const double far = WithTolerance(index, std::min(closest_.clearance, farthest_));
    if (pair.gap > far) return true;
    unit_.Enter(t);
    if (is_at_frame()) {
      const Separation by_hulls = ByHulls(t, o);
      if (!by_hulls.IsProven()) return false;
      if (closest_.Yields(by_hulls.clearance(), t, o) &&
          !(unit_.ByDirections(obstacle(o), {}).separation.clearance() > far))
        Consider({{by_hulls, -1}, {}, by_hulls.clearance(), t, o, true});
      return true;
    }
    const auto direct = [&] { return unit_.ByDirections({ByHulls(pair.t, pair.o), -1}, obstacle(pair.o), {}); };
    if (test_.placement_.has_expressions() && direct().separation.clearance() > far) return true;
    const PartSeparation searched = unit_.BestOfParts(obstacle(o), {}, Enough());
    if (searched.separation.IsProven() && searched.separation.clearance() > Enough()) return true;
    PartSeparation best = Better(searched, direct(), test_.placement_.parts().size());
    if (!best.separation.IsProven()) best = {ByBox(t, o), -1};
    if (best.separation.IsProven()) closest_.Consider(best, t, o);
    return best.separation.IsProven();
  }
  // Of one that may touch SettleNear has said so.
  void ConsiderOrSearch(const ObstacleIndex& index, const Near& pair) noexcept {
    if (ConsiderNear(index, pair) || !(pair.gap > WithTolerance(index, 0)) || is_at_frame()) return;
    Search(unit_.ByDirections({ByHulls(pair.t, pair.o), -1}, obstacle(pair.o), {}), pair.t, pair.o);
  }

  // The half-planes along the sides of a body in the plane over a unit: all of the part to which a side belongs is in
  // {y : (x, y) . y <= end}, up to rounding. A part has its sides at all samples of the unit, one after the other.
  struct Outline {
    int t = -1;
    std::array<double, std::size_t{2} * kMaxBodyPoints + kLaneCount> x, y, end;
  };
  // The sides of a part of more than one point.
  [[nodiscard]] std::size_t FirstSide(int point) const noexcept { return ToSize(point * (1 + span())); }

  // Whether anything is known of the body over a unit.
  [[nodiscard]] bool IsKnown(int t) const noexcept {
    return poses_[ToSize(t - first_)].is_known && poses_[ToSize(t - first_ + span())].is_known;
  }

  const Outline& SketchBody(int t) noexcept {
    Outline& outline = outlines_[ToSize(t) % outlines_.size()];
    if (std::exchange(outline.t, t) == t) return outline;
    for (const Placement::Part& part : test_.placement_.parts()) {
      const std::size_t first = FirstSide(part.first), end = FirstSide(part.first + part.count);
      std::size_t j = first;
      for (int s = 0; s <= span(); ++s)
        for (int i = part.first; i < part.first + part.count; ++i, ++j) {
          const auto side = test_.placement_.Side(poses_[ToSize(t - first_ + s)], part, i);
          outline.x[j] = side[0];
          outline.y[j] = side[1];
        }
      StoreLanes(AllLanes(0), &outline.x[end]);  // up to the next part
      StoreLanes(AllLanes(0), &outline.y[end]);
      for (j = first; j < end; j += kLaneCount)
        StoreLanes(FarthestOf(t, part, LoadLanes(&outline.x[j]), LoadLanes(&outline.y[j])), &outline.end[j]);
    }
    return outline;
  }
  // Of all of a part over a unit, along vectors of length 1, or 0. @pre IsKnown.
  [[nodiscard]] FOREREACH_INLINE Lanes FarthestOf(int t, const Placement::Part& part, const Lanes& x,
                                                  const Lanes& y) const noexcept {
    Lanes farthest = AllLanes(-kInfinity);
    for (int s = 0; s <= span(); ++s) {
      const Placement::Pose& pose = poses_[ToSize(t - first_ + s)];
      Lanes at_sample = AllLanes(-kInfinity);
      for (std::size_t i = ToSize(part.first); i < ToSize(part.first + part.count); ++i)
        at_sample = Max(x * AllLanes(pose.middle[0][i]) + y * AllLanes(pose.middle[1][i]) + AllLanes(pose.around[i]),
                        at_sample);
      farthest = Max(at_sample + Abs(x) * AllLanes(pose.width[0]) + Abs(y) * AllLanes(pose.width[1]), farthest);
    }
    return farthest + AllLanes(part.radius);
  }

  // Lower bounds, about, on the distances of the body from boxes, by its sides; negative: none.
  [[nodiscard]] FOREREACH_INLINE Lanes GapAcrossSides(const Outline& outline,
                                                      const BoxTree::Four& boxes) const noexcept {
    const Lanes center_x = LoadLanes(boxes.center[0].data()), center_y = LoadLanes(boxes.center[1].data()),
                half_x = LoadLanes(boxes.half_width[0].data()), half_y = LoadLanes(boxes.half_width[1].data());
    Lanes least = AllLanes(kInfinity);
    for (const Placement::Part& part : test_.placement_.parts()) {
      Lanes best = AllLanes(-1);
      for (std::size_t j = FirstSide(part.first), end = FirstSide(part.first + part.count); j < end; ++j) {
        const Lanes x = AllLanes(outline.x[j]), y = AllLanes(outline.y[j]);
        best = Max(x * center_x + y * center_y - Abs(x) * half_x - Abs(y) * half_y - AllLanes(outline.end[j]), best);
      }
      least = Min(best, least);
    }
    return least;
  }

  // Whether pairs of a unit can be refined.
  [[nodiscard]] bool IsRefinable(int t) const noexcept {
    return has_boxes() && test_.placement_.dim() == 2 && !test_.placement_.has_expressions() && IsKnown(t);
  }
  // Raises a pair's bound to about its distance, or above `far`, and lowers farthest_ to that from above. @pre
  // IsRefinable.
  void Refine(Near& pair, double far) noexcept {
    Dispatch<&Judgement::RefinePair>(test_.instructions_, *this, pair, far);
  }
  static void RefinePair(Judgement& judgement, Near& pair, double far) noexcept {
    const Obstacle& other = judgement.obstacle(pair.o);
    Bracket least{kInfinity, kInfinity};
    for (const Placement::Part& part : judgement.test_.placement_.parts()) {
      const double added = other.radius() + part.radius;
      const Bracket found = judgement.DistanceOf(pair.t, part, other, far + added);
      least = {std::min(least.lower, found.lower - added), std::min(least.upper, found.upper - added)};
    }
    pair.gap = std::max(pair.gap, least.lower);
    judgement.farthest_ = std::min(judgement.farthest_, judgement.WithRounding(least.upper));
  }

  // Bounds on a distance, up to rounding.
  struct Bracket {
    double lower = -kInfinity, upper = kInfinity;
  };
  // Of the places of a part from a core, by a search as Separate's, which is given up where they are further than
  // `far`.
  [[nodiscard]] Bracket DistanceOf(int t, const Placement::Part& part, const Obstacle& core,
                                   double far) const noexcept {
    using Vector = Eigen::Vector2d;
    constexpr int kSteps = 8;
    constexpr double kEnough = 1e-4;
    const auto nearest_on = [](const Vector& a, const Vector& b) -> Vector {
      const Vector edge = b - a;
      const double square = edge.squaredNorm();
      return square > 0 ? Vector(a + edge * std::clamp(-a.dot(edge) / square, 0.0, 1.0)) : a;
    };
    Vector nearest = Offset(t, part, core), kept[2] = {nearest, nearest};
    Bracket found;
    for (int step = 0; step < kSteps; ++step) {
      const double length = nearest.norm();
      if (!(length > 0x1p-300) || length > found.upper - kEnough) break;
      found.upper = length;
      const Vector d = nearest / length;
      Placement::Farthest farthest;
      for (int s = 0; s <= span(); ++s)
        test_.placement_.FindFarthest(poses_[ToSize(t - first_ + s)], tube_.slice(t + s), part, {d[0], d[1]}, farthest,
                                      test_.instructions_);
      if (!(farthest.support > -kInfinity)) break;  // no number: nothing is known
      Vector lowest = core.hull().front().head<2>();
      for (const Eigen::Vector3d& point : core.hull())
        if (d.dot(point.head<2>()) < d.dot(lowest)) lowest = point.head<2>();
      found.lower = std::max(found.lower, d.dot(lowest) - farthest.support);
      if (found.lower > far) break;
      lowest -= Vector(farthest.x, farthest.y);
      const Vector first = nearest_on(lowest, kept[0]), second = nearest_on(lowest, kept[1]);
      const bool with_first = first.squaredNorm() < second.squaredNorm();
      nearest = with_first ? first : second;
      kept[with_first ? 1 : 0] = lowest;
    }
    return found;
  }
  // From the middle of a part's point to a point of the core, about the nearest ones.
  [[nodiscard]] Eigen::Vector2d Offset(int t, const Placement::Part& part, const Obstacle& core) const noexcept {
    const bool is_box = core.kind() == Obstacle::Kind::kBox;
    const Eigen::Vector3d &some = core.hull().front(), &lower = is_box ? core.lower() : some,
                          &upper = is_box ? core.upper() : some;
    Eigen::Vector2d nearest;
    double least = kInfinity;
    for (int s = 0; s <= span(); ++s) {
      const Placement::Pose& pose = poses_[ToSize(t - first_ + s)];
      for (std::size_t i = ToSize(part.first); i < ToSize(part.first + part.count); ++i) {
        const double x = pose.middle[0][i], y = pose.middle[1][i];
        const Eigen::Vector2d offset(std::max(lower[0] - x, 0.0) + std::min(upper[0] - x, 0.0),
                                     std::max(lower[1] - y, 0.0) + std::min(upper[1] - y, 0.0));
        if (const double square = offset.squaredNorm(); square < least || least == kInfinity) {
          least = square;
          nearest = offset;
        }
      }
    }
    return nearest;
  }

  void ConsiderIfCloser(const Separation& by_hulls, int t, int o) noexcept {
    const Separation boxed = by_hulls.IsProven() ? Separation{} : ByBox(t, o);
    Pair pair{{by_hulls, -1}, boxed, std::max(by_hulls.clearance(), boxed.clearance()), t, o, is_at_frame()};
    ConsiderIfCloser(pair);
  }

  // Of those that are proven apart. Null if there are none.
  Pair* ConsiderLeast() noexcept {
    Pair* least = nearest_.Least();
    for (; least != nullptr && IsCloser(*least) && !least->is_direct; least = nearest_.Least()) Direct(*least);
    if (least != nullptr && IsCloser(*least)) Consider(*least);
    return least;
  }

  // The nearest by its hull first: it leaves few of the others.
  void ConsiderCores() noexcept {
    const std::span all(bounds_.data(), BoundsOf(units_));
    const auto consider = [&](const double* bound) {
      const auto place = bound - all.data(), count = static_cast<std::ptrdiff_t>(cores_.stride());
      const int t = first_ + static_cast<int>(place / count);
      unit_.Enter(t);
      unit_.EncloseHulls();
      Look(t, static_cast<int>(place % count));
    };
    const double* const least = std::ranges::min_element(all).base();
    if (*least < kInfinity) consider(least);
    for (const double& bound : all)
      if (bound <= closest_.clearance && &bound != least && bound < kInfinity) consider(&bound);
  }

  void FindClosest() noexcept {
    if (cores_.size() > 0) ConsiderCores();
    const Pair* const least = ConsiderLeast();
    const ObstacleIndex* const index = obstacles_.index();
    if (nearest_.left_out() > closest_.clearance)
      for (Pair& pair : nearest_.InOrder(closest_.clearance, least)) ConsiderIfCloser(pair);
    else if (index == nullptr || index->has_moving() || !index->everywhere().empty())
      LookAgain();
  }

  // At those for which there was no room.
  void LookAgain() noexcept {
    if (const ObstacleIndex* const index = obstacles_.index(); index != nullptr && index->has_moving())
      ForEachNearMoving(
          *index, [&] { return closest_.clearance; },
          [&](int t, int o) {
            unit_.Enter(t);
            unit_.EncloseHulls();
            Look(t, o);
          });
    for (int t = first_; t < units_; ++t) {
      unit_.Enter(t);
      unit_.EncloseHulls();
      if (const ObstacleIndex* const index = obstacles_.index()) {
        for (std::size_t i = 0; i < index->everywhere().size(); ++i)
          if (!IsFurther(i, WithTolerance(*index, closest_.clearance))) Look(t, index->everywhere()[i]);
        continue;
      }
      for (int o = static_cast<int>(cores_.size()); o < numbers_.size(); ++o) Look(t, o);
    }
  }
  // @pre unit t is entered, with its hulls.
  void Look(int t, int o) noexcept {
    const Encounter& meeting = unit_.MeetIn(obstacle(o));
    if (meeting.is_there) ConsiderIfCloser(unit_.ByHulls(obstacle(o), meeting), t, o);
  }

  const SafetyTest& test_;
  const ObstacleView& obstacles_;
  const int first_, units_, span_ = test_.placement_.sweeps() ? 1 : 0;
  const Tube& tube_;
  const Schedule& schedule_;
  const ConvexNumbers numbers_;
  int touched_, touched_obstacle_ = -1;  // the first unit and obstacle that are not proven apart; units_: none
  PartSeparation touch_;                 // there
  Closest closest_;
  Nearest nearest_;
  Unit unit_;
  std::array<Hull, HullTree::kMost> hulls_;         // of the units from the first on, with an index
  std::array<Hull, HullTree::kMost> bodies_;        // around the whole body in these units, if has_boxes
  std::array<Hull, HullTree::kMost> tight_bodies_;  // likewise, where has_body_
  std::array<bool, HullTree::kMost> has_body_{};
  std::array<Placement::Pose, HullTree::kMost> poses_;  // at the samples; without boxes only the frame's hulls
  // With an index bounds on the clearances of the first that have no end, in all units; others are seen always.
  // Without, of each core in each unit.
  std::array<double, 4096> bounds_;
  StandingCores cores_;
  // Whether all parts of a body in the plane have sides.
  const bool has_sides_ =
      has_boxes() && test_.placement_.dim() == 2 &&
      std::ranges::all_of(test_.placement_.parts(), [](const auto& part) { return part.count > 1; });
  std::array<Outline, 16> outlines_;  // of the units that were last looked at, by their remainders
  double farthest_ = kInfinity;       // of the closest pair, from above
  double nearest_gap_ = kInfinity;    // the least of those that farthest_ was found from
  Near approached_{-1, -1, 0, true};  // the last of those, refined if it can be
  double size_ = 0;                   // of the hulls of the search: a bound on their coordinates
  HullTree tree_;                     // of units, for what moves
};

Decision SafetyTest::Judge(const ObstacleView& obstacles, const Schedule& schedule, Tube& tube, int first,
                           const Decision& before) const noexcept {
  return Judgement(*this, obstacles, schedule, tube, first, before).Run();
}

}  // namespace forereach
