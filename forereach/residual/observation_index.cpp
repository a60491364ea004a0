#include "forereach/residual/observation_index.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <numeric>

#include "forereach/residual/observation_rows.h"

namespace forereach {

namespace {

constexpr double kMinusInfinity = -std::numeric_limits<double>::infinity();
constexpr double kNothing = -std::numeric_limits<double>::max();  // what a lane without a child holds
constexpr std::size_t kFanout = kPackSize;

// A capacity in coarse steps: an index that is built again for a few more entries asks for blocks of the same sizes,
// and gets those that its predecessor has freed.
std::size_t Roomy(std::size_t count) {
  const std::size_t unit = std::bit_floor(count) / 8 + 1;
  return (count / unit + 1) * unit;
}

}  // namespace

class ObservationIndex::Builder {
 public:
  Builder(const Entries& entries, ObservationIndex& index)
      : entries_(entries), index_(index), count_(entries.floors.size()) {
    places_.reserve(Roomy(count_));
    places_.resize(count_);
    for (std::size_t i = 0; i < count_; ++i) places_[i].id = static_cast<std::uint32_t>(i);
    Arrange(0, count_);
    StoreBlocks();
    StoreLowestLevel();
    while (index_.nodes_.size() > (level_ + 1) * index_.node_packs()) StoreNextLevel();
    TurnLowestOver();
  }

 private:
  struct Place {
    double at;
    std::uint32_t id;
  };

  // Orders entries [first, first + count), a subtree of its own: all children but the last are full.
  void Arrange(std::size_t first, std::size_t count) {
    if (count <= kLeafSize) return;
    std::size_t child = kLeafSize;
    while (child * kFanout < count) child *= kFanout;
    Divide(first, count, child);
  }

  // Halves the number of children across the widest coordinate until one is left.
  void Divide(std::size_t first, std::size_t count, std::size_t child) {
    const std::size_t children = (count + child - 1) / child;
    if (children == 1) return Arrange(first, count);
    const std::size_t left = children / 2 * child, k = WidestCoordinate(first, count);
    const auto begin = places_.begin() + static_cast<std::ptrdiff_t>(first),
               end = begin + static_cast<std::ptrdiff_t>(count);
    for (auto place = begin; place != end; ++place) place->at = Coordinate(place->id, k);
    std::nth_element(begin, begin + static_cast<std::ptrdiff_t>(left), end,
                     [](const Place& a, const Place& b) { return a.at != b.at ? a.at < b.at : a.id < b.id; });
    Divide(first, left, child);
    Divide(first + left, count - left, child);
  }

