/** What a page draws, as JSON for page/shared.js. */
#pragma once

#include <vector>

#include <nlohmann/json.hpp>

#include "page/page_data.h"

namespace forereach {

/** An obstacle in the plane each; null for one of another dimension. */
[[nodiscard]] nlohmann::json ToJson(const std::vector<Obstacle>& obstacles);

/** A detail without the polygons of its sketch. */
[[nodiscard]] nlohmann::json ToJson(const PageDetail& detail);

}  // namespace forereach
