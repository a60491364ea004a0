#include "certifier/gate/repair.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/QR>

#include "certifier/gate/candidate_message.h"
#include "forereach/numerics/size.h"
#include "forereach/safety/clearance.h"
#include "forereach/safety/limit_values.h"
#include "forereach/sets/zonotope.h"

namespace forereach {
namespace {

constexpr std::array kSlowdowns{0.25, 0.5, 0.75, 1.0};  // of the pace at the end of the progress part
constexpr double kEffort = 1e-3;                        // m^2, what half the range of an input counts as a distance
constexpr int kFits = 3;                                // Gauss-Newton steps
constexpr Eigen::Index kShapes = 3;                     // of a push over time, for each input
constexpr int kPushes = 4, kPushesToRest = 8;           // the second where no tail brings the robot to rest
constexpr int kHalvings = 3;
constexpr double kProbe = 1e-3;      // of half the range of an input
constexpr double kMore = 1.1;        // than what is missing, since the tube of another plan is another one
constexpr double kLeastGain = 1e-3;  // in the unit of what is missing

std::span<const double> SpanOf(const Eigen::Ref<const Eigen::VectorXd>& x) { return {x.data(), ToSize(x.size())}; }

// A plan that is tried.
struct Draft {
  Eigen::MatrixXd controls;
  Eigen::Index progress = 0;
  int way = 0;  // to brake
  int changes = 0;
};

enum class Answer { kCertified, kRefused, kFarther, kNone };

class RepairSearch final {
 public:
  RepairSearch(const Abstained& abstained, int progress_steps, const Tails& tails, Tube& tube,
               const std::function<bool()>& goes_on)
      : abstained_(abstained),
        problem_(abstained.certifier.problem()),
        model_(*problem_.model),
        tails_(tails),
        tube_(tube),
        goes_on_(goes_on),
        places_(model_, problem_.projection, problem_.body),
        limits_(model_, problem_.limits),
        start_(abstained.initial_set.CenterVector()) {
    const Plan& plan = abstained.plan;
    const Eigen::Index n = start_.size(), m = plan.num_inputs;
    Eigen::VectorXd error(m);
    for (Eigen::Index k = 0; k < m; ++k) error[k] = problem_.declaration.VariableError(n + k);
    const Box& box = problem_.domain.input;
    lower_ = box.lower() + error, upper_ = box.upper() - error;
    half_range_ = ((upper_ - lower_) / 2).cwiseMax(0);
    own_.controls.resize(m, plan.num_steps);
    for (int t = 0; t < plan.num_steps; ++t)
      own_.controls.col(t) = Eigen::Map<const Eigen::VectorXd>(plan.input(t).data(), m);
    // Without a known way to brake all of a plan is pushed: its end has to stay at rest, too.
    own_.progress = tails.motion == nullptr ? plan.num_steps : progress_steps;
    states_ = Roll(own_.controls);
    own_.way = WayOfTail();
  }

  [[nodiscard]] std::optional<Repair> Run() {
    if (!states_.allFinite() || (lower_.array() > upper_.array()).any()) return std::nullopt;
    const bool can_brake = tails_.motion != nullptr;
    if (can_brake) TrySlower();
    if (can_brake) TryTails(own_);
    Push(own_, abstained_.verdict);
    if (can_brake) TryCombinations();
    return std::move(best_);
  }

 private:
  // ---- Plans.

  [[nodiscard]] Eigen::MatrixXd Roll(const Eigen::MatrixXd& controls) const {
    const Eigen::Index n = start_.size(), m = controls.rows();
    Eigen::MatrixXd states(n, controls.cols() + 1);
    Eigen::VectorXd z(n + m);
    states.col(0) = start_;
    for (Eigen::Index t = 0; t < controls.cols(); ++t) {
      z << states.col(t), controls.col(t);
      model_.Evaluate(SpanOf(z), {states.col(t + 1).data(), ToSize(n)});
    }
    return states;
  }

  [[nodiscard]] Eigen::MatrixXd Clipped(const Eigen::MatrixXd& controls) const {
    return controls.cwiseMax(lower_.replicate(1, controls.cols())).cwiseMin(upper_.replicate(1, controls.cols()));
  }

