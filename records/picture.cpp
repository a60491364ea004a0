#include "records/picture.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <memory>
#include <numeric>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include <librsvg/rsvg.h>

#include "records/outlines.h"
#include "records/output_file.h"

namespace forereach {
namespace {

using Eigen::Vector2d;
using Polygons = std::vector<Svg::Points>;

// Told apart with every common colour blindness (the set of Okabe and Ito), and by lightness in grey.
constexpr const char *kInk = "#212126", *kFaintInk = "#73737a", *kFrame = "#ccccd1", *kObstacle = "#6b6e78",
                     *kExecuted = "#009e73", *kCertified = "#56b4e9", *kAbstained = "#d55e00", *kGoal = "#e69f00";

constexpr double kMargin = 24, kHeader = 74, kFooter = 62;  // pixels at 1200 x 800

// Half-planes have no extent, and a tube that was refused may be as wide as it likes: the rest sets the frame.
Eigen::AlignedBox2d ExtentOf(const Picture& picture) {
  Eigen::AlignedBox2d extent;
  const auto add = [&extent](const Svg::Points& points, double radius = 0) {
    for (const Vector2d& point : points)
      for (const double way : {-radius, radius})
        if (Svg::CanBeDrawn(point + Vector2d::Constant(way))) extent.extend(point + Vector2d::Constant(way));
  };
  for (const Obstacle& obstacle : picture.obstacles) {
    const auto place = PlaceOf(obstacle, obstacle.motion() ? static_cast<double>(obstacle.motion()->stamp_us) : 0);
    if (place) add(place->points, place->radius);
  }
  for (const Polygons* all : {&picture.bodies, &picture.executed, &picture.certified, &picture.expected})
    for (const Svg::Points& polygon : *all) add(polygon);
  add(picture.path);
  add(picture.observations);
  if (picture.goal) add({picture.goal->center}, picture.goal->radius);
  if (extent.isEmpty()) add({Vector2d::Zero()}, 1);
  const Vector2d border =
      (Vector2d::Constant(1.0) - extent.sizes()).cwiseMax(0) / 2 + Vector2d::Constant(0.03 * extent.sizes().maxCoeff());
  return {extent.min() - border, extent.max() + border};
}

// 1, 2 or 5 times a power of ten, at most `length`.
double RoundLength(double length) {
  const double power = std::pow(10.0, std::floor(std::log10(length)));
  for (const double factor : {5.0, 2.0})
    if (factor * power <= length) return factor * power;
  return power;
}

// About as wide as it is in DejaVu Sans.
double TextWidth(const std::string& text, double size) {
  const auto is_begin = [](char c) { return (static_cast<unsigned char>(c) & 0xc0) != 0x80; };
  return 0.51 * size * static_cast<double>(std::ranges::count_if(text, is_begin));
}

// Lengths of header and legend are in units, of which 1200 x 800 fit.
class Painter final {
 public:
  Painter(const Picture& picture, int width, int height)
      : picture_(picture),
        unit_(std::min(width / 1200.0, height / 800.0)),
        width_(width / unit_),
        height_(height / unit_) {
    const Eigen::AlignedBox2d extent = ExtentOf(picture);
    const Vector2d size(width_ - 2 * kMargin, height_ - kHeader - kFooter);
    scale_ = (size.array() / extent.sizes().array()).minCoeff();
    frame_ = {extent.center() - size / (2 * scale_), extent.center() + size / (2 * scale_)};
    svg_ = Svg({frame_.min().x() - kMargin / scale_, frame_.max().y() + kHeader / scale_}, scale_, 0.01);
  }

