/** The worlds of tests: problems in which the robot does what its nominal model says, and nothing else is known.

| part | what it is |
|---|---|
| model, domain | given; the domain is the product of two boxes |
| declaration | L = 0 and sigma = 0: the residual is a constant |
| data | one transition, from z = 0 to the nominal successor: the constant is zero |
| safety | the first two states are the position of a point (the first state, if it is the only one) |

All else is as `Problem` has it by default. A test changes what it is about. It chooses X0, plans and obstacles. */
#pragma once

#include <algorithm>
#include <initializer_list>
#include <memory>
#include <ostream>
#include <utility>
#include <vector>

#include "forereach/certify/problem.h"
#include "forereach/dynamics/models/named_models.h"
#include "forereach/residual/growing_disturbance.h"

namespace forereach {

inline Eigen::VectorXd Vec(std::initializer_list<double> entries) {
  return Eigen::Map<const Eigen::VectorXd>(entries.begin(), static_cast<Eigen::Index>(entries.size()));
}

inline void PrintTo(Method method, std::ostream* out) { *out << (method == Method::kPaper ? "paper" : "centred"); }

/** Bounds on a disturbance that grow with state and input: an expression for each state. */
inline std::shared_ptr<const GrowingDisturbance> Growing(const NominalModel& model,
                                                         std::initializer_list<const char*> bounds) {
  std::vector<ExpressionText> texts;
  for (const char* const bound : bounds) texts.push_back({bound, 1, 1});
  return std::make_shared<const GrowingDisturbance>(model, std::move(texts));
}

/** {x : |x_k| <= reach_k}. */
inline Box Within(const Eigen::VectorXd& reach) { return {-reach, reach}; }
inline Box Within(std::initializer_list<double> reach) { return Within(Vec(reach)); }

/** Gives a task a problem of its own, to be changed. */
inline Problem& Own(std::shared_ptr<const Problem>& problem) {
  const auto own = std::make_shared<Problem>(*problem);
  problem = own;
  return *own;
}

inline Problem WorldOf(std::shared_ptr<const NominalModel> model, const Box& state, const Box& input) {
  const int n = model->num_states(), variables = model->num_variables();
  Problem problem;
  problem.domain.state = state;
  problem.domain.input = input;
  problem.declaration = {Eigen::MatrixXd::Zero(n, variables), Eigen::VectorXd::Zero(n)};
  problem.projection = Eigen::MatrixXd::Identity(std::min(n, 2), n);
  Eigen::VectorXd next(n);
  const Eigen::VectorXd rest = Eigen::VectorXd::Zero(variables);
  model->Evaluate({rest.data(), static_cast<std::size_t>(variables)}, {next.data(), static_cast<std::size_t>(n)});
  problem.transitions = {rest.transpose(), next.transpose()};
  problem.model = std::move(model);
  return problem;
}

/** A point mass in steps of 0.5 s, in which whole numbers stay exact: |p| <= 100 m, |v| <= speed m/s, |a| <= 2 m/s^2,
each along both axes. */
inline Problem PointMassInHalves(double speed = 4) {
  return WorldOf(MakePointMass(0.5), Within({100, 100, speed, speed}), Within({2, 2}));
}

/** The paper's point mass, without its ball of speeds: dt = 0.15 s, |p| <= 20 m along both axes. */
inline Problem PaperPointMass(double speed = 5.4, double acceleration = 3) {
  return WorldOf(MakePointMass(0.15), Within({20, 20, speed, speed}), Within({acceleration, acceleration}));
}

/** The paper's bicycle: dt = 0.1 s, wheelbase 2.5 m, |x|, |y| <= 40 m, |theta| <= heading rad, |v| <= 25 m/s, |a| <= 3
m/s^2, |delta| <= steering rad, |jerk| <= 20 m/s^3, |steering rate| <= 2 rad/s. */
inline Problem PaperBicycle(double heading = 3, double steering = 0.48) {
  return WorldOf(MakeKinematicBicycle(0.1, 2.5), Within({40, 40, heading, 25, 3, steering}), Within({20, 2}));
}

}  // namespace forereach
