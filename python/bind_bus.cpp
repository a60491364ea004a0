#include <algorithm>
#include <iterator>

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "certifier/gate/repair.h"
#include "clients/planner_client.h"
#include "lcmtypes/names.h"
#include "python/arrays.h"
#include "python/bindings.h"
#include "python/judgement.h"
#include "python/waiting.h"

namespace forereach {
namespace {

class PlannerBus final {
 public:
  PlannerBus(std::shared_ptr<const JudgingTask> task, const std::string& key, const std::string& url,
             const std::string& source)
      : task_(std::move(task)), client_(task_->config(), {{}, key, url}, source, WithoutLock) {
    WarnUnless(client_.is_signed());
  }

  std::int64_t Propose(const py::object& controls, const py::object& x0, std::int64_t start,
                       std::optional<int> progress, bool repair) {
    const Eigen::MatrixXd plan = ControlsOf(controls);
    return client_.Propose(plan, StartOf({&plan, 1}, x0, start), {progress, repair});
  }

  std::vector<std::int64_t> ProposeMany(const py::object& controls, const py::object& x0, std::int64_t start,
                                        std::optional<int> progress, bool repair) {
    const std::vector<Eigen::MatrixXd> plans = ManyControlsOf(controls);
    return client_.ProposeMany(plans, StartOf(plans, x0, start), {progress, repair});
  }

  py::list Decisions(double timeout) {
    using namespace py::literals;
    py::list all;
    for (const decision_t& decision : client_.Decisions(timeout))
      all.append(py::dict("plan_id"_a = decision.plan_id, "certified"_a = decision.outcome == decision_t::CERTIFIED,
                          "outcome"_a = std::string(OutcomeName(decision.outcome)),
                          "cause"_a = std::string(CauseName(decision.cause)), "step"_a = IndexOrNone(decision.step),
                          "obstacle"_a = IndexOrNone(decision.obstacle), "utime"_a = decision.utime,
                          "elapsed_us"_a = decision.elapsed_us, "message"_a = GetText(decision.message)));
    return all;
  }

  py::list Withdrawals(double timeout) {
    using namespace py::literals;
    py::list all;
    for (const withdrawal_t& withdrawal : client_.Withdrawals(timeout))
      all.append(py::dict("plan_id"_a = withdrawal.plan_id, "valid_steps"_a = withdrawal.valid_steps,
                          "cause"_a = std::string(WithdrawalName(withdrawal.cause)), "utime"_a = withdrawal.utime,
                          "message"_a = GetText(withdrawal.message)));
    return all;
  }

  py::list Advice(double timeout) {
    using namespace py::literals;
    py::list all;
    for (const advice_t& advice : client_.Advice(timeout)) {
      py::list changes;
      const int count = std::clamp<int>(advice.num_changes, 0, static_cast<int>(std::size(advice.change)));
      for (const advice_change_t& change : std::span(advice.change, static_cast<std::size_t>(count)))
        changes.append(py::dict("kind"_a = std::string(AdviceName(change.kind)), "step"_a = IndexOrNone(change.step),
                                "index"_a = change.index, "value"_a = change.value, "clearance"_a = change.clearance,
                                "verified"_a = change.verified != 0,
                                "direction"_a = ArrayOf({change.direction, change.direction + 3}, {3})));
      all.append(py::dict("plan_id"_a = advice.plan_id, "changes"_a = changes));
    }
    return all;
  }

  py::list Repairs(double timeout) {
    using namespace py::literals;
    py::list all;
    for (const advice_t& advice : client_.Repairs(timeout)) {
      const candidate_plan_t& plan = advice.proposal;
      all.append(py::dict("plan_id"_a = advice.plan_id, "U"_a = ArrayOf(Eigen::MatrixXd(ControlsOf(plan).transpose())),
                          "progress_steps"_a = plan.progress_steps, "nearness"_a = advice.nearness[0],
                          "slower"_a = (advice.changed & kSlower) != 0, "other_tail"_a = (advice.changed & kTail) != 0,
                          "pushed"_a = (advice.changed & kPushed) != 0));
    }
    return all;
  }

  py::object RobotState(double timeout) {
    const std::optional<robot_state_t> state = client_.RobotState(timeout);
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
  // As the task judges them, with its words for what does not fit.
  CandidateStart StartOf(std::span<const Eigen::MatrixXd> plans, const py::object& x0, std::int64_t start) const {
    const auto [center, half_width] = PairOf(x0);
    CandidateStart at{start, VectorOf(center, "x0: center"), VectorOf(half_width, "x0: half_width")};
    for (const Eigen::MatrixXd& plan : plans) task_->Require(plan, Zonotope::FromBox(at.center, at.half_width));
    return at;
  }

  const std::shared_ptr<const JudgingTask> task_;
  PlannerClient client_;
};

}  // namespace

void BindBus(py::module_& module) {
  py::class_<PlannerBus>(module, "Bus",
                         R"(A planner's end of the bus: candidates out, decisions and the robot's states in.

Messages are signed and checked as those of the other processes. Only the thread that opened it may use it.)")
      .def(py::init([](std::shared_ptr<JudgingTask> task, const fs::path& key, const std::string& url,
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
      .def("withdrawals", &PlannerBus::Withdrawals, py::arg("timeout") = 0.0,
           R"(What the certifier withdrew of this source's plans since the last call. Waits up to `timeout` s for one.

valid_steps: the controls before it stand. It is repeated until the robot has answered.)")
      .def(
          "advice", &PlannerBus::Advice, py::arg("timeout") = 0.0,
          R"(With gate.advice: how refused plans of this source would have to give way, since the last call. Waits up to `timeout` s.

changes: by the step at which each is needed; kind, step, index, value, clearance, direction as in advice_change_t of
docs/bus.md.)")
      .def("repairs", &PlannerBus::Repairs, py::arg("timeout") = 0.0,
           R"(The plans that the certifier found near refused ones since the last call. Waits up to `timeout` s for one.

plan_id: of the refused candidate. U: (T, m), to be proposed like any other. nearness: m, how far its positions are from
the refused plan's. slower, other_tail, pushed: how it differs.)")
      .def("robot_state", &PlannerBus::RobotState, py::arg("timeout") = 0.0,
           R"(The newest state of the robot, if it came since the last call; otherwise None, after `timeout` s.

utime: the boundary of its step, microseconds. state: (n,).)");
}

}  // namespace forereach
