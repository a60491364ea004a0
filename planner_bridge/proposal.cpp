#include "planner_bridge/proposal.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>

#include <fmt/core.h>
#include <ompl/base/Goal.h>
#include <ompl/base/ProjectionEvaluator.h>
#include <ompl/base/spaces/RealVectorStateSpace.h>
#include <ompl/control/PathControl.h>
#include <ompl/control/SimpleSetup.h>
#include <ompl/control/planners/est/EST.h>
#include <ompl/control/planners/kpiece/KPIECE1.h>
#include <ompl/control/planners/pdst/PDST.h>
#include <ompl/control/planners/rrt/RRT.h>
#include <ompl/control/planners/sst/SST.h>
#include <ompl/control/spaces/RealVectorControlSpace.h>
#include <ompl/util/Console.h>
#include <ompl/util/RandomNumbers.h>
#include <Eigen/QR>

#include "forereach/certify/extender.h"
#include "forereach/certify/tube.h"
#include "forereach/numerics/size.h"
#include "forereach/safety/clearance.h"
#include "forereach/safety/limit_values.h"
#include "planner_bridge/navigation.h"
#include "planner_bridge/reference.h"

namespace forereach {
namespace {

namespace ob = ompl::base;
namespace oc = ompl::control;

constexpr double kTouch = 1e-6;         // m, kept where the start is nearer to an obstacle than the clearance
constexpr double kOverspeed = 1.05;     // times the cruise speed
constexpr double kShareOfRadius = 0.7;  // the goal counts as reached this far inside its radius
constexpr unsigned kLongestHold = 4;    // steps one control is held at most
constexpr double kLargestTurn = 0.8;    // rad, off the way down the navigation field
constexpr double kLargestSlowdown = 0.5;
constexpr int kLookAhead = 4;      // steps
constexpr double kReverse = 1e-3;  // m/s, what counts as standing still
constexpr double kRoomAhead = 1;   // s at cruise speed, kept free beyond a braking tail: enough to turn away in
constexpr int kRoomSamples = 9;
constexpr double kLeastCell = 1.0 / 9;  // of a cruising step
constexpr double kCellsOfJoints = 60;   // along the longer side of a field around a body at expressions
constexpr double kArrivalTime = 2.5;    // s: a robot that is nearer to the goal than this takes its speed back ...
constexpr double kArrivalSpeed = 0.35;  // ... down to this share of the cruise speed

/** What a progress part has to achieve. Tried in turn, the later ones are easier. */
struct Ambition {
  double share;    // of the distance that cruising straight at the goal would gain
  double heading;  // least cosine between the motion at the end and the way to the goal
  bool room;       // to drive on from where the tail ends; a robot that can back off has to have it
  bool at_rest;    // only for a robot at rest: it may have to turn round, and takes any progress
};
constexpr std::array<Ambition, 6> kAmbitions{{{0.9, 0.98, true, false},
                                              {0.8, 0.92, true, false},
                                              {0.6, 0.8, true, false},
                                              {0.2, 0.4, true, false},
                                              {-0.5, -1, true, true},
                                              {0, -1, false, true}}};

const double* Values(const ob::State* state) { return state->as<ob::RealVectorStateSpace::StateType>()->values; }
double* Values(ob::State* state) { return state->as<ob::RealVectorStateSpace::StateType>()->values; }
using RealVectorControl = oc::RealVectorControlSpace::ControlType;
const double* Values(const oc::Control* control) { return control->as<RealVectorControl>()->values; }
double* Values(oc::Control* control) { return control->as<RealVectorControl>()->values; }

using Node = std::shared_ptr<const TubeNode>;

// Where the tree is certified, a state has the node of the tube that leads there; both are copied together.
class SearchSpace final : public ob::RealVectorStateSpace {
 public:
  struct NodeState final : StateType {
    Node node;
  };
  using RealVectorStateSpace::RealVectorStateSpace;

