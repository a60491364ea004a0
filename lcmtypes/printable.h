/** Text that others chose, on a terminal. */
#pragma once

#include <string>
#include <string_view>

namespace forereach {

/** The text with each byte as "\xHH" that may not reach a terminal as it is: control characters, what is no UTF-8, and
characters that change the direction or place of the text around them. All others stay. Whoever may name a channel, a
source or a file may choose such bytes. */
[[nodiscard]] std::string Printable(std::string_view text);

/** The same, but line ends stay: for text of several lines of which each part is one's own or printable. */
[[nodiscard]] std::string PrintableLines(std::string_view text);

}  // namespace forereach
