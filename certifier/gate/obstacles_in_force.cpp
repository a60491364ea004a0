#include "certifier/gate/obstacles_in_force.h"

#include <algorithm>
#include <span>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "certifier/gate/obstacle_message.h"
#include "certifier/gate/stamp.h"
#include "forereach/numerics/text.h"
#include "forereach/safety/obstacle_view.h"
#include "task/canonical.h"

namespace forereach {

ObstaclesInForce::ObstaclesInForce(const Config& config)
    : options_(config.gate),
      clocks_(ClockBoundsOf(config)),
      dim_(static_cast<int>(config.problem->projection.rows())),
      num_of_task_(config.obstacles.size()),
      all_(config.obstacles),
      state_{.sender = SoleSender(Microseconds(config.gate.obstacles_timeout_ms))} {
  Put();
}

std::string ObstaclesInForce::Update(Bytes bytes, std::int64_t now_us, SenderId sender) {
  if (options_.obstacles != ObstaclesSource::kBus)
    return "gate.obstacles is task: those of the task file are all there are";
  switch (state_.sender.Hear(sender, now_us)) {
    // Each of two may see only a part of the obstacles, and neither is known to be the right one.
    case SoleSender::Place::kOther: return state_.sender.WhyTwo(now_us);
    case SoleSender::Place::kTakesOver:
      state_.order = {};
      state_.set = {};
      state_.known_utime.reset();
      state_.next.reset();
      state_.unconfirmed = 0;
      break;
    case SoleSender::Place::kGoesOn: break;
  }
  if (const auto message = Decoded<obstacles_t>(bytes)) return Take(*message, now_us);
  return Doubt(fmt::format("not an obstacles_t of {} bytes", EncodedSize<obstacles_t>()));
}

std::string ObstaclesInForce::Take(const obstacles_t& message, std::int64_t now_us) {
  const StreamPosition position{message.sequence, message.utime};
  // What cannot be read, or is not believed, is doubted: the obstacles before it are not known to be there still.
  if (position.sequence < 0) return Doubt(fmt::format("sequence {} is negative", position.sequence));
  const std::int64_t horizon = StreamOrder::Horizon(now_us, Microseconds(options_.max_ahead_ms));
  if (!IsNews(state_.order.Compare(position, horizon)))
    return fmt::format("sequence {} does not exceed the last, {}, nor does its stamp the last one's", position.sequence,
                       state_.order.newest()->sequence);
  NoteOrder(position.sequence, now_us);
  if (const std::string fault = CheckStamp(position.utime, now_us, options_).fault; !fault.empty()) return Doubt(fault);
  try {
    TakeSet(message);
  } catch (const std::invalid_argument& error) {
    return Doubt(error.what());
  }
  // Only now: a message that is refused must not make the next good one look old.
  state_.order.Take(position, horizon);
  if (is_partial()) return {};
  state_.known_utime = position.utime;
  state_.arrival = Arrival{position.utime, now_us};
  state_.doubt.clear();
  return {};
}

// @throws std::invalid_argument if it is no set, or one that cannot be in force.
void ObstaclesInForce::TakeSet(const obstacles_t& message) {
  if (state_.set.Take(message) != ObstacleSet::Known::kNew) return;
  try {
    std::vector<Obstacle> heard = FromMessage(state_.set.obstacles(), message.utime, dim_, state_.heard);
    RequireUsable(heard);
    state_.heard = std::move(heard);
  } catch (const std::invalid_argument&) {
    state_.set.Refuse();
    throw;
  }
  const Digest digest = ObstaclesDigest(state_.heard);
  if (digest != std::exchange(state_.heard_digest, digest)) Put();
}

void ObstaclesInForce::RequireUsable(const std::vector<Obstacle>& heard) const {
  RequireClock(heard);
  RequireGrids(heard);
}

// When a plan meets what moves is known only up to the error of the robot's clock.
void ObstaclesInForce::RequireClock(const std::vector<Obstacle>& obstacles) const {
  if (options_.max_clock_error_ms) return;
  const auto moving = std::ranges::find_if(obstacles, [](const Obstacle& each) { return each.motion().has_value(); });
  if (moving != obstacles.end())
    throw std::invalid_argument(
        fmt::format("obstacle {} moves, and the task has no gate.max_clock_error_ms", moving - obstacles.begin()));
}

// A certifier takes so many, and a candidate is not to blame for one too many.
void ObstaclesInForce::RequireGrids(const std::vector<Obstacle>& heard) const {
  const auto of_task = std::span(all_).first(num_of_task_);
  const auto is_grid = [](const Obstacle& each) { return each.grid() != nullptr; };
  const auto own = std::ranges::count_if(of_task, is_grid), more = std::ranges::count_if(heard, is_grid);
  if (own + more > ConvexNumbers::kMostGrids)
    throw std::invalid_argument(
        fmt::format("{} grids and {} of the task file, at most {} in all", more, own, ConvexNumbers::kMostGrids));
}

// Of a message that is newer than the last one taken.
void ObstaclesInForce::NoteOrder(std::int64_t sequence, std::int64_t now_us) {
  const std::int64_t next = state_.next.value_or(sequence);
  const auto& last = state_.order.newest();
  const bool follows_the_last_taken = !last || sequence - 1 == last->sequence;
  state_.next = sequence == INT64_MAX ? sequence : sequence + 1;
  if (sequence == 0) {
    // While the last message is fresh, this may be a second sender, which knows only a part of the obstacles.
    state_.unconfirmed = last && FreshnessAt(last->utime, now_us) == Freshness::kFresh ? 1 : 0;
  } else if (sequence == next || follows_the_last_taken) {
    state_.unconfirmed = std::max(state_.unconfirmed - 1, 0);
  } else {
    // A message backwards may be the other of two senders, so it takes one more in order to be believed.
    state_.unconfirmed = std::max(state_.unconfirmed, sequence > next ? 1 : 2);
    if (sequence > next) state_.lost = SumOfLost(state_.lost, sequence - next);
  }
}

std::string ObstaclesInForce::Doubt(const std::string& why) {
  state_.doubt = why;
  return why;
}

std::string ObstaclesInForce::WhyUnknown(std::int64_t now_us) const {
  if (options_.obstacles != ObstaclesSource::kBus) return {};
  if (std::string two = state_.sender.WhyTwo(now_us); !two.empty()) return two;
  if (!state_.doubt.empty()) return fmt::format("the last message was refused: {}", state_.doubt);
  const std::string partial = state_.set.WhyPartial();
  if (!state_.known_utime) return partial.empty() ? "none has been heard yet" : partial;
  if (state_.unconfirmed > 0)
    return fmt::format("sequence {} came out of order: messages were lost, or there are two senders",
                       state_.order.newest()->sequence);
  if (clocks_ && state_.arrival)
    if (const std::string why = WhyOff(*state_.arrival, *clocks_); !why.empty())
      return fmt::format("their sender's clock is {}", why);
  switch (FreshnessAt(*state_.known_utime, now_us)) {
    case Freshness::kStale:
      return fmt::format(
          "{}{} old, at most {} ms are allowed",
          partial.empty() ? "the last message is " : fmt::format("{}; the last complete one is ", partial),
          Milliseconds(now_us, *state_.known_utime), ToText(options_.obstacles_timeout_ms));
    case Freshness::kFuture:
      return fmt::format("the last message is stamped {} ahead: the clock was set back",
                         Milliseconds(*state_.known_utime, now_us));
    case Freshness::kFresh: break;
  }
  return state_.sender.WhyNotAlone(now_us);
}

Freshness ObstaclesInForce::FreshnessAt(std::int64_t utime, std::int64_t now_us) const {
  return FreshnessOf(utime, now_us, Microseconds(options_.obstacles_timeout_ms), Microseconds(options_.max_ahead_ms));
}

void ObstaclesInForce::Inherit(const ObstaclesInForce& before) {
  state_ = before.state_;
  state_.sender.Follow(Microseconds(options_.obstacles_timeout_ms));
  try {
    RequireUsable(state_.heard);
  } catch (const std::invalid_argument& error) {
    state_.set.Refuse();
    state_.doubt = error.what();
  }
  Put();
}

void ObstaclesInForce::Put() {
  all_.erase(all_.begin() + static_cast<std::ptrdiff_t>(num_of_task_), all_.end());
  all_.insert(all_.end(), state_.heard.begin(), state_.heard.end());
  const Digest digest = ObstaclesDigest(all_);
  if (digest == digest_) return;
  index_ = ObstacleIndex(all_);
  digest_ = digest;
}

}  // namespace forereach
