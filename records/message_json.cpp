#include "records/message_json.h"

#include <algorithm>
#include <cmath>
#include <concepts>
#include <stdexcept>
#include <type_traits>

#include <nlohmann/json.hpp>

#include "forereach/advice_t.hpp"
#include "forereach/candidate_plan_t.hpp"
#include "forereach/certified_plan_t.hpp"
#include "forereach/certifier_status_t.hpp"
#include "forereach/command_t.hpp"
#include "forereach/decision_t.hpp"
#include "forereach/execution_event_t.hpp"
#include "forereach/fault_t.hpp"
#include "forereach/logger_status_t.hpp"
#include "forereach/obstacles_t.hpp"
#include "forereach/robot_state_t.hpp"
#include "forereach/transition_t.hpp"
#include "forereach/withdrawal_t.hpp"
#include "lcmtypes/names.h"
#include "task/json_text.h"

namespace forereach {
namespace {

using Json = nlohmann::ordered_json;
using NameOf = std::string_view (*)(std::int16_t);

std::string_view NoFaultName(std::int16_t cause) { return cause == 0 ? "none" : FaultName(cause); }

// ---- The fields of each type, for both the object and its schema. `to` takes: a number; Code, with its name; Text and
// Digest; Row and Rows, of numbers; Nested and List, of messages.

template <class To>
void Fields(const candidate_plan_t& m, To& to) {
  to("utime", m.utime);
  to("sequence", m.sequence);
  to("plan_id", m.plan_id);
  to.Text("source", m.source);
  to("start_utime", m.start_utime);
  to("step_us", m.step_us);
  to("num_states", m.num_states);
  to("num_inputs", m.num_inputs);
  to("num_steps", m.num_steps);
  to("progress_steps", m.progress_steps);
  to.Row("initial_center", m.initial_center, m.num_states);
  to.Row("initial_half_width", m.initial_half_width, m.num_states);
  to.Rows("control", m.control, m.num_steps, m.num_inputs);
}

template <class Message, class To>
void GroundFields(const Message& m, To& to) {
  to.Digest("config_digest", m.config_digest);
  to.Digest("model_digest", m.model_digest);
  to.Digest("declaration_digest", m.declaration_digest);
  to.Digest("observations_digest", m.observations_digest);
  to.Digest("obstacles_digest", m.obstacles_digest);
}

template <class To>
void Fields(const decision_t& m, To& to) {
  to("utime", m.utime);
  to("sequence", m.sequence);
  to("candidate_utime", m.candidate_utime);
  to("plan_id", m.plan_id);
  to.Text("source", m.source);
  to.Code("outcome", m.outcome, OutcomeName);
  to.Code("cause", m.cause, CauseName);
  to("step", m.step);
  to("coordinate", m.coordinate);
  to("obstacle", m.obstacle);
  to("first_observation", m.first_observation);
  to("second_observation", m.second_observation);
  to("margin", m.margin);
  to("threshold", m.threshold);
  to("elapsed_us", m.elapsed_us);
  to.Digest("plan_digest", m.plan_digest);
  GroundFields(m, to);
  to.Text("message", m.message);
}

template <class To>
void Fields(const certified_plan_t& m, To& to) {
  to("utime", m.utime);
  to("sequence", m.sequence);
  to("expires_utime", m.expires_utime);
  to.Nested("plan", m.plan);
  to.Rows("slice_lower", m.slice_lower, m.plan.num_steps + 1, m.plan.num_states);
  to.Rows("slice_upper", m.slice_upper, m.plan.num_steps + 1, m.plan.num_states);
  to.Digest("plan_digest", m.plan_digest);
  GroundFields(m, to);
  to.Digest("transitions_digest", m.transitions_digest);
  to.Digest("certificate_digest", m.certificate_digest);
}

template <class To>
void Fields(const withdrawal_t& m, To& to) {
  to("utime", m.utime);
  to("sequence", m.sequence);
  to("plan_id", m.plan_id);
  to.Text("source", m.source);
  to("expires_utime", m.expires_utime);
  to.Code("cause", m.cause, WithdrawalName);
  to("first_step", m.first_step);
  to("valid_steps", m.valid_steps);
  to("step", m.step);
  to("obstacle", m.obstacle);
  to("margin", m.margin);
  to("threshold", m.threshold);
  to.Digest("plan_digest", m.plan_digest);
  to.Digest("certificate_digest", m.certificate_digest);
  GroundFields(m, to);
  to.Text("message", m.message);
}

template <class To>
void Fields(const advice_change_t& m, To& to) {
  to.Code("kind", m.kind, AdviceName);
  to("verified", m.verified);
  to("step", m.step);
  to("index", m.index);
  to("value", m.value);
  to("clearance", m.clearance);
  to.Row("direction", m.direction, 3);
}

template <class To>
void Fields(const advice_t& m, To& to) {
  to("utime", m.utime);
  to("sequence", m.sequence);
  to("candidate_utime", m.candidate_utime);
  to("plan_id", m.plan_id);
  to.Text("source", m.source);
  to.Digest("plan_digest", m.plan_digest);
  to.Code("outcome", m.outcome, OutcomeName);
  to.Code("cause", m.cause, CauseName);
  to("num_changes", m.num_changes);
  to.List("change", m.change, m.num_changes);
  GroundFields(m, to);
}

template <class To>
void Fields(const robot_state_t& m, To& to) {
  to("utime", m.utime);
  to("sequence", m.sequence);
  to("executing_plan_id", m.executing_plan_id);
  to("executing_step", m.executing_step);
  to("mode", m.mode);
  to("num_states", m.num_states);
  to.Row("state", m.state, m.num_states);
}

template <class To>
void Fields(const transition_t& m, To& to) {
  to("utime", m.utime);
  to("sequence", m.sequence);
  to("num_states", m.num_states);
  to("num_inputs", m.num_inputs);
  to.Row("state", m.state, m.num_states);
  to.Row("input", m.input, m.num_inputs);
  to.Row("next_state", m.next_state, m.num_states);
}

template <class To>
void Fields(const execution_event_t& m, To& to) {
  to("utime", m.utime);
  to("sequence", m.sequence);
  to("plan_id", m.plan_id);
  to.Code("kind", m.kind, EventName);
  to("step", m.step);
  to("coordinate", m.coordinate);
  to("num_states", m.num_states);
  to.Row("state", m.state, m.num_states);
  to("value", m.value);
  to.Text("message", m.message);
}

template <class To>
void Fields(const fault_t& m, To& to) {
  to("utime", m.utime);
  to("sequence", m.sequence);
  to("plan_id", m.plan_id);
  to.Code("cause", m.cause, FaultName);
  to("step", m.step);
  to("coordinate", m.coordinate);
  to("first_observation", m.first_observation);
  to("second_observation", m.second_observation);
  to("value", m.value);
  to("lower", m.lower);
  to("upper", m.upper);
  to.Nested("state", m.state);
  to.Nested("transition", m.transition);
  to.Text("message", m.message);
}

template <class To>
void Fields(const command_t& m, To& to) {
  to("utime", m.utime);
  to("sequence", m.sequence);
  to("kind", m.kind);
  to.Text("source", m.source);
}

template <class To>
void Fields(const obstacle_shape_t& m, To& to) {
  to("kind", m.kind);
  to("dimension", m.dimension);
  to("num_points", m.num_points);
  to.Rows("point", m.point, m.num_points, m.dimension);
  to("value", m.value);
}

template <class To>
void Fields(const obstacle_t& m, To& to) {
  to.Nested("shape", m.shape);
  to("track", m.track);
  to("utime", m.utime);
  to("from_utime", m.from_utime);
  to("until_utime", m.until_utime);
  to.Row("velocity", m.velocity, m.shape.dimension);
  to("uncertainty", m.uncertainty);
  to("growth", m.growth);
  to("growth_rate", m.growth_rate);
  to("gone", m.gone);
}

template <class To>
void Fields(const obstacles_t& m, To& to) {
  to("utime", m.utime);
  to("sequence", m.sequence);
  to("num_obstacles", m.num_obstacles);
  to.List("obstacle", m.obstacle, m.num_obstacles);
}

template <class To>
void Fields(const logger_status_t& m, To& to) {
  to("utime", m.utime);
  to("sequence", m.sequence);
  to("events_written", m.events_written);
  to("events_lost", m.events_lost);
  to("queue_depth", m.queue_depth);
  to("queue_high_water", m.queue_high_water);
  to("file_bytes", m.file_bytes);
  to("log_bytes", m.log_bytes);
  to("free_bytes", m.free_bytes);
  to("flush_us", m.flush_us);
  to("flush_worst_us", m.flush_worst_us);
  to.Code("state", m.state, LevelName);
  to("failed_flushes", m.failed_flushes);
  to.Text("message", m.message);
}

template <class To>
void Fields(const certifier_status_t& m, To& to) {
  to("utime", m.utime);
  to("sequence", m.sequence);
  to("instance", m.instance);
  to("started_utime", m.started_utime);
  to("other_instance", m.other_instance);
  to.Code("level", m.level, LevelName);
  to.Code("state", m.state, StateName);
  to.Code("fault", m.fault, NoFaultName);
  to("shadow", m.shadow);
  to("fault_utime", m.fault_utime);
  to.Code("latch", m.latch, LatchName);
  to("is_unsigned", m.is_unsigned);
  to("version", m.version);
  to("failed_reloads", m.failed_reloads);
  to("candidates", m.candidates);
  to.Row("by_outcome", m.by_outcome, 16);
  to.Row("by_cause", m.by_cause, 64);
  to("consecutive_failures", m.consecutive_failures);
  to("candidates_lost", m.candidates_lost);
  to("messages_refused", m.messages_refused);
  to("messages_not_sent", m.messages_not_sent);
  to("bus_dropped", m.bus_dropped);
  to("datagrams_refused", m.datagrams_refused);
  to("refused_unsigned", m.refused_unsigned);
  to("refused_forged", m.refused_forged);
  to("refused_replayed", m.refused_replayed);
  to("refused_foreign", m.refused_foreign);
  to.Code("obstacles_source", m.obstacles_source, ObstaclesSourceName);
  to("obstacles_known", m.obstacles_known);
  to("obstacles_in_force", m.obstacles_in_force);
  to("obstacles_utime", m.obstacles_utime);
  to("obstacles_age_us", m.obstacles_age_us);
  to("obstacles_lost", m.obstacles_lost);
  to("observations", m.observations);
  to("learned", m.learned);
  to("page_faults", m.page_faults);
  to("queue_depth", m.queue_depth);
  to("queue_high_water", m.queue_high_water);
  to("elapsed_p50_us", m.elapsed_p50_us);
  to("elapsed_p99_us", m.elapsed_p99_us);
  to("elapsed_max_us", m.elapsed_max_us);
  GroundFields(m, to);
  to.Text("message", m.message);
}

// ---- What is made of them.

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
    Types<advice_t, candidate_plan_t, certified_plan_t, certifier_status_t, command_t, decision_t, execution_event_t,
          fault_t, logger_status_t, obstacles_t, robot_state_t, transition_t, withdrawal_t>;

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
  summary.plan = DigestOf(bytes);
  summary.is_of_plan = true;
}
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
    throw std::invalid_argument("no type of message: " + std::string(type));
  return schema;
}

std::vector<std::string_view> MessageTypes() { return AllTypes::Names(); }

}  // namespace forereach
