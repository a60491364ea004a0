/** The travel distance to the goal around the obstacles. The search minimises it. */
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include <Eigen/Core>

#include "forereach/safety/obstacle.h"
#include "forereach/sets/box.h"

namespace forereach {

/** How far the robot is from obstacles when it is at y, metres; negative inside one. */
using RoomAt = std::function<double(const Eigen::VectorXd& y)>;

/** Of a point: the least distance to the obstacles that stand; those with a velocity, and those that are gone at a
time, are left out. It refers to its first argument. */
[[nodiscard]] RoomAt RoomOfPoint(const std::vector<Obstacle>& obstacles, std::int64_t time_us = 0);

/** Whether the obstacle's motion has ended before this time. */
[[nodiscard]] bool IsGone(const Obstacle& obstacle, std::int64_t time_us);

/** For p = 2: the travel distance from y to the goal inside a region and around obstacles grown by a clearance, with a
small penalty close to either. It is computed once on a grid by the fast
marching method. For p = 1 and p = 3: the straight distance. Use it for planning, not for bounds. It keeps no reference
to its arguments. */
class NavigationField final {
 public:
  static constexpr double kFinestCell = 0.25;

  /** @param region the region of the robot's positions, metres; a point outside has the value at the nearest edge.
  @param clearance metres. @param goal p entries, metres. @param finest_cell the least width of a cell, metres. Cost
  O(cells (room + log cells)) with at most 60,000 cells. */
  NavigationField(const Box& region, const RoomAt& room, double clearance, const Eigen::VectorXd& goal,
                  double finest_cell = kFinestCell);

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
