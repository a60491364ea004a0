#include "identify/lcm_table.h"

#include "identify/channel_table.h"
#include "records/event_log.h"
#include "task/config_error.h"

namespace forereach {

LogTable ReadLcmLog(const std::string& path, const std::vector<std::string>& wanted, const LcmTypes& types) {
  ChannelTable table(path, wanted);
  EventLogReader log(path);
  LogEvent event;
  std::optional<std::string> first_type;
  for (;;) {
    const LogStatus status = log.Next(event);
    if (status == LogStatus::kEnd || status == LogStatus::kCutTail) return table.Finish();
    if (status == LogStatus::kCorrupt) {
      table.Lose("damage of the log");
      continue;
    }
    if (!table.Takes(event.channel)) continue;
    const std::optional<std::string> type = types.TypeOf(event.data);
    if (!type && !first_type)
      throw ConfigError("{}: no type of the given .lcm files has the fingerprint of the messages on {}: {}", path,
                        event.channel, types.size() == 0 ? "give --lcm-types" : "theirs are others or older");
    if (!first_type) first_type = type;
    const auto values = type == first_type ? types.Read(*type, table.places(), event.data) : std::nullopt;
    if (values)
      table.Add(*values, static_cast<double>(event.utime) / 1e6);
    else
      table.Lose("a message of another type or length");
  }
}

}  // namespace forereach
