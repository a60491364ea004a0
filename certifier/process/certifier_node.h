/** The certifier on a bus: candidates and obstacles in; decisions, certified plans and a heartbeat out.

Messages are queued as they arrive and worked off in order by Tick. At most `gate.queue` candidates are certified in one
go: where more have arrived, the oldest are answered with a rejection, so that the newest are not kept waiting.

An answer goes out before anything is counted or logged: first the certified plan, which the robot waits for, then the
decision, so a planner that hears of a certificate knows that the plan was handed to the bus before. */
#pragma once

#include <array>
#include <deque>
#include <vector>

#include "certifier/gate/gate.h"
#include "lcmtypes/node.h"

namespace forereach {

class CertifierNode final : public Node {
 public:
  static constexpr std::int64_t kHeartbeatUs = 500'000;

  CertifierNode(const Config& config, Bus& bus);

  void Tick(std::int64_t now_us) override;
  /** Prints the counts as one line of JSON on standard output. */
  void Stop() override;

  [[nodiscard]] const Gate& gate() const { return gate_; }

 private:
  struct Pending {
    bool is_candidate;
    std::vector<std::uint8_t> bytes;
  };

  void Work(const Pending& pending, std::int64_t now_us, bool displaced);
  void Heartbeat(std::int64_t now_us);
  [[nodiscard]] double ElapsedPercentile(double fraction) const;

  const BusOptions channels_;
  const std::size_t queue_size_;
  Sender sender_;
  Gate gate_;
  std::deque<Pending> queue_;
  std::size_t waiting_candidates_ = 0;
  std::int64_t next_heartbeat_us_ = 0, heartbeats_ = 0, refused_obstacles_ = 0;
  std::array<double, 1024> elapsed_us_{};  // of the last decisions, a ring
  std::size_t decided_ = 0;
};

}  // namespace forereach
