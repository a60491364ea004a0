#include "bus/bus_options.h"

#include <algorithm>

#include "bus/bus_url.h"

namespace forereach {
namespace {

template <class Load>
std::optional<KeyRing> ReadOr(const BusOptions& options, Load load) {
  if (options.keys) return options.keys;
  return options.key.empty() ? std::nullopt : std::optional(load());
}

bool HoldsAll(const KeyRing& keys) {
  return std::ranges::all_of(kAllRoles, [&](Role role) { return keys.Holds(role); });
}

}  // namespace

std::string BusOptions::bus_name() const {
  if (!name.empty()) return name;
  if (!url.starts_with("udpm://")) return url.substr(0, url.find(':'));
  const MulticastUrl address = ParseMulticastUrl(url);
  return address.group + ":" + std::to_string(address.port);
}

std::optional<KeyRing> KeysOf(const BusOptions& options, Role role) {
  return ReadOr(options, [&] { return LoadKeys(options.key, role); });
}

std::optional<KeyRing> AllKeysOf(const BusOptions& options) {
  return ReadOr(options, [&] { return LoadAllKeys(options.key); });
}

std::optional<KeyRing> PublicKeysOf(const BusOptions& options) {
  const std::optional<KeyRing> keys = ReadOr(options, [&] { return LoadPublicKeys(options.key); });
  return keys ? std::optional(keys->Public()) : std::nullopt;
}

BusOptions WithKeys(BusOptions options, Role role) {
  options.keys = KeysOf(options, role);
  return options;
}

std::string WhyKeyCannotChange(const BusOptions& in_force, const BusOptions& read_again, Role role) try {
  if (in_force.key_is_given) return "";
  const std::string cannot = ": the key cannot change while the process runs";
  if (in_force.key != read_again.key)
    return "bus.key is " + (read_again.key.empty() ? "missing" : read_again.key) + ", it was " +
           (in_force.key.empty() ? "missing" : in_force.key) + cannot;
  const bool all = in_force.keys && HoldsAll(*in_force.keys);
  if ((all ? AllKeysOf(read_again) : KeysOf(read_again, role)) == in_force.keys) return "";
  return "bus.key: " + in_force.key + " holds other keys than at the start" + cannot;
} catch (const KeyError& error) {
  return error.what();
}

}  // namespace forereach
