#include "forereach/residual/pairs.h"

#include <algorithm>
#include <array>

#include "forereach/numerics/size.h"

#pragma GCC diagnostic ignored "-Wpsabi"

namespace forereach {

// For the inside of Dispatch, as search.h.
struct PairSearch::Kernel {
  const ObservationIndex& index;
  double margin;
  std::size_t k = index.num_coordinates();
  bool lifted = index.shape() == ObservationIndex::Shape::kLifted;

  // The most by which floor - ceiling may exceed the distance, between the group and each child of the node.
  Pack Excess(const double* group, const Pack* node) const {
    if (lifted) {
      const std::size_t side = 2 * k + 1;
      return Max(OneWay(group, node + side), OneWay(group + side, node));
    }
    return LessGaps(Max(Fill(group[0]) + LoadPack(node[1]), Fill(group[1]) + LoadPack(node[0])), group, node);
  }

  // The value less the distance between the boxes of the group and of each child.
  Pack LessGaps(const Pack& value, const double* group, const Pack* node) const {
    Pack less = value;
    for (std::size_t c = 1; c <= k; ++c) {
      const Pack before = LoadPack(node[2 * c]) - Fill(group[2 * c + 1]);
      const Pack behind = Fill(group[2 * c]) - LoadPack(node[2 * c + 1]);
      less = less - Max(Max(before, behind), Fill(0));
    }
    return less;
  }

  Pack OneWay(const double* group, const Pack* node) const {
    Pack most = Fill(group[2 * k]) + LoadPack(node[2 * k]);
    for (std::size_t c = 0; c < k; ++c)
      most = Min(most,
                 Min(Fill(group[2 * c]) + LoadPack(node[2 * c + 1]), Fill(group[2 * c + 1]) + LoadPack(node[2 * c])));
    return most;
  }

  // The same between the point and the entries of a block.
  Pack Excess(const double* coordinates, double floor, double negated_ceiling, const Pack* block) const {
    return Max(Fill(floor) + LoadPack(block[k + 1]), Fill(negated_ceiling) + LoadPack(block[k])) -
           Distance(coordinates, block);
  }

  Pack Distance(const double* coordinates, const Pack* block) const {
    Pack distance = Fill(0);
    for (std::size_t c = 0; c < k; ++c) {
      const Pack along = Abs(Fill(coordinates[c]) - LoadPack(block[c]));
      distance = lifted ? Max(distance, along) : distance + along;
    }
    return distance;
  }

  void Leaves(const double* group, std::size_t first, std::vector<std::size_t>& leaves) const {
    leaves.clear();
    struct Level {
      Pack excess;
      std::size_t child, end;  // the children still to look at
    };
    std::array<Level, ObservationIndex::kMaxHeight + 1> levels;
    const auto enter = [&](int level, std::size_t i) {
      levels[ToSize(level)] = {Excess(group, index.node(level, i)), i * kPackSize, (i + 1) * kPackSize};
    };
    const int top = index.height();
    enter(top, 0);
    for (int level = top; level <= top;) {
      Level& at = levels[ToSize(level)];
      if (at.child == at.end) {
        ++level;
        continue;
      }
      const std::size_t child = at.child++, last_leaf = ((child + 1) << (3 * (level - 1))) - 1;
      // -margin instead of 0: plain arithmetic may be off by so much, and no provable contradiction may be missed
      // (soundness, section 4). Suspects cost time, no more: TestPair decides.
      if (last_leaf < first || !(at.excess.at(child % kPackSize) > -margin)) continue;
      if (level > 1)
        enter(--level, child);
      else
        leaves.push_back(child);
    }
  }

  // Entries of `leaf` that may have a partner in the group of `other`, then their partners.
  void Suspects(std::size_t leaf, std::size_t other, const double* group,
                std::vector<std::pair<std::uint32_t, std::uint32_t>>& pairs) const {
    pairs.clear();
    std::array<double, kMaxVariables> coordinates;
    for (std::size_t b = 0; b < ObservationIndex::kLeafBlocks; ++b) {
      const std::size_t own = leaf * ObservationIndex::kLeafBlocks + b;
      const Pack* block = index.block(own);
      const Pack excess = ToGroup(block, group);
      if (!(MaxLane(excess) > -margin)) continue;
      for (std::size_t lane = 0; lane < kPackSize; ++lane) {
        if (!(excess.at(lane) > -margin)) continue;
        for (std::size_t c = 0; c < k; ++c) coordinates[c] = block[c].at(lane);
        const std::uint32_t id = index.ids(own)[lane];
        Partners(coordinates.data(), block[k].at(lane), block[k + 1].at(lane), other,
                 leaf == other ? own * kPackSize + lane + 1 : 0,
                 [&](std::uint32_t partner) { pairs.emplace_back(id, partner); });
      }
    }
  }

