/** What a person sends to clear a fault. */
#pragma once

#include <cstdint>

#include "forereach/command_t.hpp"

namespace forereach {

inline command_t ResetAt(std::int64_t utime) {
  command_t command{.utime = utime, .kind = command_t::RESET};
  return command;
}

}  // namespace forereach
