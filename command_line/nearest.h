/** Lists of words in options and messages, and what a wrong word was probably meant to be. */
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace forereach {

/** "did you mean X?" if a known word differs by few letters, else "known here: X, Y, Z", of many words the first. */
[[nodiscard]] std::string Suggestion(std::string_view word, const std::vector<std::string>& known);

/** The words, separated by commas. */
[[nodiscard]] std::string Joined(const std::vector<std::string>& words);
/** The same of what `text` gives of each element; what is empty is left out. */
template <class Range, class Text>
[[nodiscard]] std::string Joined(const Range& range, const Text& text) {
  std::string all;
  for (const auto& element : range)
    if (const std::string word(text(element)); !word.empty()) all += (all.empty() ? "" : ", ") + word;
  return all;
}
/** The words between commas; none of an empty text. */
[[nodiscard]] std::vector<std::string> SplitAtCommas(const std::string& text);

}  // namespace forereach
