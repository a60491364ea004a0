/** The recorded course as with a key, and what somebody without it sent meanwhile. */
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "certifier/task/config.h"
#include "forereach/candidate_plan_t.hpp"
#include "forereach/certified_plan_t.hpp"
#include "lcmtypes/authentic.h"
#include "logger/event_log.h"
#include "tests/scratch.h"

namespace forereach {

/** What SignedLog has of each. */
inline constexpr std::int64_t kUnsigned = 2, kForged = 1, kRepeated = 2;

/** Makes a key and a log of what `path` holds, signed, with others' candidates and certified plans among them.
@return the paths of key and log. */
inline std::pair<std::string, std::string> SignedLog(const ScratchDirectory& scratch, const std::string& path) {
  const std::string key = scratch / "key", log = scratch / "signed.lcmlog";
  MakeKeyFile(key);
  EventLogReader reader(path);
  EventLogWriter writer(log);
  Signer signer(LoadKey(key), "all", 1), intruder(Key256{1}, "intruder", 1);
  bool candidate_seen = false, certified_seen = false;
  LogEvent event;
  while (reader.Next(event) == LogStatus::kEvent) {
    const auto append = [&](const std::vector<std::uint8_t>& data) { writer.Append(event.utime, event.channel, data); };
    if (!BusOptions{}.signed_channels().contains(event.channel)) {
      append(event.data);
      continue;
    }
    const std::vector<std::uint8_t> authentic = signer.Sign(event.channel, event.data, event.utime);
    append(authentic);
    if (auto candidate = Decoded<candidate_plan_t>(event.data); candidate && !candidate_seen) {
      candidate_seen = true;
      candidate->plan_id = 1;
      append(Encode(*candidate));
      append(intruder.Sign(event.channel, Encode(*candidate), event.utime));
      append(authentic);
    }
    if (auto certified = Decoded<certified_plan_t>(event.data); certified && !certified_seen) {
      certified_seen = true;
      certified->expires_utime += 1;
      append(Encode(*certified));
      append(authentic);
    }
  }
  if (!writer.Flush()) throw LogError(writer.problem());
  return {key, log};
}

}  // namespace forereach
