#include "records/picture.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <memory>
#include <system_error>
#include <utility>

#include <cairo.h>
#include <fmt/core.h>

#include "records/canvas.h"

namespace forereach {
namespace {

using Eigen::Vector2d;

struct Color {
  double red, green, blue;
};

// Told apart with every common colour blindness (the set of Okabe and Ito), and by lightness in grey.
constexpr Color kWhite{1, 1, 1};
constexpr Color kInk{0.13, 0.13, 0.15};
constexpr Color kFaintInk{0.45, 0.45, 0.48};
constexpr Color kFrame{0.80, 0.80, 0.82};
constexpr Color kObstacle{0.42, 0.43, 0.47};
constexpr Color kExecuted{0.00, 0.62, 0.45};
constexpr Color kCertified{0.34, 0.71, 0.91};
constexpr Color kAbstained{0.84, 0.37, 0.00};
constexpr Color kGoal{0.90, 0.62, 0.00};

constexpr double kMargin = 24, kHeader = 74, kFooter = 62;  // pixels at 1200 x 800

struct Extent {
  Vector2d lower{INFINITY, INFINITY}, upper{-INFINITY, -INFINITY};

  void Add(const Vector2d& point, double radius = 0) {
    if (!point.allFinite() || !std::isfinite(radius)) return;
    lower = lower.cwiseMin(point - Vector2d::Constant(radius));
    upper = upper.cwiseMax(point + Vector2d::Constant(radius));
  }
  void Add(const std::vector<Vector2d>& points) {
    for (const Vector2d& point : points) Add(point);
  }
};

// Half-planes have no extent, and a tube that was refused may be as wide as it likes: the rest sets the frame.
Extent ExtentOf(const Picture& picture) {
  Extent extent;
  extent.Add(picture.path);
  for (const auto& circle : picture.circles) extent.Add(circle.center, circle.radius);
  for (const auto& polygon : picture.polygons) extent.Add(polygon);
  for (const auto& body : picture.bodies) extent.Add(body);
  for (const auto& slice : picture.executed) extent.Add(slice);
  for (const auto& slice : picture.certified) extent.Add(slice);
  for (const auto& slice : picture.expected) extent.Add(slice);
  extent.Add(picture.observations);
  if (picture.goal) extent.Add(picture.goal->center, picture.goal->radius);
  if (!(extent.lower.x() <= extent.upper.x())) extent.Add(Vector2d::Zero(), 1);
  const Vector2d least = (Vector2d::Constant(1.0) - (extent.upper - extent.lower)).cwiseMax(0) / 2;
  const double space = 0.03 * (extent.upper - extent.lower).maxCoeff();
  extent.lower -= least + Vector2d::Constant(space);
  extent.upper += least + Vector2d::Constant(space);
  return extent;
}

// 1, 2 or 5 times a power of ten, at most `length`.
double RoundLength(double length) {
  const double power = std::pow(10.0, std::floor(std::log10(length)));
  for (const double factor : {5.0, 2.0})
    if (factor * power <= length) return factor * power;
  return power;
}

class Painter final {
 public:
  Painter(cairo_t* cairo, const Picture& picture, int width, int height)
      : cairo_(cairo),
        picture_(picture),
        unit_(std::min(width / 1200.0, height / 800.0)),
        width_(width),
        height_(height) {
    const Extent extent = ExtentOf(picture);
    const Vector2d size = extent.upper - extent.lower;
    left_ = kMargin * unit_;
    top_ = kHeader * unit_;
    frame_width_ = width_ - 2 * left_;
    frame_height_ = height_ - top_ - kFooter * unit_;
    scale_ = std::min(frame_width_ / size.x(), frame_height_ / size.y());
    lower_ = (extent.lower + extent.upper - Vector2d(frame_width_, frame_height_) / scale_) / 2;
  }

  void Paint() {
    SelectFont(CAIRO_FONT_WEIGHT_NORMAL);
    cairo_set_line_join(cairo_, CAIRO_LINE_JOIN_ROUND);
    cairo_set_line_cap(cairo_, CAIRO_LINE_CAP_ROUND);
    SetColor(kWhite);
    cairo_paint(cairo_);
    PaintHeader();
    cairo_save(cairo_);
    cairo_rectangle(cairo_, left_, top_, frame_width_, frame_height_);
    cairo_clip(cairo_);
    PaintGrid();
    PaintGoal();
    PaintTube(picture_.certified, kCertified, 0.30);
    PaintTube(picture_.expected, kCertified, 0.30);
    PaintTube(picture_.executed, kExecuted, 0.55);
    PaintObservations();
    PaintObstacles();
    PaintOutlines(picture_.predictions, kObstacle);
    PaintAbstained();
    PaintOutlines(picture_.bodies, kInk);
    PaintPath();
    cairo_restore(cairo_);
    PaintFrame();
    PaintLegend();
  }

