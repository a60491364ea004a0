#include "worlds/task_region.h"

#include <algorithm>

namespace forereach {

Box RegionOf(const Config& config) {
  const Problem& problem = *config.problem;
  if (problem.projection.rows() != 2)
    throw ConfigError("{}: has not two safety coordinates, so a map is no world of its robot", config.path);
  const Box& states = problem.domain.state;
  const Eigen::VectorXd middle = problem.projection * (states.lower() + states.upper()) / 2;
  const Eigen::VectorXd half = problem.projection.cwiseAbs() * (states.upper() - states.lower()) / 2;
  double reach = 0;
  for (const BodyPart& part : problem.body.parts)
    for (const Eigen::Vector3d& point : part.points) reach = std::max(reach, point.norm() + part.radius);
  if (problem.between)
    reach += problem.between->acceleration.norm() * problem.between->period * problem.between->period;
  return {middle - half - Eigen::VectorXd::Constant(2, reach), middle + half + Eigen::VectorXd::Constant(2, reach)};
}

}  // namespace forereach
