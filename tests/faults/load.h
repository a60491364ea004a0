/** A steady load for a certifier: signed candidates, one at each of its times, and what becomes of each. They are sent
by a thread of its own, so nothing that is done with the answers delays the next. */
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "bus/bus.h"
#include "forereach/candidate_plan_t.hpp"
#include "forereach/certifier_status_t.hpp"
#include "task/config.h"

namespace forereach {

class Load final {
 public:
  /** The content of the candidate with this number; times, plan_id and sequence are this class's. */
  using Make = std::function<candidate_plan_t(std::int64_t number)>;

  /** On the task's bus, signed with its key. */
  Load(const Config& config, Make make);
  ~Load();

  /** Hears what else is of interest; to be used before Begin. */
  [[nodiscard]] Bus& bus() { return *bus_; }

  /** Sends until an answer comes: all losses from here on are seen as gaps. @throws std::runtime_error after 30 s. */
  void Begin();
  /** Sends `rate` candidates a second from now on. Where it is kept from sending for more than 50 ms, those are left
  out. */
  void Start(double rate);
  void ListenUntil(std::int64_t steady_us);
  /** Sends no more; waits for what is still to come, and for a heartbeat of the certifier from after it. */
  void Finish();

  [[nodiscard]] std::int64_t sent() const { return sent_ - first_; }
  /** Candidates answered; and answers beyond the first to a candidate. */
  [[nodiscard]] std::int64_t answered() const { return answered_; }
  [[nodiscard]] std::int64_t answered_again() const { return answered_again_; }
  /** Decisions that were sent and not heard here, by gaps in their sequence. */
  [[nodiscard]] std::int64_t answers_lost() const { return last_decision_ - first_decision_ + 1 - decisions_; }
  /** Microseconds from each candidate's stamp, before it is encoded and signed, to the kernel's of its answer; since
  the last call. */
  [[nodiscard]] std::vector<double> TakeLatencies() { return std::exchange(latencies_, {}); }
  /** By how many microseconds the sender's thread woke up too late, each time since the last call: what the machine
  does to a thread that only sleeps. */
  [[nodiscard]] std::vector<double> TakeLateness();
  [[nodiscard]] const certifier_status_t& status() const { return status_; }

 private:
  void Send();
  void SendUntilStopped(double rate);
  void OnDecision(const Received& received);
  [[nodiscard]] bool IsAnswered(std::int64_t number) const;

  const Config config_;
  const Make make_;
  const std::unique_ptr<Bus> bus_;
  const std::int64_t base_id_;
  std::int64_t first_ = 0;  // number of the first candidate that was answered
  std::atomic<std::int64_t> sent_ = 0;
  std::vector<bool> is_answered_;  // by number
  std::int64_t answered_ = 0, answered_again_ = 0;
  std::int64_t decisions_ = 0, first_decision_ = 0, last_decision_ = -1;
  std::vector<double> latencies_;
  std::mutex lateness_mutex_;
  std::vector<double> lateness_;
  certifier_status_t status_{};
  std::atomic<bool> stop_ = false;
  std::thread sender_;
};

/** Nearest rank; 0 without values. */
[[nodiscard]] double Percentile(std::vector<double>& values, double fraction);

}  // namespace forereach
