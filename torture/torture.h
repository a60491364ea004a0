/** Sends what a hostile or broken planner and sender would to a running gate and guard, and counts what gets through.

It attacks whatever speaks these messages on the bus: nothing of it looks into the process. It begins with an honest
candidate, so that a refusal of the others says something; ends by itself, after a bounded number of messages; and moves
no robot: what it sends to a guard starts where the robot is not.

Without a key it sends flawed messages alone: on an unsigned bus a well-formed forgery is obeyed, by whoever made it.
With the key of a planner it is a planner that has gone mad; and it tries that key on every other role's channel. */
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "task/config.h"

namespace forereach {

struct TortureOptions {
  int flood = 2000;             ///< Candidates of the flood.
  double patience_s = 3;        ///< For an answer to an honest candidate, and for a heartbeat.
  std::string beyond_loopback;  ///< The bus's name (BusOptions::bus_name) where its URL leaves this machine.
};

struct TortureRow {
  std::string attack;
  std::int64_t sent = 0, refused = 0, through = 0;  ///< Refused: by an answer. The others were not answered.
  std::string remark;                               ///< What got through, in words.
};

struct TortureReport {
  bool is_signed = false, gate_heard = false, robot_heard = false;
  std::string honest;  ///< How an honest candidate was answered; empty: it was not.
  bool honest_is_judged = false;
  bool alive =
      false;  ///< The gate still answers an honest candidate, or, without a robot's state, sends its heartbeat.
  std::vector<TortureRow> rows;

  [[nodiscard]] std::int64_t through() const;
};

[[nodiscard]] std::string ToText(const TortureReport& report);
[[nodiscard]] nlohmann::json ToJson(const TortureReport& report);

/** @param config its bus, the key of a planner and the sizes of its model. @param progress called once for each of
TortureSteps parts.
@throws ConfigError if the bus leaves this machine and options.beyond_loopback does not name it, or if neither a gate
nor a robot is heard; BusError, KeyError. */
[[nodiscard]] TortureReport Torture(const Config& config, const TortureOptions& options,
                                    const std::function<void()>& progress = {});
[[nodiscard]] std::size_t TortureSteps(const Config& config);

}  // namespace forereach
