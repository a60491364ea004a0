/** Files of the pages, embedded when the program is built (page/embed.cmake). */
#pragma once

#include <string_view>

namespace forereach {

struct PageAsset {
  std::string_view text;
  std::string_view sha256;  ///< In hexadecimal.
};

/** Of the page of a run, of the live page, and of both. kPageStyle is for both. */
extern const PageAsset kPageBody, kPageScript, kLiveBody, kLiveStyle, kLiveScript, kPageStyle, kSharedScript,
    kChartScript;

}  // namespace forereach
