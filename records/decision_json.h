/** A decision as the JSON document of `forereach certify --json`. */
#pragma once

#include <span>

#include <nlohmann/json_fwd.hpp>

#include "forereach/certify/certifier.h"
#include "task/config.h"

namespace forereach {

/** A certified or refused plan and its decision. */
struct CertifyResult {
  Decision decision;
  Schedule schedule;
  Eigen::MatrixXd controls;  ///< A column a step.
  double elapsed_us = 0;
};

/** The schedule of a plan of `steps` steps that begins at time 0, with steps of model.dt and the declared clock error.
If model.dt is no whole number of microseconds, its rounding counts as clock error. */
[[nodiscard]] Schedule ScheduleFromZero(const Config& config, int steps);

/** The digest of the controls and X0. */
[[nodiscard]] Digest PlanDigest(const Eigen::MatrixXd& controls, const Box& initial_set);

/** The digest of every number in the document's `tube`. An infinite number counts as null. */
[[nodiscard]] Digest TubeDigest(const nlohmann::json& tube);

/** The bound of each state, a number or an expression. @pre some bound is not zero. */
[[nodiscard]] nlohmann::json DisturbanceJson(const Declaration& declaration);

/** The document; docs/decision.md lists its keys. It includes all inputs, so it can be verified by itself. Infinite
numbers, and keys that do not apply to the outcome, are null. */
[[nodiscard]] nlohmann::json ToJson(const CertifyResult& result, const Tube& tube, const Certifier& certifier,
                                    const Config& config);

}  // namespace forereach
