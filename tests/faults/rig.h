/** The four real processes on a bus of their own, to be hurt and healed, with a witness. */
#pragma once

#include <array>
#include <chrono>
#include <csignal>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "tests/faults/clock_file.h"
#include "tests/faults/witness.h"
#include "tests/process/process_fixture.h"

namespace forereach {

class Rig final {
 public:
  enum Role { kLogger, kCertifier, kPlanner, kRobot, kRoles };
  static constexpr std::array<const char*, kRoles> kNames{"logger", "certifier", "planner", "robot"};

  struct Options {
    bool relayed = false;          ///< Certifier and logger are on a bus of their own: somebody has to relay.
    bool settable_clocks = false;  ///< SetClock may be called.
  };

  /** @param task YAML of the task. */
  explicit Rig(const std::string& task) : Rig(task, Options()) {}
  Rig(const std::string& task, const Options& options);

  void Start(Role role);
  /** One that does not end it. */
  void Signal(Role role, int signal);
  /** Ends it, and forgets it. @param signal SIGKILL, or SIGTERM, which waits until the process is ready. */
  void End(Role role, int signal = SIGTERM);
  /** Ends all four, for Heal to start. */
  void EndAll();
  /** One line for each process that since the last call
      - ended by itself, and is no planner or robot that was at its goal or out of time;
      - ended with an exit status that is not 0, or by a signal that is not End's SIGKILL;
      - did not end within kEndsWithin of End. */
  [[nodiscard]] std::vector<std::string> TakeBadEndings();
  [[nodiscard]] bool IsAlive(Role role) const;

  /** From now on the wall clock of a process is the machine's plus `offset`. @throws std::runtime_error if the process
  does not look at it. */
  void SetClock(Role role, std::chrono::microseconds offset);
  /** The same for all of them, and for what this one signs. */
  void SetClocks(std::chrono::microseconds offset);

  void Listen(std::chrono::milliseconds time);
  [[nodiscard]] bool ListenUntil(const std::function<bool()>& done, std::chrono::milliseconds patience);

  /** Starts what is dead and the drive of a robot that is silent, resets what is latched, and waits until the certifier is OK
  and certifies again, and the logger records.
  @return empty, or what does not come back. */
  [[nodiscard]] std::string Heal();
  /** Ends the robot's drive and begins another. */
  void DriveAnew();

  /** Events that a logger had confirmed and that its logs do not hold, found since the last call: of the present one,
  and of each before it when the next was started. Nothing while none is heard. What a logger cannot write it does not
  confirm. */
  [[nodiscard]] std::optional<std::int64_t> TakeLost();

  void Command(std::int16_t kind);
  [[nodiscard]] Bus& bus() { return *signed_; }      ///< Signs.
  [[nodiscard]] Bus& open_bus() { return *heard_; }  ///< Does not.
  [[nodiscard]] Witness& witness() { return *witness_; }
  [[nodiscard]] const Config& config() const { return config_; }
  [[nodiscard]] std::string url(Role role) const { return options_.relayed && role >= kPlanner ? near_url_ : far_url_; }
  [[nodiscard]] const std::string& task_path() const { return task_path_; }
  /** From the logger's next start on. */
  void SetDirectory(const std::string& directory) { next_directory_ = directory; }

 private:
  [[nodiscard]] std::int64_t NowUs() const { return WallClockUs() + clock_offset_us_; }
  [[nodiscard]] std::vector<std::string> UnderClock(Role role);
  [[nodiscard]] std::set<std::string> Logs() const;
  void LookAtEnd(Role role);
  void BadEnding(Role role, const std::string& how);
  void CountLost();

  const Options options_;
  ScratchDirectory scratch_;
  std::string task_path_, key_path_, near_url_, far_url_, next_directory_, directory_;
  Config config_;
  std::unique_ptr<Bus> heard_, signed_;
  std::unique_ptr<Witness> witness_;
  std::array<std::unique_ptr<ChildProcess>, kRoles> processes_;
  std::array<int, kRoles> ended_by_{};     // End's signal
  std::array<bool, kRoles> is_judged_{};  // by LookAtEnd
  std::vector<std::string> bad_endings_;
  std::array<std::unique_ptr<ClockFile, UnmapClockFile>, kRoles> clocks_;
  std::int64_t clock_offset_us_ = 0;
  std::set<std::string> earlier_logs_;               // of loggers before this one
  std::int64_t lost_by_this_ = 0, untold_lost_ = 0;  // by the present logger; by all, not taken yet
  std::chrono::steady_clock::time_point drive_began_{};
};

}  // namespace forereach
