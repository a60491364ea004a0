/** A bus that signs what it sends and refuses what is not signed, on the channels that make a robot move. */
#pragma once

#include <memory>
#include <set>
#include <string>

#include "lcmtypes/authentic.h"
#include "lcmtypes/bus.h"

namespace forereach {

/** On every channel of `protected_channels`, Publish signs with `key`, and handlers get authentic messages only, without
their signature; what is refused is counted (Bus::refusals). Other channels pass as they are.
@param name says who speaks. @param clock of the counters. */
[[nodiscard]] std::unique_ptr<Bus> Authenticate(std::unique_ptr<Bus> bus, const Key256& key, const std::string& name,
                                                std::set<std::string> protected_channels, Clock clock = WallClockUs);

}  // namespace forereach
