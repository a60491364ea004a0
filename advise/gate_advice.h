/** What would have helped a candidate that was answered without a judgement. */
#pragma once

#include <optional>
#include <string>

#include "advise/abstentions.h"

namespace forereach {

struct Remedy {
  /** A clause that continues "it would be judged " or "it might be judged ". */
  std::string what;
  /** True if a gate of its own judges the candidate with it: certified, F, D or S. Otherwise it is necessary, and the
  log does not say whether it is enough. */
  bool turns = false;
  /** The key of the task file that it is about, and the value that the key needs at least or at most, in the key's
  unit; empty if it is about none. */
  std::string key = {};
  double value = 0;
};

/** For every cause of decision_t but those of a judgement (F, D, S) and second_certifier, which is not sent. Nothing
for those, and for a decision that was read from a document. */
[[nodiscard]] std::optional<Remedy> RemedyFor(const RecordedAbstention& abstention);

}  // namespace forereach
