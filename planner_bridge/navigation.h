/** How far it still is to the goal, around the obstacles: what a receding horizon descends. */
#pragma once

#include <vector>

#include <Eigen/Core>

#include "certifier/safety/obstacle.h"
#include "certifier/sets/box.h"

namespace forereach {

/** In the plane: the travel distance from y to the goal inside a region and among obstacles grown by a clearance, a
little more where it passes close to either, from a grid solved once by the fast marching method. On the line and in
space: the straight distance. For planning, not for bounds. Refers to nothing of its arguments. */
class NavigationField final {
 public:
  /** @param region where the robot may be; outside it answers as at its edge. @param clearance metres.
  Cost O(cells (obstacles + log cells)), 60,000 cells at most. */
  NavigationField(const Box& region, const std::vector<Obstacle>& obstacles, double clearance,
                  const Eigen::VectorXd& goal);

  /** Metres. Inside a grown obstacle it is finite, large, and falls towards the way out. */
  [[nodiscard]] double DistanceToGo(const Eigen::VectorXd& y) const;

  /** The unit vector along which it falls fastest; zero where it is flat. */
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