  ob::State* allocState() const override {
    auto* const state = new NodeState;
    state->values = new double[dimension_];
    return state;
  }
  void freeState(ob::State* state) const override {
    delete[] Values(state);
    delete static_cast<NodeState*>(state);
  }
  void copyState(ob::State* to, const ob::State* from) const override {
    RealVectorStateSpace::copyState(to, from);
    NodeOf(to) = NodeOf(from);
  }
  static Node& NodeOf(ob::State* state) { return static_cast<NodeState*>(state)->node; }
  static const Node& NodeOf(const ob::State* state) { return static_cast<const NodeState*>(state)->node; }
};

// For a tree whose nodes are certified.
struct Certifying {
  explicit Certifying(const std::shared_ptr<const Problem>& problem) : certifier(problem) {}
  Certifier certifier;
  Tube tube;
};

Box ProjectedRegion(const Problem& problem) {
  const Box& box = problem.domain.state;
  const Eigen::MatrixXd positive = problem.projection.cwiseMax(0), negative = problem.projection.cwiseMin(0);
  return Box(positive * box.lower() + negative * box.upper(), positive * box.upper() + negative * box.lower());
}

template <class Algorithm>
std::shared_ptr<ob::Planner> Make(const oc::SpaceInformationPtr& space) {
  return std::make_shared<Algorithm>(space);
}

using MakeAlgorithm = std::shared_ptr<ob::Planner> (*)(const oc::SpaceInformationPtr&);

MakeAlgorithm AlgorithmNamed(const std::string& name) {
  static const std::map<std::string, MakeAlgorithm> algorithms{{"kpiece", Make<oc::KPIECE1>},
                                                               {"est", Make<oc::EST>},
                                                               {"pdst", Make<oc::PDST>},
                                                               {"rrt", Make<oc::RRT>},
                                                               {"sst", Make<oc::SST>}};
  const auto found = algorithms.find(name);
  if (found == algorithms.end())
    throw std::invalid_argument(fmt::format("planner.algorithm: {} is not kpiece, est, pdst, rrt or sst", name));
  return found->second;
}

// How far the body reaches to the sides of its way, metres. A body that turns with a heading drives along its first
// axis.
double HalfBreadth(const Body& body) {
  double breadth = 0;
  for (const BodyPart& part : body.parts)
    for (const Eigen::Vector3d& point : part.points)  // parts at expressions have none
      breadth = std::max(breadth, (body.heading >= 0 ? std::abs(point.y()) : point.norm()) + part.radius);
  return breadth;
}

// The body at a sample, or what it sweeps from one to the next, as seen from obstacles.
class Sweep {
 public:
  using Parts = std::vector<BodyPart>;

  // At sample t.
  Sweep(Parts at, int t) : from_(std::move(at)), first_(t), last_(t) {}
  // From sample t to the next. Each part is widened by its deviation.
  Sweep(Parts from, Parts to, const std::vector<double>& deviation, int t)
      : from_(std::move(from)), to_(std::move(to)), first_(t), last_(t + 1) {
    for (std::size_t i = 0; i < from_.size(); ++i) from_[i].radius += deviation[i];
  }

  [[nodiscard]] int first() const { return first_; }
  // Whether it keeps more than `clearance` from the obstacle.
  [[nodiscard]] bool Keeps(double clearance, const Obstacle& obstacle, const Schedule& schedule) const {
    for (std::size_t i = 0; i < from_.size(); ++i)
      if (!IsFar(i, clearance, obstacle) &&
          !(ApproximateDistance(obstacle, from_[i], To(i), schedule, first_, last_) > clearance))
        return false;
    return true;
  }

 private:
  // By a ball around the part that settles most of them in less time.
  [[nodiscard]] bool IsFar(std::size_t i, double clearance, const Obstacle& obstacle) const {
    const BodyPart &from = from_[i], &to = To(i);
    if (obstacle.motion() || (first_ == last_ && from.points.size() == 1)) return false;
    const Eigen::Vector3d middle = (from.points[0] + to.points[0]) / 2;
    double reach = 0;
    for (const auto* part : {&from, &to})
      for (const Eigen::Vector3d& point : part->points) reach = std::max(reach, (point - middle).norm());
    return ApproximateDistance(obstacle, middle.head(obstacle.dim())) > clearance + reach + from.radius;
  }

  [[nodiscard]] const BodyPart& To(std::size_t i) const { return first_ == last_ ? from_[i] : to_[i]; }

  Parts from_, to_;
  int first_, last_;
};

/** If there are hints: mostly follows one, for a step at a time and with some error; sometimes any control, held for
longer. */
class HintedSampler final : public oc::ControlSampler {
 public:
  /** Fills a control for the given state; `turn` from [-1, 1] and `slower` from [0, 1] say how to err. */
  using Hint = std::function<void(const double* s, double turn, double slower, double* u)>;
  /** Changes a control drawn at random into one for the given state, with `share` from [0, 1]. */
  using Explore = std::function<void(const double* s, double share, double* u)>;

  HintedSampler(const oc::ControlSpace* space, Hint hint, Explore explore)
      : ControlSampler(space), hint_(std::move(hint)), explore_(std::move(explore)) {}

  void sample(oc::Control* control) override {
    hinted_ = false;
    const ob::RealVectorBounds& bounds = space_->as<oc::RealVectorControlSpace>()->getBounds();
    double* u = Values(control);
    for (std::size_t k = 0; k < bounds.low.size(); ++k) u[k] = rng_.uniformReal(bounds.low[k], bounds.high[k]);
  }
  void sample(oc::Control* control, const ob::State* state) override {
    if (!hint_ || rng_.uniform01() > kHinted) {
      sample(control);
      return explore_(Values(state), rng_.uniform01(), Values(control));
    }
    hinted_ = true;
    const double turn = std::clamp(rng_.gaussian(0, 0.4), -1.0, 1.0), slower = rng_.uniform01() * rng_.uniform01();
    hint_(Values(state), turn, slower, Values(control));
  }
  void sampleNext(oc::Control* control, const oc::Control*) override { sample(control); }
  void sampleNext(oc::Control* control, const oc::Control*, const ob::State* state) override { sample(control, state); }
  unsigned int sampleStepCount(unsigned int least, unsigned int most) override {
    return hinted_ ? least : ControlSampler::sampleStepCount(least, most);
  }

