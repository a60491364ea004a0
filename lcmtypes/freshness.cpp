#include "lcmtypes/freshness.h"

#include <array>
#include <charconv>
#include <cmath>

namespace forereach {
namespace {

std::string Text(double milliseconds) {
  std::array<char, 32> buffer;
  const auto result = std::to_chars(buffer.data(), buffer.data() + buffer.size(), milliseconds);
  return {buffer.data(), result.ptr};
}

std::string AtMost(std::int64_t bound) { return ", at most " + Text(static_cast<double>(bound) / 1e3) + " ms allowed"; }

}  // namespace

std::string WhyNotFresh(std::int64_t stamp, std::int64_t now, std::int64_t max_age, std::int64_t max_ahead) {
  switch (FreshnessOf(stamp, now, max_age, max_ahead)) {
    case Freshness::kStale: return "stamped " + Milliseconds(now, stamp) + " ago" + AtMost(max_age);
    case Freshness::kFuture: return "stamped " + Milliseconds(stamp, now) + " ahead" + AtMost(max_ahead);
    case Freshness::kFresh: break;
  }
  return "";
}

std::string Milliseconds(std::int64_t later, std::int64_t earlier) {
  return Text(std::round((static_cast<double>(later) - static_cast<double>(earlier)) / 1e3)) + " ms";
}

}  // namespace forereach
