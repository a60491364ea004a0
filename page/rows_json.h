/** The rows of a page as JSON, for records/finished_runs.h. Drawings are not in it. */
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "page/page_data.h"

namespace forereach {

// Names that nlohmann's get<PageRun>() and assignment look for. Every bit of a number comes back, NaN too.
void to_json(nlohmann::json& json, const PageRun& rows);
/** @throws nlohmann::json::exception for other JSON. */
void from_json(const nlohmann::json& json, PageRun& rows);

}  // namespace forereach