  // The tail of a robot that has done this.
  [[nodiscard]] std::optional<Eigen::MatrixXd> Tail(const Eigen::MatrixXd& progress, int way) const {
    const Eigen::VectorXd end = Roll(progress).rightCols<1>();
    Eigen::MatrixXd tail;
    const int most = std::min(tails_.max_steps, kMaxSteps - static_cast<int>(progress.cols()));
    if (!end.allFinite() || most < 0 || !tails_.motion->Brake(SpanOf(end), way, most, tail)) return std::nullopt;
    return tail;
  }

  [[nodiscard]] std::optional<Draft> WithTail(const Eigen::MatrixXd& progress, int way, int changes) const {
    Draft draft{Clipped(progress), progress.cols(), way, changes};
    if (tails_.motion == nullptr) return draft;
    const std::optional<Eigen::MatrixXd> tail = Tail(draft.controls, way);
    if (!tail || draft.progress + tail->cols() < 1) return std::nullopt;
    draft.controls.conservativeResize(Eigen::NoChange, draft.progress + tail->cols());
    draft.controls.rightCols(tail->cols()) = Clipped(*tail);
    return draft;
  }

  // The way that the plan itself brakes, or the first.
  [[nodiscard]] int WayOfTail() const {
    const Eigen::Index length = own_.controls.cols() - own_.progress;
    for (int way = 0; tails_.motion != nullptr && way < tails_.motion->num_tails(); ++way) {
      const std::optional<Eigen::MatrixXd> tail = Tail(own_.controls.leftCols(own_.progress), way);
      if (tail && tail->cols() == length && tail->isApprox(own_.controls.rightCols(length), 1e-6)) return way;
    }
    return 0;
  }

  // ---- Trials.

  [[nodiscard]] Eigen::VectorXd PlaceAt(const Eigen::MatrixXd& states, Eigen::Index t) const {
    return problem_.projection * states.col(std::min(t, states.cols() - 1));
  }

  [[nodiscard]] std::array<double, 2> Nearness(const Eigen::MatrixXd& states) const {
    std::array<double, 2> nearness{};
    for (Eigen::Index t = 0; t < std::max(states.cols(), states_.cols()); ++t) {
      const double distance = (PlaceAt(states, t) - PlaceAt(states_, t)).norm();
      if (t <= own_.progress) nearness[0] = std::max(nearness[0], distance);
      nearness[1] = std::max(nearness[1], distance);
    }
    return nearness;
  }

  [[nodiscard]] bool GoesOn() { return goes_on_so_far_ = goes_on_so_far_ && trials_ < kMostRepairTrials && goes_on_(); }

  // kFarther: a nearer one is known. kNone: the search has ended, or it is no plan.
  Answer Try(const Draft& draft) {
    if (!GoesOn()) return Answer::kNone;
    const Eigen::MatrixXd states = Roll(draft.controls);
    if (!states.allFinite()) return Answer::kNone;
    const std::array<double, 2> nearness = Nearness(states);
    if (best_ && !(nearness < best_->nearness)) return Answer::kFarther;
    ++trials_;
    const Plan plan{draft.controls.data(), static_cast<int>(draft.controls.rows()),
                    static_cast<int>(draft.controls.cols()), static_cast<int>(draft.controls.rows()),
                    abstained_.plan.schedule};
    if (abstained_.certifier.FindMisfit(plan)) return Answer::kNone;
    verdict_ = abstained_.certifier.Certify(plan, abstained_.initial_set, abstained_.obstacles, tube_);
    if (verdict_.outcome != Outcome::kCertified) return Answer::kRefused;
    best_ = Repair{draft.controls, static_cast<int>(draft.progress), draft.changes, nearness};
    return Answer::kCertified;
  }
  Answer Try(const std::optional<Draft>& draft) { return draft ? Try(*draft) : Answer::kRefused; }

  // ---- An earlier tail.

