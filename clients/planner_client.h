/** A planner's end of the bus: candidates out; decisions, withdrawals, advice and the robot's states in. What a planner
of your own links: ForeReach::planner_client.

It reads the task file for sizes, channels, the steps' time, the bus and its key. Messages are signed and checked as
those of the other processes, and only what answers this planner, by its name, is handed out. What came waits until it
is asked for, the newest kMostWaiting of each kind. Only the thread that made it may use it.

    PlannerClient planner({"task.yaml", "keys"}, "my_planner");
    while (const auto state = planner.RobotState(1)) {
      planner.Propose(controls, {state->utime + 5 * planner.step_us(), center, half_width});
      for (const decision_t& decision : planner.Decisions(0.1)) ... decision.outcome == decision_t::CERTIFIED
    }
*/
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "clients/candidate_start.h"
#include "clients/client_options.h"
#include "forereach/advice_t.hpp"
#include "forereach/certify/problem.h"
#include "forereach/decision_t.hpp"
#include "forereach/robot_state_t.hpp"
#include "forereach/safety/obstacle.h"
#include "forereach/withdrawal_t.hpp"
#include "lcmtypes/codec.h"

namespace forereach {

struct Config;

/** What is said of a candidate besides its controls and its start. */
struct CandidateRequest {
  std::optional<int> progress_steps = {};  ///< The controls before the braking tail; nothing: all.
  bool repair = false;  ///< After an abstention D or S asks for the nearest plan that would be certified (Repairs).
};

class PlannerClient final {
 public:
  static constexpr std::size_t kMostWaiting = 4096;

  /** @param source the planner's name, 1 to 31 characters.
  @throws BadInput, with one line for people, if task, key or bus cannot be used; std::invalid_argument for the name. */
  PlannerClient(const ClientOptions& options, const std::string& source);
  /** The same of a task that was read before. @param around opened_bus.h. */
  PlannerClient(const Config& task, const ClientOptions& instead, const std::string& source,
                const std::function<void(const std::function<void()>&)>& around);
  ~PlannerClient();

  /** Of the task: what is certified, the obstacles of its file, and the time of one step. */
  [[nodiscard]] const Problem& problem() const;
  [[nodiscard]] const std::vector<Obstacle>& obstacles() const;
  [[nodiscard]] std::int64_t step_us() const;
  /** Whether it has a key. */
  [[nodiscard]] bool is_signed() const;

  /** Sends a candidate. @param controls m-by-T, one column for each step, input units. @return its plan_id.
  @throws std::invalid_argument if a size does not fit or a number is not finite; std::runtime_error if the bus does not
  take it. */
  std::int64_t Propose(const Eigen::MatrixXd& controls, const CandidateStart& start,
                       const CandidateRequest& request = {});
  /** Sends candidates that share a start as one message, the preferred ones first. One decision comes: on the first
  that is certified, otherwise on the first of them. @return their plan_ids. @throws as above, and std::invalid_argument
  unless all fit into one message (lcmtypes/candidate_batch.h), or if there is none. */
  std::vector<std::int64_t> ProposeMany(std::span<const Eigen::MatrixXd> controls, const CandidateStart& start,
                                        const CandidateRequest& request = {});

  /** What came since the last call. Each waits up to `timeout_s` seconds for one message of its kind.
  @throws std::invalid_argument unless it is a number that is not negative. */
  ///@{
  [[nodiscard]] std::vector<decision_t> Decisions(double timeout_s = 0);
  /** Of a plan under way the controls before valid_steps stand. Repeated until the robot has answered. */
  [[nodiscard]] std::vector<withdrawal_t> Withdrawals(double timeout_s = 0);
  /** With gate.advice: by how much a candidate would have to give way (docs/advise.md). */
  [[nodiscard]] std::vector<advice_t> Advice(double timeout_s = 0);
  /** Advice with a plan near a refused one, `proposal`, to be proposed like any other. Its sizes fit. */
  [[nodiscard]] std::vector<advice_t> Repairs(double timeout_s = 0);
  /** The newest alone; its numbers are usable. */
  [[nodiscard]] std::optional<robot_state_t> RobotState(double timeout_s = 0);
  ///@}

 private:
  struct Core;
  const std::unique_ptr<Core> core_;
};

/** The controls of a plan in a message, m-by-T. @pre its sizes fit, as those of Repairs. */
[[nodiscard]] Eigen::MatrixXd ControlsOf(const candidate_plan_t& plan);

}  // namespace forereach
