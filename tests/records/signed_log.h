/** The recorded course as with a key, and what somebody without it sent meanwhile. */
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "bus/authentic.h"
#include "forereach/candidate_plan_t.hpp"
#include "forereach/certified_plan_t.hpp"
#include "records/event_log.h"
#include "tests/keys.h"
#include "tests/scratch.h"

namespace forereach {

/** What SignedLog has of each. */
inline constexpr std::int64_t kUnsigned = 2, kForged = 1, kRepeated = 2;

/** Makes keys and a log of what `path` holds, signed, with others' candidates and certified plans among them.
@return the paths of keys and log. */
inline std::pair<std::string, std::string> SignedLog(const ScratchDirectory& scratch, const std::string& path) {
  const std::string key = MakeTestKeys(scratch / "keys"), log = scratch / "signed.lcmlog";
  EventLogReader reader(path);
  EventLogWriter writer(log);
  const Speakers speakers = BusOptions{}.speakers();
  Signer signer(LoadAllKeys(key), "the bus"), intruder(TestKeys("intruder"), "the bus");
  bool candidate_seen = false, certified_seen = false;
  LogEvent event;
  while (reader.Next(event) == LogStatus::kEvent) {
    const auto append = [&](const std::vector<std::uint8_t>& data) { writer.Append(event.utime, event.channel, data); };
    const auto speaker = speakers.find(event.channel);
    if (speaker == speakers.end()) {
      append(event.data);
      continue;
    }
    const std::vector<std::uint8_t> authentic = signer.Sign(speaker->second, event.channel, event.data, event.utime);
    append(authentic);
    if (auto candidate = Decoded<candidate_plan_t>(event.data); candidate && !candidate_seen) {
      candidate_seen = true;
      candidate->plan_id = 1;
      append(Encode(*candidate));
      append(intruder.Sign(Role::kPlanner, event.channel, Encode(*candidate), event.utime));
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
