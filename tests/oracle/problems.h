/** Random problems whose data come from a residual that satisfies the declaration, and random queries of them. */
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "forereach/certify/certifier.h"
#include "forereach/dynamics/expression.h"
#include "forereach/dynamics/models/kinematic_bicycle.h"
#include "forereach/dynamics/models/point_mass.h"
#include "forereach/dynamics/step_rate.h"
#include "forereach/numerics/text.h"
#include "tests/oracle/exact.h"
#include "tests/oracle/random.h"
#include "tests/worlds.h"

namespace forereach {

/** A residual that may use up all of its declaration: coordinate k is a mean of ramps a |sum_l w_l L_kl (z_l - knee_l)|
with |a|, |w_l| <= 1, some of them exactly 1. */
class Ramps {
 public:
  Ramps(Random& random, const Eigen::MatrixXd& lipschitz) : lipschitz_(lipschitz), ramps_(random.Coin() ? 1 : 2) {
    const int n = static_cast<int>(lipschitz.rows()), variables = static_cast<int>(lipschitz.cols());
    const bool extremal = random.Coin();
    const auto weight = [&] { return extremal ? random.Sign() : random.Uniform(-1, 1); };
    for (Ramp& ramp : ramps_) {
      ramp.weight = Eigen::MatrixXd::NullaryExpr(n, variables, weight);
      ramp.height = Eigen::VectorXd::NullaryExpr(n, weight);
      ramp.knee = random.Vector(variables);
    }
  }

  /** Coordinate k at z. */
  [[nodiscard]] Real operator()(const std::vector<Real>& z, int k) const {
    Real sum = 0;
    for (const Ramp& ramp : ramps_) {
      Real along = 0;
      for (Eigen::Index l = 0; l < lipschitz_.cols(); ++l) {
        if (lipschitz_(k, l) == 0) continue;
        along += Real(ramp.weight(k, l)) * Real(lipschitz_(k, l)) * (z[static_cast<std::size_t>(l)] - ramp.knee[l]);
      }
      sum += Real(ramp.height[k]) * abs(along) / static_cast<double>(ramps_.size());
    }
    return sum;
  }

 private:
  struct Ramp {
    Eigen::MatrixXd weight;
    Eigen::VectorXd knee, height;
  };
  Eigen::MatrixXd lipschitz_;
  std::vector<Ramp> ramps_;
};

[[nodiscard]] inline double StepOf(bool bicycle) { return bicycle ? 0.1 : 0.15; }

/** f0(z) in high precision, from the models' own equations, with a step of another duration than dt. */
[[nodiscard]] inline std::vector<Real> NominalSuccessor(bool bicycle, const std::vector<Real>& z,
                                                        const Real& duration) {
  std::vector<Real> next(bicycle ? 6 : 4);
  const std::vector<Real> parameters{duration, Real(2.5)};
  const std::span<const Real> all(parameters), state(z);
  if (bicycle)
    KinematicBicycle::Step<Real>(all, state, next);
  else
    PointMass::Step<Real>(all.first(1), state, next);
  return next;
}
[[nodiscard]] inline std::vector<Real> NominalSuccessor(bool bicycle, const std::vector<Real>& z) {
  return NominalSuccessor(bicycle, z, Real(StepOf(bicycle)));
}

/** One certify call's arguments. */
struct Query {
  Zonotope initial_set;
  Eigen::MatrixXd controls;  // a column a step
  std::vector<Obstacle> obstacles;
  Schedule schedule{};

