/** The parameters of a nominal model from transitions, by nonlinear least squares.

For parameters p, the one-step error of transition i in coordinate k is e_ik(p) = x_ik+ - f0_k(z_i; p). The fit
minimises sum over i and k of (e_ik(p) / c_k)^2, where c_k is the root mean square of e_ik at the start, so that states
of different units count alike, and at least 16 units in the last place of the largest x_ik+, so that the rounding of a
state that the model has exactly does not. The solver is Levenberg & Marquardt's, MINPACK's in Eigen, with differences
for derivatives.

The variance of parameter c is the sum over the states k of s_k^2 |G_kc|^2. With J the derivatives of e_ik / c_k by the
parameters at the solution, G = J (J^T J)^-1 and H = G J^T; G_kc is the part of column c in the rows of state k. The
variance s_k^2 = (sum over i of (e_ik / c_k)^2) / (N - h_k) is of state k alone; h_k is the trace of H over its rows,
what they lose to the parameters. The h_k add up to the rank of J. With one state or s_k alike this is s^2 (J^T J)^-1;
otherwise it also holds, because c_k need not be the state's noise. Where a parameter is of a quiet and of a noisy
state, the noise of the one shows in the errors of the other: the standard errors of the quiet state's parameters are
then too large.

A better nominal model leaves a smaller residual; nothing about the residual is proven by it. */
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "forereach/dynamics/model_text.h"
#include "forereach/residual/transitions.h"

namespace forereach {

struct FittedParameter {
  std::string name;
  double before = 0, after = 0;
  /** The standard error, if the errors are independent and those of one state alike. Infinite if the transitions do not
  determine the parameter: at the solution, it can change without a change of the errors beyond their rounding, alone
  or together with others. NaN if nothing shows the noise: the parameters leave less than one number over of a state
  that the parameter is found from. */
  double deviation = 0;
  /** The fitted parameters of which the transitions only determine combinations with this one. Empty if it is
  determined, or has no effect at all. */
  std::vector<std::string> together;
  bool elsewhere = false;  ///< Larger changes of it alone change the errors.
};

struct Fit {
  std::vector<FittedParameter> parameters;
  Eigen::MatrixXd before, after;  ///< e_ik, N-by-n, at the start and at the end.
  bool converged = false;         ///< Otherwise the limit on evaluations was reached.
  int evaluations = 0;            ///< Of the model at all transitions.
};

/** Fits the named parameters from the middles of their ranges; the others stay.
@throws std::invalid_argument if the text has no such parameter, dt is named, a name is given twice, there are fewer
numbers than parameters, the model has no finite value at some transition at the start, the derivative by a parameter
is infinite at the start or at the solution, or zero at the start although the parameter has an effect farther away, or
a parameter runs away: it moved by more than its size, and a thousand times as far is no worse. Cost: some tens of times
(1 + parameters) evaluations of the model at all transitions. */
[[nodiscard]] Fit FitParameters(const ModelText& text, const Transitions& transitions,
                                const std::vector<std::string>& names);

}  // namespace forereach