  std::string Paint() {
    svg_.Open(fmt::format(
        "transform=\"scale({:.6g})\" fill=\"none\" stroke-linejoin=\"round\" stroke-linecap=\"round\"", unit_));
    PaintHeader();
    svg_.Add(fmt::format("<clipPath id=\"frame\"><rect x=\"{0}\" y=\"{1}\" width=\"{2}\" height=\"{3}\"/></clipPath>",
                         kMargin, kHeader, width_ - 2 * kMargin, height_ - kHeader - kFooter));
    svg_.Open("clip-path=\"url(#frame)\"");
    PaintGrid();
    if (picture_.goal) {
      svg_.Circle(picture_.goal->center, std::max(picture_.goal->radius, 3 / scale_), Fill(kGoal, 0.22, 2));
    }
    PaintTube(picture_.certified, kCertified, 0.30);
    PaintTube(picture_.expected, kCertified, 0.30);
    PaintTube(picture_.executed, kExecuted, 0.55);
    svg_.Open(Line(kFaintInk, 3.2, 0.7));
    for (const Vector2d& place : picture_.observations) svg_.Dot(place, "");
    svg_.Close();
    PaintObstacles();
    for (const Polygons& tube : picture_.abstained) {
      PaintOutlines(tube, Line(kAbstained, 0.8, 0.4));
      if (!tube.empty()) svg_.Polygon(tube.back(), Line(kAbstained, 1.6, 0.9));  // where it was found unsafe
    }
    PaintOutlines(picture_.bodies, Line(kInk, 1, 0.7));
    PaintPath();
    svg_.Close();
    svg_.Polygon(Corners(frame_), Line(kFrame, 1));
    PaintLegend();
    svg_.Close();
    return svg_.Done();
  }

 private:
  static std::string Line(const char* color, double width, double alpha = 1) {
    return fmt::format("stroke=\"{}\" stroke-width=\"{}\" stroke-opacity=\"{}\"", color, width, alpha);
  }
  static std::string Fill(const char* color, double alpha, double width, const char* line = nullptr) {
    return fmt::format("fill=\"{}\" fill-opacity=\"{}\" ", color, alpha) + Line(line ? line : color, width);
  }
  static Svg::Points Corners(const Eigen::AlignedBox2d& box) {
    return {box.min(), {box.max().x(), box.min().y()}, box.max(), {box.min().x(), box.max().y()}};
  }
  // The place in the plane of one in the picture, in units from its upper left.
  Vector2d At(double x, double y) const {
    return {frame_.min().x() + (x - kMargin) / scale_, frame_.max().y() + (kHeader - y) / scale_};
  }
  void Write(const std::string& text, double x, double y, double size, const char* color, const char* more = "") {
    svg_.Text(At(x, y), text, fmt::format("font-size=\"{}\" fill=\"{}\" {}", size, color, more));
  }

  void PaintHeader() {
    const auto fitting = [this](double width, double most) {
      return std::clamp((width_ - 2 * kMargin) / width, 9.0, most);
    };
    constexpr double kBold = 1.2;  // as much wider
    Write(picture_.title, kMargin, 33, fitting(kBold * TextWidth(picture_.title + " ", 1), 19), kInk,
          "font-weight=\"bold\"");
    const std::string line = fmt::format("{}", fmt::join(picture_.key_numbers, "   \u00b7   "));
    Write(line, kMargin, 57, fitting(TextWidth(line + " ", 1), 13.5), kFaintInk, "xml:space=\"preserve\"");
  }

  void PaintGrid() {
    const double step = RoundLength(frame_.sizes().maxCoeff() / 6);
    svg_.Open(Line(kFrame, 0.8, 0.55));
    for (double x = std::ceil(frame_.min().x() / step) * step; x < frame_.max().x(); x += step)
      svg_.Line({{x, frame_.min().y()}, {x, frame_.max().y()}});
    for (double y = std::ceil(frame_.min().y() / step) * step; y < frame_.max().y(); y += step)
      svg_.Line({{frame_.min().x(), y}, {frame_.max().x(), y}});
    svg_.Close();
  }

