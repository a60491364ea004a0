/** Charts: lines over a positive quantity, and a table of small pictures of dots. */
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "records/picture.h"

namespace forereach {

/** Percentages over a positive quantity: lines with marks. */
struct Chart {
  struct Series {
    std::string name;
    std::vector<double> y;  ///< 0 to 100, one for each x; NaN leaves a gap.
  };
  std::string title, x_name, y_name;
  std::vector<double> x;       ///< Positive, rising; the axis is logarithmic.
  std::vector<Series> series;  ///< At most six.
};

/** Writes the chart to a .svg or .png file. @throws PictureError if it cannot be written.
@throws std::invalid_argument if sizes differ, x does not rise or is not positive, or there are too many series. */
void DrawChart(const Chart& chart, const std::string& path);

/** Each row's values against each column's, as dots, for two sets of them. */
struct Scatter {
  std::string title, first, second;  ///< Above the table; the names of the two sets.
  std::vector<std::string> x_names, y_names;
  Eigen::MatrixXd x;        ///< N-by-columns
  Eigen::MatrixXd y_first;  ///< N-by-rows, drawn below y_second.
  Eigen::MatrixXd y_second;
};

/** Writes the table to a .svg or .png file; at most 2000 dots of each set in a panel, evenly chosen. Each row has one
scale, that of its largest value. @throws PictureError if it cannot be written. @throws std::invalid_argument if sizes
differ or a number is not finite. */
void DrawScatter(const Scatter& scatter, const std::string& path);

}  // namespace forereach
