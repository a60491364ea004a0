/** The keys of a task's bus. */
#pragma once

#include <optional>
#include <string>

#include "bus/keys.h"
#include "certifier/task/config.h"

namespace forereach {

/** What every process says where its task has no key. */
inline constexpr const char* kUnsignedWarning = "UNSIGNED: anyone on this network can move this robot";

/** The keys for a program that speaks as `role`: those already read, or what bus.key names; nothing if it names none.
@throws KeyError if they cannot be used. */
[[nodiscard]] std::optional<KeyRing> KeysOf(const BusOptions& options, Role role);
/** The same for one program that is all processes. */
[[nodiscard]] std::optional<KeyRing> AllKeysOf(const BusOptions& options);
/** The same for who reads logs. */
[[nodiscard]] std::optional<KeyRing> PublicKeysOf(const BusOptions& options);

/** The options with these keys in them. */
[[nodiscard]] BusOptions WithKeys(BusOptions options, Role role);

/** Why a task file that was read again cannot take the place of the one that a process began with: another key, none,
or other content of the same. Empty if it can. Reads the keys of `read_again`. @param role that the process speaks as.
*/
[[nodiscard]] std::string WhyKeyCannotChange(const BusOptions& in_force, const BusOptions& read_again, Role role);

}  // namespace forereach
