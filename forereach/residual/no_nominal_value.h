/** What `Observe` (observations.h) throws where the nominal model is not defined. */
#pragma once

#include <stdexcept>
#include <string>

#include "forereach/numerics/compilation.h"

namespace forereach {

/** A transition at whose location f0 has no finite enclosure, as log(0) or 1/0. */
class NoNominalValue final : public std::invalid_argument {
 public:
  /** @param state the name of the first state without one. */
  NoNominalValue(int row, const std::string& state)
      : std::invalid_argument("transition " + std::to_string(row) + ": " + Text(state)),
        row_(row),
        text_(Text(state)) {}
  [[nodiscard]] int row() const { return row_; }
  /** The message without the row. */
  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  static std::string Text(const std::string& state) { return state + ": the nominal model has no finite value there"; }

  int row_;
  std::string text_;
};

}  // namespace forereach
