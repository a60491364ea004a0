// The rows of a task file that say what is certified: domain, declaration, residual, task, certifier.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <span>

#include <fmt/format.h>

#include "forereach/certify/limits.h"
#include "forereach/certify/problem.h"
#include "forereach/certify/safety.h"
#include "forereach/numerics/directed.h"
#include "forereach/numerics/limits.h"
#include "forereach/numerics/size.h"
#include "forereach/residual/growing_disturbance.h"
#include "forereach/residual/region_grid.h"
#include "forereach/safety/clearance.h"
#include "forereach/safety/occupancy_grid.h"
#include "task/keep_in.h"
#include "task/key_rows.h"
#include "task/most_obstacles.h"
#include "task/number.h"
#include "task/option_rows.h"
#include "task/row_readers.h"
#include "task/schema_parts.h"

namespace forereach::key_rows {
namespace {

using Size = Key::Size;

constexpr Range kWithinDecades = Between(-1e9, 1e9);  // in microseconds within the bounds of a schedule

Box ReadBox(const Field& at) {
  const Field lower = at["lower"], upper = at["upper"];
  for (int k = 0; k < lower.Count(); ++k) RequireOrdered(lower[k], upper[k]);
  return Box(lower.Vector(), upper.Vector());
}

// A matrix given by rows, all of one size.
Eigen::MatrixXd ReadMatrix(const Field& at) {
  const std::vector<Eigen::VectorXd> rows = at.Vectors();
  Eigen::MatrixXd matrix(std::ssize(rows), rows.front().size());
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) matrix.row(i) = rows[ToSize(i)].transpose();
  return matrix;
}

void ReadBall(const Field& at, TaskDraft& draft) {
  Domain::Ball ball{{}, at["center"].Vector(), at["radius"].Number()};
  const std::vector<std::string> variables = draft.scope.variables;
  for (const std::string& name : at["coordinates"].Names()) ball.coordinates.push_back(IndexOf(variables, name));
  const auto size = std::ssize(ball.coordinates);
  if (ball.center.size() != size)
    at.Fail("center", fmt::format("has {} entries, has to have {}, as many as coordinates", ball.center.size(), size));
  draft.problem.domain.balls.push_back(std::move(ball));
}

void ReadInequality(const Field& at, TaskDraft& draft) {
  const std::vector<std::string> variables = draft.scope.variables;
  Domain::Inequality inequality{Eigen::VectorXd::Zero(std::ssize(variables)), at["bound"].Number()};
  for (const Field& coefficient : at.Entries("coefficients"))
    inequality.coefficients[IndexOf(variables, coefficient.name())] = coefficient.Number();
  if (inequality.coefficients.isZero(0)) at.Fail("coefficients", "are all zero, which bounds nothing");
  draft.problem.domain.inequalities.push_back(std::move(inequality));
}

std::vector<Key> DomainKeys() {
  return {
      Required(
          Map("domain", "Z_cert, where declaration and model hold. A plan whose tube leaves it is not certified.")),
      Required(Map("domain.state", "The box of states.",
                   [](const Field& at, TaskDraft& draft) { draft.problem.domain.state = ReadBox(at); })),
      Required(Vector("domain.state.lower", "of the state", kReal, Size::kStates, "Least value of each state.")),
      Required(
          Vector("domain.state.upper", "of the state", kReal, Size::kStates, "Largest value, at least the least.")),
      Required(Map("domain.input", "The box of inputs.",
                   [](const Field& at, TaskDraft& draft) { draft.problem.domain.input = ReadBox(at); })),
      Required(Vector("domain.input.lower", "of the input", kReal, Size::kInputs, "Least value of each input.")),
      Required(
          Vector("domain.input.upper", "of the input", kReal, Size::kInputs, "Largest value, at least the least.")),
      Optional(
          List("domain.balls", Between(0, 1000), "Bounds on the Euclidean distance of some coordinates from a center."),
          "[]"),
      Map("domain.balls[]", "One ball.", ReadBall),
      Required(Names("domain.balls[].coordinates", Between(1, kMaxVariables), Size::kVariables,
                     "The coordinates it bounds.")),
      Required(Vector("domain.balls[].center", "of the coordinates", kReal, Size::kAny, "One entry a coordinate.")),
      Required(Number("domain.balls[].radius", "of the coordinates", kNotNegative, "The largest distance.")),
      Optional(List("domain.inequalities", Between(0, 1000), "Bounds on a weighted sum of coordinates."), "[]"),
      Map("domain.inequalities[]", "Sum of coefficient times coordinate <= bound.", ReadInequality),
      Required(Map("domain.inequalities[].coefficients", "By name; the others are zero. At least one is not zero.")),
      Number("domain.inequalities[].coefficients.<variable>", "", kReal, "Of this coordinate."),
      Required(Number("domain.inequalities[].bound", "of the sum", kReal, "The largest value of the sum.")),
  };
}

void ReadLipschitzByNames(const Field& at, TaskDraft& draft) {
  const NominalModel& model = *draft.problem.model;
  const std::vector<std::string> variables = draft.scope.variables;
  Eigen::MatrixXd& lipschitz = draft.problem.declaration.lipschitz;
  lipschitz.setZero(model.num_states(), model.num_variables());
  for (const Field& row : at.Entries())
    for (const Field& slope : row.Entries())
      lipschitz(IndexOf(variables, row.name()), IndexOf(variables, slope.name())) = slope.Number();
}

void ReadLipschitzMatrix(const Field& at, TaskDraft& draft) {
  const int states = draft.problem.model->num_states();
  if (at.Count() != states) at.Fail(fmt::format("has {} rows, has to have {}, one a state", at.Count(), states));
  draft.problem.declaration.lipschitz = ReadMatrix(at);
}

// Where an expression has no finite bound, with the state's key.
void RequireFinite(const Field& at, const GrowingDisturbance& growing, const TaskDraft& draft) {
  const auto unbounded = growing.FindUnbounded(draft.problem.domain.Ranges());
  if (!unbounded) return;
  std::string place;
  const std::vector<Interval> domain = draft.problem.domain.Ranges();
  for (std::size_t l = 0; l < domain.size(); ++l)
    if (const Interval& range = unbounded->second[l]; range.lower != domain[l].lower || range.upper != domain[l].upper)
      place += fmt::format("{} {} {:.4g}", place.empty() ? " near" : ",", draft.scope.variables[l], range.Middle());
  at.Fail(draft.scope.states[ToSize(unbounded->first)],
          fmt::format("has to have a finite value everywhere in the domain's box, and nothing bounds it{}", place));
}

// By names: numbers and expressions.
void ReadDisturbance(const Field& at, TaskDraft& draft) {
  const std::vector<std::string>& states = draft.scope.states;
  Declaration& declaration = draft.problem.declaration;
  declaration.disturbance.setZero(std::ssize(states));
  std::vector<ExpressionText> growing(states.size(), {GrowingDisturbance::kNone});
  bool grows = false;
  for (const Field& bound : at.Entries()) {
    const int k = IndexOf(states, bound.name());
    const Parsed<double> number = ParseNumber(bound.Text());
    if (!number.problem.empty()) {
      growing[ToSize(k)] = bound.Expression();
      grows = true;
    } else if (kNotNegative.Contains(number.value)) {
      declaration.disturbance[k] = number.value;
    } else {
      bound.Fail(fmt::format("{} is outside {}", bound.Text(), kNotNegative.text()));
    }
  }
  if (!grows) return;
  try {
    declaration.growing = std::make_shared<const GrowingDisturbance>(*draft.problem.model, std::move(growing));
  } catch (const ExpressionError& error) {
    FailAt(at.file(), error);
  }
  RequireFinite(at, *declaration.growing, draft);
}

// A bound on the error of what is recorded: by names, then one name, then the vector.
std::array<Key, 3> ErrorKeys(const std::string& of, Key::Size size, Eigen::VectorXd Declaration::*errors,
                             std::vector<std::string> SchemaScope::*names, std::string meaning) {
  const std::string path = "declaration." + of + "_error", unit = fmt::format("of the {}", of);
  const auto read_names = [=](const Field& at, TaskDraft& draft) {
    Eigen::VectorXd& read = draft.problem.declaration.*errors;
    read.setZero(std::ssize(draft.scope.*names));
    for (const Field& error : at.Entries()) read[IndexOf(draft.scope.*names, error.name())] = error.Number();
  };
  return {Optional(Map(path, std::move(meaning), read_names), fmt::format("not declared, {}s are taken as exact", of)),
          Number(path + ".<" + of + ">", unit, kNotNegative,
                 fmt::format("Of this {}. One that is not named is exact.", of)),
          Vector(path, unit, kNotNegative, size, "The same as a list.",
                 [=](const Field& at, TaskDraft& draft) { draft.problem.declaration.*errors = at.Vector(); })};
}

void ReadAffine(const Field& at, TaskDraft& draft) {
  Declaration& declaration = draft.problem.declaration;
  for (const std::string& name : at["rows"].Names()) {
    const int k = IndexOf(draft.scope.states, name);
    declaration.affine.rows.push_back(k);
  }
  for (const std::string& name : at["columns"].Names())
    declaration.affine.columns.push_back(IndexOf(draft.scope.variables, name));
  std::ranges::sort(declaration.affine.rows);
  std::ranges::sort(declaration.affine.columns);
  for (const Field& row : at.Entries("rest")) {
    const int k = IndexOf(draft.scope.states, row.name());
    if (!declaration.affine.Contains(k)) row.Fail("is none of declaration.affine.rows");
    if (declaration.affine.rest.size() == 0)
      declaration.affine.rest.setZero(std::ssize(draft.scope.states), std::ssize(draft.scope.variables));
    for (const Field& slope : row.Entries())
      declaration.affine.rest(k, IndexOf(draft.scope.variables, slope.name())) = slope.Number();
  }
  for (const int k : declaration.affine.rows)
    for (int l = 0; l < std::ssize(draft.scope.variables); ++l)
      if (declaration.lipschitz(k, l) != 0 && !declaration.affine.DependsOn(k, l))
        at["columns"].Fail(fmt::format("leaves {} out, by which declaration.lipschitz says that the affine {} changes",
                                       draft.scope.variables[ToSize(l)], draft.scope.states[ToSize(k)]));
}

// Numbers by states, at most `everywhere` where that has entries; infinite for the others.
void ReadRegionBound(const Field& at, const char* key, const Eigen::VectorXd& everywhere, const SchemaScope& scope,
                     Eigen::VectorXd& bounds) {
  for (const Field& bound : at.Entries(key)) {
    if (bounds.size() == 0) bounds.setConstant(std::ssize(scope.states), kInfinity);
    const int k = IndexOf(scope.states, bound.name());
    if (everywhere.size() != 0 && bound.Number() > everywhere[k])
      bound.Fail(fmt::format("{} is above declaration.{}, {}, which holds in the whole domain", ToText(bound.Number()),
                             key, ToText(everywhere[k])));
    bounds[k] = bound.Number();
  }
}

// Rows as those of declaration.lipschitz; L in the others.
void ReadRegion(const Field& at, TaskDraft& draft) {
  const SchemaScope& scope = draft.scope;
  Declaration& declaration = draft.problem.declaration;
  Region region{{}, declaration.lipschitz};
  for (const Field& range : at.Entries("in")) {
    const Eigen::VectorXd ends = range.Vector();
    if (!(ends[0] < ends[1]))
      range.Fail(fmt::format("[{}, {}] is no range, has to be [least, largest]", ToText(ends[0]), ToText(ends[1])));
    region.box.push_back({IndexOf(scope.variables, range.name()), {ends[0], ends[1]}});
  }
  if (!at.Has("lipschitz") && !at.Has("disturbance") && !at.Has("noise_bound") && !at.Has("bound"))
    at.Fail("says nothing: lipschitz, disturbance, noise_bound or bound");
  if (region.box.empty())
    at.Fail("in", "names no state or input; what holds everywhere belongs to declaration.lipschitz");
  std::ranges::sort(region.box, {}, &Region::Side::variable);
  for (const Field& row : at.Entries("lipschitz")) {
    const int k = IndexOf(scope.states, row.name());
    region.lipschitz.row(k).setZero();
    for (const Field& slope : row.Entries()) {
      const int l = IndexOf(scope.variables, slope.name());
      if (const double everywhere = declaration.lipschitz(k, l); slope.Number() > everywhere)
        slope.Fail(fmt::format("{} is above declaration.lipschitz, {}, which holds in the whole domain",
                               ToText(slope.Number()), ToText(everywhere)));
      region.lipschitz(k, l) = slope.Number();
    }
  }
  const Eigen::VectorXd no_disturbance = Eigen::VectorXd::Zero(std::ssize(scope.states));
  ReadRegionBound(at, "disturbance", declaration.disturbance.size() == 0 ? no_disturbance : declaration.disturbance,
                  scope, region.disturbance);
  ReadRegionBound(at, "noise_bound", declaration.noise_bound, scope, region.noise_bound);
  ReadRegionBound(at, "bound", {}, scope, region.bound);
  for (const int k : declaration.affine.rows)
    if (region.bound.size() != 0 && region.bound[k] < kInfinity)
      at["bound"][scope.states[ToSize(k)]].Fail("bounds a row of declaration.affine");
  declaration.regions.push_back(std::move(region));
}

// After the last one: what all of them are together.
void CheckRegions(const Field& at, TaskDraft& draft) {
  const RegionGrid grid(draft.problem.declaration);
  if (grid.variables().size() > Region::kMaxVariables || grid.num_cells() > Region::kMaxCells)
    at.Fail(fmt::format("cut {}, has to be at most {} variables and {} cells", grid.SizeText(), Region::kMaxVariables,
                        Region::kMaxCells));
  if (const std::string coupled = FindCoupledRegion(draft.problem); !coupled.empty())
    at.Fail(fmt::format("are bounded by a variable that a constraint beyond the box of the domain names: {}", coupled));
  if (const std::string turning = FindTurningRegion(draft.problem); !turning.empty()) at.Fail(turning);
}

std::vector<Key> DeclarationKeys() {
  Key range = Vector("declaration.regions[].in.<variable>", "of the variable", kReal, Size::kAny,
                     "[least, largest]; both may lie outside the domain.");
  range.count = Between(2, 2);
  Key regions =
      List("declaration.regions", Between(0, Region::kMaxRegions),
           "Boxes in which the residual changes less than declaration.lipschitz says, or less is uncertain. Where "
           "boxes overlap, the least of their numbers holds, entry by entry; in none, the declaration's.");
  regions.read = CheckRegions;
  const auto state_error = ErrorKeys(
      "state", Size::kStates, &Declaration::state_error, &SchemaScope::states,
      "e by names: each state that is recorded differs from the true one by at most this, before a step and after it. "
      "What it makes of f0 and the residual is derived; noise_bound is for other errors of the successor.");
  const auto input_error = ErrorKeys("input", Size::kInputs, &Declaration::input_error, &SchemaScope::inputs,
                                     "The same of each input: how far the one that is recorded, or that the plan "
                                     "gives, may be off the one that acted.");
  return {
      Required(Map("declaration", "The bounds on the residual.")),
      Required(Map("declaration.lipschitz",
                   "L by names: |r_k(z) - r_k(z')| <= sum over l of L_kl |z_l - z'_l|. What is not named is zero.",
                   ReadLipschitzByNames)),
      Map("declaration.lipschitz.<state>", "Row k: the residual of this state."),
      Number("declaration.lipschitz.<state>.<variable>", "of the state per that of the coordinate", kNotNegative,
             "L_kl: the largest change of the residual per unit of this coordinate."),
      Required(Vectors("declaration.lipschitz", "of the state per that of the coordinate", kNotNegative,
                       Between(1, kMaxStates), Size::kVariables, "L as a matrix: one row a state.",
                       ReadLipschitzMatrix)),
      Optional(Map("declaration.affine",
                   "Rows of the residual that are affine: r_k(z) = sum over the columns l of M_kl z_l + b_k on the "
                   "whole domain, and `rest`. Data bound M and b. An entry of `lipschitz` there says that |M_kl| is at "
                   "most that, and that r_k changes by no more; errors of the variable (`state_error`, `input_error`) "
                   "count by it, and need it.",
                   ReadAffine),
               "none"),
      Required(Names("declaration.affine.rows", Between(1, kMaxStates), Size::kStates, "Their states.")),
      Required(Names("declaration.affine.columns", Between(1, AffineRows::kMaxColumns), Size::kVariables,
                     "The states and inputs that they depend on.")),
      Optional(
          Map("declaration.affine.rest",
              "G by names, as declaration.lipschitz: what is left of the row beside M z + b changes by at most sum "
              "over l of G_kl |z_l - z'_l|, of all states and inputs."),
          "zeros"),
      Map("declaration.affine.rest.<state>", "Row k: that of this state."),
      Number("declaration.affine.rest.<state>.<variable>", "of the state per that of the coordinate", kNotNegative,
             "G_kl."),
      Required(Vector("declaration.noise_bound", "of the state", kNotNegative, Size::kStates,
                      "sigma: the largest error of a recorded successor, beside its last bit and state_error.",
                      [](const Field& at, TaskDraft& draft) { draft.problem.declaration.noise_bound = at.Vector(); })),
      Optional(Map("declaration.disturbance",
                   "w by names: in each step the true successor differs from f0 + r by at most this. The difference "
                   "may be another in each step. Errors of measurement belong to state_error and noise_bound.",
                   ReadDisturbance),
               "zeros"),
      Expression("declaration.disturbance.<state>",
                 "Of this state, in its unit: a number that is not negative, or an expression in states, inputs, "
                 "parameters and definitions, of which the absolute value counts. It has to be finite in the whole box "
                 "of the domain. One that is not named is zero."),
      Vector("declaration.disturbance", "of the state", kNotNegative, Size::kStates, "The same as a list of numbers.",
             [](const Field& at, TaskDraft& draft) { draft.problem.declaration.disturbance = at.Vector(); }),
      state_error[0],
      state_error[1],
      state_error[2],
      input_error[0],
      input_error[1],
      input_error[2],
      Optional(std::move(regions), "[]"),
      Map("declaration.regions[]", "One box.", ReadRegion),
      Required(
          Map("declaration.regions[].in",
              "The box: ranges of states and inputs, of at most three in all regions. No inequality and no ball of "
              "the domain names one of these. In a range of one of model.angles, only slopes may be bounded, unless "
              "the domain's range of it is less than a turn.")),
      std::move(range),
      Optional(Map("declaration.regions[].lipschitz",
                   "L in the box, by names, at most declaration.lipschitz. A state that is not named has that; in the "
                   "row of one that is, what is not named is zero."),
               "declaration.lipschitz"),
      Map("declaration.regions[].lipschitz.<state>", "Row k: the residual of this state."),
      Number("declaration.regions[].lipschitz.<state>.<variable>", "of the state per that of the coordinate",
             kNotNegative, "L_kl in the box."),
      Optional(
          Map("declaration.regions[].disturbance",
              "w of steps from the box, by names, at most the number of declaration.disturbance, in whose place it "
              "comes; an expression there adds to it. A tube that touches a side of the box counts both sides."),
          "declaration.disturbance"),
      Number("declaration.regions[].disturbance.<state>", "of the state", kNotNegative, "Of this state."),
      Optional(Map("declaration.regions[].noise_bound",
                   "sigma of successors of states and inputs in the box, by names, at most declaration.noise_bound."),
               "declaration.noise_bound"),
      Number("declaration.regions[].noise_bound.<state>", "of the state", kNotNegative, "Of this state."),
      Optional(Map("declaration.regions[].bound",
                   "The residual is at most this in size in the box, by names; of no affine row. A transition that "
                   "shows more falsifies it (F)."),
               "none"),
      Number("declaration.regions[].bound.<state>", "of the state", kNotNegative, "Of this state."),
      Required(Text("transitions",
                    "CSV of observed steps, relative to this file: a column for each state, input and `<state>_next`, "
                    "inside the domain; `dt_error`: by how many s steps were off dt. Those whose declared errors may "
                    "take them out are left out.",
                    [](const Field& at, TaskDraft& draft) { draft.transitions = PathIn(at); })),
      Optional(Word("declaration.transitions_are", {"measured", "exact"},
                    "measured: state_error and input_error are those of the file's transitions, too. exact: the file's "
                    "are exact, as a simulation makes them, and the errors are those of the robot on the bus alone.",
                    [](const Field& at, TaskDraft& draft) {
                      draft.problem.declaration.given_are_exact = at.Text() == "exact";
                    }),
               "measured"),
  };
}

void ReadInitialSet(const Field& at, TaskDraft& draft) {
  const Field center = at["center"], half_width = at["half_width"];
  draft.config.initial_set = Box::FromCenter(center.Vector(), half_width.Vector());
  center.Read(draft.config.robot.start);
  half_width.Read(draft.config.planner.initial_half_width);
}

void ReadRest(const Field& at, TaskDraft& draft) {
  std::vector<RestBound>& rest = draft.problem.rest;
  for (const Field& bound : at.Entries()) rest.push_back({IndexOf(draft.scope.states, bound.name()), bound.Number()});
  if (rest.empty()) at.Fail("names no state, so everything would be standing");
  std::ranges::sort(rest, {}, &RestBound::coordinate);
  draft.rest = rest;
}

void SetProjection(const Field& at, Eigen::MatrixXd projection, TaskDraft& draft) {
  for (Eigen::Index i = 0; i < projection.rows(); ++i)
    if (projection.row(i).isZero(0)) at[i].Fail("is zero, which sees no state");
  for (const int angle : draft.problem.model->angles())
    if (!projection.col(angle).isZero(0))
      at.Fail(fmt::format("depends on {}, which is one of model.angles: how often an angle has turned is not known",
                          draft.scope.states[ToSize(angle)]));
  draft.scope.safety_dim = static_cast<int>(projection.rows());
  draft.problem.projection = std::move(projection);
}

Eigen::MatrixXd ProjectionTo(std::span<const std::string> names, const std::vector<std::string>& states) {
  Eigen::MatrixXd projection = Eigen::MatrixXd::Zero(std::ssize(names), std::ssize(states));
  for (Eigen::Index i = 0; i < projection.rows(); ++i) projection(i, IndexOf(states, names[ToSize(i)])) = 1;
  return projection;
}

void ReadProjectionByNames(const Field& at, TaskDraft& draft) {
  SetProjection(at, ProjectionTo(at.Names(), draft.scope.states), draft);
}

void ReadProjectionMatrix(const Field& at, TaskDraft& draft) { SetProjection(at, ReadMatrix(at), draft); }

// @throws ConfigError unless `of` is the size of a part's point.
void RequirePointSize(const Field& at, Eigen::Index size, Eigen::Index of) {
  if (size != of)
    at.Fail(fmt::format("has {} entries, has to have {}, as many as the first point of the body", size, of));
}

// The expressions of one point.
std::vector<ExpressionText> ReadPlace(const Field& at) {
  std::vector<ExpressionText> place;
  for (const Field& coordinate : at.Entries()) place.push_back(coordinate.Expression());
  return place;
}

// `size` is that of the body's points, 0 before the first.
BodyPart ReadPart(const Field& at, Eigen::Index& size) {
  if (at.Count() != 1) at.Fail(fmt::format("has {} keys, has to have one of disc, hull", at.Count()));
  const bool is_disc = at.Has("disc");
  const Field shape = at[is_disc ? "disc" : "hull"];
  const std::string in_frame = is_disc ? "at" : "points", at_expressions = is_disc ? "place" : "places";
  const bool has_points = shape.Has(in_frame);
  if (has_points == shape.Has(at_expressions))
    shape.Fail(has_points ? "has points in the robot's frame and at expressions; delete one of them"
                          : fmt::format("missing: {} or {}", in_frame, at_expressions));
  BodyPart part{{}, shape.Has("radius") ? shape["radius"].Number() : 0, {}};
  const Field points = shape[has_points ? in_frame : at_expressions];
  for (const Field& which : is_disc ? std::vector{points} : points.Entries()) {
    const Eigen::Index entries = which.Count();
    if (size == 0) size = entries;
    RequirePointSize(which, entries, size);
    if (has_points)
      part.points.emplace_back(Eigen::Vector3d::Zero()).head(size) = which.Vector();
    else
      part.places.push_back(ReadPlace(which));
  }
  return part;
}

// A body without a point in the robot's frame needs no frame.
void ReadPose(const Field& at, Eigen::Index size, Body& body, TaskDraft& draft) {
  const auto& states = draft.scope.states;
  if (!at.Has("pose")) {
    if (HasFrame(body)) at.Fail("pose", "missing: the states that are the position of the robot's frame");
    draft.scope.safety_dim = static_cast<int>(size);
    draft.problem.projection = Eigen::MatrixXd::Zero(size, std::ssize(states));
    return;
  }
  const std::vector<std::string> pose = at["pose"].Names();
  if (const Eigen::Index names = std::ssize(pose); names == size + 1)
    body.heading = IndexOf(states, pose.back());
  else if (names != size)
    at.Fail("pose",
            fmt::format("has {} entries, has to have {}, as many as the points of the body, or one more, the heading",
                        names, size));
  SetProjection(at["pose"], ProjectionTo(std::span(pose).first(ToSize(size)), states), draft);
}

void ReadBody(const Field& at, TaskDraft& draft) {
  if (draft.scope.safety_dim != 0) at.Fail("the task has task.projection too; delete one of them");
  Body body{.heading = -1, .parts = {}};
  Eigen::Index size = 0;
  int points = 0;
  for (const Field& part : at.Entries("parts")) points += body.parts.emplace_back(ReadPart(part, size)).num_points();
  if (points > kMaxBodyPoints)
    at.Fail("parts", fmt::format("have {} points, which is outside {}", points, Between(1, kMaxBodyPoints).text()));
  ReadPose(at, size, body, draft);
  draft.problem.body = std::move(body);
}

void ReadBetween(const Field& at, TaskDraft& draft) {
  // Load lengthens the period by what the gate's options, which are not read yet, allow a step.
  forereach::Between between{.acceleration = at["acceleration"].Vector(), .period = draft.config.period};
  const bool turns = draft.problem.body.heading >= 0;
  for (const auto& [name, member] :
       {std::pair{"turn_rate", &forereach::Between::turn_rate}, {"turn_acceleration", &Between::turn_acceleration}}) {
    const bool is_given = at.Has(name);
    if (turns != is_given)
      at.Fail(name, turns ? "missing: task.body has a heading, so the bound is needed"
                          : "is for a body with a heading, the last name of task.body.pose");
    if (is_given) between.*member = at[name].Number();
  }
  draft.problem.between = std::move(between);
  draft.config.says_between = true;
}

// A row of an obstacle's kind: what `make` gives of the map at `key` is one of the task's obstacles.
template <class Make>
Key ObstacleKind(const char* name, const char* meaning, Make make) {
  return Map(std::string("task.obstacles[].") + name, meaning, [make](const Field& at, TaskDraft& draft) {
    const Obstacle& made = draft.config.obstacles.emplace_back(make(at));
    if (draft.scope.safety_dim != 0 && made.dim() != draft.scope.safety_dim)
      at.Fail(fmt::format("is for {} safety coordinates, there are {}", made.dim(), draft.scope.safety_dim));
  });
}

Obstacle ReadCircle(const Field& at) { return Obstacle::Circle(at["center"].Vector(), at["radius"].Number()); }

Obstacle ReadAxisBox(const Field& at) {
  const Box box = ReadBox(at);
  return Obstacle::AxisBox(box.lower(), box.upper());
}

Obstacle ReadPolygon(const Field& at) { return Obstacle::Polygon(at["vertices"].Vectors()); }

// Which cells the lines of a text say are occupied; the last line is the lowest row.
void ReadRows(const Field& at, bool unknown_is_free, OccupancyGrid::Map& map) {
  const std::string text = at.Text();
  std::vector<std::string_view> rows;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    rows.push_back(std::string_view(text).substr(begin, end - begin));
    begin = end + 1;
  }
  map.width = static_cast<int>(rows.front().size());
  map.height = static_cast<int>(rows.size());
  map.occupied.reserve(text.size());
  for (std::size_t row = rows.size(); row-- > 0;) {
    const auto fail = [&](const std::string& what) { at.Fail(fmt::format("line {} of the rows {}", row + 1, what)); };
    if (rows[row].size() != rows.front().size())
      fail(fmt::format("has {} cells, the first one has {}", rows[row].size(), map.width));
    for (const char& cell : rows[row]) {
      if (std::string_view("#.?").find(cell) == std::string_view::npos)
        fail(
            fmt::format("has byte {} as cell {}, a cell is one of # (occupied), . (free) and ? (unknown); write the "
                        "rows as a block, `rows: |`",
                        static_cast<int>(static_cast<unsigned char>(cell)), &cell - rows[row].data() + 1));
      map.occupied.push_back(cell == '#' || (cell == '?' && !unknown_is_free));
    }
  }
}

