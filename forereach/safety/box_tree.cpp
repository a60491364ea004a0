#include "forereach/safety/box_tree.h"

#include <numeric>
#include <utility>

namespace forereach {
namespace {

double Middle(const Bounds& box, std::size_t k) { return box.lower[k] / 2 + box.upper[k] / 2; }

Bounds Around(std::span<const Bounds> boxes, std::span<const std::int32_t> some) {
  Bounds around = boxes[ToSize(some[0])];
  for (const std::int32_t i : some)
    for (std::size_t k = 0; k < kMaxSafetyDim; ++k) {
      around.lower[k] = std::min(around.lower[k], boxes[ToSize(i)].lower[k]);
      around.upper[k] = std::max(around.upper[k], boxes[ToSize(i)].upper[k]);
    }
  return around;
}

// Cuts a list into lists of that length, but for the last one, each time where it is spread the widest.
void Spread(std::span<const Bounds> boxes, std::span<std::int32_t> some, std::size_t length) {
  const std::size_t lists = (some.size() + length - 1) / length;
  if (lists <= 1) return;
  std::size_t widest = 0;
  double most = -kInfinity;
  for (std::size_t k = 0; k < kMaxSafetyDim; ++k) {
    const auto by = [&](std::int32_t i) { return Middle(boxes[ToSize(i)], k); };
    const auto [least, largest] = std::ranges::minmax_element(some, {}, by);
    if (const double spread = by(*largest) - by(*least); spread > most) {
      most = spread;
      widest = k;
    }
  }
  const std::size_t first = lists / 2 * length;
  // Equal places by their numbers: the tree is the same on every machine.
  std::ranges::nth_element(some, some.begin() + static_cast<std::ptrdiff_t>(first), {},
                           [&](std::int32_t i) { return std::pair(Middle(boxes[ToSize(i)], widest), i); });
  Spread(boxes, some.first(first), length);
  Spread(boxes, some.subspan(first), length);
}

}  // namespace

BoxTree::BoxTree(std::span<const Bounds> boxes, int dim) : dim_(dim) {
  for (const Bounds& box : boxes)
    for (std::size_t k = 0; k < ToSize(dim); ++k)
      size_ = std::max(size_, static_cast<double>(dim) * (std::abs(box.lower[k]) + std::abs(box.upper[k])));
  std::vector<std::int32_t> all(boxes.size());
  std::iota(all.begin(), all.end(), 0);
  if (!all.empty()) Add(boxes, all);
}

std::int32_t BoxTree::Add(std::span<const Bounds> boxes, std::span<std::int32_t> some) {
  const auto number = nodes_.size();
  nodes_.emplace_back();
  std::size_t length = 1;  // of a child's list: all but the last of them are full
  while (length * kLaneCount < some.size()) length *= kLaneCount;
  Spread(boxes, some, length);
  nodes_[number].is_leaf = length == 1;
  nodes_[number].is_low = length <= kLaneCount;
  for (std::size_t lane = 0; !some.empty(); ++lane, some = some.subspan(std::min(length, some.size()))) {
    const std::span<std::int32_t> list = some.first(std::min(length, some.size()));
    const Bounds around = Around(boxes, list);
    for (std::size_t k = 0; k < kMaxSafetyDim; ++k) {
      nodes_[number].boxes.center[k][lane] = around.lower[k] / 2 + around.upper[k] / 2;
      nodes_[number].boxes.half_width[k][lane] = around.upper[k] / 2 - around.lower[k] / 2;
    }
    const std::int32_t child = length == 1 ? list[0] : Add(boxes, list);
    nodes_[number].children[lane] = child;
    nodes_[number].used |= 1u << lane;
  }
  return static_cast<std::int32_t>(number);
}

}  // namespace forereach
