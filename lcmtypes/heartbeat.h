/** The common part of certifier_status_v3_t and certifier_status_v2_t, for readers of recorded logs. */
#pragma once

#include <cstdint>
#include <optional>

#include "lcmtypes/codec.h"

namespace forereach {

struct Heartbeat {
  std::int64_t utime, sequence, version;
  /** False while the certifier listens for another one or stands by; it then decides nothing. */
  bool in_charge;
  Digest config_digest;
};

/** Decodes a certifier_status_v3_t or a certifier_status_v2_t. Nothing for other bytes. */
[[nodiscard]] std::optional<Heartbeat> ReadHeartbeat(Bytes message);

}  // namespace forereach
