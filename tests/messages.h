/** Every message type, and messages as tests make and hear them. */
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "bus/bus.h"
#include "certifier/gate/obstacle_message.h"
#include "forereach/advice_t.hpp"
#include "forereach/candidate_batch_t.hpp"
#include "forereach/candidate_plan_t.hpp"
#include "forereach/certified_plan_t.hpp"
#include "forereach/certifier_status_t.hpp"
#include "forereach/command_t.hpp"
#include "forereach/decision_t.hpp"
#include "forereach/execution_event_t.hpp"
#include "forereach/fault_t.hpp"
#include "forereach/logger_status_t.hpp"
#include "forereach/obstacles_t.hpp"
#include "forereach/robot_state_t.hpp"
#include "forereach/transition_t.hpp"
#include "forereach/withdrawal_t.hpp"
#include "lcmtypes/codec.h"

namespace forereach {

/** Keeps all messages of a channel. */
template <class Message>
void Hear(Bus& bus, const std::string& channel, std::vector<Message>& heard) {
  bus.Subscribe(channel, [&heard](const Received& r) { heard.push_back(Decoded<Message>(r.bytes).value()); });
}
/** Keeps the last one. */
template <class Message>
void Hear(Bus& bus, const std::string& channel, Message& last) {
  bus.Subscribe(channel, [&last](const Received& r) { last = Decoded<Message>(r.bytes).value(); });
}

inline obstacles_t Sighted(const std::vector<Obstacle>& obstacles, std::int64_t utime, std::int64_t sequence = 0) {
  obstacles_t message = ToMessage(obstacles, utime);
  message.sequence = sequence;
  return message;
}

/** A robot of four states, all zero, that stands or is at a step of a plan. */
inline robot_state_t StateOf(std::int64_t utime, std::int64_t sequence = 0, std::int64_t plan_id = -1, int step = -1) {
  return {.utime = utime,
          .sequence = sequence,
          .executing_plan_id = plan_id,
          .executing_step = static_cast<std::int16_t>(step),
          .mode = plan_id < 0 ? robot_state_t::STANDING : robot_state_t::EXECUTING,
          .num_states = 4};
}

/** What a person sends to clear a fault. */
inline command_t ResetAt(std::int64_t utime) { return {.utime = utime, .kind = command_t::RESET}; }

}  // namespace forereach
