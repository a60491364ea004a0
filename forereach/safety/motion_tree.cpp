#include "forereach/safety/motion_tree.h"

#include <cmath>
#include <numeric>

namespace forereach {
namespace {

// The middle of a window; of one without end, the time in it next to the reference. No difference of two of them
// overflows.
std::int64_t TimeOf(std::int64_t from_us, std::int64_t until_us, std::int64_t reference_us) noexcept {
  const bool has_end = from_us > -ObstacleMotion::kAlways && until_us < ObstacleMotion::kAlways;
  const std::int64_t time = has_end ? std::midpoint(from_us, until_us) : std::clamp(reference_us, from_us, until_us);
  return std::clamp(time, -Schedule::kLatest, Schedule::kLatest);
}

double PlainSeconds(std::int64_t us) noexcept { return 1e-6 * static_cast<double>(us); }

}  // namespace

void HullTree::Build(std::span<const Hull> hulls, int dim) noexcept {
  num_nodes_ = 0;
  size_ = 0;
  for (const Hull& hull : hulls) {
    double size = 0;
    for (std::size_t k = 0; k < ToSize(dim); ++k) size += std::abs(hull.center[k]) + hull.half_width[k];
    if (!(size <= size_) && !std::isnan(size_)) size_ = size;
  }
  Build(hulls, dim, 0, static_cast<int>(hulls.size()));
}

// What is compared with NaN may get lost, but size_ then is NaN, and no pair is left out.
int HullTree::Build(std::span<const Hull> hulls, int dim, int first, int count) noexcept {
  const int number = num_nodes_++;
  Node& node = nodes_[ToSize(number)];
  node.first = first;
  node.count = count;
  if (count == 1) {
    const auto& [c, w] = hulls[ToSize(first)];
    const Lanes center{c[0], dim > 1 ? c[1] : 0, dim > 2 ? c[2] : 0, 0},
        half_width{w[0], dim > 1 ? w[1] : 0, dim > 2 ? w[2] : 0, 0};
    StoreLanes(center - half_width, node.lower.data());
    StoreLanes(center + half_width, node.upper.data());
    return number;
  }
  // Slices follow each other, so halves of the list are near each other without a sort, which a certify step has no
  // time for.
  Build(hulls, dim, first, count / 2);
  node.second = Build(hulls, dim, first + count / 2, count - count / 2);
  const Node &a = nodes_[ToSize(number + 1)], &b = nodes_[ToSize(node.second)];
  StoreLanes(Min(LoadLanes(a.lower.data()), LoadLanes(b.lower.data())), node.lower.data());
  StoreLanes(Max(LoadLanes(a.upper.data()), LoadLanes(b.upper.data())), node.upper.data());
  return number;
}

// In plain arithmetic: SizeIn allows for its rounding.
MotionTree::Node MotionTree::Around(std::span<const Obstacle* const> obstacles, std::span<const std::int32_t> some,
                                    std::int64_t reference_us) noexcept {
  Node node;
  node.from_us = ObstacleMotion::kAlways;
  node.until_us = -ObstacleMotion::kAlways;
  for (const std::int32_t i : some) {
    node.from_us = std::min(node.from_us, obstacles[ToSize(i)]->motion()->from_us);
    node.until_us = std::max(node.until_us, obstacles[ToSize(i)]->motion()->until_us);
  }
  node.time_us = TimeOf(node.from_us, node.until_us, reference_us);
  const auto dim = ToSize(obstacles[0]->dim());
  for (std::size_t k = 0; k < dim; ++k) {
    node.lower[k] = node.slow[k] = kInfinity;
    node.upper[k] = node.fast[k] = -kInfinity;
  }
  for (const std::int32_t i : some) {
    const Obstacle& obstacle = *obstacles[ToSize(i)];
    const ObstacleMotion& motion = *obstacle.motion();
    const double tau = PlainSeconds(node.time_us - motion.stamp_us), ago = std::abs(tau);
    const double around = obstacle.radius() + motion.uncertainty + ago * (motion.growth + ago * motion.growth_rate / 2);
    for (std::size_t k = 0; k < dim; ++k) {
      const auto row = static_cast<Eigen::Index>(k);
      const double velocity = motion.velocity[row], shift = velocity * tau;
      node.lower[k] = std::min(node.lower[k], obstacle.lower()[row] + shift - around);
      node.upper[k] = std::max(node.upper[k], obstacle.upper()[row] + shift + around);
      node.slow[k] = std::min(node.slow[k], velocity);
      node.fast[k] = std::max(node.fast[k], velocity);
    }
    node.growth = std::max(node.growth, motion.growth + ago * motion.growth_rate);
    node.bend = std::max(node.bend, motion.growth_rate);
    node.speed = std::max(node.speed, motion.velocity.norm());
  }
  return node;
}

MotionTree::MotionTree(std::span<const Obstacle* const> obstacles) {
  if (obstacles.empty()) return;
  const std::int64_t reference = obstacles[0]->motion()->stamp_us;
  earliest_us_ = latest_us_ = reference;
  const auto note = [&](std::int64_t time) {
    earliest_us_ = std::min(earliest_us_, time);
    latest_us_ = std::max(latest_us_, time);
  };
  for (const Obstacle* obstacle : obstacles) {
    const ObstacleMotion& motion = *obstacle->motion();
    note(motion.stamp_us);
    const auto size = obstacle->lower().cwiseAbs().sum() + obstacle->upper().cwiseAbs().sum();
    place_ = std::max(place_, size + obstacle->radius() + motion.uncertainty);
    speed_ = std::max(speed_, motion.velocity.norm());
    growth_ = std::max(growth_, motion.growth);
    bend_ = std::max(bend_, motion.growth_rate);
  }
  // Apart in place, in the place after a second, or in time.
  std::vector<std::array<double, 2 * kMaxSafetyDim + 1>> places;
  for (const Obstacle* obstacle : obstacles) {
    const ObstacleMotion& motion = *obstacle->motion();
    const std::int64_t time = TimeOf(motion.from_us, motion.until_us, reference);
    auto& place = places.emplace_back();
    for (std::size_t k = 0; k < kMaxSafetyDim; ++k) {
      const auto row = static_cast<Eigen::Index>(k);
      place[k] = obstacle->lower()[row] / 2 + obstacle->upper()[row] / 2 +
                 motion.velocity[row] * PlainSeconds(time - motion.stamp_us);
      place[kMaxSafetyDim + k] = motion.velocity[row];
    }
    place.back() = std::min(speed_, 1e100) * PlainSeconds(time - reference);  // a number, whatever is sent
  }
  halves_ = Halves<Node>(places, [&](std::span<const std::int32_t> some) {
    const Node node = Around(obstacles, some, reference);
    note(node.time_us);
    return node;
  });
}

// Let T be the longest time from a sample to a stamp or to the time of a node. From a stamp to a node it is 2 T at
// most.
double MotionTree::SizeIn(const Times& times) const noexcept {
  const auto& [start_us, step_us, error_us] = times.schedule;
  const std::int64_t from = start_us + times.first * step_us - error_us,
                     until = start_us + (times.first + HullTree::kMost) * step_us + error_us;
  const double longest = PlainSeconds(std::max({std::abs(from - earliest_us_), std::abs(from - latest_us_),
                                                std::abs(until - earliest_us_), std::abs(until - latest_us_)}));
  return place_ + longest * (4 * (speed_ + growth_) + 5 * longest * bend_);
}

}  // namespace forereach
