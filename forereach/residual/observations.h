/** Enclosures of the observed residuals r~_i = x_i+ - f0(z_i), Eq. (data).

A recorded successor is a rounded number. One unit in its last place counts as observation error in addition to sigma.
So [lower, upper] contains x_i+ - f0(z_i) +- ulp(x_i+), and with eps_k = Declaration::ObservationError every admissible
residual satisfies
    lower_ik - eps_k <= r_k(z_i) <= upper_ik + eps_k.

Where the declaration bounds the error e of what is recorded, z_i and x_i+ are near the true ones, which the step
belongs to. By the mean value theorem and by L, [lower, upper] then contains in addition
    e_k + sum_l (sup |D_l f0_k| + L_kl) e_l,    the sup over the box z_i +- e,
and the inequality above holds at the recorded z_i. That box has to lie in the domain (docs/soundness.md, 3.16).

Where the bound on the disturbance grows (Declaration::growing), [lower, upper] contains sup |d_k| over that box, too,
and what the regions that the box meets say of w^_k and sigma_k beyond the least of all regions; the inequality holds
with what is left in eps_k.

A step that lasted by up to delta longer or shorter than dt (Transitions::longer) may have moved the state by delta |d
f0 / d dt| more or less, and the residual may have done delta / dt of itself more: [lower, upper] contains that, too
(docs/ soundness.md, 3.15).

A recorded angle is known up to whole turns. Its residual is x_i+ + 2 pi j - f0(z_i) with the j that makes it least in
size, which has to be at most a quarter of a turn: then every other j gives three quarters or more, which the task
declares not to happen (docs/soundness.md, 3.14). Instead of the unit of x_i+ it counts the larger one of that and
kAngleUnit, which covers a successor that was computed in doubles and then turned back. */
#pragma once

#include <stdexcept>
#include <string>

#include "forereach/dynamics/model.h"
#include "forereach/dynamics/step_rate.h"
#include "forereach/residual/declaration.h"
#include "forereach/residual/transitions.h"
#include "forereach/sets/eigen.h"

namespace forereach {

struct Observations {
  Eigen::MatrixXd z;             ///< N-by-d_z: the locations z_i, one row each
  Eigen::MatrixXd lower, upper;  ///< N-by-n: enclosures of the observed residuals, in the units of the states

  [[nodiscard]] int size() const { return static_cast<int>(z.rows()); }
  [[nodiscard]] int num_states() const { return static_cast<int>(lower.cols()); }
};

/** Two units in the last place of 2 pi: the rounding of a sum below 16, that of one turn taken off it in doubles, and
that of the double next to 2 pi. */
inline constexpr double kAngleUnit = 0x1p-49;

/** A transition whose angle is more than a quarter of a turn away from the nominal model's, whatever turns are added.
 */
class AmbiguousAngle final : public std::invalid_argument {
 public:
  AmbiguousAngle(int row, const std::string& what) : std::invalid_argument(what), row_(row) {}
  [[nodiscard]] int row() const { return row_; }

 private:
  int row_;
};

/** Computes the observations from transitions. @param declaration its L, its e, w^ and d. @param timing what is
declared of rates, where steps did not last dt. @throws AmbiguousAngle; NoNominalValue; std::invalid_argument if there
are none, a size does not match the model or a number is not finite; the message names the row. Cost O(N). */
[[nodiscard]] Observations Observe(const NominalModel& model, const Declaration& declaration,
                                   const Transitions& transitions, const StepTiming& timing = {});
/** The same of exact records: e = 0. */
[[nodiscard]] Observations Observe(const NominalModel& model, const Transitions& transitions);

}  // namespace forereach
