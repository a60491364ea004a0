/** Small tasks for the methods: a point mass with residuals put in by hand, and the paper's two systems with data drawn
from their true residuals. */
#pragma once

#include <memory>
#include <vector>

#include "forereach/dynamics/models/named_models.h"
#include "forereach/dynamics/models/residuals.h"
#include "forereach/reach/propagator.h"
#include "research/methods/method.h"
#include "tests/oracle/traced_random.h"

namespace forereach::research {

/** What a Setting refers to. */
struct Task {
  std::shared_ptr<const NominalModel> model;
  Domain domain;
  Declaration declaration;
  Transitions data{};

  [[nodiscard]] Setting setting(std::uint64_t seed = 1) const { return {*model, domain, declaration, data, seed}; }

  /** Appends the transition at z whose residual is r, rounded once to a recorded successor. */
  void Observe(const Eigen::VectorXd& z, const std::vector<long double>& r) {
    const Eigen::Index i = data.z.rows(), n = model->num_states();
    Eigen::VectorXd next(n);
    model->Evaluate(View(z), {next.data(), static_cast<std::size_t>(n)});
    data.z.conservativeResize(i + 1, z.size());
    data.x_next.conservativeResize(i + 1, n);
    data.z.row(i) = z;
    for (Eigen::Index k = 0; k < n; ++k)
      data.x_next(i, k) = static_cast<double>(next[k] + r[static_cast<std::size_t>(k)]);
  }
};

/** The point mass with |p| <= 8, |v| <= 4, |u| <= 1, step 0.5, and a residual of vx that changes with px and vx by at
most `by_position` and `by_speed`. */
inline Task HandTask(double by_position, double by_speed) {
  Task task{MakePointMass(0.5), {}, {Eigen::MatrixXd::Zero(4, 6), Eigen::VectorXd::Zero(4)}};
  task.domain.state = Box(Eigen::Vector4d(-8, -8, -4, -4), Eigen::Vector4d(8, 8, 4, 4));
  task.domain.input = Box(Eigen::Vector2d(-1, -1), Eigen::Vector2d(1, 1));
  task.declaration.lipschitz(2, 0) = by_position;
  task.declaration.lipschitz(2, 2) = by_speed;
  return task;
}

/** Appends an observation of HandTask: at px and vx, the rest zero, vx has the residual r. */
inline void ObserveAt(Task& task, double px, double vx, double r) {
  task.Observe((Eigen::VectorXd(6) << px, 0, vx, 0, 0, 0).finished(), {0, 0, r, 0});
}

template <class Residual>
void ObserveUniformly(Task& task, const Residual& residual, const Box& region, int count, std::uint64_t seed) {
  Random random(seed);
  for (int i = 0; i < count; ++i) {
    Eigen::VectorXd z(region.dim());
    for (int l = 0; l < region.dim(); ++l) z[l] = random.Uniform(region.lower()[l], region.upper()[l]);
    const std::vector<long double> wide(z.begin(), z.end());
    std::vector<long double> r(static_cast<std::size_t>(task.model->num_states()));
    residual(std::span<const long double>(wide), std::span<long double>(r));
    task.Observe(z, r);
  }
}

inline constexpr HeadingSaturation kBicycleResidual{0.1, 2.5};
inline constexpr VelocityKnee kPointMassResidual{0.15};

/** The paper's bicycle with `count` observations in the corridor. */
inline Task BicycleTask(int count, std::uint64_t seed) {
  Task task{MakeKinematicBicycle(0.1, 2.5), {}, {Eigen::MatrixXd::Zero(6, 8), Eigen::VectorXd::Zero(6)}};
  Eigen::VectorXd lowest(6), highest(6), lower(8), upper(8);
  lowest << -40, -40, -3.141592653589793, 0, -3, -0.48;
  highest << 40, 40, 3.141592653589793, 25, 3, 0.48;
  task.domain.state = Box(lowest, highest);
  task.domain.input = Box(Eigen::Vector2d(-20, -2), Eigen::Vector2d(20, 2));
  task.declaration.lipschitz(2, 3) = 0.017926410;
  task.declaration.lipschitz(2, 5) = 0.609638820;
  lower << -40, -40, -3, 7.25, -3, 0, -20, -2;
  upper << 40, 40, 3, 15.75, 3, 0.45, 20, 2;
  ObserveUniformly(task, kBicycleResidual, Box(lower, upper), count, seed);
  return task;
}

/** The paper's point mass with `count` observations around its corridor. */
inline Task PointMassTask(int count, std::uint64_t seed) {
  Task task{MakePointMass(0.15), {}, {Eigen::MatrixXd::Zero(4, 6), Eigen::VectorXd::Zero(4)}};
  task.domain.state = Box(Eigen::Vector4d(-20, -20, -5.4, -5.4), Eigen::Vector4d(20, 20, 5.4, 5.4));
  task.domain.input = Box(Eigen::Vector2d(-3, -3), Eigen::Vector2d(3, 3));
  task.domain.balls = {{{2, 3}, Eigen::Vector2d(0, 0), 5.4}};
  task.declaration.lipschitz.middleCols(2, 2) << 0.006914008, 0.005689541, 0.005689541, 0.006914008,  //
      0.092186775, 0.075860540, 0.075860540, 0.092186775;
  Eigen::VectorXd lower(6), upper(6);
  lower << -20, -20, -0.5, -0.8, -3, -3;
  upper << 20, 20, 3.5, 0.8, 3, 3;
  ObserveUniformly(task, kPointMassResidual, Box(lower, upper), count, seed);
  return task;
}

/** A query that owns its parts. */
class Query {
 public:
  Query(const Zonotope& slice, std::vector<double> input)
      : slice_(slice), input_(std::move(input)), half_width_(HalfWidths(slice_)) {}