  // The earlier, the farther: as few fewer steps as are enough.
  void TryTails(const Draft& from) {
    Eigen::Index refused = -1, enough = -1;
    for (Eigen::Index fewer = 0; enough < 0; fewer = std::min(std::max<Eigen::Index>(2 * fewer, 1), from.progress)) {
      const Answer answer = TryTailsAt(from, fewer);
      if (answer == Answer::kNone || answer == Answer::kFarther) return;
      (answer == Answer::kCertified ? enough : refused) = fewer;
      if (fewer == from.progress) break;
    }
    while (enough > refused + 1) {
      const Eigen::Index middle = (enough + refused) / 2;
      const Answer answer = TryTailsAt(from, middle);
      if (answer == Answer::kNone) return;
      (answer == Answer::kCertified ? enough : refused) = middle;
    }
  }

  // Each way to brake. The robot does the same until then, so all are as near over the progress part if nothing is cut.
  Answer TryTailsAt(const Draft& from, Eigen::Index fewer) {
    Answer all = Answer::kFarther;
    for (int way = 0; way < tails_.motion->num_tails(); ++way) {
      if (fewer == 0 && way == from.way) continue;  // this one was refused
      const Answer answer = Try(WithTail(from.controls.leftCols(from.progress - fewer), way, from.changes | kTail));
      if (answer == Answer::kCertified || !goes_on_so_far_) return goes_on_so_far_ ? answer : Answer::kNone;
      if (answer != Answer::kFarther) all = Answer::kRefused;
    }
    return fewer == 0 ? Answer::kRefused : all;
  }

  void TryCombinations() {
    for (const double slowdown : {kSlowdowns[1], kSlowdowns.back()}) {
      const std::optional<Draft> slower = Slower(slowdown);
      if (!slower) continue;
      if (Try(*slower) == Answer::kRefused) Push(*slower, verdict_);
      TryTails(*slower);
    }
    for (const Eigen::Index kept : {own_.progress / 2, own_.progress / 4}) {
      const std::optional<Draft> shorter = WithTail(own_.controls.leftCols(kept), own_.way, kTail);
      if (Try(shorter) == Answer::kRefused && shorter) Push(*shorter, verdict_);
    }
  }

  // ---- Slower along its path.

  void TrySlower() {
    double refused = 0, enough = 0;
    for (const double slowdown : kSlowdowns) {
      const Answer answer = Try(Slower(slowdown));
      if (answer == Answer::kFarther) return;
      if (answer == Answer::kCertified) {
        enough = slowdown;
        break;
      }
      refused = slowdown;
    }
    for (int i = 0; enough > 0 && i < kHalvings; ++i) {
      const double middle = (refused + enough) / 2;
      (Try(Slower(middle)) == Answer::kCertified ? enough : refused) = middle;
    }
  }

  [[nodiscard]] std::optional<Draft> Slower(double slowdown) {
    const Eigen::Index steps = own_.progress;
    if (steps == 0 || !GoesOn()) return std::nullopt;
    Eigen::MatrixXd path(problem_.projection.rows(), steps + 1), controls(own_.controls.rows(), steps);
    for (Eigen::Index t = 0; t <= steps; ++t) {
      const double at = static_cast<double>(t), passed = at - slowdown * at * at / static_cast<double>(2 * steps);
      const auto before = static_cast<Eigen::Index>(passed);
      const double part = passed - static_cast<double>(before);
      path.col(t) = (1 - part) * PlaceAt(states_, before) + part * PlaceAt(states_, before + 1);
      if (t < steps) controls.col(t) = own_.controls.col(before);
    }
    if (!Follow(path, controls)) return std::nullopt;
    return WithTail(controls, own_.way, kSlower);
  }

