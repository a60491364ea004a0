/** What a certificate claims at all times, tried: continuous motions under certified plans, in 256 bits.

A trial makes one random problem (problems.h, any_surroundings.h) and plans of it, and places obstacles that the
certifier just accepts. In some, steps are disturbed, and off their times; in some, the transitions are
recorded with errors, by which the inputs that act are off the plan's, too; often by all that is declared. Under each
certificate it follows admissible residuals from sample to sample: none leaves its slice. Between two samples it follows
motions whose second derivatives are piecewise constant, within the declared bounds and often equal to them, and that
keep the samples. Moving obstacles have any clock error, and are anywhere in their declared sets. A contact is a broken
promise. Then an obstacle appears that the certifier just accepts up to some step of the plan: what it says still stands
is followed in the same way.

Nor is anything held against such a robot: it measures its states with errors, often of all that is declared, and none
of these measurements has left a slice; it records its steps so, with their durations and up to the noise bound beside,
and no certifier that learns them finds a contradiction. */
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "forereach/certify/rates.h"
#include "forereach/certify/standing.h"
#include "forereach/certify/tube.h"
#include "forereach/numerics/size.h"
#include "lcmtypes/angle.h"
#include "tests/oracle/admissible.h"
#include "tests/oracle/any_surroundings.h"
#include "tests/oracle/meeting.h"

namespace forereach {

/** A part of the declaration that the certifier of a trial is not told, which shows that the trial would find its
absence. */
enum class Untold {
  kNothing,
  kAcceleration,
  kTurnRate,
  kBody,
  kVelocity,
  kGrowth,
  kClockError,
  kLateness,
  kOffsets,
  kStateErrors,
  kInputErrors,
  kDurations
};

struct Tally {
  long problems = 0, plans = 0, certified = 0, withdrawn = 0, motions = 0, moments = 0, decided_exactly = 0,
       inadmissible = 0, learned = 0, shifted = 0, recorded = 0,
       all_at_once = 0;  // of the certified: with steps off their times, with errors of records, with disturbances, too

  void Add(const Tally& other) {
    problems += other.problems;
    plans += other.plans;
    certified += other.certified;
    withdrawn += other.withdrawn;
    motions += other.motions;
    moments += other.moments;
    decided_exactly += other.decided_exactly;
    inadmissible += other.inadmissible;
    learned += other.learned;
    shifted += other.shifted;
    recorded += other.recorded;
    all_at_once += other.all_at_once;
  }
  [[nodiscard]] std::string Text() const {
    std::ostringstream text;
    text << problems << " problems, " << plans << " plans, " << certified << " certified (" << shifted
         << " with steps off their times, " << recorded << " from records with errors, " << all_at_once
         << " with both and disturbed), " << withdrawn << " withdrawn in part; " << motions << " motions, " << moments
         << " moments, " << decided_exactly << " of them decided in 256 bits; " << learned << " steps learned";
    return text.str();
  }
};

/** A contact under a certificate, or a true motion that is held against its declaration. */
class Contradiction : public std::logic_error {
  using std::logic_error::logic_error;
};

/** b(s) for s in [0, 1] with |b''| <= 1 and b(0) = b(1) = 0: the pieces are b'' on equal parts. */
class Bulge {
 public:
  explicit Bulge(std::vector<double> pieces) : pieces_(std::move(pieces)) {}

  template <class Scalar>
  [[nodiscard]] Scalar At(double s) const {
    return Twice<Scalar>(s).first - Scalar(s) * Twice<Scalar>(1).first;
  }
  /** The largest |b'|. */
  [[nodiscard]] Real Steepest() const {
    const Real mean = Twice<Real>(1).first;
    Real steepest = 0;
    for (std::size_t i = 0; i <= pieces_.size(); ++i) {
      const double s = static_cast<double>(i) / static_cast<double>(pieces_.size());
      const Real slope = abs(Twice<Real>(s).second - mean);
      if (steepest < slope) steepest = slope;
    }
    return steepest;
  }

 private:
  // The integral of the integral of b'', and the integral.
  template <class Scalar>
  [[nodiscard]] std::pair<Scalar, Scalar> Twice(double s) const {
    const double width = 1 / static_cast<double>(pieces_.size());  // a power of two
    Scalar value(0.0), slope(0.0);
    for (std::size_t i = 0; i < pieces_.size(); ++i) {
      const double in_it = std::clamp(s - static_cast<double>(i) * width, 0.0, width);
      const Scalar h(in_it), c(pieces_[i]);
      value = value + slope * h + c * h * h / Scalar(2.0);
      slope = slope + c * h;
    }
    return {value, slope};
  }

