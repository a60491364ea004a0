/** Numbers as text. */
#pragma once

#include <string>

#include "certifier/numerics/compilation.h"

namespace forereach {

/** The shortest decimal that reads back as the same double. */
[[nodiscard]] std::string ToText(double value);

/** A decimal of at most `digits` significant digits, 1 to 700, that is at most (at least) x as an exact number: for
people to read. A lower bound is printed rounded down and an upper bound rounded up, so that what is printed holds too.
In the style of printf's %g; "inf", "-inf" and "nan" as they are. */
[[nodiscard]] std::string RoundedDown(double x, int digits = 6);
[[nodiscard]] std::string RoundedUp(double x, int digits = 6);

}  // namespace forereach
