/** Reads event logs for an export, record by record: each decision with its candidate. It keeps no more than the last
candidates without a decision, whatever the length of the logs. */
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bus/bus_options.h"
#include "forereach/candidate_plan_t.hpp"
#include "forereach/certified_plan_t.hpp"
#include "forereach/withdrawal_t.hpp"
#include "records/event_log.h"
#include "records/interpreter.h"
#include "records/log_survey.h"
#include "records/log_trust.h"
#include "records/rows.h"
#include "records/undecided.h"

namespace forereach {

/** Receives records in the order of the logs. */
class RecordUser {
 public:
  RecordUser() = default;
  virtual ~RecordUser() = default;
  RecordUser(const RecordUser&) = delete;
  RecordUser& operator=(const RecordUser&) = delete;

  virtual void OnMessage(const LogEvent&) {}  ///< Every authentic message, before the calls that it causes.
  /** @param candidate null if the log lacks it, or it is no candidate_plan_t. */
  virtual void OnDecision(const DecisionRow&, const candidate_plan_t* /*candidate*/) {}
  virtual void OnCertified(const certified_plan_t&, const LogReference&) {}
  virtual void OnWithdrawn(const withdrawal_t&, const LogReference&) {}  ///< Without its repetitions.
  virtual void OnExecution(const EventRow&) {}
  virtual void OnGap(const GapRow&) {}
};

class RecordReader final {
 public:
  /** @param user must outlive the reader. @param on_bytes is told of the bytes of each event; may be empty.
  @throws KeyError if the key cannot be read. */
  RecordReader(const BusOptions& channels, RecordUser& user, std::function<void(std::int64_t)> on_bytes = {});

  /** Reads consecutive event logs of one run. @throws LogError if one cannot be read. */
  void Read(const std::vector<std::string>& logs);

  [[nodiscard]] const LogDamage& damage() const { return damage_; }
  /** Whether a message was one of ForeReach's. */
  [[nodiscard]] bool has_messages() const { return has_messages_; }
  [[nodiscard]] PassedOver passed_over() const { return {authenticator_.refusals(), undecodable_}; }

 private:
  static constexpr std::size_t kCandidates = 1024;  // undecided

  void Take(const LogEvent& event, const std::string& log_file);
  void TakeWithdrawal(const LogEvent& event, const std::string& log_file);

  const BusOptions channels_;
  RecordUser& user_;
  const std::function<void(std::int64_t)> on_bytes_;
  LogAuthenticator authenticator_;
  std::optional<Interpreter> interpreter_;                        // given authentic events only
  Undecided<std::vector<std::uint8_t>> candidates_{kCandidates};  // as they were sent
  RepeatedWithdrawals withdrawals_;
  LogDamage damage_;
  std::int64_t undecodable_ = 0;
  bool has_messages_ = false;
};

}  // namespace forereach
