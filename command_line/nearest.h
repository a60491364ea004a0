/** What a wrong word was probably meant to be. */
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace forereach {

/** "did you mean X?" if a known word differs by few letters, else "known here: X, Y, Z", of many words the first. */
[[nodiscard]] std::string Suggestion(std::string_view word, const std::vector<std::string>& known);

/** The words, separated by commas. */
[[nodiscard]] std::string Joined(const std::vector<std::string>& words);

}  // namespace forereach
