/** A hierarchy over boxes in R^p: it finds those near the hulls of a tube without a look at the others. */
#pragma once

#include <array>
#include <cstdint>
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

class BoxTree final {
 public:
  BoxTree() = default;
  /** @pre lower <= upper, and 1 <= dim <= kMaxSafetyDim. Cost O(n log^2 n). */
  BoxTree(std::span<const Bounds> boxes, int dim);

  /** Calls visit(t, i) for hulls t and boxes i, each pair at most once and about from near to far. A pair that is left
  out is further apart than `reach` + `within()`, by more than what SeparateHulls may lose by rounding. `within()` is
  asked on the way and may fall; what is below 0 counts as 0. It allocates nothing. Cost about O(log n + pairs
  visited). */
  template <class Within, class Visit>
  void ForEachNear(const HullTree& hulls, double reach, const Within& within, const Visit& visit) const {
    if (nodes_.empty()) return;
    struct Entry {
      std::int32_t hulls, boxes;
      double square;  // of the distance
    };
    const auto entry = [&](std::int32_t t, std::int32_t i) {
      return Entry{t, i, SquareOfDistance(hulls.node(t), nodes_[ToSize(i)])};
    };
    const double hair = kHair * (size_ + hulls.size() + reach);
    std::array<Entry, 2 * kMostLevels> stack;
    std::size_t count = 0;
    const auto push = [&](Entry first, Entry second) {
      if (second.square < first.square) std::swap(first, second);
      stack[count++] = second;
      stack[count++] = first;
    };
    stack[count++] = entry(0, 0);
    while (count > 0) {
      const auto [t, i, square] = stack[--count];
      const double least = within(), far = (reach + (least > 0 ? least : 0) + hair) * (1 + kHair);
      if (square > far * far) continue;
      const HullTree::Node& some = hulls.node(t);
      const Node& node = nodes_[ToSize(i)];
      const bool is_unit = some.count == 1, is_leaf = node.count > 0;
      if (is_unit && is_leaf)
        for (int place = node.first; place < node.first + node.count; ++place) visit(some.first, order_[ToSize(place)]);
      else if (is_leaf || (!is_unit && Extent(some) >= Extent(node)))
        push(entry(t + 1, i), entry(some.second, i));
      else
        push(entry(t, i + 1), entry(t, node.first));
    }
  }

  /** An upper bound on the absolute values of the coordinates. */
  [[nodiscard]] double size() const { return size_; }

 private:
  static constexpr int kLeaf = 2;  // boxes in a leaf, at most
  static constexpr std::size_t kMostLevels =
      48;  // of both hierarchies together: halves of 2^31 boxes and of kMost hulls
  // Far above all rounding here and in SeparateHulls, relative to their operands.
  static constexpr double kHair = 0x1p-40;

  struct Node {
    std::array<double, kLaneCount> lower{}, upper{};  // unused coordinates are 0
    std::int32_t first = 0;  // of a leaf its first place in order_; otherwise its second child; the first follows it
    std::int32_t count = 0;  // boxes of a leaf; otherwise 0
  };

  // What is not a number is no distance, nor is what is too small or too large for its square.
  [[nodiscard]] FOREREACH_INLINE static double SquareOfDistance(const HullTree::Node& a, const Node& b) noexcept {
    const Lanes below = LoadLanes(b.lower.data()) - LoadLanes(a.upper.data()),
                above = LoadLanes(a.lower.data()) - LoadLanes(b.upper.data());
    const Lanes gap = Max(Max(below, above), AllLanes(0));
    const double square = Sum(gap * gap);
    return square > 0x1p-800 && square < kInfinity ? square : 0;
  }
  template <class Box>
  [[nodiscard]] static double Extent(const Box& box) noexcept {
    return box.upper[0] - box.lower[0] + (box.upper[1] - box.lower[1]) + (box.upper[2] - box.lower[2]);
  }

  void Build(std::span<const Bounds> boxes, std::int32_t first, std::int32_t count);

  int dim_ = 1;
  double size_ = 0;  // of the coordinates
  std::vector<Node> nodes_;
  std::vector<std::int32_t> order_;  // the boxes, leaf by leaf
};

}  // namespace forereach
