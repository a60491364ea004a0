/** The least amount that is enough, by halving. For amounts that need not be exact, such as advice to people. */
#pragma once

#include <optional>

#include "forereach/numerics/compilation.h"

namespace forereach {

/** The least amount in (0, most] that is enough: an amount that is enough, up to most / 2^halvings too large if what is
enough is an interval up to `most`. Nothing if `most` is not enough. */
template <class IsEnough>
[[nodiscard]] std::optional<double> Least(double most, int halvings, IsEnough is_enough) {
  if (!is_enough(most)) return std::nullopt;
  double too_little = 0, enough = most;
  for (int i = 0; i < halvings; ++i) {
    const double middle = (too_little + enough) / 2;
    (is_enough(middle) ? enough : too_little) = middle;
  }
  return enough;
}

/** The same if its size is not known: tries first, 2 first, 4 first .. up to `most`. */
template <class IsEnough>
[[nodiscard]] std::optional<double> LeastFrom(double first, double most, int halvings, IsEnough is_enough) {
  for (double amount = first; amount <= most; amount *= 2)
    if (is_enough(amount)) return Least(amount, halvings, is_enough);
  return std::nullopt;
}

}  // namespace forereach
