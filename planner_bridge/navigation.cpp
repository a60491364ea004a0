#include "planner_bridge/navigation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>
#include <utility>

namespace forereach {
namespace {

constexpr double kCellsAlong = 240, kStartCells = 4;
// A metre inside a grown obstacle counts as many; one at its edge as kNear, which falls to 1 over kMargin metres.
constexpr double kInside = 20, kNear = 2, kMargin = 2;

double Slowness(const Box& region, const RoomAt& room_at, double clearance, const Eigen::VectorXd& y) {
  const double from_edge = std::min((y - region.lower()).minCoeff(), (region.upper() - y).minCoeff());
  const double room = std::min(kMargin, std::min(from_edge, room_at(y)) - clearance);
  return room < 0 ? kInside : kNear - (kNear - 1) * room / kMargin;
}

}  // namespace

bool IsGone(const Obstacle& obstacle, std::int64_t time_us) {
  return obstacle.motion() && obstacle.motion()->until_us < time_us;
}

RoomAt RoomOfPoint(const std::vector<Obstacle>& obstacles, std::int64_t time_us) {
  return [&obstacles, time_us](const Eigen::VectorXd& y) {
    double room = kInfinity;
    for (const Obstacle& obstacle : obstacles) {
      const auto& motion = obstacle.motion();
      if (motion && (!motion->velocity.isZero(0) || IsGone(obstacle, time_us))) continue;
      room = std::min(room, ApproximateDistance(obstacle, y) - (motion ? motion->uncertainty : 0));
    }
    return room;
  };
}

NavigationField::NavigationField(const Box& region, const RoomAt& room, double clearance, const Eigen::VectorXd& goal,
                                 double finest_cell)
    : goal_(goal) {
  if (goal.size() != 2) return;
  const Eigen::VectorXd extent = region.upper() - region.lower();
  origin_ = region.lower();
  cell_ = std::max(finest_cell, extent.maxCoeff() / kCellsAlong);
  columns_ = static_cast<int>(extent(0) / cell_) + 2;
  rows_ = static_cast<int>(extent(1) / cell_) + 2;
  std::vector<double> slowness(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_));
  for (std::size_t k = 0; k < slowness.size(); ++k)
    slowness[k] = Slowness(region, room, clearance, NodeAt(static_cast<int>(k)));
  March(slowness);
}

Eigen::Vector2d NavigationField::NodeAt(int index) const {
  return origin_ + cell_ * Eigen::Vector2d(index % columns_, index / columns_);
}

// Dijkstra's order with the eikonal equation's update, so that distances are Euclidean and not along grid lines.
// Around the goal, where that equation is least exact on a grid, the straight distance is the start.
void NavigationField::March(const std::vector<double>& slowness) {
  using Entry = std::pair<double, int>;
  distance_.assign(slowness.size(), std::numeric_limits<double>::infinity());
  std::vector<bool> settled(slowness.size());
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> front;
  const Eigen::Vector2d end = origin_ + cell_ * Eigen::Vector2d(columns_ - 1, rows_ - 1);
  // A goal outside the region draws to the place of the region that is nearest to it.
  const Eigen::Vector2d source = goal_.head<2>().cwiseMax(origin_).cwiseMin(end);
  for (int k = 0; k < columns_ * rows_; ++k) {
    const double distance = (NodeAt(k) - source).norm();
    if (!(distance <= kStartCells * cell_)) continue;
    distance_[static_cast<std::size_t>(k)] = distance * slowness[static_cast<std::size_t>(k)];
    front.emplace(distance_[static_cast<std::size_t>(k)], k);
  }
  while (!front.empty()) {
    const int index = front.top().second;
    front.pop();
    if (settled[static_cast<std::size_t>(index)]) continue;
    settled[static_cast<std::size_t>(index)] = true;
    const int i = index % columns_, j = index / columns_;
    for (const auto& [ni, nj] : {std::pair(i - 1, j), {i + 1, j}, {i, j - 1}, {i, j + 1}}) {
      if (ni < 0 || nj < 0 || ni >= columns_ || nj >= rows_) continue;
      const auto next = static_cast<std::size_t>(Index(ni, nj));
      const double distance = Solve(static_cast<int>(next), slowness[next]);
      if (settled[next] || !(distance < distance_[next])) continue;
      distance_[next] = distance;
      front.emplace(distance, static_cast<int>(next));
    }
  }
}

double NavigationField::Solve(int index, double slowness) const {
  const int i = index % columns_, j = index / columns_;
  const auto at = [this](int column, int row) {
    if (column < 0 || row < 0 || column >= columns_ || row >= rows_) return std::numeric_limits<double>::infinity();
    return distance_[static_cast<std::size_t>(Index(column, row))];
  };
  const double a = std::min(at(i - 1, j), at(i + 1, j)), b = std::min(at(i, j - 1), at(i, j + 1));
  const double h = slowness * cell_, nearer = std::min(a, b), difference = std::abs(a - b);
  // The front comes from one side only.
  if (!(difference < h)) return nearer + h;
  return (a + b + std::sqrt(2 * h * h - difference * difference)) / 2;
}

double NavigationField::DistanceToGo(const Eigen::VectorXd& y) const {
  if (!y.allFinite()) return kInfinity;
  if (columns_ == 0) return (y - goal_).norm();
  const double u = std::clamp((y(0) - origin_(0)) / cell_, 0.0, columns_ - 1.0);
  const double v = std::clamp((y(1) - origin_(1)) / cell_, 0.0, rows_ - 1.0);
  const int i = std::min(static_cast<int>(u), columns_ - 2), j = std::min(static_cast<int>(v), rows_ - 2);
  const double s = u - i, t = v - j;
  const auto at = [this](int column, int row) { return distance_[static_cast<std::size_t>(Index(column, row))]; };
  return (1 - t) * ((1 - s) * at(i, j) + s * at(i + 1, j)) + t * ((1 - s) * at(i, j + 1) + s * at(i + 1, j + 1));
}

Eigen::VectorXd NavigationField::Descent(const Eigen::VectorXd& y) const {
  Eigen::VectorXd direction = goal_ - y;
  for (int k = 0; columns_ != 0 && k < 2; ++k) {
    Eigen::VectorXd before = y, after = y;
    before(k) -= cell_;
    after(k) += cell_;
    direction(k) = DistanceToGo(before) - DistanceToGo(after);
  }
  const double norm = direction.norm();
  return norm > 0 ? Eigen::VectorXd(direction / norm) : Eigen::VectorXd::Zero(y.size());
}

}  // namespace forereach