  std::vector<double> pieces_;
};

/** One motion from a sample to the next: of each safety coordinate in units of a_k T^2, and of the heading in units of
turn T^2, with |turn| <= alpha. */
struct Path {
  std::vector<Bulge> of_position;
  Bulge of_heading;
  double turn;
};

/** The pose at two samples. */
struct Chord {
  std::vector<Real> from, to;  // p entries
  Real heading_from, heading_to;
  double duration;                      // s, not below the true one
  double offset_from_us, offset_to_us;  // of the boundaries from their times
};

template <class Scalar>
Scalar Of(const Real& x) {
  if constexpr (std::is_same_v<Scalar, double>)
    return x.ToDouble();
  else
    return x;
}

/** The judge of one problem. */
class MotionJudge {
 public:
  MotionJudge(const Problem& problem, const Schedule& schedule) : problem_(problem), schedule_(schedule) {}

  /** @param before, after how far the boundaries are off their times, s. */
  [[nodiscard]] Chord ChordOf(const std::vector<Real>& from, const std::vector<Real>& to, const Real& before,
                              const Real& after) const {
    const auto heading = [&](const std::vector<Real>& x) {
      return problem_.body.heading < 0 ? Real() : x[ToSize(problem_.body.heading)];
    };
    const double period = problem_.between ? problem_.between->period : 0;
    const double shorter = (after - before - Real(problem_.timing.error)).ToDouble();
    return {Position(from),          Position(to),          heading(from), heading(to), period + std::min(shorter, 0.0),
            before.ToDouble() * 1e6, after.ToDouble() * 1e6};
  }

  /** A motion that the bounds admit; nothing if the heading turns too fast from one sample to the other already. */
  [[nodiscard]] std::optional<Path> AnyPath(Random& random, const Chord& chord) const {
    const Between& between = *problem_.between;
    const bool extreme = random.Coin(0.7);
    const auto any = [&] {
      std::vector<double> pieces(std::size_t{1} << random.Integer(0, 3));
      const double sign = random.Sign();
      const bool constant = random.Coin();
      for (double& piece : pieces) piece = constant ? sign : extreme ? random.Sign() : random.Uniform(-1, 1);
      return Bulge(pieces);
    };
    Path path{{}, any(), 0};
    for (std::size_t k = 0; k < chord.from.size(); ++k) path.of_position.push_back(any());
    const Real period(chord.duration), change = abs(chord.heading_to - chord.heading_from);
    const Real left = Real(between.turn_rate) - change / period;
    if (problem_.body.heading >= 0 && left < Real(0.0)) return std::nullopt;
    const double most = (left / (period * path.of_heading.Steepest())).ToDouble() * (1 - 1e-12);
    path.turn = std::max(0.0, std::min(between.turn_acceleration, most));
    return path;
  }

  /** The parts of the body at s in [0, 1]. Without a path the samples are the only moments. */
  template <class Scalar>
  [[nodiscard]] std::vector<std::vector<Point3<Scalar>>> Place(const Chord& chord, const Path* path, double s) const {
    const Scalar rest(1 - s), share(s);
    const double period = path ? chord.duration : 0;
    const Scalar square = Scalar(period) * Scalar(period);
    Point3<Scalar> y{Scalar(0.0), Scalar(0.0), Scalar(0.0)};
    for (std::size_t k = 0; k < chord.from.size(); ++k) {
      y[k] = rest * Of<Scalar>(chord.from[k]) + share * Of<Scalar>(chord.to[k]);
      if (path)
        y[k] = y[k] + Scalar(problem_.between->acceleration[static_cast<Eigen::Index>(k)]) * square *
                          path->of_position[k].At<Scalar>(s);
    }
    Scalar heading = rest * Of<Scalar>(chord.heading_from) + share * Of<Scalar>(chord.heading_to);
    if (path) heading = heading + Scalar(path->turn) * square * path->of_heading.At<Scalar>(s);
    using std::cos, std::sin;
    const Scalar c = cos(heading), d = sin(heading);
    std::vector<std::vector<Point3<Scalar>>> parts;
    for (const BodyPart& part : problem_.body.parts) {
      parts.emplace_back();
      for (const Eigen::Vector3d& q : part.points) {
        Point3<Scalar> place{Scalar(q[0]), Scalar(q[1]), Scalar(q[2])};
        if (problem_.body.heading >= 0)
          place = {c * Scalar(q[0]) - d * Scalar(q[1]), d * Scalar(q[0]) + c * Scalar(q[1]), Scalar(q[2])};
        parts.back().push_back(Plus(y, Scalar(1.0), place));
      }
    }
    return parts;
  }

