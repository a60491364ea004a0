/** A chart of percentages over a positive quantity: lines with marks. */
#pragma once

#include <string>
#include <vector>

#include "records/picture.h"

namespace forereach {

struct Chart {
  struct Series {
    std::string name;
    std::vector<double> y;  ///< 0 to 100, one for each x; NaN leaves a gap.
  };
  std::string title, x_name, y_name;
  std::vector<double> x;       ///< Positive, rising; the axis is logarithmic.
  std::vector<Series> series;  ///< At most six.
};

/** Writes the chart to a .svg, .png or .pdf file. @throws PictureError if it cannot be written.
@throws std::invalid_argument if sizes differ, x does not rise or is not positive, or there are too many series. */
void DrawChart(const Chart& chart, const std::string& path, int width = 900, int height = 560);

}  // namespace forereach
