/** The inputs that a decision rests on, by their digests. Messages and records name a decision's inputs by these
five. */
#pragma once

#include <array>
#include <string>
#include <utility>

#include "lcmtypes/codec.h"

namespace forereach {

struct Grounds {
  Digest config{};        ///< The task file's bytes.
  Digest model{};         ///< The nominal model and its parameters.
  Digest declaration{};   ///< Lipschitz bounds and noise bounds.
  Digest observations{};  ///< The task's transitions, chained with each transition that was learned.
  Digest obstacles{};     ///< The obstacles in force.

  friend bool operator==(const Grounds&, const Grounds&) = default;
};

/** A member of Grounds with its name in words, for messages to people and for JSON. */
struct NamedDigest {
  const char* name;
  Digest Grounds::*member;
};
inline constexpr std::array<NamedDigest, 5> kGrounds{{{"config", &Grounds::config},
                                                      {"model", &Grounds::model},
                                                      {"declaration", &Grounds::declaration},
                                                      {"observations", &Grounds::observations},
                                                      {"obstacles", &Grounds::obstacles}}};

/** Of a message with the five fields: decision_t, certified_plan_t, a certifier's heartbeat. */
template <class Message>
[[nodiscard]] Grounds GroundsOf(const Message& message) {
  return {GetDigest(message.config_digest), GetDigest(message.model_digest), GetDigest(message.declaration_digest),
          GetDigest(message.observations_digest), GetDigest(message.obstacles_digest)};
}

template <class Message>
void SetGrounds(Message& message, const Grounds& grounds) {
  SetDigest(message.config_digest, grounds.config);
  SetDigest(message.model_digest, grounds.model);
  SetDigest(message.declaration_digest, grounds.declaration);
  SetDigest(message.observations_digest, grounds.observations);
  SetDigest(message.obstacles_digest, grounds.obstacles);
}

}  // namespace forereach
