/** Random bodies, bounds between samples, schedules and moving obstacles, for the problems of problems.h. */
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "forereach/certify/decision.h"
#include "forereach/certify/tube.h"
#include "tests/oracle/problems.h"

namespace forereach {

/** Any body for p safety coordinates and n states: a point, a disc, a box, several discs along a truck, or all of it.
It turns, about the given state or -1 for none, only if p >= 2. */
inline Body AnyBody(Random& random, int p, int heading) {
  const auto point = [&](double scale) {
    Eigen::Vector3d q = Eigen::Vector3d::Zero();
    q.head(p) = random.Vector(p, scale);
    return q;
  };
  const auto box = [&] {
    const Eigen::Vector3d corner = point(2);
    BodyPart part{{}, random.Coin(0.3) ? random.Uniform(0, 0.3) : 0};
    const int dims = std::min(p, 2);  // a flat box in space, so that a body of two has few points
    for (int bits = 0; bits < 1 << dims; ++bits) {
      Eigen::Vector3d q = corner;
      for (int k = 0; k < dims; ++k) q[k] *= bits >> k & 1 ? 1 : -1;
      part.points.push_back(q);
    }
    return part;
  };
  Body body{p >= 2 && random.Coin(0.8) ? heading : -1, {}};
  switch (random.Below(5)) {
    case 0: body.parts = {BodyPart{{Eigen::Vector3d::Zero()}, 0}}; break;
    case 1: body.parts = {BodyPart{{point(1.5)}, random.Uniform(0, 1.5)}}; break;
    case 2: body.parts = {box()}; break;
    case 3:
      for (int i = -1; i < random.Integer(1, 5); ++i)
        body.parts.push_back({{Eigen::Vector3d(1.2 * i, 0, 0)}, random.Uniform(0.5, 1)});
      break;
    default: body.parts = {box(), BodyPart{{point(3), point(3)}, random.Uniform(0, 0.5)}, box()};
  }
  return body;
}

/** Any bounds, some of them zero. */
inline Between AnyBetween(Random& random, int p, double period) {
  const auto bound = [&](double most) { return random.Coin(0.25) ? 0 : random.Uniform(0, most); };
  Between between;
  between.acceleration = Eigen::VectorXd::NullaryExpr(p, [&] { return bound(15); });
  between.turn_rate = bound(8);
  between.turn_acceleration = bound(20);
  between.period = period;
  return between;
}

inline Schedule AnySchedule(Random& random) {
  Schedule schedule;
  schedule.start_us = random.Coin() ? 0 : 1'700'000'000'000'000 + random.Below(1'000'000);
  schedule.step_us = random.Integer(1, 300'000);
  schedule.clock_error_us = random.Coin() ? 0 : random.Below(50'000);
  return schedule;
}

/** Any motion about the time of a plan of `steps` steps. */
inline ObstacleMotion AnyMotion(Random& random, int p, const Schedule& schedule, int steps) {
  const auto bound = [&](double most) { return random.Coin() ? 0 : random.Uniform(0, most); };
  const std::int64_t duration = steps * schedule.step_us;
  const auto about = [&] { return schedule.start_us + static_cast<std::int64_t>(random.Uniform(-1, 2) * 1e6); };
  const auto within = [&] {
    return schedule.start_us + static_cast<std::int64_t>(random.Uniform(-0.2, 1.2) * static_cast<double>(duration));
  };
  ObstacleMotion motion;
  motion.stamp_us = about();
  motion.velocity.head(p) = random.Vector(p, random.Coin(0.2) ? 0 : 20);
  motion.uncertainty = bound(0.3);
  motion.growth = bound(1);
  motion.growth_rate = bound(1);
  if (random.Coin(0.3)) motion.from_us = within();
  if (random.Coin(0.3)) motion.until_us = std::max(within(), motion.from_us);
  return motion;
}

/** An obstacle of any kind whose place can be chosen. */
inline std::function<Obstacle(const Eigen::VectorXd& place)> AnyShape(Random& random, int p) {
  switch (random.Below(p == 2 ? 4 : 2)) {
    case 0: {
      const Eigen::VectorXd half =
          random.Coin(0.2) ? Eigen::VectorXd(Eigen::VectorXd::Zero(p)) : Eigen::VectorXd(random.Vector(p).cwiseAbs());
      return [half](const Eigen::VectorXd& place) { return Obstacle::AxisBox(place - half, place + half); };
    }
    case 1: {
      const Eigen::VectorXd normal = random.Vector(p);
      return [normal](const Eigen::VectorXd& place) { return Obstacle::HalfSpace(normal, normal.dot(place)); };
    }
    case 2: {
      const double radius = random.Coin(0.2) ? 0 : random.Uniform(0, 2);
      return [radius](const Eigen::VectorXd& place) { return Obstacle::Circle(place, radius); };
    }
    default: {
      const Eigen::MatrixXd offsets = random.Matrix(p, random.Integer(3, 6), 1.5);
      return [offsets](const Eigen::VectorXd& place) {
        std::vector<Eigen::VectorXd> vertices;
        for (const auto& offset : offsets.colwise()) vertices.emplace_back(place + offset);
        return Obstacle::Polygon(vertices);
      };
    }
  }
}

/** Obstacles of one shape on a line: `away` metres from where the robot is at a sample of a tube. */
struct Approach {
  std::function<Obstacle(const Eigen::VectorXd& place)> shape;
  std::optional<ObstacleMotion> motion;
  Eigen::VectorXd place, direction;

  [[nodiscard]] Obstacle At(double away) const {
    const Obstacle obstacle = shape(place + away * direction);
    return motion ? obstacle.Moving(*motion) : obstacle;
  }
};

/** Any shape and any unit direction, seven in ten with a motion. Nothing if no direction is found. */
inline std::optional<Approach> AnyApproach(Random& random, const Problem& problem, const Tube& tube,
                                           const Schedule& schedule) {
  const int p = static_cast<int>(problem.projection.rows()), t = random.Integer(0, tube.length());
  Approach approach;
  approach.shape = AnyShape(random, p);
  if (random.Coin(0.7)) approach.motion = AnyMotion(random, p, schedule, tube.length());
  approach.place =
      problem.projection * Eigen::Map<const Eigen::VectorXd>(tube.slice(t).center().data(), tube.slice(t).dim());
  if (approach.motion) {
    const std::int64_t at = schedule.start_us + t * schedule.step_us;
    approach.place -= approach.motion->velocity.head(p) * (static_cast<double>(at - approach.motion->stamp_us) * 1e-6);
  }
  approach.direction = random.Vector(p);
  if (approach.direction.norm() < 1e-3) return std::nullopt;
  approach.direction.normalize();
  return approach;
}

/** The edge between two answers, found by halving: accepted(away) holds at the result, and not 1e-11 m before it.
Nothing if it holds nowhere up to some hundred metres. */
template <class Accepted>
std::optional<double> JustAccepted(Accepted accepted) {
  double near = 0, far = 1;
  while (far < 500 && !accepted(far)) far *= 2;
  if (far >= 500) return std::nullopt;
  for (int i = 0; i < 45; ++i) (accepted((near + far) / 2) ? far : near) = (near + far) / 2;
  return far;
}

/** How far away an obstacle has to be for the certifier to accept it, alone, from a unit of time on up to a control. */
inline std::optional<double> JustAccepted(const Certifier& certifier, const Approach& approach,
                                          const Schedule& schedule, Tube& tube, int first = 0, int kept = kMaxSteps) {
  return JustAccepted([&](double away) {
    const std::vector<Obstacle> alone{approach.At(away)};
    const Decision decision = certifier.safety().Judge(alone, schedule, tube, first);
    return decision.outcome == Outcome::kCertified || decision.step - (certifier.problem().between ? 0 : 1) >= kept;
  });
}

/** A problem of problems.h in 1, 2 or 3 safety coordinates, with a body and mostly with bounds between the samples. In
half of them the model is exact, and the tube is as narrow as X_0. */
inline std::shared_ptr<Problem> AnyWorld(Random& random, bool bicycle) {
  auto problem = AnyProblem(random, bicycle, random.Integer(1, 8));
  const int n = problem->model->num_states();
  if (random.Coin()) {
    problem->declaration.lipschitz.setZero();
    problem->declaration.noise_bound.setZero();
    for (int i = 0; i < problem->transitions.size(); ++i) {
      const Eigen::VectorXd z = problem->transitions.z.row(i);
      const auto nominal = NominalSuccessor(bicycle, {z.begin(), z.end()});
      for (int k = 0; k < n; ++k) problem->transitions.x_next(i, k) = nominal[static_cast<std::size_t>(k)].ToDouble();
    }
  }
  problem->zonotope_order = random.Integer(2, 6);
  int p = 2;
  if (random.Coin(0.4)) {
    p = random.Coin(0.2) ? 1 : 3;
    problem->projection = Eigen::MatrixXd::Identity(p, n);
  }
  problem->body = AnyBody(random, p, random.Coin(0.9) ? 2 : random.Below(n));
  if (random.Coin(0.85)) problem->between = AnyBetween(random, p, bicycle ? 0.1 : 0.15);
  return problem;
}

/** A plan for it, without obstacles. */
inline Query AnyDrive(Random& random, const Problem& problem) {
  Problem planar = problem;  // AnyQuery knows the plane only
  planar.projection = Eigen::MatrixXd::Identity(2, problem.model->num_states());
  Query query = AnyQuery(random, planar);
  query.obstacles.clear();
  if (random.Coin(0.4))
    query.initial_set = Zonotope::FromBox(query.initial_set.CenterVector(), 0 * query.initial_set.CenterVector());
  query.schedule = AnySchedule(random);
  return query;
}

}  // namespace forereach
