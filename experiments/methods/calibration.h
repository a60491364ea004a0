/** Calibration: bounds fitted to the observed residuals by conformal quantiles.

The paper says: "Global calibration fits one residual bound to all observations and applies it uniformly, regional
calibration fits one bound per region", and nothing of level, center or regions. Ours:
- the level is the paper's only miscoverage, 0.10, for each step; no union over steps;
- the center is the mean: a box around zero would contain the mirrored plans of the point mass, and the paper says that
  global calibration contains none of them;
- the radius is the split-conformal quantile of |r~_ik - mean_k| (Lei et al. 2018, Algorithm 2), over all observations
  as the paper has it, without the split;
- a region is a cell of the domain, cut in four along each coordinate that L names (Mondrian conformal prediction, Vovk
  et al. 2005, 4.5). A cell with too few observations for a finite quantile has the global box. */
#pragma once

#include <map>
#include <memory>
#include <vector>

#include "experiments/methods/method.h"
#include "experiments/methods/samples.h"

namespace forereach::experiments {

inline constexpr double kMiscoverage = 0.10;

/** The ceil((N + 1)(1 - alpha))-th smallest of N scores, infinite where that exceeds N.
@throws std::invalid_argument unless 0 < alpha < 1. */
[[nodiscard]] double ConformalQuantile(std::vector<double> scores, double alpha);

/** Mean and conformal radius of each column of residuals, N-by-n, N >= 1. */
[[nodiscard]] ResidualBox Calibrate(const Eigen::MatrixXd& residuals, double alpha = kMiscoverage);

/** Claims: at a location drawn like the observations, each coordinate lies in its bound with a probability of about
1 - alpha. Nothing of a plan's locations, nor of all of a query. Not sound. */
[[nodiscard]] std::unique_ptr<ResidualEnclosure> MakeGlobalCalibration(const Setting& setting);

/** One ResidualBox a cell. A query gets the hull of the boxes of all cells that Box(Z) meets, so a larger query never
has a narrower bound. Claims: the same as global calibration, of locations drawn like the observations of their cell.
Not sound. */
class RegionalCalibration final : public ResidualEnclosure {
 public:
  static constexpr int kCells = 4;  ///< along a coordinate

  /** @throws std::invalid_argument if L names more than 12 coordinates. */
  explicit RegionalCalibration(const Setting& setting);

  void Enclose(const QuerySet& query, ResidualBounds& bounds) const noexcept override;

  /** Cells with a box of their own. */
  [[nodiscard]] int num_calibrated() const { return static_cast<int>(boxes_.size()); }

 private:
  struct Axis {
    int coordinate;
    Interval range;
    // The cell of a number, those outside counted to the last.
    [[nodiscard]] int CellOf(double z) const noexcept;
  };
  [[nodiscard]] const ResidualBox& BoxOf(int cell) const noexcept;

  std::vector<Axis> axes_;
  ResidualBox global_;
  std::map<int, ResidualBox> boxes_;  // by the cell's digits to the base kCells
};

[[nodiscard]] std::unique_ptr<ResidualEnclosure> MakeRegionalCalibration(const Setting& setting);

}  // namespace forereach::experiments