  // The most by which each entry of a block may exceed its distance to a group.
  Pack ToGroup(const Pack* block, const double* group) const {
    const Pack floor = LoadPack(block[k]), ceiling = LoadPack(block[k + 1]);
    if (lifted) {
      const double* other = group + 2 * k + 1;
      Pack up = floor + Fill(other[2 * k]), down = ceiling + Fill(group[2 * k]);
      for (std::size_t c = 0; c < k; ++c) {
        const Pack alpha = LoadPack(block[c]);
        up = Min(up, Min(floor - alpha + Fill(other[2 * c + 1]), floor + alpha + Fill(other[2 * c])));
        down = Min(down, Min(ceiling - alpha + Fill(group[2 * c + 1]), ceiling + alpha + Fill(group[2 * c])));
      }
      return Max(up, down);
    }
    Pack excess = Max(floor + Fill(group[1]), ceiling + Fill(group[0]));
    for (std::size_t c = 0; c < k; ++c) {
      const Pack alpha = LoadPack(block[c]);
      excess = excess - Max(Max(Fill(group[2 * c + 2]) - alpha, alpha - Fill(group[2 * c + 3])), Fill(0));
    }
    return excess;
  }

  // Suspects in a leaf, from position `from` of the whole index on.
  template <class Take>
  void Partners(const double* coordinates, double floor, double negated_ceiling, std::size_t leaf, std::size_t from,
                const Take& take) const {
    for (std::size_t b = leaf * ObservationIndex::kLeafBlocks; b < (leaf + 1) * ObservationIndex::kLeafBlocks; ++b) {
      if ((b + 1) * kPackSize <= from) continue;
      const Pack excess = Excess(coordinates, floor, negated_ceiling, index.block(b));
      if (!(MaxLane(excess) > -margin)) continue;
      for (std::size_t lane = 0; lane < kPackSize; ++lane)
        if (excess.at(lane) > -margin && b * kPackSize + lane >= from) take(index.ids(b)[lane]);
    }
  }

  // As Descent of search.h, for a point and an entry that is left out.
  Other BestOther(const Point& point, const double* group, std::size_t side, std::uint32_t self, double enough) const {
    Other best;
    const double own = side == 0 ? point.floor : point.negated_ceiling;
    std::array<Pack, ObservationIndex::kMaxHeight + 1> bounds;
    std::array<std::size_t, ObservationIndex::kMaxHeight + 1> first;
    if (!(margin < kInfinity)) {  // the bounds of nodes say nothing
      for (std::size_t b = 0; b < index.num_blocks(); ++b) BestOther(point, own, b, side, self, best);
      return best;
    }
    const int top = index.height();
    int level = top + 1;
    for (std::size_t child = 0;;) {
      if (level > 1) {
        const auto at = ToSize(--level);
        bounds[at] = TagLanes(Max(OneSide(group, index.node(level, child), side), Fill(-kMaxDouble)));
        first[at] = child * kPackSize;
      } else {
        for (std::size_t b = child * ObservationIndex::kLeafBlocks; b < (child + 1) * ObservationIndex::kLeafBlocks;
             ++b)
          BestOther(point, own, b, side, self, best);
      }
      if (best.value >= enough) return best;
      double next;
      while (!((next = MaxLane(bounds[ToSize(level)])) >= best.value && next > ObservationIndex::kMissing))
        if (++level > top) return best;
      const auto at = ToSize(level);
      bounds[at] = Replace(bounds[at], next, -kMaxDouble);
      child = first[at] + TaggedLane(next);
    }
  }

  void BestOther(const Point& point, double own, std::size_t b, std::size_t side, std::uint32_t self,
                 Other& best) const {
    const Pack* block = index.block(b);
    const Pack values = LoadPack(block[k + side]) - Distance(point.coordinates.data(), block);
    if (!(MaxLane(values) > best.value)) return;
    for (std::size_t lane = 0; lane < kPackSize; ++lane) {
      const std::uint32_t id = index.ids(b)[lane];
      // Of equals at one place the first stays: each would else be the reason for which the other may go.
      const bool same = values.at(lane) == own && block[k + side].at(lane) == own && id > self;
      if (id != self && !same && values.at(lane) > best.value) best = {values.at(lane), id};
    }
  }

