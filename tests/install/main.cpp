#include <iostream>

#include "forereach/certify/certifier.h"
#include "forereach/certify/explain.h"
#include "forereach/certify/tube.h"
#include "forereach/dynamics/models/named_models.h"

int main() {
  using namespace forereach;
  auto problem = std::make_shared<Problem>();
  problem->model = MakePointMass(0.1);  // px, py, vx, vy; ax, ay
  problem->domain.state = Box(Eigen::Vector4d(-9, -9, -3, -3), Eigen::Vector4d(9, 9, 3, 3));
  problem->domain.input = Box(Eigen::Vector2d(-1, -1), Eigen::Vector2d(1, 1));
  problem->declaration.lipschitz = Eigen::MatrixXd::Zero(4, 6);
  problem->declaration.lipschitz(2, 2) = 0.02;  // drag: vx differs, by at most 0.02 per m/s
  problem->declaration.noise_bound = Eigen::VectorXd::Zero(4);
  problem->transitions.z = Eigen::MatrixXd::Zero(1, 6);  // one observed step, from rest to rest
  problem->transitions.x_next = Eigen::MatrixXd::Zero(1, 4);
  problem->projection = Eigen::MatrixXd::Identity(2, 4);

  const Certifier certifier(problem);
  const std::vector<Obstacle> obstacles{Obstacle::Circle(Eigen::Vector2d(2, 1), 0.5)};
  const auto initial_set = Zonotope::FromBox(Eigen::Vector4d(0, 0, 1, 0), Eigen::Vector4d::Constant(0.05));
  const std::vector<double> controls(2 * 20, 0.0);  // 20 steps without force
  const Plan plan{controls.data(), 2, 20, 2};

  certifier.Require(plan, initial_set, obstacles);
  Tube tube;
  const Decision decision = certifier.Certify(plan, initial_set, obstacles, tube);
  std::cout << Explain(decision, *problem) << std::endl;
  return decision.outcome == Outcome::kCertified ? 0 : 1;
}
