#include "research/methods_plot.h"

#include <cmath>
#include <cstddef>
#include <iterator>

#include <fmt/format.h>

#include "research/labels.h"

namespace forereach::research {
namespace {

constexpr int kWidth = 1240, kHeight = 620;
constexpr const char* kColors[] = {"green",  "blue",      "sky",       "orange",   "red",
                                   "purple", "'#222222'", "'#8b5a2b'", "'#a0a000'"};

// What completes no tube has a place of its own beyond a coverage of 1, each method beside the others.
constexpr double kEndOfCoverage = 1.05, kFirstPlaceOfNone = 1.09, kPlaceOfNone = 0.035;
// Ends of both axes.
constexpr double kLeft = -0.04, kRight = 1.24, kBottom = -0.06, kTop = 1.12;

std::string Screen(double part) { return fmt::format("screen {:.4f}", part); }

// One of the three frames side by side.
class Panel final {
 public:
  Panel(std::size_t index, const char* title) : index_(index), title_(title) {}

  // The marks of a method that is drawn as the `method`th. Hollow: the paper's.
  void Add(std::size_t method, const std::vector<MethodMark>& marks, bool is_hollow, const std::string& key) {
    if (marks.empty()) return;
    const std::string block = fmt::format("p{}s{}", index_, series_++), color = kColors[method % std::size(kColors)];
    std::string lines;
    bool completes = true;
    for (const MethodMark& mark : marks) {
      const double x = mark.coverage.mean.value_or(kFirstPlaceOfNone + kPlaceOfNone * static_cast<double>(none_));
      lines += DataLine({x, mark.coverage.deviation, mark.recall.mean.value_or(NAN), mark.recall.deviation});
      completes = completes && mark.coverage.mean;
      if (mark.recall.mean) marks_.push_back(Around(x, *mark.recall.mean));
    }
    none_ += !completes;
    AddLines(marks);
    AddLabels(marks, color);
    data_ += DataBlock(block, lines);
    const bool is_star = method == 0 && !is_hollow;
    series_text_ += "$" + block + " using 1:3:2:4 with xyerrorbars " +
                    (is_star     ? "pt 3 ps 1.4"
                     : is_hollow ? "pt 6 ps 0.9"
                                 : "pt 7 ps 0.8") +
                    " lw 1 lc rgb " + color + (key.empty() ? " notitle" : " title \"" + key + "\"") +
                    ", '' using ($1 <= 1 ? $1 : 1/0):3 with " + "lines lw 0.6 lc rgb " + color + " notitle, ";
  }

  [[nodiscard]] std::string Script() const {
    std::string data = data_, text = series_text_;
    std::vector<PixelBox> lines = lines_;
    lines.push_back({PixelX(kEndOfCoverage) - kHalfLine, kFloor, PixelX(kEndOfCoverage) + kHalfLine, kCeiling});
    const std::vector<PixelBox> boxes = PlaceLabels(Frame(), marks_, lines, labels_, kClearance);
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      const PixelBox& box = boxes[i];
      const std::string block = fmt::format("p{}l{}", index_, i);
      std::string line = DataLine({XOf((box.left + box.right) / 2), YOf((box.bottom + box.top) / 2)});
      line.back() = ' ';
      data += DataBlock(block, line + "\"" + labels_[i].text + "\"\n");
      text += "$" + block + " using 1:2:3 with labels center font '," + std::to_string(static_cast<int>(kLabelSize)) +
              "' textcolor rgb " + colors_[i] + " notitle, ";
    }
    return data + "set lmargin at " + Screen(Left() / kWidth) + "; set rmargin at " + Screen(Right() / kWidth) +
           "\nset title '" + title_ + "'\nplot " + text + "1/0 notitle\n";
  }

  static std::string Margins() {
    return "set bmargin at " + Screen(kFloor / kHeight) + "; set tmargin at " + Screen(kCeiling / kHeight) + "\n";
  }

 private:
  static constexpr double kFirst = 72, kPanelWidth = 340, kGap = 62, kFloor = 150, kCeiling = 580;
  static constexpr double kRadius = 5, kClearance = 9, kTogether = 8, kHalfLine = 0.5;

  // Pixels and figures.
  [[nodiscard]] double Left() const { return kFirst + static_cast<double>(index_) * (kPanelWidth + kGap); }
  [[nodiscard]] double Right() const { return Left() + kPanelWidth; }
  [[nodiscard]] PixelBox Frame() const { return {Left() + 1, kFloor + 1, Right() - 1, kCeiling - 1}; }
  [[nodiscard]] double PixelX(double x) const { return Left() + (x - kLeft) / (kRight - kLeft) * kPanelWidth; }
  [[nodiscard]] double PixelY(double y) const {
    return kFloor + (y - kBottom) / (kTop - kBottom) * (kCeiling - kFloor);
  }
  [[nodiscard]] double XOf(double pixel) const { return kLeft + (pixel - Left()) / kPanelWidth * (kRight - kLeft); }
  [[nodiscard]] double YOf(double pixel) const {
    return kBottom + (pixel - kFloor) / (kCeiling - kFloor) * (kTop - kBottom);
  }
  [[nodiscard]] PixelBox Around(double x, double y) const {
    return {PixelX(x) - kRadius, PixelY(y) - kRadius, PixelX(x) + kRadius, PixelY(y) + kRadius};
  }