Obstacle ReadGrid(const Field& at) {
  OccupancyGrid::Map map{.resolution = at["resolution"].Number(),
                         .origin = {},
                         .outside_is_free = at.Has("unknown") && at["unknown"].Text() == "free"};
  const Eigen::VectorXd origin = at["origin"].Vector();
  map.origin = {origin[0], origin[1]};
  map.yaw = origin.size() > 2 ? origin[2] : 0;
  ReadRows(at["rows"], map.outside_is_free, map);
  // YAML takes a row that begins with # and stands too far left for a comment: a wall would be gone.
  if (const Eigen::VectorXd size = at["size"].Vector(); size[0] != map.width || size[1] != map.height)
    at["rows"].Fail(fmt::format("has {} by {} cells, size says {} by {}; indent all rows as the first one", map.width,
                                map.height, size[0], size[1]));
  return Obstacle::Grid(std::make_shared<const OccupancyGrid>(std::move(map)));
}

Obstacle ReadHalfPlane(const Field& at) { return Obstacle::HalfSpace(at["normal"].Vector(), at["offset"].Number()); }

// Microseconds of a time in seconds; nothing is lost of a window between these two.
std::int64_t MicrosecondsDown(double seconds) { return static_cast<std::int64_t>(std::floor(MulDown(seconds, 1e6))); }
std::int64_t MicrosecondsUp(double seconds) { return static_cast<std::int64_t>(std::ceil(MulUp(seconds, 1e6))); }