 private:
  static constexpr double kHinted = 0.9;
  const Hint hint_;  // empty: there are none
  const Explore explore_;
  bool hinted_ = false;
};

/** Position in the safety coordinates, for the planners that keep a grid. */
class PositionProjection final : public ob::ProjectionEvaluator {
 public:
  PositionProjection(const ob::StateSpacePtr& space, const Eigen::MatrixXd& projection, double cell)
      : ProjectionEvaluator(space), projection_(projection), cell_(cell) {}

  unsigned int getDimension() const override { return static_cast<unsigned>(projection_.rows()); }
  void defaultCellSizes() override { cellSizes_.assign(static_cast<std::size_t>(projection_.rows()), cell_); }
  void project(const ob::State* state, Eigen::Ref<Eigen::VectorXd> position) const override {
    position = projection_ * Eigen::Map<const Eigen::VectorXd>(Values(state), projection_.cols());
  }

 private:
  const Eigen::MatrixXd projection_;
  const double cell_;
};

class Planner final : public Proposer {
 public:
  explicit Planner(const Config& config)
      : problem_(config.problem),
        options_(config.planner),
        make_algorithm_(AlgorithmNamed(options_.algorithm)),
        motion_(config, Braking::kPlanned),
        places_(*problem_->model, problem_->projection, problem_->body),
        limits_(*problem_->model, problem_->limits),
        region_(ProjectedRegion(*problem_)),
        goal_(Eigen::Map<const Eigen::VectorXd>(options_.goal.data(), std::ssize(options_.goal))),
        obstacles_(config.obstacles),
        certifying_(options_.certifies ? std::make_unique<Certifying>(problem_) : nullptr) {
    ompl::msg::noOutputHandler();
  }

  [[nodiscard]] const RobotMotion& motion() const override { return motion_; }
  void SetObstacles(std::vector<Obstacle> obstacles) override {
    obstacles_ = std::move(obstacles);
    fields_.clear();
  }

  // At a time: what is gone by then is not in the way.
  const NavigationField& Field(double clearance, std::int64_t time_us) {
    constexpr std::size_t kKept = 64;
    // Clearances are learned, so their number has no bound of its own.
    if (fields_.size() > kKept) fields_.clear();
    const auto gone =
        std::ranges::count_if(obstacles_, [&](const Obstacle& obstacle) { return IsGone(obstacle, time_us); });
    const auto [field, is_new] = fields_.try_emplace({clearance, gone});
    if (is_new) field->second.emplace(MakeField(clearance, time_us));
    return *field->second;
  }

  [[nodiscard]] std::optional<Proposal> Propose(const PlanRequest& request) override;
  [[nodiscard]] bool HasRoom(const PlanRequest& request, const Eigen::VectorXd& direction) override;

 private:
  class ProposalSearch;

  // Around obstacles. Where no part of the body is in its frame, P x is no place among them: what counts is where the
  // body is in a state with this P x, at rest.
  [[nodiscard]] NavigationField MakeField(double clearance, std::int64_t time_us) const {
    if (HasFrame(problem_->body)) return {region_, RoomOfPoint(obstacles_, time_us), clearance + half_breadth_, goal_};
    const RoomAt room = [this](const Eigen::VectorXd& y) {
      const Eigen::VectorXd x = shift_ * y;
      double least = kInfinity;
      for (const BodyPart& part : places_.At({x.data(), ToSize(x.size())}))
        for (const Obstacle& obstacle : obstacles_)
          if (!obstacle.motion()) least = std::min(least, ApproximateDistance(obstacle, part));
      return least;
    };
    return {region_, room, clearance, goal_, (region_.upper() - region_.lower()).maxCoeff() / kCellsOfJoints};
  }

