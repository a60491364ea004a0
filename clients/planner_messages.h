/** The messages of one planner: it hears what concerns this planner alone, and counts its candidates. */
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "bus/node.h"
#include "clients/candidate_start.h"
#include "forereach/advice_t.hpp"
#include "forereach/candidate_plan_t.hpp"
#include "forereach/decision_t.hpp"
#include "forereach/robot_state_t.hpp"
#include "forereach/withdrawal_t.hpp"
#include "lcmtypes/stream_order.h"
#include "task/config.h"

namespace forereach {

class PlannerMessages final {
 public:
  /** What is done with a message, which came at `now_us`. Without a handler its channel is not subscribed to. */
  template <class Message>
  using Handler = std::function<void(const Message& message, std::int64_t now_us)>;
  struct Handlers {
    Handler<robot_state_t> state;  ///< The newest of the one robot that counts (SoleSender), usable by TakeState.
    Handler<decision_t> decision;
    Handler<withdrawal_t> withdrawal;
    Handler<advice_t> advice;
  };
  struct Controls {
    const Eigen::MatrixXd& controls;  ///< m-by-T, one column for each step.
    int progress_steps;               ///< Number of columns before the braking tail.
  };

  /** @param source the planner's name. What is for another one is ignored. @param bus outlives this object, and
  `config`, too. */
  PlannerMessages(const Config& config, Bus& bus, std::string source, Handlers handlers);
  PlannerMessages(const PlannerMessages&) = delete;
  PlannerMessages& operator=(const PlannerMessages&) = delete;

  /** Sends plans that share a start as one message, the preferred ones first: as many of them as there is room for. One
  alone is sent as a candidate, several as a batch.
  @pre the sizes fit (HasSizes). @return the candidates that were sent; empty if the bus did not take the message. Their
  plan_ids count on from the time of the first, microseconds, so that they grow over restarts. */
  [[nodiscard]] std::vector<candidate_plan_t> Send(const CandidateStart& start, const std::vector<Controls>& plans,
                                                   bool asks_for_repair, std::int64_t now_us);

  /** Messages that do not decode, are another planner's, or are no newer state of the robot. */
  [[nodiscard]] std::int64_t ignored() const { return ignored_; }
  [[nodiscard]] std::int64_t sent() const { return sent_; }
  /** Messages that the bus did not take. */
  [[nodiscard]] std::int64_t not_sent() const { return sender_.refused(); }

 private:
  template <class Message>
  void Hear(const std::string& channel, Handler<Message> handler);
  void HearStates(const std::string& channel, Handler<robot_state_t> handler);
  [[nodiscard]] candidate_plan_t Next(const CandidateStart& start, const Controls& plan, bool asks_for_repair,
                                      std::int64_t now_us);

  const Config& config_;
  Bus& bus_;
  Sender sender_;
  const std::string source_;
  SoleSender robot_;    // of two, it follows one
  StreamOrder states_;  // of that one
  std::int64_t next_plan_id_ = 0, sent_ = 0, ignored_ = 0;
};

}  // namespace forereach
