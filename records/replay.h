/** A recorded log through the same gate again, on the log's own clock. */
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "certifier/task/config.h"
#include "records/log_trust.h"

namespace forereach {

struct ReplayResult {
  std::int64_t candidates = 0;  ///< In the log.
  std::int64_t agreed = 0;      ///< Same outcome, step, cause and digests as recorded.
  /** Recorded as displaced, out of time, not armed, without known obstacles, in fault: a matter of the moment and not
  of the plan, not compared. */
  std::int64_t circumstances = 0;
  std::int64_t corruptions = 0;  ///< Damaged places in the log.
  PassedOver passed_over;
  /** One line for each decision that differs, each candidate without a recorded decision, each recorded decision
  without a candidate, and each way in which the seal of a certified plan does not hold. */
  std::vector<std::string> differences;
};

/** Feeds the candidates of logs that follow one another to a new gate, each at the time of its recorded decision and
with the obstacles and executed transitions that the decision names by their digests, and compares what it says;
certified plans have to be sealed (lcmtypes/seal.h). A certifier that was started again, or reloaded, within the logs
begins with a new gate here too. With bus.key only authentic messages count. Each decision is held against the task of
its own config digest, and one of another digest differs; with one task alone each is held against that.
@param tasks at least one; channels and key are those of the first.
@throws LogError if a log cannot be read, KeyError if the key cannot, std::invalid_argument as Certifier does. */
[[nodiscard]] ReplayResult Replay(const std::vector<std::string>& logs, const std::vector<Config>& tasks);

}  // namespace forereach
