#include <exception>
#include <stdexcept>
#include <utility>

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "clients/robot_client.h"
#include "python/arrays.h"
#include "python/bindings.h"
#include "python/judgement.h"
#include "python/waiting.h"

namespace forereach {
namespace {

// A robot that is an object of Python. Its functions take Python's lock, which is free while messages come. What its
// functions raise stops the robot and goes to sys.unraisablehook, or, what is to end the program (KeyboardInterrupt,
// SystemExit), to the caller of the supervisor. Or it is None: the caller measures and holds.
class PythonRobot final : public RobotClient::Robot {
 public:
  explicit PythonRobot(py::object robot) : robot_(std::move(robot)) {}

  // Takes what the caller measured of a robot that is None. Any other measures itself, and two answers could differ.
  void Measured(const py::object& state, const py::object& error, int num_states) {
    if (state.is_none() == robot_.is_none() || (state.is_none() && !error.is_none()))
      throw std::invalid_argument("state: has to be given to boundary if the supervisor has no robot, and only then");
    if (state.is_none()) return;
    const auto numbers = [&](const py::object& given, const char* name) {
      const Eigen::VectorXd vector = VectorOf(given, name);
      if (vector.size() != num_states)
        throw std::invalid_argument(std::string(name) + ": " + std::to_string(vector.size()) + " entries, must have " +
                                    std::to_string(num_states));
      return std::vector<double>(vector.begin(), vector.end());
    };
    state_ = numbers(state, "state");
    error_ = error.is_none() ? std::vector<double>() : numbers(error, "state_error");
  }

  // Without a robot: what the caller gave at the last boundary. Empty before the first; until then nothing is executed
  // or reported.
  std::span<const double> state() const override { return robot_.is_none() ? state_ : Numbers("state", state_); }
  std::span<const double> state_error() const override {
    return Has("state_error") ? Numbers("state_error", error_) : error_;
  }
  void Hold() override {
    if (robot_.is_none())
      has_to_hold_ = true;
    else
      Call("hold", [&](const py::object& hold) { hold(); });
  }
  int StepsToRest(std::span<const double> lower, std::span<const double> upper) const override {
    if (!Has("steps_to_rest")) return Robot::StepsToRest(lower, upper);
    int steps = 0;
    const auto array = [](std::span<const double> x) { return ArrayOf({x.begin(), x.end()}, {std::ssize(x)}); };
    Call("steps_to_rest", [&](const py::object& rest) { steps = rest(array(lower), array(upper)).cast<int>(); });
    if (steps < 0) throw std::runtime_error("steps_to_rest: negative");
    return steps;
  }
  void Reload() override {
    if (Has("reload")) Call("reload", [&](const py::object& reload) { reload(); });
  }

  // Whether nothing is to be waited for: its caller has to hold it, or the program ends.
  [[nodiscard]] bool is_interrupted() const { return has_to_hold_ || interrupt_ != nullptr; }
  void BeginWaiting() { has_to_hold_ = false; }
  void RaiseInterrupt() {
    if (interrupt_) std::rethrow_exception(std::exchange(interrupt_, nullptr));
  }

 private:
  bool Has(const char* name) const {
    const py::gil_scoped_acquire lock;
    return py::hasattr(robot_, name);
  }

  template <class Use>
  void Call(const char* name, const Use& use) const {
    const py::gil_scoped_acquire lock;
    try {
      use(robot_.attr(name));
    } catch (py::error_already_set& error) {
      if (error.matches(PyExc_Exception))
        error.discard_as_unraisable(name);
      else
        interrupt_ = std::current_exception();
      throw std::runtime_error(std::string(name) + " of the robot raised an exception");
    } catch (const std::exception& error) {
      PyErr_SetString(PyExc_ValueError, error.what());
      PyErr_WriteUnraisable(robot_.ptr());
      throw std::runtime_error(std::string(name) + " of the robot returned what cannot be used");
    }
  }

  std::span<const double> Numbers(const char* name, std::vector<double>& kept) const {
    Call(name, [&](const py::object& numbers) {
      const Eigen::VectorXd vector = VectorOf(numbers(), name);
      kept.assign(vector.begin(), vector.end());
    });
    return kept;
  }