  std::shared_ptr<const Problem> problem_;
  PlannerOptions options_;
  MakeAlgorithm make_algorithm_;
  RobotMotion motion_;
  BodyPlaces places_;
  LimitValues limits_;
  const bool inputs_are_limited_ = limits_.SomeUseInputs();
  // Moves a state so that P x moves by a vector.
  const Eigen::MatrixXd shift_ = problem_->projection.completeOrthogonalDecomposition().pseudoInverse();
  Box region_;
  Eigen::VectorXd goal_;
  double half_breadth_ = HalfBreadth(problem_->body);
  std::vector<Obstacle> obstacles_;
  std::unique_ptr<Certifying> certifying_;  // or null
  std::map<std::pair<double, std::ptrdiff_t>, std::optional<NavigationField>>
      fields_;  // by clearance and how many are gone
};

/** One request: what is allowed, what counts as progress, and the work done so far. `more` is added to every distance
to keep on the way. */
class Planner::ProposalSearch {
 public:
  ProposalSearch(const Planner& planner, const PlanRequest& request, const NavigationField& field, double more = 0)
      : planner_(planner),
        field_(field),
        model_(*planner.problem_->model),
        n_(static_cast<std::size_t>(model_.num_states())),
        m_(static_cast<std::size_t>(model_.num_inputs())),
        start_(request.state),
        schedule_(request.schedule),
        more_(more) {
    const Box& box = planner.problem_->domain.state;
    const Eigen::VectorXd margin =
        request.domain_margin.size() == 0 ? Eigen::VectorXd::Zero(start_.size()) : request.domain_margin;
    // A start that is within the margin stays allowed, as does all that is no nearer to the bound.
    lower_ = (box.lower() + margin).cwiseMin(start_).cwiseMax(box.lower());
    upper_ = (box.upper() - margin).cwiseMax(start_).cwiseMin(box.upper());
    const std::span<const double> x(start_.data(), n_);
    if (planner.problem_->between)
      for (const BodyPart& part : planner.problem_->body.parts)
        deviation_.push_back(Deviation(*planner.problem_->between, part));
    const Sweep::Parts body = BodyAt(x);
    own_ = request.obstacle_clearance;
    own_.resize(planner.obstacles_.size());
    for (std::size_t o = 0; o < planner.obstacles_.size(); ++o) {
      const Obstacle& obstacle = planner.obstacles_[o];
      double distance = kInfinity;
      for (std::size_t i = 0; i < body.size(); ++i)
        distance = std::min(distance, ApproximateDistance(obstacle, body[i], body[i], schedule_, 0, 0) -
                                          (deviation_.empty() ? 0 : deviation_[i]));
      const double kept = std::max(distance - kTouch, 0.0);
      clearances_.push_back(std::min(kept, request.clearance));
      if (own_[o].first_step <= 0) own_[o].clearance = std::min(kept, own_[o].clearance);
    }
    limit_margin_ = LimitMargin(request);
    start_distance_ = field.DistanceToGo(Position(x));
    gain_ = IdealGain();
    // A robot that is already faster may slow down first.
    top_speed_ = std::max(kOverspeed * planner.options_.cruise_speed, planner.motion_.Speed(x));
    least_speed_ = std::min(-kReverse, planner.motion_.Speed(x));
    at_rest_ = planner.motion_.IsAtRest(x);
    start_valid_ = Allowed(x, 0) && BeginTree(request);
  }

  /** False if the start itself is not allowed. */
  [[nodiscard]] bool StartIsValid() const { return start_valid_; }
  [[nodiscard]] bool StartsAtRest() const { return at_rest_; }
  /** Whether the robot at rest in the start can drive on in a direction. */
  [[nodiscard]] bool StartHasRoom(const Eigen::VectorXd& direction) const {
    const std::span<const double> x(start_.data(), n_);
    return start_valid_ && HasRoom(x, Position(x), direction);
  }
  [[nodiscard]] std::optional<Proposal> Run(const Ambition& ambition, std::int64_t allowance) {
    const auto setup = SetUp(ambition);
    const std::int64_t most = work_ + allowance;
    std::int64_t rounds = 0;  // bounds a search that propagates nothing
    setup->solve(ob::PlannerTerminationCondition([&] { return work_ >= most || ++rounds > allowance; }));
    if (!setup->getProblemDefinition()->hasExactSolution()) return std::nullopt;
    oc::PathControl& path = setup->getSolutionPath();
    path.interpolate();
    Eigen::MatrixXd progress(static_cast<Eigen::Index>(m_), static_cast<Eigen::Index>(path.getControlCount()));
    for (Eigen::Index t = 0; t < progress.cols(); ++t)
      std::copy_n(Values(path.getControl(static_cast<unsigned>(t))), m_, progress.col(t).data());
    const ob::State* const end = path.getStates().back();
    return Assemble(progress, StateOf(Values(end)), SearchSpace::NodeOf(end), ambition);
  }

  /** What the hints themselves do, without a search. @pre the robot has hints. */
  [[nodiscard]] std::optional<Proposal> FollowHints() const {
    Eigen::MatrixXd progress(static_cast<Eigen::Index>(m_), planner_.options_.progress_steps);
    std::vector<double> s(start_.begin(), start_.end());
    s.insert(s.end(), {0, start_distance_});
    Node node = root_;
    for (int t = 0; t < progress.cols(); ++t) {
      double* u = progress.col(t).data();
      planner_.motion_.Pursue(StateOf(s.data()), DesiredIn(s.data(), 0, 0), {u, m_});
      if (!Propagate(s.data(), node, u, s.data(), node) || !Allowed(StateOf(s.data()), t + 1)) return std::nullopt;
    }
    for (const Ambition& ambition : kAmbitions)
      if (!ambition.at_rest && Meets(s.data(), node, ambition))
        return Assemble(progress, StateOf(s.data()), node, ambition);
    return std::nullopt;
  }

 private:
  class ProgressGoal final : public ob::Goal {
   public:
    ProgressGoal(const ob::SpaceInformationPtr& space, const ProposalSearch& search, const Ambition& ambition)
        : Goal(space), search_(search), ambition_(ambition) {}

    bool isSatisfied(const ob::State* state) const override { return isSatisfied(state, nullptr); }

