/** The key of a task's bus. */
#pragma once

#include <optional>

#include "certifier/task/config.h"
#include "lcmtypes/authentic.h"

namespace forereach {

/** The key that bus.key names; nothing if it names none. @throws KeyError if it cannot be read. */
[[nodiscard]] inline std::optional<Key256> KeyOf(const BusOptions& options) {
  return options.key.empty() ? std::nullopt : std::optional(LoadKey(options.key));
}

}  // namespace forereach
