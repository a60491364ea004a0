#include "cli/gate_advice.h"

#include <cmath>

#include "certifier/gate/gate.h"
#include "certifier/gate/obstacles_in_force.h"
#include "certifier/numerics/text.h"

namespace forereach {
namespace {

constexpr double kHourMs = 3'600'000;  // the most that these keys take
constexpr std::size_t kLongestQueue = 65536;

// In doubles: a log may hold any stamps, and those of this age are exact.
double Ms(std::int64_t from, std::int64_t to) { return (static_cast<double>(to) - static_cast<double>(from)) / 1e3; }

class TimeAdvice final {
 public:
  explicit TimeAdvice(const RecordedAbstention& abstention) : abstention_(abstention) {}

  [[nodiscard]] std::optional<Setting> Find() const {
    switch (decision().cause) {
      case decision_t::CAUSE_STALE: return Stale();
      case decision_t::CAUSE_FUTURE: return candidate().utime > decision().utime ? Ahead() : StartsLate();
      case decision_t::CAUSE_TOO_LATE: return TooLate();
      case decision_t::CAUSE_DEADLINE: return Deadline();
      case decision_t::CAUSE_OVERRUN: return Overrun();
      case decision_t::CAUSE_QUEUE_FULL: return QueueFull();
      case decision_t::CAUSE_NO_OBSTACLES: return Silent();
      default: return std::nullopt;
    }
  }

 private:
  [[nodiscard]] const decision_t& decision() const { return abstention_.decision; }
  [[nodiscard]] const candidate_plan_t& candidate() const { return abstention_.candidate; }
  [[nodiscard]] const GateOptions& gate() const { return abstention_.task->gate; }

  // The answer of a gate of its own, with another value of a key or another candidate.
  [[nodiscard]] bool IsAnsweredOtherwise(const Config& config, const candidate_plan_t& sent) const {
    return Gate(config).Decide(Encode(sent), decision().utime).decision.cause != decision().cause;
  }

  [[nodiscard]] std::optional<Setting> Tried(const std::string& key, double GateOptions::*member, double value,
                                             const std::string& what) const {
    if (!(0 < value && value <= kHourMs)) return std::nullopt;
    Config changed = *abstention_.task;
    changed.gate.*member = value;
    return Setting{key, value, what, IsAnsweredOtherwise(changed, candidate())};
  }

  [[nodiscard]] std::optional<Setting> Stale() const {
    const double age = Ms(candidate().utime, decision().utime);
    return Tried("gate.max_age_ms", &GateOptions::max_age_ms, age,
                 "with gate.max_age_ms of at least " + RoundedUp(age));
  }

  [[nodiscard]] std::optional<Setting> Ahead() const {
    const double ahead = Ms(decision().utime, candidate().utime);
    return Tried(
        "gate.max_ahead_ms", &GateOptions::max_ahead_ms, ahead,
        "with gate.max_ahead_ms of at least " + RoundedUp(ahead) + ", if the sender's clock is right and not this one");
  }

  [[nodiscard]] std::optional<Setting> StartsLate() const {
    const double until_start = Ms(decision().utime, candidate().start_utime);
    return Tried("gate.certificate_lifetime_ms", &GateOptions::certificate_lifetime_ms, until_start,
                 "with gate.certificate_lifetime_ms of at least " + RoundedUp(until_start));
  }

  // The gate has no say in this: the planner has to begin its plans later.
  [[nodiscard]] std::optional<Setting> TooLate() const {
    const double needs = Ms(candidate().start_utime, decision().utime) + gate().decision_budget_ms;
    const double period = abstention_.task->robot.step_period_ms;
    if (!(0 < needs && needs <= kHourMs && period > 0)) return std::nullopt;
    const double steps = std::ceil(needs / period);
    candidate_plan_t later = candidate();
    later.start_utime += static_cast<std::int64_t>(std::ceil(steps * period * 1e3));
    return Setting{"planner.lead_steps", abstention_.task->planner.lead_steps + steps,
                   "with planner.lead_steps of at least " + RoundedUp(abstention_.task->planner.lead_steps + steps) +
                       ", or sent " + RoundedUp(needs) + " ms earlier",
                   IsAnsweredOtherwise(*abstention_.task, later)};
  }

  [[nodiscard]] std::optional<Setting> Deadline() const {
    const double until_start = Ms(decision().utime, candidate().start_utime);
    return Tried("gate.decision_budget_ms", &GateOptions::decision_budget_ms, until_start,
                 "with gate.decision_budget_ms of at most " + RoundedDown(until_start) + ", or sent " +
                     RoundedUp(gate().decision_budget_ms - until_start) + " ms earlier");
  }

  [[nodiscard]] std::optional<Setting> Overrun() const {
    const double taken = decision().elapsed_us / 1e3;
    if (!(0 < taken && taken <= kHourMs)) return std::nullopt;
    return Setting{"gate.decision_budget_ms", taken,
                   "with gate.decision_budget_ms of at least " + RoundedUp(taken) + ", if it takes no longer then",
                   false};
  }

  [[nodiscard]] std::optional<Setting> QueueFull() const {
    const std::size_t waiting = abstention_.waiting;
    if (waiting <= static_cast<std::size_t>(gate().queue) || waiting > kLongestQueue) return std::nullopt;
    return Setting{"gate.queue", static_cast<double>(waiting),
                   "with gate.queue of at least " + std::to_string(waiting) + ", if the log has every candidate",
                   false};
  }

  // Tried with the rules of the obstacles in force, and the last message before.
  [[nodiscard]] std::optional<Setting> Silent() const {
    if (!abstention_.last_obstacles) return std::nullopt;
    const auto& [bytes, arrived] = *abstention_.last_obstacles;
    Config changed = *abstention_.task;
    changed.gate.obstacles_timeout_ms = kHourMs;
    ObstaclesInForce heard(changed);
    if (!heard.Update(bytes, arrived).empty()) return std::nullopt;
    const double silence = Ms(heard.stamp().value_or(decision().utime), decision().utime);
    if (!(gate().obstacles_timeout_ms < silence && silence <= kHourMs)) return std::nullopt;
    changed.gate.obstacles_timeout_ms = silence;
    ObstaclesInForce again(changed);
    const bool holds = again.Update(bytes, arrived).empty() && again.WhyUnknown(decision().utime).empty();
    return Setting{"gate.obstacles_timeout_ms", silence,
                   "with gate.obstacles_timeout_ms of at least " + RoundedUp(silence), holds};
  }

  const RecordedAbstention& abstention_;
};

}  // namespace

std::optional<Setting> SettingFor(const RecordedAbstention& abstention) {
  if (!abstention.task || abstention.decision.utime == 0) return std::nullopt;
  return TimeAdvice(abstention).Find();
}

}  // namespace forereach