  [[nodiscard]] QuerySet set() const { return {slice_, input_, half_width_}; }
  [[nodiscard]] ResidualBounds Of(const ResidualEnclosure& enclosure) const {
    ResidualBounds bounds;
    enclosure.Enclose(set(), bounds);
    return bounds;
  }

  /** A point of the query, input included. */
  [[nodiscard]] Eigen::VectorXd Point(Random& random) const {
    Eigen::VectorXd z(slice_.dim() + static_cast<Eigen::Index>(input_.size()));
    z.head(slice_.dim()) = slice_.CenterVector();
    for (int j = 0; j < slice_.num_generators(); ++j) {
      const double along = random.Uniform(-1, 1) * (1 - 1e-12);
      for (int k = 0; k < slice_.dim(); ++k) z[k] += along * slice_.generator(k, j);
    }
    std::copy(input_.begin(), input_.end(), z.begin() + slice_.dim());
    return z;
  }

 private:
  Zonotope slice_;
  std::vector<double> input_;
  std::vector<double> half_width_;
};

/** HandTask's box around px and vx, the rest zero. */
inline Query HandQuery(double px, double vx, double px_half_width = 0, double vx_half_width = 0) {
  return {Zonotope::FromBox(Eigen::Vector4d(px, 0, vx, 0), Eigen::Vector4d(px_half_width, 0, vx_half_width, 0)),
          {0, 0}};
}

/** A random zonotope whose hull lies in the task's domain box. */
inline Query AnyQueryIn(Random& random, const Task& task, double size) {
  const int n = task.model->num_states();
  const Box& state = task.domain.state;
  const Eigen::VectorXd reach = (state.upper() - state.lower()) / 2;
  const Eigen::VectorXd center = (state.upper() + state.lower()) / 2 + 0.6 * reach.cwiseProduct(random.Vector(n));
  const Eigen::MatrixXd generators = (size / (n + 3)) * reach.asDiagonal() * random.Matrix(n, n + 3);
  std::vector<double> input;
  for (int j = 0; j < task.model->num_inputs(); ++j) input.push_back(random.Uniform(-1, 1));
  return {Zonotope(center, generators), input};
}

}  // namespace forereach::research
