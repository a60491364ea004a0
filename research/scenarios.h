/** The plans that are certified, and the observations they are certified with. Both are made in code, the same on every
machine.

The paper's scenario bounds are not in its text. These are ours, and fitted: they were found by a search for definitions
under which these figures of the paper come out: the recall of group C, the bicycle's by N, and group B's shares of D
and S. Agreement with those confirms nothing. The data regions (systems.h) were part of the search.
- **Bicycle.** Start: origin, theta = a = 0, v0 ~ U[9, 15]; delta0 ~ U[0.25, 0.40] in C, negated in B, U[0.04, 0.12] in
  A. Plan: constant jerk ~ U[-0.5, 0.5] and steering rate ~ U[-0.05, 0.05], the latter negated in B. Obstacle: r = 1.
- **Point mass.** Start: origin; v0 ~ U[1, 3] x U[-0.4, 0.4] in C, mirrored in x in B, U[0.1, 0.8] x U[-0.4, 0.4] in A.
  Plan: constant u ~ U[-0.3, 0.3]^2. Obstacle: r = 0.8.
- **Obstacle.** One circle, beside the target's rollout from the center of X0 at step k ~ U{9..12}. It is moved off that
  path: in even scenarios by r + U[0.5, 2.5], for the point mass r + U[0.6, 1.6], in odd ones by U[0, 0.8] r, so that
the target meets it. The bicycle's B and C move it to the outside of the curve, where understeer leads; all others to a
random side. */
#pragma once

#include <cstddef>

#include <Eigen/Core>

#include "forereach/residual/declaration.h"
#include "forereach/residual/transitions.h"
#include "forereach/sets/zonotope.h"
#include "research/systems.h"

namespace forereach::research {

/** A: little is asked of the tyres, with data. B: much is asked, where there are no data: "unsupported". C: much is
asked, along the data: "corridor-supported". */
enum class Group { kA, kB, kC };
inline constexpr Group kGroups[] = {Group::kA, Group::kB, Group::kC};
/** 'A', 'B' or 'C'. */
[[nodiscard]] inline char NameOf(Group group) { return static_cast<char>('A' + static_cast<int>(group)); }

struct Circle {
  Eigen::Vector2d center;
  double radius;
};

/** One certification task: X0, a plan and an obstacle. */
struct Scenario {
  Eigen::VectorXd center;    ///< Of X0
  Eigen::MatrixXd controls;  ///< m-by-T, a column a step
  Circle obstacle;
};

/** Scenario `index` of a group; seeds count from 0. The plans of ChunkSystem() are a policy's (chunks/blocks.h). */
[[nodiscard]] Scenario MakeScenario(const System& system, Group group, int seed, int index);

/** A circle beside the target's rollout from `center` under `controls`: `aside` metres to the left of where it is at
step k, square to its last step. */
[[nodiscard]] Circle PlaceBeside(const System& system, const Eigen::VectorXd& center, const Eigen::MatrixXd& controls,
                                 int k, double aside, double radius);

/** Where observations are: in the data region, only where the residual does not show, and two of chunks/blocks.h. */
enum class Layout { kCorridor, kBelowKnee, kFixedGrid, kPolicyCorridor };
/** "corridor", "below_knee", "fixed_grid" or "policy_corridor". */
[[nodiscard]] inline const char* NameOf(Layout layout) {
  constexpr const char* kNames[] = {"corridor", "below_knee", "fixed_grid", "policy_corridor"};
  return kNames[static_cast<std::size_t>(layout)];
}

inline constexpr double kNoiseCut = 3;
/** sigma_k = cut s: the declared bound on noise of scale s, at which the noise is truncated. A Gaussian has no bound.
 */
[[nodiscard]] inline double NoiseBound(double scale, double cut = kNoiseCut) { return cut * scale; }

/** `count` observed transitions, at points uniform in the layout's region or as chunks/blocks.h says. Those of a
smaller count are the first of a larger, but for a grid, and noise does not move the points.
@param noise_scale to each entry of a successor an error N(0, s^2), cut at NoiseBound(s, cut), is added. @pre cut >= 1
*/
[[nodiscard]] Transitions MakeData(const System& system, Layout layout, int seed, int count, double noise_scale,
                                   double cut = kNoiseCut);

}  // namespace forereach::research
