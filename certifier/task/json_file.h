/** JSON files that people hand us. */
#pragma once

#include <string_view>

#include <nlohmann/json.hpp>

namespace forereach {

/** The document, if it nests at most 32 levels: what walks over a deeper one by recursion, as nlohmann's own copying and
writing do, could end the program. @throws Json::exception, also for what is no JSON. */
template <class Json>
[[nodiscard]] Json ParseJson(std::string_view text) {
  constexpr int kDeepest = 32;
  return Json::parse(text, [](int depth, typename Json::parse_event_t, Json&) {
    if (depth > kDeepest) throw Json::other_error::create(501, "nested deeper than 32 levels", nullptr);
    return true;
  });
}

}  // namespace forereach
