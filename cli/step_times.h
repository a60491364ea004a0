/** How far a robot's steps are from their times, and the stamps of messages from their arrival, as messages show it:
what `robot.step_error_ms` and `gate.max_clock_error_ms` have to be at least. It proves nothing of what was not heard.
*/
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace forereach {

class StepTimes final {
 public:
  /** What is proposed is so many times the largest that was measured. */
  static constexpr int kMargin = 2;

  /** @param step_us a step's time by the task. */
  explicit StepTimes(std::int64_t step_us) : step_us_(step_us) {}

  /** A transition: when its step began and how long it took, on the robot's clock. Boundary t of a run of steps, one
  after the other without a gap, is off by the sum of what the steps before it lasted longer than step_us. */
  void HearStep(std::int64_t utime, std::int64_t duration_us);
  /** A robot's state or obstacles. @param arrival_us on the clock of this machine. */
  void HearStamp(std::int64_t utime, std::int64_t arrival_us);

  [[nodiscard]] std::int64_t steps() const { return steps_; }
  [[nodiscard]] std::int64_t stamps() const { return stamps_; }
  /** The largest size of what a boundary is off, us. */
  [[nodiscard]] std::int64_t step_error_us() const { return step_error_us_; }
  /** The least and the largest arrival - stamp, us. */
  [[nodiscard]] std::int64_t least_delay_us() const { return least_delay_us_; }
  [[nodiscard]] std::int64_t largest_delay_us() const { return largest_delay_us_; }

  /** Milliseconds for the task; nothing where no message says it. */
  [[nodiscard]] std::optional<double> StepErrorMs() const;
  /** @param delay_ms bus.delay_ms, by which a message may arrive later. */
  [[nodiscard]] std::optional<double> ClockErrorMs(double delay_ms) const;
  /** Both with what they rest on, for people. @param seconds of listening. */
  [[nodiscard]] std::string Text(double seconds, double delay_ms) const;

 private:
  std::int64_t step_us_;
  std::int64_t steps_ = 0, stamps_ = 0, step_error_us_ = 0, least_delay_us_ = 0, largest_delay_us_ = 0;
  std::optional<std::int64_t> next_utime_;  // of the run's next step
  std::int64_t off_us_ = 0;                 // at that boundary
};

}  // namespace forereach
