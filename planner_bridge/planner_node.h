/** The planner's node: it receives robot states, decisions and withdrawals, and sends candidates.

A round searches for a certified plan in response to one robot state. The plan starts lead_steps boundaries later, at
the state that the executing plan will have reached by then, as predicted from an estimate of the state: the errors of
single measurements count for less in it. A round begins while the robot holds still, or when that
start is at or after the end of the executing plan's progress part. No round begins while a certified plan waits for its
start. A round sends one candidate or batch at a time and waits for its decision (with planner.policy_samples what one
search gives is sent in batches, one after the other):
 - certified: the round ends, the plan waits for its start;
 - abstention S: the next candidate keeps more distance than the searches before it, by clearance_step from obstacles or
   from the limit of the task by what the tube may reach beyond it (lessons.h);
 - abstention D: the next candidate keeps further inside the domain's bounds (a policy's candidate follows another
   reference instead, policy_proposer.h);
 - abstention F: the round ends, because no candidate can be certified;
 - With gate.advice, after an abstention S or D, it waits twice gate.decision_budget_ms for the certifier's advice on
this candidate. If it comes, the next candidate gives way as it says, and not by the rules above; after a search without
a result, half as far;
 - With planner.repair, each candidate asks for the nearest plan that would be certified, and after an abstention S or D
it waits as long for the answer. When the round would end without a certificate, the nearest proposal is its last
candidate, if it can still be decided on; only controls are taken from it;
 - rejected: the next candidate; the round ends if the certifier is not armed, does not know the obstacles, or has
   latched a fault;
 - abstained, no time: the next candidate.
The first candidate of a round may be what the task's hints do (proposal.h), but not for a start that the last round
found no certificate for. A round ends without a certificate after `candidates` searches, or when too little time is
left until its start; the next state begins another round. With gate.obstacles bus, no round begins before the obstacles
are known, and a round ends when they become unknown (obstacles_in_force.h). All planning runs in Tick, one search at a
time. After the robot has reached the goal, or has reported FINISHED, no round begins.

With planner.back_off, a robot at rest that does not get away from its place for kStuckUs backs off; for kWaitsUs if it
has room to drive on from there (Proposer::HasRoom). The candidates of this round follow that law until there is room,
and then brake: for progress_steps steps or a multiple of them, for at least twice as many each time near the same
place, so that it does not end in the same dead end for ever, and for half as many after each refusal. Only the
certifier selects them.

If the executing plan is withdrawn, the round ends, and a stopping round begins at once, unless a certified plan takes
over while the plan still stands. Its candidates start at the first boundary for which a decision is in time, and not
after what stands. They have no progress part: they brake by planner.emergency_stop, in each of its ways in turn
(RobotMotion::Brake). Obstacles do not select them; the certifier does. If a plan that
waits for its start is withdrawn, or no stop is certified, the next state begins another round.

Some messages are counted and ignored: those that do not decode, that contain a number that is not finite, or that are
stamped ahead of the clock by more than gate.max_ahead_ms; obstacles that the gate would refuse (obstacles_in_force.h);
decisions on candidates of other planners; and advice that is not on the candidate that was just abstained on. */
#pragma once

#include <deque>
#include <iostream>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "bus/node.h"
#include "certifier/gate/obstacles_in_force.h"
#include "clients/planner_messages.h"
#include "planner_bridge/lessons.h"
#include "planner_bridge/proposer.h"
#include "planner_bridge/residual_estimate.h"
#include "task/config.h"

namespace forereach {

class PlannerNode final : public Node {
 public:
  static constexpr const char* kSource = "forereach-planner";

  /** @param bus must outlive the node. @param out receives the summary at Stop.
  @throws ConfigError if the planner's part of the task does not match the model. */
  PlannerNode(const Config& config, Bus& bus, std::ostream& out = std::cout);

  void Tick(std::int64_t now_us) override;
  /** True once the robot has reported FINISHED. */
  [[nodiscard]] bool done() const override { return finished_; }
  /** Prints Summary() on one line. */
  void Stop() override;

  /** As many rounds in a row without a certificate are logged, with the causes and where to look. */
  static constexpr int kLostRounds = 20;

  /** A robot that has come to rest again and again within a tenth of a second's way at cruise speed for this time is
  stuck. */
  static constexpr std::int64_t kStuckUs = 2'000'000;
  /** Likewise one that has room to drive on where it stands: what moves may be in its way, and waiting help. */
  static constexpr std::int64_t kWaitsUs = 3 * kStuckUs;

  /** One JSON object: proposed (a batch counts once), certified, abstained and rejected (counts by cause), advised
  (abstentions from which it has learned by the certifier's advice), unanswered, withdrawn (plans), rounds,
  stopping_rounds, back_off_rounds, rounds_without_certificate, searches_without_result, messages_ignored,
  messages_not_sent. */
  [[nodiscard]] std::string Summary() const;

 private:
  struct Round {
    CandidateStart start;
    Lessons lessons;
    bool stops = false;      // a stopping round
    int back_off_steps = 0;  // of its first candidate; 0: it does not back off
    int searches = 0;
    std::deque<Proposal> found = {};           // by the last search, and not sent yet
    std::int64_t awaited_plan = -1;            // the first plan whose decision is outstanding, -1 if none
    std::int64_t awaited = 0;                  // so many plans have one decision
    std::optional<decision_t> unadvised = {};  // the abstention whose advice is outstanding
    std::int64_t advice_until = 0;
    std::optional<advice_t> repair = {};  // the nearest that was proposed and not sent
  };

