/** Files of the page, embedded when the program is built (page/embed.cmake). */
#pragma once

#include <string_view>

namespace forereach {

struct PageAsset {
  std::string_view text;
  std::string_view sha256;  ///< In hexadecimal.
};

extern const PageAsset kPageBody, kPageStyle, kPageScript, kChartScript;

}  // namespace forereach
