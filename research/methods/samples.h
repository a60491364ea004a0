/** What the methods that calibrate have in common: the residuals as they were observed, and the coordinates of z that
matter. In plain arithmetic: these methods are not bounds to begin with. */
#pragma once

#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "forereach/numerics/interval.h"
#include "forereach/residual/observations.h"
#include "research/methods/method.h"

namespace forereach::research {

/** The middles of the enclosures of r~_i, N-by-n. */
[[nodiscard]] Eigen::MatrixXd ObservedResiduals(const Observations& observations);

/** Half the widest enclosure of r~_ik over i, for each k: what the last bit of a recorded number may hide. It is added
to every bound, so that no method fails by 1e-16. */
[[nodiscard]] Eigen::VectorXd RecordingError(const Observations& observations);

/** The coordinates l of z with L_kl > 0 for some k: those that the residual may depend on. Every method is told so
much, as ForeReach is; the rest would only blur it. */
[[nodiscard]] std::vector<int> ActiveCoordinates(const Declaration& declaration);

/** Coordinate l of Box(Z), rounded outward. */
[[nodiscard]] Interval HullOf(const QuerySet& query, int l) noexcept;

/** The center of Z, d_z entries. */
[[nodiscard]] Eigen::VectorXd CenterOf(const QuerySet& query);

/** center_k - radius_k <= r_k <= center_k + radius_k, wherever it is asked. */
struct ResidualBox {
  Eigen::VectorXd center, radius;  ///< n entries, a radius not negative, perhaps infinite
};

/** The same box for every query. */
class ConstantEnclosure final : public ResidualEnclosure {
 public:
  explicit ConstantEnclosure(ResidualBox box) : box_(std::move(box)) {}
  void Enclose(const QuerySet& query, ResidualBounds& bounds) const noexcept override;

 private:
  ResidualBox box_;
};

}  // namespace forereach::research
