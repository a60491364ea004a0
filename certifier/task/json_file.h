/** JSON files that people hand us. */
#pragma once

#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

namespace forereach {

/** The document, if it nests at most 32 levels and no object has a key twice: what walks over a deeper one by
recursion, as nlohmann's own copying and writing do, could end the program; and of two values another reader may take
the other.
@throws Json::exception, also for what is no JSON. */
template <class Json>
[[nodiscard]] Json ParseJson(std::string_view text) {
  constexpr int kDeepest = 32;
  using Event = typename Json::parse_event_t;
  std::vector<std::set<std::string>> keys;  // of the objects that are open
  return Json::parse(text, [&keys](int depth, Event event, Json& value) {
    if (depth > kDeepest) throw Json::other_error::create(501, "nested deeper than 32 levels", nullptr);
    if (event == Event::object_start) keys.emplace_back();
    if (event == Event::object_end) keys.pop_back();
    if (event == Event::key && !keys.back().insert(value.template get<std::string>()).second)
      throw Json::other_error::create(501, "duplicate key " + value.dump(), nullptr);
    return true;
  });
}

}  // namespace forereach
