#include "forereach/certify/certifier.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "forereach/certify/tube.h"
#include "forereach/numerics/arithmetic.h"
#include "forereach/numerics/require.h"
#include "forereach/numerics/size.h"
#include "forereach/numerics/text.h"

namespace forereach {
namespace {

// The place of the robot's frame has to be that of the configuration, however often an angle has turned. PlacementOf
// requires it of places at expressions.
void RequireSameAfterTurns(const Problem& problem) {
  const NominalModel& model = *problem.model;
  for (const int angle : model.angles())
    Require(angle >= problem.projection.cols() || problem.projection.col(angle).isZero(0),
            "projection: depends on " + model.state_names()[ToSize(angle)] +
                ", which is an angle: how often it has turned is not known");
}

// Checks what every certifier reads of a problem.
const Problem& Validated(const std::shared_ptr<const Problem>& problem) {
  RequireExactArithmetic();  // what the proof assumes of the machine: docs/soundness.md, 1
  Require(problem && problem->model, "problem: no model");
  const int n = problem->model->num_states();
  problem->domain.Validate(n, problem->model->num_inputs());
  problem->declaration.ValidateDisturbance(n);
  // A slice has one column more where steps may be off their times. A successor adds up to 2 n columns before it is
  // reduced, a projection up to p.
  const int highest_order = (kMaxGenerators - 1 - std::max(2 * n, kMaxSafetyDim)) / n;
  Require(1 <= problem->zonotope_order && problem->zonotope_order <= highest_order,
          "zonotope_order: " + std::to_string(problem->zonotope_order) + " is outside [1, " +
              std::to_string(highest_order) + "] for " + std::to_string(n) + " states");
  RequireSameAfterTurns(*problem);
  for (const RestBound& bound : problem->rest)
    Require(0 <= bound.coordinate && bound.coordinate < n && bound.tolerance >= 0 && bound.tolerance < kInfinity,
            "rest: coordinate " + std::to_string(bound.coordinate) + " within " + std::to_string(bound.tolerance) +
                " is no state of the model, or negative or not finite");
  return *problem;
}

// Checks declaration and transitions, of which the envelope is made.
void ValidateObservations(const Problem& problem) {
  const int variables = problem.model->num_variables();
  problem.declaration.Validate(problem.model->num_states(), variables);
  Require(problem.transitions.z.cols() == variables || problem.transitions.size() == 0,
          "transitions: " + std::to_string(problem.transitions.z.cols()) + " columns, must be " +
              std::to_string(variables));
  for (int i = 0; i < problem.transitions.size(); ++i) {
    const Eigen::VectorXd z = problem.transitions.z.row(i);
    Require(IsWithin(problem, {z.data(), ToSize(z.size())}, problem.transitions.IsLearned(i)),
            "transition " + std::to_string(i) + ": lies outside the certification domain" +
                (problem.declaration.HasErrorInZ() ? ", or may within the declared errors" : ""));
  }
  ValidateDurations(problem);
  const std::string coupled = FindCoupledRegion(problem);
  Require(coupled.empty(),
          "declaration: " + coupled + ", by which a region is bounded: paths have to stay in the domain");
  const std::string turning = FindTurningRegion(problem);
  Require(turning.empty(), "declaration: " + turning);
}

// The domain's box over z = (x, u) envelops every query.
ObservationStore MakeStore(const Problem& problem, const Observations& observations) {
  const auto corners = problem.domain.Corners();
  StoreOptions options;
  options.max_observations = ToSize(problem.max_observations);
  options.envelope.max_leaf_visits = problem.max_leaf_visits;
  options.envelope.instructions = problem.instructions;
  const auto make = [&](const Observations& known) {
    return ObservationStore(WithoutAffineRows(problem.declaration), known, corners.first, corners.second, options);
  };
  if (problem.declaration.affine.rows.empty()) return make(observations);
  return make(WithoutAffineRows(problem.declaration, observations));
}

Decision Falsified(int step, int coordinate, Cause cause = Cause::kPairwise) {
  Decision decision;
  decision.outcome = Outcome::kFalsified;
  decision.cause = cause;
  decision.step = step;
  decision.coordinate = coordinate;
  return decision;
}

Decision Falsified(const Violation& violation) {
  Decision decision = Falsified(-1, violation.coordinate, violation.second < 0 ? Cause::kBound : Cause::kPairwise);
  decision.first_observation = violation.first;
  decision.second_observation = violation.second;
  decision.margin = violation.difference;
  decision.threshold = violation.bound;
  return decision;
}

Decision Stopped(const StepResult& result, int step, const StepRecord& record) {
  Decision decision;
  decision.outcome = Outcome::kDomain;
  decision.step = step;
  switch (result.status) {
    case StepResult::Status::kDomainExit:
      decision.cause = Cause::kDomainExit;
      decision.exit = result.exit;
      decision.coordinate = result.exit.index;
      decision.margin = result.exit.value;
      decision.threshold = result.exit.bound;
      return decision;
    case StepResult::Status::kInconsistent: {
      const auto k = ToSize(result.coordinate);
      decision = Falsified(step, result.coordinate);
      decision.margin = record.envelope.lower[k];
      decision.threshold = record.envelope.upper[k];
      return decision;
    }
    case StepResult::Status::kNoFiniteEnclosure:
    case StepResult::Status::kDone:  // of a step that was not stopped: not to be certified
      decision.cause = Cause::kNoFiniteEnclosure;
      decision.coordinate = result.coordinate;
      decision.margin = decision.threshold = kInfinity;
      return decision;
  }
  return decision;
}

}  // namespace

Certifier::Observed::Observed(const Problem& problem, const Observations& observations)
    : store(MakeStore(problem, observations)), known(store.snapshot()) {
  const auto [lower, upper] = problem.domain.Corners();
  if (!problem.declaration.regions.empty()) regional.emplace(problem.declaration, observations, lower, upper, known);
  if (!problem.declaration.affine.rows.empty())
    affine.emplace(problem.declaration, observations, lower, upper, lipschitz());
}

Certifier::Observed::Observed(const Problem& problem)
    : Observed(problem, (ValidateObservations(problem),
                         Observe(*problem.model, problem.declaration, problem.transitions, problem.timing))) {}

int Certifier::Observed::Add(std::span<const double> z, const Observations& observation) {
  const auto entries = [](const Eigen::MatrixXd& one_row) {
    return std::span<const double>(one_row.data(), ToSize(one_row.size()));
  };
  const auto insert = [&](const Observations& one) {
    return store.Insert(z, entries(one.lower), entries(one.upper)).id;
  };
  const int id = insert(affine ? WithoutAffineRows(affine->declaration(), observation) : observation);
  // What the store refuses is outside the domain, where nothing is declared: no other enclosure may know it either.
  if (id >= 0 && regional) regional->Add(id, z, entries(observation.lower), entries(observation.upper));
  if (id >= 0 && affine) affine->Add(id, z, entries(observation.lower), entries(observation.upper));
  return id;
}

const AffineContradiction* Certifier::Observed::affine_contradiction() const {
  if (pair_violation() || !affine || !affine->contradiction()) return nullptr;
  return &*affine->contradiction();
}

std::optional<Violation> Certifier::Observed::violation() const {
  const AffineContradiction* const found = affine_contradiction();
  return found ? AsViolation(*found) : pair_violation();
}

namespace {

// "0.5 v - 1 a is constant": of a row whose parameters no observation bounds.
std::string Flat(const std::vector<double>& normal, const std::vector<int>& columns, const NominalModel& model) {
  std::string sum;
  for (std::size_t j = 0; j < normal.size(); ++j) {
    const double share = std::round(std::abs(normal[j]) * 1e3) / 1e3;
    if (share == 0) continue;
    if (!sum.empty())
      sum += normal[j] < 0 ? " - " : " + ";
    else if (normal[j] < 0)
      sum += "-";
    sum += (share == 1 ? "" : ToText(share) + " ") + model.variable_names()[ToSize(columns[j])];
  }
  return sum;
}

std::span<const double> EntriesOf(const Eigen::VectorXd& vector) { return {vector.data(), ToSize(vector.size())}; }

}  // namespace

// Of the problem's transitions the one that exceeds a bound by the largest factor.
void Certifier::TestRates() {
  const Transitions& data = problem_->transitions;
  for (int i = 0; i < data.size() && !rates_.bounds().empty(); ++i) {
    const Eigen::VectorXd z = data.z.row(i), next = data.x_next.row(i);
    const Eigen::VectorXd shown = rates_.Shown(EntriesOf(z), EntriesOf(next), data.Longer(i), data.IsLearned(i));
    const auto found = rates_.FindViolation(shown, i);
    if (!found ||
        (too_fast_ && FactorOf(found->difference, found->bound) <= FactorOf(too_fast_->difference, too_fast_->bound)))
      continue;
    too_fast_ = found;
  }
  if (!violation_) violation_ = too_fast_;
}

std::vector<int> Certifier::Contradicting() const {
  const AffineContradiction* const found = observed_ ? observed_->affine_contradiction() : nullptr;
  std::vector<int> ids = found ? found->rows : std::vector{violation_->first, violation_->second};
  std::erase_if(ids, [](int id) { return id < 0; });
  std::ranges::sort(ids);
  return ids;
}

Transitions Certifier::Contradiction() const {
  const Transitions& given = problem_->transitions;
  Transitions rows{Eigen::MatrixXd(0, given.z.cols()), Eigen::MatrixXd(0, given.x_next.cols())};
  const auto add = [&](const Eigen::RowVectorXd& z, const Eigen::RowVectorXd& next, double longer, bool is_learned) {
    const Eigen::Index row = rows.z.rows();
    rows.z.conservativeResize(row + 1, Eigen::NoChange);
    rows.x_next.conservativeResize(row + 1, Eigen::NoChange);
    rows.longer.conservativeResize(row + 1);
    rows.z.row(row) = z, rows.x_next.row(row) = next, rows.longer[row] = longer;
    rows.num_learned += is_learned ? 1 : 0;
  };
  for (const int id : Contradicting()) {
    if (id < given.size()) {
      add(given.z.row(id), given.x_next.row(id), given.Longer(id), given.IsLearned(id));
    } else if (const auto found_id = std::ranges::lower_bound(learned_ids_, id);
               found_id != learned_ids_.end() && *found_id == id) {
      const auto row = [](std::span<const double> values) {
        return Eigen::Map<const Eigen::RowVectorXd>(values.data(), std::ssize(values));
      };
      const auto [z, next, longer] = learned_[ToSize(found_id - learned_ids_.begin())];
      add(row(z), row(next), longer, true);
    }
  }
  return rows;
}

std::string Certifier::Unexcited() const {
  if (!observed_ || !observed_->affine) return {};
  const AffineRows& affine = problem_->declaration.affine;
  for (const int k : affine.rows) {
    const AffineSet& set = observed_->affine->set(k);
    if (set.IsBounded() || set.contradiction()) continue;
    const std::string sum = Flat(set.unexcited(), affine.columns, *problem_->model);
    return "the residual of " + problem_->model->state_names()[ToSize(k)] + " has no bound: " +
           (sum.empty() ? "its parameters are too uncertain" : sum + " is the same in all observations");
  }
  return {};
}

// The store drops observations for want of room, but none with a contradiction among them. Affine rows keep all.
void Certifier::ForgetDropped() {
  // A contradiction is kept on disk with all of its rows (`Contradiction`), so none of them may go.
  if (violation_ || observed_->affine || learned_.size() <= 2 * observed_->known.size()) return;
  const std::vector<int> kept = observed_->known.ids();
  LearnedTransitions left;
  std::vector<int> ids;
  for (std::size_t i = 0; i < learned_ids_.size(); ++i) {
    const int id = learned_ids_[i];
    if (!std::ranges::binary_search(kept, id) && !(observed_->regional && observed_->regional->Keeps(id))) continue;
    left.Add(learned_[i].z, learned_[i].next, learned_[i].longer);
    ids.push_back(id);
  }
  learned_ = std::move(left);
  learned_ids_ = std::move(ids);
}

namespace {

// What bounds a step's disturbance by regions; null if none does.
std::shared_ptr<const RegionGrid> DisturbedRegions(const Problem& problem) {
  if (!problem.declaration.AnyRegionHas(&Region::disturbance)) return nullptr;
  const auto [lower, upper] = problem.domain.Corners();
  return std::make_shared<const RegionGrid>(problem.declaration, lower, upper);
}

// The states that the slack may hold: the slope of a row ties its columns to others.
unsigned SeparableStates(const Problem& problem, const Placement& placement) {
  if (!problem.declaration.affine.rows.empty()) return 0;
  unsigned states = placement.SeparableStates();
  for (const Region& region : problem.declaration.regions)
    for (const Region::Side& side : region.box)
      if (side.variable < problem.model->num_states()) states &= ~(1u << side.variable);
  return states;
}

}  // namespace

Certifier::Certifier(std::shared_ptr<const Problem> problem)
    : problem_((Validated(problem), std::move(problem))),
      safety_(*problem_),
      limits_(*problem_),
      rates_(*problem_),
      observed_(std::in_place, *problem_),
      violation_(observed_->violation()),
      propagator_(*problem_->model, problem_->domain, observed_->residual(), problem_->declaration.disturbance,
                  problem_->zonotope_order, problem_->method, problem_->instructions, problem_->timing,
                  ActedInputs(problem_->declaration), problem_->declaration.growing,
                  SeparableStates(*problem_, safety_.placement()), DisturbedRegions(*problem_)) {
  TestRates();
}

Certifier::Certifier(std::shared_ptr<const Problem> problem, const ResidualEnclosure& residual)
    : problem_((Validated(problem), std::move(problem))),
      safety_(*problem_),
      limits_(*problem_),
      rates_(*problem_),
      propagator_(*problem_->model, problem_->domain, residual, problem_->declaration.disturbance,
                  problem_->zonotope_order, problem_->method, problem_->instructions, problem_->timing, {},
                  problem_->declaration.growing, SeparableStates(*problem_, safety_.placement())) {
  // Soundness 3.18 bounds what an input's error does to the residual by L, and nobody says that this residual keeps L.
  forereach::Require(problem_->declaration.input_error.isZero(0),
                     "declaration: input_error counts by lipschitz, which does not bound a residual of another kind");
}

Learned Certifier::Learn(std::span<const double> z, std::span<const double> next, double longer,
                         std::optional<double> by_clock) {
  Observations observed;
  // What is learned is for good, so what may say nothing true (no value, no turns, near the edge) is refused here.
  if (const Learned learned = Observe(*problem_, z, next, longer, observed); learned != Learned::kAdded) return learned;
  const int id = observed_->Add(z, observed);
  if (id < 0) return Learned::kOutsideDomain;
  learned_.Add(z, next, by_clock.value_or(longer));
  learned_ids_.push_back(id);
  observed_->known = observed_->store.snapshot();
  if (!too_fast_ && !rates_.bounds().empty()) too_fast_ = rates_.FindViolation(rates_.Shown(z, next, longer, true), id);
  violation_ = observed_->violation();
  if (!violation_) violation_ = too_fast_;
  ForgetDropped();
  return Learned::kAdded;
}

std::optional<Certifier::Misfit> Certifier::FindMisfit(const Plan& plan) const {
  const NominalModel& model = *problem_->model;
  const auto number = [](auto value) { return std::to_string(value); };
  const auto size = [](const std::string& what) { return Misfit{Misfit::Kind::kSize, "plan: " + what}; };
  if (plan.num_inputs != model.num_inputs())
    return size(number(plan.num_inputs) + " inputs, the model has " + number(model.num_inputs()));
  if (plan.stride < plan.num_inputs)
    return size("stride " + number(plan.stride) + ", must be at least its " + number(plan.num_inputs) + " inputs");
  if (plan.num_steps < 1 || plan.num_steps > kMaxSteps)
    return size(number(plan.num_steps) + " steps, must be 1 to " + number(kMaxSteps));
  if (plan.controls == nullptr) return size("no controls, its pointer is null");
  const auto& [start, step, error] = plan.schedule;
  constexpr std::int64_t kLatest = Schedule::kLatest, kLongest = Schedule::kLongest;
  if (start < -kLatest || start > kLatest || step < 0 || step > kLongest || error < 0 || error > kLongest)
    return size("its schedule starts at " + number(start) + " us with steps of " + number(step) +
                " us and a clock error of " + number(error) + " us, must be within 2^60, [0, 2^40] and [0, 2^40]");
  // NaN would pass no comparison of the step, but a caller has to hear which number it was.
  for (int t = 0; t < plan.num_steps; ++t)
    for (std::size_t k = 0; k < plan.input(t).size(); ++k)
      if (!std::isfinite(plan.input(t)[k]))
        return Misfit{Misfit::Kind::kNumber, "plan: step " + number(t) + ": " + model.input_names()[k] + " is " +
                                                 number(plan.input(t)[k]) + ", must be finite"};
  return std::nullopt;
}

void Certifier::Require(const Plan& plan, const Zonotope& initial_set, const ObstacleView& obstacles) const {
  if (const auto misfit = FindMisfit(plan)) throw std::invalid_argument(misfit->what);
  const bool moves =
      std::ranges::any_of(obstacles.all(), [](const Obstacle& obstacle) { return obstacle.motion().has_value(); });
  forereach::Require(!moves || plan.schedule.step_us > 0, "plan: no schedule, and an obstacle moves");
  Require(initial_set, obstacles);
}

void Certifier::Require(const Zonotope& initial_set, const ObstacleView& obstacles) const {
  const NominalModel& model = *problem_->model;
  const auto number = [](auto value) { return std::to_string(value); };
  forereach::Require(initial_set.dim() == model.num_states(), "initial set: dimension " + number(initial_set.dim()) +
                                                                  ", the model has " + number(model.num_states()) +
                                                                  " states");
  const int most = problem_->zonotope_order * model.num_states();
  forereach::Require(initial_set.num_generators() <= most, "initial set: " + number(initial_set.num_generators()) +
                                                               " generators, must be at most " + number(most) +
                                                               ", the zonotope order times the states");
  const auto grids = std::ranges::count_if(obstacles.all(), [](const Obstacle& each) { return !!each.grid(); });
  forereach::Require(grids <= ConvexNumbers::kMostGrids,
                     "obstacles: " + number(grids) + " grids, must be at most " + number(ConvexNumbers::kMostGrids));
  for (std::size_t o = 0; o < obstacles.size(); ++o)
    forereach::Require(obstacles[o].dim() == projection().dim(),
                       "obstacle " + std::to_string(o) + ": dimension " + std::to_string(obstacles[o].dim()) +
                           ", the projection has " + std::to_string(projection().dim()));
}

Decision Certifier::Certify(const Plan& plan, const Zonotope& initial_set, const ObstacleView& obstacles, Tube& tube,
                            int known) const noexcept {
  // The first slices may be those of another plan with the same first controls (batch.h): a prefix, never more.
  tube.length_ = std::clamp(known, 0, tube.length_);
  Decision decision = Begin(initial_set, tube);
  if (decision.outcome != Outcome::kNone) return decision;
  decision = Propagate(plan, tube);
  if (decision.outcome == Outcome::kNone) decision = JudgeBetween(tube);
  if (decision.outcome == Outcome::kNone) decision = JudgeRest(tube);
  if (decision.outcome == Outcome::kNone) decision = JudgeSafety(plan, obstacles, tube);
  for (int t = 0; t < tube.length(); ++t) decision.capped |= tube.step(t).envelope.capped;
  return decision;
}

// A contradiction precedes every other cause: no residual is admissible, so a tube would say nothing.
Decision Certifier::Begin(const Zonotope& initial_set, Tube& tube) const noexcept {
  tube.slices_[0].Assign(initial_set);
  Propagator::HalfWidths(initial_set, tube.steps_[0].half_width.data());
  return violation() ? Falsified(*violation()) : Decision{};
}

Decision Certifier::Propagate(const Plan& plan, Tube& tube) const noexcept {
  for (int t = tube.length(); t < plan.num_steps; ++t) {
    const auto i = ToSize(t);
    StepRecord& record = tube.steps_[i];
    // Where the step before found its bounds the search begins. It may change which sound bound is found, never whether
    // it is one: any subset of the observations bounds the residual (soundness 3.5).
    record.envelope.found = t > 0 ? tube.steps_[i - 1].envelope.found : decltype(record.envelope.found){};
    const StepResult result = propagator_.Step(tube.slices_[i], plan.input(t), record, tube.slices_[i + 1],
                                               tube.steps_[i + 1].half_width.data(), t == 0);
    if (result.status != StepResult::Status::kDone) return Stopped(result, t, record);
    tube.length_ = t + 1;
  }
  return {};
}

Decision Certifier::JudgeSafety(const Plan& plan, const ObstacleView& obstacles, Tube& tube, int first) const noexcept {
  return JudgeSafety(plan, obstacles, tube, first, first, {});
}

Decision Certifier::JudgeSafety(const Plan& plan, const ObstacleView& obstacles, Tube& tube, int first_sample,
                                int first_unit, const Decision& before) const noexcept {
  const Decision limits = limits_.Judge(plan, tube, first_sample);
  const Decision among_obstacles = safety_.Judge(obstacles, plan.schedule, tube, first_unit, before);
  // The earlier failure is reported; of two at one step, the limit.
  const bool is_touched_before = among_obstacles.outcome == Outcome::kSafety && among_obstacles.step < limits.step;
  return limits.outcome == Outcome::kNone || is_touched_before ? among_obstacles : limits;
}

Decision Certifier::JudgeBetween(const Tube& tube, int first) const noexcept {
  Decision decision;
  for (int t = first; t < tube.length(); ++t)
    for (const RateBounds::Bound& bound : rates_.bounds()) {
      const int k = bound.state;
      const double least = LeastChange(tube.hull(t, k), tube.hull(t + 1, k), bound.is_angle);
      // D, though the data may be right: no motion within the declared rate joins the two slices, so the theorem at all
      // times would say nothing (soundness 3.17).
      if (!(least > bound.change)) continue;
      decision.outcome = Outcome::kDomain;
      decision.cause = Cause::kBetween;
      decision.step = t;
      decision.coordinate = k;
      decision.margin = least;
      decision.threshold = bound.change;
      return decision;
    }
  return decision;
}

Decision Certifier::JudgeRest(const Tube& tube) const noexcept {
  Decision decision;
  for (const RestBound& bound : problem_->rest) {
    const Interval reached = tube.hull(tube.length(), bound.coordinate);
    // All of the last slice has to be at rest: where the robot stops within it is not known. NaN fails both
    // comparisons.
    const bool is_below = reached.upper <= bound.tolerance;
    if (is_below && -bound.tolerance <= reached.lower) continue;
    decision.outcome = Outcome::kDomain;
    decision.cause = Cause::kNoStop;
    decision.step = tube.length();
    decision.coordinate = bound.coordinate;
    decision.margin = is_below ? reached.lower : reached.upper;
    decision.threshold = is_below ? -bound.tolerance : bound.tolerance;
    break;
  }
  return decision;
}

}  // namespace forereach
