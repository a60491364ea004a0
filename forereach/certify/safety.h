/** The last test of Algorithm 1: whether a tube keeps the body clear of every obstacle.

A unit of time is a sample t = 0 .. T, or, with Problem::between, a step t = 0 .. T-1: all times from sample t to
sample t + 1. Over a unit, each part of the body lies in the convex hull of the places of its points at the unit's
samples, widened by what the declared bounds allow between them. The hull is separated from each obstacle, seen from an
obstacle that moves (docs/soundness.md). */
#pragma once

#include <span>
#include <vector>

#include "forereach/certify/decision.h"
#include "forereach/certify/problem.h"
#include "forereach/safety/obstacle_view.h"
#include "forereach/safety/placement.h"
#include "forereach/safety/separation.h"

namespace forereach {

class Tube;

/** A separation, and the part of the body that comes closest; -1 if the bound is that of the whole body. */
struct PartSeparation {
  Separation separation;
  int part = -1;
};

/** A body's places. @throws std::invalid_argument as Placement does, and if one tells how often an angle has turned. */
[[nodiscard]] Placement PlacementOf(const Problem& problem);

/** Immutable, so any number of threads may use it, each with its own tube. */
class SafetyTest final {
 public:
  /** @throws std::invalid_argument as Placement does. */
  explicit SafetyTest(const Problem& problem);

  [[nodiscard]] const Placement& placement() const { return placement_; }
  /** The number of units of a tube: its steps or its samples. */
  [[nodiscard]] int NumUnits(const Tube& tube) const;

  /** Judges the units from `first` on. The outcome is kCertified only with a proof that the body is disjoint from every
  obstacle in each of them; otherwise it is kSafety with the first unit that is not proven as `step`, and the first
  obstacle there. A certificate names the closest approach, of several as close the first; with no unit left none.
  @param before names the closest approach in earlier units, which stays if nothing is closer; or nothing.
  @param tube its slices are read; its scratch memory is used. @pre the obstacles and the schedule are as
  Certifier::Require wants them. It allocates nothing. Cost for each unit and obstacle: O(p) if the hulls are far from
  each other, otherwise as Separate for the points of the body; nothing for those that an index leaves out. */
  [[nodiscard]] Decision Judge(const ObstacleView& obstacles, const Schedule& schedule, Tube& tube, int first = 0,
                               const Decision& before = {}) const noexcept;

  /** The proven distance between the body and an obstacle in unit t: the largest of the bounds by interval hulls and by
  the best direction. Infinite if the obstacle is nowhere in that unit. @pre 0 <= t < NumUnits(tube). */
  [[nodiscard]] PartSeparation Separate(const Tube& tube, int t, const Obstacle& obstacle,
                                        const Schedule& schedule) const;

 private:
  class Unit;
  class Judgement;

  Placement placement_;
  InstructionSet instructions_;
};

}  // namespace forereach