  void PaintOutlines(const Polygons& polygons, const std::string& attributes) {
    svg_.Open(attributes);
    for (const Svg::Points& polygon : polygons) svg_.Polygon(polygon);
    svg_.Close();
  }

  // One layer for all slices, so that where many overlap it is no darker than where one lies alone; a slice thinner
  // than a pixel still shows. Outlines tell how wide one slice is, where they are few enough to be told apart.
  void PaintTube(const Polygons& slices, const char* color, double alpha) {
    if (slices.empty()) return;
    PaintOutlines(slices, fmt::format("opacity=\"{}\" ", alpha) + Fill(color, 1, 0.6));
    PaintOutlines(slices, Line(color, 0.7, 0.35));
  }

  void PaintObstacles() {
    svg_.Open(fmt::format("opacity=\"0.88\" {}", Fill(kObstacle, 1, 0.8)));
    for (const Obstacle& obstacle : picture_.obstacles)
      DrawObstacle(obstacle, {obstacle.motion() ? static_cast<double>(obstacle.motion()->stamp_us) : 0}, frame_, "",
                   svg_);
    svg_.Close();
    for (const Obstacle& obstacle : picture_.obstacles)
      if (obstacle.motion())
        PaintOutlines(PredictionOf(obstacle, obstacle.motion()->stamp_us), Line(kObstacle, 1, 0.7));
  }

  void PaintStop(const Vector2d& at) {
    const Vector2d half = Vector2d::Constant(4 / scale_);
    svg_.Polygon(Corners({at - half, at + half}), Fill("#fff", 1, 1.6, kInk));
  }
  void PaintRing(const Vector2d& at, double radius) { svg_.Circle(at, radius / scale_, Fill("#fff", 1, 2, kInk)); }

  void PaintPath() {
    if (picture_.path.empty()) return;
    svg_.Line(picture_.path, Line(kInk, 2));
    for (const Vector2d& stop : picture_.stops) PaintStop(stop);
    PaintRing(picture_.path.front(), 6);
    svg_.Dot(picture_.path.back(), Line(kInk, 9));
  }

  // Only what the picture shows has an entry.
  void PaintLegend() {
    const double y = height_ - 24;
    double x = kMargin;
    const auto entry = [&](bool shown, const std::string& name, const std::function<void()>& symbol) {
      if (!shown) return;
      symbol();
      Write(name, x + 29, y, 12.5, kInk);
      x += 29 + TextWidth(name, 12.5) + 20;
    };
    const auto swatch = [&](const char* color, double fill) {
      return [=, this, &x] {
        svg_.Polygon({At(x, y + 3), At(x + 22, y + 3), At(x + 22, y - 10), At(x, y - 10)}, Fill(color, fill, 1.2));
      };
    };
    const auto middle = [&] { return At(x + 11, y - 4); };
    const bool predicted =
        std::ranges::any_of(picture_.obstacles, [](const Obstacle& each) { return !!each.motion(); });
    entry(!picture_.executed.empty(), "certified, executed", swatch(kExecuted, 0.55));
    entry(!picture_.certified.empty(), "certified, replaced", swatch(kCertified, 0.30));
    entry(!picture_.expected.empty(), picture_.expected_name, swatch(kCertified, 0.30));
    entry(!picture_.observations.empty(), "data", [&] { svg_.Dot(middle(), Line(kFaintInk, 5)); });
    entry(!picture_.abstained.empty(), "abstained (S)", swatch(kAbstained, 0));
    entry(!picture_.obstacles.empty(), "obstacle", swatch(kObstacle, 0.88));
    entry(predicted, "predicted", swatch(kObstacle, 0));
    entry(picture_.path.size() > 1, "driven", [&] { svg_.Line({At(x, y - 3.5), At(x + 22, y - 3.5)}, Line(kInk, 2)); });
    entry(!picture_.path.empty(), "start", [&] { PaintRing(middle(), 5.5); });
    entry(!picture_.stops.empty(), "stop", [&] { PaintStop(middle()); });
    entry(picture_.goal.has_value(), "goal", swatch(kGoal, 0.22));
    PaintScaleBar(y);
  }