  // Fits the controls: sum_t |P x_t - path_t|^2 + kEffort |u_t - given_t|^2, inputs in halves of their ranges. The
  // least of the model that is linear about the last rollout, by dynamic programming.
  [[nodiscard]] bool Follow(const Eigen::MatrixXd& path, Eigen::MatrixXd& controls) const {
    const Eigen::MatrixXd given = controls, weight = problem_.projection.transpose() * problem_.projection;
    const Eigen::VectorXd effort = kEffort * half_range_.cwiseMax(1e-9).array().square().inverse().matrix();
    const Eigen::Index n = start_.size(), steps = controls.cols();
    std::vector<Eigen::MatrixXd> gains(ToSize(steps));
    Eigen::MatrixXd offsets(controls.rows(), steps), by_state(n, n), by_input(n, controls.rows());
    for (int fit = 0; fit < kFits; ++fit) {
      const Eigen::MatrixXd states = Roll(controls);
      const auto pull = [&](Eigen::Index t) -> Eigen::VectorXd {
        return problem_.projection.transpose() * (problem_.projection * states.col(t) - path.col(t));
      };
      if (!states.allFinite()) return false;
      Eigen::MatrixXd curvature = weight;
      Eigen::VectorXd slope = pull(steps);
      for (Eigen::Index t = steps - 1; t >= 0; --t) {
        Linearize(states.col(t), controls.col(t), by_state, by_input);
        Eigen::MatrixXd of_input = by_input.transpose() * curvature * by_input;
        of_input.diagonal() += effort;
        const Eigen::MatrixXd mixed = by_input.transpose() * curvature * by_state;
        const Eigen::LDLT<Eigen::MatrixXd> solver(of_input);
        gains[ToSize(t)] = -solver.solve(mixed);
        offsets.col(t) =
            -solver.solve(effort.cwiseProduct(controls.col(t) - given.col(t)) + by_input.transpose() * slope);
        slope = (by_state.transpose() * slope + mixed.transpose() * offsets.col(t) + pull(t)).eval();
        curvature =
            (by_state.transpose() * curvature * by_state + mixed.transpose() * gains[ToSize(t)] + weight).eval();
      }
      Step(states, gains, offsets, controls);
      if (!controls.allFinite()) return false;
    }
    return true;
  }

  // From the start on with these corrections, inside the box.
  void Step(const Eigen::MatrixXd& states, const std::vector<Eigen::MatrixXd>& gains, const Eigen::MatrixXd& offsets,
            Eigen::MatrixXd& controls) const {
    Eigen::VectorXd x = start_, z(start_.size() + controls.rows());
    for (Eigen::Index t = 0; t < controls.cols(); ++t) {
      controls.col(t) = Clipped(controls.col(t) + offsets.col(t) + gains[ToSize(t)] * (x - states.col(t)));
      z << x, controls.col(t);
      model_.Evaluate(SpanOf(z), {x.data(), ToSize(x.size())});
    }
  }

  void Linearize(const Eigen::VectorXd& x, const Eigen::VectorXd& u, Eigen::MatrixXd& by_state,
                 Eigen::MatrixXd& by_input) const {
    Eigen::VectorXd z(x.size() + u.size());
    z << x, u;
    Linearization linear;
    model_.Linearize(SpanOf(z), linear);
    by_state.setZero(), by_input.setZero();
    for (const MatrixEntry& entry : linear.jacobian())
      (entry.column < x.size() ? by_state(entry.row, entry.column) : by_input(entry.row, entry.column - x.size())) =
          entry.value.Middle();
  }

  // ---- Away from what refuses it.

  // What a plan has too little of, as a function of its rollout.
  struct Lack {
    std::function<double(const Eigen::MatrixXd& states, const Eigen::MatrixXd& controls)> value;
    double missing = 0;                                        // to the value that it had when it was found
    double enough = std::numeric_limits<double>::quiet_NaN();  // the value to reach, from the first push on
  };

  // A push keeps the rest that those before it have reached.
  void Push(Draft draft, Decision verdict) {
    std::vector<Lack> lacks;
    const int most = tails_.motion != nullptr ? kPushes : kPushesToRest;
    for (int i = 0; draft.progress > 0 && i < most; ++i) {
      if (auto lack = LackOf(draft, verdict); lack && std::isfinite(lack->missing))
        lacks.push_back(*std::move(lack));
      else
        return;
      std::optional<Draft> pushed = Pushed(draft, lacks);
      if (!pushed) return;
      const Answer answer = Try(*pushed);
      if (answer == Answer::kCertified) return GoBack(draft, *pushed);
      if (answer != Answer::kRefused) return;
      // Rest at the end has to be kept by every later push. What an obstacle or a limit lacks is found anew.
      if (verdict.cause != Cause::kNoStop) lacks.pop_back();
      draft = std::move(*pushed);
      verdict = verdict_;
    }
  }

