/** Makes libFuzzer change a text of lines and numbers, YAML or CSV, by those as well as by bytes: hardly any change of
a byte leaves a file that is not refused for a key or column of no name. To be included by the one source file of a
target. */
#pragma once

#include <algorithm>

#include "fuzz/mutator.h"

namespace forereach {

class TextMutator final {
 public:
  TextMutator(std::string_view text, std::minstd_rand& random) : text_(text), random_(random) {}

  std::string Changed() {
    const std::size_t at = Below(text_.size());
    switch (Below(8)) {
      case 0: return Replaced(LineAt(at), "");
      case 1: return Replaced({at, 0}, Piece(LineAt(Below(text_.size()))));
      case 2: return Replaced(LineAt(at), Piece(LineAt(Below(text_.size()))));
      case 3: return Replaced(NumberFrom(at), Piece(NumberFrom(Below(text_.size()))));
      default: return Replaced(NumberFrom(at), AnyNumber());
    }
  }

 private:
  struct Range {
    std::size_t begin, size;
  };

  [[nodiscard]] std::string_view Piece(Range range) const { return text_.substr(range.begin, range.size); }

  // With its end.
  [[nodiscard]] Range LineAt(std::size_t at) const {
    const std::size_t begin = at == 0 ? 0 : text_.rfind('\n', at - 1) + 1;  // npos + 1 is 0
    return {begin, std::min(text_.find('\n', at), text_.size() - 1) + 1 - begin};
  }

  // The first that begins there or later; empty if none does.
  [[nodiscard]] Range NumberFrom(std::size_t at) const {
    constexpr std::string_view kOf = "0123456789.+-eE";
    const std::size_t digit = text_.find_first_of("0123456789", at);
    if (digit == std::string_view::npos) return {at, 0};
    const std::size_t begin = text_.find_last_not_of(kOf, digit) + 1;
    return {begin, std::min(text_.find_first_not_of(kOf, digit), text_.size()) - begin};
  }

  std::string_view AnyNumber() {
    constexpr std::string_view kAny[] = {"0",    "1",    "-1",  "2",   "3",     "0.5",    "-2.5",
                                         "1e-3", "1e3",  "16",  "128", "1e300", "1e-320", "1e999",
                                         ".nan", "-0.0", "0.1", "4",   "1000",  "65536",  "2147483648"};
    return kAny[Below(std::size(kAny))];
  }

  [[nodiscard]] std::string Replaced(Range range, std::string_view by) const {
    return std::string(text_.substr(0, range.begin)).append(by).append(text_.substr(range.begin + range.size));
  }

  std::size_t Below(std::size_t end) { return random_() % end; }

  std::string_view text_;
  std::minstd_rand& random_;
};

}  // namespace forereach

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max_size,
                                               unsigned seed) {
  return forereach::MutateText(data, size, max_size, seed, [](std::string_view text, std::minstd_rand& random) {
    return forereach::TextMutator(text, random).Changed();
  });
}
