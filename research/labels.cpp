#include "research/labels.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>
#include <utility>

namespace forereach::research {
namespace {

// Of a wide font, as parts of its size.
constexpr double kLetterWidth = 0.65, kLineHeight = 1.1;
// How much further, in pixels, is as bad as to lie across a line.
constexpr double kLinePenalty = 12;
constexpr double kStep = 2;
constexpr int kDirections = 16;

// The unit square's boundary, from its right side on, upwards.
std::pair<double, double> Direction(int i) {
  const double along = 8.0 * i / kDirections;  // The boundary is 8 long.
  const auto coordinate = [](double s) {       // 1, falls to -1, stays, rises.
    const double at = std::fmod(s + 8, 8);
    return at <= 1 || at >= 7 ? 1.0 : at <= 3 ? 2 - at : at <= 5 ? -1.0 : at - 6;
  };
  return {coordinate(along), coordinate(along - 2)};
}

bool MeetsAny(std::span<const PixelBox> boxes, const PixelBox& box) {
  return std::ranges::any_of(boxes, [&](const PixelBox& other) { return other.Meets(box); });
}

}  // namespace

std::vector<PixelBox> PlaceLabels(const PixelBox& frame, std::span<const PixelBox> marks,
                                  std::span<const PixelBox> lines, std::span<const Label> labels, double clearance) {
  std::vector<PixelBox> placed;
  const double furthest = std::max(frame.right - frame.left, frame.top - frame.bottom);
  for (const Label& label : labels) {
    const double half_width = kLetterWidth * kLabelSize * static_cast<double>(label.text.size()) / 2,
                 half_height = kLineHeight * kLabelSize / 2;
    std::optional<PixelBox> best;
    double least = std::numeric_limits<double>::infinity();
    for (double away = 0; away < std::min(furthest, least); away += kStep)
      for (int i = 0; i < kDirections; ++i) {
        const auto [dx, dy] = Direction(i);
        const double x = label.x + dx * (clearance + half_width + away),
                     y = label.y + dy * (clearance + half_height + away);
        const PixelBox box{x - half_width, y - half_height, x + half_width, y + half_height};
        if (!frame.Holds(box) || MeetsAny(marks, box) || MeetsAny(placed, box)) continue;
        const bool is_across = MeetsAny(lines, box);
        const double cost = away + (is_across ? kLinePenalty : 0);
        if (cost < least) least = cost, best = box;
      }
    if (!best) throw std::runtime_error("picture: no room for the label " + label.text);
    placed.push_back(*best);
  }
  return placed;
}

}  // namespace forereach::research