 private:
  Vector2d ToPixels(const Vector2d& point) const {
    return {left_ + scale_ * (point.x() - lower_.x()), top_ + frame_height_ - scale_ * (point.y() - lower_.y())};
  }

  void SetColor(const Color& color, double alpha = 1) {
    cairo_set_source_rgba(cairo_, color.red, color.green, color.blue, alpha);
  }

  void Stroke(const Color& color, double line_width, double alpha = 1) {
    SetColor(color, alpha);
    cairo_set_line_width(cairo_, line_width * unit_);
    cairo_stroke(cairo_);
  }

  void FillAndStroke(const Color& fill, double fill_alpha, const Color& line, double line_width,
                     double line_alpha = 1) {
    SetColor(fill, fill_alpha);
    cairo_fill_preserve(cairo_);
    Stroke(line, line_width, line_alpha);
  }

  // Corners that lie closer together than the eye can tell are left out: a slice has up to two hundred.
  void Trace(const std::vector<Vector2d>& points) {
    Vector2d last{INFINITY, INFINITY};
    for (const Vector2d& point : points) {
      const Vector2d pixel = ToPixels(point);
      if (!pixel.allFinite() || (pixel - last).norm() < 0.3 * unit_) continue;
      cairo_line_to(cairo_, pixel.x(), pixel.y());
      last = pixel;
    }
  }

  void TraceClosed(const std::vector<Vector2d>& points) {
    cairo_new_sub_path(cairo_);
    Trace(points);
    cairo_close_path(cairo_);
  }

  void TraceDisc(const Vector2d& pixel, double radius_px) {
    cairo_new_sub_path(cairo_);
    cairo_arc(cairo_, pixel.x(), pixel.y(), radius_px, 0, 2 * M_PI);
  }

  void SelectFont(cairo_font_weight_t weight) {
    cairo_select_font_face(cairo_, "DejaVu Sans", CAIRO_FONT_SLANT_NORMAL, weight);
  }

  double TextWidth(const std::string& text, double size) {
    cairo_set_font_size(cairo_, size * unit_);
    cairo_text_extents_t extents;
    cairo_text_extents(cairo_, text.c_str(), &extents);
    return extents.x_advance;
  }

