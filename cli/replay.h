/** A recorded log through the same gate again, on the log's own clock. */
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "certifier/task/config.h"

namespace forereach {

struct ReplayResult {
  std::int64_t candidates = 0;   ///< Fed to the gate.
  std::int64_t agreed = 0;       ///< Same outcome, step, cause and digests as recorded.
  std::int64_t displaced = 0;    ///< Recorded as displaced from a full queue: a matter of timing, not compared.
  std::int64_t corruptions = 0;  ///< Damaged places in the log.
  /** One line for each decision that differs, each candidate without a recorded decision, each recorded decision
  without a candidate, and each way in which the seal of a certified plan does not hold. */
  std::vector<std::string> differences;
};

/** Feeds candidates and obstacles of logs that follow one another, in their order and at the times it recorded them, to a new gate, and compares
each decision with the recorded one of the same bytes; certified plans have to be sealed (lcmtypes/seal.h). A certifier that
was started again within the logs begins with a new gate here too.
@throws LogError if a log cannot be read, std::invalid_argument as Certifier does. */
[[nodiscard]] ReplayResult Replay(const std::vector<std::string>& logs, const Config& config);

}  // namespace forereach
