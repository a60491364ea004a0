/** The messages of the bus as JSON objects, with a JSON Schema for each type.

Fields have their names in lcmtypes/. Of arrays only the entries in use are written. Digests are in hexadecimal. A
number that stands for a name is followed by that name: "outcome": 1, "outcome_name": "certified". A number that is not
finite is left out, and is null in an array. */
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "lcmtypes/codec.h"

namespace forereach {

/** What every message says of itself. */
struct MessageSummary {
  std::string_view type;               ///< "decision_t"
  std::optional<std::int64_t> plan_id; /**< No value if it is about no plan. */
  std::string_view what;               ///< Name of outcome, kind or cause; empty if it has none.
  Digest plan{};                       ///< Digest of the candidate's bytes, for candidates and what answers them.
  bool is_of_plan = false;             ///< Whether `plan` is set.
  std::int64_t utime = 0;              ///< The sender's stamp.
};

/** Nothing if the bytes are no message of ForeReach's types. */
[[nodiscard]] std::optional<MessageSummary> Summarize(Bytes message);

struct MessageJson {
  std::string_view type;
  std::int64_t utime = 0, sequence = 0;
  std::string json;
};

/** Nothing if the bytes are no message of ForeReach's types. Counts in the message are bounded before they are used. */
[[nodiscard]] std::optional<MessageJson> ToJsonMessage(Bytes message);

/** The JSON Schema of a type. @throws std::invalid_argument for another name. */
[[nodiscard]] std::string SchemaOf(std::string_view type);

/** The names of all types of messages, sorted. */
[[nodiscard]] std::vector<std::string_view> MessageTypes();

}  // namespace forereach
