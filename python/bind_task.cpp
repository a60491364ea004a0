#include <algorithm>
#include <iterator>

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "forereach/certify/tube.h"
#include "forereach/numerics/directed.h"
#include "forereach/numerics/parallel.h"
#include "identify/declare_by.h"
#include "identify/declare_data.h"
#include "identify/fit.h"
#include "identify/proposal.h"
#include "lcmtypes/names.h"
#include "python/arrays.h"
#include "python/bindings.h"
#include "python/judgement.h"
#include "records/outlines.h"
#include "task/config_text.h"
#include "task/wrapped_angle.h"

namespace forereach {
namespace {

using TaskPointer = std::shared_ptr<JudgingTask>;
using JudgementPointer = std::shared_ptr<const Judgement>;
using WithoutGil = py::call_guard<py::gil_scoped_release>;

// ---- Tasks.

// A dict becomes JSON, which is YAML, a key a line.
std::string TextOf(const py::object& task) {
  if (py::isinstance<py::str>(task)) return task.cast<std::string>();
  if (!py::isinstance<py::dict>(task)) throw std::invalid_argument("task: must be a dict or the text of a task file");
  const py::cpp_function plain([](const py::object& value) -> py::object {
    if (py::hasattr(value, "tolist")) return value.attr("tolist")();  // NumPy's
    throw std::invalid_argument("task: " + py::repr(value).cast<std::string>() + " is no value of a task file");
  });
  return py::module_::import("json")
      .attr("dumps")(task, py::arg("indent") = 1, py::arg("ensure_ascii") = false, py::arg("default") = plain)
      .cast<std::string>();
}

Eigen::MatrixXd RowsOf(const py::handle& given, const std::string& name) {
  const py::array_t<double> numbers = NumbersOf(given, name, 2);
  return Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
      numbers.data(), numbers.shape(0), numbers.shape(1));
}

TaskPointer MakeTask(const py::object& task, const fs::path& path, const py::object& data, const py::kwargs& keys) {
  if (task.is_none() == keys.empty())
    throw std::invalid_argument("task: must be a dict or a text, or its keys by name");
  py::object whole = task.is_none() ? keys : task;
  if (keys.contains("equations") || keys.contains("L"))
    whole = py::module_::import("forereach._task").attr("spelled_out")(**keys);
  std::optional<Transitions> transitions;
  if (!data.is_none()) {
    const bool has_durations = py::isinstance<py::tuple>(data) && py::len(data) == 3;
    const auto [z, next] = PairOf(has_durations ? data[py::slice(0, 2, 1)] : data, "data");
    transitions = Transitions{RowsOf(z, "data: z"), RowsOf(next, "data: x_next")};
    if (has_durations) transitions->longer = VectorOf(data[py::int_(2)], "data: dt_error");
    if (py::isinstance<py::dict>(whole)) {
      whole = whole.attr("copy")();
      whole.attr("setdefault")("transitions", "data");
    }
  }
  const std::string text = TextOf(whole);
  const py::gil_scoped_release release;
  return std::make_shared<JudgingTask>(ConfigOfText(path, text, transitions ? &*transitions : nullptr));
}

TaskPointer LoadTaskFile(const fs::path& path) { return std::make_shared<JudgingTask>(LoadConfig(path)); }

// ---- Certifying.

Box BoxOf(const py::handle& x0) {
  const auto [center, half_width] = PairOf(x0);
  return Box::FromCenter(VectorOf(center, "x0: center"), VectorOf(half_width, "x0: half_width"));
}

JudgementPointer CertifyPlan(const JudgingTask& task, const py::object& controls, const py::object& x0) {
  std::vector<Eigen::MatrixXd> plans{ControlsOf(controls)};
  std::vector<Box> sets;
  if (!x0.is_none()) sets.push_back(BoxOf(x0));
  const py::gil_scoped_release release;
  return task.Certify(std::move(plans), std::move(sets), 1).front();
}

// One X_0, or with center and half_width of (B, n) one for each plan.
std::vector<Box> BoxesOf(const py::object& x0) {
  if (x0.is_none()) return {};
  const auto [center, half_width] = PairOf(x0);
  if (const py::array array = py::array::ensure(center); !array || array.ndim() != 2) return {BoxOf(x0)};
  const py::array_t<double> centers = NumbersOf(center, "x0: center", 2),
                            widths = NumbersOf(half_width, "x0: half_width", 2);
  if (centers.shape(0) == 0 || centers.shape(0) != widths.shape(0))
    throw std::invalid_argument("x0: " + std::to_string(centers.shape(0)) + " centers and " +
                                std::to_string(widths.shape(0)) + " half-widths, must be as many, and at least 1");
  std::vector<Box> boxes;
  const auto row = [](const py::array_t<double>& rows, py::ssize_t i) {
    return Eigen::VectorXd(Eigen::Map<const Eigen::VectorXd>(rows.data(i, 0), rows.shape(1)));
  };
  for (py::ssize_t i = 0; i < centers.shape(0); ++i) boxes.push_back(Box::FromCenter(row(centers, i), row(widths, i)));
  return boxes;
}

Judgements CertifyPlans(const JudgingTask& task, const py::object& controls, const py::object& x0,
                        std::optional<unsigned> threads, bool until_certified) {
  std::vector<Eigen::MatrixXd> plans = ManyControlsOf(controls);
  std::vector<Box> sets = BoxesOf(x0);
  const py::gil_scoped_release release;
  return task.Certify(std::move(plans), std::move(sets), threads.value_or(AllCores()), until_certified);
}

std::string AddObservation(JudgingTask& task, const py::object& z, const py::object& next) {
  const Eigen::VectorXd at = VectorOf(z, "z"), to = VectorOf(next, "x_next");
  const py::gil_scoped_release release;
  return Explain(task.Observe({at.begin(), at.end()}, {to.begin(), to.end()}));
}

// ---- Decisions.

py::object Clearance(const Judgement& judgement) {
  const Decision& decision = judgement.decision;
  const bool is_of_obstacle =
      decision.obstacle >= 0 && (decision.outcome == Outcome::kCertified || decision.cause == Cause::kObstacle);
  if (!is_of_obstacle) return py::none();
  return py::float_(SubDown(decision.margin, decision.threshold));
}

py::list PolygonsOf(const std::vector<Picture::Polygon>& polygons) {
  py::list all;
  for (const Picture::Polygon& polygon : polygons) {
    Eigen::MatrixXd corners(static_cast<Eigen::Index>(polygon.size()), 2);
    for (std::size_t i = 0; i < polygon.size(); ++i) corners.row(static_cast<Eigen::Index>(i)) = polygon[i];
    all.append(ArrayOf(corners));
  }
  return all;
}

py::dict PictureDict(const Judgement& judgement) {
  const Picture picture = [&] {
    const py::gil_scoped_release release;
    return PictureOf(judgement);
  }();
  py::list half_planes;
  std::vector<Picture::Polygon> obstacles, predictions;
  for (const Obstacle& obstacle : picture.obstacles) {
    const std::int64_t stamp = obstacle.motion() ? obstacle.motion()->stamp_us : 0;
    for (const Obstacle& convex : obstacle.convex())
      if (convex.kind() == Obstacle::Kind::kHalfSpace) {
        const auto& normal = convex.points()[0];
        half_planes.append(py::make_tuple(normal.x(), normal.y(), convex.offset()));
      } else if (const auto place = PlaceOf(convex, static_cast<double>(stamp))) {
        obstacles.push_back(HullOf(place->points, place->radius));
      }
    std::ranges::move(PredictionOf(obstacle, stamp), std::back_inserter(predictions));
  }
  using namespace py::literals;
  return py::dict("tube"_a = PolygonsOf(picture.certified), "path"_a = PolygonsOf({picture.path})[0],
                  "obstacles"_a = PolygonsOf(obstacles), "half_planes"_a = half_planes,
                  "predictions"_a = PolygonsOf(predictions));
}

py::array_t<double> PerState(const TubeNumbers& tube, const std::vector<double>& numbers) {
  return ArrayOf(numbers, {tube.length + 1, tube.num_states});
}

py::list GeneratorsOf(const TubeNumbers& tube) {
  py::list all;
  for (const Eigen::MatrixXd& generators : tube.generators) all.append(ArrayOf(generators));
  return all;
}

// ---- What would turn a decision, and what data say.

py::list AdviceList(const Judgement& judgement) {
  const std::vector<Advice> found = [&] {
    const py::gil_scoped_release release;
    return AdviseOn(judgement);
  }();
  using namespace py::literals;
  py::list all;
  for (const Advice& advice : found)
    all.append(py::dict("change"_a = Name(advice.change), "what"_a = advice.what, "amount"_a = advice.amount,
                        "turns"_a = advice.turns));
  return all;
}

// The task's problem with all that it observed. What is estimated from angles that jump by a turn is wrong.
std::shared_ptr<const Problem> WithoutWrappedAngle(const JudgingTask& task) {
  const std::shared_ptr<const Problem> problem = task.problem();
  RequireNoWrappedAngle(task.config().path, "observations", task.model(), problem->transitions);
  return problem;
}

py::array_t<double> PerCoordinate(const Eigen::VectorXd& vector) {
  return ArrayOf({vector.begin(), vector.end()}, {vector.size()});
}

py::dict Declare(const JudgingTask& task, const std::vector<std::string>& by, double factor, bool noise,
                 bool disturbance) {
  ProposalOptions options{factor, noise, disturbance, ColumnsBy(by, task.model())};
  if (!(factor >= 1)) throw std::invalid_argument("factor: must be at least 1");
  HeldOutSteps held_out;
  const Declaration found = [&] {
    const py::gil_scoped_release release;
    const std::shared_ptr<const Problem> problem = WithoutWrappedAngle(task);
    try {
      const Observations observations = ObserveForProposal(*problem, problem->transitions);
      Declaration declaration = Propose(problem->declaration, observations, options).declaration;
      held_out = JudgeByHeldOut(task.config(), declaration, AllCores());
      return declaration;
    } catch (const Unexplained& unexplained) {
      throw ConfigError(task.config().path + ": " + Explain(unexplained, task.config(), options));
    }
  }();
  Eigen::VectorXd disturbance_bound(found.noise_bound.size());
  for (Eigen::Index k = 0; k < disturbance_bound.size(); ++k) disturbance_bound[k] = found.DisturbanceBound(k);
  using namespace py::literals;
  return py::dict("lipschitz"_a = ArrayOf(found.lipschitz), "noise_bound"_a = PerCoordinate(found.noise_bound),
                  "disturbance"_a = PerCoordinate(disturbance_bound),
                  "yaml"_a = "declaration:\n" + DeclarationYaml(found, task.model()),
                  "held_out_slices"_a = held_out.slices(), "held_out_outside"_a = held_out.left,
                  "warning"_a = WarningOf(held_out));
}

// The observations, or the executed steps of a log. As `forereach fit`, it takes those outside the domain, too.
Transitions StepsToFit(const JudgingTask& task, const py::object& log) {
  if (log.is_none()) {
    const py::gil_scoped_release release;
    return WithoutWrappedAngle(task)->transitions;
  }
  const auto [z, next] = PairOf(py::module_::import("forereach._task").attr("steps_of")(log, task.config().period));
  const Transitions steps{RowsOf(z, "log: z"), RowsOf(next, "log: x_next")};
  const NominalModel& model = task.model();
  if (steps.z.cols() != model.num_variables() || steps.x_next.cols() != model.num_states())
    throw ConfigError("log: " + std::to_string(steps.x_next.cols()) + " states, and with inputs " +
                      std::to_string(steps.z.cols()) + "; the model has " + std::to_string(model.num_states()) +
                      " and " + std::to_string(model.num_variables()));
  RequireNoWrappedAngle(task.config().path, "log", model, steps);
  return steps;
}

py::dict FitOf(const JudgingTask& task, const py::object& log, const std::vector<std::string>& names) {
  const ModelText* text = task.model().text();
  if (!text)
    throw ConfigError(task.config().path + ": model: " + task.model().name() +
                      " is compiled; only the parameters of a model as text can be fitted");
  std::vector<std::string> those = names;
  if (names.empty())
    for (const ModelText::Parameter& parameter : text->parameters)
      if (parameter.name != "dt") those.push_back(parameter.name);
  const Transitions steps = StepsToFit(task, log);
  const Fit fit = [&] {
    const py::gil_scoped_release release;
    return FitParameters(*text, steps, those);
  }();
  using namespace py::literals;
  py::dict parameters, deviations;
  for (const FittedParameter& each : fit.parameters) {
    parameters[each.name.c_str()] = each.after;
    deviations[each.name.c_str()] = each.deviation;
  }
  return py::dict("parameters"_a = parameters, "deviations"_a = deviations, "before"_a = ArrayOf(fit.before),
                  "after"_a = ArrayOf(fit.after), "converged"_a = fit.converged);
}

void BindDecision(py::module_& module) {
  py::class_<TubeNumbers>(module, "Tube",
                          R"(The reachable slices X_0 .. X_T that were computed, in the units of the states.

An abstention's tube ends at the slice that failed; one before any step has no slice.)")
      .def("__len__", [](const TubeNumbers& tube) { return tube.length + 1; })
      .def_property_readonly(
          "center", [](const TubeNumbers& t) { return PerState(t, t.center); }, "(slices, n)")
      .def_property_readonly(
          "half_width", [](const TubeNumbers& t) { return PerState(t, t.half_width); },
          "(slices, n): upper bounds on the half-widths of each slice's hull.")
      .def_property_readonly(
          "hull",
          [](const TubeNumbers& t) {
            return ArrayOf(t.hull, {t.length + 1, t.num_states, 2});
          },
          "(slices, n, 2): lower and upper bound of each state, rounded outward.")
      .def_property_readonly("generators", &GeneratorsOf, "(n, g) of each slice, a column a generator.");

  py::class_<Judgement, std::shared_ptr<Judgement>>(module, "Decision",
                                                    "A certificate, or an abstention with its cause and witness.")
      .def_property_readonly("certified", [](const Judgement& j) { return j.decision.outcome == Outcome::kCertified; })
      .def_property_readonly(
          "outcome",
          [](const Judgement& j) { return std::string(OutcomeName(static_cast<std::int16_t>(j.decision.outcome))); },
          "certified, abstain_falsified, abstain_domain or abstain_safety.")
      .def_property_readonly(
          "cause",
          [](const Judgement& j) -> std::optional<std::string> {
            if (j.decision.cause == Cause::kNone) return std::nullopt;
            return std::string(CauseName(static_cast<std::int16_t>(j.decision.cause)));
          },
          "None for a certificate.")
      .def_property_readonly(
          "step", [](const Judgement& j) { return IndexOrNone(j.decision.step); },
          "The first step that fails; None if no step does.")
      .def_property_readonly(
          "obstacle", [](const Judgement& j) { return IndexOrNone(j.decision.obstacle); },
          "The obstacle that may be touched, of a certificate the closest one; None: no obstacle.")
      .def_property_readonly("clearance", &Clearance,
                             "Proven distance to that obstacle, m, rounded down; negative: how far it may be entered.")
      .def_readonly("message", &Judgement::message, "One sentence, as `forereach certify` prints it.")
      .def_property_readonly(
          "controls", [](const Judgement& j) { return ArrayOf(Eigen::MatrixXd(j.controls.transpose())); },
          "(T, m): the plan, in the units of the inputs.")
      .def_readonly("tube", &Judgement::tube, "What was computed of the tube.")
      .def("_picture", &PictureDict)
      .def(
          "plot",
          [](const py::object& self, const py::object& ax) {
            return py::module_::import("forereach._plot").attr("plot")(self, ax);
          },
          py::arg("ax") = py::none(),
          "Draws tube and obstacles from above, m, by matplotlib. Returns the axes. The task has to be planar.")
      .def("__repr__", [](const Judgement& j) { return "<forereach.Decision: " + j.message + ">"; });
}

}  // namespace

void BindTask(py::module_& module) {
  BindDecision(module);
  py::class_<JudgingTask, TaskPointer>(module, "Task", R"(A task: model, domain, declaration, observed steps, obstacles.

Any number of threads may use one. n states, m inputs, T steps; the units are the model's.)")
      .def(
          py::init(&MakeTask), py::arg("task") = py::none(), py::pos_only(), py::arg("path") = "task",
          py::arg("data") = py::none(),
          R"(Of a dict with the keys of a task file, the text of one, or the keys by name: Task(model={...}, domain={...}, ...).

In the paper's words: Task(equations=..., domain=..., L=..., data=...). equations stands for `model`, with `states`, and L for
`declaration.lipschitz`: names, or (n, n + m) in the states' units per those of states and inputs. Unless they are given, too,
`declaration.noise_bound` is zero, and `task` has no obstacle: the data are exact, certificates hold at the samples. The task's
x0 is then the whole domain: give certify its own.

`path` names it in messages, and the files that it names are relative to the directory of `path`.
data: (z, x_next) of observed steps, (N, n + m) and (N, n), instead of the file `transitions`, or (z, x_next, dt_error):
step i lasted at most dt_error[i] seconds longer or shorter than dt.)")
      .def_static("load", &LoadTaskFile, py::arg("path"), WithoutGil(), "Reads a task file.")
      .def_property_readonly("path", [](const JudgingTask& task) { return task.config().path; })
      .def_property_readonly(
          "dt", [](const JudgingTask& task) { return task.config().period; }, "s")
      .def_property_readonly("states", [](const JudgingTask& task) { return task.model().state_names(); })
      .def_property_readonly("inputs", [](const JudgingTask& task) { return task.model().input_names(); })
      .def_property_readonly("num_observations", &JudgingTask::num_observations)
      .def("certify", &CertifyPlan, py::arg("U"), py::arg("x0") = py::none(),
           R"(Decides on a plan, as `forereach certify` does, bit for bit.

U: (T, m) real numbers. x0: (center, half_width), (n,) each; by default the task's. The plan begins at time 0.)")
      .def("certify_many", &CertifyPlans, py::arg("Us"), py::arg("x0") = py::none(), py::arg("threads") = py::none(),
           py::arg("until_certified") = false,
           R"(Decides on B plans at once, by default on all cores; the decisions are those of certify.

Us: (B, T, m). x0: as of certify, for all plans; or (B, n) each, for one plan each.
until_certified: the plans after the first certified one are not judged, and the list ends with it.)")
      .def(
          "observe", &AddObservation, py::arg("z"), py::arg("x_next"),
          R"(Adds one executed step to the observations, for later decisions. z: (n + m,), state and input; x_next: (n,).

Returns why it is not added, as a clause; empty if it is.)")
      .def(
          "advise", [](const JudgingTask&, const Judgement& decision) { return AdviceList(decision); },
          py::arg("decision"),
          R"(What would have turned an abstention: for each change the clause `what`, its `amount`, and `turns`.

It is judged with what the task knew when it decided.)")
      .def("declare", &Declare, py::arg("by") = std::vector<std::string>(), py::arg("factor") = 1.5,
           py::arg("estimate_noise") = false, py::arg("estimate_disturbance") = true,
           R"(A declaration proposed from the observations, as `forereach declare --from-data`; it proves nothing.

by: "v,omega" for every state, or "theta=v,omega" for one. The result has `lipschitz` (n, n + m),
`noise_bound` and `disturbance` (n,), `yaml`, and of the task's own steps how many slices were held against steps left out, how many miss them, and a warning.)")
      .def(
          "fit", &FitOf, py::arg("log") = py::none(), py::arg("parameters") = std::vector<std::string>(),
          R"(Fits the named parameters of a model as text, by default all but dt, to the observations, as `forereach fit`.

log: a Log or the path of one, whose executed steps take the place of the observations: those that lasted dt, give or take
less than half of it, each as if it had lasted dt.
The result has `parameters`, their standard errors `deviations`, and one-step errors `before` and `after`, (N, n).)");
}

}  // namespace forereach