  /** Whether a part meets the obstacle at the time of sample t + s, off by `error_us` of the clock. */
  template <class Scalar>
  [[nodiscard]] bool Meet(const std::vector<std::vector<Point3<Scalar>>>& parts, const Obstacle& obstacle, int t,
                          double s, std::int64_t error_us, double slack, double tolerance) const {
    Point3<Scalar> shift{Scalar(0.0), Scalar(0.0), Scalar(0.0)};
    Scalar radius(obstacle.radius());
    if (const auto& motion = obstacle.motion()) {
      const std::int64_t sample = schedule_.start_us + t * schedule_.step_us + error_us;
      const double within = s * static_cast<double>(schedule_.step_us);  // exact: s has few bits
      if (!IsThere(*motion, sample, within)) return false;
      const Scalar tau = (Scalar(static_cast<double>(sample - motion->stamp_us)) + Scalar(within)) / Scalar(1e6);
      const Scalar age = tau < Scalar(0.0) ? Scalar(0.0) - tau : tau;
      for (std::size_t k = 0; k < shift.size(); ++k)
        shift[k] = Scalar(motion->velocity[static_cast<Eigen::Index>(k)]) * tau;
      radius = radius + Scalar(motion->uncertainty) + Scalar(motion->growth) * age +
               Scalar(motion->growth_rate) * age * age / Scalar(2.0);
    }
    for (std::size_t i = 0; i < parts.size(); ++i)
      if (Meets(obstacle, shift, parts[i], radius + Scalar(problem_.body.parts[i].radius) + Scalar(slack), tolerance))
        return true;
    return false;
  }

  [[nodiscard]] const Problem& problem() const { return problem_; }
  [[nodiscard]] const Schedule& schedule() const { return schedule_; }

 private:
  // Whether sample + within, in microseconds, is in the obstacle's window.
  static bool IsThere(const ObstacleMotion& motion, std::int64_t sample, double within) {
    const bool begun =
        motion.from_us == -ObstacleMotion::kAlways || static_cast<double>(motion.from_us - sample) <= within;
    return begun &&
           (motion.until_us == ObstacleMotion::kAlways || within <= static_cast<double>(motion.until_us - sample));
  }

  [[nodiscard]] std::vector<Real> Position(const std::vector<Real>& x) const {
    std::vector<Real> y;
    for (Eigen::Index k = 0; k < problem_.projection.rows(); ++k) {
      y.emplace_back(0.0);
      for (std::size_t l = 0; l < x.size(); ++l)
        y.back() += Real(problem_.projection(k, static_cast<Eigen::Index>(l))) * x[l];
    }
    return y;
  }

  const Problem& problem_;
  const Schedule schedule_;
};

/** One problem with all its plans. */
class MotionTrial {
 public:
  explicit MotionTrial(std::uint64_t seed, Untold untold = Untold::kNothing)
      : random_(seed), winds_(~seed), records_(seed ^ 0x2545f4914f6cdd1d), untold_(untold) {}

  /** @throws Contradiction with the circumstances. */
  [[nodiscard]] Tally Run(int plans) {
    const bool bicycle = random_.Coin();
    const auto problem = AnyWorld(random_, bicycle);
    if (winds_.Coin(0.4)) Disturb(winds_, *problem);
    if (untold_ == Untold::kOffsets || winds_.Coin()) Shift(winds_, *problem);
    const double period = problem->between ? problem->between->period : 0;
    if (problem->between) problem->between->period = AddUp(period, problem->timing.error);
    if (problem->between && (untold_ == Untold::kLateness || winds_.Coin()))
      problem->between->period += winds_.Uniform(0, 0.05);  // what a step may last longer
    const auto told = winds_.Coin() ? Recorded(winds_, *problem) : std::make_shared<Problem>(*problem);
    told_ = told;
    if (untold_ == Untold::kOffsets) told->timing = {};
    step_error_us_ = static_cast<std::int64_t>(std::ceil(told->timing.error * 1e6));
    if (untold_ == Untold::kAcceleration && told->between) told->between->acceleration.setZero();
    if (untold_ == Untold::kTurnRate && told->between) {  // a told rate of 0 would be contradicted by the slices
      problem->between->turn_rate *= 8;
      problem->between->turn_acceleration *= 64;
      told->between->turn_acceleration = 0;
    }
    if (untold_ == Untold::kBody) told->body = Body();
    if (untold_ == Untold::kLateness && told->between) told->between->period = period;
    const Certifier certifier(told);
    tally_.problems = 1;
    for (int i = 0; i < plans; ++i) RunPlan(certifier, *problem, bicycle);
    return tally_;
  }

