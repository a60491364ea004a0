/** Where a number stands in a message: "pose.position[0].x". */
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace forereach {

/** A member, or an entry of the array before it. */
struct PlaceStep {
  std::string name;  ///< Empty of an entry.
  std::size_t entry = 0;
};

/** @throws ConfigError if it is no such text. */
[[nodiscard]] std::vector<PlaceStep> StepsOf(std::string_view place);

}  // namespace forereach