  const py::object robot_;
  mutable std::vector<double> state_, error_;
  mutable std::exception_ptr interrupt_;
  bool has_to_hold_ = false;
};

class BusSupervisor final {
 public:
  BusSupervisor(const std::shared_ptr<const JudgingTask>& task, py::object robot, const std::string& key,
                const std::string& url)
      : robot_(std::move(robot)), client_(task->config(), {{}, key, url}, robot_, WithoutLock) {
    WarnUnless(client_.is_signed());
  }
  BusSupervisor(const BusSupervisor&) = delete;
  BusSupervisor& operator=(const BusSupervisor&) = delete;

  void Listen(std::int64_t until_utime) {
    robot_.BeginWaiting();
    client_.Listen(until_utime, [this] { return robot_.is_interrupted(); });
    robot_.RaiseInterrupt();
  }
  py::object Boundary(std::int64_t utime, bool ends, const py::object& state, const py::object& error) {
    static_cast<void>(client_.supervisor());  // of this thread
    robot_.Measured(state, error, client_.problem().model->num_states());
    const py::object control = Control(client_.Boundary(utime, ends));
    robot_.RaiseInterrupt();
    return control;
  }
  py::object Control() { return Control(client_.supervisor().control()); }
  void Expect(const JudgingTask& task) { client_.Expect(task.config()); }
  bool halted() { return client_.supervisor().halted(); }

  py::dict Counts() {
    const Supervisor::Counts& counts = client_.supervisor().counts();
    using namespace py::literals;
    return py::dict(
        "boundaries"_a = counts.boundaries, "steps"_a = counts.steps, "steps_inside"_a = counts.steps_inside,
        "steps_consistent"_a = counts.steps_consistent, "accepted"_a = counts.accepted, "started"_a = counts.started,
        "emergency_stops"_a = counts.emergency_stops, "errors"_a = counts.errors,
        "failed_sends"_a = counts.failed_sends, "reports_lost"_a = counts.reports_lost, "refused"_a = counts.refused);
  }

 private:
  static py::object Control(std::span<const double> control) {
    if (control.empty()) return py::none();
    return ArrayOf({control.begin(), control.end()}, {std::ssize(control)});
  }

  PythonRobot robot_;
  RobotClient client_;
};

}  // namespace

void BindSupervisor(py::module_& module) {
  py::class_<BusSupervisor>(module, "Supervisor",
                            R"(The robot's end of the bus: it executes certified plans and nothing else.

It is the C++ Supervisor (robot/supervisor.h), which calls `robot`: state() -> (n,), as measured last; hold(), which
comes to rest by its own means; and, where it has them, steps_to_rest(lower, upper) -> int, state_error() -> (n,),
reload(). An exception in one of them stops the robot and goes to sys.unraisablehook. Only the thread that made it may
use it.

Without a `robot` you give each boundary its state, and come to rest by your own means where `control` is None.)")
      .def(py::init(
               [](std::shared_ptr<JudgingTask> task, py::object robot, const fs::path& key, const std::string& url) {
                 return std::make_unique<BusSupervisor>(task, std::move(robot), key, url);
               }),
           py::arg("task"), py::arg("robot") = py::none(), py::arg("key") = "", py::arg("url") = "",
           "key: the robot's key file, or a directory with it; url: of the bus. By default those of the task.")
      .def("listen", &BusSupervisor::Listen, py::arg("until_utime"),
           R"(Takes plans, withdrawals, faults and commands until this time, microseconds since the Unix epoch.

Without a `robot` it returns sooner if the control ends before its step does: hold at once, and listen on.)")
      .def("boundary", &BusSupervisor::Boundary, py::arg("utime"), py::arg("ends") = false,
           py::arg("state") = py::none(), py::arg("state_error") = py::none(),
           R"(Handles the step boundary that was due at `utime`. ends: no further plan starts.

state: (n,), as measured last, and state_error: (n,), how far it may be off, by default the task's; both only without a
`robot`. Returns the control to apply until the next boundary, (m,); None: hold.)")
      .def_property_readonly("control", py::overload_cast<>(&BusSupervisor::Control),
                             "The control under way, until a stop or a withdrawal ends it; None: hold.")
      .def("expect", &BusSupervisor::Expect, py::arg("task"), "After reload(): also accepts plans under this task.")
      .def_property_readonly("halted", &BusSupervisor::halted, "Until an operator's reset.")
      .def_property_readonly("counts", &BusSupervisor::Counts, "How often what has happened.");
}

}  // namespace forereach
