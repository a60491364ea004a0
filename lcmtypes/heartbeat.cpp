#include "lcmtypes/heartbeat.h"

#include "forereach/certifier_status_v2_t.hpp"
#include "forereach/certifier_status_v3_t.hpp"

namespace forereach {
namespace {

template <class Status>
Heartbeat Of(const Status& status, bool in_charge) {
  return {status.utime, status.sequence, status.version, in_charge, GetDigest(status.config_digest)};
}

}  // namespace

std::optional<Heartbeat> ReadHeartbeat(Bytes message) {
  if (const auto status = Decoded<certifier_status_v3_t>(message))
    return Of(*status,
              status->state != certifier_status_v3_t::LISTENING && status->state != certifier_status_v3_t::STANDBY);
  if (const auto status = Decoded<certifier_status_v2_t>(message)) return Of(*status, true);
  return std::nullopt;
}

}  // namespace forereach
