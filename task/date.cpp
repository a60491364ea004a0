#include "task/date.h"

#include <algorithm>
#include <chrono>
#include <string>

#include "forereach/numerics/text.h"
#include "task/number.h"

namespace forereach {
namespace {

// So many digits at the front, taken off the text; -1 if there are fewer.
int TakeDigits(std::string_view& text, std::size_t count) {
  int value = 0;
  if (text.size() < count) return -1;
  for (std::size_t i = 0; i < count; ++i) {
    if (!IsDigit(text[i])) return -1;
    value = 10 * value + (text[i] - '0');
  }
  text.remove_prefix(count);
  return value;
}

bool Take(std::string_view& text, char c) {
  if (!text.starts_with(c)) return false;
  text.remove_prefix(1);
  return true;
}

// The seconds east of UTC of "Z", "+01:00", "-0130" or nothing.
std::optional<int> ZoneOf(std::string_view text) {
  if (text.empty() || text == "Z" || text == "z") return 0;
  const int sign = text[0] == '-' ? -1 : 1;
  if (!Take(text, '+') && !Take(text, '-')) return std::nullopt;
  const int hours = TakeDigits(text, 2);
  static_cast<void>(Take(text, ':'));
  const int minutes = text.empty() ? 0 : TakeDigits(text, 2);
  if (hours < 0 || hours > 23 || minutes < 0 || minutes > 59 || !text.empty()) return std::nullopt;
  return sign * (3600 * hours + 60 * minutes);
}

}  // namespace

std::optional<long double> SecondsOfDate(std::string_view text) {
  const int year = TakeDigits(text, 4);
  const bool is_basic = !text.starts_with('-');  // no separators at all
  const auto separates = [&](char c) { return is_basic || Take(text, c); };
  if (year < 0 || !separates('-')) return std::nullopt;
  const int month = TakeDigits(text, 2);
  if (month < 0 || !separates('-')) return std::nullopt;
  const int day = TakeDigits(text, 2);
  const std::chrono::year_month_day date{std::chrono::year(year), std::chrono::month(static_cast<unsigned>(month)),
                                         std::chrono::day(static_cast<unsigned>(day))};
  if (day < 0 || !date.ok() || !(Take(text, 'T') || Take(text, 't') || Take(text, ' '))) return std::nullopt;
  const int hour = TakeDigits(text, 2);
  if (hour < 0 || hour > 23 || !separates(':')) return std::nullopt;
  const int minute = TakeDigits(text, 2);
  if (minute < 0 || minute > 59 || !separates(':')) return std::nullopt;
  const int second = TakeDigits(text, 2);
  if (second < 0 || second > 60) return std::nullopt;
  long double fraction = 0;
  if (Take(text, '.') || Take(text, ',')) {
    const std::size_t digits = std::min(text.find_first_not_of("0123456789"), text.size());
    if (digits == 0) return std::nullopt;
    fraction = ParseNumber("0." + std::string(text.substr(0, digits))).value;
    text.remove_prefix(digits);
  }
  const std::optional<int> zone = ZoneOf(text);
  if (!zone) return std::nullopt;
  const auto days = std::chrono::sys_days(date).time_since_epoch().count();
  return static_cast<long double>(days * 86'400LL + hour * 3600 + minute * 60 + second - *zone) + fraction;
}

}  // namespace forereach
