#include "certifier/gate/obstacles_in_force.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "certifier/gate/obstacle_message.h"
#include "certifier/gate/stamp.h"
#include "certifier/numerics/text.h"
#include "certifier/task/canonical.h"
#include "forereach/obstacles_t.hpp"

namespace forereach {

ObstaclesInForce::ObstaclesInForce(const Config& config)
    : options_(config.gate), dim_(static_cast<int>(config.problem->projection.rows())), of_task_(config.obstacles) {
  Put(true);
}

std::string ObstaclesInForce::Update(Bytes bytes, std::int64_t now_us) {
  if (options_.obstacles == ObstaclesSource::kTask)
    return "gate.obstacles is task: those of the task file are all there are";
  const auto message = Decoded<obstacles_t>(bytes);
  if (!message) return Doubt("not an obstacles_t of " + std::to_string(EncodedSize<obstacles_t>()) + " bytes");
  const std::int64_t sequence = message->sequence;
  if (sequence < 0) return Doubt("sequence " + std::to_string(sequence) + " is negative");
  const std::optional<Heard>& last = state_.heard;
  if (last && sequence <= last->sequence && IsNotAfter(message->utime, last->utime, now_us, options_))
    return "sequence " + std::to_string(sequence) + " does not exceed the last, " + std::to_string(last->sequence) +
           ", nor does its stamp the last one's";
  NoteOrder(sequence, now_us);
  if (const std::string fault = Judge(message->utime, now_us, options_).fault; !fault.empty()) return Doubt(fault);
  try {
    state_.heard = Heard{sequence, message->utime, FromMessage(*message, dim_)};
  } catch (const std::invalid_argument& error) {
    return Doubt(error.what());
  }
  state_.doubt.clear();
  Put(options_.obstacles != ObstaclesSource::kUnsaid);
  return {};
}

// Of a message that is newer than the last one taken.
void ObstaclesInForce::NoteOrder(std::int64_t sequence, std::int64_t now_us) {
  const std::int64_t next = state_.next.value_or(sequence);
  const bool follows_the_last_taken = !state_.heard || sequence - 1 == state_.heard->sequence;
  state_.next = sequence == INT64_MAX ? sequence : sequence + 1;
  if (sequence == 0) {
    // While the last message is fresh this may be a second sender, which knows a part only.
    // One from beyond now was stamped before a clock was set back.
    const std::int64_t age_us = state_.heard ? now_us - state_.heard->utime : 0;
    const bool is_beside_another = state_.heard && -Microseconds(options_.max_ahead_ms) <= age_us &&
                                   age_us <= Microseconds(options_.obstacles_timeout_ms);
    state_.unconfirmed = is_beside_another ? 1 : 0;
  } else if (sequence == next || follows_the_last_taken) {
    state_.unconfirmed = std::max(state_.unconfirmed - 1, 0);
  } else {
    state_.unconfirmed = std::max(state_.unconfirmed, sequence > next ? 1 : 2);
    if (sequence > next) state_.lost += sequence - next;
  }
}

std::string ObstaclesInForce::Doubt(const std::string& why) {
  state_.doubt = why;
  return why;
}

std::string ObstaclesInForce::WhyUnknown(std::int64_t now_us) const {
  if (options_.obstacles != ObstaclesSource::kBus) return {};
  if (!state_.doubt.empty()) return "the last message was refused: " + state_.doubt;
  if (!state_.heard) return "none has been heard yet";
  if (state_.unconfirmed > 0)
    return "sequence " + std::to_string(state_.heard->sequence) +
           " came out of order: messages were lost, or there are two senders";
  const std::int64_t stamp = state_.heard->utime;
  switch (
      FreshnessOf(stamp, now_us, Microseconds(options_.obstacles_timeout_ms), Microseconds(options_.max_ahead_ms))) {
    case Freshness::kStale:
      return "the last message is " + Milliseconds(now_us, stamp) + " old, at most " +
             ToText(options_.obstacles_timeout_ms) + " ms are allowed";
    case Freshness::kFuture:
      return "the last message is stamped " + Milliseconds(stamp, now_us) + " ahead: the clock was set back";
    case Freshness::kFresh: break;
  }
  return {};
}

std::optional<std::int64_t> ObstaclesInForce::stamp() const {
  return state_.heard ? std::optional(state_.heard->utime) : std::nullopt;
}

void ObstaclesInForce::Inherit(const ObstaclesInForce& before) {
  state_ = before.state_;
  Put(true);
}

void ObstaclesInForce::Put(bool of_task) {
  all_ = of_task ? of_task_ : std::vector<Obstacle>();
  if (state_.heard) all_.insert(all_.end(), state_.heard->obstacles.begin(), state_.heard->obstacles.end());
  digest_ = ObstaclesDigest(all_);
}

}  // namespace forereach
