/** The exception for invalid input from outside: a task file, a plan, a log, a database, a bus address or an option.

Each kind of input derives its own class. The text names the place, the value and the requirement. A program prints the
text in one line and exits with 2. */
#pragma once

#include <stdexcept>

#include "forereach/numerics/compilation.h"

namespace forereach {

class BadInput : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace forereach