  [[nodiscard]] PlannerMessages::Handler<advice_t> HandlerOfAdvice();
  void OnRobotState(const robot_state_t& state, std::int64_t now_us);
  void OnDecision(const decision_t& decision, std::int64_t now_us);
  void OnAdvice(const advice_t& advice);
  [[nodiscard]] bool Heed(const advice_t& advice);
  [[nodiscard]] bool TakeRepair(const advice_t& advice);
  void OnWithdrawn(const withdrawal_t& withdrawal, std::int64_t now_us);
  void OnObstacles(const Received& received);

  [[nodiscard]] Eigen::VectorXd PlaceOf(const robot_state_t& state) const;
  [[nodiscard]] bool IsAtGoal(const robot_state_t& state) const;
  [[nodiscard]] bool IsAtRest(const robot_state_t& state) const;
  [[nodiscard]] bool NextPlanIsDue(const robot_state_t& state) const;
  [[nodiscard]] std::optional<Eigen::VectorXd> PredictStart(const robot_state_t& state, std::int64_t lead_steps) const;
  [[nodiscard]] std::int64_t StepsToAStop(std::int64_t now_us) const;
  [[nodiscard]] bool TakesOver(int valid_steps) const;
  void BeginStop(int valid_steps, std::int64_t now_us);
  [[nodiscard]] std::vector<Proposal> Propose();
  [[nodiscard]] std::optional<Proposal> StopFrom(std::span<const double> state) const;
  [[nodiscard]] std::optional<Proposal> BackOffFrom(std::span<const double> state) const;
  void SendNext(std::int64_t now_us);
  [[nodiscard]] int MostCandidates() const;
  void Follow(const robot_state_t& state);
  void Estimate(const robot_state_t& state);
  void Advance(const candidate_plan_t& plan, std::int64_t step, Eigen::VectorXd& x) const;
  [[nodiscard]] Eigen::VectorXd ErrorOf(const robot_state_t& state) const;
  [[nodiscard]] Eigen::VectorXd HalfWidthFor(const robot_state_t& state) const;
  void BeginRound(const robot_state_t& state, std::int64_t lead_steps, bool stops);
  void EndRound(bool certified);
  [[nodiscard]] std::int64_t StandsFor(const robot_state_t& state);
  [[nodiscard]] bool HasRoomFurtherBack(int steps) const;
  [[nodiscard]] int StepsBack();
  void LogLostRounds() const;
  void SearchOnce(std::int64_t now_us);
  [[nodiscard]] bool SendRepair(std::int64_t now_us);
  [[nodiscard]] bool AsksForRepairs() const;
  [[nodiscard]] int Send(const std::vector<PlannerMessages::Controls>& plans, bool asks_for_repair,
                         std::int64_t now_us);
  [[nodiscard]] PlanRequest RequestOf(const Round& round) const;
  void Learn(const decision_t& decision, std::int64_t now_us);
  void LearnWithoutAdvice();

  const Config config_;
  std::ostream& out_;
  const std::int64_t period_us_;
  const Eigen::VectorXd half_width_;  // of X_0, without the state error
  const ResidualEstimate residual_;
  const std::unique_ptr<Proposer> proposer_;
  const RobotMotion hardest_;  // the ways to stop after a withdrawal

  std::optional<Round> round_;
  std::optional<Eigen::VectorXd> refused_center_;   // of the last round without a certificate
  std::map<std::int64_t, candidate_plan_t> plans_;  // sent, undecided or certified, and not superseded
  std::optional<std::int64_t> waiting_start_;       // start of a certified plan that has not begun yet
  std::int64_t waiting_plan_ = -1;                  // its plan_id
  robot_state_t last_state_{};                      // of the robot, the newest; num_states 0: none yet
  Eigen::VectorXd estimate_;                        // of its true state then
  std::map<std::int64_t, int> withdrawn_;           // valid_steps, of plans in plans_
  ObstaclesInForce obstacles_;
  PlannerMessages messages_;
  Digest planned_among_{};  // the digest of the obstacles that proposer_ has from a message
  bool arrived_ = false, finished_ = false;

  std::int64_t searches_ = 0, fruitless_searches_ = 0, certified_ = 0, unanswered_ = 0, rounds_ = 0,
               stopping_rounds_ = 0, back_off_rounds_ = 0, withdrawals_ = 0, advised_ = 0, repairs_ = 0,
               fruitless_rounds_ = 0, ignored_ = 0;
  std::map<std::string, std::int64_t> abstained_, rejected_;  // by cause
  int lost_in_a_row_ = 0;                                     // rounds that searched and found no certificate
  Eigen::VectorXd place_;                                     // in safety coordinates, empty: nowhere yet
  std::int64_t there_since_ = 0;                              // its first round there, or its last to back off
  std::optional<Eigen::VectorXd> stuck_at_;                   // the place where it last backed off
  int doublings_ = 0;                                         // of the time for which it backs off there
};

}  // namespace forereach
