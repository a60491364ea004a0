#include "records/status_json.h"

#include <string>

#include "lcmtypes/codec.h"
#include "lcmtypes/names.h"

namespace forereach {
namespace {

using OrderedJson = nlohmann::ordered_json;

OrderedJson If(bool is_known, const OrderedJson& value) { return is_known ? value : OrderedJson(nullptr); }

}  // namespace

nlohmann::ordered_json ToJson(const certifier_status_t& status, bool is_signed) {
  OrderedJson by_outcome, by_cause;
  for (std::int16_t i = 0; i < 16; ++i)
    if (status.by_outcome[i] > 0) by_outcome[std::string(OutcomeName(i))] = status.by_outcome[i];
  for (std::int16_t i = 1; i < 64; ++i)
    if (status.by_cause[i] > 0) by_cause[std::string(CauseName(i))] = status.by_cause[i];
  return {
      {"level", LevelName(status.level)},
      {"state", StateName(status.state)},
      {"fault", If(status.fault != 0, FaultName(status.fault))},
      {"latch", LatchName(status.latch)},
      {"message", GetText(status.message)},
      {"advice", If(status.fault != 0, FaultAdvice(status.fault))},
      {"signed", is_signed},
      {"shadow", status.shadow != 0},
      {"version", status.version},
      {"failed_reloads", status.failed_reloads},
      {"candidates", status.candidates},
      {"by_outcome", by_outcome},
      {"by_cause", by_cause},
      {"instance", status.instance},
      {"started_utime", status.started_utime},
      {"other_instance", If(status.other_instance != 0, status.other_instance)},
      {"obstacles",
       {{"source", ObstaclesSourceName(status.obstacles_source)},
        {"known", status.obstacles_known != 0},
        {"in_force", status.obstacles_in_force},
        {"utime", If(status.obstacles_utime != 0, status.obstacles_utime)},
        {"age_us", If(status.obstacles_age_us >= 0, status.obstacles_age_us)},
        {"lost", status.obstacles_lost}}},
      {"unsigned", status.is_unsigned != 0},
      {"candidates_lost", status.candidates_lost},
      {"messages_refused", status.messages_refused},
      {"refused_unsigned", status.refused_unsigned},
      {"refused_forged", status.refused_forged},
      {"refused_replayed", status.refused_replayed},
      {"refused_foreign", status.refused_foreign},
      {"datagrams_refused", status.datagrams_refused},
      {"bus_dropped", status.bus_dropped},
      {"observations", status.observations},
      {"learned", status.learned},
      {"queue_depth", status.queue_depth},
      {"elapsed_us", {{"p50", status.elapsed_p50_us}, {"p99", status.elapsed_p99_us}, {"max", status.elapsed_max_us}}}};
}

}  // namespace forereach
