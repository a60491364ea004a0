/** Numbers out of text, strictly: the whole token, in decimal, whatever the locale. */
#pragma once

#include <string_view>

namespace forereach {

template <class T>
struct Parsed {
  T value{};
  std::string_view problem;  ///< Empty if `value` is good, else what is wrong, to be read after the token.
};

/** The double nearest to a token such as -1, 0.25 or 1e-3. Refused: anything left over, hexadecimal, a leading zero
that another reader may take for octal, infinity, NaN, and what no double comes close to. */
[[nodiscard]] Parsed<double> ParseNumber(std::string_view token);

/** The same for integers; 1.0 and 1e3 are refused. */
[[nodiscard]] Parsed<long long> ParseInteger(std::string_view token);

}  // namespace forereach
