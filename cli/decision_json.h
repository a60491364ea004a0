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
  Digest plan_digest{};
  double elapsed_us = 0;
};

/** Keys: outcome, step, cause, message, tube, digests, elapsed_us. `tube` has an object for each X_t that was computed:
center, half_width (of the interval hull), generators (list of columns), clearance (per obstacle, a lower bound on the
distance to it in metres, negative where none was proven), radius (of the projected slice, metres), and for each
completed step also envelope {lower, upper} and remainder. Numbers that are infinite are null. */
[[nodiscard]] nlohmann::json ToJson(const CertifyResult& result, const Tube& tube, const Certifier& certifier,
                                    const Config& config);

}  // namespace forereach
