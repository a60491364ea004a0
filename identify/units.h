/** Units of logged columns, and what a number in them is in the model's units. */
#pragma once

#include <string>
#include <vector>

namespace forereach {

/** A unit, the unit of the SI (with rad) in which the models are, and the factor between the two. */
struct Unit {
  const char* name;
  const char* base;
  long double factor;  ///< value in `base` = factor * value in `name`
};

/** The units that FactorOf knows by name. */
[[nodiscard]] const std::vector<Unit>& KnownUnits();

/** The factor of a unit's name or of a positive number, as text.
@param base the unit that it has to lead to, as in the model's text; empty: any.
@throws std::invalid_argument for a name that is not known and not a number, or one that leads to another unit. */
[[nodiscard]] long double FactorOf(const std::string& unit, const std::string& base);

}  // namespace forereach
