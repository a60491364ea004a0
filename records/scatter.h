/** A table of small pictures: each row's values against each column's, as dots, for two sets of them. */
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "records/picture.h"

namespace forereach {

struct Scatter {
  std::string title, first, second;  ///< Above the table; the names of the two sets.
  std::vector<std::string> x_names, y_names;
  Eigen::MatrixXd x;        ///< N-by-columns
  Eigen::MatrixXd y_first;  ///< N-by-rows, drawn below y_second.
  Eigen::MatrixXd y_second;
};

/** Writes the table to a .svg, .png or .pdf file; at most 2000 dots of each set in a panel, evenly chosen. Each row has
one scale, that of its largest value. @throws PictureError if it cannot be written. @throws std::invalid_argument if
sizes differ or a number is not finite. */
void DrawScatter(const Scatter& scatter, const std::string& path);

}  // namespace forereach
