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
    // Every level takes stack when the value is written or destroyed, and brackets are cheap to send.
    if (depth > deepest)
      throw Json::other_error::create(501, fmt::format("is nested deeper than {} levels", deepest), nullptr);
    if (event == Event::object_start) keys.emplace_back();
    if (event == Event::object_end) keys.pop_back();
    // Readers differ in which of two they take, so a file with two could mean two things.
    if (event == Event::key && !keys.back().insert(value.template get<std::string>()).second)
      throw Json::other_error::create(501, fmt::format("has a duplicate key {}", value.dump()), nullptr);
    return true;
  });
}

std::string DescribeJsonError(const std::exception& error) {
  const std::string text = error.what();  // "[json.exception.parse_error.101] parse error at line 1, column 5: ..."
  const auto after = [&](const std::string& mark) {
    const std::size_t at = text.find(mark);
    return at == std::string::npos ? std::string() : text.substr(at + mark.size());
  };
  if (dynamic_cast<const nlohmann::json::parse_error*>(&error)) {
    const std::string place = after("parse error at ");
    return fmt::format("is no JSON at {}", place.substr(0, place.find(':')));
  }
  if (dynamic_cast<const nlohmann::json::other_error*>(&error)) return after("] ");  // ours
  if (dynamic_cast<const nlohmann::json::out_of_range*>(&error)) return "lacks a field or an entry that it has to have";
  return "has a field with a value of another type than it has to have";
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