 private:
  struct Neighbour {
    Obstacle obstacle, told;
  };

  void RunPlan(const Certifier& certifier, const Problem& problem, bool bicycle) {
    Query query = AnyDrive(random_, problem);
    ++tally_.plans;
    Schedule told = query.schedule;
    if (untold_ == Untold::kClockError) told.clock_error_us = 0;
    told.clock_error_us += step_error_us_;
    if (!bicycle || random_.Coin()) query.controls *= random_.Uniform(0, 1);
    Plan plan = query.plan();
    plan.schedule = told;
    if (certifier.Certify(plan, query.initial_set, {}, tube_).outcome != Outcome::kCertified) return;
    std::vector<Obstacle> obstacles, told_obstacles;
    for (int o = random_.Integer(1, 3); o > 0; --o) {
      const auto neighbour = PlaceNeighbour(certifier, problem, query.schedule, told);
      if (!neighbour) continue;
      obstacles.push_back(neighbour->obstacle);
      told_obstacles.push_back(neighbour->told);
    }
    certifier.Require(plan, query.initial_set, told_obstacles);
    if (certifier.Certify(plan, query.initial_set, told_obstacles, tube_).outcome != Outcome::kCertified)
      throw std::logic_error("a tube that is judged alone is certified among the same obstacles");
    ++tally_.certified;
    const bool is_shifted = problem.timing.error > 0, is_recorded = told_->declaration.HasErrorInZ();
    tally_.shifted += is_shifted;
    tally_.recorded += is_recorded;
    tally_.all_at_once += is_shifted && is_recorded && problem.declaration.IsDisturbed();
    const MotionJudge judge(problem, query.schedule);
    for (int r = 0; r < 3; ++r) Rollout(judge, query, obstacles, 0, plan.num_steps);
    Withdraw(certifier, judge, query, plan);
  }

  // An obstacle that appears while the robot is at some step, and leaves a part of the plan.
  void Withdraw(const Certifier& certifier, const MotionJudge& judge, const Query& query, const Plan& plan) {
    const int first = random_.Below(plan.num_steps), kept = random_.Integer(first, plan.num_steps - 1);
    const auto neighbour = PlaceNeighbour(certifier, judge.problem(), query.schedule, plan.schedule, first, kept);
    if (!neighbour) return;
    const Standing standing =
        JudgeAgain(certifier, plan, query.initial_set, std::vector<Obstacle>{neighbour->told}, tube_, first);
    if (standing.steps < kept) throw std::logic_error("what is judged alone stands among the same obstacles");
    if (standing.steps <= first || standing.steps == plan.num_steps) return;
    ++tally_.withdrawn;
    for (int r = 0; r < 3; ++r) Rollout(judge, query, {neighbour->obstacle}, first, standing.steps);
  }

  // An obstacle near the path that the certifier just accepts, from a unit of time on up to control `kept`.
  std::optional<Neighbour> PlaceNeighbour(const Certifier& certifier, const Problem& problem, const Schedule& schedule,
                                          const Schedule& told_schedule, int first = 0, int kept = kMaxSteps) {
    const std::optional<Approach> approach = AnyApproach(random_, problem, tube_, schedule);
    if (!approach) return std::nullopt;
    Approach told = *approach;
    if (told.motion && untold_ == Untold::kVelocity) told.motion->velocity.setZero();
    if (told.motion && untold_ == Untold::kGrowth)
      told.motion->uncertainty = told.motion->growth = told.motion->growth_rate = 0;
    const std::optional<double> away = JustAccepted(certifier, told, told_schedule, tube_, first, kept);
    if (!away) return std::nullopt;
    return Neighbour{approach->At(*away), told.At(*away)};
  }