// The obstacle was read before.
void ReadMotion(const Field& at, TaskDraft& draft) {
  ObstacleMotion motion;
  motion.velocity.head(draft.scope.safety_dim) = at["velocity"].Vector();
  for (const auto& [name, member] : {std::pair{"uncertainty", &ObstacleMotion::uncertainty},
                                     {"growth", &ObstacleMotion::growth},
                                     {"growth_rate", &ObstacleMotion::growth_rate}})
    if (at.Has(name)) motion.*member = at[name].Number();
  if (at.Has("from")) motion.from_us = MicrosecondsDown(at["from"].Number());
  if (at.Has("until")) motion.until_us = MicrosecondsUp(at["until"].Number());
  if (at.Has("from") && at.Has("until")) RequireOrdered(at["from"], at["until"]);
  Obstacle& obstacle = draft.config.obstacles.back();
  obstacle = obstacle.Moving(motion);
}

void ReadObstacle(const Field& at, TaskDraft& draft) {
  ++draft.config.num_listed;
  const bool moves = at.Has("motion"), is_named = at.Has("name");
  if (const std::size_t kinds = at.Keys().size() - (moves ? 1 : 0) - (is_named ? 1 : 0); kinds != 1)
    at.Fail(fmt::format("has {} keys of a shape, has to have one of circle, box, polygon, half_plane, grid", kinds));
  if (const auto grids =
          std::ranges::count_if(draft.config.obstacles, [](const Obstacle& each) { return !!each.grid(); });
      grids > ConvexNumbers::kMostGrids)
    at.Fail(fmt::format("is the {}th grid, at most {} are taken", grids, ConvexNumbers::kMostGrids));
  if (moves) ReadMotion(at["motion"], draft);
  if (!is_named) return;
  const std::string name = at["name"].Text();
  if (const std::string why = WhyNoName(name); !why.empty()) at.Fail("name", why);
  Obstacle& obstacle = draft.config.obstacles.back();
  obstacle = obstacle.Named(name);
}

