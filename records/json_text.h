/** JSON documents as text. */
#pragma once

#include <string>

#include <nlohmann/json.hpp>

namespace forereach {

/** Of a document that names channels or files, which may have any bytes: what is no UTF-8 is replaced.
On one line, or with an indent. */
[[nodiscard]] inline std::string JsonText(const nlohmann::json& json, int indent = -1) {
  return json.dump(indent, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace forereach
