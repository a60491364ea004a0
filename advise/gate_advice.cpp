#include "advise/gate_advice.h"

#include <cmath>

#include <fmt/core.h>

#include "certifier/gate/gate.h"
#include "certifier/gate/obstacles_in_force.h"
#include "forereach/numerics/text.h"

namespace forereach {
namespace {

constexpr double kHourMs = 3'600'000;  // the most that these keys take
constexpr std::size_t kLongestQueue = 65536;

// In doubles: a log may hold any stamps, and those of this age are exact.
double Ms(std::int64_t from, std::int64_t to) { return (static_cast<double>(to) - static_cast<double>(from)) / 1e3; }

bool IsJudged(const decision_t& decision) {
  switch (decision.outcome) {
    case decision_t::CERTIFIED:
    case decision_t::ABSTAIN_FALSIFIED:
    case decision_t::ABSTAIN_DOMAIN:
    case decision_t::ABSTAIN_SAFETY: return true;
    default: return decision.cause == decision_t::CAUSE_SHADOW;
  }
}

// What is necessary in any case, whatever the numbers are; empty for a cause that needs no remedy of this kind.
std::string Necessary(std::int16_t cause) {
  switch (cause) {
    case decision_t::CAUSE_STALE: return "if it was sent less than gate.max_age_ms before it is heard";
    case decision_t::CAUSE_FUTURE:
      return "if the clocks agreed to gate.max_ahead_ms and it started within gate.certificate_lifetime_ms";
    case decision_t::CAUSE_DUPLICATE: return "with a plan_id above all that its source has used";
    case decision_t::CAUSE_WRONG_LENGTH:
    case decision_t::CAUSE_TRAILING_BYTES:
    case decision_t::CAUSE_UNKNOWN_FINGERPRINT: return "if its sender encoded it as a candidate_plan_t of this version";
    case decision_t::CAUSE_WRONG_DIMENSION: return "with the sizes and step_us of the task that is in force";
    case decision_t::CAUSE_NON_FINITE: return "with finite numbers, and half-widths that are not negative";
    case decision_t::CAUSE_TOO_MANY_SOURCES: return "if fewer sources sent candidates at a time";
    case decision_t::CAUSE_TOO_LATE: return "if it was sent at least gate.decision_budget_ms before its start";
    case decision_t::CAUSE_QUEUE_FULL: return "if fewer candidates waited, or fewer certified plans might be executed";
    case decision_t::CAUSE_INTERNAL_ERROR: return "without the error inside the certifier that the sentence names";
    case decision_t::CAUSE_DEADLINE: return "if it was sent at least gate.decision_budget_ms before its start";
    case decision_t::CAUSE_OVERRUN: return "if the decision took no longer than gate.decision_budget_ms";
    case decision_t::CAUSE_NOT_ARMED: return "once the robot's state is heard";
    case decision_t::CAUSE_FAULT: return "once the fault is reset (forereach reset)";
    case decision_t::CAUSE_SHADOW: return "with gate.mode: enforce";
    case decision_t::CAUSE_NO_OBSTACLES:
      return "if complete obstacles were heard within gate.obstacles_timeout_ms before";
    case decision_t::CAUSE_LATCH_UNWRITABLE: return "once gate.state can be written, and the fault is reset";
    default: return {};
  }
}

// With numbers of the decision, tried where a gate can be asked.
class RemedySearch final {
 public:
  explicit RemedySearch(const RecordedAbstention& abstention) : abstention_(abstention) {}

  [[nodiscard]] std::optional<Remedy> Find() const {
    switch (decision().cause) {
      case decision_t::CAUSE_STALE: return Stale();
      case decision_t::CAUSE_FUTURE: return candidate().utime > decision().utime ? Ahead() : StartsLate();
      case decision_t::CAUSE_TOO_LATE: return TooLate();
      case decision_t::CAUSE_DEADLINE: return Deadline();
      case decision_t::CAUSE_OVERRUN: return Overrun();
      case decision_t::CAUSE_QUEUE_FULL: return QueueFull();
      case decision_t::CAUSE_NO_OBSTACLES: return Silent();
      case decision_t::CAUSE_SHADOW: return Shadow();
      default: return std::nullopt;
    }
  }

 private:
  [[nodiscard]] const decision_t& decision() const { return abstention_.decision; }
  [[nodiscard]] const candidate_plan_t& candidate() const { return abstention_.candidate; }
  [[nodiscard]] const GateOptions& gate() const { return abstention_.task->gate; }

  // By a gate of its own, of a task whose obstacles are all in its file.
  [[nodiscard]] bool IsJudgedBy(Config config, const candidate_plan_t& sent) const {
    config.gate.obstacles = ObstaclesSource::kTask;
    return IsJudged(Gate(config).Decide(Encode(sent), decision().utime).decision);
  }

  [[nodiscard]] std::optional<Remedy> Tried(const std::string& key, double GateOptions::*member, double value,
                                            const std::string& what) const {
    if (!(0 < value && value <= kHourMs)) return std::nullopt;
    Config changed = *abstention_.task;
    changed.gate.*member = value;
    return Remedy{what, IsJudgedBy(changed, candidate()), key, value};
  }