Ring RingOf(const Field& at) {
  Ring ring;
  for (const Eigen::VectorXd& corner : at.Vectors()) ring.push_back({corner[0], corner[1]});
  return ring;
}

// After the obstacles of the list.
void ReadKeepIn(const Field& at, TaskDraft& draft) {
  Config& config = draft.config;
  if (draft.scope.safety_dim != 2)
    at.Fail(fmt::format("is for two safety coordinates, the task has {}", draft.scope.safety_dim));
  KeepIn keep_in{at.Has("name") ? at["name"].Text() : "keep_in", {RingOf(at["vertices"]), {}}};
  const std::string name = std::string(kOutside) + keep_in.name;
  if (const std::string why = WhyNoName(keep_in.name); !why.empty()) at.Fail("name", why);
  if (name.size() > kMaxObstacleName)
    at.Fail("name", fmt::format("has {} characters, must have 1 to {}", keep_in.name.size(),
                                kMaxObstacleName - kOutside.size()));
  for (const Field& hole : at.Entries("holes")) keep_in.area.holes.push_back(RingOf(hole));
  try {
    for (const Obstacle& piece : OutsideOf({keep_in.area})) config.obstacles.push_back(piece.Named(name));
  } catch (const NoPolygon& error) {
    at.Fail(error.what());
  }
  if (config.obstacles.size() > kMostObstacles)
    at.Fail(
        fmt::format("what is outside of it has so many convex pieces that the task has {} obstacles, which is "
                    "outside {}",
                    config.obstacles.size(), Between(0, kMostObstacles).text()));
  config.keep_in.push_back(std::move(keep_in));
}