  void Write(const std::string& text, double x, double y, double size, const Color& color, bool bold = false) {
    SelectFont(bold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
    cairo_set_font_size(cairo_, size * unit_);
    SetColor(color);
    cairo_move_to(cairo_, x, y);
    cairo_show_text(cairo_, text.c_str());
    SelectFont(CAIRO_FONT_WEIGHT_NORMAL);
    cairo_new_path(cairo_);
  }

  void PaintHeader() {
    Write(picture_.title, kMargin * unit_, 33 * unit_, 19, kInk, true);
    std::string line;
    for (const std::string& number : picture_.key_numbers) line += (line.empty() ? "" : "   \u00b7   ") + number;
    double size = 13.5;
    while (size > 9 && TextWidth(line, size) > width_ - 2 * kMargin * unit_) size -= 0.5;
    Write(line, kMargin * unit_, 57 * unit_, size, kFaintInk);
  }

  void PaintGrid() {
    const double step = RoundLength(std::max(frame_width_, frame_height_) / scale_ / 6);
    for (double x = std::ceil(lower_.x() / step) * step; ToPixels({x, 0}).x() < left_ + frame_width_; x += step)
      Trace({{x, lower_.y()}, {x, lower_.y() + frame_height_ / scale_}}), cairo_new_sub_path(cairo_);
    for (double y = std::ceil(lower_.y() / step) * step; ToPixels({0, y}).y() > top_; y += step)
      Trace({{lower_.x(), y}, {lower_.x() + frame_width_ / scale_, y}}), cairo_new_sub_path(cairo_);
    Stroke(kFrame, 0.8, 0.55);
  }

  void PaintFrame() {
    cairo_rectangle(cairo_, left_, top_, frame_width_, frame_height_);
    Stroke(kFrame, 1);
  }

  // One layer for all slices, so that where many overlap it is no darker than where one lies alone.
  void PaintTube(const std::vector<Picture::Polygon>& slices, const Color& color, double alpha) {
    if (slices.empty()) return;
    cairo_push_group(cairo_);
    for (const auto& slice : slices) {
      TraceClosed(slice);
      SetColor(color);
      cairo_fill_preserve(cairo_);
      cairo_set_line_width(cairo_, 0.6 * unit_);  // a slice thinner than a pixel still shows
      cairo_stroke(cairo_);
    }
    cairo_pop_group_to_source(cairo_);
    cairo_paint_with_alpha(cairo_, alpha);
    // Outlines tell how wide one slice is, where they are few enough to be told apart.
    for (const auto& slice : slices) TraceClosed(slice);
    Stroke(color, 0.7, 0.35);
  }

  void PaintAbstained() {
    for (const auto& tube : picture_.abstained) {
      for (const auto& slice : tube) TraceClosed(slice);
      Stroke(kAbstained, 0.8, 0.4);
      if (tube.empty()) continue;
      TraceClosed(tube.back());  // where it was found unsafe
      Stroke(kAbstained, 1.6, 0.9);
    }
  }

  void PaintObstacles() {
    for (const auto& circle : picture_.circles) TraceDisc(ToPixels(circle.center), scale_ * circle.radius);
    for (const auto& polygon : picture_.polygons) TraceClosed(polygon);
    for (const auto& half_plane : picture_.half_planes) {
      // A rectangle with one edge on the line, larger than the frame.
      const double far = 2 * (frame_width_ + frame_height_) / scale_;
      const Vector2d normal = half_plane.normal.normalized(), along{-normal.y(), normal.x()};
      const Vector2d middle = lower_ + Vector2d(frame_width_, frame_height_) / (2 * scale_);
      const Vector2d foot = middle + (half_plane.offset / half_plane.normal.norm() - normal.dot(middle)) * normal;
      TraceClosed({foot - far * along, foot + far * along, foot + far * along + far * normal,
                   foot - far * along + far * normal});
    }
    FillAndStroke(kObstacle, 0.88, kInk, 0.8, 0.8);
  }

  void PaintOutlines(const std::vector<Picture::Polygon>& polygons, const Color& color) {
    for (const auto& polygon : polygons) TraceClosed(polygon);
    Stroke(color, 1, 0.7);
  }

  void PaintGoal() {
    if (!picture_.goal) return;
    TraceDisc(ToPixels(picture_.goal->center), std::max(scale_ * picture_.goal->radius, 3 * unit_));
    FillAndStroke(kGoal, 0.22, kGoal, 2);
  }

  void PaintObservations() {
    for (const Vector2d& place : picture_.observations) TraceDisc(ToPixels(place), 1.6 * unit_);
    SetColor(kFaintInk, 0.7);
    cairo_fill(cairo_);
  }

  void PaintStop(const Vector2d& pixel) {
    const double half = 4 * unit_;
    cairo_rectangle(cairo_, pixel.x() - half, pixel.y() - half, 2 * half, 2 * half);
    FillAndStroke(kWhite, 1, kInk, 1.6);
  }

  void PaintPath() {
    if (picture_.path.empty()) return;
    Trace(picture_.path);
    Stroke(kInk, 2);
    for (const Vector2d& stop : picture_.stops) PaintStop(ToPixels(stop));
    PaintRing(ToPixels(picture_.path.front()), 6);
    TraceDisc(ToPixels(picture_.path.back()), 4.5 * unit_);
    SetColor(kInk);
    cairo_fill(cairo_);
  }

  void PaintSwatch(double x, double y, const Color& color, double fill, double line) {
    cairo_rectangle(cairo_, x, y - 10 * unit_, 22 * unit_, 13 * unit_);
    FillAndStroke(color, fill, color, 1.2, line);
  }

  void PaintLine(double x, double y) {
    cairo_move_to(cairo_, x, y - 3.5 * unit_);
    cairo_line_to(cairo_, x + 22 * unit_, y - 3.5 * unit_);
    Stroke(kInk, 2);
  }

  // Only what the picture shows has an entry.
  void PaintLegend() {
    const double y = height_ - 24 * unit_;
    double x = kMargin * unit_;
    const auto entry = [&](bool shown, const std::string& name, const std::function<void()>& symbol) {
      if (!shown) return;
      symbol();
      Write(name, x + 29 * unit_, y, 12.5, kInk);
      x += 29 * unit_ + TextWidth(name, 12.5) + 20 * unit_;
    };
    const bool obstacles = !(picture_.circles.empty() && picture_.polygons.empty() && picture_.half_planes.empty());
    entry(!picture_.executed.empty(), "certified, executed", [&] { PaintSwatch(x, y, kExecuted, 0.55, 1); });
    entry(!picture_.certified.empty(), "certified, replaced", [&] { PaintSwatch(x, y, kCertified, 0.30, 0.6); });
    entry(!picture_.expected.empty(), "tube without obstacles", [&] { PaintSwatch(x, y, kCertified, 0.30, 0.6); });
    entry(!picture_.observations.empty(), "data", [&] {
      TraceDisc({x + 11 * unit_, y - 4 * unit_}, 2.5 * unit_);
      SetColor(kFaintInk);
      cairo_fill(cairo_);
    });
    entry(!picture_.abstained.empty(), "abstained (S)", [&] { PaintSwatch(x, y, kAbstained, 0, 1); });
    entry(obstacles, "obstacle", [&] { PaintSwatch(x, y, kObstacle, 0.88, 1); });
    entry(!picture_.predictions.empty(), "predicted", [&] { PaintSwatch(x, y, kObstacle, 0, 0.7); });
    entry(picture_.path.size() > 1, "driven", [&] { PaintLine(x, y); });
    entry(!picture_.path.empty(), "start", [&] { PaintRing({x + 11 * unit_, y - 4 * unit_}, 5.5); });
    entry(!picture_.stops.empty(), "stop", [&] { PaintStop({x + 11 * unit_, y - 4 * unit_}); });
    entry(picture_.goal.has_value(), "goal", [&] { PaintSwatch(x, y, kGoal, 0.22, 1); });
    PaintScaleBar(y);
  }

  void PaintRing(const Vector2d& pixel, double radius) {
    TraceDisc(pixel, radius * unit_);
    FillAndStroke(kWhite, 1, kInk, 2);
  }

  void PaintScaleBar(double y) {
    const double length = RoundLength(150 * unit_ / scale_), pixels = length * scale_;
    const double right = width_ - kMargin * unit_, left = right - pixels, tick = 4 * unit_, line = y + 1 * unit_;
    cairo_move_to(cairo_, left, line - tick);
    cairo_line_to(cairo_, left, line);
    cairo_line_to(cairo_, right, line);
    cairo_line_to(cairo_, right, line - tick);
    Stroke(kInk, 1.4);
    const std::string text = fmt::format("{:g} m", length);
    Write(text, left + (pixels - TextWidth(text, 12.5)) / 2, line - 6 * unit_, 12.5, kInk);
  }

  cairo_t* cairo_;
  const Picture& picture_;
  double unit_, width_, height_;
  double scale_ = 1, left_ = 0, top_ = 0, frame_width_ = 0, frame_height_ = 0;  // pixels, scale_ in pixels per metre
  Vector2d lower_;                                                              // metres, the frame's lower left
};

}  // namespace

std::vector<std::string> PictureFiles(const std::string& name) {
  const std::filesystem::path path(name);
  if (!path.has_filename()) throw PictureError("picture: '" + name + "' names no file");
  const std::string ending = path.extension();
  if (!ending.empty() && ending != ".svg" && ending != ".png" && ending != ".pdf")
    throw PictureError("picture: " + name + " ends in " + ending +
                       "; it has to end in .svg, .png or .pdf, or have no ending: then a .svg and a .png are written");
  const std::filesystem::path directory = path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
  std::error_code ignored;
  if (!std::filesystem::is_directory(directory, ignored))
    throw PictureError("picture: " + name + ": there is no directory " + directory.string());
  const std::vector<std::string> files = ending.empty() ? std::vector{name + ".svg", name + ".png"} : std::vector{name};
  for (const std::string& file : files)
    if (std::filesystem::is_directory(file, ignored))
      throw PictureError("picture: " + file + " is a directory, not a file");
  return files;
}

void DrawPicture(const Picture& picture, const std::string& path, int width, int height) {
  DrawFile(path, width, height, [&](cairo_t* cairo) { Painter(cairo, picture, width, height).Paint(); });
}

}  // namespace forereach
