/** When the certifier of a log began anew, as its heartbeats tell: what it had learned is gone then. */
#pragma once

#include <cstdint>

#include "lcmtypes/heartbeat.h"

namespace forereach {

class Restarts final {
 public:
  enum class Kind {
    kNone,
    kBegin,   ///< A new process, which has heard nothing yet.
    kReload,  ///< The same with its task read again: the obstacles that it had heard it still knows.
  };

  /** What has happened between the heartbeat before and this message of CERTIFIER_STATUS. A process counts heartbeats
  from 0, and versions up by each reload. A log may begin in the middle of its life, which is no beginning. Heartbeats
  of a certifier that is not in charge mean nothing here: when it takes charge it counts from 0. */
  [[nodiscard]] Kind Notice(Bytes message) {
    const auto status = ReadHeartbeat(message);
    if (!status || !status->in_charge) return Kind::kNone;
    const bool began = status->sequence == 0 || status->sequence < last_sequence_;
    const bool reloaded = last_sequence_ >= 0 && status->version != last_version_;
    last_sequence_ = status->sequence;
    last_version_ = status->version;
    config_ = status->config_digest;
    return began ? Kind::kBegin : reloaded ? Kind::kReload : Kind::kNone;
  }

  /** The config digest of the last heartbeat. */
  [[nodiscard]] const Digest& config() const { return config_; }

 private:
  Digest config_{};
  std::int64_t last_sequence_ = -1, last_version_ = 0;
};

}  // namespace forereach
