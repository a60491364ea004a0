#include "forereach/safety/box_tree.h"

#include <algorithm>
#include <cmath>
#include <numeric>

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

BoxTree::BoxTree(std::span<const Bounds> boxes, int dim) : dim_(dim), order_(boxes.size()) {
  std::iota(order_.begin(), order_.end(), 0);
  for (const Bounds& box : boxes)
    for (std::size_t k = 0; k < ToSize(dim); ++k)
      size_ = std::max(size_, static_cast<double>(dim) * (std::abs(box.lower[k]) + std::abs(box.upper[k])));
  nodes_.reserve(boxes.size());
  if (!boxes.empty()) Build(boxes, 0, static_cast<std::int32_t>(boxes.size()));
}

// The halves of the boxes along the axis on which their middles are spread the widest.
void BoxTree::Build(std::span<const Bounds> boxes, std::int32_t first, std::int32_t count) {
  const auto place = nodes_.size();
  nodes_.emplace_back();
  Bounds all = boxes[ToSize(order_[ToSize(first)])], middles;
  middles.lower.fill(kInfinity);
  middles.upper.fill(-kInfinity);
  const auto middle = [&](std::int32_t box, std::size_t k) {
    return boxes[ToSize(box)].lower[k] / 2 + boxes[ToSize(box)].upper[k] / 2;
  };
  for (std::int32_t i = first; i < first + count; ++i) {
    const std::int32_t box = order_[ToSize(i)];
    for (std::size_t k = 0; k < ToSize(dim_); ++k) {
      all.lower[k] = std::min(all.lower[k], boxes[ToSize(box)].lower[k]);
      all.upper[k] = std::max(all.upper[k], boxes[ToSize(box)].upper[k]);
      middles.lower[k] = std::min(middles.lower[k], middle(box, k));
      middles.upper[k] = std::max(middles.upper[k], middle(box, k));
    }
  }
  std::ranges::copy(all.lower, nodes_[place].lower.begin());
  std::ranges::copy(all.upper, nodes_[place].upper.begin());
  if (count <= kLeaf) {
    nodes_[place].first = first;
    nodes_[place].count = count;
    return;
  }
  std::size_t axis = 0;
  for (std::size_t k = 1; k < ToSize(dim_); ++k)
    if (middles.upper[k] - middles.lower[k] > middles.upper[axis] - middles.lower[axis]) axis = k;
  const std::int32_t half = count / 2;
  const auto begin = order_.begin() + first;
  std::nth_element(begin, begin + half, begin + count, [&](std::int32_t a, std::int32_t b) {
    // Equal middles by their numbers: the tree, and so the first obstacle that is named, is the same on every machine.
    return std::pair(middle(a, axis), a) < std::pair(middle(b, axis), b);
  });
  Build(boxes, first, half);
  nodes_[place].first = static_cast<std::int32_t>(nodes_.size());
  Build(boxes, first + half, count - half);
}

}  // namespace forereach
