/** A decision as the JSON document of `forereach certify --json`. */
#pragma once

#include <span>

#include <nlohmann/json.hpp>

#include "certifier/certify/certifier.h"
#include "certifier/task/config.h"

namespace forereach {

/** What was asked and answered. */
struct CertifyResult {
  Decision decision;
  Eigen::MatrixXd controls;  ///< A column a step.
  double elapsed_us = 0;
};

/** Of the controls and X0. */
[[nodiscard]] Digest PlanDigest(const Eigen::MatrixXd& controls, const Box& initial_set);

/** Of every number in the document's `tube`, so that none can be altered unnoticed. What is infinite counts as null. */
[[nodiscard]] Digest TubeDigest(const nlohmann::json& tube);

/** Keys: outcome, step, cause, message, inputs, tube, digests, elapsed_us. With `inputs` (config {given, absolute},
controls {a list a step}, initial_set {lower, upper}) the document can be verified by itself. `tube` has an object for each X_t that was computed:
center, half_width (of the interval hull), generators (list of columns), clearance (per obstacle, a lower bound on the
distance to it in metres, negative where none was proven), radius (of the projected slice, metres), and for each
completed step also envelope {lower, upper} and remainder. Numbers that are infinite are null. */
[[nodiscard]] nlohmann::json ToJson(const CertifyResult& result, const Tube& tube, const Certifier& certifier,
                                    const Config& config);

}  // namespace forereach
