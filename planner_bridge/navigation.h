/** The travel distance to the goal around the obstacles. The search minimises it. */
#pragma once

#include <vector>

#include <Eigen/Core>

#include "certifier/safety/obstacle.h"
#include "certifier/sets/box.h"

namespace forereach {

/** For p = 2: the travel distance from y to the goal inside a region and around obstacles grown by a clearance, with a
small penalty close to either. Obstacles with a velocity are left out. It is computed once on a grid by the fast
marching method. For p = 1 and p = 3: the straight distance. Use it for planning, not for bounds. It keeps no reference
to its arguments. */
class NavigationField final {
 public:
  /** @param region the region of the robot's positions, metres; a point outside has the value at the nearest edge.
  @param clearance metres. @param goal p entries, metres. Cost O(cells (obstacles + log cells)) with at most 60,000
  cells. */
  NavigationField(const Box& region, const std::vector<Obstacle>& obstacles, double clearance,
                  const Eigen::VectorXd& goal);

  /** The distance in metres. Inside a grown obstacle it is finite and large, and decreases towards the outside. */
  [[nodiscard]] double DistanceToGo(const Eigen::VectorXd& y) const;

  /** The unit vector of steepest descent; zero if the field is flat. */
  [[nodiscard]] Eigen::VectorXd Descent(const Eigen::VectorXd& y) const;

 private:
  [[nodiscard]] int Index(int i, int j) const { return j * columns_ + i; }
  [[nodiscard]] Eigen::Vector2d NodeAt(int index) const;
  void March(const std::vector<double>& slowness);
  [[nodiscard]] double Solve(int index, double slowness) const;

  Eigen::VectorXd goal_;
  Eigen::Vector2d origin_ = Eigen::Vector2d::Zero();
  double cell_ = 0;               // metres
  int columns_ = 0, rows_ = 0;    // 0 if not in the plane
  std::vector<double> distance_;  // at the nodes
};

}  // namespace forereach
