/** The record of an event as it lies in a log (records/event_log.h), for files whose events keep their numbers. */
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "lcmtypes/codec.h"

namespace forereach {

/** Adds a record to `out`. @pre the limits of the format, as EventLogReader keeps them. */
void PutRecord(std::vector<std::uint8_t>& out, std::int64_t number, std::int64_t utime, const std::string& channel,
               Bytes data);

}  // namespace forereach
