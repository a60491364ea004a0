#include "certifier/residual/pairs.h"

#include <algorithm>
#include <array>

#pragma GCC diagnostic ignored "-Wpsabi"

namespace forereach {

using simd::kLanes;
using simd::Pack;

// For the inside of the two entry points of each function, as search.h.
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
    Pack excess = Max(simd::Fill(group[0]) + simd::Load(node[1]), simd::Fill(group[1]) + simd::Load(node[0]));
    for (std::size_t c = 1; c <= k; ++c) {
      const Pack before = simd::Load(node[2 * c]) - simd::Fill(group[2 * c + 1]);
      const Pack behind = simd::Fill(group[2 * c]) - simd::Load(node[2 * c + 1]);
      excess = excess - Max(Max(before, behind), simd::Fill(0));
    }
    return excess;
  }

  Pack OneWay(const double* group, const Pack* node) const {
    Pack most = simd::Fill(group[2 * k]) + simd::Load(node[2 * k]);
    for (std::size_t c = 0; c < k; ++c)
      most = Min(most, Min(simd::Fill(group[2 * c]) + simd::Load(node[2 * c + 1]),
                           simd::Fill(group[2 * c + 1]) + simd::Load(node[2 * c])));
    return most;
  }

  // The same between the point and the entries of a block.
  Pack Excess(const double* coordinates, double floor, double negated_ceiling, const Pack* block) const {
    Pack distance = simd::Fill(0);
    for (std::size_t c = 0; c < k; ++c) {
      const Pack along = Abs(simd::Fill(coordinates[c]) - simd::Load(block[c]));
      distance = lifted ? Max(distance, along) : distance + along;
    }
    return Max(simd::Fill(floor) + simd::Load(block[k + 1]), simd::Fill(negated_ceiling) + simd::Load(block[k])) - distance;
  }

  void Leaves(const double* group, std::size_t first, std::vector<std::size_t>& leaves) const {
    leaves.clear();
    struct Level {
      Pack excess;
      std::size_t child, end;  // the children still to look at
    };
    std::array<Level, ObservationIndex::kMaxHeight + 1> levels;
    const auto enter = [&](int level, std::size_t i) {
      levels[static_cast<std::size_t>(level)] = {Excess(group, index.node(level, i)), i * kLanes, (i + 1) * kLanes};
    };
    const int top = index.height();
    enter(top, 0);
    for (int level = top; level <= top;) {
      Level& at = levels[static_cast<std::size_t>(level)];
      if (at.child == at.end) {
        ++level;
        continue;
      }
      const std::size_t child = at.child++, last_leaf = ((child + 1) << (3 * (level - 1))) - 1;
      if (last_leaf < first || !(at.excess.at(child % kLanes) > -margin)) continue;
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
      for (std::size_t lane = 0; lane < kLanes; ++lane) {
        if (!(excess.at(lane) > -margin)) continue;
        for (std::size_t c = 0; c < k; ++c) coordinates[c] = block[c].at(lane);
        const std::uint32_t id = index.ids(own)[lane];
        Partners(coordinates.data(), block[k].at(lane), block[k + 1].at(lane), other, leaf == other ? own * kLanes + lane + 1 : 0,
                 [&](std::uint32_t partner) { pairs.emplace_back(id, partner); });
      }
    }
  }

  // The most by which each entry of a block may exceed its distance to a group.
  Pack ToGroup(const Pack* block, const double* group) const {
    const Pack floor = simd::Load(block[k]), ceiling = simd::Load(block[k + 1]);
    if (lifted) {
      const double* other = group + 2 * k + 1;
      Pack up = floor + simd::Fill(other[2 * k]), down = ceiling + simd::Fill(group[2 * k]);
      for (std::size_t c = 0; c < k; ++c) {
        const Pack alpha = simd::Load(block[c]);
        up = Min(up, Min(floor - alpha + simd::Fill(other[2 * c + 1]), floor + alpha + simd::Fill(other[2 * c])));
        down = Min(down, Min(ceiling - alpha + simd::Fill(group[2 * c + 1]), ceiling + alpha + simd::Fill(group[2 * c])));
      }
      return Max(up, down);
    }
    Pack excess = Max(floor + simd::Fill(group[1]), ceiling + simd::Fill(group[0]));
    for (std::size_t c = 0; c < k; ++c) {
      const Pack alpha = simd::Load(block[c]);
      excess = excess - Max(Max(simd::Fill(group[2 * c + 2]) - alpha, alpha - simd::Fill(group[2 * c + 3])), simd::Fill(0));
    }
    return excess;
  }

  // Suspects in a leaf, from position `from` of the whole index on.
  template <class Take>
  void Partners(const double* coordinates, double floor, double negated_ceiling, std::size_t leaf, std::size_t from,
                const Take& take) const {
    for (std::size_t b = leaf * ObservationIndex::kLeafBlocks; b < (leaf + 1) * ObservationIndex::kLeafBlocks; ++b) {
      if ((b + 1) * kLanes <= from) continue;
      const Pack excess = Excess(coordinates, floor, negated_ceiling, index.block(b));
      if (!(MaxLane(excess) > -margin)) continue;
      for (std::size_t lane = 0; lane < kLanes; ++lane)
        if (excess.at(lane) > -margin && b * kLanes + lane >= from) take(index.ids(b)[lane]);
    }
  }

  FOREREACH_AVX2 static void LeavesAvx2(const Kernel& kernel, const double* group, std::size_t first, std::vector<std::size_t>& leaves) {
    kernel.Leaves(group, first, leaves);
  }
  FOREREACH_AVX2 static void SuspectsAvx2(const Kernel& kernel, std::size_t leaf, std::size_t other, const double* group,
                                          std::vector<std::pair<std::uint32_t, std::uint32_t>>& pairs) {
    kernel.Suspects(leaf, other, group, pairs);
  }
};

void PairSearch::Leaves(const std::vector<double>& group, std::size_t first, std::vector<std::size_t>& leaves) const {
  const Kernel kernel{index_, margin_};
  if (instructions_ == InstructionSet::kAvx2) return Kernel::LeavesAvx2(kernel, group.data(), first, leaves);
  kernel.Leaves(group.data(), first, leaves);
}

void PairSearch::Suspects(std::size_t leaf, std::size_t other,
                          std::vector<std::pair<std::uint32_t, std::uint32_t>>& pairs) const {
  const Kernel kernel{index_, margin_};
  const std::vector<double> group = GroupOf(other);
  if (instructions_ == InstructionSet::kAvx2) return Kernel::SuspectsAvx2(kernel, leaf, other, group.data(), pairs);
  kernel.Suspects(leaf, other, group.data(), pairs);
}

void PairSearch::Suspects(const Point& point, std::size_t leaf, std::vector<std::uint32_t>& partners) const {
  partners.clear();
  Kernel{index_, margin_}.Partners(point.coordinates.data(), point.floor, point.negated_ceiling, leaf, 0,
                                   [&](std::uint32_t partner) { partners.push_back(partner); });
}

std::vector<double> PairSearch::GroupOf(std::size_t leaf) const {
  std::vector<double> group(index_.node_packs());
  const Pack* node = index_.node(1, leaf / kLanes);
  for (std::size_t p = 0; p < group.size(); ++p) group[p] = node[p].at(leaf % kLanes);
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

}  // namespace forereach
