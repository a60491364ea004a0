/** A hierarchy over boxes in R^p, four to a node: it finds those near a hull without a look at the others. */
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
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

class BoxTree final {
 public:
  // Far above all rounding here and in SeparateHulls, relative to their operands.
  static constexpr double kHair = 0x1p-40;

  /** Four boxes, center +- half_width for each coordinate. */
  struct Four {
    std::array<std::array<double, kLaneCount>, kMaxSafetyDim> center{}, half_width{};
  };

  BoxTree() = default;
  /** @pre lower <= upper, and 1 <= dim <= kMaxSafetyDim. Cost O(n log n). */
  BoxTree(std::span<const Bounds> boxes, int dim);

  /** Calls visit(i, least) for boxes i, each at most once and about from near to far, with a lower bound on their
  distance, up to rounding. A box that is left out is further from the hull than `reach` + `within()`, by more than what
  SeparateHulls may lose by rounding. `within()` is asked on the way and may fall; what is below 0 counts as 0. It
  allocates nothing. Cost about O(log n + boxes visited). @param gap gap(boxes) gives lower bounds, up to such rounding,
  on what a set within the hull is from Four boxes; they may be closer to the distance than those of the hull. Negative:
  nothing is known. */
  template <class Within, class Visit, class Gap>
  void ForEachNear(const Hull& hull, double reach, const Within& within, const Visit& visit, Gap gap) const {
    if (nodes_.empty()) return;
    struct Entry {
      std::int32_t node;
      double square;
    };
    std::array<Entry, kMostEntries> stack;
    std::size_t count = 0;
    const auto far = FarBy(kHair * (size_ + SizeOf(hull, dim_) + reach), reach, within);
    double most_square;
    const auto measure = [&] {
      const double most = far();
      most_square = std::max(most * most, 0x1p-800);  // smaller squares may have lost digits
    };
    measure();
    std::int32_t at = 0;
    while (true) {
      const Node& node = nodes_[ToSize(at)];
      Lanes square = SquareOfDistance(hull, node.boxes);
      const auto is_near = [&] { return BitsOf(~(square > AllLanes(most_square))) & node.used; };
      unsigned near = is_near();
      if (near != 0 && node.is_low) {
        square = Closer(square, gap(node.boxes));
        near = is_near();
      }
      if (near != 0) {
        std::array<double, kLaneCount> squares;
        StoreLanes(square, squares.data());
        auto nearest = ToSize(std::countr_zero(near));
        if (!node.is_leaf) {
          for (near &= near - 1; near != 0; near &= near - 1) {
            auto other = ToSize(std::countr_zero(near));
            if (squares[other] < squares[nearest]) std::swap(nearest, other);
            stack[count++] = {node.children[other], squares[other]};
          }
          at = node.children[nearest];
          continue;
        }
        for (; near != 0; near &= near - 1) {
          const auto lane = ToSize(std::countr_zero(near));
          if (squares[lane] > most_square) continue;
          visit(node.children[lane], std::sqrt(squares[lane]));
          measure();
        }
      }
      do {
        if (count == 0) return;
        at = stack[--count].node;
      } while (stack[count].square > most_square);
    }
  }
  template <class Within, class Visit>
  void ForEachNear(const Hull& hull, double reach, const Within& within, const Visit& visit) const {
    ForEachNear(
        hull, reach, within, visit, [](const Four&) __attribute__((always_inline)) { return AllLanes(-1); });
  }

  /** A box that is about as near as any. */
  struct Found {
    std::int32_t box = -1;      ///< -1: there is none.
    double square = kInfinity;  ///< of its distance, about
  };
  /** Follows the nearest node on each level. @param gap as above. */
  template <class Gap>
  [[nodiscard]] FOREREACH_INLINE Found FindNear(const Hull& hull, Gap gap) const noexcept {
    if (nodes_.empty()) return {};
    for (std::int32_t at = 0;;) {
      const Node& node = nodes_[ToSize(at)];
      Lanes square = SquareOfDistance(hull, node.boxes);
      if (node.is_low) square = Closer(square, gap(node.boxes));
      std::array<double, kLaneCount> squares;
      StoreLanes(square, squares.data());
      std::size_t nearest = 0;
      for (std::size_t lane = 1; lane < kLaneCount; ++lane)
        if (squares[lane] < squares[nearest] && (node.used >> lane & 1) != 0) nearest = lane;
      if (node.is_leaf) return {node.children[nearest], squares[nearest]};
      at = node.children[nearest];
    }
  }

  /** How far things have to be from each other to be left out. */
  template <class Within>
  [[nodiscard]] static auto FarBy(double hair, double reach, const Within& within) {
    return [=, &within] {
      const double least = within();
      return (reach + (least > 0 ? least : 0) + hair) * (1 + kHair);
    };
  }
  /** The sum of |center| + half-width of a hull. */
  [[nodiscard]] static double SizeOf(const Hull& hull, int dim) noexcept {
    double size = 0;
    for (std::size_t k = 0; k < ToSize(dim); ++k) size += std::abs(hull.center[k]) + hull.half_width[k];
    return size;
  }

  /** An upper bound on the absolute values of the coordinates. */
  [[nodiscard]] double size() const { return size_; }

 private:
  static constexpr std::size_t kMostEntries = 64;  // three on each level, and 4^16 boxes

  struct Node {
    Four boxes;                                       // around its children, or theirs
    std::array<std::int32_t, kLaneCount> children{};  // nodes; in a leaf, boxes
    unsigned used = 0;                                // a bit for each of them
    bool is_leaf = false, is_low = false;             // the latter: its children are leaves, or it is one
  };

  // The larger of two bounds, one of them as a square.
  [[nodiscard]] FOREREACH_INLINE static Lanes Closer(const Lanes& square, const Lanes& gap) noexcept {
    const Lanes its_square = gap * gap;
    return ((gap > AllLanes(0)) & (its_square > square)) ? its_square : square;
  }
  // What is not a number is no distance.
  [[nodiscard]] FOREREACH_INLINE Lanes SquareOfDistance(const Hull& hull, const Four& boxes) const noexcept {
    const auto square = [&](std::size_t k) __attribute__((always_inline)) {
      const Lanes apart = Abs(LoadLanes(boxes.center[k].data()) - AllLanes(hull.center[k])) -
                          (LoadLanes(boxes.half_width[k].data()) + AllLanes(hull.half_width[k]));
      const Lanes gap = Max(apart, AllLanes(0));
      return gap * gap;
    };
    if (dim_ == 2) return square(0) + square(1);
    return dim_ == 1 ? square(0) : square(0) + square(1) + square(2);
  }

  // Gives the number of the node that it makes.
  std::int32_t Add(std::span<const Bounds> boxes, std::span<std::int32_t> some);

  int dim_ = 0;
  double size_ = 0;
  std::vector<Node> nodes_;
};

}  // namespace forereach
