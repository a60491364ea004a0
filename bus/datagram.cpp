#include "bus/datagram.h"

#include <algorithm>
#include <cstring>

#include <fmt/format.h>

namespace forereach {
namespace {

constexpr std::size_t kMagicBytes = 4;
constexpr char kShortMessage[] = "LC02", kFragment[] = "LC03";

bool IsPrintable(char c) { return c >= ' ' && c <= '~'; }

bool BeginsWith(Bytes bytes, const char* magic) { return std::memcmp(bytes.data(), magic, kMagicBytes) == 0; }

}  // namespace

bool IsChannelName(std::string_view name) noexcept {
  return !name.empty() && name.size() <= kMaxChannelBytes && std::ranges::all_of(name, IsPrintable);
}

Datagram ParseDatagram(Bytes bytes) noexcept {
  if (bytes.size() < kDatagramHeaderBytes) return {DatagramKind::kTooShort, {}, {}};
  if (BeginsWith(bytes, kFragment)) return {DatagramKind::kFragment, {}, {}};
  if (!BeginsWith(bytes, kShortMessage)) return {DatagramKind::kNotLcm, {}, {}};
  const Bytes rest = bytes.subspan(kDatagramHeaderBytes);
  // A name may fill the whole datagram; beyond the longest that is allowed nothing is looked at.
  const Bytes head = rest.first(std::min(rest.size(), kMaxChannelBytes + 1));
  const auto end = std::ranges::find(head, 0);
  if (end == head.end()) return {DatagramKind::kUnterminatedName, {}, {}};
  const auto length = static_cast<std::size_t>(end - head.begin());
  const std::string_view channel(reinterpret_cast<const char*>(head.data()), length);
  if (!IsChannelName(channel)) return {DatagramKind::kBadName, {}, {}};
  return {DatagramKind::kMessage, channel, rest.subspan(length + 1)};
}

void DatagramCounts::Count(DatagramKind kind) {
  switch (kind) {
    case DatagramKind::kTooShort: ++too_short; return;
    case DatagramKind::kNotLcm: ++not_lcm; return;
    case DatagramKind::kFragment: ++fragments; return;
    case DatagramKind::kUnterminatedName: ++unterminated_names; return;
    case DatagramKind::kBadName: ++bad_names; return;
    case DatagramKind::kMessage: ++messages; return;
  }
}

std::string DescribeRefused(const DatagramCounts& counts) {
  std::string words;
  const auto add = [&words](std::int64_t count, const char* what) {
    if (count > 0) words += fmt::format("{}{} {}", words.empty() ? "" : ", ", count, what);
  };
  add(counts.fragments, "fragments of messages over 64 kB");
  add(counts.not_lcm, "not of LCM");
  add(counts.too_short, "too short");
  add(counts.unterminated_names, "without the end of the channel's name");
  add(counts.bad_names, "with a channel's name that is empty or not printable");
  add(counts.truncated, "truncated");
  return words;
}

}  // namespace forereach
