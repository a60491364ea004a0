#include "records/svg.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "lcmtypes/printable.h"

namespace forereach {
namespace {

using Eigen::Vector2d;

constexpr double kTolerance = 0.005;
constexpr int kGrid = 1 << 14;

// To the chord itself: of a thin polygon the far end lies on the line through two corners before it.
double DistanceToChord(const Vector2d& point, const Vector2d& from, const Vector2d& to) {
  const Vector2d chord = to - from;
  const double square = chord.squaredNorm(), share = square > 0 ? chord.dot(point - from) / square : 0;
  return (point - from - std::clamp(share, 0.0, 1.0) * chord).norm();
}

}  // namespace

Svg::Points Simplified(const Svg::Points& polygon, double tolerance) {
  if (polygon.size() <= 3) return polygon;
  Svg::Points kept{polygon.front()};
  std::size_t last = 0;
  for (std::size_t i = 1; i + 1 < polygon.size(); ++i) {
    bool is_near = true;
    for (std::size_t k = last + 1; k <= i && is_near; ++k)
      is_near = DistanceToChord(polygon[k], polygon[last], polygon[i + 1]) <= tolerance;
    if (is_near) continue;
    kept.push_back(polygon[i]);
    last = i;
  }
  kept.push_back(polygon.back());
  return kept.size() < 3 ? polygon : kept;
}

Svg::Svg(const Eigen::AlignedBox2d& frame)
    : origin_(frame.center()), scale_(kGrid / std::max(frame.sizes().maxCoeff(), 1e-9)), unit_(1), end_("</g>") {
  text_ = fmt::format(
      "<g class=\"scene\" data-scale=\"{0:.9g}\" transform=\"translate({1:.12g} {2:.12g}) scale({0:.9g})\">",
      1 / scale_, origin_.x(), -origin_.y());
}

bool Svg::CanBeDrawn(const Vector2d& point) {
  return std::abs(point.x()) < kFarthest && std::abs(point.y()) < kFarthest;
}

bool Svg::CanBeDrawn(const Eigen::AlignedBox2d& frame) {
  return !frame.isEmpty() && CanBeDrawn(Vector2d(frame.min())) && CanBeDrawn(Vector2d(frame.max()));
}

double Svg::Rounded(double length) const { return unit_ * std::round(scale_ * length / unit_) + 0.0; }  // no -0

std::string Svg::Length(double metres) const { return fmt::format("{:.10g}", Rounded(metres)); }

void Svg::Open(std::string_view attributes) { text_.append("<g ").append(attributes).append(">"); }

// Behind the first point, a path has the differences from point to point.
void Svg::Path(const Points& points, bool is_closed, std::string_view attributes, std::string_view inside) {
  if (points.empty() || !std::ranges::all_of(points, [](const Vector2d& point) { return CanBeDrawn(point); })) return;
  text_ += "<path d=\"";
  Vector2d last = Vector2d::Zero();
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vector2d at(Rounded(points[i].x() - origin_.x()), Rounded(origin_.y() - points[i].y())), by = at - last;
    fmt::format_to(std::back_inserter(text_), "{}{:.10g} {:.10g}", i == 0 ? "M" : i == 1 ? "l" : " ", by.x(), by.y());
    last = at;
  }
  text_.append(is_closed ? "z\" " : "\" ").append(attributes);
  if (inside.empty())
    text_ += "/>";
  else
    text_.append(">").append(inside).append("</path>");
}

void Svg::Polygon(const Points& corners, std::string_view attributes, std::string_view inside) {
  Eigen::AlignedBox2d box;
  for (const Vector2d& corner : corners) box.extend(corner);
  Path(Simplified(corners, kTolerance * box.sizes().maxCoeff()), true, attributes, inside);
}

void Svg::Line(const Points& points, std::string_view attributes) { Path(points, false, attributes, ""); }

void Svg::Circle(const Vector2d& center, double radius, std::string_view attributes, std::string_view inside) {
  if (!CanBeDrawn(center) || !(radius >= 0 && radius <= kFarthest)) return;
  fmt::format_to(std::back_inserter(text_), "<circle cx=\"{}\" cy=\"{}\" r=\"{}\" {}>{}</circle>",
                 Length(center.x() - origin_.x()), Length(origin_.y() - center.y()), Length(radius), attributes,
                 inside);
}

void Svg::Text(const Vector2d& at, std::string_view text, std::string_view attributes) {
  if (!CanBeDrawn(at)) return;
  fmt::format_to(std::back_inserter(text_), "<text x=\"{}\" y=\"{}\" {}>", Length(at.x() - origin_.x()),
                 Length(origin_.y() - at.y()), attributes);
  for (const char c : Printable(text)) c == '<' ? text_ += "&lt;" : c == '&' ? text_ += "&amp;" : text_ += c;
  text_ += "</text>";
}

std::string Svg::Done() { return std::move(text_) + end_; }

}  // namespace forereach
