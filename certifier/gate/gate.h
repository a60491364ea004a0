/** The gate: a candidate's bytes and a clock in, exactly one decision out. No bus, no wall clock, no thread in it.

Whatever is not a proof is an abstention or a rejection: bytes that are no candidate, one that is stale, stamped ahead of
the clock, too late for its own start, a repetition, of wrong size or not finite, and any error inside. */
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "certifier/certify/certifier.h"
#include "certifier/gate/freshness.h"
#include "certifier/task/config.h"
#include "forereach/candidate_plan_t.hpp"
#include "forereach/certified_plan_t.hpp"
#include "forereach/certifier_status_t.hpp"
#include "forereach/decision_t.hpp"
#include "lcmtypes/codec.h"

namespace forereach {

/** A decision and, only with a certificate, the certified plan. */
struct GateAnswer {
  decision_t decision{};
  std::optional<certified_plan_t> certified;
};

class Gate final {
 public:
  static constexpr std::size_t kMaxSources = 16;

  /** @throws std::invalid_argument as Certifier does. */
  explicit Gate(const Config& config);

  [[nodiscard]] const Certifier& certifier() const { return certifier_; }
  [[nodiscard]] const std::vector<Obstacle>& obstacles() const { return obstacles_; }
  /** The tube of the last candidate that reached the certifier. */
  [[nodiscard]] const Tube& tube() const { return tube_; }

  /** Decides on one candidate. Never throws: an exception becomes a rejection. Both messages are complete but for
  elapsed_us, which the caller measures. @param now_us microseconds since the Unix epoch. */
  [[nodiscard]] GateAnswer Decide(Bytes candidate, std::int64_t now_us) noexcept;

  /** Rejects a candidate unread, because newer ones displaced it from the queue. */
  [[nodiscard]] GateAnswer Displace(Bytes candidate, std::int64_t now_us) noexcept;

  /** Replaces the obstacles by those of an obstacles_t. Whole or not at all: returns what is wrong with the message, and
  the obstacles in force stay, or an empty text. */
  [[nodiscard]] std::string UpdateObstacles(Bytes message, std::int64_t now_us);

  /** Counts so far and the digests in force; the percentiles are the caller's. */
  [[nodiscard]] certifier_status_t Status(std::int64_t now_us) const;

 private:
  struct Rejection {
    std::int16_t cause;
    std::string why;
  };

  [[nodiscard]] GateAnswer Answer(Bytes candidate, std::int64_t now_us, bool displaced);
  [[nodiscard]] std::optional<Rejection> Admit(Bytes bytes, candidate_plan_t& candidate, std::int64_t now_us);
  [[nodiscard]] std::optional<Rejection> CheckContent(const candidate_plan_t& candidate) const;
  [[nodiscard]] std::optional<Rejection> CheckTimes(const candidate_plan_t& candidate, std::int64_t now_us) const;
  [[nodiscard]] std::optional<Rejection> CheckSource(const candidate_plan_t& candidate);
  void Certify(const candidate_plan_t& candidate, GateAnswer& answer);
  /** Fills and seals a message of zeros. */
  void Attest(const candidate_plan_t& candidate, const decision_t& decision, certified_plan_t& certified);
  void Count(std::int16_t outcome);

  template <class Message>
  void SetDigests(Message& message) const;

  Certifier certifier_;
  GateOptions options_;
  Digest config_digest_, model_digest_, declaration_digest_, observations_digest_, obstacles_digest_;
  std::vector<Obstacle> obstacles_;
  std::int64_t last_obstacles_sequence_ = -1;
  std::map<std::string, std::int64_t> last_plan_id_;  // of each source
  std::int64_t decisions_ = 0, certificates_ = 0;
  certifier_status_t counts_{};
  Tube tube_;
};

}  // namespace forereach
