/** Bounds that a task sets to functions of state and input: a lateral acceleration, a power, a region to keep in. */
#pragma once

#include <string>

#include "forereach/dynamics/model_text.h"
#include "forereach/numerics/directed.h"

namespace forereach {

inline constexpr int kMaxLimits = 32;
inline constexpr int kMaxLimitName = 48;  ///< Bytes: a message on the bus has room for it.

/** at_least <= h(x, u) <= at_most, with h the expression `that` of the model's states, inputs, parameters and
definitions, for the values of all parameters. At sample t it holds for every x in X_t with u = u_t; at the last sample,
after which no input is applied, only if h uses no input. Nothing is claimed between the samples. */
struct Limit {
  std::string name;  ///< For messages: printable, 1 to kMaxLimitName bytes.
  ExpressionText that;
  double at_least = -kInfinity,
         at_most = kInfinity;  ///< In the unit of h; one of them is finite, and they are ordered.
};

}  // namespace forereach
