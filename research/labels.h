/** Where the labels of a picture go: beside their marks, and off each other. */
#pragma once

#include <span>
#include <string>
#include <vector>

namespace forereach::research {

/** Part of a picture, in pixels; y goes up. */
struct PixelBox {
  double left, bottom, right, top;

  [[nodiscard]] bool Meets(const PixelBox& other) const {
    return left < other.right && other.left < right && bottom < other.top && other.bottom < top;
  }
  [[nodiscard]] bool Holds(const PixelBox& other) const {
    return left <= other.left && other.right <= right && bottom <= other.bottom && other.top <= top;
  }
};

/** The text of a mark, and the mark's center. */
struct Label {
  double x, y;
  std::string text;
};

inline constexpr double kLabelSize = 9;  ///< Of the font

/** A box for each label, which holds its text, centered, in any usual font: in the frame, off every mark and off every
other label; as near to its mark as that allows, but rather further than across a line.
@param clearance from a mark's center to where its label may begin. @throws std::runtime_error if there is no room. */
[[nodiscard]] std::vector<PixelBox> PlaceLabels(const PixelBox& frame, std::span<const PixelBox> marks,
                                                std::span<const PixelBox> lines, std::span<const Label> labels,
                                                double clearance);

}  // namespace forereach::research
