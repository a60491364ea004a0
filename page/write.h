/** The page as HTML. */
#pragma once

#include <string>

#include "page/page_data.h"

namespace forereach {

/** One document that needs no network: its style, scripts and data are in it, and its policy forbids every request. All
texts of the run are data of the scripts, which show them as text.
@param before its figures are shown beside those of `run`. */
[[nodiscard]] std::string PageHtml(const PageRun& run, const PageRun* before = nullptr);

}  // namespace forereach