    bool isSatisfied(const ob::State* state, double* distance) const override {
      const double* s = Values(state);
      const double missing = std::max(search_.Shortfall(s, ambition_), 0.0);
      const double steps = search_.planner_.options_.progress_steps - search_.StepsOf(s);
      const bool satisfied = steps == 0 && search_.Meets(s, SearchSpace::NodeOf(state), ambition_);
      // Metres and steps alike: only their order matters. OMPL takes a state at distance zero for a solution.
      if (distance != nullptr) *distance = satisfied ? 0 : missing + steps + 1;
      return satisfied;
    }

   private:
    const ProposalSearch& search_;
    const Ambition ambition_;
  };

  // A search state is x, the steps taken, and the shortest distance to go on the way.
  [[nodiscard]] double StepsOf(const double* s) const { return s[n_]; }
  [[nodiscard]] double BestOf(const double* s) const { return s[n_ + 1]; }
  [[nodiscard]] std::span<const double> StateOf(const double* s) const { return {s, n_}; }

  [[nodiscard]] Eigen::VectorXd Position(std::span<const double> x) const {
    return planner_.problem_->projection * Eigen::Map<const Eigen::VectorXd>(x.data(), std::ssize(x));
  }

  void Step(std::span<const double> x, const double* u, std::span<double> next) const {
    std::array<double, kMaxVariables> z;
    std::copy_n(u, m_, std::copy(x.begin(), x.end(), z.begin()));
    model_.Evaluate({z.data(), n_ + m_}, next);
    ++work_;
  }

  [[nodiscard]] Sweep::Parts BodyAt(std::span<const double> x) const { return planner_.places_.At(x); }

  // What the request asks for, or what the start has.
  [[nodiscard]] std::vector<double> LimitMargin(const PlanRequest& request) const {
    std::vector<double> margin(planner_.limits_.size());
    planner_.limits_.Room({start_.data(), n_}, {}, margin);
    for (std::size_t i = 0; i < margin.size(); ++i)
      margin[i] = std::clamp(margin[i], 0.0, i < request.limit_margin.size() ? request.limit_margin[i] : 0.0);
    return margin;
  }

  // Of a state, or of one with the input that is applied there.
  [[nodiscard]] bool KeepsLimitsOfStates(std::span<const double> x) const {
    return planner_.limits_.Keep(x, {}, limit_margin_);
  }
  [[nodiscard]] bool KeepsLimitsOfInputs(std::span<const double> z) const {
    return !planner_.inputs_are_limited_ || planner_.limits_.Keep(z.first(n_), z.subspan(n_), limit_margin_);
  }

  // A state at sample t.
  [[nodiscard]] bool Allowed(std::span<const double> x, int t) const {
    const Eigen::Map<const Eigen::ArrayXd> state(x.data(), start_.size());
    if (!((lower_.array() <= state).all() && (state <= upper_.array()).all())) return false;
    const double speed = planner_.motion_.Speed(x);
    if (!(least_speed_ <= speed && speed <= top_speed_) || !KeepsLimitsOfStates(x)) return false;
    return Clear(Sweep(BodyAt(x), t));
  }

  [[nodiscard]] bool Clear(const Sweep& sweep) const {
    for (std::size_t o = 0; o < clearances_.size(); ++o) {
      const double own = sweep.first() >= own_[o].first_step ? own_[o].clearance : 0;
      if (!sweep.Keeps(std::max(clearances_[o], own) + more_, planner_.obstacles_[o], schedule_)) return false;
    }
    return true;
  }

  // Whether the way from sample t to the next is clear, if that is to be certified.
  [[nodiscard]] bool WayIsClear(std::span<const double> x, std::span<const double> next, int t) const {
    return deviation_.empty() || Clear(Sweep(BodyAt(x), BodyAt(next), deviation_, t));
  }

  // The root of a tree that is certified. False if no plan from the request's X_0 is.
  [[nodiscard]] bool BeginTree(const PlanRequest& request) {
    if (!planner_.certifying_) return true;
    if (!request.initial_set) return false;
    Schedule schedule = request.schedule;
    schedule.start_us -= request.before.cols() * schedule.step_us;
    auto& [certifier, tube] = *planner_.certifying_;
    extender_.emplace(certifier, planner_.obstacles_, schedule, tube, false);
    auto root = std::make_shared<TubeNode>();
    bool proven = extender_->Begin(*request.initial_set, *root).outcome == Outcome::kNone;
    for (Eigen::Index t = 0; t < request.before.cols() && proven; ++t)
      proven = extender_->Extend(*root, {request.before.col(t).data(), m_}, *root).outcome == Outcome::kNone;
    root_ = std::move(root);
    return proven;
  }

  // The node after one more control, which may be that before. False if no plan that begins so is certified.
  [[nodiscard]] bool Extend(const Node& from, const double* u, Node& next) const {
    if (!extender_) return true;
    auto node = std::make_shared<TubeNode>();
    if (!from || from->depth() == kMaxSteps || extender_->Extend(*from, {u, m_}, *node).outcome != Outcome::kNone)
      return false;
    next = std::move(node);
    return true;
  }

