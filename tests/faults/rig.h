/** The four real processes on a bus of their own, to be hurt and healed, with a witness. */
#pragma once

#include <array>
#include <chrono>
#include <csignal>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "tests/faults/clock_file.h"
#include "tests/faults/perception.h"
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
    std::vector<Obstacle> seen;    ///< Of a task whose gate.obstacles is bus: what is sent.
    bool takes_logs_away = false;  ///< Logs are deleted: the logger may end with 1, and logs be missing.
  };

  /** @param task YAML of the task. */
  explicit Rig(const std::string& task) : Rig(task, Options()) {}
  Rig(const std::string& task, const Options& options);

  void Start(Role role);
  /** One that does not end it. */
  void Signal(Role role, int signal);
  /** Ends it, and forgets it. @param signal SIGKILL, or SIGTERM, which waits until the process is ready. */
  void End(Role role, int signal = SIGTERM);
  /** A second certifier beside the first, and its end by SIGKILL. */
  void StartSecondCertifier();
  void EndSecondCertifier();
  [[nodiscard]] bool SecondCertifierIsAlive() const {
    return second_ && !second_->WaitForEnd(std::chrono::milliseconds(0));
  }
  /** Ends all four, for Heal to start. */
  void EndAll();
  /** The same, and the role has a new key, as `forereach keygen --again` gives it one. The buses and the witness are
  new ones, so who listens has to subscribe again. */
  void MakeKeyAgain(forereach::Role role);
  /** One line for each process that since the last call
      - ended by itself, and is no planner or robot that was at its goal or out of time;
      - ended with an exit status that is not 0, or by a signal that is not End's SIGKILL;
      - did not end within kEndsWithin of End. */
  [[nodiscard]] std::vector<std::string> TakeBadEndings();
  [[nodiscard]] bool IsAlive(Role role) const;
  /** Bytes of memory that it holds; 0 if it is not there. */
  [[nodiscard]] double Resident(Role role) const {
    return processes_[role] ? ResidentBytes(processes_[role]->pid()) : 0;
  }

  /** From now on the wall clock of a process is the machine's plus `offset`. @throws std::runtime_error if the process
  does not look at it. */
  void SetClock(Role role, std::chrono::microseconds offset);
  /** The same for all of them, and for what this one signs. */
  void SetClocks(std::chrono::microseconds offset);

  void Listen(std::chrono::milliseconds time);
  [[nodiscard]] bool ListenUntil(const std::function<bool()>& done, std::chrono::milliseconds patience);

  /** Starts what is dead and the drive of a robot that is silent, resets what is latched, and waits until the certifier
  is OK, the robot executes a plan that was certified since, and the logger records.
  @return empty, or what does not come back. */
  [[nodiscard]] std::string Heal();
  /** Ends the robot's drive and begins another. */
  void DriveAnew();

  /** Events that logs lack, found since the last call: of the present logger's those that it has confirmed, as far as
  was heard; of one before it also those that stood in them when the next was started, once more after that one has
  mended them. What a logger cannot write it does not confirm. */
  [[nodiscard]] std::int64_t TakeLost();
  /** Holds all logs against the databases of their directories (records/check.h). No logger may run.
  @return one entry for each directory in which something is amiss. */
  [[nodiscard]] std::vector<std::string> CheckRecords() const;

  void Command(std::int16_t kind);
  [[nodiscard]] Bus& bus() { return *signed_; }     ///< Signs as every role.
  [[nodiscard]] Bus& open_bus() { return *open_; }  ///< Neither signs nor looks at signatures.
  /** Authentic messages. */
  void Hear(const std::string& channel, Bus::Handler handler) { heard_->Subscribe(channel, std::move(handler)); }
  [[nodiscard]] KeyRing keys() const { return LoadAllKeys(key_path_); }
  [[nodiscard]] Witness& witness() const { return *witness_; }
  [[nodiscard]] Perception& perception() { return *perception_; }
  [[nodiscard]] const Config& config() const { return config_; }
  [[nodiscard]] std::string url(Role role) const { return options_.relayed && role >= kPlanner ? near_url_ : far_url_; }
  [[nodiscard]] const std::string& task_path() const { return task_path_; }
  /** YAML, as the processes were started with it. */
  [[nodiscard]] const std::string& task() const { return task_; }
  /** Of the logger that is started next. */
  [[nodiscard]] const std::string& directory() const { return next_directory_; }
  /** From the logger's next start on. */
  void SetDirectory(const std::string& directory) { next_directory_ = directory; }
  /** What the certifier keeps a fault in, from its next start on. */
  void SetState(const std::string& directory) { state_ = directory; }

 private:
  struct Record {  // of one logger
    std::set<std::string> logs;
    std::int64_t due = 0, lost = 0;  // events that have to be in them, and that were not
  };

  void OpenBuses();
  [[nodiscard]] std::int64_t NowUs() const { return WallClockUs() + clock_offset_us_; }
  [[nodiscard]] std::vector<std::string> UnderClock(Role role);
  void LookAtEnd(Role role);
  void BadEnding(Role role, const std::string& how);
  void LookAtLogs();

  const Options options_;
  ScratchDirectory scratch_;
  const std::string task_;
  bool has_one_key_ring_ = true;
  std::string task_path_, key_path_, near_url_, far_url_, next_directory_, directory_, state_;
  Config config_;
  std::unique_ptr<Bus> heard_, signed_, open_;
  std::unique_ptr<Witness> witness_;
  std::array<std::unique_ptr<ChildProcess>, kRoles> processes_;
  std::unique_ptr<ChildProcess> second_;
  std::unique_ptr<Perception> perception_;
  std::array<int, kRoles> ended_by_{};    // End's signal
  std::array<bool, kRoles> is_judged_{};  // by LookAtEnd
  std::vector<std::string> bad_endings_;
  std::array<std::unique_ptr<ClockFile, UnmapClockFile>, kRoles> clocks_;
  std::int64_t clock_offset_us_ = 0;
  std::set<std::string> directories_, earlier_logs_;  // of all loggers; of loggers before this one
  std::vector<Record> records_;  // of the present logger, the last, and of those before it that TakeLost has yet to see
  std::chrono::steady_clock::time_point drive_began_{};
};

}  // namespace forereach
