/** Drawings as SVG: one piece of text that the page of a run shows, the live page too, and picture files have. For
display, not for bounds. */
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Geometry>

namespace forereach {

/** Attributes are as they stand in a tag, such as "class=\"tube\"". A shape of which a coordinate is not finite, or as
large as 1e9, is left out. */
class Svg final {
 public:
  using Points = std::vector<Eigen::Vector2d>;

  /** The point y, y[1] upwards, is drawn at scale (y - origin), rounded to multiples of `unit`. */
  Svg(const Eigen::Vector2d& origin, double scale, double unit) : origin_(origin), scale_(scale), unit_(unit) {}
  /** In a group that maps a grid of 2^14 cells over the frame to metres. Done ends it. @pre CanBeDrawn(frame). */
  explicit Svg(const Eigen::AlignedBox2d& frame);

  static constexpr double kFarthest = 1e9;  ///< metres

  [[nodiscard]] static bool CanBeDrawn(const Eigen::Vector2d& point);
  /** Whether a frame has a place in the plane. */
  [[nodiscard]] static bool CanBeDrawn(const Eigen::AlignedBox2d& frame);

  void Open(std::string_view attributes);
  void Close() { text_ += "</g>"; }
  /** A convex polygon without the corners within half a percent of its diameter from the rest. */
  void Polygon(const Points& corners, std::string_view attributes = "", std::string_view inside = "");
  void Line(const Points& points, std::string_view attributes = "");
  void Circle(const Eigen::Vector2d& center, double radius, std::string_view attributes = "",
              std::string_view inside = "");
  /** A line without length, whose round ends are a dot of the stroke's width. */
  void Dot(const Eigen::Vector2d& at, std::string_view attributes) { Path({at, at}, false, attributes, ""); }
  /** @param text of a stranger, too. */
  void Text(const Eigen::Vector2d& at, std::string_view text, std::string_view attributes = "");
  /** SVG as it is. */
  void Add(std::string_view svg) { text_ += svg; }

  /** A length, or what a point moves by, as the drawing has it. */
  [[nodiscard]] std::string Length(double metres) const;
  [[nodiscard]] std::string Shift(const Eigen::Vector2d& by) const { return Length(by.x()) + " " + Length(-by.y()); }

  [[nodiscard]] std::string Done();

 private:
  void Path(const Points& points, bool is_closed, std::string_view attributes, std::string_view inside);
  [[nodiscard]] double Rounded(double length) const;

  Eigen::Vector2d origin_;
  double scale_, unit_;
  std::string text_, end_;
};

/** The corners of a convex polygon without those that change it little: what is left out lies within `tolerance` of
the rest. Keeps at least three corners of three. */
[[nodiscard]] Svg::Points Simplified(const Svg::Points& polygon, double tolerance);

}  // namespace forereach
