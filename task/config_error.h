/** Errors of files that a person wrote. */
#pragma once

#include <utility>

#include <fmt/core.h>

#include "lcmtypes/bad_input.h"

namespace forereach {

/** A task file, or a file that it names, cannot be used. The text names file, line, key, value and bound. */
class ConfigError : public BadInput {
 public:
  using BadInput::BadInput;
  /** The text by fmt: ConfigError("{}: {} is negative", path, value). */
  template <class First, class... Others>
  ConfigError(fmt::format_string<First, Others...> text, First&& first, Others&&... others)
      : BadInput(fmt::format(text, std::forward<First>(first), std::forward<Others>(others)...)) {}
};

}  // namespace forereach