  // False outside the certification domain, past the progress part, if the way is not clear or no tube leads there;
  // then `to` is not a state of the search.
  [[nodiscard]] bool Propagate(const double* from, const Node& from_node, const double* u, double* to,
                               Node& to_node) const {
    std::array<double, kMaxVariables> z;
    std::copy_n(u, m_, std::copy_n(from, n_, z.begin()));
    const double steps = StepsOf(from) + 1, best = BestOf(from);  // `to` may be `from`
    const std::span<const double> all(z.data(), n_ + m_);
    bool inside = steps <= planner_.options_.progress_steps && planner_.problem_->domain.Contains(all) &&
                  KeepsLimitsOfInputs(all);
    Step({z.data(), n_}, z.data() + n_, {to, n_});
    inside =
        inside && WayIsClear({z.data(), n_}, {to, n_}, static_cast<int>(steps) - 1) && Extend(from_node, u, to_node);
    to[n_] = inside ? steps : planner_.options_.progress_steps + 1;
    to[n_ + 1] = std::min(best, field_.DistanceToGo(Position({to, n_})));
    return inside;
  }

  // The speed to drive at a distance from the goal. It decreases towards the goal, so that the robot does not miss it.
  [[nodiscard]] double SpeedAt(double distance) const {
    const double cruise = planner_.options_.cruise_speed;
    return std::clamp(distance / kArrivalTime, kArrivalSpeed * cruise, cruise);
  }

  // Follows the descent of the navigation field a short distance ahead, with a turn and a lower speed.
  [[nodiscard]] DesiredMotion DesiredIn(const double* s, double turn, double slower) const {
    const Eigen::VectorXd position = Position(StateOf(s));
    const Eigen::VectorXd descent = field_.Descent(position + kLookAhead * Drift(StateOf(s)));
    const double heading = std::atan2(descent.size() > 1 ? descent(1) : 0.0, descent(0)) + kLargestTurn * turn;
    const double speed = SpeedAt(field_.DistanceToGo(position)) * (1 - kLargestSlowdown * slower);
    const double climb = descent.size() > 2 ? descent(2) : 0.0, level = std::sqrt(1 - std::min(climb * climb, 1.0));
    return {heading, speed * level, speed * climb};
  }

  // What the motion does of its own accord in one step.
  void Coast(std::span<const double> x, std::span<double> next) const {
    std::array<double, kMaxInputs> u;
    planner_.motion_.Coast(x, {u.data(), m_});
    Step(x, u.data(), next);
  }

  // How far the robot moves in one step by itself.
  [[nodiscard]] Eigen::VectorXd Drift(std::span<const double> x) const {
    std::array<double, kMaxStates> next;
    Coast(x, {next.data(), n_});
    return Position({next.data(), n_}) - Position(x);
  }

  // The distance that driving straight at the goal would gain, with acceleration up to the desired speed.
  [[nodiscard]] double IdealGain() const {
    const double dt = planner_.motion_.dt();
    double speed = planner_.motion_.Speed({start_.data(), n_}), gain = 0;
    for (int t = 0; t < planner_.options_.progress_steps; ++t) {
      gain += dt * std::min(speed, SpeedAt(start_distance_ - gain));
      speed += dt * planner_.options_.braking;
    }
    return gain;
  }

  // Metres that the state is short of the ambition, not positive if it is met.
  [[nodiscard]] double Shortfall(const double* s, const Ambition& ambition) const {
    const double near_enough = kShareOfRadius * planner_.options_.goal_radius;
    return BestOf(s) - std::max(start_distance_ - ambition.share * gain_, near_enough);
  }

  // Whether a state at the end of the progress part is what the ambition asks for.
  [[nodiscard]] bool Meets(const double* s, const Node& node, const Ambition& ambition) const {
    const bool arrives = BestOf(s) <= kShareOfRadius * planner_.options_.goal_radius;
    Eigen::MatrixXd tail;
    return Shortfall(s, ambition) <= 0 && (arrives || HeadsWell(StateOf(s), ambition.heading)) &&
           FindTail(StateOf(s), node, ambition, tail);
  }

  // Evaluated a short time ahead, so that the steering angle counts. A robot at rest has no heading and passes.
  [[nodiscard]] bool HeadsWell(std::span<const double> x, double cosine) const {
    std::array<double, kMaxStates> ahead;
    std::copy(x.begin(), x.end(), ahead.begin());
    for (int t = 0; t < kLookAhead; ++t) Coast({ahead.data(), n_}, {ahead.data(), n_});
    const Eigen::VectorXd drift = Drift({ahead.data(), n_});
    return drift.dot(field_.Descent(Position({ahead.data(), n_}))) >= cosine * drift.norm();
  }

  [[nodiscard]] bool FindTail(std::span<const double> x, const Node& node, const Ambition& ambition,
                              Eigen::MatrixXd& tail) const {
    const RobotMotion& motion = planner_.motion_;
    for (int shape = 0; shape < motion.num_tails(); ++shape)
      if (motion.Brake(x, shape, planner_.options_.tail_steps, tail) && TailIsAllowed(x, node, ambition, tail))
        return true;
    return false;
  }

