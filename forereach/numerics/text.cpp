#include "forereach/numerics/text.h"

#include <algorithm>
#include <array>
#include <cfenv>
#include <charconv>
#include <clocale>
#include <cmath>
#include <cstdio>

namespace forereach {
namespace {

// @param direction FE_UPWARD or FE_DOWNWARD. printf rounds the exact value in the direction of its thread.
std::string Rounded(double x, int digits, int direction) {
  if (!std::isfinite(x) || x == 0) return ToText(x == 0 ? 0 : x);
  std::array<char, 720> buffer;
  const int before = std::fegetround();
  std::fesetround(direction);
  std::snprintf(buffer.data(), buffer.size(), "%.*g", std::clamp(digits, 1, 700), x);
  std::fesetround(before);
  const std::string_view text = buffer.data(), point = std::localeconv()->decimal_point;
  const std::size_t whole = std::min(text.find(point), text.size());
  if (whole == text.size()) return std::string(text);
  return std::string(text.substr(0, whole)).append(".").append(text.substr(whole + point.size()));
}

}  // namespace

std::string ToText(double value) {
  std::array<char, 32> buffer;
  const auto result = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value);
  return {buffer.data(), result.ptr};
}

std::string RoundedDown(double x, int digits) { return Rounded(x, digits, FE_DOWNWARD); }
std::string RoundedUp(double x, int digits) { return Rounded(x, digits, FE_UPWARD); }

}  // namespace forereach
