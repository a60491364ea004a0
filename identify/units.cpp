#include "identify/units.h"

#include <numbers>
#include <stdexcept>

#include <fmt/core.h>

#include "command_line/nearest.h"
#include "task/number.h"

namespace forereach {

const std::vector<Unit>& KnownUnits() {
  constexpr long double kTurn = 2 * std::numbers::pi_v<long double>, kDegree = kTurn / 360;
  constexpr long double kKnot = 1852.0L / 3600, kMile = 1609.344L, kGravity = 9.80665L;
  static const std::vector<Unit> units{{"deg", "rad", kDegree},
                                       {"deg/s", "rad/s", kDegree},
                                       {"deg/s^2", "rad/s^2", kDegree},
                                       {"rev/s", "rad/s", kTurn},
                                       {"rpm", "rad/s", kTurn / 60},
                                       {"mm", "m", 1e-3L},
                                       {"cm", "m", 1e-2L},
                                       {"km", "m", 1e3L},
                                       {"ft", "m", 0.3048L},
                                       {"mm/s", "m/s", 1e-3L},
                                       {"cm/s", "m/s", 1e-2L},
                                       {"km/h", "m/s", 1 / 3.6L},
                                       {"mph", "m/s", kMile / 3600},
                                       {"kn", "m/s", kKnot},
                                       {"mm/s^2", "m/s^2", 1e-3L},
                                       {"standard gravity", "m/s^2", kGravity},
                                       {"ns", "s", 1e-9L},
                                       {"us", "s", 1e-6L},
                                       {"ms", "s", 1e-3L},
                                       {"min", "s", 60},
                                       {"h", "s", 3600},
                                       {"%", "1", 1e-2L}};
  return units;
}

long double FactorOf(const std::string& unit, const std::string& base) {
  if (const auto [factor, problem] = ParseNumber(unit); problem.empty()) {
    if (!(factor > 0)) throw std::invalid_argument(fmt::format("'{}': a factor is above 0", unit));
    return factor;
  }
  for (const Unit& known : KnownUnits()) {
    if (unit == known.base && (base.empty() || base == unit)) return 1;
    if (unit != known.name) continue;
    if (base.empty() || base == known.base) return known.factor;
    throw std::invalid_argument(fmt::format("'{}' is {}, and the model has {}", unit, known.base, base));
  }
  if (!unit.empty() && unit == base) return 1;
  std::vector<std::string> names;
  for (const Unit& known : KnownUnits()) names.emplace_back(known.name);
  throw std::invalid_argument(
      fmt::format("'{}' is no unit that is known here, and no factor; {}", unit, Suggestion(unit, names)));
}

}  // namespace forereach
