/** A hierarchy over boxes in R^p: it finds those near a hull without a look at the others. */
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "forereach/numerics/directed.h"
#include "forereach/numerics/size.h"
#include "forereach/safety/separation.h"

namespace forereach {

/** {y : lower <= y <= upper}, metres; unused coordinates are 0. */
struct Bounds {
  std::array<double, kMaxSafetyDim> lower{}, upper{};
};

class BoxTree final {
 public:
  BoxTree() = default;
  /** @pre lower <= upper, and 1 <= dim <= kMaxSafetyDim. Cost O(n log^2 n). */
  BoxTree(std::span<const Bounds> boxes, int dim);

  /** Calls visit(i) for the boxes i, each at most once and about from near to far. A box that is left out is further
  from the hull than `reach` + `within()`, by more than what SeparateHulls may lose by rounding. `within()` is asked on
  the way and may fall; what is below 0 counts as 0. It allocates nothing. Cost O(log n + boxes visited), about. */
  template <class Within, class Visit>
  void ForEachNear(const Hull& hull, double reach, const Within& within, const Visit& visit) const {
    if (nodes_.empty()) return;
    const Query query(hull, dim_);
    const double hair = kHair * (size_ + query.size + reach);
    struct Entry {
      std::int32_t node;
      double distance;
    };
    std::array<Entry, 2 * kMostLevels> stack{};
    std::size_t count = 0;
    stack[count++] = {0, query.DistanceLower(nodes_[0], dim_)};
    while (count > 0) {
      const auto [number, distance] = stack[--count];
      const double least = within();
      if (distance * (1 - kHair) - hair > reach + (least > 0 ? least : 0)) continue;
      const Node& node = nodes_[ToSize(number)];
      if (node.count > 0) {
        for (int i = node.first; i < node.first + node.count; ++i) visit(order_[ToSize(i)]);
        continue;
      }
      Entry near{number + 1, query.DistanceLower(nodes_[ToSize(number + 1)], dim_)},
          far{node.first, query.DistanceLower(nodes_[ToSize(node.first)], dim_)};
      if (far.distance < near.distance) std::swap(near, far);
      stack[count++] = far;
      stack[count++] = near;
    }
  }

  [[nodiscard]] bool empty() const { return nodes_.empty(); }

 private:
  static constexpr int kLeaf = 4;              // boxes in a leaf, at most
  static constexpr std::size_t kMostLevels = 40;  // halves of at most 2^31 boxes
  // Far above all rounding here and in SeparateHulls, relative to their operands.
  static constexpr double kHair = 0x1p-40;

  struct Node {
    Bounds bounds;
    std::int32_t first = 0;  // of a leaf its first place in order_; otherwise its second child; the first follows it
    std::int32_t count = 0;  // boxes of a leaf; otherwise 0
  };

  // The ends of a hull, in plain arithmetic.
  struct Query {
    Query(const Hull& hull, int dim) {
      for (std::size_t k = 0; k < ToSize(dim); ++k) {
        ends.lower[k] = hull.center[k] - hull.half_width[k];
        ends.upper[k] = hull.center[k] + hull.half_width[k];
        size += std::abs(hull.center[k]) + hull.half_width[k];
      }
    }
    // Of the boxes. What is not a number is no distance.
    [[nodiscard]] double DistanceLower(const Node& node, int dim) const {
      double square = 0;
      for (std::size_t k = 0; k < ToSize(dim); ++k) {
        const double below = node.bounds.lower[k] - ends.upper[k], above = ends.lower[k] - node.bounds.upper[k];
        const double gap = below > above ? below : above;
        square += gap > 0 ? gap * gap : 0;
      }
      return square > 0x1p-800 && square < kInfinity ? std::sqrt(square) : 0;
    }
    Bounds ends;
    double size = 0;
  };

  void Build(std::span<const Bounds> boxes, std::int32_t first, std::int32_t count);

  int dim_ = 1;
  double size_ = 0;  // of the coordinates
  std::vector<Node> nodes_;
  std::vector<std::int32_t> order_;  // the boxes, leaf by leaf
};

}  // namespace forereach
