/** Random problems whose models are texts, and queries of them. */
#pragma once

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "forereach/dynamics/text_model.h"
#include "tests/oracle/any_text.h"
#include "tests/oracle/problems.h"
#include "tests/oracle/text_in_high_precision.h"

namespace forereach {

constexpr double kTextReach = 3;  ///< Of each state; of each input it is 1.

/** A random text with transitions of it and an admissible residual, for some value of its parameters. Null if the text
has no value at most points. */
inline std::shared_ptr<Problem> AnyTextProblem(Random& random, const ModelText& text) {
  const auto model = MakeTextModel(text);
  const int n = model->num_states(), variables = model->num_variables();
  auto problem = std::make_shared<Problem>(
      WorldOf(model, Within(Eigen::VectorXd::Constant(n, kTextReach)), Within(Eigen::VectorXd::Ones(variables - n))));
  problem->zonotope_order = random.Integer(1, 6);
  Declaration& declaration = problem->declaration;
  for (int k = 0; k < n; ++k) {
    for (int l = 0; l < variables; ++l)
      if (random.Coin(0.2)) declaration.lipschitz(k, l) = random.Uniform(0, 0.05);
    declaration.noise_bound[k] = random.Coin(0.3) ? random.Uniform(0, 1e-3) : 0;
  }
  std::vector<double> parameters;
  for (const auto& [name, lower, upper] : text.parameters) parameters.push_back(random.Coin() ? lower : upper);
  const TextInHighPrecision nominal(text, parameters);
  const Ramps residual(random, declaration.lipschitz);
  const int count = random.Integer(1, 20);
  problem->transitions = {Eigen::MatrixXd(count, variables), Eigen::MatrixXd(count, n)};
  for (int i = 0, attempts = 0; i < count; ++attempts) {
    if (attempts > 20 * count) return nullptr;
    Eigen::VectorXd z(variables), next(n);
    for (int l = 0; l < variables; ++l) z[l] = (l < n ? kTextReach : 1) * random.Uniform(-0.9, 0.9);
    const std::vector<exact::Real> exact_z(z.begin(), z.end()), value = nominal(exact_z);
    for (int k = 0; k < n; ++k)
      next[k] = (value[static_cast<std::size_t>(k)] + residual(exact_z, k) +
                 declaration.noise_bound[k] * random.Uniform(-1, 1))
                    .ToDouble();
    if (!next.allFinite()) continue;
    problem->transitions.z.row(i) = z;
    problem->transitions.x_next.row(i++) = next;
  }
  return problem;
}

inline std::shared_ptr<Problem> AnyTextProblem(Random& random) { return AnyTextProblem(random, AnyText(random)); }

/** Of states that are points, at kinks and beside them, or touch a kink with an end; and of boxes. */
inline Query KinkedQuery(Random& random, const Problem& problem) {
  const int n = problem.model->num_states(), inputs = problem.model->num_inputs();
  const auto whole_half = [&] { return 0.5 * random.Integer(-3, 3); };
  Eigen::VectorXd center(n), half(n);
  for (int k = 0; k < n; ++k) {
    center[k] = random.Coin(0.7) ? whole_half() : random.Uniform(-1.5, 1.5);
    half[k] = random.Coin(0.6) ? 0 : std::ldexp(1, -random.Integer(3, 12));
    if (random.Coin(0.2)) center[k] += random.Sign() * half[k];
    if (random.Coin(0.1)) center[k] += random.Sign() * std::ldexp(1, -random.Integer(20, 60));
  }
  Query query;
  query.initial_set = Zonotope::FromBox(center, half);
  query.controls = random.Matrix(inputs, random.Integer(1, 4), 0.7);
  for (Eigen::Index i = 0; i < query.controls.size(); ++i)
    if (random.Coin()) query.controls(i) = 0.5 * random.Integer(-2, 2);
  return query;
}

inline Query AnyTextQuery(Random& random, const Problem& problem) {
  const int n = problem.model->num_states(), inputs = problem.model->num_inputs();
  const Eigen::VectorXd center = random.Vector(n, 0.6 * kTextReach);
  Eigen::VectorXd half = random.Vector(n).cwiseAbs();
  half *= random.Coin(0.1) ? 0 : std::ldexp(1, -random.Integer(4, 12));
  Query query;
  query.initial_set = Zonotope::FromBox(center, half);
  query.controls = random.Matrix(inputs, random.Integer(1, 12), 0.7);
  return query;
}

}  // namespace forereach