  // The coordinate of largest width over a sample of the entries. Any choice gives a correct tree.
  std::size_t WidestCoordinate(std::size_t first, std::size_t count) const {
    constexpr std::size_t kSample = 64;
    const std::size_t stride = count / kSample + 1;
    std::size_t widest = 0;
    double width = -1;
    for (std::size_t k = 0; k < entries_.num_coordinates; ++k) {
      double lowest = Coordinate(places_[first].id, k), highest = lowest;
      for (std::size_t i = first; i < first + count; i += stride) {
        const double x = Coordinate(places_[i].id, k);
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
    const std::size_t blocks = index_.num_leaves() * kLeafBlocks, k = entries_.num_coordinates;
    index_.blocks_.reserve(Roomy(blocks) * index_.block_packs());
    index_.ids_.reserve(Roomy(blocks) * kPackSize);
    index_.nodes_.reserve(Roomy(index_.num_leaves() / (kFanout - 1) + kMaxHeight) * index_.node_packs());
    index_.blocks_.assign(blocks * index_.block_packs(), Pack{});
    index_.ids_.assign(blocks * kPackSize, kNone);
    for (std::size_t i = 0; i < blocks * kPackSize; ++i) {
      Pack* block = index_.blocks_.data() + i / kPackSize * index_.block_packs();
      const std::size_t lane = i % kPackSize;
      const bool used = i < count_;
      const std::uint32_t id = used ? places_[i].id : kNone;
      index_.ids_[i] = id;
      for (std::size_t c = 0; c < k; ++c) block[c].set(lane, used ? Coordinate(id, c) : 0);
      // An entry that is not there bounds nothing, on either side.
      block[k].set(lane, used ? entries_.floors[id] : kMinusInfinity);
      block[k + 1].set(lane, used ? -entries_.ceilings[id] : kMinusInfinity);
    }
  }

  // The level above the leaves: what entry i has to say, taken into its leaf's lane.
  void StoreLowestLevel() {
    StartLevel(index_.num_leaves());
    for (std::size_t i = 0; i < count_; ++i) {
      const Pack* block = index_.block(i / kPackSize);
      const std::size_t k = entries_.num_coordinates, lane = i % kPackSize, leaf = i / kLeafSize;
      for (std::size_t side = 0; side < 2; ++side) Raise(leaf, MaxOf(side), block[k + side].at(lane));
      for (std::size_t c = 0; c < k; ++c) {
        const double alpha = block[c].at(lane);
        if (index_.shape_ == Shape::kBoxed) {
          Raise(leaf, 2 + 2 * c, -alpha);  // the lowest, negated until the level is done
          Raise(leaf, 3 + 2 * c, alpha);
        } else {
          for (std::size_t side = 0; side < 2; ++side) {
            Raise(leaf, side * (2 * k + 1) + 2 * c, block[k + side].at(lane) - alpha);
            Raise(leaf, side * (2 * k + 1) + 2 * c + 1, block[k + side].at(lane) + alpha);
          }
        }
      }
    }
  }

  // The level above the highest there is: of each pack, the largest lane of the node below.
  void StoreNextLevel() {
    const std::size_t below = level_, nodes = index_.nodes_.size() / index_.node_packs() - below;
    StartLevel(nodes);
    for (std::size_t i = 0; i < nodes; ++i)
      for (std::size_t p = 0; p < index_.node_packs(); ++p)
        Raise(i, p, MaxLane(index_.nodes_[(below + i) * index_.node_packs() + p]));
  }

  void StartLevel(std::size_t children) {
    level_ = index_.nodes_.size() / index_.node_packs();
    index_.levels_.push_back(level_);
    index_.nodes_.resize((level_ + (children + kFanout - 1) / kFanout) * index_.node_packs(), Fill(kNothing));
  }

  // Child i of the level being stored has at least `value` in pack p.
  void Raise(std::size_t i, std::size_t p, double value) {
    Pack& pack = index_.nodes_[(level_ + i / kFanout) * index_.node_packs() + p];
    if (value > pack.at(i % kFanout)) pack.set(i % kFanout, value);
  }

  // The pack of a node that holds the largest floor (side 0) or negated ceiling (side 1) below it.
  std::size_t MaxOf(std::size_t side) const {
    return index_.shape_ == Shape::kBoxed ? side
                                          : side * (2 * entries_.num_coordinates + 1) + 2 * entries_.num_coordinates;
  }

  // Lowest coordinates are stored negated so far. A child that is not there becomes the box of the origin.
  void TurnLowestOver() {
    if (index_.shape_ != Shape::kBoxed) return;
    for (std::size_t first = 0; first < index_.nodes_.size(); first += index_.node_packs())
      for (std::size_t lane = 0; lane < kPackSize; ++lane)
        for (std::size_t c = 0; c < entries_.num_coordinates; ++c) {
          Pack& lowest = index_.nodes_[first + 2 + 2 * c];
          Pack& highest = index_.nodes_[first + 3 + 2 * c];
          const bool there = highest.at(lane) != kNothing;
          lowest.set(lane, there ? -lowest.at(lane) : 0);
          if (!there) highest.set(lane, 0);
        }
  }

  const Entries& entries_;
  ObservationIndex& index_;
  std::size_t count_;
  std::vector<Place> places_;
  std::size_t level_ = 0;  // the first node of the level being stored
};

ObservationIndex::ObservationIndex(const Entries& entries)
    : shape_(entries.shape), size_(entries.floors.size()), num_coordinates_(entries.num_coordinates) {
  Builder(entries, *this);
}

double LargestValue(const ObservationIndex::Entries& entries) {
  double largest = 0;
  for (const auto* values : {&entries.floors, &entries.ceilings})
    for (const double x : *values) largest = std::max(largest, std::abs(x));
  return largest;
}

template <class Rows>
ObservationIndex::Entries EntriesOf(const LipschitzRow& row, const Declaration& declaration, const Rows& observations,
                                    int coordinate) {
  const auto count = ToSize(observations.size());
  const double error = declaration.ObservationError(coordinate);
  using Shape = ObservationIndex::Shape;
  ObservationIndex::Entries entries{
      row.has_patterns() ? Shape::kLifted : Shape::kBoxed, row.num_coordinates(), {}, {}, {}};
  entries.coordinates.reserve(Roomy(count) * row.num_coordinates());
  entries.coordinates.resize(count * row.num_coordinates());
  entries.floors.reserve(Roomy(count)), entries.ceilings.reserve(Roomy(count));
  for (int i = 0; i < observations.size(); ++i) {
    row.Map([&](int l) { return observations.z(i, l); },
            entries.coordinates.data() + ToSize(i) * row.num_coordinates());
    // Outward, once for all queries: what follows may search as it likes.
    entries.floors.push_back(SubDown(observations.lower(i, coordinate), error));
    entries.ceilings.push_back(AddUp(observations.upper(i, coordinate), error));
  }
  return entries;
}

template ObservationIndex::Entries EntriesOf(const LipschitzRow&, const Declaration&, const Observations&, int);
template ObservationIndex::Entries EntriesOf(const LipschitzRow&, const Declaration&, const LastRows&, int);

}  // namespace forereach
