/** Errors of files that a person wrote. */
#pragma once

#include "lcmtypes/bad_input.h"

namespace forereach {

/** A task file, or a file that it names, cannot be used. The text names file, line, key, value and bound. */
class ConfigError : public BadInput {
 public:
  using BadInput::BadInput;
};

}  // namespace forereach
