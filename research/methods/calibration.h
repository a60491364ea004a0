/** Calibration: bounds fitted to the observed residuals by conformal quantiles.

The paper says: "Global calibration fits one residual bound to all observations and applies it uniformly, regional
calibration fits one bound per region", and nothing of level, center, regions, or of a query outside all regions.
research/readings.cpp has the readings that were tried. Those among Methods():
- **Global.** Level 0.10, the paper's only miscoverage, for each step; around the mean, as a box around zero would
  contain the mirrored plans of the point mass, and the paper says that global calibration contains none of them. The
  radius is the split-conformal quantile of |r~_ik - center_k| (Lei et al. 2018, Algorithm 2), over all observations as
  the paper has it, without the split.
- **Regional.** A region is a cell of the domain (Mondrian conformal prediction, Vovk et al. 2005, 4.5), cut in four
  along the coordinate over whose range L lets the residual vary most. Around zero, and all regions at once: each at
  level 0.10 over their number. A query outside all regions has the widest bound of any. While no region has enough
  observations, the global box stands in. **Chosen by its result**: the paper's regional coverage lies above its global
  one and its recall below, and this reading has that. */
#pragma once

#include <map>
#include <memory>
#include <vector>

#include "research/methods/method.h"
#include "research/methods/samples.h"

namespace forereach::research {

/** The ceil((N + 1)(1 - alpha))-th smallest of N scores, infinite where that exceeds N.
@throws std::invalid_argument unless 0 < alpha < 1. */
[[nodiscard]] double ConformalQuantile(std::vector<double> scores, double alpha);

enum class Center { kMean, kZero };

struct CalibrationOptions {
  double miscoverage = 0.10;
  Center center = Center::kMean;
};

/** Center and conformal radius of each column of residuals, N-by-n, N >= 1. */
[[nodiscard]] ResidualBox Calibrate(const Eigen::MatrixXd& residuals, const CalibrationOptions& options);

/** Claims: at a location drawn like the observations, each coordinate lies in its bound with a probability of about
1 - alpha. Nothing of a plan's locations, nor of all of a query. Not sound. */
[[nodiscard]] std::unique_ptr<ResidualEnclosure> MakeGlobalCalibration(const Setting& setting,
                                                                       const CalibrationOptions& options);

/** What is cut into regions. */
enum class Cut {
  kSteepest,  ///< The coordinate l of largest max_k L_kl (upper_l - lower_l)
  kActive,    ///< Every coordinate that L names
  kAll        ///< Every coordinate of z, inputs included
};

/** The bound in a cell that has none of its own. */
enum class Elsewhere {
  kGlobal,    ///< The global box
  kNearest,   ///< The hull of the boxes of the nearest cells, by steps from cell to cell
  kWidest,    ///< The hull of all cells' boxes
  kDeclared,  ///< ForeReach's envelope over the query
  kUnbounded  ///< None for a coordinate that L lets vary
};

struct RegionalOptions {
  CalibrationOptions global = {}, regional = {};
  bool jointly = false;  ///< regional.miscoverage is shared out among the cells that have observations.
  Cut cut = Cut::kActive;
  int cells = 4;  ///< Along a coordinate
  Elsewhere elsewhere = Elsewhere::kGlobal;
};

/** One ResidualBox a cell. A query gets the hull of the bounds of all cells that Box(Z) meets, so a larger query never
has a narrower bound. Claims: the same as global calibration, of locations drawn like the observations of their cell.
Not sound. */
class RegionalCalibration final : public ResidualEnclosure {
 public:
  /** @throws std::invalid_argument if more than 12 coordinates are to be cut. */
  RegionalCalibration(const Setting& setting, const RegionalOptions& options);

  void Enclose(const QuerySet& query, ResidualBounds& bounds) const noexcept override;

  /** Cells with a box of their own. */
  [[nodiscard]] int num_calibrated() const { return static_cast<int>(boxes_.size()); }

 private:
  static constexpr std::size_t kMostAxes = 12;

  struct Axis {
    int coordinate;
    Interval range;
  };
  // The cell of a number, those outside counted to the last.
  [[nodiscard]] int CellOf(const Axis& axis, double z) const noexcept;
  // Widens the bounds by those of a cell.
  void Join(int cell, const QuerySet& query, ResidualBounds& bounds) const noexcept;
  [[nodiscard]] int Steps(int cell, int other) const noexcept;

  RegionalOptions options_;
  std::vector<Axis> axes_;
  ResidualBox global_;
  std::map<int, ResidualBox> boxes_;  // by the cell's digits to the base cells
  Eigen::VectorXd largest_slopes_;    // max_l L_kl
  std::unique_ptr<ResidualEnclosure> declared_;
};

/** @name As among Methods(). */
///@{
[[nodiscard]] std::unique_ptr<ResidualEnclosure> MakeGlobalCalibration(const Setting& setting);
[[nodiscard]] std::unique_ptr<ResidualEnclosure> MakeRegionalCalibration(const Setting& setting);
///@}

}  // namespace forereach::research
