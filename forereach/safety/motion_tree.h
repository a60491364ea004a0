/** A hierarchy over obstacles that move: it finds those near the hulls of a tube, each hull at its own times.

A node is a box that moves and grows. All of its obstacles that are somewhere at the time of the node plus tau seconds
lie, at that time, in
    [lower + min(tau slow, tau fast) - g, upper + max(tau slow, tau fast) + g],    g = growth |tau| + bend tau^2 / 2. */
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "forereach/safety/box_tree.h"
#include "forereach/safety/motion.h"
#include "forereach/safety/obstacle.h"

namespace forereach {

/** A hierarchy over the hulls of a tube, in the order of time. Without hulls until Build; it allocates nothing. */
class HullTree final {
 public:
  static constexpr int kMost = kMaxSteps + 1;

  struct Node {
    std::array<double, kLaneCount> lower, upper;  // unused coordinates are 0
    std::int32_t first, count;                    // hulls
    std::int32_t second;                          // child; the first follows the node
  };

  /** Replaces the hulls, in plain arithmetic: MotionTree allows for its rounding. @pre 1 to kMost hulls. */
  void Build(std::span<const Hull> hulls, int dim) noexcept;
  [[nodiscard]] const Node& node(int number) const { return nodes_[ToSize(number)]; }
  /** The largest |center| + half-width, summed over the coordinates. */
  [[nodiscard]] double size() const { return size_; }

 private:
  int Build(std::span<const Hull> hulls, int dim, int first, int count) noexcept;

  std::array<Node, 2 * kMost> nodes_;  // those in use are set
  int num_nodes_ = 0;
  double size_ = 0;
};

/** Things in nested halves, and around each half a node: {lower, upper, first, count}, where `first` is a place in the
order of a leaf's `count` things, and of another node, whose count is 0, its second child; the first one follows it. */
template <class Node>
class Halves final {
 public:
  Halves() = default;
  /** @param places of the things, each half is cut where they are spread the widest. @param enclose makes the node
  around the things of a list. Cost O(n log n) and, for each of them, a node on each of log2 n levels. */
  template <std::size_t kAxes, class Enclose>
  Halves(const std::vector<std::array<double, kAxes>>& places, const Enclose& enclose) : order_(places.size()) {
    std::iota(order_.begin(), order_.end(), 0);
    nodes_.reserve(places.size());
    if (!places.empty()) Cut(places, enclose, 0, static_cast<std::int32_t>(places.size()));
  }

  /** Calls visit(t, i) for hulls t and things i, each pair at most once and about from near to far. Left out are those
  whose nodes have a `square_of(hulls, node)` of their distance that is negative, never, or above that of `far()`, which
  may fall on the way. It allocates nothing. */
  template <class Square, class Far, class Visit>
  void Search(const HullTree& hulls, const Square& square_of, const Far& far, const Visit& visit) const {
    if (nodes_.empty()) return;
    struct Entry {
      std::int32_t hulls, things;
      double square;
    };
    std::array<Entry, kMostLevels> stack;
    std::size_t count = 0;
    double most = far(), most_square = most * most;  // only a visit lowers them
    const auto entry = [&](std::int32_t t, std::int32_t i) {
      return Entry{t, i, square_of(hulls.node(t), nodes_[ToSize(i)])};
    };
    const auto is_near = [&](const Entry& some) { return !(some.square < 0 || some.square > most_square); };
    Entry at = entry(0, 0);
    while (true) {
      if (is_near(at)) {
        const auto [t, i, square] = at;
        const HullTree::Node& some = hulls.node(t);
        const Node& node = nodes_[ToSize(i)];
        const bool is_unit = some.count == 1, is_leaf = node.count > 0;
        if (!is_unit || !is_leaf) {
          const bool cuts_hulls = is_leaf || (!is_unit && Extent(some) >= Extent(node));
          at = cuts_hulls ? entry(t + 1, i) : entry(t, i + 1);
          Entry other = cuts_hulls ? entry(some.second, i) : entry(t, node.first);
          if (other.square < at.square) std::swap(at, other);
          if (is_near(other)) stack[count++] = other;
          continue;
        }
        for (int place = node.first; place < node.first + node.count; ++place) visit(some.first, order_[ToSize(place)]);
        most = far();
        most_square = most * most;
      }
      if (count == 0) return;
      at = stack[--count];
    }
  }

 private:
  static constexpr std::int32_t kLeaf = 2;        // things in a leaf, at most
  static constexpr std::size_t kMostLevels = 48;  // of both hierarchies: 2^31 things and kMost hulls

  template <class Box>
  [[nodiscard]] static double Extent(const Box& box) noexcept {
    return box.upper[0] - box.lower[0] + (box.upper[1] - box.lower[1]) + (box.upper[2] - box.lower[2]);
  }

  template <std::size_t kAxes, class Enclose>
  void Cut(const std::vector<std::array<double, kAxes>>& places, const Enclose& enclose, std::int32_t first,
           std::int32_t count) {
    const auto begin = order_.begin() + first, end = begin + count;
    const auto number = nodes_.size();
    nodes_.push_back(enclose(std::span<const std::int32_t>(&*begin, ToSize(count))));
    if (count <= kLeaf) {
      nodes_[number].first = first;
      nodes_[number].count = count;
      return;
    }
    std::size_t widest = 0;
    double most = -kInfinity;
    for (std::size_t k = 0; k < kAxes; ++k) {
      const auto by = [&](std::int32_t i) { return places[ToSize(i)][k]; };
      const auto [least, largest] = std::ranges::minmax_element(begin, end, {}, by);
      if (const double spread = by(*largest) - by(*least); spread > most) {
        most = spread;
        widest = k;
      }
    }
    const std::int32_t half = count / 2;
    // Equal places by their numbers: the tree, and so the first obstacle that is named, is the same on every machine.
    std::ranges::nth_element(begin, begin + half, end, {},
                             [&](std::int32_t i) { return std::pair(places[ToSize(i)][widest], i); });
    Cut(places, enclose, first, half);
    nodes_[number].first = static_cast<std::int32_t>(nodes_.size());
    Cut(places, enclose, first + half, count - half);
  }

  std::vector<Node> nodes_;
  std::vector<std::int32_t> order_;  // the things, leaf by leaf
};

/** How far two boxes are from each other, squared. What is not a number is no distance, nor is what is too small or too
large for its square. @param lower, upper the ends of the other one. */
[[nodiscard]] FOREREACH_INLINE double SquareOfDistance(const HullTree::Node& a, const Lanes& lower,
                                                       const Lanes& upper) noexcept {
  const Lanes gap = Max(Max(lower - LoadLanes(a.upper.data()), LoadLanes(a.lower.data()) - upper), AllLanes(0));
  const double square = Sum(gap * gap);  // NaN: 0
  return square > 0x1p-800 && square < kInfinity ? square : 0;
}

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
  /** As BoxTree::ForEachNear, for each hull: visit(t, i). An obstacle that is left out is nowhere during the hull's
  samples, or further away than `reach` + `within()` by SeparateHulls, as it is seen from the obstacle (Meet). */
  template <class Within, class Visit>
  void ForEachNear(const HullTree& hulls, const Times& times, double reach, const Within& within,
                   const Visit& visit) const {
    const double hair = BoxTree::kHair * (SizeIn(times) + hulls.size() + reach);
    halves_.Search(
        hulls, [&](const HullTree::Node& some, const Node& node) { return SquareOfDistanceIn(times, some, node); },
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
