/** A hierarchy over boxes in R^p: it finds those near the hulls of a tube without a look at the others. Its parts serve
motion_tree.h, too. */
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "forereach/numerics/directed.h"
#include "forereach/numerics/lanes.h"
#include "forereach/numerics/size.h"
#include "forereach/safety/separation.h"

namespace forereach {

/** {y : lower <= y <= upper}, metres; unused coordinates are 0. */
struct Bounds {
  std::array<double, kMaxSafetyDim> lower{}, upper{};
};

/** A hierarchy over the hulls of a tube, in the order of time. Without hulls until Build; it allocates nothing. */
class HullTree final {
 public:
  static constexpr int kMost = kMaxSteps + 1;

  struct Node {
    std::array<double, kLaneCount> lower, upper;  // unused coordinates are 0
    std::int32_t first, count;                    // hulls
    std::int32_t second;                          // child; the first follows the node
  };

  /** Replaces the hulls, in plain arithmetic: BoxTree allows for its rounding. @pre 1 to kMost hulls. */
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
  whose nodes have a `square_of(hulls, node, most)` of their distance that is negative, never, or above `most`, that of
  `far()`, which may fall on the way. It allocates nothing. */
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
      return Entry{t, i, square_of(hulls.node(t), nodes_[ToSize(i)], most_square)};
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

class BoxTree final {
 public:
  // Far above all rounding here and in SeparateHulls, relative to their operands.
  static constexpr double kHair = 0x1p-40;

  BoxTree() = default;
  /** @pre lower <= upper, and 1 <= dim <= kMaxSafetyDim. Cost O(n log n). */
  BoxTree(std::span<const Bounds> boxes, int dim);

  /** Calls visit(t, i) for hulls t and boxes i, each pair at most once and about from near to far. A pair that is left
  out is further apart than `reach` + `within()`, by more than what SeparateHulls may lose by rounding. `within()` is
  asked on the way and may fall; what is below 0 counts as 0. It allocates nothing. Cost about O(log n + pairs
  visited). @param gap gap(t, lower, upper) is a lower bound, up to such rounding, on what hull t's own set is from the
  box with these ends; it may be closer to the distance than that of the hull. Negative: nothing is known. */
  template <class Within, class Visit, class Gap>
  void ForEachNear(const HullTree& hulls, double reach, const Within& within, const Visit& visit,
                   const Gap& gap) const {
    halves_.Search(
        hulls,
        [&](const HullTree::Node& some, const Node& node, double most) __attribute__((always_inline)) {
          const Lanes lower = LoadLanes(node.lower.data()), upper = LoadLanes(node.upper.data());
          const double square = SquareOfDistance(some, lower, upper);
          if (some.count > 1 || square > most) return square;
          const double own = gap(some.first, lower, upper);
          return own > 0 && own * own > square ? own * own : square;
        },
        FarBy(kHair * (size_ + hulls.size() + reach), reach, within), visit);
  }
  template <class Within, class Visit>
  void ForEachNear(const HullTree& hulls, double reach, const Within& within, const Visit& visit) const {
    ForEachNear(hulls, reach, within, visit, [](int, const Lanes&, const Lanes&) { return -1.0; });
  }
  /** How far nodes have to be from each other to be left out. */
  template <class Within>
  [[nodiscard]] static auto FarBy(double hair, double reach, const Within& within) {
    return [=, &within] {
      const double least = within();
      return (reach + (least > 0 ? least : 0) + hair) * (1 + kHair);
    };
  }

  /** An upper bound on the absolute values of the coordinates. */
  [[nodiscard]] double size() const { return size_; }

 private:
  struct Node {
    std::array<double, kLaneCount> lower{}, upper{};  // unused coordinates are 0
    std::int32_t first = 0, count = 0;
  };

  double size_ = 0;
  Halves<Node> halves_;
};

}  // namespace forereach
