#include "clients/planner_messages.h"

#include <utility>

#include "certifier/gate/candidate_message.h"
#include "certifier/gate/robot_messages.h"
#include "certifier/gate/stamp.h"
#include "lcmtypes/candidate_batch.h"

namespace forereach {

PlannerMessages::PlannerMessages(const Config& config, Bus& bus, std::string source, Handlers handlers)
    : config_(config),
      bus_(bus),
      sender_(bus),
      source_(std::move(source)),
      robot_(Microseconds(config.gate.robot_timeout_ms)) {
  if (handlers.state) HearStates(config.bus.robot_state, std::move(handlers.state));
  Hear(config.bus.decision, std::move(handlers.decision));
  Hear(config.bus.advice, std::move(handlers.advice));
  Hear(config.bus.withdrawn, std::move(handlers.withdrawal));
}

template <class Message>
void PlannerMessages::Hear(const std::string& channel, Handler<Message> handler) {
  if (!handler) return;
  bus_.Subscribe(channel, [this, handle = std::move(handler)](const Received& received) {
    const auto message = Decoded<Message>(received.bytes);
    if (message && GetText(message->source) == source_)
      handle(*message, received.utime);
    else
      ++ignored_;
  });
}

void PlannerMessages::HearStates(const std::string& channel, Handler<robot_state_t> handler) {
  bus_.Subscribe(channel, [this, handle = std::move(handler)](const Received& received) {
    const auto state = Decoded<robot_state_t>(received.bytes);
    const SoleSender::Place place = robot_.Hear(received.sender, received.utime);
    // Whoever takes over counts its states anew.
    if (place == SoleSender::Place::kTakesOver) states_ = {};
    if (place != SoleSender::Place::kOther && state &&
        TakeState(*state, config_.problem->model->num_states(), received.utime, config_.gate, states_))
      handle(*state, received.utime);
    else
      ++ignored_;
  });
}

candidate_plan_t PlannerMessages::Next(const CandidateStart& start, const Controls& plan, bool asks_for_repair,
                                       std::int64_t now_us) {
  if (next_plan_id_ == 0) next_plan_id_ = now_us;
  candidate_plan_t candidate{};
  candidate.utime = now_us;
  candidate.sequence = sent_;
  candidate.plan_id = next_plan_id_;
  SetText(candidate.source, source_);
  candidate.start_utime = start.utime;
  candidate.step_us = Microseconds(config_.robot.step_period_ms);
  SetPlan(candidate, start.center, start.half_width, plan.controls);
  candidate.progress_steps = static_cast<std::int16_t>(plan.progress_steps);
  candidate.repair = asks_for_repair ? 1 : 0;
  return candidate;
}

std::vector<candidate_plan_t> PlannerMessages::Send(const CandidateStart& start, const std::vector<Controls>& plans,
                                                    bool asks_for_repair, std::int64_t now_us) {
  std::vector<candidate_plan_t> sent;
  candidate_batch_t batch{};
  for (const Controls& plan : plans) {
    const candidate_plan_t candidate = Next(start, plan, asks_for_repair, now_us);
    if (plans.size() > 1 && !Append(batch, candidate)) break;
    sent.push_back(candidate);
    ++next_plan_id_;
  }
  if (sent.empty()) return {};
  const std::string& channel = config_.bus.candidate;
  if (!(plans.size() > 1 ? sender_.Send(channel, batch) : sender_.Send(channel, sent.front()))) return {};
  ++sent_;
  return sent;
}

}  // namespace forereach
