/** Parses decimal numbers strictly: the whole token must be the number. Independent of the locale. */
#pragma once

#include <string_view>

namespace forereach {

template <class T>
struct Parsed {
  T value{};
  std::string_view problem;  ///< Empty if `value` is valid; otherwise the error, to be printed behind the token.
};

/** The double nearest to a token such as -1, 0.25 or 1e-3. Errors: further characters, hexadecimal, a leading zero that
another reader may take for octal, infinity, NaN, overflow and underflow. */
[[nodiscard]] Parsed<double> ParseNumber(std::string_view token);

/** The same for integers. 1.0 and 1e3 are errors. */
[[nodiscard]] Parsed<long long> ParseInteger(std::string_view token);

}  // namespace forereach
