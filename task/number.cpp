#include "task/number.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <string>

#include "forereach/numerics/text.h"

namespace forereach {
namespace {

bool SpellsNonFinite(std::string_view token) {
  std::string word(token.substr(std::min(token.find_first_not_of("+-."), token.size())));
  for (char& c : word) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return word == "nan" || word == "inf" || word == "infinity";
}

// The token without a leading plus, which std::from_chars does not take; empty if it cannot be a number.
std::string_view Digits(std::string_view token) {
  if (token.starts_with('+') && !token.starts_with("+-")) token.remove_prefix(1);
  const std::string_view magnitude = token.substr(token.starts_with('-') ? 1 : 0);
  return magnitude.empty() || !(IsDigit(magnitude[0]) || magnitude[0] == '.') ? std::string_view() : token;
}

bool HasLeadingZero(std::string_view digits) {
  const std::string_view magnitude = digits.substr(digits.starts_with('-') ? 1 : 0);
  return magnitude.size() > 1 && magnitude[0] == '0' && IsDigit(magnitude[1]);
}

template <class T>
Parsed<T> Parse(std::string_view token, std::string_view not_one) {
  const std::string_view digits = Digits(token);
  if (HasLeadingZero(digits)) return {{}, "has a leading zero"};
  T value{};
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (digits.empty() || error == std::errc::invalid_argument || end != digits.data() + digits.size())
    return {{}, not_one};
  if (error == std::errc::result_out_of_range) return {{}, "is too large or too small to represent"};
  return {value, {}};
}

}  // namespace

Parsed<double> ParseNumber(std::string_view token) {
  if (SpellsNonFinite(token)) return {0, "is not a finite number"};
  return Parse<double>(token, "is not a number");
}

Parsed<long long> ParseInteger(std::string_view token) {
  if (SpellsNonFinite(token)) return {0, "is not a finite number"};
  return Parse<long long>(token, "is not an integer");
}

}  // namespace forereach
