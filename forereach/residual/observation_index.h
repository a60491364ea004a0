/** The observations of one residual coordinate k in blocks of eight, four blocks to a leaf, under a tree with eight
children to a node.

An entry i has K coordinates alpha_i (lipschitz_row.h), a floor and a ceiling: floor_i <= r_k(z_i) <= ceiling_i. Side 0
has the values v_i = floor_i, side 1 has v_i = -ceiling_i, so both sides ask for a maximum. Entries that are close in
space are close in memory. For each child and each side, a node bounds v_i - d(alpha, alpha_i) over the entries below,
for any alpha, in one of two shapes:
- lifted, if d is an infinity norm: max_i v_i, and for each coordinate c max_i (v_i - alpha_ic) and max_i (v_i +
  alpha_ic), because v_i - d <= max_i (v_i -+ alpha_ic) +- alpha_c. Unlike a box, this relates a value to its place.
- boxed, if d is a 1-norm: max_i v_i, and for each coordinate the interval of the alpha_ic.

Immutable, so any number of threads may read it. Memory: 8 (K + 2) + 4 bytes an entry, and up to a fifth of that for the
tree. Set-up: O(K N log N), half a second for 10^6 entries in two coordinates. */
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "forereach/numerics/lanes.h"
#include "forereach/numerics/size.h"
#include "forereach/residual/lipschitz_row.h"
#include "forereach/residual/observations.h"

namespace forereach {

class ObservationIndex final {
 public:
  static constexpr std::uint32_t kNone = 0xffffffff;
  /** A child that is missing, or taken already, has a bound at or below this. TagLanes changes the last bits of bounds,
  so none is compared with -kMaxDouble itself. A child that exists has a higher bound: callers search only where no sum
  exceeds 2^960. */
  static constexpr double kMissing = -0x1p1023;
  /** Levels of nodes over 2^32 entries. */
  static constexpr int kMaxHeight = 10;
  static constexpr std::size_t kLeafBlocks = 4;
  static constexpr std::size_t kLeafSize = kLeafBlocks * kPackSize;

  enum class Shape { kLifted, kBoxed };

  /** The entries of coordinate k, in the order of their ids 0, 1, ... */
  struct Entries {
    Shape shape;
    std::size_t num_coordinates;      // K
    std::vector<double> coordinates;  // N-by-K, entry by entry
    std::vector<double> floors, ceilings;
  };

  ObservationIndex() = default;
  /** @pre between 1 and 2^32 - 2 entries, at least one coordinate. */
  explicit ObservationIndex(const Entries& entries);

  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] std::size_t num_coordinates() const { return num_coordinates_; }
  /** The number of blocks with an entry. */
  [[nodiscard]] std::size_t num_blocks() const { return (size_ + kPackSize - 1) / kPackSize; }
  [[nodiscard]] std::size_t num_leaves() const { return (size_ + kLeafSize - 1) / kLeafSize; }
  /** Levels of nodes, at least one. The highest has one node. */
  [[nodiscard]] int height() const { return static_cast<int>(levels_.size()); }

  /** K packs of coordinates, then a pack of values for each side. A lane without an entry has the value -infinity, also
  in the blocks that fill the last leaf. */
  [[nodiscard]] const Pack* block(std::size_t b) const { return blocks_.data() + b * block_packs(); }
  [[nodiscard]] const Pack* leaf(std::size_t i) const { return block(i * kLeafBlocks); }
  [[nodiscard]] std::size_t block_packs() const { return num_coordinates_ + 2; }
  /** Eight ids, kNone in a lane without an entry. */
  [[nodiscard]] const std::uint32_t* ids(std::size_t b) const { return ids_.data() + b * kPackSize; }

  /** Node i of level 1..height(), its packs with a lane for each child. Its children are 8 i .. 8 i + 7 of the level
  below; below level 1 are the leaves.
  - Lifted: for each side, max (v - alpha_c) and max (v + alpha_c) of each c, then max v.
  - Boxed: max v of each side, then the lowest and the highest alpha_c of each c.
  A missing child has -kMaxDouble for every maximum. */
  [[nodiscard]] const Pack* node(int level, std::size_t i) const {
    return nodes_.data() + (levels_[ToSize(level - 1)] + i) * node_packs();
  }
  [[nodiscard]] std::size_t num_nodes(int level) const {
    return level < height() ? levels_[ToSize(level)] - levels_[ToSize(level - 1)] : 1;
  }
  [[nodiscard]] std::size_t node_packs() const {
    return shape_ == Shape::kLifted ? 4 * num_coordinates_ + 2 : 2 * num_coordinates_ + 2;
  }
  [[nodiscard]] Shape shape() const { return shape_; }

 private:
  class Builder;

  Shape shape_ = Shape::kBoxed;
  std::size_t size_ = 0, num_coordinates_ = 0;
  std::vector<Pack> blocks_, nodes_;
  std::vector<std::uint32_t> ids_;
  std::vector<std::size_t> levels_;  // the first node of each level
};

/** The largest |floor| and |ceiling|. */
[[nodiscard]] double LargestValue(const ObservationIndex::Entries& entries);

/** The entries of coordinate k = `coordinate`: floors r~_ik - eps_k and ceilings r~_ik + eps_k, rounded outward, with
eps_k = Declaration::ObservationError, and their coordinates in plain arithmetic.
@tparam Rows Observations or LastRows. */
template <class Rows>
[[nodiscard]] ObservationIndex::Entries EntriesOf(const LipschitzRow& row, const Declaration& declaration,
                                                  const Rows& observations, int coordinate);

}  // namespace forereach
