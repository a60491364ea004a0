#include "task/json_text.h"

#include <set>
#include <vector>

#include <fmt/format.h>

#include <nlohmann/json.hpp>

namespace forereach {

template <class Json>
Json ParseJson(std::string_view text, int deepest) {
  using Event = typename Json::parse_event_t;
  std::vector<std::set<std::string>> keys;  // of the objects that are open
  return Json::parse(text, [&keys, deepest](int depth, Event event, Json& value) {
    if (depth > deepest)
      throw Json::other_error::create(501, fmt::format("nested deeper than {} levels", deepest), nullptr);
    if (event == Event::object_start) keys.emplace_back();
    if (event == Event::object_end) keys.pop_back();
    if (event == Event::key && !keys.back().insert(value.template get<std::string>()).second)
      throw Json::other_error::create(501, "duplicate key " + value.dump(), nullptr);
    return true;
  });
}

template <class Json>
std::string JsonText(const Json& json, int indent) {
  return json.dump(indent, ' ', false, Json::error_handler_t::replace);
}

template nlohmann::json ParseJson(std::string_view, int);
template nlohmann::ordered_json ParseJson(std::string_view, int);
template std::string JsonText(const nlohmann::json&, int);
template std::string JsonText(const nlohmann::ordered_json&, int);

}  // namespace forereach
