#include <cmath>
#include <deque>
#include <stdexcept>

#include <pybind11/stl.h>

#include "certifier/gate/candidate_message.h"
#include "certifier/gate/repair.h"
#include "certifier/gate/robot_messages.h"
#include "certifier/gate/stamp.h"
#include "forereach/advice_t.hpp"
#include "forereach/candidate_plan_t.hpp"
#include "forereach/decision_t.hpp"
#include "forereach/robot_state_t.hpp"
#include "lcmtypes/candidate_batch.h"
#include "lcmtypes/names.h"
#include "python/arrays.h"
#include "python/bindings.h"
#include "python/judgement.h"
#include "python/open_bus.h"

namespace forereach {
namespace {

std::int64_t In(double seconds) {
  if (!(seconds >= 0)) throw std::invalid_argument("timeout: must be a number of seconds that is not negative");
  return WallClockUs() + static_cast<std::int64_t>(std::min(seconds, 1e9) * 1e6);
}

// A planner's end of the bus.
class PlannerBus final {
 public:
  PlannerBus(std::shared_ptr<const JudgingTask> task, const std::string& key, const std::string& url,
             std::string source)
      : task_(std::move(task)), opened_(task_->config(), Role::kPlanner, key, url), source_(std::move(source)) {
    const BusOptions& channels = opened_.config().bus;
    if (source_.empty() || source_.size() >= sizeof(candidate_plan_t::source))
      throw std::invalid_argument("source: must be a name of 1 to 31 characters");
    opened_.bus().Subscribe(channels.decision, [this](const Received& received) {
      const auto decision = Decoded<decision_t>(received.bytes);
      if (decision && GetText(decision->source) == source_) decisions_.push_back(*decision);
    });
    opened_.bus().Subscribe(channels.advice, [this](const Received& received) {
      const auto advice = Decoded<advice_t>(received.bytes);
      if (advice && GetText(advice->source) == source_ && HasPlan(*advice)) repairs_.push_back(*advice);
    });
    opened_.bus().Subscribe(channels.robot_state, [this](const Received& received) { OnState(received); });
  }

  std::int64_t Propose(const py::object& controls, const py::object& x0, std::int64_t start,
                       std::optional<int> progress, bool repair) {
    const std::int64_t now = WallClockUs(), plan_id = std::max(last_plan_id_ + 1, now);
    Send(CandidateOf(ControlsOf(controls), x0, start, progress, repair, now, plan_id), plan_id);
    return plan_id;
  }

  std::vector<std::int64_t> ProposeMany(const py::object& controls, const py::object& x0, std::int64_t start,
                                        std::optional<int> progress, bool repair) {
    const std::int64_t now = WallClockUs(), first = std::max(last_plan_id_ + 1, now);
    std::vector<std::int64_t> plan_ids;
    candidate_batch_t batch{};
    for (const Eigen::MatrixXd& plan : ManyControlsOf(controls)) {
      plan_ids.push_back(first + std::ssize(plan_ids));
      if (!Append(batch, CandidateOf(plan, x0, start, progress, repair, now, plan_ids.back())))
        throw std::invalid_argument("Us: at most " + std::to_string(kMaxBatch) + " plans and " +
                                    std::to_string(kMaxBatchNumbers) + " numbers fit into one message");
    }
    if (plan_ids.empty()) throw std::invalid_argument("Us: has no plan");
    Send(batch, plan_ids.back());
    return plan_ids;
  }

  py::list Decisions(double timeout) {
    opened_.Listen(In(timeout), [this] { return !decisions_.empty(); });
    using namespace py::literals;
    py::list all;
    for (const decision_t& decision : std::exchange(decisions_, {}))
      all.append(py::dict("plan_id"_a = decision.plan_id, "certified"_a = decision.outcome == decision_t::CERTIFIED,
                          "outcome"_a = std::string(OutcomeName(decision.outcome)),
                          "cause"_a = std::string(CauseName(decision.cause)), "step"_a = IndexOrNone(decision.step),
                          "obstacle"_a = IndexOrNone(decision.obstacle), "utime"_a = decision.utime,
                          "elapsed_us"_a = decision.elapsed_us, "message"_a = GetText(decision.message)));
    return all;
  }

  py::list Repairs(double timeout) {
    opened_.Listen(In(timeout), [this] { return !repairs_.empty(); });
    using namespace py::literals;
    py::list all;
    for (const advice_t& advice : std::exchange(repairs_, {})) {
      const candidate_plan_t& plan = advice.proposal;
      std::vector<double> controls;
      for (int t = 0; t < plan.num_steps; ++t)
        controls.insert(controls.end(), plan.control[t], plan.control[t] + plan.num_inputs);
      all.append(py::dict("plan_id"_a = advice.plan_id, "U"_a = ArrayOf(controls, {plan.num_steps, plan.num_inputs}),
                          "progress_steps"_a = plan.progress_steps, "nearness"_a = advice.nearness[0],
                          "slower"_a = (advice.changed & kSlower) != 0, "other_tail"_a = (advice.changed & kTail) != 0,
                          "pushed"_a = (advice.changed & kPushed) != 0));
    }
    return all;
  }