  [[nodiscard]] bool TailIsAllowed(std::span<const double> x, Node node, const Ambition& ambition,
                                   const Eigen::MatrixXd& tail) const {
    std::array<double, kMaxVariables> z;
    std::copy(x.begin(), x.end(), z.begin());
    Eigen::VectorXd position = Position(x), direction = Eigen::VectorXd::Zero(position.size());
    for (int t = 0; t < tail.cols(); ++t) {
      std::copy_n(tail.col(t).data(), m_, z.begin() + static_cast<std::ptrdiff_t>(n_));
      const std::span<const double> all(z.data(), n_ + m_);
      if (!planner_.problem_->domain.Contains(all) || !KeepsLimitsOfInputs(all)) return false;
      std::array<double, kMaxStates> next;
      Step({z.data(), n_}, z.data() + n_, {next.data(), n_});
      const int sample = planner_.options_.progress_steps + t;
      if (!Allowed({next.data(), n_}, sample + 1) || !WayIsClear({z.data(), n_}, {next.data(), n_}, sample) ||
          !Extend(node, tail.col(t).data(), node))
        return false;
      std::copy_n(next.begin(), n_, z.begin());
      const Eigen::VectorXd moved = Position({z.data(), n_}) - position;
      position += moved;
      if (moved.norm() > kReverse) direction = moved.normalized();
    }
    return !ambition.room || HasRoom({z.data(), n_}, position, direction) || HintsLeadOn({z.data(), n_});
  }

  // Whether a robot at rest in x, at `position`, can drive on. A robot that cannot reverse could otherwise not leave
  // the place.
  [[nodiscard]] bool HasRoom(std::span<const double> x, const Eigen::VectorXd& position,
                             const Eigen::VectorXd& direction) const {
    const Eigen::Map<const Eigen::VectorXd> state(x.data(), std::ssize(x));
    const double room = kRoomAhead * planner_.options_.cruise_speed;
    for (int i = 1; i <= kRoomSamples; ++i) {
      const Eigen::VectorXd ahead = state + planner_.shift_ * (room * i / kRoomSamples * direction);
      if (!StandsClear({ahead.data(), n_}, 0)) return false;
    }
    return planner_.region_.Contains(position + room * direction);
  }

  // Whether a robot at rest in x that does what its hints do gets as far, in much room: its turns may be wider.
  [[nodiscard]] bool HintsLeadOn(std::span<const double> x) const {
    if (!planner_.motion_.has_hints()) return false;
    const double more = kRoomOfHints * planner_.options_.clearance_step;
    const Box& region = planner_.region_;
    std::array<double, kMaxStates> state, next;
    std::array<double, kMaxInputs> u;
    std::copy(x.begin(), x.end(), state.begin());
    const Eigen::VectorXd from = Position(x);
    for (int t = 0; t < planner_.options_.tail_steps; ++t) {
      planner_.motion_.Pursue({state.data(), n_}, DesiredIn(state.data(), 0, 0), {u.data(), m_});
      Step({state.data(), n_}, u.data(), {next.data(), n_});
      state = next;
      const Eigen::VectorXd position = Position({state.data(), n_});
      const bool inside = (region.lower().array() + more <= position.array()).all() &&
                          (position.array() <= region.upper().array() - more).all();
      if (!inside || !StandsClear({state.data(), n_}, more)) return false;
      if ((position - from).norm() >= kRoomAhead * planner_.options_.cruise_speed) return true;
    }
    return false;
  }

  // Of what stands. What moves may have gone by then.
  [[nodiscard]] bool StandsClear(std::span<const double> x, double more) const {
    const Sweep sweep(BodyAt(x), 0);
    for (std::size_t o = 0; o < clearances_.size(); ++o)
      if (!planner_.obstacles_[o].motion() && !sweep.Keeps(clearances_[o] + more, planner_.obstacles_[o], schedule_))
        return false;
    return true;
  }

