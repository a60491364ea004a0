#include "records/chart.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

namespace forereach {
namespace {

// Told apart with every common colour blindness (the set of Okabe and Ito).
constexpr const char* kColors[] = {"#d55e00", "#e69f00", "#0072b2", "#009e73", "#cc79a7", "#212126"};
constexpr double kWidth = 900, kHeight = 560, kLeft = 70, kRight = 30, kTop = 60, kBottom = 105;  // pixels of a chart
constexpr double kPanelWidth = 210, kPanelHeight = 130, kGap = 16, kScatterLeft = 100, kScatterTop = 70,
                 kScatterBottom = 40;  // pixels of a scatter
constexpr Eigen::Index kMostDots = 2000;

/** Places are pixels from the upper left. */
class Paper final {
 public:
  void Write(const std::string& text, double x, double y, double size) {
    svg_.Text({x, -y}, text, fmt::format("font-size=\"{}\" fill=\"#212126\"", size));
  }
  void Line(double x0, double y0, double x1, double y1, const char* color = "#ccccd1", double width = 1) {
    svg_.Line({{x0, -y0}, {x1, -y1}}, fmt::format("stroke=\"{}\" stroke-width=\"{}\"", color, width));
  }
  void Dot(double x, double y, double radius, const char* color, double alpha = 1) {
    svg_.Dot({x, -y}, fmt::format("stroke=\"{}\" stroke-width=\"{}\" stroke-opacity=\"{}\" stroke-linecap=\"round\"",
                                  color, 2 * radius, alpha));
  }
  std::string Done() { return svg_.Done(); }

 private:
  Svg svg_{Eigen::Vector2d::Zero(), 1, 0.1};
};

void Require(bool is_right, const std::string& what) {
  if (!is_right) throw std::invalid_argument(what);
}

}  // namespace

void DrawChart(const Chart& chart, const std::string& path) {
  Require(!chart.x.empty() && chart.x.front() > 0, "chart: x is positive");
  Require(std::ranges::adjacent_find(chart.x, [](double a, double b) { return !(a < b); }) == chart.x.end(),
          "chart: x has to rise");
  Require(chart.series.size() <= std::size(kColors), fmt::format("chart: {} series", chart.series.size()));
  const double least = std::log(chart.x.front()), range = std::log(chart.x.back()) - least;
  const auto x_of = [&](double x) {
    return kLeft + (kWidth - kLeft - kRight) * (range > 0 ? (std::log(x) - least) / range : 0.5);
  };
  const auto y_of = [](double percent) { return kHeight - kBottom - (kHeight - kTop - kBottom) * percent / 100; };
  Paper paper;
  paper.Write(chart.title, kLeft, 34, 18);
  for (int percent = 0; percent <= 100; percent += 20) {
    paper.Line(kLeft, y_of(percent), kWidth - kRight, y_of(percent));
    paper.Write(std::to_string(percent), kLeft - 36, y_of(percent) + 5, 13);
  }
  for (const double x : chart.x) {
    paper.Line(x_of(x), y_of(0), x_of(x), y_of(100));
    paper.Write(fmt::format("{:g}", x), x_of(x) - 8, y_of(0) + 20, 13);
  }
  paper.Write(chart.x_name, kLeft, y_of(0) + 42, 13);
  paper.Write(chart.y_name, kLeft, y_of(100) - 8, 13);
  for (std::size_t s = 0; s < chart.series.size(); ++s) {
    const auto& [name, y] = chart.series[s];
    Require(y.size() == chart.x.size(),
            fmt::format("chart: {} has {} values for {} x", name, y.size(), chart.x.size()));
    for (std::size_t i = 0; i < y.size(); ++i) {
      if (!std::isfinite(y[i])) continue;
      if (i > 0 && std::isfinite(y[i - 1]))
        paper.Line(x_of(chart.x[i - 1]), y_of(y[i - 1]), x_of(chart.x[i]), y_of(y[i]), kColors[s], 2);
      paper.Dot(x_of(chart.x[i]), y_of(y[i]), 4, kColors[s]);
    }
    const double x = kLeft + (s % 2 == 0 ? 0 : kWidth / 2), height = kHeight - 40 + 18 * static_cast<double>(s / 2);
    paper.Dot(x, height, 4, kColors[s]);
    paper.Write(name, x + 10, height + 5, 13);
  }
  WriteSvg(path, static_cast<int>(kWidth), static_cast<int>(kHeight), paper.Done());
}

void DrawScatter(const Scatter& scatter, const std::string& path) {
  const auto& [title, first, second, x_names, y_names, x, y_first, y_second] = scatter;
  Require(x.rows() > 0 && y_first.rows() == x.rows() && y_second.rows() == x.rows() &&
              y_first.cols() == y_second.cols() && std::ssize(x_names) == x.cols() &&
              std::ssize(y_names) == y_first.cols(),
          "scatter: sizes differ");
  Require(x.allFinite() && y_first.allFinite() && y_second.allFinite(), "scatter: a number is not finite");
  struct Set {
    const std::string& name;
    const Eigen::MatrixXd& y;
    const char* color;
    double alpha, key;
  };
  const Set sets[] = {{first, y_first, kColors[0], 0.35, kGap}, {second, y_second, kColors[2], 0.6, kGap + 160}};
  Paper paper;
  paper.Write(title, kGap, 28, 17);
  for (const Set& set : sets) {
    paper.Dot(set.key + 5, 50, 4, set.color, set.alpha);
    paper.Write(set.name, set.key + 16, 55, 13);
  }
  for (Eigen::Index k = 0; k < y_first.cols(); ++k) {
    const double top = kScatterTop + static_cast<double>(k) * (kPanelHeight + kGap), bottom = top + kPanelHeight;
    const double most = std::max(y_first.col(k).cwiseAbs().maxCoeff(), y_second.col(k).cwiseAbs().maxCoeff());
    paper.Write(y_names[static_cast<std::size_t>(k)], kGap, top + 16, 13);
    paper.Write(fmt::format("+-{:.3g}", most), kGap, top + 34, 11);
    for (Eigen::Index l = 0; l < x.cols(); ++l) {
      const double left = kScatterLeft + static_cast<double>(l) * (kPanelWidth + kGap), right = left + kPanelWidth;
      const double least = x.col(l).minCoeff(), range = x.col(l).maxCoeff() - least;
      for (const double y : {top, (top + bottom) / 2, bottom}) paper.Line(left, y, right, y);
      for (const double side : {left, right}) paper.Line(side, top, side, bottom);
      for (const Set& set : sets)
        for (Eigen::Index d = 0, dots = std::min(x.rows(), kMostDots); d < dots; ++d) {
          const Eigen::Index i = d * x.rows() / dots;
          paper.Dot(left + kPanelWidth * (range > 0 ? (x(i, l) - least) / range : 0.5),
                    top + kPanelHeight / 2 * (1 - (most > 0 ? set.y(i, k) / most : 0)), 1.3, set.color, set.alpha);
        }
      if (k + 1 == y_first.cols())
        paper.Write(fmt::format("{}  {:.3g} .. {:.3g}", x_names[static_cast<std::size_t>(l)], least, least + range),
                    left, bottom + 18, 12);
    }
  }
  WriteSvg(path, static_cast<int>(kScatterLeft + static_cast<double>(x.cols()) * (kPanelWidth + kGap)),
           static_cast<int>(kScatterTop + static_cast<double>(y_first.cols()) * (kPanelHeight + kGap) + kScatterBottom),
           paper.Done());
}

}  // namespace forereach