// A limit has at least one of both bounds.
void ReadLimit(const Field& at, TaskDraft& draft) {
  const bool has_least = at.Has("at_least"), has_most = at.Has("at_most");
  Limit limit{.name = at["name"].Text(), .that = at["that"].Expression()};
  if (has_least) limit.at_least = at["at_least"].Number();
  if (has_most) limit.at_most = at["at_most"].Number();
  if (!has_least && !has_most) at.Fail("bounds nothing, has to have at_most, at_least or both");
  if (has_least && has_most) RequireOrdered(at["at_least"], at["at_most"]);
  std::vector<Limit>& limits = draft.problem.limits;
  if (const auto other = std::ranges::find(limits, limit.name, &Limit::name); other != limits.end())
    at.Fail("name", fmt::format("{} is the name of task.limits[{}], too", limit.name, other - limits.begin()));
  limits.push_back(std::move(limit));
}

void CheckTask(const Field& at, TaskDraft& draft) {
  const Problem& problem = draft.problem;
  if (draft.scope.safety_dim == 0) at.Fail("projection", "missing: the task needs this key, or task.body");
  // Numbers that are each in their range may still be too large together. @throws std::invalid_argument.
  try {
    static_cast<void>(PlacementOf(problem));
    static_cast<void>(LimitTest(problem));
  } catch (const ExpressionError& error) {
    FailAt(at.file(), error);
  }
}