  [[nodiscard]] std::unique_ptr<oc::SimpleSetup> SetUp(const Ambition& ambition) {
    auto states = std::make_shared<SearchSpace>(static_cast<unsigned>(n_ + 2));
    ob::RealVectorBounds bounds(static_cast<unsigned>(n_ + 2));
    std::copy(lower_.begin(), lower_.end(), bounds.low.begin());  // steps and distance begin at 0
    std::copy(upper_.begin(), upper_.end(), bounds.high.begin());
    bounds.high[n_] = planner_.options_.progress_steps;
    bounds.high[n_ + 1] = start_distance_;
    states->setBounds(bounds);
    const double cell = std::max(gain_ / planner_.options_.progress_steps,
                                 kLeastCell * planner_.options_.cruise_speed * planner_.motion_.dt());
    states->registerDefaultProjection(
        std::make_shared<PositionProjection>(states, planner_.problem_->projection, cell));

    auto controls = std::make_shared<oc::RealVectorControlSpace>(states, static_cast<unsigned>(m_));
    const Box& input = planner_.motion_.controls();
    ob::RealVectorBounds control_bounds(static_cast<unsigned>(m_));
    control_bounds.low.assign(input.lower().begin(), input.lower().end());
    control_bounds.high.assign(input.upper().begin(), input.upper().end());
    controls->setBounds(control_bounds);
    controls->setControlSamplerAllocator([this](const oc::ControlSpace* space) {
      HintedSampler::Hint hint;
      if (planner_.motion_.has_hints())
        hint = [this](const double* s, double turn, double slower, double* u) {
          planner_.motion_.Pursue(StateOf(s), DesiredIn(s, turn, slower), {u, m_});
        };
      return std::make_shared<HintedSampler>(space, std::move(hint), [this](const double* s, double share, double* u) {
        planner_.motion_.Explore(StateOf(s), share, {u, m_});
      });
    });

    auto setup = std::make_unique<oc::SimpleSetup>(controls);
    const auto& space = setup->getSpaceInformation();
    space->setPropagationStepSize(planner_.motion_.dt());
    space->setMinMaxControlDuration(1, kLongestHold);
    setup->setStatePropagator([this](const ob::State* from, const oc::Control* u, double, ob::State* to) {
      Node node;
      static_cast<void>(Propagate(Values(from), SearchSpace::NodeOf(from), Values(u), Values(to), node));
      SearchSpace::NodeOf(to) = std::move(node);
    });
    setup->setStateValidityChecker([this](const ob::State* state) {
      const double* s = Values(state);
      return StepsOf(s) <= planner_.options_.progress_steps && Allowed(StateOf(s), static_cast<int>(StepsOf(s)));
    });
    ob::ScopedState<ob::RealVectorStateSpace> start(states);
    std::copy_n(start_.data(), n_, start->values);
    start->values[n_] = 0;
    start->values[n_ + 1] = start_distance_;
    SearchSpace::NodeOf(start.get()) = root_;
    setup->setStartState(start);
    setup->setGoal(std::make_shared<ProgressGoal>(space, *this, ambition));
    setup->setPlanner(planner_.make_algorithm_(space));
    return setup;
  }

  // @pre the progress part ends in `end`.
  [[nodiscard]] std::optional<Proposal> Assemble(const Eigen::MatrixXd& progress, std::span<const double> end,
                                                 const Node& node, const Ambition& ambition) const {
    Eigen::MatrixXd tail;
    if (!FindTail(end, node, ambition, tail)) return std::nullopt;
    Proposal proposal{
        Eigen::MatrixXd(progress.rows(), progress.cols() + tail.cols()), static_cast<int>(progress.cols()), {}};
    proposal.controls << progress, tail;
    proposal.states = Rollout(model_, start_, proposal.controls);
    return proposal;
  }

  const Planner& planner_;
  const NavigationField& field_;
  const NominalModel& model_;
  const std::size_t n_, m_;
  const Eigen::VectorXd start_;
  const Schedule schedule_;
  const double more_;
  Eigen::VectorXd lower_, upper_;
  std::vector<double> clearances_;      // to each obstacle
  std::vector<ObstacleClearance> own_;  // likewise, where it is more
  std::vector<double> limit_margin_;
  std::vector<double> deviation_;  // of each part between two samples; empty: only the samples count
  double start_distance_, gain_, top_speed_, least_speed_;
  bool at_rest_, start_valid_;
  Node root_;                                 // null, as all nodes, unless the tree is certified
  mutable std::optional<Extender> extender_;  // likewise
  mutable std::int64_t work_ = 0;             // model steps
};

std::optional<Proposal> Planner::Propose(const PlanRequest& request) {
  if (request.state.size() != problem_->model->num_states() || !request.state.allFinite()) return std::nullopt;
  const NavigationField& field = Field(request.clearance, request.schedule.start_us);
  ProposalSearch search(*this, request, field);
  if (!search.StartIsValid()) return std::nullopt;
  if (request.may_follow_hints && motion_.has_hints()) {
    const ProposalSearch roomy(*this, request, field, kRoomOfHints * options_.clearance_step);
    if (std::optional<Proposal> proposal = roomy.FollowHints()) return proposal;
  }
  // OMPL calls a second seed an error because generators that exist keep theirs. None does: each search makes its own.
  ompl::RNG::setSeed(std::max<std::uint32_t>(request.seed, 1));
  const auto allowance = static_cast<std::int64_t>(options_.time_limit_ms * kStepsPerMs / kAmbitions.size());
  for (const Ambition& ambition : kAmbitions) {
    if (ambition.at_rest && !search.StartsAtRest()) continue;
    if (!ambition.room && motion_.has_back_off()) continue;  // it would only drive deeper into a dead end
    if (std::optional<Proposal> proposal = search.Run(ambition, allowance)) return proposal;
  }
  return std::nullopt;
}

bool Planner::HasRoom(const PlanRequest& request, const Eigen::VectorXd& direction) {
  return ProposalSearch(*this, request, Field(request.clearance, request.schedule.start_us)).StartHasRoom(direction);
}

}  // namespace

std::unique_ptr<Proposer> MakeOmplProposer(const Config& config) {
  RequireGoalAndSteps(*config.problem, config.planner);
  return std::make_unique<Planner>(config);
}

}  // namespace forereach
