#include <algorithm>
#include <set>

#include <fmt/core.h>
#include <nlohmann/json.hpp>

#include "task/json_text.h"
#include "task/schema.h"

namespace forereach {
namespace {

using Json = nlohmann::ordered_json;
using Type = Key::Type;

// Whether a row is the value of a key of the map `path`, or the entry of a list.
bool IsBelow(const std::string& path, const Key& row) {
  if (row.path.size() <= path.size() || !row.path.starts_with(path)) return false;
  const std::string rest = row.path.substr(path.size() + (path.empty() || row.path[path.size()] == '[' ? 0 : 1));
  return rest == "[]" || (!rest.empty() && rest.find_first_of(".[") == std::string::npos);
}

std::string LeafOf(const std::string& path, const Key& row) {
  return row.path.substr(path.empty() ? 0 : path.size() + 1);
}

void AddRange(const Range& range, Json& json) {
  if (std::isfinite(range.lower)) json[range.lower_open ? "exclusiveMinimum" : "minimum"] = range.lower;
  if (std::isfinite(range.upper)) json[range.upper_open ? "exclusiveMaximum" : "maximum"] = range.upper;
}

void AddCount(const Range& count, Json& json) {
  if (std::isfinite(count.lower)) json["minItems"] = static_cast<int>(count.lower);
  if (std::isfinite(count.upper)) json["maxItems"] = static_cast<int>(count.upper);
}

Json NumberJson(const Key& key) {
  Json json{{"type", key.type == Type::kInteger ? "integer" : "number"}};
  AddRange(key.range, json);
  return json;
}

Json VectorJson(const Key& key, const Range& count) {
  Json json{{"type", "array"}, {"items", NumberJson(key)}};
  AddCount(key.size == Key::Size::kPoint ? Range{2, 3, false, false} : count, json);
  return json;
}

Json FormsJson(std::span<const Key> schema, const std::string& path);

// The keys of a map that are there for certain values of its `name` only.
void AddConditions(std::span<const Key> schema, const std::string& path, Json& json) {
  std::map<std::string, std::set<std::string>> only, required;  // names by leaf; leaves by name
  std::set<std::string> always;
  for (const Key& row : schema) {
    if (!IsBelow(path, row)) continue;
    const std::string leaf = LeafOf(path, row);
    if (row.only.empty()) always.insert(leaf);
    if (!row.only.empty()) only[leaf].insert(row.only);
    if (!row.only.empty() && row.required) required[row.only].insert(leaf);
  }
  const auto is_named = [](const Json& names) {
    return Json{{"properties", {{"name", {{"enum", names}}}}}, {"required", {"name"}}};
  };
  for (const auto& [name, leaves] : required)
    json["allOf"].push_back({{"if", is_named({name})}, {"then", {{"required", leaves}}}});
  for (const auto& [leaf, names] : only)
    if (!always.contains(leaf))
      json["allOf"].push_back({{"if", is_named(names)}, {"else", {{"properties", {{leaf, false}}}}}});
}

Json MapJson(std::span<const Key> schema, const std::string& path) {
  Json json{{"type", "object"}, {"properties", Json::object()}, {"additionalProperties", false}};
  std::set<std::string> required;
  for (const Key& row : schema) {
    if (!IsBelow(path, row)) continue;
    const std::string leaf = LeafOf(path, row);
    if (leaf.starts_with('<')) {  // names of which a schema knows nothing
      json["additionalProperties"] = FormsJson(schema, row.path);
      continue;
    }
    json["properties"][leaf] = FormsJson(schema, row.path);
    if (row.required && row.only.empty()) required.insert(leaf);
  }
  if (!required.empty()) json["required"] = required;
  AddConditions(schema, path, json);
  return json;
}

Json FormJson(std::span<const Key> schema, const Key& key) {
  switch (key.type) {
    case Type::kMap: return MapJson(schema, key.path);
    case Type::kList: {
      Json json{{"type", "array"}, {"items", FormsJson(schema, key.path + "[]")}};
      AddCount(key.count, json);
      return json;
    }
    case Type::kNumber:
    case Type::kInteger: return NumberJson(key);
    case Type::kVector: return VectorJson(key, key.size == Key::Size::kAny ? key.count : kReal);
    case Type::kVectors: {
      Json json{{"type", "array"}, {"items", VectorJson(key, kReal)}};
      AddCount(key.count, json);
      return json;
    }
    case Type::kNames: {
      Json json{{"type", "array"}, {"items", {{"type", "string"}}}, {"uniqueItems", true}};
      AddCount(key.count, json);
      return json;
    }
    case Type::kWord: return {{"enum", std::vector<std::string>(key.words.begin(), key.words.end())}};
    case Type::kText:
    case Type::kExpression: return {{"type", {"string", "number", "boolean"}}, {"minLength", 1}};  // YAML's scalars
    case Type::kChannel: return {{"type", "string"}, {"pattern", "^[A-Za-z0-9_]{1,63}$"}};
  }
  return true;
}

std::string DescriptionOf(const Key& key) {
  std::string text = key.meaning;
  if (!key.unit.empty()) text += fmt::format(" Unit: {}.", key.unit);
  if (!key.fallback.empty()) text += fmt::format(" Default: {}.", key.fallback);
  return text;
}

// Of all rows with this path: a value has the form of one of them.
Json FormsJson(std::span<const Key> schema, const std::string& path) {
  std::vector<Json> forms;
  std::string description;
  for (const Key& row : schema) {
    if (row.path != path) continue;
    if (description.empty()) description = DescriptionOf(row);
    Json form = FormJson(schema, row);
    if (std::ranges::find(forms, form) == forms.end()) forms.push_back(std::move(form));
  }
  Json json{{"description", description}};
  json.update(forms.size() == 1 ? forms.front() : Json{{"anyOf", forms}});
  return json;
}

}  // namespace

std::string SchemaJson() {
  Json json{{"$schema", "http://json-schema.org/draft-07/schema#"}, {"title", "ForeReach task file"}};
  json.update(FormsJson(Schema(), ""));
  return JsonText(json, 2);
}

}  // namespace forereach
