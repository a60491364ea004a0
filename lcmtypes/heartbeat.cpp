#include "lcmtypes/heartbeat.h"

#include "forereach/certifier_status_v2_t.hpp"
#include "forereach/certifier_status_v3_t.hpp"

namespace forereach {

std::optional<Heartbeat> ReadHeartbeat(Bytes message) {
  if (const auto status = Decoded<certifier_status_v3_t>(message))
    return Heartbeat{status->utime, status->sequence, status->version,
                     status->state != certifier_status_v3_t::LISTENING && status->state != certifier_status_v3_t::STANDBY};
  if (const auto status = Decoded<certifier_status_v2_t>(message))
    return Heartbeat{status->utime, status->sequence, status->version, true};
  return std::nullopt;
}

}  // namespace forereach
