#include "certifier/gate/obstacle_message.h"

#include <stdexcept>
#include <string>

#include "certifier/numerics/size.h"

namespace forereach {
namespace {

Eigen::VectorXd Point(const obstacle_t& message, int index) {
  return Eigen::Map<const Eigen::VectorXd>(message.point[index], message.dimension);
}

void RequirePoints(const obstacle_t& message, int count) {
  if (message.num_points != count)
    throw std::invalid_argument(std::to_string(message.num_points) + " points, must be " + std::to_string(count));
}

Obstacle FromMessage(const obstacle_t& message) {
  if (message.dimension < 1 || message.dimension > kMaxSafetyDim || message.num_points < 1 ||
      message.num_points > kMaxObstaclePoints)
    throw std::invalid_argument(std::to_string(message.num_points) + " points of dimension " +
                                std::to_string(message.dimension));
  switch (message.kind) {
    case obstacle_t::CIRCLE: RequirePoints(message, 1); return Obstacle::Circle(Point(message, 0), message.value);
    case obstacle_t::BOX: RequirePoints(message, 2); return Obstacle::AxisBox(Point(message, 0), Point(message, 1));
    case obstacle_t::POLYGON: {
      std::vector<Eigen::VectorXd> vertices;
      vertices.reserve(ToSize(message.num_points));
      for (int i = 0; i < message.num_points; ++i) vertices.push_back(Point(message, i));
      return Obstacle::Polygon(vertices);
    }
    case obstacle_t::HALF_SPACE:
      RequirePoints(message, 1);
      return Obstacle::HalfSpace(Point(message, 0), message.value);
    default: throw std::invalid_argument("unknown kind " + std::to_string(message.kind));
  }
}

}  // namespace

std::vector<Obstacle> FromMessage(const obstacles_t& message, int dim) {
  if (message.num_obstacles < 0 || message.num_obstacles > kMaxObstacles)
    throw std::invalid_argument("obstacles: " + std::to_string(message.num_obstacles) + ", must be 0 to " +
                                std::to_string(kMaxObstacles));
  std::vector<Obstacle> obstacles;
  for (int i = 0; i < message.num_obstacles; ++i) {
    const std::string which = "obstacle " + std::to_string(i) + ": ";
    try {
      obstacles.push_back(FromMessage(message.obstacle[i]));
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument(which + error.what());
    }
    if (obstacles.back().dim() != dim)
      throw std::invalid_argument(which + "dimension " + std::to_string(obstacles.back().dim()) + ", must be " +
                                  std::to_string(dim));
  }
  return obstacles;
}

obstacles_t ToMessage(const std::vector<Obstacle>& obstacles) {
  obstacles_t message{};
  message.num_obstacles = static_cast<std::int16_t>(obstacles.size());
  for (std::size_t i = 0; i < obstacles.size(); ++i) {
    obstacle_t& to = message.obstacle[i];
    const Obstacle& from = obstacles[i];
    to.kind = static_cast<std::int16_t>(from.kind());
    to.dimension = static_cast<std::int16_t>(from.dim());
    to.num_points = static_cast<std::int16_t>(from.points().size());
    to.value = from.kind() == Obstacle::Kind::kHalfSpace ? from.offset() : from.radius();
    for (std::size_t p = 0; p < from.points().size(); ++p)
      for (Eigen::Index k = 0; k < from.points()[p].size(); ++k) to.point[p][k] = from.points()[p][k];
  }
  return message;
}

}  // namespace forereach
