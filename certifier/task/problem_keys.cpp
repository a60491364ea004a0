// The rows of a task file that say what is certified: model, domain, declaration, residual, task, certifier.
#include <array>
#include <iterator>

#include "certifier/dynamics/kinematic_bicycle.h"
#include "certifier/dynamics/models.h"
#include "certifier/dynamics/point_mass.h"
#include "certifier/numerics/limits.h"
#include "certifier/numerics/size.h"
#include "certifier/task/key_rows.h"

namespace forereach::key_rows {
namespace {

using Size = Key::Size;

int IndexOf(const std::vector<std::string>& names, const std::string& name) {
  return static_cast<int>(std::ranges::find(names, name) - names.begin());
}

Box ReadBox(const Document& file, const std::string& key) {
  const std::string lower_key = key + ".lower", upper_key = key + ".upper";
  const Eigen::VectorXd lower = file.Vector(lower_key), upper = file.Vector(upper_key);
  for (Eigen::Index k = 0; k < lower.size(); ++k)
    RequireOrdered(file, lower[k], upper[k], Entry(lower_key, k), Entry(upper_key, k));
  return Box(lower, upper);
}

// A matrix given by rows, all of one size.
Eigen::MatrixXd ReadMatrix(const Document& file, const std::string& key) {
  const std::vector<Eigen::VectorXd> rows = file.Vectors(key);
  Eigen::MatrixXd matrix(std::ssize(rows), rows.front().size());
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) matrix.row(i) = rows[ToSize(i)].transpose();
  return matrix;
}

using ModelMaker = std::shared_ptr<const NominalModel> (*)(const Document& file);

const std::vector<Named<ModelMaker>>& Models() {
  static const std::vector<Named<ModelMaker>> models{
      {KinematicBicycle::kName,
       [](const Document& file) {
         return MakeKinematicBicycle(file.Number("model.dt"), file.Number("model.wheelbase"));
       }},
      {PointMass::kName, [](const Document& file) { return MakePointMass(file.Number("model.dt")); }},
  };
  return models;
}

void ReadModel(const Document& file, const std::string& key, TaskDraft& draft) {
  draft.problem.model = ValueNamed(Models(), file.Text(key + ".name"))(file);
  const NominalModel& model = *draft.problem.model;
  draft.scope = {model.state_names(), model.input_names(), model.variable_names()};
  draft.config.gate.longest_step_ms = file.Number(key + ".dt") * 1e3;
}

std::vector<Key> ModelKeys() {
  return {
      Required(Map("model", "The nominal model f0.", ReadModel)),
      Required(Word("model.name", NamesIn(Models()), "The equations.")),
      Required(Number("model.dt", "s", UpTo(60), "The time from one control to the next.")),
      OnlyFor(KinematicBicycle::kName,
              Required(Number("model.wheelbase", "m", UpTo(1000), "Distance between the axles."))),
  };
}

void ReadBall(const Document& file, const std::string& key, TaskDraft& draft) {
  Domain::Ball ball{{}, file.Vector(key + ".center"), file.Number(key + ".radius")};
  const std::vector<std::string> variables = draft.scope.variables;
  for (const std::string& name : file.Names(key + ".coordinates")) ball.coordinates.push_back(IndexOf(variables, name));
  const auto size = std::ssize(ball.coordinates);
  if (ball.center.size() != size)
    file.Fail(key + ".center", "has " + std::to_string(ball.center.size()) + " entries, has to have " +
                                   std::to_string(size) + ", as many as coordinates");
  draft.problem.domain.balls.push_back(std::move(ball));
}

void ReadInequality(const Document& file, const std::string& key, TaskDraft& draft) {
  const std::string sum = key + ".coefficients";
  const std::vector<std::string> variables = draft.scope.variables;
  Domain::Inequality inequality{Eigen::VectorXd::Zero(std::ssize(variables)), file.Number(key + ".bound")};
  for (const std::string& name : file.KeysOf(sum))
    inequality.coefficients[IndexOf(variables, name)] = file.Number(sum + "." + name);
  if (inequality.coefficients.isZero(0)) file.Fail(sum, "are all zero, which bounds nothing");
  draft.problem.domain.inequalities.push_back(std::move(inequality));
}

std::vector<Key> DomainKeys() {
  return {
      Required(
          Map("domain",
              "Z_cert: the set on which declaration and model hold. A plan whose tube leaves it is not certified.")),
      Required(Map("domain.state", "The box of states.",
                   [](const Document& file, const std::string& key, TaskDraft& draft) {
                     draft.problem.domain.state = ReadBox(file, key);
                   })),
      Required(Vector("domain.state.lower", "of the state", kReal, Size::kStates, "Least value of each state.")),
      Required(
          Vector("domain.state.upper", "of the state", kReal, Size::kStates, "Largest value, at least the least.")),
      Required(Map("domain.input", "The box of inputs.",
                   [](const Document& file, const std::string& key, TaskDraft& draft) {
                     draft.problem.domain.input = ReadBox(file, key);
                   })),
      Required(Vector("domain.input.lower", "of the input", kReal, Size::kInputs, "Least value of each input.")),
      Required(
          Vector("domain.input.upper", "of the input", kReal, Size::kInputs, "Largest value, at least the least.")),
      Optional(List("domain.balls", Between(0, 1000),
                    "Further bounds: the Euclidean distance of some coordinates from a center."),
               "[]"),
      Map("domain.balls[]", "One ball.", ReadBall),
      Required(Names("domain.balls[].coordinates", Between(1, kMaxVariables), Size::kVariables,
                     "The coordinates it bounds.")),
      Required(
          Vector("domain.balls[].center", "of the coordinates", kReal, Size::kAny, "One entry for each coordinate.")),
      Required(Number("domain.balls[].radius", "of the coordinates", kNotNegative, "The largest distance.")),
      Optional(List("domain.inequalities", Between(0, 1000), "Further bounds: a weighted sum of coordinates."), "[]"),
      Map("domain.inequalities[]", "One inequality: sum of coefficient times coordinate <= bound.", ReadInequality),
      Required(Map("domain.inequalities[].coefficients", "By name. The others are zero; at least one is not zero.")),
      Number("domain.inequalities[].coefficients.<variable>", "", kReal, "The coefficient of this coordinate."),
      Required(Number("domain.inequalities[].bound", "of the sum", kReal, "The largest admissible value of the sum.")),
  };
}

void ReadLipschitzByNames(const Document& file, const std::string& key, TaskDraft& draft) {
  const NominalModel& model = *draft.problem.model;
  const std::vector<std::string> variables = draft.scope.variables;
  Eigen::MatrixXd& lipschitz = draft.problem.declaration.lipschitz;
  lipschitz.setZero(model.num_states(), model.num_variables());
  for (const std::string& row : file.KeysOf(key))
    for (const std::string& column : file.KeysOf(key + "." + row))
      lipschitz(IndexOf(variables, row), IndexOf(variables, column)) = file.Number(key + "." + row + "." + column);
}

void ReadLipschitzMatrix(const Document& file, const std::string& key, TaskDraft& draft) {
  const int states = draft.problem.model->num_states();
  if (file.Count(key) != states)
    file.Fail(key, "has " + std::to_string(file.Count(key)) + " rows, has to have " + std::to_string(states) +
                       ", one a state");
  draft.problem.declaration.lipschitz = ReadMatrix(file, key);
}

std::vector<Key> DeclarationKeys() {
  return {
      Required(Map("declaration", "The declared bounds on the residual.")),
      Required(Map("declaration.lipschitz",
                   "L by names: |r_k(z) - r_k(z')| <= sum over l of L_kl |z_l - z'_l|. What is not named is zero.",
                   ReadLipschitzByNames)),
      Map("declaration.lipschitz.<state>", "Row k: the residual of this state."),
      Number("declaration.lipschitz.<state>.<variable>", "of the state per that of the coordinate", kNotNegative,
             "L_kl: the largest change of the residual per unit of this coordinate."),
      Required(Vectors("declaration.lipschitz", "of the state per that of the coordinate", kNotNegative,
                       Between(1, kMaxStates), Size::kVariables,
                       "L as a matrix: one row for each state, one entry for each state and input.",
                       ReadLipschitzMatrix)),
      Required(Vector("declaration.noise_bound", "of the state", kNotNegative, Size::kStates,
                      "sigma: the largest error of a recorded successor, in addition to its last bit.",
                      [](const Document& file, const std::string& key, TaskDraft& draft) {
                        draft.problem.declaration.noise_bound = file.Vector(key);
                      })),
      Required(Text("transitions",
                    "CSV of observed one-step transitions, relative to this file: a column for each state, "
                    "each input and each `<state>_next`, all inside the domain, at least one row.",
                    [](const Document& file, const std::string& key, TaskDraft& draft) {
                      draft.transitions = RelativeTo(file.path(), file.Text(key));
                    })),
  };
}

void ReadInitialSet(const Document& file, const std::string& key, TaskDraft& draft) {
  const std::string center = key + ".center", half_width = key + ".half_width";
  draft.config.initial_set = Box::FromCenter(file.Vector(center), file.Vector(half_width));
  file.Read(center, draft.config.robot.start);
  file.Read(half_width, draft.config.planner.initial_half_width);
}

void ReadRest(const Document& file, const std::string& key, TaskDraft& draft) {
  std::vector<RestBound>& rest = draft.problem.rest;
  for (const std::string& name : file.KeysOf(key))
    rest.push_back({IndexOf(draft.scope.states, name), file.Number(key + "." + name)});
  if (rest.empty()) file.Fail(key, "names no state, so everything would be standing");
  std::ranges::sort(rest, {}, &RestBound::coordinate);
}

void SetProjection(const Document& file, const std::string& key, Eigen::MatrixXd projection, TaskDraft& draft) {
  for (Eigen::Index i = 0; i < projection.rows(); ++i)
    if (projection.row(i).isZero(0)) file.Fail(Entry(key, i), "is zero, which sees no state");
  draft.scope.safety_dim = static_cast<int>(projection.rows());
  draft.problem.projection = std::move(projection);
}

void ReadProjectionByNames(const Document& file, const std::string& key, TaskDraft& draft) {
  const std::vector<std::string> names = file.Names(key);
  Eigen::MatrixXd projection = Eigen::MatrixXd::Zero(std::ssize(names), std::ssize(draft.scope.states));
  for (Eigen::Index i = 0; i < projection.rows(); ++i) projection(i, IndexOf(draft.scope.states, names[ToSize(i)])) = 1;
  SetProjection(file, key, std::move(projection), draft);
}

void ReadProjectionMatrix(const Document& file, const std::string& key, TaskDraft& draft) {
  SetProjection(file, key, ReadMatrix(file, key), draft);
}

// A row of an obstacle's kind: what `make` gives of the map at `key` is one of the task's obstacles.
template <class Make>
Key ObstacleKind(const char* name, const char* meaning, Make make) {
  return Map(std::string("task.obstacles[].") + name, meaning,
             [make](const Document& file, const std::string& key, TaskDraft& draft) {
               draft.config.obstacles.push_back(make(file, key));
             });
}

Obstacle ReadCircle(const Document& file, const std::string& key) {
  return Obstacle::Circle(file.Vector(key + ".center"), file.Number(key + ".radius"));
}

Obstacle ReadAxisBox(const Document& file, const std::string& key) {
  const Box box = ReadBox(file, key);
  return Obstacle::AxisBox(box.lower(), box.upper());
}

Obstacle ReadPolygon(const Document& file, const std::string& key) {
  return Obstacle::Polygon(file.Vectors(key + ".vertices"));
}

Obstacle ReadHalfPlane(const Document& file, const std::string& key) {
  return Obstacle::HalfSpace(file.Vector(key + ".normal"), file.Number(key + ".offset"));
}

void RequireOneKind(const Document& file, const std::string& key, TaskDraft&) {
  if (const std::size_t kinds = file.KeysOf(key).size(); kinds != 1)
    file.Fail(key, "has " + std::to_string(kinds) + " keys, has to have one of circle, box, polygon, half_plane");
}

std::vector<Key> TaskKeys() {
  return {
      Required(Map("task", "The certification task.")),
      Required(Map("task.initial_set", "X0, the set of initial states. A candidate on the bus has its own.",
                   ReadInitialSet)),
      Required(Vector("task.initial_set.center", "of the state", kReal, Size::kStates, "Its middle.")),
      Required(Vector("task.initial_set.half_width", "of the state", kNotNegative, Size::kStates, "Half its width.")),
      Map("task.rest",
          "Definition of rest: the absolute value of each state named here is at most its bound. A plan that may end "
          "outside these bounds gets abstention D (no_stop), unless gate.require_stop is false.",
          ReadRest),
      Number("task.rest.<state>", "of the state", kNotNegative,
             "Its bound, which has to hold for the whole last slice. Choose it so small that the robot's hold mode can "
             "stop the remaining motion."),
      Required(Names("task.projection", Between(1, kMaxSafetyDim), Size::kStates,
                     "P: the 1 to 3 states that are the coordinates of obstacles, in metres.", ReadProjectionByNames)),
      Required(Vectors("task.projection", "", kReal, Between(1, kMaxSafetyDim), Size::kStates,
                       "P as a matrix: 1 to 3 rows, one entry for each state.", ReadProjectionMatrix)),
      Required(List(
          "task.obstacles", Between(0, kMaxObstacles),
          "The unsafe sets, closed. `[]` for none. With `gate.obstacles: bus` those received on the bus count too.")),
      Map("task.obstacles[]", "One of circle, box, polygon and half_plane.", RequireOneKind),
      ObstacleKind("circle", "A disc; the projection has to have 2 rows.", ReadCircle),
      Required(Vector("task.obstacles[].circle.center", "m", kReal, Size::kSafety, "Its center.")),
      Required(Number("task.obstacles[].circle.radius", "m", kNotNegative, "Its radius.")),
      ObstacleKind("box", "An axis-aligned box.", ReadAxisBox),
      Required(Vector("task.obstacles[].box.lower", "m", kReal, Size::kSafety, "Its lower corner.")),
      Required(Vector("task.obstacles[].box.upper", "m", kReal, Size::kSafety, "Its upper corner.")),
      ObstacleKind("polygon", "The convex hull of points; the projection has to have 2 rows.", ReadPolygon),
      Required(Vectors("task.obstacles[].polygon.vertices", "m", kReal, Between(3, kMaxObstaclePoints), Size::kSafety,
                       "The points, in any order.")),
      ObstacleKind("half_plane", "A half-space: unsafe where normal . y >= offset.", ReadHalfPlane),
      Required(Vector("task.obstacles[].half_plane.normal", "", kReal, Size::kSafety,
                      "Points into the unsafe side; not zero.")),
      Required(Number("task.obstacles[].half_plane.offset", "m", kReal, "In metres if the normal has length 1.")),
  };
}

void CheckOrder(const Document& file, const std::string&, TaskDraft& draft) {
  const int order = draft.problem.zonotope_order, states = draft.problem.model->num_states(),
            largest = kMaxGenerators / states - 2;
  if (order > largest)
    file.Fail("certifier.zonotope_order", std::to_string(order) + " is outside [1, " + std::to_string(largest) +
                                              "] for " + std::to_string(states) + " states");
}

std::vector<Key> CertifierKeys() {
  const OptionRows<Problem> certifier("certifier", [](TaskDraft& draft) -> Problem& { return draft.problem; });
  return {
      Optional(Map("certifier", "Options of the certifier.", CheckOrder), "all defaults"),
      certifier.Word<Method>(
          "method", {{"centred", Method::kCentred}, {"paper", Method::kPaper}}, &Problem::method,
          "paper: Algorithm 1 of the paper, with this project's conventions; it will not change. centred: the "
          "same with a tighter bound on the nominal model's remainder."),
      certifier.Integer(
          "zonotope_order", Between(1, kMaxGenerators), &Problem::zonotope_order,
          "rho: a slice has at most rho generators for each state. (rho + 2) times the number of states may not "
          "exceed " +
              std::to_string(kMaxGenerators) + "."),
      certifier.Integer(
          "max_leaf_visits", Between(1, 1 << 20), &Problem::max_leaf_visits,
          "The number of groups of 32 observations that one search for the tightest bound may visit. Every subset of "
          "the observations gives a sound bound. A decision whose search reached this cap says so."),
      certifier.Integer("max_observations", Between(1, 100'000'000), &Problem::max_observations,
                        "The largest number of stored observations. Above it, observations that never attain the "
                        "envelope are removed."),
  };
}

}  // namespace

std::vector<Key> ProblemKeys() {
  std::vector<Key> keys;
  for (const auto part : {ModelKeys, DomainKeys, DeclarationKeys, ResidualKeys, TaskKeys, CertifierKeys})
    std::ranges::move(part(), std::back_inserter(keys));
  return keys;
}

}  // namespace forereach::key_rows
