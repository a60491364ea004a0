#include "records/shard.h"

#include <charconv>

#include "lcmtypes/printable.h"
#include "task/config_error.h"

namespace forereach {

Shard ShardOf(const std::string& text) {
  if (text.empty()) return {};
  int number = 0, count = 0;
  const char* const end = text.data() + text.size();
  const auto [slash, error] = std::from_chars(text.data(), end, number);
  const bool has_count = error == std::errc() && slash != end && *slash == '/' &&
                         std::from_chars(slash + 1, end, count).ptr == end && slash + 1 != end;
  if (!has_count || number < 1 || number > count || count > kMostShards)
    throw ConfigError("--shard: {} is not I/N with whole numbers 1 <= I <= N <= {}, for example 2/7", Printable(text),
                      kMostShards);
  return {number - 1, count};
}

}  // namespace forereach
