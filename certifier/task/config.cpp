#include "certifier/task/config.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <set>
#include <stdexcept>

#include "certifier/dynamics/kinematic_bicycle.h"
#include "certifier/dynamics/models.h"
#include "certifier/dynamics/point_mass.h"
#include "certifier/dynamics/residuals.h"
#include "certifier/numerics/text.h"
#include "certifier/task/csv.h"
#include "certifier/task/document.h"
#include "certifier/task/named_files.h"
#include "certifier/task/number.h"

namespace forereach {
namespace {

std::shared_ptr<const NominalModel> ReadModel(const Document& file) {
  const double dt = file.Number("model.dt");
  if (file.Text("model.name") == "point_mass") return MakePointMass(dt);
  return MakeKinematicBicycle(dt, file.Number("model.wheelbase"));
}

std::vector<std::string> Variables(const NominalModel& model) {
  std::vector<std::string> names = model.state_names();
  names.insert(names.end(), model.input_names().begin(), model.input_names().end());
  return names;
}

int IndexOf(const std::vector<std::string>& names, const std::string& name) {
  return static_cast<int>(std::find(names.begin(), names.end(), name) - names.begin());
}

std::string Entry(const std::string& key, Eigen::Index i) { return key + "[" + std::to_string(i) + "]"; }

Box ReadBox(const Document& file, const std::string& key) {
  const std::string upper_key = key + ".upper";
  const Eigen::VectorXd lower = file.Vector(key + ".lower"), upper = file.Vector(upper_key);
  for (Eigen::Index k = 0; k < lower.size(); ++k)
    if (!(lower[k] <= upper[k]))
      file.Fail(Entry(upper_key, k), ToText(upper[k]) + " is outside " + Range{lower[k], HUGE_VAL, false, true}.text() +
                                         ", below " + Entry(key + ".lower", k));
  return Box(lower, upper);
}

Domain::Ball ReadBall(const Document& file, const std::string& key, const std::vector<std::string>& variables) {
  Domain::Ball ball{{}, file.Vector(key + ".center"), file.Number(key + ".radius")};
  for (const std::string& name : file.Names(key + ".coordinates")) ball.coordinates.push_back(IndexOf(variables, name));
  const auto size = static_cast<Eigen::Index>(ball.coordinates.size());
  if (ball.center.size() != size)
    file.Fail(key + ".center", "has " + std::to_string(ball.center.size()) + " entries, has to have " +
                                   std::to_string(size) + ", as many as coordinates");
  return ball;
}

Domain::Inequality ReadInequality(const Document& file, const std::string& key,
                                  const std::vector<std::string>& variables) {
  const std::string sum = key + ".coefficients";
  Domain::Inequality inequality{Eigen::VectorXd::Zero(static_cast<Eigen::Index>(variables.size())),
                                file.Number(key + ".bound")};
  for (const std::string& name : file.KeysOf(sum))
    inequality.coefficients[IndexOf(variables, name)] = file.Number(sum + "." + name);
  if (inequality.coefficients.isZero(0)) file.Fail(sum, "are all zero, which bounds nothing");
  return inequality;
}

Domain ReadDomain(const Document& file, const NominalModel& model) {
  const std::vector<std::string> variables = Variables(model);
  Domain domain{ReadBox(file, "domain.state"), ReadBox(file, "domain.input"), {}, {}};
  for (int i = 0; i < file.Count("domain.inequalities"); ++i)
    domain.inequalities.push_back(ReadInequality(file, Entry("domain.inequalities", i), variables));
  for (int i = 0; i < file.Count("domain.balls"); ++i)
    domain.balls.push_back(ReadBall(file, Entry("domain.balls", i), variables));
  return domain;
}

// A matrix given by rows, all of one size.
Eigen::MatrixXd ReadMatrix(const Document& file, const std::string& key) {
  const std::vector<Eigen::VectorXd> rows = file.Vectors(key);
  Eigen::MatrixXd matrix(static_cast<Eigen::Index>(rows.size()), rows.front().size());
  for (std::size_t i = 0; i < rows.size(); ++i) matrix.row(static_cast<Eigen::Index>(i)) = rows[i].transpose();
  return matrix;
}

Eigen::MatrixXd ReadLipschitz(const Document& file, const NominalModel& model) {
  const std::string key = "declaration.lipschitz";
  if (file.IsList(key)) {
    if (file.Count(key) != model.num_states())
      file.Fail(key, "has " + std::to_string(file.Count(key)) + " rows, has to have " +
                         std::to_string(model.num_states()) + ", one a state");
    return ReadMatrix(file, key);
  }
  const std::vector<std::string> variables = Variables(model);
  Eigen::MatrixXd lipschitz = Eigen::MatrixXd::Zero(model.num_states(), model.num_variables());
  for (const std::string& row : file.KeysOf(key))
    for (const std::string& column : file.KeysOf(key + "." + row))
      lipschitz(IndexOf(variables, row), IndexOf(variables, column)) = file.Number(key + "." + row + "." + column);
  return lipschitz;
}

Eigen::MatrixXd ReadProjection(const Document& file, const NominalModel& model) {
  const std::string key = "task.projection";
  Eigen::MatrixXd projection = Eigen::MatrixXd::Zero(file.Count(key), model.num_states());
  if (file.Has(Entry(key, 0))) {
    projection = ReadMatrix(file, key);
  } else {
    const std::vector<std::string> names = file.Names(key);
    for (std::size_t i = 0; i < names.size(); ++i)
      projection(static_cast<Eigen::Index>(i), IndexOf(model.state_names(), names[i])) = 1;
  }
  for (Eigen::Index i = 0; i < projection.rows(); ++i)
    if (projection.row(i).isZero(0)) file.Fail(Entry(key, i), "is zero, which sees no state");
  return projection;
}

std::vector<RestBound> ReadRest(const Document& file, const NominalModel& model) {
  const std::string key = "task.rest", requires_stop = "gate.require_stop";
  const bool says = file.Has(key), required = file.Has(requires_stop) ? file.Text(requires_stop) == "true" : says;
  if (required && !says) file.Fail(requires_stop, "true, but task.rest does not say what standing is");
  if (!says) return {};
  std::vector<RestBound> rest;
  for (const std::string& name : file.KeysOf(key))
    rest.push_back({IndexOf(model.state_names(), name), file.Number(key + "." + name)});
  if (rest.empty()) file.Fail(key, "names no state, so everything would be standing");
  std::ranges::sort(rest, {}, &RestBound::coordinate);
  return required ? rest : std::vector<RestBound>();
}

void RequireOrder(const Document& file, int order, int num_states) {
  const int largest = kMaxGenerators / num_states - 2;
  if (order > largest)
    file.Fail("certifier.zonotope_order", std::to_string(order) + " is outside [1, " + std::to_string(largest) +
                                              "] for " + std::to_string(num_states) + " states");
}

Obstacle ReadObstacle(const Document& file, const std::string& key) {
  const std::vector<std::string> kinds = file.KeysOf(key);
  if (kinds.size() != 1)
    file.Fail(key,
              "has " + std::to_string(kinds.size()) + " keys, has to have one of circle, box, polygon, half_plane");
  const std::string inside = key + "." + kinds.front();
  try {
    if (kinds.front() == "circle")
      return Obstacle::Circle(file.Vector(inside + ".center"), file.Number(inside + ".radius"));
    if (kinds.front() == "box") {
      const Box box = ReadBox(file, inside);
      return Obstacle::AxisBox(box.lower(), box.upper());
    }
    if (kinds.front() == "polygon") return Obstacle::Polygon(file.Vectors(inside + ".vertices"));
    return Obstacle::HalfSpace(file.Vector(inside + ".normal"), file.Number(inside + ".offset"));
  } catch (const std::invalid_argument& error) {
    file.Fail(inside, error.what());
  }
}

std::vector<Obstacle> ReadObstacles(const Document& file) {
  std::vector<Obstacle> obstacles;
  for (int i = 0; i < file.Count("task.obstacles"); ++i)
    obstacles.push_back(ReadObstacle(file, Entry("task.obstacles", i)));
  return obstacles;
}

Box ReadInitialSet(const Document& file) {
  const std::string key = "task.initial_set";
  try {
    return Box::FromCenter(file.Vector(key + ".center"), file.Vector(key + ".half_width"));
  } catch (const std::invalid_argument& error) {  // center + half_width overflows
    file.Fail(key, error.what());
  }
}

std::string RelativeTo(const std::string& file, const std::string& path) {
  return (std::filesystem::path(file).parent_path() / path).string();
}

GateOptions ReadGate(const Document& file) {
  GateOptions gate;
  file.Read("gate.max_age_ms", gate.max_age_ms);
  file.Read("gate.max_ahead_ms", gate.max_ahead_ms);
  file.Read("gate.certificate_lifetime_ms", gate.certificate_lifetime_ms);
  file.Read("gate.decision_budget_ms", gate.decision_budget_ms);
  file.Read("gate.queue", gate.queue);
  const auto read = [&](const char* key, const char* yes, bool& value) {
    if (file.Has(key)) value = file.Text(key) == yes;
  };
  read("gate.mode", "shadow", gate.shadow);
  read("gate.arming", "robot_state", gate.needs_robot_state);
  file.Read("gate.robot_timeout_ms", gate.robot_timeout_ms);
  file.Read("gate.max_clock_jump_ms", gate.max_clock_jump_ms);
  if (file.Has("gate.obstacles"))
    gate.obstacles = file.Text("gate.obstacles") == "bus" ? ObstaclesSource::kBus : ObstaclesSource::kTask;
  file.Read("gate.obstacles_timeout_ms", gate.obstacles_timeout_ms);
  read("gate.learn", "executed", gate.learns);
  if (file.Has("gate.state")) gate.state = RelativeTo(file.path(), file.Text("gate.state"));
  return gate;
}

RealtimeOptions ReadRealtime(const Document& file) {
  RealtimeOptions realtime;
  if (file.Has("realtime.lock_memory")) {
    const std::string word = file.Text("realtime.lock_memory");
    using Lock = RealtimeOptions::Lock;
    realtime.lock_memory = word == "no" ? Lock::kNo : word == "try" ? Lock::kTry : Lock::kRequire;
  }
  file.Read("realtime.fifo_priority", realtime.fifo_priority);
  return realtime;
}

BusOptions ReadBus(const Document& file) {
  BusOptions bus;
  file.Read("bus.url", bus.url);
  std::set<std::string> names;
  const auto read = [&](const char* key, std::string& name) {
    const std::string path = std::string("bus.channels.") + key;
    file.Read(path, name);
    if (!names.insert(name).second) file.Fail(path, name + " is the name of another channel too");
  };
  read("candidate", bus.candidate);
  read("decision", bus.decision);
  read("certified", bus.certified);
  read("robot_state", bus.robot_state);
  read("obstacles", bus.obstacles);
  read("transition", bus.transition);
  read("status", bus.status);
  read("event", bus.event);
  read("logger_status", bus.logger_status);
  read("fault", bus.fault);
  read("command", bus.command);
  file.Read("bus.name", bus.name);
  if (file.Has("bus.key")) bus.key = RelativeTo(file.path(), file.Text("bus.key"));
  return bus;
}

PlannerOptions ReadPlanner(const Document& file, const NamedFiles& instead) {
  PlannerOptions planner;
  file.Read("planner.source", planner.source);
  if (file.Has("planner.policy"))
    planner.policy = instead.policy.empty() ? RelativeTo(file.path(), file.Text("planner.policy")) : instead.policy;
  else if (planner.source == "policy")
    file.Fail("planner.policy", "missing: a policy's file, for planner.source: policy");
  file.Read("planner.algorithm", planner.algorithm);
  file.Read("planner.goal", planner.goal);
  file.Read("planner.goal_radius", planner.goal_radius);
  file.Read("planner.clearance", planner.clearance);
  file.Read("planner.clearance_step", planner.clearance_step);
  file.Read("planner.progress_steps", planner.progress_steps);
  file.Read("planner.tail_steps", planner.tail_steps);
  file.Read("planner.lead_steps", planner.lead_steps);
  file.Read("planner.candidates", planner.candidates);
  file.Read("planner.cruise_speed", planner.cruise_speed);
  file.Read("planner.braking", planner.braking);
  file.Read("planner.time_limit_ms", planner.time_limit_ms);
  file.Read("planner.seed", planner.seed);
  file.Read("task.initial_set.half_width", planner.initial_half_width);
  file.Read("planner.initial_half_width", planner.initial_half_width);
  if (const int steps = planner.progress_steps + planner.tail_steps; steps > kMaxSteps)
    file.Fail("planner.tail_steps", std::to_string(planner.tail_steps) + " is outside [0, " +
                                        std::to_string(kMaxSteps - planner.progress_steps) + "]: with progress_steps " +
                                        std::to_string(steps) + " steps, a plan has at most " +
                                        std::to_string(kMaxSteps));
  return planner;
}

// What the residual needs besides its own parameters is the model's.
std::map<std::string, double> ReadResidualParameters(const Document& file, const std::string& residual) {
  std::map<std::string, double> parameters;
  if (residual == "none") return parameters;
  parameters["dt"] = file.Number("model.dt");
  if (file.Has("model.wheelbase")) parameters["wheelbase"] = file.Number("model.wheelbase");
  for (const Key& key : Schema()) {
    if (key.only != residual || !key.path.starts_with("robot.")) continue;
    double& value = parameters[key.path.substr(key.path.rfind('.') + 1)];
    value = file.Has(key.path) ? file.Number(key.path) : ParseNumber(key.fallback).value;
  }
  return parameters;
}

std::string ModelOfResidual(const std::string& residual) {
  return residual == "heading_saturation" ? KinematicBicycle::kName : PointMass::kName;
}

void RequireItsModel(const Document& file, const std::string& key, const std::string& residual,
                     const NominalModel& model) {
  if (ModelOfResidual(residual) != model.name())
    file.Fail(key, residual + " is for " + ModelOfResidual(residual) + ", the model is " + model.name());
}

ParametricResidual::Parameter ReadParameter(const Document& file, const std::string& name) {
  const std::string key = "residual." + name;
  if (file.Has("model." + name)) {  // the model's own
    const double value = file.Number("model." + name);
    return {name, value, value};
  }
  if (file.Has(key) && file.IsList(key)) {
    const Eigen::VectorXd ends = file.Vector(key);
    if (!(ends[0] <= ends[1]))
      file.Fail(Entry(key, 1), ToText(ends[1]) + " is outside " + Range{ends[0], HUGE_VAL, false, true}.text() +
                                   ", below " + Entry(key, 0));
    return {name, ends[0], ends[1]};
  }
  const auto row = std::ranges::find(Schema(), key, &Key::path);
  const double value = file.Has(key) ? file.Number(key) : ParseNumber(row->fallback).value;
  return {name, value, value};
}

std::optional<ParametricResidual> ReadResidual(const Document& file, const NominalModel& model) {
  if (!file.Has("residual")) return std::nullopt;
  ParametricResidual residual{file.Text("residual.name"), {}};
  RequireItsModel(file, "residual.name", residual.name, model);
  const auto read = [&](const auto& names) {
    for (const char* name : names) residual.parameters.push_back(ReadParameter(file, name));
  };
  if (residual.name == HeadingSaturation::kName)
    read(HeadingSaturation::kParameterNames);
  else
    read(VelocityKnee::kParameterNames);
  return residual;
}

RobotOptions ReadRobot(const Document& file, const NominalModel& model) {
  RobotOptions robot;
  file.Read("task.initial_set.center", robot.start);
  file.Read("robot.start", robot.start);
  file.Read("robot.step_period_ms", robot.step_period_ms);
  file.Read("robot.time_limit_s", robot.time_limit_s);
  const std::string key = file.Has("robot.residual.name") ? "robot.residual.name" : "robot.residual";
  file.Read(key, robot.residual);
  if (robot.residual != "none") RequireItsModel(file, key, robot.residual, model);
  robot.residual_parameters = ReadResidualParameters(file, robot.residual);
  return robot;
}

LoggerOptions ReadLogger(const Document& file) {
  LoggerOptions logger;
  if (file.Has("logger.directory")) logger.directory = RelativeTo(file.path(), file.Text("logger.directory"));
  file.Read("logger.queue", logger.queue);
  file.Read("logger.flush_ms", logger.flush_ms);
  file.Read("logger.rotate_mb", logger.rotate_mb);
  file.Read("logger.rotate_minutes", logger.rotate_minutes);
  if (file.Has("logger.quota_mb")) {
    logger.quota_mb = file.Number("logger.quota_mb");
    if (*logger.quota_mb < logger.rotate_mb)
      file.Fail("logger.quota_mb",
                ToText(*logger.quota_mb) + " is less than logger.rotate_mb, " + ToText(logger.rotate_mb));
  }
  file.Read("logger.min_free_mb", logger.min_free_mb);
  file.Read("logger.unsigned_kb_per_s", logger.unsigned_kb_per_s);
  return logger;
}

std::vector<std::string> TransitionColumns(const NominalModel& model) {
  std::vector<std::string> columns = Variables(model);
  for (const std::string& state : model.state_names()) columns.push_back(state + "_next");
  return columns;
}

Transitions ReadTransitions(const std::string& path, const NominalModel& model, const std::string& named_by) {
  const Eigen::MatrixXd rows = ReadCsv(path, TransitionColumns(model), named_by);
  if (rows.rows() == 0) throw ConfigError(path + ":2: no transitions; at least one is needed");
  return {rows.leftCols(model.num_variables()), rows.rightCols(model.num_states())};
}

// What a transition violates, in the words of the task file.
std::string Describe(const DomainExit& exit, const Domain& domain, const NominalModel& model) {
  using Kind = DomainExit::Kind;
  const std::vector<std::string> names = Variables(model);
  if (exit.kind == Kind::kLower || exit.kind == Kind::kUpper) {
    const Eigen::Index l = exit.index, n = model.num_states();
    const Box& box = l < n ? domain.state : domain.input;
    const Eigen::Index k = l < n ? l : l - n;
    return names[static_cast<std::size_t>(l)] + ": " + ToText(exit.value) + " is outside " +
           Range{box.lower()[k], box.upper()[k], false, false}.text() + " of domain." + (l < n ? "state" : "input");
  }
  std::string involved;
  const auto involve = [&](Eigen::Index l) {
    involved += (involved.empty() ? "" : ", ") + names[static_cast<std::size_t>(l)];
  };
  const std::string limit = ToText(exit.value) + " is outside (-inf, " + ToText(exit.bound) + "] of domain.";
  if (exit.kind == Kind::kBall) {
    for (const int l : domain.balls[static_cast<std::size_t>(exit.index)].coordinates) involve(l);
    return involved + ": distance " + limit + "balls[" + std::to_string(exit.index) + "]";
  }
  const Eigen::VectorXd& coefficients = domain.inequalities[static_cast<std::size_t>(exit.index)].coefficients;
  for (Eigen::Index l = 0; l < coefficients.size(); ++l)
    if (coefficients[l] != 0) involve(l);
  return involved + ": sum " + limit + "inequalities[" + std::to_string(exit.index) + "]";
}

void RequireInside(const std::string& path, const Transitions& transitions, const Domain& domain,
                   const NominalModel& model) {
  std::array<Interval, kMaxVariables> point;
  const auto size = static_cast<std::size_t>(model.num_variables());
  for (Eigen::Index i = 0; i < transitions.z.rows(); ++i) {
    for (std::size_t l = 0; l < size; ++l) point[l] = Interval(transitions.z(i, static_cast<Eigen::Index>(l)));
    const DomainExit exit = FindExit(domain, {point.data(), size});
    if (exit.kind != DomainExit::Kind::kNone)
      throw ConfigError(path + ":" + std::to_string(i + 2) + ": " + Describe(exit, domain, model));
  }
}

std::shared_ptr<const Problem> ReadProblem(Document& file, TransitionsFile transitions, const NamedFiles& instead) {
  file.Check({});
  const auto problem = std::make_shared<Problem>();
  problem->model = ReadModel(file);
  const NominalModel& model = *problem->model;
  file.Check({model.state_names(), model.input_names(), 0});
  problem->projection = ReadProjection(file, model);
  file.Check({model.state_names(), model.input_names(), static_cast<int>(problem->projection.rows())});

  problem->domain = ReadDomain(file, model);
  const Eigen::VectorXd noise_bound = file.Vector("declaration.noise_bound");
  problem->declaration = {ReadLipschitz(file, model), noise_bound};
  if (file.Has("certifier.method") && file.Text("certifier.method") == "paper") problem->method = Method::kPaper;
  file.Read("certifier.max_leaf_visits", problem->max_leaf_visits);
  file.Read("certifier.max_observations", problem->max_observations);
  file.Read("certifier.zonotope_order", problem->zonotope_order);
  RequireOrder(file, problem->zonotope_order, model.num_states());
  problem->rest = ReadRest(file, model);
  if (transitions == TransitionsFile::kIgnore) return problem;
  const std::string path =
      instead.transitions.empty() ? RelativeTo(file.path(), file.Text("transitions")) : instead.transitions;
  problem->transitions = ReadTransitions(path, model, file.Place("transitions"));
  RequireInside(path, problem->transitions, problem->domain, model);
  return problem;
}

Config Load(const std::string& path, TransitionsFile transitions, const NamedFiles& instead) {
  Document file(path);
  Config config;
  config.path = path;
  config.problem = ReadProblem(file, transitions, instead);
  const Problem& problem = *config.problem;
  config.digest = DigestOf(file.text());
  config.model_digest = ModelDigest(*problem.model);
  config.declaration_digest = DeclarationDigest(*problem.model, problem.declaration);
  config.observations_digest = ObservationsDigest(*problem.model, problem.transitions);
  config.obstacles = ReadObstacles(file);
  config.obstacles_digest = ObstaclesDigest(config.obstacles);
  config.initial_set = ReadInitialSet(file);
  config.residual = ReadResidual(file, *problem.model);
  config.gate = ReadGate(file);
  config.realtime = ReadRealtime(file);
  config.bus = ReadBus(file);
  config.planner = ReadPlanner(file, instead);
  config.robot = ReadRobot(file, *problem.model);
  config.gate.longest_step_ms = std::max(config.robot.step_period_ms, file.Number("model.dt") * 1e3);
  config.logger = ReadLogger(file);
  return config;
}

}  // namespace

Config LoadConfig(const std::string& path, TransitionsFile transitions) { return Load(path, transitions, {}); }

Config LoadConfig(const std::string& path, const NamedFiles& instead) {
  return Load(path, TransitionsFile::kRead, instead);
}

NamedFiles FilesNamedBy(const std::string& path) {
  Document file(path);
  file.Check({});
  const auto named = [&file](const char* key) {
    return file.Has(key) ? RelativeTo(file.path(), file.Text(key)) : std::string();
  };
  return {named("transitions"), named("planner.policy")};
}

void RequireObstaclesSource(const Config& config) {
  if (config.gate.obstacles != ObstaclesSource::kUnsaid) return;
  throw ConfigError(
      config.path +
      ": gate.obstacles: missing. `bus`: the obstacles are those of this file and those that OBSTACLES says on "
      "the bus; nothing is certified before they are heard, nor while they are silent. `task`: the obstacles "
      "of this file are all there are");
}

Transitions LoadTransitions(const std::string& path, const NominalModel& model) {
  return ReadTransitions(path, model, "");
}

void SaveTransitions(const std::string& path, const NominalModel& model, const Transitions& transitions) {
  Eigen::MatrixXd rows(transitions.size(), model.num_variables() + model.num_states());
  rows << transitions.z, transitions.x_next;
  WriteCsv(path, TransitionColumns(model), rows);
}

Eigen::MatrixXd LoadPlan(const std::string& path, const NominalModel& model) {
  const Eigen::MatrixXd rows = ReadCsv(path, model.input_names());
  if (rows.rows() < 1 || rows.rows() > kMaxSteps)
    throw ConfigError(path + ":" + std::to_string(std::min<Eigen::Index>(rows.rows(), kMaxSteps) + 2) + ": " +
                      std::to_string(rows.rows()) + " steps are outside [1, " + std::to_string(kMaxSteps) + "]");
  return rows.transpose();
}

void SavePlan(const std::string& path, const NominalModel& model, const Eigen::MatrixXd& controls) {
  WriteCsv(path, model.input_names(), controls.transpose());
}

}  // namespace forereach