  [[nodiscard]] std::optional<Remedy> Stale() const {
    const double age = Ms(candidate().utime, decision().utime);
    return Tried("gate.max_age_ms", &GateOptions::max_age_ms, age,
                 fmt::format("with gate.max_age_ms of at least {}", RoundedUp(age)));
  }

  [[nodiscard]] std::optional<Remedy> Ahead() const {
    const double ahead = Ms(decision().utime, candidate().utime);
    return Tried("gate.max_ahead_ms", &GateOptions::max_ahead_ms, ahead,
                 fmt::format("with gate.max_ahead_ms of at least {}, if the sender's clock is right and not this one",
                             RoundedUp(ahead)));
  }

  [[nodiscard]] std::optional<Remedy> StartsLate() const {
    const double until_start = Ms(decision().utime, candidate().start_utime);
    return Tried("gate.certificate_lifetime_ms", &GateOptions::certificate_lifetime_ms, until_start,
                 fmt::format("with gate.certificate_lifetime_ms of at least {}", RoundedUp(until_start)));
  }

  // The gate has no say in this: the planner has to begin its plans later.
  [[nodiscard]] std::optional<Remedy> TooLate() const {
    const double needs = Ms(candidate().start_utime, decision().utime) + gate().decision_budget_ms;
    const double period = abstention_.task->robot.step_period_ms;
    if (!(0 < needs && needs <= kHourMs && period > 0)) return std::nullopt;
    const double steps = std::ceil(needs / period), all = abstention_.task->planner.lead_steps + steps;
    candidate_plan_t later = candidate();
    later.start_utime += static_cast<std::int64_t>(std::ceil(steps * period * 1e3));
    return Remedy{
        fmt::format("with planner.lead_steps of at least {}, or sent {} ms earlier", RoundedUp(all), RoundedUp(needs)),
        IsJudgedBy(*abstention_.task, later), "planner.lead_steps", all};
  }

  [[nodiscard]] std::optional<Remedy> Deadline() const {
    const double until_start = Ms(decision().utime, candidate().start_utime);
    return Tried("gate.decision_budget_ms", &GateOptions::decision_budget_ms, until_start,
                 fmt::format("with gate.decision_budget_ms of at most {}, or sent {} ms earlier",
                             RoundedDown(until_start), RoundedUp(gate().decision_budget_ms - until_start)));
  }

  [[nodiscard]] std::optional<Remedy> Overrun() const {
    const double taken = decision().elapsed_us / 1e3;
    if (!(0 < taken && taken <= kHourMs)) return std::nullopt;
    return Remedy{
        fmt::format("with gate.decision_budget_ms of at least {}, if it takes no longer then", RoundedUp(taken)), false,
        "gate.decision_budget_ms", taken};
  }

  [[nodiscard]] std::optional<Remedy> QueueFull() const {
    const std::size_t waiting = abstention_.waiting;
    if (waiting <= static_cast<std::size_t>(gate().queue) || waiting > kLongestQueue) return std::nullopt;
    return Remedy{fmt::format("with gate.queue of at least {}, if the log has every candidate", waiting), false,
                  "gate.queue", static_cast<double>(waiting)};
  }

  // Tried with the rules of the obstacles in force, and the last message before.
  [[nodiscard]] std::optional<Remedy> Silent() const {
    if (!abstention_.last_obstacles) return std::nullopt;
    const auto& [bytes, arrived] = *abstention_.last_obstacles;
    Config changed = *abstention_.task;
    // So long that only the message's own defects count, and not yet its age.
    changed.gate.obstacles_timeout_ms = kHourMs;
    ObstaclesInForce heard(changed);
    if (!heard.Update(bytes, arrived).empty()) return std::nullopt;
    const double silence = Ms(heard.stamp().value_or(decision().utime), decision().utime);
    if (!(gate().obstacles_timeout_ms < silence && silence <= kHourMs)) return std::nullopt;
    changed.gate.obstacles_timeout_ms = silence;
    Gate gate(changed);
    const bool turns = gate.UpdateObstacles(bytes, arrived).empty() &&
                       gate.WhyObstaclesUnknown(decision().utime).empty() &&
                       IsJudged(gate.Decide(Encode(candidate()), decision().utime).decision);
    return Remedy{fmt::format("with gate.obstacles_timeout_ms of at least {}", RoundedUp(silence)), turns,
                  "gate.obstacles_timeout_ms", silence};
  }

  [[nodiscard]] std::optional<Remedy> Shadow() const {
    Config changed = *abstention_.task;
    changed.gate.shadow = false;
    return Remedy{Necessary(decision().cause), IsJudgedBy(changed, candidate())};
  }

  const RecordedAbstention& abstention_;
};

}  // namespace

std::optional<Remedy> RemedyFor(const RecordedAbstention& abstention) {
  if (!abstention.task || abstention.decision.utime == 0) return std::nullopt;
  if (auto found = RemedySearch(abstention).Find()) return found;
  const std::string what = Necessary(abstention.decision.cause);
  return what.empty() ? std::nullopt : std::optional(Remedy{.what = what});
}

}  // namespace forereach