std::vector<Key> TaskKeys() {
  return {
      Required(Map("task", "What to certify. It has either projection or body.", CheckTask)),
      Required(Map("task.initial_set", "X0, the initial states. A candidate on the bus has its own.", ReadInitialSet)),
      Required(Vector("task.initial_set.center", "of the state", kReal, Size::kStates, "Its middle.")),
      Required(Vector("task.initial_set.half_width", "of the state", kNotNegative, Size::kStates, "Half its width.")),
      Map("task.rest",
          "What rest is: each state named here is at most its bound in absolute value. A plan that may end outside "
          "gets abstention D (no_stop), unless gate.require_stop is false.",
          ReadRest),
      Number("task.rest.<state>", "of the state", kNotNegative,
             "Its bound on the whole last slice, small enough that the robot's hold mode can stop what is left."),
      Names("task.projection", Between(1, kMaxSafetyDim), Size::kStates,
            "P: the states that are the coordinates of obstacles, in metres. The robot is this point.",
            ReadProjectionByNames),
      Vectors("task.projection", "", kReal, Between(1, kMaxSafetyDim), Size::kStates,
              "P as a matrix: one row a safety coordinate.", ReadProjectionMatrix),
  };
}

std::vector<Key> BodyKeys() {
  return {
      Map("task.body", "The union of its parts. Obstacles are in its position's coordinates.", ReadBody),
      Names("task.body.pose", Between(2, kMaxSafetyDim + 1), Size::kStates,
            "The 2 or 3 states that are the position of the robot's frame, in metres, as many as a point has entries; "
            "one name more is the heading, in radians, by which the frame turns in the first two coordinates. Required "
            "if a part is in the frame. If none is: the states in which planner.goal is given."),
      Required(List("task.body.parts", Between(1, kMaxBodyParts),
                    fmt::format("Convex parts, with at most {} points in all. A part's points are fixed in the robot's "
                                "frame, or stand where expressions say, as an arm's joints.",
                                kMaxBodyPoints))),
      Map("task.body.parts[]", "One of disc and hull."),
      Map("task.body.parts[].disc", "The points within a radius of one point: a disc or a ball."),
      Vector("task.body.parts[].disc.at", "m", kReal, Size::kPoint,
             "Its center in the frame. Required without `place`."),
      List("task.body.parts[].disc.place", Between(2, kMaxSafetyDim),
           "Instead of `at`: the safety coordinates of its center in metres, as expressions of states, parameters and "
           "definitions of the model ([docs/expressions.md](../docs/expressions.md))."),
      Expression("task.body.parts[].disc.place[]", "One coordinate."),
      Required(Number("task.body.parts[].disc.radius", "m", kNotNegative, "Its radius.")),
      Map("task.body.parts[].hull", "The points within a radius of the convex hull of some points."),
      Vectors("task.body.parts[].hull.points", "m", kReal, Between(1, kMaxBodyPoints), Size::kPoint,
              "In the frame, in any order. Required without `places`."),
      List("task.body.parts[].hull.places", Between(1, kMaxBodyPoints),
           "Instead of `points`: by expressions, as `disc.place`."),
      List("task.body.parts[].hull.places[]", Between(2, kMaxSafetyDim), "One point."),
      Expression("task.body.parts[].hull.places[][]", "One coordinate."),
      Optional(Number("task.body.parts[].hull.radius", "m", kNotNegative, "The radius."), "0"),
  };
}

