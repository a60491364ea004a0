/** Random candidates that a gate has answered without a judgement, for every cause that is answered so. */
#pragma once

#include <array>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "advise/abstentions.h"
#include "certifier/gate/gate.h"
#include "tests/certifier/small_task.h"
#include "tests/oracle/random.h"

namespace forereach {

struct Answered {
  std::shared_ptr<Config> task = std::make_shared<Config>(SmallTask());
  RecordedAbstention abstention = {};
};

/** The causes that AnyAnswered tries for. */
inline constexpr std::array kAnswers{
    decision_t::CAUSE_STALE,           decision_t::CAUSE_FUTURE,           decision_t::CAUSE_DEADLINE,
    decision_t::CAUSE_TOO_LATE,        decision_t::CAUSE_DUPLICATE,        decision_t::CAUSE_WRONG_LENGTH,
    decision_t::CAUSE_TRAILING_BYTES,  decision_t::CAUSE_WRONG_DIMENSION,  decision_t::CAUSE_UNKNOWN_FINGERPRINT,
    decision_t::CAUSE_NON_FINITE,      decision_t::CAUSE_TOO_MANY_SOURCES, decision_t::CAUSE_QUEUE_FULL,
    decision_t::CAUSE_INTERNAL_ERROR,  decision_t::CAUSE_OVERRUN,          decision_t::CAUSE_NOT_ARMED,
    decision_t::CAUSE_FAULT,           decision_t::CAUSE_SHADOW,           decision_t::CAUSE_NO_OBSTACLES,
    decision_t::CAUSE_LATCH_UNWRITABLE};

/** An answer of a gate with random settings. It may be another one than `cause`, and even a judgement. */
inline Answered AnyAnswered(Random& random, std::int16_t cause) {
  Answered answered;
  Config& task = *answered.task;
  RecordedAbstention& abstention = answered.abstention;
  GateOptions& gate = task.gate;
  gate.max_age_ms = random.Uniform(1, 800);
  gate.max_ahead_ms = random.Uniform(1, 100);
  gate.certificate_lifetime_ms = random.Uniform(200, 2000);
  gate.decision_budget_ms = random.Uniform(1, 50);
  gate.queue = random.Integer(1, 64);
  task.robot.step_period_ms = 150;

  const bool is_certified = cause == decision_t::CAUSE_SHADOW || cause == decision_t::CAUSE_OVERRUN || random.Coin(0.6);
  const double acceleration = is_certified    ? kAccelerationThatCertifies
                              : random.Coin() ? kAccelerationIntoTheCircle
                                              : kAccelerationOutsideDomain;
  candidate_plan_t& candidate = abstention.candidate;
  candidate = Candidate(random.Integer(2, 1000), acceleration);
  candidate.start_utime = kNow + 100'000;
  std::int64_t now = kNow;
  const auto us = [](double milliseconds) { return static_cast<std::int64_t>(milliseconds * 1e3); };
  std::vector<std::uint8_t> bytes = Encode(candidate);
  const auto sent = [&](auto change) {
    change(candidate);
    bytes = Encode(candidate);
  };
  const auto refuse = [&](std::int16_t outcome = decision_t::REJECTED) {
    return Gate(task).Refuse(bytes, now, cause, "as the certifier's node says", outcome).decision;
  };
  const auto decide = [&] { return Gate(task).Decide(bytes, now).decision; };

  decision_t& decision = abstention.decision;
  switch (cause) {
    case decision_t::CAUSE_STALE:
      sent([&](candidate_plan_t& c) { c.start_utime += us(random.Uniform(0, 3000)); });
      now += us(gate.max_age_ms + random.Uniform(0.1, 2000));
      decision = decide();
      break;
    case decision_t::CAUSE_FUTURE:
      if (random.Coin())
        now -= us(gate.max_ahead_ms + random.Uniform(0.1, 200));
      else
        sent([&](candidate_plan_t& c) { c.start_utime += us(gate.certificate_lifetime_ms + random.Uniform(0, 1000)); });
      decision = decide();
      break;
    case decision_t::CAUSE_DEADLINE:
    case decision_t::CAUSE_TOO_LATE:
      now = candidate.start_utime + us(cause == decision_t::CAUSE_DEADLINE ? -random.Uniform(0, gate.decision_budget_ms)
                                                                           : random.Uniform(0, 1000));
      sent([&](candidate_plan_t& c) { c.utime = now - us(random.Uniform(0, gate.max_age_ms)); });
      decision = decide();
      break;
    case decision_t::CAUSE_DUPLICATE: {
      Gate twice(task);
      static_cast<void>(twice.Decide(bytes, now));
      decision = twice.Decide(bytes, now).decision;
      break;
    }
    case decision_t::CAUSE_WRONG_LENGTH:
      bytes.resize(static_cast<std::size_t>(random.Integer(8, static_cast<int>(bytes.size()) - 1)));
      decision = decide();
      break;
    case decision_t::CAUSE_TRAILING_BYTES:
      bytes.resize(bytes.size() + static_cast<std::size_t>(random.Integer(1, 100)));
      decision = decide();
      break;
    case decision_t::CAUSE_UNKNOWN_FINGERPRINT:
      bytes[static_cast<std::size_t>(random.Below(8))] ^= static_cast<std::uint8_t>(random.Integer(1, 255));
      decision = decide();
      break;
    case decision_t::CAUSE_WRONG_DIMENSION:
      sent([&](candidate_plan_t& c) { c.num_steps = static_cast<std::int16_t>(random.Integer(129, 1000)); });
      decision = decide();
      break;
    case decision_t::CAUSE_NON_FINITE:
      sent([&](candidate_plan_t& c) {
        c.control[random.Below(10)][random.Below(2)] =
            random.Coin() ? std::numeric_limits<double>::quiet_NaN() : std::numeric_limits<double>::infinity();
      });
      decision = decide();
      break;
    case decision_t::CAUSE_TOO_MANY_SOURCES: {
      Gate crowded(task);
      for (std::size_t i = 0; i < Sources::kMaxSources; ++i) {
        candidate_plan_t other = candidate;
        SetText(other.source, "other " + std::to_string(i));
        static_cast<void>(crowded.Decide(Encode(other), now));
      }
      decision = crowded.Decide(bytes, now).decision;
      break;
    }
    case decision_t::CAUSE_QUEUE_FULL:
      abstention.waiting = static_cast<std::size_t>(random.Integer(0, 100));
      decision = refuse();
      break;
    case decision_t::CAUSE_OVERRUN: {
      const double taken = gate.decision_budget_ms + random.Uniform(0.01, 100);
      std::int64_t late = now;
      decision = Gate(task).Decide(bytes, [&] { return std::exchange(late, now + us(taken)); }).decision;
      decision.elapsed_us = taken * 1e3;
      break;
    }
    case decision_t::CAUSE_SHADOW:
      gate.shadow = true;
      decision = decide();
      break;
    case decision_t::CAUSE_NO_OBSTACLES: {
      gate.obstacles = ObstaclesSource::kBus;
      gate.obstacles_timeout_ms = random.Uniform(1, 500);
      if (random.Coin(0.8)) {
        obstacles_t seen{.utime = now - us(gate.obstacles_timeout_ms + random.Uniform(0.01, 1000))};
        abstention.last_obstacles =
            std::make_shared<std::pair<std::vector<std::uint8_t>, std::int64_t>>(Encode(seen), seen.utime);
      }
      decision = refuse(decision_t::ABSTAIN_OBSTACLES);
      break;
    }
    default: decision = refuse();
  }
  abstention.task = &task;
  abstention.outcome = decision.outcome;
  abstention.cause = decision.cause;
  if (!Decoded<candidate_plan_t>(bytes)) candidate = {};  // as where a log is read
  return answered;
}

}  // namespace forereach
