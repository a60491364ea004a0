/** Output of untrusted text to a terminal. */
#pragma once

#include <string>
#include <string_view>

namespace forereach {

/** The text with each unsafe byte replaced by "\xHH": control characters, bytes that are not UTF-8, and characters that
change the direction or place of the text around them. Names of channels, sources and files can contain such bytes. Cost
O(bytes). */
[[nodiscard]] std::string Printable(std::string_view text);

/** The same, except that line ends stay. Use it for text of several lines whose parts are trusted or already
printable. */
[[nodiscard]] std::string PrintableLines(std::string_view text);

}  // namespace forereach
