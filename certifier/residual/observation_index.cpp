#include "certifier/residual/observation_index.h"

#include <algorithm>
#include <limits>
#include <numeric>

namespace forereach {

using simd::kLanes;
using simd::Pack;

namespace {

constexpr double kMinusInfinity = -std::numeric_limits<double>::infinity();

double Lowest(const Pack& pack, std::size_t used) {
  double lowest = -kMinusInfinity;
  for (std::size_t lane = 0; lane < used; ++lane) lowest = std::min(lowest, pack.at(lane));
  return lowest;
}

double Highest(const Pack& pack, std::size_t used) {
  double highest = kMinusInfinity;
  for (std::size_t lane = 0; lane < used; ++lane) highest = std::max(highest, pack.at(lane));
  return highest;
}

}  // namespace

class ObservationIndex::Builder {
 public:
  Builder(const Entries& entries, ObservationIndex& index)
      : entries_(entries), index_(index), count_(entries.floors.size()), keys_(count_) {
    for (std::size_t i = 0; i < count_; ++i) keys_[i].id = static_cast<std::uint32_t>(i);
    Arrange(0, count_);
    StoreBlocks();
    do {
      StoreLevel();
    } while (index_.nodes_.size() > (index_.levels_.back() + 1) * index_.node_packs());
  }

 private:
  struct Key {
    double at;
    std::uint32_t id;
  };

  // Orders entries [first, first + count), a subtree of its own: all children but the last are full.
  void Arrange(std::size_t first, std::size_t count) {
    if (count <= kLanes) return;
    std::size_t child = kLanes;
    while (child * kLanes < count) child *= kLanes;
    Divide(first, count, child);
  }

  // Halves the number of children across the widest coordinate until one is left.
  void Divide(std::size_t first, std::size_t count, std::size_t child) {
    const std::size_t children = (count + child - 1) / child;
    if (children == 1) return Arrange(first, count);
    const std::size_t left = children / 2 * child, k = WidestCoordinate(first, count);
    const auto begin = keys_.begin() + static_cast<std::ptrdiff_t>(first), end = begin + static_cast<std::ptrdiff_t>(count);
    for (auto key = begin; key != end; ++key) key->at = Coordinate(key->id, k);
    std::nth_element(begin, begin + static_cast<std::ptrdiff_t>(left), end,
                     [](const Key& a, const Key& b) { return a.at != b.at ? a.at < b.at : a.id < b.id; });
    Divide(first, left, child);
    Divide(first + left, count - left, child);
  }

  // By a sample, which is enough to choose by.
  std::size_t WidestCoordinate(std::size_t first, std::size_t count) const {
    constexpr std::size_t kSample = 64;
    const std::size_t stride = count / kSample + 1;
    std::size_t widest = 0;
    double width = -1;
    for (std::size_t k = 0; k < entries_.num_coordinates; ++k) {
      double lowest = Coordinate(keys_[first].id, k), highest = lowest;
      for (std::size_t i = first; i < first + count; i += stride) {
        const double x = Coordinate(keys_[i].id, k);
        lowest = std::min(lowest, x);
        highest = std::max(highest, x);
      }
      if (highest - lowest > width) width = highest - lowest, widest = k;
    }
    return widest;
  }

  double Coordinate(std::uint32_t id, std::size_t k) const {
    return entries_.coordinates[id * entries_.num_coordinates + k];
  }

  void StoreBlocks() {
    const std::size_t blocks = (count_ + kLanes - 1) / kLanes, k = entries_.num_coordinates;
    index_.blocks_.assign(blocks * index_.block_packs(), Pack{});
    index_.ids_.assign(blocks * kLanes, kNone);
    for (std::size_t i = 0; i < blocks * kLanes; ++i) {
      Pack* block = index_.blocks_.data() + i / kLanes * index_.block_packs();
      const std::size_t lane = i % kLanes;
      block[k].set(lane, kMinusInfinity);
      block[k + 1].set(lane, kMinusInfinity);
      if (i >= count_) continue;
      const std::uint32_t id = index_.ids_[i] = keys_[i].id;
      for (std::size_t c = 0; c < k; ++c) block[c].set(lane, Coordinate(id, c));
      block[k].set(lane, entries_.floors[id]);
      block[k + 1].set(lane, -entries_.ceilings[id]);
    }
  }

  // The level above the highest there is so far.
  void StoreLevel() {
    const std::size_t stored = index_.nodes_.size() / index_.node_packs();
    const std::size_t below = index_.levels_.empty() ? 0 : index_.levels_.back();
    const std::size_t children = index_.levels_.empty() ? index_.num_blocks() : stored - below;
    const std::size_t nodes = (children + kLanes - 1) / kLanes;
    index_.nodes_.resize((stored + nodes) * index_.node_packs(), Pack{});
    for (std::size_t i = 0; i < nodes * kLanes; ++i) {
      Pack* node = index_.nodes_.data() + (stored + i / kLanes) * index_.node_packs();
      const std::size_t used = std::min(kLanes, grandchildren_ - std::min(grandchildren_, i * kLanes));
      if (index_.levels_.empty())
        StoreChild(index_.block(std::min(i, children - 1)), 1, used, node, i % kLanes);
      else
        StoreChild(index_.nodes_.data() + (below + std::min(i, children - 1)) * index_.node_packs(), 2, used, node, i % kLanes);
    }
    grandchildren_ = children;
    index_.levels_.push_back(stored);
  }

  // A child has `stride` packs a coordinate: a block one, a node two. One that is not there uses no lane.
  void StoreChild(const Pack* child, std::size_t stride, std::size_t used, Pack* node, std::size_t lane) const {
    const std::size_t k = entries_.num_coordinates;
    for (std::size_t c = 0; used > 0 && c < k; ++c) {
      node[2 * c].set(lane, Lowest(child[stride * c], used));
      node[2 * c + 1].set(lane, Highest(child[stride * c + stride - 1], used));
    }
    node[2 * k].set(lane, Highest(child[stride * k], used));
    node[2 * k + 1].set(lane, Highest(child[stride * k + 1], used));
  }

  const Entries& entries_;
  ObservationIndex& index_;
  std::size_t count_;
  std::vector<Key> keys_;
  std::size_t grandchildren_ = count_;  // what lies below the children of the level being stored
};

ObservationIndex::ObservationIndex(const Entries& entries)
    : size_(entries.floors.size()), num_coordinates_(entries.num_coordinates) {
  Builder(entries, *this);
}

}  // namespace forereach
