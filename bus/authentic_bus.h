/** A bus that signs sent messages and delivers only authentic ones. */
#pragma once

#include <memory>
#include <string>

#include "bus/authentic.h"
#include "bus/bus.h"

namespace forereach {

/** The screen of a signed bus: it admits authentic messages, without their trailer, and signs what is sent. It accepts
nothing that was signed before this call. @param clock for the counters. */
[[nodiscard]] std::shared_ptr<Screen> MakeKeyScreen(const KeyRing& keys, const std::string& bus_name,
                                                    const Speakers& speakers, Clock clock);

/** Opens a bus (bus.h). On every channel of `speakers`, Publish signs as the channel's role and returns false if `keys`
lack its secret. Handlers receive only authentic messages, without their trailer; refused messages are counted
(Bus::refusals). Other channels carry messages unchanged.
@param bus_name is part of every signature. @param clock for the counters and for memq. @throws BusError as OpenBus. */
[[nodiscard]] std::unique_ptr<Bus> OpenSignedBus(const std::string& url, const KeyRing& keys,
                                                 const std::string& bus_name, const Speakers& speakers,
                                                 Clock clock = WallClockUs);

}  // namespace forereach