  void PaintScaleBar(double y) {
    const double length = RoundLength(150 / scale_), right = width_ - kMargin, left = right - length * scale_;
    svg_.Line({At(left, y - 3), At(left, y + 1), At(right, y + 1), At(right, y - 3)}, Line(kInk, 1.4));
    Write(fmt::format("{:g} m", length), (left + right) / 2, y - 5, 12.5, kInk, "text-anchor=\"middle\"");
  }

  const Picture& picture_;
  double unit_, width_, height_;  // pixels; units
  double scale_ = 1;              // units per metre
  Eigen::AlignedBox2d frame_;     // metres
  Svg svg_{Vector2d::Zero(), 1, 1};
};

std::string PngOf(const std::string& svg) {
  GError* error = nullptr;
  const auto require = [&](bool done) {
    if (done) return;
    const std::string why = error ? error->message : "there is not enough memory";
    g_clear_error(&error);
    throw PictureError(fmt::format("picture: a .png cannot be drawn: {}", why));
  };
  const std::unique_ptr<RsvgHandle, decltype(&g_object_unref)> handle(
      rsvg_handle_new_from_data(reinterpret_cast<const guint8*>(svg.data()), svg.size(), &error), &g_object_unref);
  require(handle != nullptr);
  const std::unique_ptr<GdkPixbuf, decltype(&g_object_unref)> pixels(rsvg_handle_get_pixbuf(handle.get()),
                                                                     &g_object_unref);
  require(pixels != nullptr);
  gchar* bytes = nullptr;
  gsize size = 0;
  require(gdk_pixbuf_save_to_buffer(pixels.get(), &bytes, &size, "png", &error, nullptr));
  const std::unique_ptr<gchar, decltype(&g_free)> owner(bytes, &g_free);
  return {bytes, size};
}

}  // namespace

std::vector<std::string> PictureFiles(const std::string& name) {
  const std::filesystem::path path(name);
  if (!path.has_filename()) throw PictureError(fmt::format("picture: '{}' names no file", name));
  const std::string ending = path.extension();
  if (!ending.empty() && ending != ".svg" && ending != ".png")
    throw PictureError(
        fmt::format("picture: {} ends in {}; it has to end in .svg or .png, or have no ending: then both are written",
                    name, ending));
  const std::filesystem::path directory = path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
  std::error_code ignored;
  if (!std::filesystem::is_directory(directory, ignored))
    throw PictureError(fmt::format("picture: {}: there is no directory {}", name, directory.string()));
  const std::vector<std::string> files = ending.empty() ? std::vector{name + ".svg", name + ".png"} : std::vector{name};
  for (const std::string& file : files)
    if (std::filesystem::is_directory(file, ignored))
      throw PictureError(fmt::format("picture: {} is a directory, not a file", file));
  return files;
}

void WriteSvg(const std::string& path, int width, int height, const std::string& drawing) {
  const bool png = path.ends_with(".png");
  if (!png && !path.ends_with(".svg")) throw PictureError(fmt::format("picture: {} has to end in .svg or .png", path));
  if (width < 200 || width > 10000 || height < 200 || height > 10000)
    throw PictureError(fmt::format("picture: {} x {} pixels is not within 200 to 10000", width, height));
  const std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {0} {1}\" "
      "font-family=\"DejaVu Sans, sans-serif\"><rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>{2}</svg>\n",
      width, height, drawing);
  const std::string bytes = png ? PngOf(svg) : svg;
  OutputFile file(path, OutputFile::Existing::kReplaced);
  file.Write(bytes);
  file.Close();
}

void DrawPicture(const Picture& picture, const std::string& path, int width, int height) {
  WriteSvg(path, width, height, Painter(picture, width, height).Paint());
}

}  // namespace forereach
