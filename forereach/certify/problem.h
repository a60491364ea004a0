/** The inputs that stay fixed while a robot runs: nominal model, domain, declaration, observations and safety
projection. */
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "forereach/dynamics/expansion.h"
#include "forereach/dynamics/model.h"
#include "forereach/dynamics/step_rate.h"
#include "forereach/numerics/instruction_set.h"
#include "forereach/reach/domain.h"
#include "forereach/residual/declaration.h"
#include "forereach/residual/transitions.h"
#include "forereach/safety/body.h"
#include "forereach/safety/limit.h"
#include "forereach/safety/obstacle.h"
#include "forereach/sets/box.h"
#include "forereach/sets/eigen.h"

namespace forereach {

/** One condition of rest: |x_coordinate| <= tolerance, in the unit of that state. */
struct RestBound {
  int coordinate = 0;
  double tolerance = 0;  ///< Not negative.
};

struct Problem {
  std::shared_ptr<const NominalModel> model;  ///< f0
  Domain domain;                              ///< Z_cert
  Declaration declaration;                    ///< L, sigma, the disturbance and the errors of records
  Transitions transitions;                    ///< D_N; the box around each (Declaration::BoxAround) is in the domain
  Eigen::MatrixXd projection;                 ///< P, p-by-n: the position of the robot's frame
  Body body;                                  ///< By default the point P x
  StepTiming timing;                          ///< By how much the boundaries of steps may be off their times
  /** The bounds with which a certificate holds at all times; without them it holds at the samples only. */
  std::optional<Between> between;
  std::vector<Limit> limits;          ///< At most kMaxLimits, which hold at the samples
  Method method = Method::kCentred;   ///< How the nominal remainder is bounded
  int max_leaf_visits = 512;          ///< EnvelopeOptions: bounds the work of one search
  int max_observations = 10'000'000;  ///< Above this number, observations that never attain the envelope are removed
  int zonotope_order = 5;             ///< rho: at most rho * n generators after reduction
  InstructionSet instructions = BestInstructionSet();  ///< Changes the computing time only, not a bit of the result
  std::vector<RestBound> rest;  ///< X_T of a certified plan satisfies all of these; empty: no condition
};

/** The first inequality or ball of the domain that names a variable by which a region is bounded, as
"domain.balls[0] names v"; empty if none does. Without one, paths along the axes stay in the domain (region_grid.h). */
[[nodiscard]] std::string FindCoupledRegion(const Problem& problem);

/** The first region that bounds more than slopes in a range of an angle, of which the domain has one turn or more, as
"regions[0].disturbance is bounded by theta, ..."; empty if none does. There another number may be the same
configuration, of which the region says nothing. */
[[nodiscard]] std::string FindTurningRegion(const Problem& problem);

}  // namespace forereach
