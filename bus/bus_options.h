/** Where a task's messages go, who speaks on which channel, and the keys of its bus. */
#pragma once

#include <optional>
#include <string>

#include "bus/authentic.h"
#include "bus/keys.h"

namespace forereach {

/** By how much the clocks of two certifiers on one bus may differ, microseconds: each has to hear that the other is
there. The one whose clock is ahead does not hear the other, whose heartbeats were signed before its start, until the
other's clock has passed that time; the other hears it. */
inline constexpr std::int64_t kCertifiersApartUs = 60'000'000;

struct BusOptions {
  std::string url = "udpm://239.255.76.67:7667?ttl=0";
  std::string candidate = "PLAN_CANDIDATE";
  std::string decision = "PLAN_DECISION";
  std::string certified = "PLAN_CERTIFIED";
  std::string withdrawn = "PLAN_WITHDRAWN";
  std::string advice = "PLAN_ADVICE";
  std::string robot_state = "ROBOT_STATE";
  std::string obstacles = "OBSTACLES";
  std::string transition = "TRANSITION";
  std::string status = "CERTIFIER_STATUS";
  std::string event = "EXECUTION_EVENT";
  std::string logger_status = "LOGGER_STATUS";
  std::string fault = "FAULT";
  std::string command = "COMMAND";
  /** The longest time from a message's stamp to its arrival at the certifier, if all clocks agree. A loaded machine may
  wake a process 8 ms late (docs/reliability.md). */
  double delay_ms = 10;
  std::string name;             ///< Of the bus, in every signature; empty: address and port of `url`.
  std::string key;              ///< Path of a directory of keys or of a key file; empty: messages are not signed.
  bool key_is_given = false;    ///< On the command line, so the task file does not say which.
  std::optional<KeyRing> keys;  ///< What `key` held when the process started; nothing: not read yet, or none.

  /** The role that speaks on each channel where there are keys. */
  [[nodiscard]] Speakers speakers() const {
    return {{decision, Role::kCertifier},
            {certified, Role::kCertifier},
            {status, {Role::kCertifier, kCertifiersApartUs}},
            {advice, Role::kCertifier},
            {fault, {Role::kCertifier, kStopsAheadUs}},
            {candidate, Role::kPlanner},
            {withdrawn, {Role::kCertifier, kStopsAheadUs}},
            {command, Role::kOperator},
            {obstacles, Role::kPerception},
            {event, Role::kRobot},
            {robot_state, Role::kRobot},
            {transition, Role::kRobot},
            {logger_status, Role::kLogger}};
  }

  /** `name`, or address and port of `url`: "239.255.76.67:7667"; "memq" for memq. @throws BusError if `url` is none. */
  [[nodiscard]] std::string bus_name() const;

  friend bool operator==(const BusOptions&, const BusOptions&) = default;
};

/** What every process says where its task has no key. */
inline constexpr const char* kUnsignedWarning = "UNSIGNED: anyone on this network can move this robot";

/** The keys for a program that speaks as `role`: those already read, or what bus.key names; nothing if it names none.
@throws KeyError if they cannot be used. */
[[nodiscard]] std::optional<KeyRing> KeysOf(const BusOptions& options, Role role);
/** The same for one program that is all processes. */
[[nodiscard]] std::optional<KeyRing> AllKeysOf(const BusOptions& options);
/** For a reader of logs, and for the logger, so that both take the same messages for authentic: without the group key,
whose tags the signatures do not cover. */
[[nodiscard]] std::optional<KeyRing> PublicKeysOf(const BusOptions& options);

/** The options with these keys in them. */
[[nodiscard]] BusOptions WithKeys(BusOptions options, Role role);

/** Why a task file that was read again cannot take the place of the one that a process began with: another key, none,
or other content of the same. Empty if it can. Reads the keys of `read_again`. @param role that the process speaks
as. */
[[nodiscard]] std::string WhyKeyCannotChange(const BusOptions& in_force, const BusOptions& read_again, Role role);

}  // namespace forereach
