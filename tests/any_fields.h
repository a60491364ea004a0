/** Messages whose fields hold any numbers: what a damaged or hostile sender may put on the bus. */
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <limits>
#include <random>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "lcmtypes/candidate_batch.h"
#include "lcmtypes/codec.h"
#include "lcmtypes/message_fields.h"
#include "records/event_log.h"

namespace forereach {

/** A visitor of lcmtypes/message_fields.h that puts any number into a share of the fields. */
class AnyFields final {
 public:
  AnyFields(std::mt19937_64& random, double share) : random_(random), share_(share) {}

  template <class Number>
  void operator()(const char*, const Number& value) {
    if (std::uniform_real_distribution()(random_) < share_) const_cast<Number&>(value) = Any<Number>();
  }
  template <class NameOf>
  void Code(const char* name, const std::int16_t& value, NameOf) {
    (*this)(name, value);
  }
  template <std::size_t N>
  void Text(const char* name, const std::uint8_t (&text)[N]) {
    Row(name, text, 0);
  }
  void Digest(const char* name, const std::uint8_t (&digest)[32]) { Row(name, digest, 0); }
  template <class Number, std::size_t N, class Count>
  void Row(const char* name, const Number (&row)[N], Count) {
    for (const Number& value : row) (*this)(name, value);
  }
  template <std::size_t N, std::size_t M, class Count>
  void Rows(const char* name, const double (&rows)[N][M], Count count, int) {
    for (const auto& row : rows) Row(name, row, count);
  }
  template <class Message>
  void Nested(const char*, const Message& message) {
    Fields(message, *this);
  }
  template <class Message, std::size_t N, class Count>
  void List(const char* name, const Message (&list)[N], Count) {
    for (const Message& message : list) Nested(name, message);
  }

 private:
  template <class Number>
  Number Any() {
    using Limits = std::numeric_limits<Number>;
    const std::uint64_t bits = random_();
    if constexpr (std::is_floating_point_v<Number>) {
      const std::array special{
          Limits::quiet_NaN(), Limits::infinity(), -Limits::infinity(),  0.0,  -0.0, -1.0, 1e-300,
          Limits::max(),       Limits::lowest(),   Limits::denorm_min(), 1e21, 0.5,  1e9,  12345.6789};
      return bits % 2 ? special[(bits >> 1) % special.size()] : std::bit_cast<Number>(random_());
    } else {
      const std::array special{Limits::min(), Limits::max(),           Number{0},
                               Number{1},     static_cast<Number>(-1), static_cast<Number>(bits >> 60)};
      return bits % 2 ? special[(bits >> 1) % special.size()] : static_cast<Number>(random_());
    }
  }

  std::mt19937_64& random_;
  double share_;
};

/** Any message of a type, and made of `event` if that is one. */
template <class Message>
std::vector<std::uint8_t> AnyMessage(std::mt19937_64& random, const LogEvent& event, double share) {
  auto message = Decoded<Message>(event.message()).value_or(Message{});
  AnyFields to(random, share);
  Fields(message, to);
  return Encode(message);
}

/** Any candidates in one message, each of them possible for a part of the tries. */
inline std::vector<std::uint8_t> AnyBatch(std::mt19937_64& random, const LogEvent& event, double share) {
  candidate_batch_t batch = Decoded<candidate_batch_t>(event.message()).value_or(candidate_batch_t{});
  if (const auto alone = Decoded<candidate_plan_t>(event.message()))
    for (auto left = random() % 4; left > 0 && Append(batch, *alone); --left) continue;
  AnyFields to(random, share);
  Fields(batch, to);
  return Encode(batch);
}

/** A message on a channel of the default names, a few or all of whose fields are any numbers. */
inline LogEvent AnyEvent(std::mt19937_64& random, LogEvent event) {
  using Make = std::vector<std::uint8_t> (*)(std::mt19937_64&, const LogEvent&, double);
  static constexpr std::pair<std::string_view, Make> kTypes[] = {{"PLAN_CANDIDATE", AnyMessage<candidate_plan_t>},
                                                                 {"PLAN_CANDIDATE", AnyBatch},
                                                                 {"PLAN_CERTIFIED", AnyMessage<certified_plan_t>},
                                                                 {"PLAN_DECISION", AnyMessage<decision_t>},
                                                                 {"PLAN_WITHDRAWN", AnyMessage<withdrawal_t>},
                                                                 {"ROBOT_STATE", AnyMessage<robot_state_t>},
                                                                 {"OBSTACLES", AnyMessage<obstacles_t>},
                                                                 {"TRANSITION", AnyMessage<transition_t>},
                                                                 {"FAULT", AnyMessage<fault_t>},
                                                                 {"CERTIFIER_STATUS", AnyMessage<certifier_status_t>},
                                                                 {"LOGGER_STATUS", AnyMessage<logger_status_t>},
                                                                 {"EXECUTION_EVENT", AnyMessage<execution_event_t>},
                                                                 {"PLAN_ADVICE", AnyMessage<advice_t>},
                                                                 {"COMMAND", AnyMessage<command_t>}};
  const auto [channel, make] = kTypes[random() % std::size(kTypes)];
  if (random() % 2 == 0) event.channel = channel;
  const double share = std::array{.0, .003, .1, 1.}[random() % 4];
  const bool is_batch = random() % 4 == 0;
  for (const auto& [name, make_of] : kTypes)
    if (name == event.channel && (make_of == AnyBatch) == (is_batch && name == kTypes[0].first))
      event.data = make_of(random, event, share);
  return event;
}

}  // namespace forereach
