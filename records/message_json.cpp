#include "records/message_json.h"

#include <algorithm>
#include <cmath>
#include <concepts>
#include <stdexcept>
#include <type_traits>

#include <fmt/core.h>
#include <nlohmann/json.hpp>

#include "lcmtypes/candidate_batch.h"
#include "lcmtypes/message_fields.h"
#include "lcmtypes/names.h"
#include "lcmtypes/seal.h"
#include "task/json_text.h"

namespace forereach {
namespace {

using Json = nlohmann::ordered_json;
using NameOf = std::string_view (*)(std::int16_t);

// Visitors of Fields(message, visitor), of lcmtypes/message_fields.h. They take: a number; Code, with the function that
// tells its name; Text and Digest; Row and Rows, of numbers, with how many entries are in use; Nested and List, of
// messages.

// Values of a message. A count in it may be any number.
class ObjectFields final {
 public:
  template <class Number>
  void operator()(const char* name, Number value) {
    if constexpr (std::floating_point<Number>)
      if (!std::isfinite(value)) return;
    object_[name] = value;
  }
  void Code(const char* name, std::int16_t value, NameOf name_of) {
    object_[name] = value;
    object_[std::string(name) + "_name"] = name_of(value);
  }
  template <std::size_t N>
  void Text(const char* name, const std::uint8_t (&field)[N]) {
    object_[name] = GetText(field);
  }
  void Digest(const char* name, const std::uint8_t (&field)[32]) { object_[name] = ToHex(GetDigest(field)); }
  template <class Number, std::size_t N>
  void Row(const char* name, const Number (&row)[N], int count) {
    object_[name] = RowOf(row, count);
  }
  template <std::size_t N, std::size_t M>
  void Rows(const char* name, const double (&rows)[N][M], int count, int columns) {
    Json all = Json::array();
    for (int i = 0; i < std::clamp<int>(count, 0, N); ++i) all.push_back(RowOf(rows[i], columns));
    object_[name] = std::move(all);
  }
  template <class Message>
  void Nested(const char* name, const Message& message) {
    object_[name] = ObjectOf(message);
  }
  template <class Message, std::size_t N>
  void List(const char* name, const Message (&list)[N], int count) {
    Json all = Json::array();
    for (int i = 0; i < std::clamp<int>(count, 0, N); ++i) all.push_back(ObjectOf(list[i]));
    object_[name] = std::move(all);
  }

  template <class Message>
  static Json ObjectOf(const Message& message) {
    ObjectFields fields;
    Fields(message, fields);
    return std::move(fields.object_);
  }

 private:
  template <class Number, std::size_t N>
  static Json RowOf(const Number (&row)[N], int count) {
    Json values = Json::array();
    for (int i = 0; i < std::clamp<int>(count, 0, N); ++i) values.push_back(row[i]);
    return values;
  }

  Json object_ = Json::object();
};

// The schema of a type. Only words that viewers know: they take no unions of types.
class SchemaFields final {
 public:
  template <class Number>
  void operator()(const char* name, Number) {
    properties_[name] = Of(std::integral<Number> ? "integer" : "number");
  }
  void Code(const char* name, std::int16_t, NameOf) {
    properties_[name] = Of("integer");
    properties_[std::string(name) + "_name"] = Of("string");
  }
  template <std::size_t N>
  void Text(const char* name, const std::uint8_t (&)[N]) {
    properties_[name] = Of("string");
  }
  void Digest(const char* name, const std::uint8_t (&)[32]) { properties_[name] = Of("string"); }
  template <class Number, std::size_t N>
  void Row(const char* name, const Number (&)[N], int) {
    properties_[name] = ArrayOf(Of(std::integral<Number> ? "integer" : "number"));
  }
  template <std::size_t N, std::size_t M>
  void Rows(const char* name, const double (&)[N][M], int, int) {
    properties_[name] = ArrayOf(ArrayOf(Of("number")));
  }
  template <class Message>
  void Nested(const char* name, const Message&) {
    properties_[name] = SchemaOfType<Message>();
  }
  template <class Message, std::size_t N>
  void List(const char* name, const Message (&)[N], int) {
    properties_[name] = ArrayOf(SchemaOfType<Message>());
  }

  template <class Message>
  static Json SchemaOfType() {
    static const Message zero{};
    SchemaFields fields;
    Fields(zero, fields);
    return {{"type", "object"}, {"properties", std::move(fields.properties_)}};
  }

