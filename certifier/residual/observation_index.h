/** Observations of one residual coordinate, in blocks of eight under a tree of eight children a node.

An entry has K coordinates (lipschitz_row.h), a floor and a ceiling: floor <= r_k(z_i) <= ceiling. Ceilings are stored
negated, so that both sides ask for a maximum. Blocks that are close in memory are close in space; a node knows of each
child the box of its coordinates and its highest floor and lowest ceiling.

Immutable: any number of threads may read it. Memory 8 (K + 2) + 4 bytes an entry and a quarter of that for the tree; set-up
O(K N log N), about a second for 10^6 entries. */
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "certifier/numerics/simd.h"

namespace forereach {

class ObservationIndex final {
 public:
  static constexpr std::uint32_t kNone = 0xffffffff;
  /** Levels of nodes over 2^32 entries. */
  static constexpr int kMaxHeight = 10;

  /** One row's entries, in the order of their ids 0, 1, ... */
  struct Entries {
    std::size_t num_coordinates;       // K
    std::vector<double> coordinates;   // N-by-K, entry by entry
    std::vector<double> floors, ceilings;
  };

  ObservationIndex() = default;
  /** @pre between 1 and 2^32 - 2 entries. */
  explicit ObservationIndex(const Entries& entries);

  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] std::size_t num_coordinates() const { return num_coordinates_; }
  [[nodiscard]] std::size_t num_blocks() const { return ids_.size() / simd::kLanes; }
  /** Levels of nodes, the blocks not counted; at least one. The highest has one node. */
  [[nodiscard]] int height() const { return static_cast<int>(levels_.size()); }

  /** K packs of coordinates, one of floors, one of negated ceilings. A lane without an entry has minus infinity in both. */
  [[nodiscard]] const simd::Pack* block(std::size_t b) const { return blocks_.data() + b * block_packs(); }
  [[nodiscard]] std::size_t block_packs() const { return num_coordinates_ + 2; }
  /** Eight ids, kNone in a lane without an entry. */
  [[nodiscard]] const std::uint32_t* ids(std::size_t b) const { return ids_.data() + b * simd::kLanes; }

  /** Node i of level 1..height(): for each coordinate a pack of the children's lowest and one of their highest, then
  their highest floors, then their highest negated ceilings; minus infinity for a child that is not there. Its children
  are 8 i .. 8 i + 7 of the level below; below level 1 are the blocks. */
  [[nodiscard]] const simd::Pack* node(int level, std::size_t i) const {
    return nodes_.data() + (levels_[static_cast<std::size_t>(level - 1)] + i) * node_packs();
  }
  [[nodiscard]] std::size_t node_packs() const { return 2 * num_coordinates_ + 2; }

 private:
  class Builder;

  std::size_t size_ = 0, num_coordinates_ = 0;
  std::vector<simd::Pack> blocks_, nodes_;
  std::vector<std::uint32_t> ids_;
  std::vector<std::size_t> levels_;  // the first node of each level
};

}  // namespace forereach