  // Under the controls 0 .. standing - 1, looked at from sample `first` on.
  void Rollout(const MotionJudge& judge, const Query& query, const std::vector<Obstacle>& obstacles, int first,
               int standing) {
    const Problem& problem = judge.problem();
    const AdmissibleResidual residual(random_, problem);
    std::vector<Real> x = PointOf(random_, query.initial_set);
    const std::unique_ptr<Certifier> learner = MakeLearner(problem);
    Eigen::VectorXd measured = Measured(x);
    Real offset;
    for (int t = 0; t < standing; ++t) {
      const Eigen::VectorXd u = query.controls.col(t);
      std::vector<Real> z = x;
      for (int l = 0; l < u.size(); ++l) z.push_back(ActedInput(winds_, *told_, l, u[l]));
      const Real before = std::exchange(offset, NextOffset(problem, offset));
      const std::vector<Real> next = Rolled(winds_, problem, residual, z, offset - before);
      RequireInSlice(next, t + 1);
      Eigen::VectorXd recorded(z.size());
      recorded << measured, u;
      measured = Measured(next);
      RequireConsistent(measured, t + 1);
      if (learner && KeepsRates(x, next, Real(StepOf(*problem.model)) + offset - before))
        Learn(*learner, problem, recorded, measured, abs(offset - before));
      const Chord chord = judge.ChordOf(x, next, before, offset);
      if (t >= first && problem.between)
        Follow(judge, chord, obstacles, t);
      else if (t >= first)
        Visit(judge, chord, nullptr, obstacles, t, 0);
      if (t + 1 == standing) Visit(judge, chord, nullptr, obstacles, t, 1);
      x = next;
    }
  }

  // Of the boundary after one: a robot ends a step that lasts longer by more than the error.
  Real NextOffset(const Problem& problem, const Real& before) {
    const Real any = AnyOffset(winds_, problem), latest = before + Real(problem.timing.error);
    return any < latest ? any : latest;
  }

  void RequireInSlice(const std::vector<Real>& x, int t) const {
    for (std::size_t k = 0; k < x.size(); ++k) {
      const Interval hull = tube_.hull(t, static_cast<int>(k));
      if (Real(hull.lower) <= x[k] && x[k] <= Real(hull.upper)) continue;
      std::ostringstream text;
      text << random_.trace() << ": state " << k << " leaves slice " << t << " of plan " << tally_.plans;
      throw Contradiction(text.str());
    }
  }

  // ---- What a robot measures and records.

  [[nodiscard]] double StateError(Eigen::Index k) const {
    constexpr double kLastBits = 1e-7;  // at least: a true state is no double
    return std::max(told_->declaration.VariableError(k), kLastBits);
  }
  [[nodiscard]] double ToldStateError(Eigen::Index k) const {
    return untold_ == Untold::kStateErrors ? 0 : StateError(k);
  }

  // By all of the error or by anything within it. The margin of 1e-6 is for rounding.
  double Off(double error) {
    return (1 - 1e-6) * error * (records_.Coin(0.7) ? records_.Sign() : records_.Uniform(-1, 1));
  }

  Eigen::VectorXd Measured(const std::vector<Real>& x) {
    Eigen::VectorXd measured(std::ssize(x));
    for (Eigen::Index k = 0; k < measured.size(); ++k)
      measured[k] = (x[ToSize(k)] + Real(Off(StateError(k)))).ToDouble();
    return measured;
  }

  void RequireConsistent(const Eigen::VectorXd& measured, int t) const {
    for (Eigen::Index k = 0; k < measured.size(); ++k) {
      const Interval hull = tube_.hull(t, static_cast<int>(k));
      if (Conform(measured[k], ToldStateError(k), hull.lower, hull.upper, false) != Conformance::kLeft) continue;
      std::ostringstream text;
      text << random_.trace() << ": state " << k << " is said to leave slice " << t << " of plan " << tally_.plans;
      throw Contradiction(text.str());
    }
  }

