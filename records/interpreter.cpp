#include "records/interpreter.h"

#include <algorithm>
#include <utility>

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
#include "lcmtypes/candidate_batch.h"
#include "lcmtypes/names.h"

namespace forereach {
namespace {

template <class Message>
std::optional<StreamPosition> PositionOf(Bytes bytes) {
  const auto message = Decoded<Message>(bytes);
  return message ? std::optional(StreamPosition{message->sequence, message->utime}) : std::nullopt;
}

DecisionRow MakeRow(const decision_t& decision, LogReference event) {
  DecisionRow row;
  row.event = std::move(event);
  row.utime = decision.utime;
  row.candidate_utime = decision.candidate_utime;
  row.sequence = decision.sequence;
  row.plan_id = decision.plan_id;
  row.source = GetText(decision.source);
  row.outcome = OutcomeName(decision.outcome);
  row.cause = CauseName(decision.cause);
  row.message = GetText(decision.message);
  row.step = decision.step;
  row.coordinate = decision.coordinate;
  row.obstacle = decision.obstacle;
  row.first_observation = decision.first_observation;
  row.second_observation = decision.second_observation;
  row.margin = decision.margin;
  row.threshold = decision.threshold;
  row.elapsed_us = decision.elapsed_us;
  row.plan_digest = ToHex(GetDigest(decision.plan_digest));
  const Grounds grounds = GroundsOf(decision);
  for (std::size_t i = 0; i < kGrounds.size(); ++i) row.grounds[i] = ToHex(grounds.*kGrounds[i].member);
  return row;
}

EventRow MakeRow(const execution_event_t& event, LogReference reference) {
  EventRow row;
  row.event = std::move(reference);
  row.utime = event.utime;
  row.sequence = event.sequence;
  row.plan_id = event.plan_id;
  row.kind = EventName(event.kind);
  row.message = GetText(event.message);
  row.step = event.step;
  row.coordinate = event.coordinate;
  row.state.assign(event.state, event.state + std::clamp<int>(event.num_states, 0, 16));
  row.value = event.value;
  return row;
}

TransitionRow MakeRow(const transition_t& transition, LogReference reference) {
  const int n = std::clamp<int>(transition.num_states, 0, static_cast<int>(std::size(transition.state))),
            m = std::clamp<int>(transition.num_inputs, 0, static_cast<int>(std::size(transition.input)));
  return {.event = std::move(reference),
          .utime = transition.utime,
          .sequence = transition.sequence,
          .duration_us = transition.duration_us,
          .state = {transition.state, transition.state + n},
          .input = {transition.input, transition.input + m},
          .next_state = {transition.next_state, transition.next_state + n}};
}

}  // namespace

Interpreter::Interpreter(BusOptions channels, std::string log_file, std::optional<KeyRing> keys)
    : channels_(std::move(channels)), log_file_(std::move(log_file)), authenticator_(channels_, std::move(keys)) {}

std::pair<Stream, std::optional<StreamPosition>> Interpreter::Identify(const std::string& channel, Bytes bytes) const {
  const Stream plain{channel, ""};
  if (channel == channels_.candidate) {
    const auto place = [&](const auto& message) -> std::pair<Stream, std::optional<StreamPosition>> {
      if (!message) return {plain, std::nullopt};
      return {Stream{channel, GetText(message->source)}, StreamPosition{message->sequence, message->utime}};
    };
    return IsBatch(bytes) ? place(Decoded<candidate_batch_t>(bytes)) : place(Decoded<candidate_plan_t>(bytes));
  }
  if (channel == channels_.decision) return {plain, PositionOf<decision_t>(bytes)};
  if (channel == channels_.certified) return {plain, PositionOf<certified_plan_t>(bytes)};
  if (channel == channels_.withdrawn) return {plain, PositionOf<withdrawal_t>(bytes)};
  if (channel == channels_.advice) return {plain, PositionOf<advice_t>(bytes)};
  if (channel == channels_.robot_state) return {plain, PositionOf<robot_state_t>(bytes)};
  if (channel == channels_.transition) return {plain, PositionOf<transition_t>(bytes)};
  if (channel == channels_.status) {
    const auto heartbeat = Decoded<certifier_status_t>(bytes);
    if (!heartbeat || !IsInCharge(*heartbeat)) return {plain, std::nullopt};  // a second certifier counts for itself
    return {plain, StreamPosition{heartbeat->sequence, heartbeat->utime}};
  }
  if (channel == channels_.fault) return {plain, PositionOf<fault_t>(bytes)};
  if (channel == channels_.event) return {plain, PositionOf<execution_event_t>(bytes)};
  if (channel == channels_.logger_status) return {plain, PositionOf<logger_status_t>(bytes)};
  if (channel == channels_.obstacles) return {plain, PositionOf<obstacles_t>(bytes)};
  return {plain, std::nullopt};
}

void Interpreter::Observe(const LogEvent& event, Rows& rows) {
  if (!authenticator_.IsAuthentic(event)) return;
  const auto reference = [&] { return LogReference{log_file_, event.number, ToHex(DigestOf(event)), event.utime}; };
  if (std::optional<GapRow> gap = CheckSequence(event)) {
    gap->event = reference();
    rows.gaps.push_back(std::move(*gap));
  }
  if (event.channel == channels_.candidate) {
    candidates_.Add(KeyOfCandidates(event.message()), event.utime);
  } else if (event.channel == channels_.decision) {
    if (const auto decision = Decoded<decision_t>(event.message())) {
      DecisionRow row = MakeRow(*decision, reference());
      row.latency_us = LatencyUs(*decision, event.utime);
      row.shadow = decision->cause == decision_t::CAUSE_SHADOW ? 1 : shadow_;
      rows.decisions.push_back(std::move(row));
    }
  } else if (event.channel == channels_.event) {
    if (const auto execution = Decoded<execution_event_t>(event.message()))
      rows.events.push_back(MakeRow(*execution, reference()));
  } else if (event.channel == channels_.status) {
    if (const auto heartbeat = Decoded<certifier_status_t>(event.message()); heartbeat && IsInCharge(*heartbeat))
      shadow_ = heartbeat->shadow != 0 ? 1 : 0;
  } else if (event.channel == channels_.transition) {
    if (const auto transition = Decoded<transition_t>(event.message()))
      rows.transitions.push_back(MakeRow(*transition, reference()));
  }
}

void Interpreter::Forgive(const Stream& stream, std::int64_t lost) {
  const auto found = streams_.find(stream);
  if (found != streams_.end()) found->second.forgiven += lost;
}

std::optional<GapRow> Interpreter::CheckSequence(const LogEvent& event) {
  const auto [stream, position] = Identify(event.channel, event.message());
  if (!position || (streams_.size() >= kMaxStreams && !streams_.contains(stream))) return std::nullopt;
  Count& count = streams_[stream];
  const std::optional<StreamPosition> newest = count.order.newest();
  const std::int64_t horizon = HorizonOf(event);
  const Succession succession = count.order.Compare(*position, horizon);
  if (succession == Succession::kLate || succession == Succession::kRepeated) return std::nullopt;
  count.order.Take(*position, horizon);
  const std::int64_t got = position->sequence, forgiven = std::exchange(count.forgiven, 0);
  if (!newest) return std::nullopt;
  const std::int64_t expected = newest->sequence < INT64_MAX ? newest->sequence + 1 : INT64_MAX;
  GapRow gap{{}, stream.channel, stream.source, expected, got, 0, event.utime, "restart"};
  if (succession == Succession::kNewer) {
    gap.lost = expected < 0 ? 0 : std::max<std::int64_t>(got - expected - forgiven, 0);
    gap.reason = "bus";
    if (gap.lost == 0) return std::nullopt;
  } else if (got > 0) {
    gap.lost = std::max<std::int64_t>(got - forgiven, 0);  // the sender restarted, and its first messages are missing
  }
  return gap;
}

double Interpreter::LatencyUs(const decision_t& decision, std::int64_t utime) {
  const std::optional<std::int64_t> received = candidates_.Take(PlanKeys(decision));
  return received ? static_cast<double>(utime - *received) : kNoNumber;
}

}  // namespace forereach
