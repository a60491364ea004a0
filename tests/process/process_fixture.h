/** What tests of processes share: a bus of their own, a task file, candidates for it, and an ear on the bus. */
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "bus/bus.h"
#include "forereach/candidate_plan_t.hpp"
#include "task/config.h"
#include "tests/paths.h"
#include "tests/process/child_process.h"

namespace forereach {

/** A multicast port that no other running test has: it is made of this process's number. */
[[nodiscard]] std::string PrivateBusUrl();

/** Of a process, this one too. */
[[nodiscard]] double ResidentBytes(pid_t pid);

/** The shipped point mass with a goal, a robot that steps every 100 ms from rest at the origin, and a gate that bears
with a slow machine and does without a robot: candidates may be 20 s old. Its state is kept beside the task file. The
robot finishes after `time_limit_s`. */
[[nodiscard]] std::string PatientTask(int time_limit_s = 60);

/** Hears channels and keeps the messages that come, without their signatures, which it does not check. Fails with the
advice of BusError if the bus cannot be opened. */
class BusProbe final {
 public:
  BusProbe(const std::string& url, const std::vector<std::string>& channels);

  [[nodiscard]] Bus& bus() { return *bus_; }

  /** Listens until `done`, which is asked after every few messages; false once kPatience has passed. */
  [[nodiscard]] bool WaitUntil(const std::function<bool()>& done);
  void ListenFor(std::chrono::milliseconds time);

  [[nodiscard]] const std::vector<std::vector<std::uint8_t>>& heard(const std::string& channel) const {
    return heard_.at(channel);
  }
  /** Everything heard on a channel so far. @throws std::runtime_error, which fails the test, if something is not a
  Message. */
  template <class Message>
  [[nodiscard]] std::vector<Message> Heard(const std::string& channel) const;

 private:
  std::map<std::string, std::vector<std::vector<std::uint8_t>>> heard_;
  std::unique_ptr<Bus> bus_;
};

/** A candidate of the task, of `steps` times the same control, stamped now and starting in `lead`. */
[[nodiscard]] candidate_plan_t CandidateFor(const Config& config, std::int64_t plan_id, const Eigen::VectorXd& control,
                                            int steps = 6, std::chrono::milliseconds lead = std::chrono::seconds(20));

[[noreturn]] void ThrowNotA(const char* type, const std::string& channel);

template <class Message>
std::vector<Message> BusProbe::Heard(const std::string& channel) const {
  std::vector<Message> messages;
  for (const auto& bytes : heard(channel)) {
    if (Decode(bytes, messages.emplace_back()) != DecodeStatus::kOk) ThrowNotA(Message::getTypeName(), channel);
  }
  return messages;
}

}  // namespace forereach
