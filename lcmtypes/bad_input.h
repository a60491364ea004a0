/** What a person gave cannot be used: a task file, a plan, a log, a database, a bus, an option.

Each kind of it has a class of its own derived from this; the text names the place, the value and what it has to be.
A program that gets one says the text in one line and exits with 2. */
#pragma once

#include <stdexcept>

#include "certifier/numerics/compilation.h"

namespace forereach {

class BadInput : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace forereach