  // Part of the way back to where it was refused.
  void GoBack(const Draft& refused, const Draft& certified) {
    const Eigen::MatrixXd from = refused.controls.leftCols(refused.progress),
                          by = certified.controls.leftCols(refused.progress) - from;
    double too_little = 0, enough = 1;
    for (int i = 0; i < kHalvings; ++i) {
      const double middle = (too_little + enough) / 2;
      const Answer answer = Try(WithTail(from + middle * by, certified.way, certified.changes));
      (answer == Answer::kCertified ? enough : too_little) = middle;
    }
  }

  // How an input may move over the steps: hats at some of them, which add up to one.
  [[nodiscard]] static std::vector<Eigen::RowVectorXd> ShapesOf(Eigen::Index steps) {
    const Eigen::Index count = std::min(steps, kShapes);
    std::vector<Eigen::RowVectorXd> shapes(ToSize(count), Eigen::RowVectorXd::Ones(steps));
    for (Eigen::Index j = 0; count > 1 && j < count; ++j)
      for (Eigen::Index t = 0; t < steps; ++t)
        shapes[ToSize(j)][t] =
            std::max(0.0, 1 - std::abs(static_cast<double>(t * (count - 1)) / static_cast<double>(steps - 1) -
                                       static_cast<double>(j)));
    return shapes;
  }

  // The least change that is enough for all, if each grows as at the start.
  [[nodiscard]] std::optional<Draft> Pushed(const Draft& draft, std::vector<Lack>& lacks) {
    Eigen::MatrixXd progress = Clipped(draft.controls.leftCols(draft.progress));
    const Eigen::Index count = std::ssize(lacks);
    const auto values = [&](const std::optional<Draft>& of) {
      Eigen::VectorXd all = Eigen::VectorXd::Constant(count, std::numeric_limits<double>::quiet_NaN());
      if (!of) return all;
      const Eigen::MatrixXd states = Roll(of->controls);
      for (Eigen::Index i = 0; i < count; ++i) all[i] = lacks[ToSize(i)].value(states, of->controls);
      return all;
    };
    const Eigen::VectorXd before = values(WithTail(progress, draft.way, 0));
    if (!before.allFinite()) return std::nullopt;
    lacks.back().enough = before[count - 1] + lacks.back().missing;
    Eigen::VectorXd missing = Eigen::VectorXd::Zero(count);
    missing[count - 1] = lacks.back().missing;
    const std::vector<Eigen::RowVectorXd> shapes = ShapesOf(progress.cols());
    const Eigen::Index num_shapes = std::ssize(shapes);
    Eigen::MatrixXd gradient(count, progress.rows() * num_shapes), moved = progress;
    for (Eigen::Index k = 0; k < progress.rows(); ++k)
      for (Eigen::Index j = 0; j < num_shapes; ++j) {
        if (!GoesOn()) return std::nullopt;
        const double middle = lower_[k] / 2 + upper_[k] / 2, own = progress.row(k).dot(shapes[ToSize(j)]);
        // Away from the nearer bound: a push that is clipped would hide the slope.
        const double part = own <= middle * shapes[ToSize(j)].sum() ? kProbe : -kProbe;
        moved.row(k) += part * half_range_[k] * shapes[ToSize(j)];
        gradient.col(k * num_shapes + j) = (values(WithTail(moved, draft.way, 0)) - before) / part;
        moved.row(k) = progress.row(k);
      }
    // A push that leaves no plan behind has no slope: it is not tried.
    gradient = gradient.unaryExpr([](double slope) { return std::isfinite(slope) ? slope : 0.0; });
    const Eigen::VectorXd change = LeastChange(gradient, missing, before, lacks);
    if (!change.allFinite() || change.isZero(0)) return std::nullopt;
    for (Eigen::Index k = 0; k < progress.rows(); ++k)
      for (Eigen::Index j = 0; j < num_shapes; ++j)
        progress.row(k) += half_range_[k] * change[k * num_shapes + j] * shapes[ToSize(j)];
    return WithTail(progress, draft.way, draft.changes | kPushed);
  }

