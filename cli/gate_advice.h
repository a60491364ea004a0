/** Answers that are about time, order and silence: the setting of the gate, and the value, that would have held. */
#pragma once

#include <optional>
#include <string>

#include "cli/abstentions.h"

namespace forereach {

/** The key of the task file that would have let a candidate in, and the value that it needs at least or at most. */
struct Setting {
  std::string key;
  double value;      ///< In the key's unit.
  std::string what;  ///< A clause with key and value that continues "it would be judged ".
  /** True if a gate with this value gives another answer to the candidate. Otherwise the value is necessary, and the
  log does not say whether it is enough. */
  bool turns;
};

/** For the causes stale, future, too_late, deadline, overrun, queue_full and no_obstacles. Nothing for another cause,
if the log does not have what the answer was about, or if no value of the key would do. */
[[nodiscard]] std::optional<Setting> SettingFor(const RecordedAbstention& abstention);

}  // namespace forereach
