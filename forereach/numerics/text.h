/** Numbers as text. */
#pragma once

#include <string>

#include "forereach/numerics/compilation.h"

namespace forereach {

/** Whether it is a decimal digit, whatever the locale. */
[[nodiscard]] constexpr bool IsDigit(char c) { return '0' <= c && c <= '9'; }

/** The shortest decimal that reads back as the same double. */
[[nodiscard]] std::string ToText(double value);

/** A decimal of at most `digits` significant digits (1 to 700) that is, as an exact number, at most x (RoundedDown) or
at least x (RoundedUp). Print lower bounds rounded down and upper bounds rounded up, so that the printed bound is valid
too. The style is that of printf's %g; infinity and NaN give "inf", "-inf" and "nan". */
[[nodiscard]] std::string RoundedDown(double x, int digits = 6);
[[nodiscard]] std::string RoundedUp(double x, int digits = 6);

}  // namespace forereach
