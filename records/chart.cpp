#include "records/chart.h"

#include <array>
#include <cmath>
#include <stdexcept>

#include <cairo.h>
#include <fmt/core.h>

#include "records/canvas.h"

namespace forereach {
namespace {

constexpr std::size_t kMostSeries = 6;
// Told apart with every common colour blindness (the set of Okabe and Ito).
constexpr std::array<std::array<double, 3>, kMostSeries> kColors{{{0.84, 0.37, 0.00},
                                                                  {0.90, 0.62, 0.00},
                                                                  {0.00, 0.45, 0.70},
                                                                  {0.00, 0.62, 0.45},
                                                                  {0.80, 0.47, 0.65},
                                                                  {0.13, 0.13, 0.15}}};
constexpr double kLeft = 70, kRight = 30, kTop = 60, kBottom = 105;  // pixels

class ChartPainter {
 public:
  ChartPainter(cairo_t* cairo, const Chart& chart, double width, double height)
      : cairo_(cairo), chart_(chart), width_(width), height_(height) {}

  void Paint() {
    BeginDrawing(cairo_);
    Write(chart_.title, kLeft, 34, 18);
    PaintAxes();
    for (std::size_t s = 0; s < chart_.series.size(); ++s) PaintSeries(s);
    PaintLegend();
  }

 private:
  double X(double x) const {
    const double least = std::log(chart_.x.front()), range = std::log(chart_.x.back()) - least;
    return kLeft + (width_ - kLeft - kRight) * (range > 0 ? (std::log(x) - least) / range : 0.5);
  }
  double Y(double percent) const { return height_ - kBottom - (height_ - kTop - kBottom) * percent / 100; }

  void Write(const std::string& text, double x, double y, double size) { WriteText(cairo_, text, x, y, size); }
  void Line(double x0, double y0, double x1, double y1) {
    cairo_set_source_rgb(cairo_, 0.80, 0.80, 0.82);
    cairo_set_line_width(cairo_, 1);
    cairo_move_to(cairo_, x0, y0);
    cairo_line_to(cairo_, x1, y1);
    cairo_stroke(cairo_);
  }

  void PaintAxes() {
    for (int percent = 0; percent <= 100; percent += 20) {
      Line(kLeft, Y(percent), width_ - kRight, Y(percent));
      Write(fmt::format("{:>3}", percent), kLeft - 36, Y(percent) + 5, 13);
    }
    for (const double x : chart_.x) {
      Line(X(x), Y(0), X(x), Y(100));
      Write(fmt::format("{:g}", x), X(x) - 8, Y(0) + 20, 13);
    }
    Write(chart_.x_name, kLeft, Y(0) + 42, 13);
    Write(chart_.y_name, kLeft, Y(100) - 8, 13);
  }

  void UseColor(std::size_t s) { cairo_set_source_rgb(cairo_, kColors[s][0], kColors[s][1], kColors[s][2]); }
  void Mark(double x, double y) {
    cairo_arc(cairo_, x, y, 4, 0, 2 * M_PI);
    cairo_fill(cairo_);
  }

  void PaintSeries(std::size_t s) {
    UseColor(s);
    cairo_set_line_width(cairo_, 2);
    const std::vector<double>& y = chart_.series[s].y;
    for (std::size_t i = 0; i < y.size(); ++i) {
      if (!std::isfinite(y[i])) continue;
      if (i > 0 && std::isfinite(y[i - 1])) {
        cairo_move_to(cairo_, X(chart_.x[i - 1]), Y(y[i - 1]));
        cairo_line_to(cairo_, X(chart_.x[i]), Y(y[i]));
        cairo_stroke(cairo_);
      }
      Mark(X(chart_.x[i]), Y(y[i]));
    }
  }

  void PaintLegend() {
    double x = kLeft;
    for (std::size_t s = 0; s < chart_.series.size(); ++s) {
      UseColor(s);
      Mark(x, height_ - 26);
      Write(chart_.series[s].name, x + 10, height_ - 21, 13);
      cairo_text_extents_t extents;
      cairo_text_extents(cairo_, chart_.series[s].name.c_str(), &extents);
      x += extents.x_advance + 32;
    }
  }

  cairo_t* cairo_;
  const Chart& chart_;
  const double width_, height_;
};

void Require(const Chart& chart) {
  if (chart.x.empty() || !(chart.x.front() > 0)) throw std::invalid_argument("chart: x is positive");
  for (std::size_t i = 1; i < chart.x.size(); ++i)
    if (!(chart.x[i - 1] < chart.x[i])) throw std::invalid_argument("chart: x has to rise");
  if (chart.series.size() > kMostSeries)
    throw std::invalid_argument(fmt::format("chart: {} series, at most {}", chart.series.size(), kMostSeries));
  for (const Chart::Series& series : chart.series)
    if (series.y.size() != chart.x.size())
      throw std::invalid_argument(
          fmt::format("chart: {} has {} values for {} x", series.name, series.y.size(), chart.x.size()));
}

}  // namespace

void DrawChart(const Chart& chart, const std::string& path, int width, int height) {
  Require(chart);
  DrawFile(path, width, height, [&](cairo_t* cairo) { ChartPainter(cairo, chart, width, height).Paint(); });
}

}  // namespace forereach