std::vector<Key> BetweenKeys() {
  return {
      Optional(Word("task.between", {"samples"},
                    "Certificates hold at the sample instants only, as in the paper. forereach-certifier and the "
                    "commands that certify require this key, in one of its forms, unless the method is `paper`.",
                    [](const Field&, TaskDraft& draft) { draft.config.says_between = true; }),
               "samples with `certifier.method: paper`"),
      Map("task.between",
          "Certificates hold at all times. These bound the true motion from one sample to the next, at most model.dt "
          "and robot.step_error_ms later. `forereach declare --between` proposes them.",
          ReadBetween),
      Required(Vector("task.between.acceleration", "m/s^2", kNotNegative, Size::kSafety,
                      "The largest absolute second derivative of each safety coordinate, of the frame and of every "
                      "point at expressions.")),
      Number("task.between.turn_rate", "rad/s", kNotNegative,
             "The largest absolute derivative of the heading; required if there is one."),
      Number("task.between.turn_acceleration", "rad/s^2", kNotNegative,
             "Its largest absolute second derivative, likewise."),
  };
}

std::vector<Key> LimitKeys() {
  return {
      Optional(List("task.limits", Between(0, kMaxLimits),
                    "Bounds on functions of state and input: a lateral acceleration, a power, a region to keep in. A "
                    "plan that may exceed one gets abstention S (limit). They hold at the sample instants only."),
               "[]"),
      Map("task.limits[]", "With at_most, at_least or both.", ReadLimit),
      Required(Text("task.limits[].name",
                    fmt::format("For messages, 1 to {} printable characters of ASCII.", kMaxLimitName))),
      Required(Expression("task.limits[].that",
                          "The function, of states, inputs, parameters and definitions of the model "
                          "([docs/expressions.md](../docs/expressions.md)). With an input it is bounded at every "
                          "sample but the last.")),
      Number("task.limits[].at_most", "of the function", kReal, "For every state of the slice."),
      Number("task.limits[].at_least", "of the function", kReal, "Likewise."),
  };
}