  // v_j - d at most, between a group with v = 0 and each child.
  Pack OneSide(const double* group, const Pack* node, std::size_t side) const {
    if (lifted) return OneWay(group, node + side * (2 * k + 1)) + Fill(margin);
    return LessGaps(LoadPack(node[side]) + Fill(margin), group, node);
  }

  void PartnersOf(const Point& point, std::size_t leaf, std::vector<std::uint32_t>& partners) const {
    Partners(point.coordinates.data(), point.floor, point.negated_ceiling, leaf, 0,
             [&](std::uint32_t partner) { partners.push_back(partner); });
  }

  void InBlocks(const Point& point, const Pack* blocks, std::size_t count, std::vector<std::uint32_t>& partners) const {
    for (std::size_t first = 0; first < count; first += kPackSize, blocks += k + 2) {
      const Pack excess = Excess(point.coordinates.data(), point.floor, point.negated_ceiling, blocks);
      if (!(MaxLane(excess) > -margin)) continue;
      for (std::size_t lane = 0; lane < std::min(kPackSize, count - first); ++lane)
        if (excess.at(lane) > -margin) partners.push_back(static_cast<std::uint32_t>(first + lane));
    }
  }
};

void PairSearch::Leaves(const std::vector<double>& group, std::size_t first, std::vector<std::size_t>& leaves) const {
  const Kernel kernel{index_, margin_};
  Dispatch<&Kernel::Leaves>(instructions_, kernel, group.data(), first, leaves);
}

void PairSearch::Suspects(std::size_t leaf, std::size_t other,
                          std::vector<std::pair<std::uint32_t, std::uint32_t>>& pairs) const {
  const Kernel kernel{index_, margin_};
  const std::vector<double> group = GroupOf(other);
  Dispatch<&Kernel::Suspects>(instructions_, kernel, leaf, other, group.data(), pairs);
}

void PairSearch::Suspects(const Point& point, std::size_t leaf, std::vector<std::uint32_t>& partners) const {
  partners.clear();
  const Kernel kernel{index_, margin_};
  Dispatch<&Kernel::PartnersOf>(instructions_, kernel, point, leaf, partners);
}

void PairSearch::Suspects(const Point& point, const LipschitzRow& row, const Pack* blocks, std::size_t count,
                          double margin, std::vector<std::uint32_t>& partners) {
  partners.clear();
  const ObservationIndex none;
  const Kernel kernel{none, margin, row.num_coordinates(), row.has_patterns()};
  Dispatch<&Kernel::InBlocks>(BestInstructionSet(), kernel, point, blocks, count, partners);
}

PairSearch::Other PairSearch::BestOther(const Point& point, std::size_t side, std::uint32_t self, double enough) const {
  const Point at_zero{point.coordinates, 0, 0};
  return Kernel{index_, margin_}.BestOther(point, GroupOf(at_zero).data(), side, self, enough);
}

std::vector<double> PairSearch::GroupOf(std::size_t leaf) const {
  std::vector<double> group(index_.node_packs());
  const Pack* node = index_.node(1, leaf / kPackSize);
  for (std::size_t p = 0; p < group.size(); ++p) group[p] = node[p].at(leaf % kPackSize);
  return group;
}

std::vector<double> PairSearch::GroupOf(const Point& point) const {
  std::vector<double> group;
  if (index_.shape() == ObservationIndex::Shape::kBoxed) {
    group = {point.floor, point.negated_ceiling};
    for (const double alpha : point.coordinates) group.insert(group.end(), {alpha, alpha});
    return group;
  }
  for (const double value : {point.floor, point.negated_ceiling}) {
    for (const double alpha : point.coordinates) group.insert(group.end(), {value - alpha, value + alpha});
    group.push_back(value);
  }
  return group;
}

double MarginUpper(const LipschitzRow& row, const ObservationIndex::Entries& entries, const Observations& o) {
  double locations = 0;
  for (const LipschitzRow::Column& column : row.columns())
    locations = AddUp(locations, MulUp(column.slope, o.z.col(column.variable).cwiseAbs().maxCoeff()));
  return PairMarginUpper(LargestValue(entries), locations, row.columns().size());
}

PairSearch::Point PointOf(const ObservationIndex::Entries& entries, int i) {
  const auto at = ToSize(i);
  const double* coordinates = entries.coordinates.data() + at * entries.num_coordinates;
  return {{coordinates, coordinates + entries.num_coordinates}, entries.floors[at], -entries.ceilings[at]};
}

}  // namespace forereach
