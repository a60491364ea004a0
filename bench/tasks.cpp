#include "bench/tasks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <random>
#include <utility>

#include "forereach/dynamics/models/kinematic_bicycle.h"
#include "forereach/dynamics/models/named_models.h"
#include "forereach/dynamics/models/point_mass.h"
#include "forereach/dynamics/models/residuals.h"

namespace forereach::bench {
namespace {

constexpr double kBicycleStep = 0.1, kWheelbase = 2.5, kPointMassStep = 0.15;
constexpr int kHorizon = 12;

// Successors are computed in extended precision and rounded once: a recorded successor is then known to its last bit.
using Wide = long double;
using Target = std::function<void(std::span<const Wide> z, std::span<Wide> next)>;

template <class Equations, class Residual>
Target Sum(Equations equations, Residual residual) {
  return [=](std::span<const Wide> z, std::span<Wide> next) {
    std::array<Wide, Equations::kStates> r;
    equations(z, next);
    residual(z, std::span<Wide>(r));
    for (std::size_t k = 0; k < r.size(); ++k) next[k] += r[k];
  };
}

// r_k(z) = 0.9 sum_l +-L_kl sin(z_l + l), other signs for every k: each partial derivative is within 0.9 of its bound.
struct Waves {
  Eigen::MatrixXd lipschitz;

