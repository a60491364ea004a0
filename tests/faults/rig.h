/** The four real processes on a bus of their own, to be hurt and healed, with a witness. */
#pragma once

#include <array>
#include <chrono>
#include <functional>
#include <memory>
#include <string>

#include "tests/faults/witness.h"
#include "tests/process/process_fixture.h"

namespace forereach {

class Rig final {
 public:
  enum Role { kLogger, kCertifier, kPlanner, kRobot, kRoles };
  static constexpr std::array<const char*, kRoles> kNames{"logger", "certifier", "planner", "robot"};

  /** @param task YAML of the task. @param relayed certifier and logger on a bus of their own: somebody has to relay. */
  Rig(const std::string& task, bool relayed = false);
  ~Rig();

  void Start(Role role);
  void Signal(Role role, int signal);
  /** Waits for its end, and forgets it. @return true if it ended. */
  bool Reap(Role role);
  [[nodiscard]] bool IsAlive(Role role) const;

  void Listen(std::chrono::milliseconds time);
  [[nodiscard]] bool ListenUntil(const std::function<bool()>& done, std::chrono::milliseconds patience);

  /** Starts what is dead, resets what is latched, and waits until the certifier is OK and decides again.
  @return empty, or what does not come back. */
  [[nodiscard]] std::string Heal();
  /** Ends the robot's drive and begins another. */
  void DriveAnew();

  /** After the logger was hurt: events that it had confirmed and that its log does not hold. */
  [[nodiscard]] std::int64_t LostByLogger() const;

  void Command(std::int16_t kind);
  [[nodiscard]] Bus& bus() { return *signed_; }      ///< Signs.
  [[nodiscard]] Bus& open_bus() { return *heard_; }  ///< Does not.
  [[nodiscard]] Witness& witness() { return *witness_; }
  [[nodiscard]] const Config& config() const { return config_; }
  [[nodiscard]] std::string url(Role role) const { return relayed_ && role >= kPlanner ? near_url_ : far_url_; }
  [[nodiscard]] const std::string& task_path() const { return task_path_; }
  /** From the logger's next start on. */
  void SetDirectory(const std::string& directory) { directory_ = directory; }

 private:
  const bool relayed_;
  ScratchDirectory scratch_;
  std::string task_path_, key_path_, near_url_, far_url_, directory_;
  Config config_;
  std::unique_ptr<Bus> heard_, signed_;
  std::unique_ptr<Witness> witness_;
  std::array<std::unique_ptr<ChildProcess>, kRoles> processes_;
  std::chrono::steady_clock::time_point drive_began_{};
};

}  // namespace forereach
