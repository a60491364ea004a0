// Prints every bit of the decisions and tubes of some plans, for two models of the library and for one of the user's
// own. Whatever it is compiled with, by whatever compiler and for whatever machine, it prints the same.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <memory>
#include <vector>

#include "forereach/certify/certifier.h"
#include "forereach/certify/tube.h"
#include "forereach/dynamics/equations_model.h"
#include "forereach/dynamics/models/named_models.h"
#include "own_model.h"

using namespace forereach;

namespace {

// The same numbers everywhere: the standard library's distributions are not.
class Random {
 public:
  double Uniform(double lower, double upper) {
    state_ = state_ * 6364136223846793005u + 1442695040888963407u;
    const volatile double part = (upper - lower) * (static_cast<double>(state_ >> 44) * 0x1p-20);  // not fused
    return lower + part;
  }

 private:
  std::uint64_t state_ = 20260701;
};

struct Task {
  std::shared_ptr<const NominalModel> model;
  std::vector<double> state, input, center, width;  // domain |x| <= state, |u| <= input; X_0
};

// Successors are rounded to 2^-20, so that the last bit of the C library's functions does not matter in them.
Transitions Observe(const Task& task, int count, Random& random) {
  const auto n = static_cast<int>(task.state.size()), variables = n + static_cast<int>(task.input.size());
  Transitions data{Eigen::MatrixXd(count, variables), Eigen::MatrixXd(count, n)};
  std::vector<double> z(static_cast<std::size_t>(variables)), next(task.state.size());
  for (int i = 0; i < count; ++i) {
    for (int l = 0; l < variables; ++l) {
      const auto at = static_cast<std::size_t>(l);
      const double bound = l < n ? task.state[at] : task.input[at - task.state.size()];
      data.z(i, l) = z[at] = random.Uniform(-0.5, 0.5) * bound;
    }
    task.model->Evaluate(z, next);
    for (int k = 0; k < n; ++k) data.x_next(i, k) = std::floor(next[static_cast<std::size_t>(k)] * 0x1p20) * 0x1p-20;
  }
  return data;
}

std::shared_ptr<Problem> MakeProblem(const Task& task, Method method, int observations, Random& random) {
  const auto vector = [](const std::vector<double>& v) -> Eigen::VectorXd {
    return Eigen::Map<const Eigen::VectorXd>(v.data(), static_cast<Eigen::Index>(v.size()));
  };
  const auto n = static_cast<Eigen::Index>(task.state.size()), u = static_cast<Eigen::Index>(task.input.size());
  auto problem = std::make_shared<Problem>();
  problem->model = task.model;
  problem->method = method;
  problem->domain.state = Box(-vector(task.state), vector(task.state));
  problem->domain.input = Box(-vector(task.input), vector(task.input));
  problem->declaration.lipschitz = Eigen::MatrixXd::Zero(n, n + u);
  problem->declaration.lipschitz(2, 2) = 0.02;
  problem->declaration.lipschitz(2, 3) = 0.01;
  problem->declaration.lipschitz(3, 3) = 0.02;
  problem->declaration.noise_bound = Eigen::VectorXd::Constant(n, 0x1p-19);
  problem->transitions = Observe(task, observations, random);
  problem->projection = Eigen::MatrixXd::Identity(2, n);
  return problem;
}

void Print(const Decision& decision, const Tube& tube) {
  std::printf("%d %d %d %d %d %d %a %a\n", static_cast<int>(decision.outcome), static_cast<int>(decision.cause),
              decision.step, decision.coordinate, decision.obstacle, decision.closest_step, decision.margin,
              decision.threshold);
  for (int t = 0; t <= tube.length(); ++t)
    for (int k = 0; k < tube.slice(t).dim(); ++k) {
      std::printf("%a %a %a %a", tube.slice(t).center(k), tube.slice(t).slack(k),
                  tube.half_width(t)[static_cast<std::size_t>(k)], tube.slice(t).HalfWidthUpper(k));
      for (const double g : tube.slice(t).row(k)) std::printf(" %a", g);
      std::printf("\n");
    }
}

void Certify(const Task& task, Method method, int plans, Random& random) {
  const auto problem = MakeProblem(task, method, 60, random);
  const Certifier certifier(problem);
  const std::vector<Obstacle> obstacles{
      Obstacle::Circle(Eigen::Vector2d(4, 2.5), 0.5),
      Obstacle::AxisBox(Eigen::Vector2d(-6, -6), Eigen::Vector2d(-5, 6)),
      Obstacle::Polygon({Eigen::Vector2d(6, -3), Eigen::Vector2d(7, -3), Eigen::Vector2d(6.5, -2)}),
      Obstacle::HalfSpace(Eigen::Vector2d(0, 1), 14)};
  const auto n = static_cast<Eigen::Index>(task.state.size());
  Tube tube;
  for (int p = 0; p < plans; ++p) {
    const Zonotope initial_set = Zonotope::FromBox(Eigen::Map<const Eigen::VectorXd>(task.center.data(), n),
                                                   Eigen::Map<const Eigen::VectorXd>(task.width.data(), n));
    std::vector<double> controls;
    for (int t = 0; t < 12; ++t)
      for (const double bound : task.input) controls.push_back(random.Uniform(-0.6, 0.6) * bound);
    const auto inputs = static_cast<int>(task.input.size());
    const Plan plan{controls.data(), inputs, 12, inputs};
    certifier.Require(plan, initial_set, obstacles);
    Print(certifier.Certify(plan, initial_set, obstacles, tube), tube);
  }
}

}  // namespace

int main() try {
  Random random;
  const Task bicycle{MakeKinematicBicycle(0.1, 2.5),
                     {40, 40, 3, 25, 3, 0.48},
                     {8, 0.4},
                     {0, 0, 0.25, 6, 0.1, 0.05},
                     {0.03, 0.03, 0.01, 0.05, 0.01, 0.004}};
  const Task point_mass{MakePointMass(0.15), {20, 20, 6, 6}, {3, 3}, {0, 0, 2, 0.1}, {0.05, 0.05, 0.03, 0.03}};
  const Task own{std::make_shared<EquationsModel<Unicycle>>(Unicycle{0.1, 0.05, 1.5}),
                 {40, 40, 3, 9, 0.5},
                 {2, 0.8},
                 {0, 0, 0.5, 4, 0.05},
                 {0.04, 0.04, 0.01, 0.03, 0.01}};
  for (const Method method : {Method::kCentred, Method::kPaper}) {
    Certify(bicycle, method, 7, random);
    Certify(point_mass, method, 4, random);
    Certify(own, method, 9, random);
  }
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 3;
}