  py::object RobotState(double timeout) {
    opened_.Listen(In(timeout), [this] { return state_.has_value(); });
    const std::optional<robot_state_t> state = std::exchange(state_, std::nullopt);
    if (!state) return py::none();
    using namespace py::literals;
    const char* const mode = state->mode == robot_state_t::EXECUTING  ? "executing"
                             : state->mode == robot_state_t::STANDING ? "standing"
                                                                      : "finished";
    return py::dict("utime"_a = state->utime, "mode"_a = mode,
                    "state"_a = ArrayOf({state->state, state->state + state->num_states}, {state->num_states}),
                    "executing_plan_id"_a = IndexOrNone(state->executing_plan_id),
                    "executing_step"_a = IndexOrNone(state->executing_step));
  }

 private:
  candidate_plan_t CandidateOf(const Eigen::MatrixXd& plan, const py::object& x0, std::int64_t start,
                               std::optional<int> progress, bool repair, std::int64_t now_us,
                               std::int64_t plan_id) const {
    const auto [given_center, given_width] = PairOf(x0);
    const Eigen::VectorXd center = VectorOf(given_center, "x0: center"),
                          width = VectorOf(given_width, "x0: half_width");
    task_->Require(plan, Zonotope::FromBox(center, width));
    candidate_plan_t candidate{};
    candidate.utime = now_us;
    candidate.sequence = proposed_;
    candidate.plan_id = plan_id;
    SetText(candidate.source, source_);
    candidate.start_utime = start;
    candidate.step_us = Microseconds(task_->config().robot.step_period_ms);
    SetPlan(candidate, center, width, plan);
    if (progress && (*progress < 0 || *progress > plan.cols()))
      throw std::invalid_argument("progress_steps: " + std::to_string(*progress) + ", must be 0 to the steps of U");
    candidate.progress_steps = static_cast<std::int16_t>(progress.value_or(candidate.num_steps));
    candidate.repair = repair ? 1 : 0;
    return candidate;
  }

  [[nodiscard]] bool HasPlan(const advice_t& advice) const {
    const candidate_plan_t& plan = advice.proposal;
    return advice.changed != 0 && HasSizes(plan, task_->model()) && plan.progress_steps >= 0 &&
           plan.progress_steps <= plan.num_steps;
  }

  template <class Message>
  void Send(const Message& message, std::int64_t last_plan_id) {
    opened_.Send(opened_.config().bus.candidate, Encode(message));
    last_plan_id_ = last_plan_id;
    ++proposed_;
  }

  void OnState(const Received& received) {
    const auto state = Decoded<robot_state_t>(received.bytes);
    if (state && TakeState(*state, task_->model().num_states(), received.utime, task_->config().gate, states_))
      state_ = state;
  }

  const std::shared_ptr<const JudgingTask> task_;
  const OpenedBus opened_;
  const std::string source_;
  std::deque<decision_t> decisions_;
  std::deque<advice_t> repairs_;
  std::optional<robot_state_t> state_;
  StreamOrder states_;
  std::int64_t proposed_ = 0, last_plan_id_ = 0;
};

}  // namespace

void BindBus(py::module_& module) {
  py::class_<PlannerBus>(module, "Bus",
                         R"(A planner's end of the bus: candidates out, decisions and the robot's states in.

Messages are signed and checked as those of the other processes. Only the thread that opened it may use it.)")
      .def(py::init([](std::shared_ptr<JudgingTask> task, const std::string& key, const std::string& url,
                       const std::string& source) { return std::make_unique<PlannerBus>(task, key, url, source); }),
           py::arg("task"), py::arg("key") = "", py::arg("url") = "", py::arg("source") = "python",
           "key: the planner's key file, or a directory with it; url: of the bus. By default those of the task.")
      .def("propose", &PlannerBus::Propose, py::arg("U"), py::arg("x0"), py::arg("start"),
           py::arg("progress_steps") = py::none(), py::arg("repair") = false,
           R"(Sends a candidate, and returns its plan_id.

U: (T, m). x0: (center, half_width), (n,) each: where the robot is expected at `start`, microseconds since the Unix
epoch, at a boundary of its steps. progress_steps: the controls before the braking tail. repair: after an abstention D
or S the certifier is asked for the nearest plan that it would certify, see repairs().)")
      .def("propose_many", &PlannerBus::ProposeMany, py::arg("Us"), py::arg("x0"), py::arg("start"),
           py::arg("progress_steps") = py::none(), py::arg("repair") = false,
           R"(Sends candidates that share x0 as one message, the preferred ones first, and returns their plan_ids.

One decision comes: on the first that is certified, otherwise on the first of them. Us: (B, T, m), at most 256 plans and
7680 numbers; the rest as of propose.)")
      .def("decisions", &PlannerBus::Decisions, py::arg("timeout") = 0.0,
           "The decisions on candidates of this source that came since the last call. Waits up to `timeout` s for one.")
      .def("repairs", &PlannerBus::Repairs, py::arg("timeout") = 0.0,
           R"(The plans that the certifier found near refused ones since the last call. Waits up to `timeout` s for one.

plan_id: of the refused candidate. U: (T, m), to be proposed like any other. nearness: m, how far its positions are from
the refused plan's. slower, other_tail, pushed: how it differs.)")
      .def("robot_state", &PlannerBus::RobotState, py::arg("timeout") = 0.0,
           R"(The newest state of the robot, if it came since the last call; otherwise None, after `timeout` s.

utime: the boundary of its step, microseconds. state: (n,).)");
}

}  // namespace forereach
