/** ForeReach's residual bound, and the same bound with one number in place of its matrix. */
#pragma once

#include <memory>

#include "research/methods/method.h"

namespace forereach::research {

/** LipschitzEnvelope, Eq. (set-envelope), over the domain's box.
Claims: contains r_k(z) for every z of the query, if the declaration holds. Sound. */
[[nodiscard]] std::unique_ptr<ResidualEnclosure> MakeForeReach(const Setting& setting);

/** ForeReach under another declaration than the setting's. */
[[nodiscard]] std::unique_ptr<ResidualEnclosure> MakeForeReach(const Setting& setting, const Declaration& declaration);

/** ForeReach with every bound `part` times as wide about its middle: what a wrong envelope would be. Sound at best for
part >= 1. */
[[nodiscard]] std::unique_ptr<ResidualEnclosure> MakeScaledForeReach(const Setting& setting, double part);

/** The scalar-envelope ablation: L_kl is replaced by lambda = max_kl L_kl for every k and l, the one number for which
|r_k(z) - r_k(z')| <= lambda |z - z'|_1 follows from the declaration for all k. The paper says only that the bound is
"collapsed to a single scalar"; the 1-norm is ours, the one its declaration is written in.
Claims: the same as ForeReach, for a larger class. Sound, and wider. */
[[nodiscard]] std::unique_ptr<ResidualEnclosure> MakeScalarEnvelope(const Setting& setting);

}  // namespace forereach::research
