/** Numbers as text. */
#pragma once

#include <string>

#include "certifier/numerics/compilation.h"

namespace forereach {

/** The shortest decimal that reads back as the same double. */
[[nodiscard]] std::string ToText(double value);

}  // namespace forereach
