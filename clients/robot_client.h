/** A robot's end of the bus: it executes certified plans of one task and nothing else. What a robot of your own links:
ForeReach::robot_client.

It is the Supervisor (robot/supervisor.h) on a bus of its own. Sizes, digests, domain, angles, channels and the key come
from the task file. A robot that brings its own LCM, or reads no files, links ForeReach::supervisor instead. Only the
thread that made it may use it.

    class Mower final : public RobotClient::Robot { state(), Hold(), StepsToRest(...) };
    RobotClient client({"task.yaml", "keys"}, mower);
    for (std::int64_t boundary = now;; boundary += client.step_us()) {
      client.Listen(boundary);
      ... apply client.Boundary(boundary), or hold if it is empty
    }
*/
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>

#include "clients/client_options.h"
#include "forereach/certify/problem.h"
#include "robot/supervisor.h"

namespace forereach {

struct Config;
class OpenedBus;

class RobotClient final {
 public:
  /** The robot. It is called only from within a call of the client, whose bus sends its reports. */
  class Robot : public Supervisor::Robot {
   public:
    void Send(const std::string& channel, Bytes message) final;
    /** A person asks for the task to be read again: call RobotClient::ReloadTask when there is time for that. */
    void Reload() override {}

   private:
    friend class RobotClient;
    const OpenedBus* bus_ = nullptr;
  };

  /** @param robot outlives this object. @throws BadInput, with one line for people, if task, key or bus cannot be
  used. */
  RobotClient(const ClientOptions& options, Robot& robot);
  /** The same of a task that was read before. @param around opened_bus.h. */
  RobotClient(const Config& task, const ClientOptions& instead, Robot& robot,
              const std::function<void(const std::function<void()>&)>& around);
  ~RobotClient();

  [[nodiscard]] const Problem& problem() const;
  [[nodiscard]] std::int64_t step_us() const;
  /** Whether it has a key. */
  [[nodiscard]] bool is_signed() const;

  /** Takes plans, withdrawals, faults and commands until this time, microseconds since the Unix epoch, or until
  `done`. */
  void Listen(
      std::int64_t until_utime, const std::function<bool()>& done = [] { return false; });
  /** Supervisor::Boundary, with the time by the wall clock. */
  std::span<const double> Boundary(std::int64_t utime, bool ends = false);
  /** Reads the task file again, which takes as long as the files are: plans under it are accepted, too.
  @throws BadInput; then nothing has changed. */
  void ReloadTask();
  /** The same of a task that was read before. */
  void Expect(const Config& task);
  /** Its counts, its control, whether it is halted. @throws std::runtime_error in another thread. */
  [[nodiscard]] Supervisor& supervisor();

 private:
  struct Core;
  const std::unique_ptr<Core> core_;
};

}  // namespace forereach
