#include "forereach/safety/box_tree.h"

#include <algorithm>
#include <cmath>

namespace forereach {

void HullTree::Build(std::span<const Hull> hulls, int dim) noexcept {
  num_nodes_ = 0;
  size_ = 0;
  for (const Hull& hull : hulls) {
    double size = 0;
    for (std::size_t k = 0; k < ToSize(dim); ++k) size += std::abs(hull.center[k]) + hull.half_width[k];
    if (!(size <= size_) && !std::isnan(size_)) size_ = size;
  }
  Build(hulls, dim, 0, static_cast<int>(hulls.size()));
}

// What is compared with NaN may get lost, but size_ then is NaN, and no pair is left out.
int HullTree::Build(std::span<const Hull> hulls, int dim, int first, int count) noexcept {
  const int number = num_nodes_++;
  Node& node = nodes_[ToSize(number)];
  node.first = first;
  node.count = count;
  if (count == 1) {
    const auto& [c, w] = hulls[ToSize(first)];
    const Lanes center{c[0], dim > 1 ? c[1] : 0, dim > 2 ? c[2] : 0, 0},
        half_width{w[0], dim > 1 ? w[1] : 0, dim > 2 ? w[2] : 0, 0};
    StoreLanes(center - half_width, node.lower.data());
    StoreLanes(center + half_width, node.upper.data());
    return number;
  }
  // Slices follow each other, so halves of the list are near each other without a sort, which a certify step has no
  // time for.
  Build(hulls, dim, first, count / 2);
  node.second = Build(hulls, dim, first + count / 2, count - count / 2);
  const Node &a = nodes_[ToSize(number + 1)], &b = nodes_[ToSize(node.second)];
  StoreLanes(Min(LoadLanes(a.lower.data()), LoadLanes(b.lower.data())), node.lower.data());
  StoreLanes(Max(LoadLanes(a.upper.data()), LoadLanes(b.upper.data())), node.upper.data());
  return number;
}

BoxTree::BoxTree(std::span<const Bounds> boxes, int dim) {
  std::vector<std::array<double, kMaxSafetyDim>> middles;
  for (const Bounds& box : boxes) {
    auto& middle = middles.emplace_back();
    for (std::size_t k = 0; k < ToSize(dim); ++k) {
      size_ = std::max(size_, static_cast<double>(dim) * (std::abs(box.lower[k]) + std::abs(box.upper[k])));
      middle[k] = box.lower[k] / 2 + box.upper[k] / 2;
    }
  }
  halves_ = {middles, [&](std::span<const std::int32_t> some) {
               Node node;
               for (std::size_t k = 0; k < ToSize(dim); ++k) {
                 node.lower[k] = boxes[ToSize(some[0])].lower[k];
                 node.upper[k] = boxes[ToSize(some[0])].upper[k];
                 for (const std::int32_t i : some.subspan(1)) {
                   node.lower[k] = std::min(node.lower[k], boxes[ToSize(i)].lower[k]);
                   node.upper[k] = std::max(node.upper[k], boxes[ToSize(i)].upper[k]);
                 }
               }
               return node;
             }};
}

}  // namespace forereach
