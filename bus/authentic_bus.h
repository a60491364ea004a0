/** A bus that signs what it sends, and hands out what the right role has signed. */
#pragma once

#include <memory>
#include <string>

#include "bus/authentic.h"
#include "bus/bus.h"

namespace forereach {

/** Opens a bus (bus.h). On every channel of `speakers`, Publish signs as that role, and returns false where `keys` do
not hold its secret; handlers get authentic messages only, without their trailer, and what is refused is counted
(Bus::refusals). Other channels pass as they are.
@param bus_name is part of every signature. @param clock of the counters, and of memq. @throws BusError. */
[[nodiscard]] std::unique_ptr<Bus> OpenSignedBus(const std::string& url, const KeyRing& keys,
                                                 const std::string& bus_name, const Speakers& speakers,
                                                 Clock clock = WallClockUs);

}  // namespace forereach