 private:
  static Json Of(const char* type) { return {{"type", type}}; }
  static Json ArrayOf(Json items) { return {{"type", "array"}, {"items", std::move(items)}}; }

  Json properties_ = Json::object();
};

// ---- All types, sorted.

template <class... Messages>
struct Types {
  // Calls `use` with a null pointer of the first type for which `is` is true. False if it is none.
  template <class Is, class Use>
  static bool Find(Is is, Use use) {
    return ((is(static_cast<const Messages*>(nullptr)) && (use(static_cast<const Messages*>(nullptr)), true)) || ...);
  }
  static std::vector<std::string_view> Names() { return {Messages::getTypeName()...}; }
};

using AllTypes =
    Types<advice_t, candidate_batch_t, candidate_plan_t, certified_plan_t, certifier_status_t, command_t, decision_t,
          execution_event_t, fault_t, logger_status_t, obstacles_t, robot_state_t, transition_t, withdrawal_t>;

// Calls `use` with the decoded message.
template <class Use>
void WithMessage(Bytes bytes, Use use) {
  if (bytes.size() < 8) return;
  const auto fingerprint = FromBigEndian<std::int64_t>(bytes);
  static_cast<void>(
      AllTypes::Find([fingerprint]<class Message>(const Message*) { return Message::getHash() == fingerprint; },
                     [&]<class Message>(const Message*) {
                       if (const auto message = Decoded<Message>(bytes)) use(*message);
                     }));
}

void Describe(const candidate_plan_t& m, Bytes bytes, MessageSummary& summary) {
  summary.plan_id = m.plan_id;
  summary.plan = PlanDigest(bytes);
  summary.is_of_plan = true;
}
void Describe(const candidate_batch_t& m, Bytes, MessageSummary& summary) { summary.plan_id = m.plan_id; }
template <class Answer>
requires(std::same_as<Answer, decision_t> || std::same_as<Answer, advice_t>) void Describe(const Answer& m, Bytes,
                                                                                           MessageSummary& summary) {
  summary.plan_id = m.plan_id;
  summary.what = OutcomeName(m.outcome);
  summary.plan = GetDigest(m.plan_digest);
  summary.is_of_plan = true;
}
void Describe(const certified_plan_t& m, Bytes, MessageSummary& summary) {
  summary.plan_id = m.plan.plan_id;
  summary.plan = GetDigest(m.plan_digest);
  summary.is_of_plan = true;
}
void Describe(const withdrawal_t& m, Bytes, MessageSummary& summary) {
  summary.plan_id = m.plan_id;
  summary.what = WithdrawalName(m.cause);
}
void Describe(const execution_event_t& m, Bytes, MessageSummary& summary) {
  if (m.plan_id >= 0) summary.plan_id = m.plan_id;
  summary.what = EventName(m.kind);
}
void Describe(const fault_t& m, Bytes, MessageSummary& summary) {
  if (m.plan_id >= 0) summary.plan_id = m.plan_id;
  summary.what = FaultName(m.cause);
}
void Describe(const robot_state_t& m, Bytes, MessageSummary& summary) {
  if (m.executing_plan_id >= 0) summary.plan_id = m.executing_plan_id;
}
template <class Message>
void Describe(const Message&, Bytes, MessageSummary&) {}

}  // namespace

std::optional<MessageSummary> Summarize(Bytes bytes) {
  std::optional<MessageSummary> summary;
  WithMessage(bytes, [&]<class Message>(const Message& message) {
    summary.emplace();
    summary->type = Message::getTypeName();
    summary->utime = message.utime;
    Describe(message, bytes, *summary);
  });
  return summary;
}

std::optional<MessageJson> ToJsonMessage(Bytes bytes) {
  std::optional<MessageJson> made;
  WithMessage(bytes, [&]<class Message>(const Message& message) {
    made =
        MessageJson{Message::getTypeName(), message.utime, message.sequence, JsonText(ObjectFields::ObjectOf(message))};
  });
  return made;
}

std::string SchemaOf(std::string_view type) {
  std::string schema;
  if (!AllTypes::Find([type]<class Message>(const Message*) { return type == Message::getTypeName(); },
                      [&]<class Message>(const Message*) {
                        Json json = SchemaFields::SchemaOfType<Message>();
                        json["title"] = Message::getTypeName();
                        schema = JsonText(json);
                      }))
    throw std::invalid_argument(fmt::format("no type of message: {}", type));
  return schema;
}

std::vector<std::string_view> MessageTypes() { return AllTypes::Names(); }

}  // namespace forereach
