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

/** docs/decision.md lists the keys. With `inputs` the document can be verified by itself. Numbers that are infinite,
and keys that do not apply to the outcome, are null. */
[[nodiscard]] nlohmann::json ToJson(const CertifyResult& result, const Tube& tube, const Certifier& certifier,
                                    const Config& config);

}  // namespace forereach
