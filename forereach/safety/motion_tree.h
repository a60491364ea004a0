/** A hierarchy over obstacles that move: it finds those near the hulls of a tube, each hull at its own times.

A node is a box that moves and grows. All of its obstacles that are somewhere at the time of the node plus tau seconds
lie, at that time, in
    [lower + min(tau slow, tau fast) - g, upper + max(tau slow, tau fast) + g],    g = growth |tau| + bend tau^2 / 2. */
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "forereach/safety/box_tree.h"
#include "forereach/safety/motion.h"
#include "forereach/safety/obstacle.h"

namespace forereach {

class MotionTree final {
 public:
  MotionTree() = default;
  /** @pre all move, have a size and one dimension. It keeps none of them. Cost O(n log n). */
  explicit MotionTree(std::span<const Obstacle* const> obstacles);

  /** The times of hulls: that of hull t are samples first + t to first + t + span of the schedule. */
  struct Times {
    Schedule schedule;
    int first, span;
  };
  /** As BoxTree::ForEachNear: visit(t, i). An obstacle that is left out is nowhere during the hull's samples, or
  further away than `reach` + `within()` by SeparateHulls, as it is seen from the obstacle (Meet). */
  template <class Within, class Visit>
  void ForEachNear(const HullTree& hulls, const Times& times, double reach, const Within& within,
                   const Visit& visit) const {
    const double hair = BoxTree::kHair * (SizeIn(times) + hulls.size() + reach);
    halves_.Search(
        hulls,
        [&](const HullTree::Node& some, const Node& node, double) { return SquareOfDistanceIn(times, some, node); },
        BoxTree::FarBy(hair, reach, within), visit);
  }

 private:
  struct Node {
    std::array<double, kLaneCount> lower{}, upper{}, slow{}, fast{};  // m and m/s; unused coordinates are 0
    double growth = 0, bend = 0, speed = 0;                           // m/s, m/s^2; the largest |velocity|, m/s
    std::int64_t time_us = 0, from_us = 0, until_us = 0;              // its own; the windows of all
    std::int32_t first = 0, count = 0;
  };

  [[nodiscard]] static Node Around(std::span<const Obstacle* const> obstacles, std::span<const std::int32_t> some,
                                   std::int64_t reference_us) noexcept;
  // An upper bound on all numbers from which a distance is found in these times.
  [[nodiscard]] double SizeIn(const Times& times) const noexcept;

  // A hull is left out if all of its units are. During one that meets a window, times are within a unit of the window.
  [[nodiscard]] FOREREACH_INLINE static double SquareOfDistanceIn(const Times& times, const HullTree::Node& hulls,
                                                                  const Node& node) noexcept {
    const auto& [start_us, step_us, error_us] = times.schedule;
    const int sample = times.first + hulls.first;
    std::int64_t from = start_us + sample * step_us - error_us,
                 until = start_us + (sample + hulls.count - 1 + times.span) * step_us + error_us;
    if (until < node.from_us || node.until_us < from) return -1;
    const std::int64_t unit = times.span * step_us + 2 * error_us;
    if (from < node.from_us) from = std::max(from, node.from_us - unit);
    if (until > node.until_us) until = std::min(until, node.until_us + unit);
    const double first = 1e-6 * static_cast<double>(from - node.time_us),
                 last = 1e-6 * static_cast<double>(until - node.time_us);
    const Lanes slow = LoadLanes(node.slow.data()), fast = LoadLanes(node.fast.data());
    const Lanes ends[] = {AllLanes(first) * slow, AllLanes(first) * fast, AllLanes(last) * slow, AllLanes(last) * fast};
    // The largest growth goes with all places, as in Meet.
    const double tau = std::max(-first, last);
    const Lanes added =
        AllLanes(tau * (node.growth + tau * node.bend / 2) + 1e-6 * static_cast<double>(error_us) * node.speed);
    return SquareOfDistance(hulls,
                            LoadLanes(node.lower.data()) + Min(Min(ends[0], ends[1]), Min(ends[2], ends[3])) - added,
                            LoadLanes(node.upper.data()) + Max(Max(ends[0], ends[1]), Max(ends[2], ends[3])) + added);
  }

  Halves<Node> halves_;
  // The largest of all, in m, m/s and m/s^2; stamps and times of nodes.
  double place_ = 0, speed_ = 0, growth_ = 0, bend_ = 0;
  std::int64_t earliest_us_ = 0, latest_us_ = 0;
};

}  // namespace forereach