  // Of the last lack, and of those that this would take what they have reached.
  [[nodiscard]] static Eigen::VectorXd LeastChange(const Eigen::MatrixXd& gradient, const Eigen::VectorXd& missing,
                                                   const Eigen::VectorXd& before, const std::vector<Lack>& lacks) {
    std::vector<Eigen::Index> heeded{missing.size() - 1};
    for (;;) {
      const Eigen::MatrixXd rows = gradient(heeded, Eigen::all);
      const Eigen::VectorXd change = rows.completeOrthogonalDecomposition().solve(missing(heeded));
      Eigen::Index worst = -1;
      double most = kLeastGain / 2;
      for (Eigen::Index i = 0; i < missing.size(); ++i) {
        const double taken = std::min(before[i], lacks[ToSize(i)].enough) - before[i] - gradient.row(i).dot(change);
        if (taken > most && std::ranges::find(heeded, i) == heeded.end()) worst = i, most = taken;
      }
      if (worst < 0) return change;
      heeded.push_back(worst);
    }
  }

  [[nodiscard]] std::optional<Lack> LackOf(const Draft& draft, const Decision& verdict) const {
    std::optional<Lack> lack;
    switch (verdict.cause) {
      case Cause::kObstacle: lack = LackOfClearance(draft, verdict); break;
      case Cause::kLimit: lack = LackOfRoom(verdict); break;
      case Cause::kDomainExit: lack = LackInDomain(verdict); break;
      case Cause::kNoStop: lack = LackOfRest(verdict); break;
      case Cause::kNone:
      case Cause::kPairwise:
      case Cause::kNoFiniteEnclosure:
      case Cause::kBetween:
      case Cause::kBound: return std::nullopt;
    }
    lack->missing = kMore * std::max(lack->missing, 0.0) + kLeastGain;
    return lack;
  }

  // The clearance of the nominal body where it is least, and as much as the tube lacks at the step that refused it.
  [[nodiscard]] Lack LackOfClearance(const Draft& draft, const Decision& verdict) const {
    const Obstacle& obstacle = abstained_.obstacles[ToSize(verdict.obstacle)];
    const Eigen::MatrixXd states = Roll(draft.controls);
    const double width = Clearance(states, obstacle, verdict.step) - (verdict.margin - verdict.threshold);
    int closest = 0;
    double least = kInfinity;
    for (int t = 0; t + (problem_.between ? 1 : 0) < states.cols(); ++t)
      if (const double clearance = Clearance(states, obstacle, t); clearance < least) closest = t, least = clearance;
    return {[this, &obstacle, closest](const auto& of, const auto&) { return Clearance(of, obstacle, closest); },
            std::max(width, 0.0) - least};
  }

  [[nodiscard]] double Clearance(const Eigen::MatrixXd& states, const Obstacle& obstacle, int t) const {
    const int last = static_cast<int>(states.cols()) - 1, length = problem_.between ? 1 : 0;
    const int first = std::min(t, last - length), second = first + length;
    if (first < 0) return kInfinity;
    const std::vector<BodyPart> from = places_.At(SpanOf(states.col(first))),
                                to = places_.At(SpanOf(states.col(second)));
    double least = kInfinity;
    for (std::size_t i = 0; i < from.size(); ++i)
      least = std::min(least, ApproximateDistance(obstacle, from[i], to[i], abstained_.plan.schedule, first, second) -
                                  (problem_.between ? Deviation(*problem_.between, problem_.body.parts[i]) : 0));
    return least;
  }

  [[nodiscard]] Lack LackOfRoom(const Decision& verdict) const {
    const int limit = verdict.coordinate, step = verdict.step;
    return {[this, limit, step](const Eigen::MatrixXd& states, const Eigen::MatrixXd& controls) {
              std::vector<double> room(limits_.size());
              const Eigen::Index t = std::min<Eigen::Index>(step, controls.cols() - 1);
              limits_.Room(SpanOf(states.col(t)), SpanOf(controls.col(t)), room);
              return room[ToSize(limit)];
            },
            std::abs(verdict.margin - verdict.threshold)};
  }

