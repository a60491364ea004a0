#include "bench/text_models.h"

#include <map>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "forereach/dynamics/text_model.h"

namespace forereach::bench {
namespace {

using Integrator = ModelText::Integrator;

std::vector<double> Successor(const NominalModel& model, const Eigen::VectorXd& z) {
  std::vector<double> next(static_cast<std::size_t>(model.num_states()));
  model.Evaluate({z.data(), static_cast<std::size_t>(z.size())}, next);
  return next;
}

ModelText TextOf(std::string name, const std::vector<std::string>& states, const std::vector<std::string>& inputs,
                 const std::map<std::string, double>& parameters, const std::vector<std::string>& equations,
                 Integrator integrator) {
  ModelText text;
  text.name = std::move(name);
  text.integrator = integrator;
  for (const std::string& state : states) text.states.push_back({state, ""});
  for (const std::string& input : inputs) text.inputs.push_back({input, ""});
  for (const auto& [parameter, value] : parameters) text.parameters.push_back({parameter, value, value});
  for (const std::string& equation : equations) text.equations.push_back({equation});
  return text;
}

}  // namespace

ModelText BicycleText(Integrator integrator) {
  const std::vector<std::string> next{"x + dt * (v * cos(theta))",
                                      "y + dt * (v * sin(theta))",
                                      "theta + dt / wheelbase * (v * tan(delta))",
                                      "v + dt * a",
                                      "a + dt * jerk",
                                      "delta + dt * steer_rate"};
  const std::vector<std::string> rate{"v * cos(theta)", "v * sin(theta)", "v * tan(delta) / wheelbase", "a",
                                      "jerk",           "steer_rate"};
  return TextOf("bicycle_text", {"x", "y", "theta", "v", "a", "delta"}, {"jerk", "steer_rate"},
                {{"dt", 0.1}, {"wheelbase", 2.5}}, integrator == Integrator::kNone ? next : rate, integrator);
}

ModelText BicycleMidpointText() {
  ModelText text = BicycleText(Integrator::kNone);
  for (const auto& [name, value] : {std::pair{"v_half", "v + dt/2 * a"},
                                    {"theta_half", "theta + dt/2 * (v * tan(delta) / wheelbase)"},
                                    {"a_half", "a + dt/2 * jerk"},
                                    {"delta_half", "delta + dt/2 * steer_rate"}})
    text.definitions.push_back({name, {value}});
  text.equations = {{"x + dt * (v_half * cos(theta_half))"},
                    {"y + dt * (v_half * sin(theta_half))"},
                    {"theta + dt * (v_half * tan(delta_half) / wheelbase)"},
                    {"v + dt * a_half"},
                    {"a + dt * jerk"},
                    {"delta + dt * steer_rate"}};
  return text;
}

Task MakeBicycleTextTask(const ModelText& text, int observations) {
  Task task = CachedTask(Scenario::kBicycle, observations);
  Problem problem = *task.problem;
  problem.model = MakeTextModel(text);
  if (text !=
      BicycleText(Integrator::kNone))  // other successors: those of this model and the same residual, which is zero
    for (Eigen::Index i = 0; i < problem.transitions.z.rows(); ++i) {
      const Eigen::VectorXd z = problem.transitions.z.row(i);
      const std::vector<double> next = Successor(*problem.model, z), before = Successor(*task.problem->model, z);
      for (Eigen::Index k = 0; k < 6; ++k)
        problem.transitions.x_next(i, k) += next[static_cast<std::size_t>(k)] - before[static_cast<std::size_t>(k)];
    }
  task.problem = std::make_shared<const Problem>(std::move(problem));
  return task;
}

Task MakeQuadrotorTask() {
  constexpr double kHover = 0.775 * 9.81;
  ModelText text =
      TextOf("quadrotor", {"x", "y", "z", "roll", "pitch", "yaw", "vx", "vy", "vz", "p", "q", "r"},
             {"thrust", "mx", "my", "mz"},
             {{"dt", 0.05}, {"mass", 0.775}, {"ix", 0.0015}, {"iy", 0.0025}, {"iz", 0.0035}, {"g", 9.81}},
             {"vx", "vy", "vz", "p + sr*tan(pitch)*q + cr*tan(pitch)*r", "cr*q - sr*r", "(sr*q + cr*r)/cp",
              "lift*(cr*sp*cos(yaw) + sr*sin(yaw))", "lift*(cr*sp*sin(yaw) - sr*cos(yaw))", "lift*cr*cp - g",
              "(mx + (iy - iz)*q*r)/ix", "(my + (iz - ix)*p*r)/iy", "(mz + (ix - iy)*p*q)/iz"},
             Integrator::kRk4);
  for (const auto& [name, value] : {std::pair{"sr", "sin(roll)"},
                                    {"cr", "cos(roll)"},
                                    {"sp", "sin(pitch)"},
                                    {"cp", "cos(pitch)"},
                                    {"lift", "thrust/mass"}})
    text.definitions.push_back({name, {value}});

  Problem problem;
  problem.model = MakeTextModel(text);
  Eigen::VectorXd state(12), input(4);
  state << 20, 20, 20, 1, 1, 4, 10, 10, 10, 10, 10, 10;
  input << 2 * kHover, 0.1, 0.1, 0.1;
  problem.domain.state = Box(-state, state);
  problem.domain.input = Box(-input, input);
  problem.declaration = {Eigen::MatrixXd::Zero(12, 16), Eigen::VectorXd::Constant(12, 1e-4)};
  for (int k = 6; k < 9; ++k) problem.declaration.lipschitz(k, k) = 0.01;  // drag
  problem.projection = Eigen::MatrixXd::Identity(3, 12);
  std::mt19937_64 random(20);
  const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1p-52 - 1; };
  problem.transitions = {Eigen::MatrixXd(100, 16), Eigen::MatrixXd(100, 12)};
  for (int i = 0; i < 100; ++i) {
    Eigen::VectorXd z(16);
    z << state * 0.1, input * 0.1;
    for (double& coordinate : z) coordinate *= uniform();
    z[12] = kHover;
    const std::vector<double> next = Successor(*problem.model, z);
    problem.transitions.z.row(i) = z.transpose();
    problem.transitions.x_next.row(i) = Eigen::Map<const Eigen::RowVectorXd>(next.data(), 12);
  }

  Task task;
  task.center = Eigen::VectorXd::Zero(12);
  task.half_width = Eigen::VectorXd::Constant(12, 0.01);
  task.controls = Eigen::MatrixXd::Zero(4, 20);
  for (int t = 0; t < 20; ++t) task.controls.col(t) << kHover, 1e-4 * (t % 2), -1e-4 * (t % 3), 1e-5;
  task.obstacles = {Obstacle::AxisBox(Eigen::Vector3d(4, -1, -1), Eigen::Vector3d(5, 1, 1))};
  task.problem = std::make_shared<const Problem>(std::move(problem));
  return task;
}

}  // namespace forereach::bench
