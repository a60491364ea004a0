/** The certifier's heartbeat as JSON: of `forereach status`, and of the live page. */
#pragma once

#include <nlohmann/json.hpp>

#include "forereach/certifier_status_t.hpp"

namespace forereach {

/** @param is_signed whether it was authentic. Texts are as they were sent. */
[[nodiscard]] nlohmann::ordered_json ToJson(const certifier_status_t& status, bool is_signed);

}  // namespace forereach
