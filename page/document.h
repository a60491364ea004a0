/** An HTML document that needs no network: its style, scripts and data are in it, and its policy allows no other. */
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "page/assets.h"

namespace forereach {

struct PageDocument {
  std::string title;
  const PageAsset& body;
  std::vector<const PageAsset*> styles, scripts;
  /** What it may request beside: "'none'", or "'self'" for its own server. */
  std::string connect = "'none'";

  /** Its Content-Security-Policy. */
  [[nodiscard]] std::string Policy() const;
  /** @param data for the scripts, which find it as JSON in the element "data". No tag begins in it. Each of its
  binary values (page/columns.h) is in an element "column" of its own, and the JSON has its place among these: a browser
  reads small elements faster than a large one, and a script those that it needs. */
  [[nodiscard]] std::string Html(nlohmann::json data) const;
};

}  // namespace forereach
