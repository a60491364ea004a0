#include "records/scatter.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <cairo.h>
#include <fmt/core.h>

#include "records/canvas.h"

namespace forereach {
namespace {

constexpr double kPanelWidth = 210, kPanelHeight = 130, kGap = 16, kScatterLeft = 100, kScatterTop = 70,
                 kScatterBottom = 40;  // pixels
constexpr Eigen::Index kMostDots = 2000;

class ScatterPainter {
 public:
  ScatterPainter(cairo_t* cairo, const Scatter& scatter) : cairo_(cairo), scatter_(scatter) {}

  void Paint() {
    BeginDrawing(cairo_);
    Write(scatter_.title, kGap, 28, 17);
    Legend(scatter_.first, kGap, false);
    Legend(scatter_.second, kGap + 160, true);
    for (Eigen::Index k = 0; k < scatter_.y_first.cols(); ++k)
      for (Eigen::Index l = 0; l < scatter_.x.cols(); ++l) PaintPanel(k, l);
  }

 private:
  void Write(const std::string& text, double x, double y, double size) { WriteText(cairo_, text, x, y, size); }
  void UseColor(bool second) {
    second ? cairo_set_source_rgba(cairo_, 0.00, 0.45, 0.70, 0.6)
           : cairo_set_source_rgba(cairo_, 0.84, 0.37, 0.00, 0.35);
  }
  void Dot(double x, double y, double radius) {
    cairo_arc(cairo_, x, y, radius, 0, 2 * M_PI);
    cairo_fill(cairo_);
  }
  void Legend(const std::string& name, double x, bool second) {
    UseColor(second);
    Dot(x + 5, 50, 4);
    Write(name, x + 16, 55, 13);
  }

  void PaintPanel(Eigen::Index k, Eigen::Index l) {
    const double left = kScatterLeft + static_cast<double>(l) * (kPanelWidth + kGap),
                 top = kScatterTop + static_cast<double>(k) * (kPanelHeight + kGap);
    const double least = scatter_.x.col(l).minCoeff(), range = scatter_.x.col(l).maxCoeff() - least;
    const double most =
        std::max(scatter_.y_first.col(k).cwiseAbs().maxCoeff(), scatter_.y_second.col(k).cwiseAbs().maxCoeff());
    cairo_set_source_rgb(cairo_, 0.80, 0.80, 0.82);
    cairo_set_line_width(cairo_, 1);
    cairo_rectangle(cairo_, left, top, kPanelWidth, kPanelHeight);
    cairo_move_to(cairo_, left, top + kPanelHeight / 2);
    cairo_line_to(cairo_, left + kPanelWidth, top + kPanelHeight / 2);
    cairo_stroke(cairo_);
    for (const bool second : {false, true}) {
      UseColor(second);
      const Eigen::MatrixXd& y = second ? scatter_.y_second : scatter_.y_first;
      const Eigen::Index dots = std::min(y.rows(), kMostDots);
      for (Eigen::Index d = 0; d < dots; ++d) {
        const Eigen::Index i = d * y.rows() / dots;
        Dot(left + kPanelWidth * (range > 0 ? (scatter_.x(i, l) - least) / range : 0.5),
            top + kPanelHeight / 2 * (1 - (most > 0 ? y(i, k) / most : 0)), 1.3);
      }
    }
    const auto name = [](const auto& names, Eigen::Index at) { return names[static_cast<std::size_t>(at)]; };
    if (l == 0) {
      Write(name(scatter_.y_names, k), kGap, top + 16, 13);
      Write(fmt::format("+-{:.3g}", most), kGap, top + 34, 11);
    }
    if (k + 1 == scatter_.y_first.cols())
      Write(fmt::format("{}  {:.3g} .. {:.3g}", name(scatter_.x_names, l), least, least + range), left,
            top + kPanelHeight + 18, 12);
  }

  cairo_t* cairo_;
  const Scatter& scatter_;
};

void Require(const Scatter& scatter) {
  const auto rows = scatter.x.rows();
  if (rows == 0 || scatter.y_first.rows() != rows || scatter.y_second.rows() != rows ||
      scatter.y_first.cols() != scatter.y_second.cols() || std::ssize(scatter.x_names) != scatter.x.cols() ||
      std::ssize(scatter.y_names) != scatter.y_first.cols())
    throw std::invalid_argument("scatter: sizes differ");
  if (!scatter.x.allFinite() || !scatter.y_first.allFinite() || !scatter.y_second.allFinite())
    throw std::invalid_argument("scatter: a number is not finite");
}

}  // namespace

void DrawScatter(const Scatter& scatter, const std::string& path) {
  Require(scatter);
  const double width = kScatterLeft + static_cast<double>(scatter.x.cols()) * (kPanelWidth + kGap),
               height =
                   kScatterTop + static_cast<double>(scatter.y_first.cols()) * (kPanelHeight + kGap) + kScatterBottom;
  DrawFile(path, static_cast<int>(width), static_cast<int>(height),
           [&](cairo_t* cairo) { ScatterPainter(cairo, scatter).Paint(); });
}

}  // namespace forereach