  [[nodiscard]] Plan plan() const {
    return {controls.data(), static_cast<int>(controls.rows()), static_cast<int>(controls.cols()),
            static_cast<int>(controls.rows()), schedule};
  }
};

inline Eigen::VectorXd StateReach(bool bicycle) {
  return bicycle ? Vec({40, 40, 3.14, 25, 3, 0.48}) : Vec({20, 20, 6, 6});
}

/** The bicycle or the point mass with `count` transitions. Few entries of L are not zero; a third of the coordinates
have noise, up to its bound. */
inline std::shared_ptr<Problem> AnyProblem(Random& random, bool bicycle, int count) {
  const std::shared_ptr<const NominalModel> model = bicycle ? MakeKinematicBicycle(0.1, 2.5) : MakePointMass(0.15);
  const int n = model->num_states(), variables = model->num_variables();
  const Eigen::VectorXd reach = StateReach(bicycle), input = bicycle ? Eigen::Vector2d(20, 2) : Eigen::Vector2d(3, 3);
  auto problem = std::make_shared<Problem>(WorldOf(model, Within(reach), Within(input)));
  if (!bicycle && random.Coin()) problem->domain.balls.push_back({{2, 3}, Eigen::Vector2d::Zero(), 5.4});
  problem->zonotope_order = random.Integer(1, 6);
  if (random.Coin(0.2)) problem->projection += random.Matrix(2, n, 0.1);

  Declaration& declaration = problem->declaration;
  for (int k = 0; k < n; ++k) {
    for (int l = 0; l < variables; ++l)
      if (random.Coin(0.12)) declaration.lipschitz(k, l) = random.Uniform(0, 0.05);
    if (random.Coin(0.3)) declaration.noise_bound[k] = random.Uniform(0, 1e-3);
  }
  const Ramps residual(random, declaration.lipschitz);
  problem->transitions = {Eigen::MatrixXd(count, variables), Eigen::MatrixXd(count, n)};
  for (int i = 0; i < count; ++i) {
    Eigen::VectorXd z(variables);
    do {
      for (int l = 0; l < variables; ++l)
        z[l] = (l < n ? reach[l] : input[l - n]) * random.Uniform(-0.8, 0.8) * (random.Coin() ? 0.3 : 1);
    } while (!problem->domain.Contains(View(z)));
    const std::vector<Real> exact_z(z.begin(), z.end()), nominal = NominalSuccessor(bicycle, exact_z);
    for (int k = 0; k < n; ++k) {
      const double noise = declaration.noise_bound[k] * (random.Coin(0.3) ? random.Sign() : random.Uniform(-1, 1));
      problem->transitions.x_next(i, k) =
          (nominal[static_cast<std::size_t>(k)] + residual(exact_z, k) + noise).ToDouble();
    }
    problem->transitions.z.row(i) = z;
  }
  return problem;
}

/** What the bound on the disturbance of state k has at z beyond its constant part: |d_k(z)|. @pre d_k names variables
only. */
inline Real GrowthAt(const Problem& problem, const std::vector<Real>& z, Eigen::Index k) {
  const Declaration& declaration = problem.declaration;
  if (!declaration.Grows(k)) return 0;
  const Expression text =
      ParseExpression(declaration.growing->bounds()[static_cast<std::size_t>(k)], problem.model->variable_names());
  return abs(Evaluate<Real>(text, z, [](double number) { return Real(number); }));
}

/** What the regions around z bound, or `everywhere`. */
inline double BoundAt(const Declaration& declaration, Eigen::VectorXd Region::*bound, const std::vector<Real>& z,
                      Eigen::Index k, double everywhere) {
  for (const Region& region : declaration.regions)
    if ((region.*bound).size() != 0 && std::ranges::all_of(region.box, [&](const Region::Side& side) {
          const Real& at = z[static_cast<std::size_t>(side.variable)];
          return Real(side.range.lower) <= at && at <= Real(side.range.upper);
        }))
      everywhere = std::min(everywhere, (region.*bound)[k]);
  return everywhere;
}

/** The bound on the disturbance of state k in a step at z. */
inline Real DisturbanceAt(const Problem& problem, const std::vector<Real>& z, Eigen::Index k) {
  const Declaration& declaration = problem.declaration;
  return Real(BoundAt(declaration, &Region::disturbance, z, k, declaration.DisturbanceBound(k))) +
         GrowthAt(problem, z, k);
}

/** The bound on the error of its recorded successor. */
inline double NoiseAt(const Declaration& declaration, const std::vector<Real>& z, Eigen::Index k) {
  return BoundAt(declaration, &Region::noise_bound, z, k, declaration.noise_bound[k]);
}

/** Declares that the disturbance of about half of the coordinates grows with state and input, by expressions with and
without kinks, some of which are negative somewhere. */
inline void Grow(Random& random, Problem& problem) {
  const std::vector<std::string> names = problem.model->variable_names();
  const std::vector<Interval> ranges = problem.domain.Ranges();
  std::vector<ExpressionText> bounds(static_cast<std::size_t>(problem.model->num_states()),
                                     {GrowingDisturbance::kNone});
  for (ExpressionText& bound : bounds) {
    if (random.Coin()) continue;
    const auto any = [&] { return static_cast<std::size_t>(random.Below(static_cast<int>(names.size()))); };
    const std::size_t a = any(), b = any();
    const double reach = std::max(ranges[a].Magnitude(), ranges[b].Magnitude());
    const std::string least = ToText(std::ldexp(random.Uniform(0.5, 1), -random.Integer(6, 16)) / (reach * reach)),
                      scale = least + "*" + ToText(reach);
    switch (random.Below(5)) {
      case 0: bound.text = scale + "*" + names[a]; break;
      case 1: bound.text = least + "*abs(" + names[a] + "*(" + names[b] + " - 0.25*" + names[a] + "))"; break;
      case 2: bound.text = least + "*(" + names[a] + "^2 - " + names[b] + "*" + names[a] + ")"; break;
      case 3: bound.text = scale + "*" + names[a] + "*sin(" + names[b] + ")"; break;
      default: bound.text = scale + "*max(" + names[a] + ", abs(" + names[b] + "))"; break;
    }
  }
  problem.declaration.growing = std::make_shared<const GrowingDisturbance>(*problem.model, std::move(bounds));
}

/** Shares of a bound, or nothing, for each of some regions. */
inline void BoundInRegions(Random& random, Declaration& declaration, Eigen::VectorXd Region::*bound,
                           const Eigen::VectorXd& everywhere) {
  for (Region& region : declaration.regions) {
    if (random.Coin(0.3)) continue;
    region.*bound = everywhere;
    for (double& entry : region.*bound)
      entry = random.Coin(0.2) ? kInfinity : random.Coin(0.2) ? 0 : random.Uniform(0, 1) * entry;
  }
}

/** Declares a disturbance in about half of the coordinates, in some problems one that grows, less in some of the
regions if there are any, and disturbs every observation within it, many of them by the bound. The margin of 1e-6 is for
the rounding of the successors. */
inline void Disturb(Random& random, Problem& problem) {
  const int n = problem.model->num_states();
  Eigen::VectorXd& bound = problem.declaration.disturbance;
  bound = Eigen::VectorXd::Zero(n);
  for (int k = 0; k < n; ++k)
    if (random.Coin()) bound[k] = std::ldexp(random.Uniform(0.5, 1), -random.Integer(6, 16));
  if (random.Coin(0.4)) Grow(random, problem);
  BoundInRegions(random, problem.declaration, &Region::disturbance, bound);
  for (int i = 0; i < problem.transitions.size(); ++i) {
    const Eigen::VectorXd z = problem.transitions.z.row(i);
    for (int k = 0; k < n; ++k)
      problem.transitions.x_next(i, k) += (1 - 1e-6) * DisturbanceAt(problem, {z.begin(), z.end()}, k).ToDouble() *
                                          (random.Coin() ? random.Sign() : random.Uniform(-1, 1));
  }
}

/** The same as a robot records it whose states and inputs are known to the errors e that it declares, in about half of
the coordinates: each number that is recorded is off by at most e, many of them by nearly all of it. Whatever residual
the true transitions admit is that of a robot that may have been recorded so. Transitions that may lie outside the
domain are left out; if all do, nothing is declared. The margin of 1e-6 is for rounding. */
inline std::shared_ptr<Problem> Recorded(Random& random, const Problem& truth) {
  auto problem = std::make_shared<Problem>(truth);
  const int n = truth.model->num_states(), variables = truth.model->num_variables();
  Eigen::VectorXd errors = Eigen::VectorXd::Zero(variables);
  const std::vector<Interval> ranges = truth.domain.Ranges();
  for (int l = 0; l < variables; ++l)
    if (random.Coin())
      errors[l] = std::ldexp(random.Uniform(0.5, 1) * (ranges[static_cast<std::size_t>(l)].HalfWidthUpper()),
                             -random.Integer(5, 16));
  problem->declaration.state_error = errors.head(n);
  problem->declaration.input_error = errors.tail(variables - n);
  const auto off = [&](double e) {
    return (1 - 1e-6) * e * (random.Coin(0.7) ? random.Sign() : random.Uniform(-1, 1));
  };
  Transitions& data = problem->transitions;
  std::vector<int> rows;
  for (int i = 0; i < data.size(); ++i) {
    for (int l = 0; l < variables; ++l) data.z(i, l) += off(errors[l]);
    for (int k = 0; k < n; ++k) data.x_next(i, k) += off(errors[k]);
    const Eigen::VectorXd z = data.z.row(i);
    if (IsWithin(*problem, View(z), false)) rows.push_back(i);
  }
  if (rows.empty()) return std::make_shared<Problem>(truth);
  data = Transitions{data.z(rows, Eigen::all), data.x_next(rows, Eigen::all)};
  return problem;
}

/** What disturbs a step at z: by the bound or by anything within it. */
inline std::vector<Real> AnyDisturbance(Random& random, const Problem& problem, const std::vector<Real>& z) {
  std::vector<Real> w;
  for (int k = 0; k < problem.model->num_states(); ++k)
    w.push_back(DisturbanceAt(problem, z, k) * Real(random.Coin(0.8) ? random.Sign() : random.Uniform(-1, 1)));
  return w;
}

/** Declares that boundaries of steps may be off their times, that software sets some states at them, and bounds on the
rates of some others. */
inline void Shift(Random& random, Problem& problem) {
  const int n = problem.model->num_states();
  const StepRate rate(*TextOf(*problem.model));
  problem.timing.error = StepOf(*problem.model) * std::ldexp(random.Uniform(0.5, 1), -random.Integer(2, 8));
  for (int k = 0; k < n; ++k) {
    if (random.Coin(0.2)) problem.timing.set_at_steps.push_back(k);
    if (rate.UsesDuration(k) && rate.BeginsAtState(k) && !random.Coin(0.2)) continue;
    if (problem.timing.rate_bound.size() == 0) problem.timing.rate_bound.setConstant(n, kInfinity);
    // The data keep it.
    const Transitions& data = problem.transitions;
    const double fastest = (data.x_next.col(k) - data.z.col(k)).cwiseAbs().maxCoeff() / StepOf(*problem.model);
    problem.timing.rate_bound[k] = fastest * random.Uniform(1, 2) + 1e-9;
  }
}

/** The offset of a boundary: by the error or by anything within it. */
inline Real AnyOffset(Random& random, const Problem& problem) {
  return Real(problem.timing.error) * Real(random.Coin(0.8) ? random.Sign() : random.Uniform(-1, 1));
}

/** An input that acts where the plan has u: off by the declared error or by anything within it. */
inline Real ActedInput(Random& random, const Problem& problem, int l, double u) {
  const Eigen::VectorXd& error = problem.declaration.input_error;
  if (error.size() == 0) return u;
  return Real(u) + Real(error[l]) * Real(random.Coin(0.8) ? random.Sign() : random.Uniform(-1, 1));
}

/** f0(z) + r + w for a step that lasts `longer` than dt: the residual and the disturbance do what they may meanwhile,
which is to grow with the square of the duration, or the state moves by what is declared of its rate.
@param unexpected r + w. @param most bounds on |r| + w^. */
inline std::vector<Real> LongerSuccessor(Random& random, const Problem& problem, const std::vector<Real>& z,
                                         const std::vector<Real>& unexpected, const std::vector<Real>& most,
                                         const Real& longer) {
  const bool bicycle = problem.model->num_states() == 6;
  const Real dt(StepOf(bicycle)), share = abs(longer) / dt;
  const StepTiming& timing = problem.timing;
  std::vector<Real> next = NominalSuccessor(bicycle, z), of_duration = NominalSuccessor(bicycle, z, dt + longer);
  for (std::size_t k = 0; k < next.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    const Real way(random.Coin(0.8) ? random.Sign() : random.Uniform(-1, 1));
    if (std::ranges::count(timing.set_at_steps, static_cast<int>(k)) == 0) {
      if (timing.rate_bound.size() > 0 && timing.rate_bound[i] < kInfinity)
        next[k] += way * abs(longer) * Real(timing.rate_bound[i]);
      else
        next[k] = of_duration[k] + way * share * (Real(2) + share) * most[k];
    }
    next[k] += unexpected[k];
  }
  return next;
}

/** The next state of an admissible rollout, whose step lasts `longer` than dt. @param residual r_k(z), as it is called.
 */
template <class Residual>
std::vector<Real> Rolled(Random& random, const Problem& problem, const Residual& residual, const std::vector<Real>& z,
                         const Real& longer) {
  std::vector<Real> unexpected = AnyDisturbance(random, problem, z), most;
  for (std::size_t k = 0; k < unexpected.size(); ++k) {
    const Real r = residual(z, static_cast<int>(k));
    unexpected[k] += r;
    most.push_back(abs(r) + DisturbanceAt(problem, z, static_cast<Eigen::Index>(k)));
  }
  return LongerSuccessor(random, problem, z, unexpected, most, longer);
}

inline Query AnyQuery(Random& random, const Problem& problem) {
  const bool bicycle = problem.model->num_states() == 6;
  const int n = problem.model->num_states();
  const Eigen::VectorXd reach = StateReach(bicycle);
  Eigen::VectorXd center = 0.3 * reach.cwiseProduct(random.Vector(n)),
                  half = reach.cwiseProduct(random.Vector(n)).cwiseAbs();
  half *= random.Coin(0.1) ? 0 : std::ldexp(1, -random.Integer(5, 12));
  Query query;
  query.initial_set = Zonotope::FromBox(center, half);
  const int steps = random.Integer(1, 12);
  const Eigen::VectorXd input =
      (bicycle ? Eigen::Vector2d(2, 0.5) : Eigen::Vector2d(1, 1)).cwiseProduct(random.Vector(2));
  query.controls = input.replicate(1, steps);
  if (random.Coin()) query.controls += random.Matrix(2, steps, 0.2);
  for (int o = random.Integer(0, 4); o > 0; --o) {
    const Eigen::VectorXd place = problem.projection * center + random.Vector(2, 12);
    switch (random.Below(4)) {
      case 0: query.obstacles.push_back(Obstacle::Circle(place, random.Uniform(0, 2))); break;
      case 1: query.obstacles.push_back(Obstacle::AxisBox(place, place + random.Vector(2).cwiseAbs())); break;
      case 2:
        query.obstacles.push_back(Obstacle::Polygon({place, place + random.Vector(2), place + random.Vector(2)}));
        break;
      default: {
        const Eigen::VectorXd normal = random.Vector(2);
        query.obstacles.push_back(Obstacle::HalfSpace(normal, normal.dot(place) + random.Uniform(0, 8)));
      }
    }
  }
  return query;
}

}  // namespace forereach
