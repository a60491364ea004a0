#include "command_line/nearest.h"

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <optional>
#include <sstream>
#include <utility>

namespace forereach {
namespace {

// Letters to insert, delete, replace, or swap with their neighbour.
std::size_t EditDistance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before(b.size() + 1), row(b.size() + 1), next(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    next[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      next[j + 1] = std::min({row[j] + (a[i] == b[j] ? 0 : 1), next[j] + 1, row[j + 1] + 1});
      if (i > 0 && j > 0 && a[i] == b[j - 1] && a[i - 1] == b[j])
        next[j + 1] = std::min(next[j + 1], before[j - 1] + 1);
    }
    before = std::exchange(row, next);
  }
  return row.back();
}

// How many letters a word may differ from this one and still be meant for it.
std::size_t NearLimit(const std::string& known) { return 1 + known.size() / 4; }

// Nothing for words that are not near: whoever wrote them may have made them as long as a file.
std::optional<std::size_t> NearDistance(std::string_view word, const std::string& known) {
  const std::size_t limit = NearLimit(known);
  if (std::max(word.size(), known.size()) - std::min(word.size(), known.size()) > limit) return std::nullopt;
  const std::size_t distance = EditDistance(word, known);
  return distance <= limit ? std::optional(distance) : std::nullopt;
}

}  // namespace

std::string Joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

std::vector<std::string> SplitAtCommas(const std::string& text) {
  std::vector<std::string> words;
  std::istringstream in(text);
  for (std::string word; std::getline(in, word, ',');) words.push_back(word);
  return words;
}

std::string Suggestion(std::string_view word, const std::vector<std::string>& known) {
  constexpr std::size_t kShown = 100;
  const std::string* nearest = nullptr;
  std::size_t least = 0;
  for (const std::string& other : known)
    if (const auto distance = NearDistance(word, other); distance && (nearest == nullptr || *distance < least)) {
      nearest = &other;
      least = *distance;
    }
  if (nearest != nullptr) return "did you mean " + *nearest + "?";
  if (known.size() <= kShown) return "known here: " + Joined(known);
  return "known here: " + Joined({known.begin(), known.begin() + kShown}) + " and " +
         std::to_string(known.size() - kShown) + " more";
}

}  // namespace forereach