  // Of steps that are recorded with errors; what it is given may be exact. Null where something else is untold, or what
  // is given shows a faster motion than is declared, as no true motion does.
  std::unique_ptr<Certifier> MakeLearner(const Problem& truth) {
    if (untold_ != Untold::kNothing && untold_ < Untold::kStateErrors) return nullptr;
    auto problem = std::make_shared<Problem>(*told_);
    Declaration& declaration = problem->declaration;
    declaration.given_are_exact = untold_ != Untold::kNothing || records_.Coin();
    declaration.state_error =
        Eigen::VectorXd::NullaryExpr(truth.model->num_states(), [this](Eigen::Index k) { return ToldStateError(k); });
    if (untold_ == Untold::kInputErrors) declaration.input_error.setZero();
    if (declaration.given_are_exact) problem->transitions = truth.transitions;
    auto learner = std::make_unique<Certifier>(problem);
    const bool is_too_fast = learner->violation() && learner->violation()->second == -1;
    return is_too_fast ? nullptr : std::move(learner);
  }

  // Whether a motion within the declared rates can have made a step: another one is not true.
  [[nodiscard]] bool KeepsRates(const std::vector<Real>& x, const std::vector<Real>& next, const Real& duration) const {
    const RateBounds rates(*told_);
    return std::ranges::all_of(rates.bounds(), [&](const RateBounds::Bound& bound) {
      const std::size_t k = ToSize(bound.state);
      return abs(next[k] - x[k]) <= Real(bound.rate) * duration;
    });
  }

  void Learn(Certifier& learner, const Problem& truth, const Eigen::VectorXd& z, Eigen::VectorXd next,
             const Real& longer) {
    for (Eigen::Index k = 0; k < next.size(); ++k) next[k] += Off(truth.declaration.noise_bound[k]);
    const double by_clock = untold_ == Untold::kDurations ? 0 : NextUp(longer.ToDouble());
    const std::optional<double> counted = CountedDuration(*told_, by_clock, false);
    if (!counted) throw Contradiction(random_.trace() + ": a step is said to be off its time");
    tally_.learned += learner.Learn(View(z), View(next), *counted) == Learned::kAdded;
    if (!learner.violation()) return;
    std::ostringstream text;
    text << random_.trace() << ": a step of plan " << tally_.plans << " is said to contradict the declaration in state "
         << learner.violation()->coordinate;
    throw Contradiction(text.str());
  }

  void Follow(const MotionJudge& judge, const Chord& chord, const std::vector<Obstacle>& obstacles, int t) {
    for (int m = 0; m < 5; ++m) {
      const std::optional<Path> path = judge.AnyPath(random_, chord);
      if (!path) {
        ++tally_.inadmissible;
        return;
      }
      ++tally_.motions;
      for (int i = 0; i < 6; ++i) Visit(judge, chord, &*path, obstacles, t, random_.Integer(0, 16) / 16.0);
    }
  }

  void Visit(const MotionJudge& judge, const Chord& chord, const Path* path, const std::vector<Obstacle>& obstacles,
             int t, double s) {
    constexpr double kScreen = 1e-6, kDouble = 1e-13, kReal = 1e-60;
    ++tally_.moments;
    const auto parts = judge.Place<double>(chord, path, s);
    const std::int64_t most = judge.schedule().clock_error_us;
    for (std::size_t o = 0; o < obstacles.size(); ++o) {
      const std::int64_t error = random_.Coin(0.3) || most == 0 ? 0
                                 : random_.Coin()               ? (random_.Coin() ? most : -most)
                                                                : random_.Below(static_cast<int>(2 * most + 1)) - most;
      const auto off = error + static_cast<std::int64_t>((1 - s) * chord.offset_from_us + s * chord.offset_to_us);
      if (!judge.Meet(parts, obstacles[o], t, s, off, kScreen, kDouble)) continue;
      ++tally_.decided_exactly;
      if (!judge.Meet(judge.Place<Real>(chord, path, s), obstacles[o], t, s, off, 0, kReal)) continue;
      std::ostringstream text;
      text << random_.trace() << ": obstacle " << o << " (kind " << static_cast<int>(obstacles[o].kind())
           << (obstacles[o].motion() ? ", moving" : "") << ") is met at step " << t << " + " << s << ", clock off by "
           << off << " us, p = " << chord.from.size() << ", " << judge.problem().body.parts.size() << " parts"
           << (path ? "" : ", at a sample") << "; plan " << tally_.plans << " of its problem";
      throw Contradiction(text.str());
    }
  }

  Random random_, winds_, records_;
  Untold untold_;
  std::shared_ptr<const Problem> told_;
  std::int64_t step_error_us_ = 0;  // what the certifier is told
  Tally tally_;
  Tube tube_;
};

}  // namespace forereach