  // Error bars, and the lines from mark to mark in short pieces.
  void AddLines(const std::vector<MethodMark>& marks) {
    const MethodMark* last = nullptr;
    for (const MethodMark& mark : marks) {
      if (!mark.coverage.mean || !mark.recall.mean) continue;
      const double x = PixelX(*mark.coverage.mean), y = PixelY(*mark.recall.mean);
      const double dx = PixelX(mark.coverage.deviation) - PixelX(0), dy = PixelY(mark.recall.deviation) - PixelY(0);
      lines_.push_back({x - dx, y - kHalfLine, x + dx, y + kHalfLine});
      lines_.push_back({x - kHalfLine, y - dy, x + kHalfLine, y + dy});
      constexpr int kPieces = 100;
      for (int i = 0; last != nullptr && i < kPieces; ++i) {
        const double part = static_cast<double>(i) / kPieces;
        const double px = x + part * (PixelX(*last->coverage.mean) - x),
                     py = y + part * (PixelY(*last->recall.mean) - y);
        lines_.push_back({px - kHalfLine, py - kHalfLine, px + kHalfLine, py + kHalfLine});
      }
      last = &mark;
    }
  }

  // N beside each mark that has a coverage; one label for successive marks that cover each other.
  void AddLabels(const std::vector<MethodMark>& marks, const std::string& color) {
    if (marks.size() < 2) return;
    bool continues = false;
    for (const MethodMark& mark : marks) {
      if (!mark.coverage.mean || !mark.recall.mean) continue;
      const double x = PixelX(*mark.coverage.mean), y = PixelY(*mark.recall.mean);
      const std::string n = std::to_string(mark.observations);
      if (continues && std::abs(x - labels_.back().x) < kTogether && std::abs(y - labels_.back().y) < kTogether) {
        labels_.back().text += ", " + n;
      } else {
        labels_.push_back({x, y, n});
        colors_.push_back(color);
        continues = true;
      }
    }
  }

  std::size_t index_, series_ = 0, none_ = 0;
  std::string title_, data_, series_text_;
  std::vector<PixelBox> marks_, lines_;
  std::vector<Label> labels_;
  std::vector<std::string> colors_;
};

}  // namespace

Plot MethodsPlot(const std::vector<MethodMarks>& methods) {
  Panel bicycle(0, "Bicycle"), papers(1, "Bicycle, the paper"), point_mass(2, "Point mass, N = 100");
  for (std::size_t m = 0; m < methods.size(); ++m) {
    bicycle.Add(m, methods[m].bicycle, false, "");
    papers.Add(m, methods[m].papers_bicycle, true, "");
    point_mass.Add(m, methods[m].point_mass, false, methods[m].name);
    point_mass.Add(m, methods[m].papers_point_mass, true, "the paper");
  }
  return {"methods",
          "Coverage of complete tubes in group B, which has no data, against recall in group C, which has; mean and "
          "one standard deviation over the seeds. Filled: ours. Hollow: the paper's; of the point mass it prints both "
          "figures for ForeReach only. Beside the marks of the bicycle: N. A method that completes no tube in B has no "
          "coverage and stands in the strip on the right, side by side with the others. At N = 25 regional calibration "
          "is the global one.",
          kWidth, kHeight,
          "set multiplot\n" + Panel::Margins() + "set xrange [" + std::to_string(kLeft) + ":" + std::to_string(kRight) +
              "]; set yrange [" + std::to_string(kBottom) + ":" + std::to_string(kTop) +
              "]\nset xtics ('0' 0, '0.2' 0.2, '0.4' 0.4, '0.6' 0.6, '0.8' 0.8, '1' 1, 'none' 1.14); set ytics 0.2\n"
              "set arrow from 1.05, graph 0 to 1.05, graph 1 nohead dt 2 lc rgb grey\n"
              "set xlabel 'coverage, group B'; set ylabel 'certified recall, group C'\nunset key\n" +
              bicycle.Script() + "unset ylabel\n" + papers.Script() +
              "set key at screen 0.5, 0.12 center top vertical maxrows 2 width 2\n" + point_mass.Script() +
              "unset multiplot\n"};
}

}  // namespace forereach::research
