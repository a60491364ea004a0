#include "identify/message_place.h"

#include <charconv>

#include "task/config_error.h"

namespace forereach {

std::vector<PlaceStep> StepsOf(std::string_view place) {
  std::vector<PlaceStep> steps;
  for (std::string_view rest = place; !rest.empty();) {
    const std::size_t end = std::min(rest.find_first_of(".["), rest.size());
    if (end > 0) {
      steps.push_back({std::string(rest.substr(0, end)), 0});
      rest.remove_prefix(end);
    } else if (rest.front() == '.' && !steps.empty()) {
      rest.remove_prefix(1);
      if (rest.empty() || rest.front() == '.' || rest.front() == '[') break;
    } else {
      PlaceStep step;
      const char* const last = rest.data() + rest.size();
      const auto [at, error] = std::from_chars(rest.data() + 1, last, step.entry);
      if (steps.empty() || error != std::errc() || at == last || *at != ']') break;
      steps.push_back(step);
      rest.remove_prefix(static_cast<std::size_t>(at + 1 - rest.data()));
      if (!rest.empty() && rest.front() != '.' && rest.front() != '[') break;
    }
    if (rest.empty()) return steps;
  }
  throw ConfigError("'{}' is no place in a message, such as pose.position[0]", place);
}

}  // namespace forereach