  // Inputs outside their box are clipped, whatever the gradient is.
  [[nodiscard]] Lack LackInDomain(const Decision& verdict) const {
    const DomainExit exit = verdict.exit;
    const auto room = [this, exit, step = verdict.step](const Eigen::MatrixXd& states,
                                                        const Eigen::MatrixXd& controls) {
      const Eigen::Index t = std::min<Eigen::Index>(step, controls.cols() - 1);
      Eigen::VectorXd z(states.rows() + controls.rows());
      z << states.col(t), controls.col(t);
      switch (exit.kind) {
        case DomainExit::Kind::kLower: return z[exit.index];
        case DomainExit::Kind::kUpper: return -z[exit.index];
        case DomainExit::Kind::kInequality:
          return -problem_.domain.inequalities[ToSize(exit.index)].coefficients.dot(z);
        case DomainExit::Kind::kBall: {
          const Domain::Ball& ball = problem_.domain.balls[ToSize(exit.index)];
          double square = 0;
          for (std::size_t i = 0; i < ball.coordinates.size(); ++i)
            square += std::pow(z[ball.coordinates[i]] - ball.center[static_cast<Eigen::Index>(i)], 2);
          return -std::sqrt(square);
        }
        case DomainExit::Kind::kNone: break;
      }
      return 0.0;
    };
    return {room, std::abs(exit.value - exit.bound)};
  }

  [[nodiscard]] static Lack LackOfRest(const Decision& verdict) {
    return {[k = verdict.coordinate](const Eigen::MatrixXd& states, const Eigen::MatrixXd&) {
              return -std::abs(states(k, states.cols() - 1));
            },
            std::abs(verdict.margin) - std::abs(verdict.threshold)};
  }

  const Abstained& abstained_;
  const Problem& problem_;
  const NominalModel& model_;
  const Tails& tails_;
  Tube& tube_;
  const std::function<bool()>& goes_on_;
  const BodyPlaces places_;
  const LimitValues limits_;
  const Eigen::VectorXd start_;
  Eigen::VectorXd lower_, upper_, half_range_;  // of the inputs, without their errors
  Draft own_;                                   // the refused plan
  Eigen::MatrixXd states_;                      // its rollout
  Decision verdict_;                            // on the last plan that was certified or refused
  std::optional<Repair> best_;
  int trials_ = 0;
  bool goes_on_so_far_ = true;
};

}  // namespace

std::optional<Repair> FindRepair(const Abstained& abstained, int progress_steps, const Tails& tails, Tube& tube,
                                 const std::function<bool()>& goes_on) {
  if (abstained.verdict.outcome != Outcome::kDomain && abstained.verdict.outcome != Outcome::kSafety)
    return std::nullopt;
  // Without safety coordinates there is no distance by which one plan is nearer than another.
  if (abstained.certifier.projection().dim() == 0) return std::nullopt;
  return RepairSearch(abstained, progress_steps, tails, tube, goes_on).Run();
}

bool AsksForRepair(const candidate_plan_t& candidate, const decision_t& decision) {
  return candidate.repair == 1 &&
         (decision.outcome == decision_t::ABSTAIN_DOMAIN || decision.outcome == decision_t::ABSTAIN_SAFETY);
}

void SetProposal(const Repair& repair, const candidate_plan_t& candidate, advice_t& advice) {
  advice.changed = static_cast<std::int16_t>(repair.changes);
  std::ranges::copy(repair.nearness, advice.nearness);
  candidate_plan_t& proposal = advice.proposal;
  std::ranges::copy(candidate.source, proposal.source);
  proposal.start_utime = candidate.start_utime;
  proposal.step_us = candidate.step_us;
  SetPlan(proposal, Eigen::Map<const Eigen::VectorXd>(candidate.initial_center, candidate.num_states),
          Eigen::Map<const Eigen::VectorXd>(candidate.initial_half_width, candidate.num_states), repair.controls);
  proposal.progress_steps = static_cast<std::int16_t>(repair.progress_steps);
}

}  // namespace forereach
