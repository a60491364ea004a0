#include "certifier/numerics/text.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "certifier/numerics/size.h"

namespace forereach {
namespace {

// Every double has at most so many significant decimal digits.
constexpr int kAllDigits = 767;

// |x| = 0.d1 d2 d3 ... 10^point, all its digits, d1 not zero.
struct Decimal {
  std::string digits;
  int point;
};

Decimal Exact(double x) {
  std::array<char, kAllDigits + 16> text;
  const char* end =
      std::to_chars(text.data(), text.data() + text.size(), std::abs(x), std::chars_format::scientific, kAllDigits - 1)
          .ptr;
  const char* exponent = std::find(text.data(), text.data() + text.size(), 'e') + 1;
  Decimal decimal{text[0] + std::string(text.data() + 2, ToSize(exponent - text.data()) - 3), 0};
  std::from_chars(exponent + (*exponent == '+'), end, decimal.point);
  ++decimal.point;
  return decimal;
}

// Towards zero, or away from it.
void Shorten(Decimal& decimal, std::size_t digits, bool away) {
  std::string& kept = decimal.digits;
  const bool exact = kept.find_first_not_of('0', digits) == std::string::npos;
  kept.resize(digits);
  if (!exact && away) {
    std::size_t i = digits;
    while (i > 0 && kept[i - 1] == '9') kept[--i] = '0';
    if (i > 0) {
      ++kept[i - 1];
    } else {
      kept.insert(0, "1");
      ++decimal.point;
    }
  }
  kept.resize(kept.find_last_not_of('0') + 1);
}

std::string Written(const Decimal& decimal, int digits) {
  const auto& [kept, point] = decimal;
  const int size = static_cast<int>(kept.size());
  if (point < -3 || point > digits) {
    const std::string exponent = std::to_string(std::abs(point - 1));
    return kept.substr(0, 1) + (size > 1 ? "." + kept.substr(1) : "") + (point < 1 ? "e-" : "e+") +
           (exponent.size() < 2 ? "0" : "") + exponent;
  }
  if (point <= 0) return "0." + std::string(ToSize(-point), '0') + kept;
  if (size <= point) return kept + std::string(ToSize(point - size), '0');
  return kept.substr(0, ToSize(point)) + "." + kept.substr(ToSize(point));
}

std::string Rounded(double x, int digits, bool up) {
  if (!std::isfinite(x) || x == 0) return ToText(x == 0 ? 0 : x);
  Decimal decimal = Exact(x);
  Shorten(decimal, ToSize(std::clamp(digits, 1, 700)), up == (x > 0));
  return (x < 0 ? "-" : "") + Written(decimal, digits);
}

}  // namespace

std::string ToText(double value) {
  std::array<char, 32> buffer;
  const auto result = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value);
  return {buffer.data(), result.ptr};
}

std::string RoundedDown(double x, int digits) { return Rounded(x, digits, false); }
std::string RoundedUp(double x, int digits) { return Rounded(x, digits, true); }

}  // namespace forereach