std::vector<Key> ObstacleKeys() {
  Key origin = Vector("task.obstacles[].grid.origin", "m, m, rad", Between(-1e9, 1e9), Size::kAny,
                      "x and y of the lower left corner, and yaw; 0 if it is left out.");
  origin.count = Between(2, 3);
  Key size = Vector("task.obstacles[].grid.size", "cells", kPositive, Size::kAny, "Width and height of its rows.");
  size.count = Between(2, 2);
  return {
      Required(List("task.obstacles", Between(0, kMostObstacles),
                    "The unsafe sets, closed; `[]` for none. With `gate.obstacles: bus` those received count too.")),
      Map("task.obstacles[]", "One of circle, box, polygon, half_plane and grid; motion if it moves; a name.",
          ReadObstacle),
      Text(
          "task.obstacles[].name",
          fmt::format("For messages, instead of its number: a letter, then letters, digits and any of `_-.:/`, at most "
                      "{} in all. Pieces of one thing may share it.",
                      kMaxObstacleName)),
      ObstacleKind("circle", "A disc; for two safety coordinates.", ReadCircle),
      Required(Vector("task.obstacles[].circle.center", "m", kReal, Size::kSafety, "Its center.")),
      Required(Number("task.obstacles[].circle.radius", "m", kNotNegative, "Its radius.")),
      ObstacleKind("box", "An axis-aligned box.", ReadAxisBox),
      Required(Vector("task.obstacles[].box.lower", "m", kReal, Size::kSafety, "Its lower corner.")),
      Required(Vector("task.obstacles[].box.upper", "m", kReal, Size::kSafety, "Its upper corner.")),
      ObstacleKind("polygon", "The convex hull of points, for two safety coordinates.", ReadPolygon),
      Required(Vectors("task.obstacles[].polygon.vertices", "m", kReal, Between(3, kMaxObstaclePoints), Size::kSafety,
                       "In any order.")),
      ObstacleKind("half_plane", "A half-space, unsafe where normal . y >= offset.", ReadHalfPlane),
      Required(Vector("task.obstacles[].half_plane.normal", "", kReal, Size::kSafety,
                      "Points into the unsafe side; not zero.")),
      Required(Number("task.obstacles[].half_plane.offset", "m", kReal, "In metres if the normal has length 1.")),
      ObstacleKind("grid", "The occupied cells of a map, closed squares; for two safety coordinates. It does not move.",
                   ReadGrid),
      Required(Number("task.obstacles[].grid.resolution", "m", {0, 1e6, true, false}, "The side of a cell.")),
      Required(origin),
      Optional(
          Word("task.obstacles[].grid.unknown", {"occupied", "free"}, "What a cell `?` is, and all beyond the map."),
          "occupied"),
      Required(size),
      Required(Text("task.obstacles[].grid.rows",
                    fmt::format("A line for each row, the lowest last: `#` occupied, `.` free, `?` unknown. At most {} "
                                "cells, of which the occupied ones make up at most {} rectangles.",
                                OccupancyGrid::kMostCells, OccupancyGrid::kMostBlocks))),
      Map("task.obstacles[].motion",
          "At time t it has moved by velocity t, and lies within uncertainty + growth |t| + growth_rate t^2 / 2 of "
          "there. Times are seconds from the start of the plan or of the sender (`forereach obstacles`, `run "
          "--obstacles`); a certifier on the bus refuses this key."),
      Required(Vector("task.obstacles[].motion.velocity", "m/s", kReal, Size::kSafety, "Its velocity.")),
      Optional(Number("task.obstacles[].motion.uncertainty", "m", kNotNegative, "How far off it may be at time 0."),
               "0"),
      Optional(Number("task.obstacles[].motion.growth", "m/s", kNotNegative, "How fast this grows."), "0"),
      Optional(Number("task.obstacles[].motion.growth_rate", "m/s^2", kNotNegative, "How fast the growth grows."), "0"),
      Optional(Number("task.obstacles[].motion.from", "s", kWithinDecades,
                      "It is there from this time on, rounded down to microseconds."),
               "always"),
      Optional(Number("task.obstacles[].motion.until", "s", kWithinDecades,
                      "It is there up to this time, rounded up, and then nowhere."),
               "always"),
  };
}

std::vector<Key> KeepInKeys() {
  const Range count = Between(3, kMaxKeepInCorners);
  const Range place = Between(-1e9, 1e9);
  return {
      Optional(List("task.keep_in", Between(0, 16),
                    "Areas that the robot has to stay in, in each of them; for two safety coordinates. They need not "
                    "be convex. All outside and the boundary are obstacles, in convex pieces, which count as such."),
               "[]"),
      Map("task.keep_in[]", "One area.", ReadKeepIn),
      Optional(Text("task.keep_in[].name",
                    fmt::format("For messages: \"may leave lawn\". As of an obstacle, at most {} characters.",
                                kMaxObstacleName - kOutside.size())),
               "keep_in"),
      Required(Vectors("task.keep_in[].vertices", "m", place, count, Size::kSafety,
                       "The corners of its boundary, one after the other, in either direction. Sides may not meet.")),
      Optional(List("task.keep_in[].holes", Between(0, kMaxKeepInCorners / 3), "Parts of it that are no part of it."),
               "[]"),
      Vectors("task.keep_in[].holes[]", "m", place, count, Size::kSafety,
              "The corners of a hole inside of the boundary, apart from it and from other holes."),
  };
}

void CheckOrder(const Field& at, TaskDraft& draft) {
  const int order = draft.problem.zonotope_order, states = draft.problem.model->num_states(),
            largest = (kMaxGenerators - 1) / states - 2;
  if (order > largest)
    at.Fail("zonotope_order", fmt::format("{} is outside [1, {}] for {} states", order, largest, states));
}

std::vector<Key> CertifierKeys() {
  const OptionRows<Problem> certifier("certifier", [](TaskDraft& draft) -> Problem& { return draft.problem; });
  return {
      Optional(Map("certifier", "Options of the certifier.", CheckOrder), "{}"),
      certifier.Word<Method>("method", {{"centred", Method::kCentred}, {"paper", Method::kPaper}}, &Problem::method,
                             "paper: Algorithm 1 of the paper; it will not change. centred: the same with a tighter "
                             "bound on the model's remainder."),
      certifier.Integer("zonotope_order", Between(1, kMaxGenerators), &Problem::zonotope_order,
                        fmt::format("rho: a slice has at most rho generators for each state. (rho + 2) times the "
                                    "number of states may not exceed {}.",
                                    kMaxGenerators - 1)),
      certifier.Integer("max_leaf_visits", Between(1, 1 << 20), &Problem::max_leaf_visits,
                        "How many groups of 32 observations one search for the tightest bound may visit. Every subset "
                        "gives a sound bound; a decision that met this cap says so."),
      certifier.Integer("max_observations", Between(1, 100'000'000), &Problem::max_observations,
                        "The most that are stored. Above it, observations that never attain the envelope are removed."),
  };
}

}  // namespace

std::vector<Key> ProblemKeys() {
  std::vector<Key> keys;
  for (const auto part : {DomainKeys, DeclarationKeys, ResidualKeys, TaskKeys, BodyKeys, BetweenKeys, LimitKeys,
                          ObstacleKeys, KeepInKeys, CertifierKeys})
    std::ranges::move(part(), std::back_inserter(keys));
  return keys;
}

}  // namespace forereach::key_rows