  void operator()(std::span<const Wide> z, std::span<Wide> residual) const {
    std::ranges::fill(residual, Wide(0));
    for (std::size_t l = 0; l < z.size(); ++l) {
      const Wide wave = 0.9L * std::sin(z[l] + static_cast<Wide>(l));
      for (std::size_t k = 0; k < residual.size(); ++k) {
        const Wide slope = lipschitz(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(l));
        residual[k] += (k & (l + 1)) != 0 ? -slope * wave : slope * wave;
      }
    }
  }
};

double Uniform(std::mt19937_64& random, double lower, double upper) {
  return lower + (upper - lower) * (static_cast<double>(random() >> 11) * 0x1p-53);
}

Eigen::VectorXd Vec(std::initializer_list<double> entries) {
  return Eigen::Map<const Eigen::VectorXd>(entries.begin(), static_cast<Eigen::Index>(entries.size()));
}

Transitions Observed(const Target& target, const Box& region, int count, int states) {
  std::mt19937_64 random(20260701);
  Transitions data{Eigen::MatrixXd(count, region.dim()), Eigen::MatrixXd(count, states)};
  std::vector<Wide> z(static_cast<std::size_t>(region.dim())), next(static_cast<std::size_t>(states));
  for (int i = 0; i < count; ++i) {
    for (int l = 0; l < region.dim(); ++l) {
      data.z(i, l) = Uniform(random, region.lower()[l], region.upper()[l]);
      z[static_cast<std::size_t>(l)] = data.z(i, l);
    }
    target(z, next);
    for (int k = 0; k < states; ++k) data.x_next(i, k) = static_cast<double>(next[static_cast<std::size_t>(k)]);
  }
  return data;
}

Problem BareBicycle() {
  Problem problem;
  problem.method = Method::kPaper;
  problem.model = MakeKinematicBicycle(kBicycleStep, kWheelbase);
  problem.domain.state = Box(Vec({-40, -40, -M_PI, 0, -3, -0.48}), Vec({40, 40, M_PI, 25, 3, 0.48}));
  problem.domain.input = Box(Vec({-20, -2}), Vec({20, 2}));
  problem.declaration = {Eigen::MatrixXd::Zero(6, 8), Eigen::VectorXd::Zero(6)};
  problem.projection = Eigen::MatrixXd::Identity(2, 6);
  return problem;
}

Problem BarePointMass() {
  Problem problem;
  problem.method = Method::kPaper;
  problem.model = MakePointMass(kPointMassStep);
  problem.domain.state = Box(Vec({-20, -20, -5.4, -5.4}), Vec({20, 20, 5.4, 5.4}));
  problem.domain.input = Box(Vec({-3, -3}), Vec({3, 3}));
  problem.domain.balls = {{{2, 3}, Vec({0, 0}), 5.4}};
  problem.declaration = {Eigen::MatrixXd::Zero(4, 6), Eigen::VectorXd::Zero(4)};
  problem.projection = Eigen::MatrixXd::Identity(2, 4);
  return problem;
}

// The middle of group C's ranges.
Task BicycleQuestion() {
  return {nullptr,
          Vec({0, 0, 0, 12, 0, 0.32}),
          Vec({0.025, 0.025, 0.005, 0.025, 0.01, 0.002}),
          Vec({0.2, 0.02}).replicate(1, kHorizon),
          {}};
}

Task PointMassQuestion() {
  return {nullptr, Vec({0, 0, 2, 0.1}), Vec({0.05, 0.05, 0.03, 0.03}), Vec({0.1, -0.1}).replicate(1, kHorizon), {}};
}

// A residual's declaration and data.
struct Setting {
  Task task;
  Problem problem;
  Target target;
  Box region;  // of the data, over z
};

Setting Bicycle() {
  Setting setting{BicycleQuestion(), BareBicycle(),
                  Sum(KinematicBicycle{kBicycleStep, kWheelbase}, HeadingSaturation{kBicycleStep, kWheelbase}),
                  Box(Vec({-40, -40, -M_PI, 7.25, -3, 0, -20, -2}), Vec({40, 40, M_PI, 15.75, 3, 0.45, 20, 2}))};
  setting.problem.declaration.lipschitz(2, 3) = 0.017926410;
  setting.problem.declaration.lipschitz(2, 5) = 0.609638820;
  return setting;
}

Setting PointMassTask() {
  Setting setting{PointMassQuestion(), BarePointMass(), Sum(PointMass{kPointMassStep}, VelocityKnee{kPointMassStep}),
                  Box(Vec({-20, -20, -0.5, -0.8, -3, -3}), Vec({20, 20, 3.5, 0.8, 3, 3}))};
  setting.problem.declaration.lipschitz.middleCols(2, 2) << 0.006914008, 0.005689541,  //
      0.005689541, 0.006914008,                                                        //
      0.092186775, 0.075860540,                                                        //
      0.075860540, 0.092186775;
  return setting;
}

// A crossing of the data's region along any axis may change each coordinate of the residual by 0.001.
Setting Dense() {
  const Box region(Vec({-2, -4, -0.2, 7.25, -1, 0, -1, -0.1}), Vec({16, 14, 2, 15.75, 1, 0.45, 1, 0.1}));
  Setting setting{BicycleQuestion(), BareBicycle(), {}, region};
  setting.problem.declaration.lipschitz =
      0.001 * (region.upper() - region.lower()).cwiseInverse().transpose().replicate(6, 1);
  setting.target = Sum(KinematicBicycle{kBicycleStep, kWheelbase}, Waves{setting.problem.declaration.lipschitz});
  return setting;
}

Setting SettingOf(Scenario scenario) {
  switch (scenario) {
    case Scenario::kBicycle: return Bicycle();
    case Scenario::kPointMass: return PointMassTask();
    case Scenario::kDense: return Dense();
  }
  return {};
}

// The circle of radius 1 whose center is `aside` to the right of the target's center rollout at step 10.
Obstacle CircleBeside(const Setting& setting, double aside) {
  const auto n = static_cast<std::size_t>(setting.task.center.size());
  std::vector<Wide> z(n + 2), next(n);
  std::copy(setting.task.center.begin(), setting.task.center.end(), z.begin());
  Eigen::Vector2d position, before;
  for (int t = 0; t < 10; ++t) {
    before = {static_cast<double>(z[0]), static_cast<double>(z[1])};
    for (std::size_t j = 0; j < 2; ++j) z[n + j] = setting.task.controls(static_cast<Eigen::Index>(j), t);
    setting.target(z, next);
    std::copy(next.begin(), next.end(), z.begin());
    position = {static_cast<double>(z[0]), static_cast<double>(z[1])};
  }
  const Eigen::Vector2d along = (position - before).normalized();
  return Obstacle::Circle(position + aside * Eigen::Vector2d(along.y(), -along.x()), 1);
}

Task Made(Scenario scenario, int observations, double aside) {
  Setting setting = SettingOf(scenario);
  setting.problem.transitions =
      Observed(setting.target, setting.region, observations, static_cast<int>(setting.task.center.size()));
  setting.task.obstacles = {CircleBeside(setting, aside)};
  setting.task.problem = std::make_shared<const Problem>(std::move(setting.problem));
  return std::move(setting.task);
}

}  // namespace

std::string NameOf(Scenario scenario) {
  switch (scenario) {
    case Scenario::kBicycle: return "bicycle";
    case Scenario::kPointMass: return "point_mass";
    case Scenario::kDense: return "dense";
  }
  return {};
}

std::string NameOf(Scenario scenario, int observations) {
  return NameOf(scenario).append("/").append(std::to_string(observations));
}

Task MakeTask(Scenario scenario, int observations) { return Made(scenario, observations, 3.5); }

Task MakeBlockedTask(Scenario scenario, int observations) { return Made(scenario, observations, 0); }

Task MakeNominalTube(Method method) {
  Problem problem = BareBicycle();
  problem.method = method;
  const Target target = [](std::span<const Wide> z, std::span<Wide> next) {
    KinematicBicycle{kBicycleStep, kWheelbase}(z, next);
  };
  const Eigen::VectorXd center = Vec({0, 0, 0, 10, 0, 0.05}), z = Vec({0, 0, 0, 10, 0, 0.05, 0.5, 0.1});
  problem.transitions = Observed(target, Box(z, z), 1, 6);
  return {std::make_shared<const Problem>(std::move(problem)),
          center,
          Vec({0.1, 0.1, 0.02, 0.2, 0.02, 0.005}),
          Vec({0.5, 0.1}).replicate(1, kHorizon),
          {}};
}

std::vector<Eigen::MatrixXd> MakePlans(const Task& task, int count) {
  std::mt19937_64 random(1);
  std::vector<Eigen::MatrixXd> plans{task.controls};
  while (static_cast<int>(plans.size()) < count)
    plans.push_back(task.controls.unaryExpr([&](double u) { return u * Uniform(random, 0.95, 1.05); }));
  return plans;
}

Task MakeChunkTask() {
  constexpr int kSteps = 20, kPosts = 11;
  Task task = CachedTask(Scenario::kBicycle, 400);
  task.center[5] = 0.05;
  task.controls = Vec({0.2, 0.01}).replicate(1, kSteps);
  task.obstacles.clear();
  for (int i = 0; i < kPosts; ++i)
    task.obstacles.push_back(Obstacle::Circle(Vec({3.0 * i - 3, i % 2 == 0 ? -7.0 : 18.0}), 1));
  return task;
}

const Task& CachedTask(Scenario scenario, int observations) {
  static std::map<std::pair<Scenario, int>, Task> tasks;
  const auto key = std::pair(scenario, observations);
  const auto known = tasks.find(key);
  return known != tasks.end() ? known->second : tasks.emplace(key, MakeTask(scenario, observations)).first->second;
}

const Certifier& CachedCertifier(Scenario scenario, int observations) {
  static std::map<std::pair<Scenario, int>, std::unique_ptr<const Certifier>> certifiers;
  auto& certifier = certifiers[{scenario, observations}];
  if (!certifier) certifier = std::make_unique<const Certifier>(CachedTask(scenario, observations).problem);
  return *certifier;
}

}  // namespace forereach::bench
