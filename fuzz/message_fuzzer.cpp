// Messages of any bytes as JSON: what is written parses, has the fields of its type's schema and no others, and arrays
// no longer than a message can hold.
#include <map>
#include <string>

#include <nlohmann/json.hpp>

#include "forereach/advice_t.hpp"
#include "forereach/candidate_plan_t.hpp"
#include "forereach/certified_plan_t.hpp"
#include "forereach/certifier_status_t.hpp"
#include "forereach/decision_t.hpp"
#include "forereach/execution_event_t.hpp"
#include "forereach/fault_t.hpp"
#include "forereach/logger_status_t.hpp"
#include "forereach/obstacles_t.hpp"
#include "forereach/robot_state_t.hpp"
#include "forereach/transition_t.hpp"
#include "forereach/withdrawal_t.hpp"
#include "fuzz/fuzz.h"
#include "records/message_json.h"

namespace forereach {
namespace {

using nlohmann::json;

constexpr std::size_t kMostEntries = 1024;

void RequireFits(const json& value, const json& schema) {
  const std::string type = schema.at("type");
  if (value.is_null()) return;  // a number that is not finite
  if (type == "object") {
    Require(value.is_object());
    for (const auto& [name, field] : value.items()) RequireFits(field, schema.at("properties").at(name));
  } else if (type == "array") {
    Require(value.is_array() && value.size() <= kMostEntries);
    for (const json& entry : value) RequireFits(entry, schema.at("items"));
  } else if (type == "integer") {
    Require(value.is_number_integer());
  } else if (type == "number") {
    Require(value.is_number());
  } else {
    Require(type == "string" && value.is_string());
  }
}

template <class... Messages>
std::vector<std::uint8_t> DamagedOneOf(FuzzedDataProvider& input) {
  std::vector<std::uint8_t> bytes;
  std::size_t left = input.ConsumeIntegralInRange<std::size_t>(0, sizeof...(Messages) - 1);
  static_cast<void>(((left-- == 0 && (bytes = Damaged(input, Messages{}), true)) || ...));
  return bytes;
}

}  // namespace

bool Try(Bytes data) {
  FuzzedDataProvider input(data.data(), data.size());
  const auto bytes =
      DamagedOneOf<decision_t, candidate_plan_t, certified_plan_t, certifier_status_t, execution_event_t, fault_t,
                   logger_status_t, obstacles_t, robot_state_t, transition_t, withdrawal_t, advice_t>(input);
  const std::optional<MessageJson> made = ToJsonMessage(bytes);
  const std::optional<MessageSummary> summary = Summarize(bytes);
  Require(made.has_value() == summary.has_value());
  if (!made) return false;
  Require(made->type == summary->type && made->utime == summary->utime);
  static std::map<std::string, json> schemas;
  const std::string type(made->type);
  if (!schemas.contains(type)) schemas[type] = json::parse(SchemaOf(type));
  RequireFits(json::parse(made->json), schemas[type]);
  return true;
}

}  // namespace forereach
