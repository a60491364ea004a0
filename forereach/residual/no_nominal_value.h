/** What `Observe` (observations.h) throws where the nominal model is not defined. */
#pragma once

#include <stdexcept>
#include <string>

#include "forereach/numerics/compilation.h"

namespace forereach {

/** A transition at whose location f0 has no finite enclosure, as log(0) or 1/0, or no finite derivative within the
declared errors of z around it. */
class NoNominalValue final : public std::invalid_argument {
 public:
  enum class At { kLocation, kAround };

  /** @param state the name of the first state without one. */
  NoNominalValue(int row, const std::string& state, At at)
      : std::invalid_argument("transition " + std::to_string(row) + ": " + Text(state, at)),
        row_(row),
        at_(at),
        text_(Text(state, at)) {}
  [[nodiscard]] int row() const { return row_; }
  [[nodiscard]] At at() const { return at_; }
  /** The message without the row. */
  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  static std::string Text(const std::string& state, At at) {
    return state + ": the nominal model has no finite " +
           (at == At::kLocation ? "value there"
                                : "derivative within the declared errors of states, inputs and durations there");
  }

  int row_;
  At at_;
  std::string text_;
};

}  // namespace forereach
