// Declarations that are too small: certificates that are false of the target, the factor with which the tubes contain
// it, and what noise on the observations does to them.
#include "research/witness.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "forereach/residual/consistency.h"
#include "forereach/residual/observations.h"
#include "research/experiment.h"
#include "research/methods/envelope.h"
#include "research/random.h"
#include "research/variants.h"

namespace forereach::research {
namespace {

constexpr int kPlans = 10, kPlansOfSmall = 40, kNoisyPlans = 10, kRollouts = 40, kBisections = 20;
constexpr double kLeastFactor = 0x1p-6, kLargestFactor = 0x1p10, kLargestNoise = 1;
constexpr int kPapersStep = 7;

Answer Decide(const System& system, const Eigen::MatrixXd& lipschitz, double sigma, const Transitions& data,
              const Scenario& scenario) {
  const Declaration declaration{lipschitz, Eigen::VectorXd::Constant(system.num_states(), sigma)};
  const auto residual = MakeForeReach({*system.model, system.domain, declaration, data, 0});
  Answer answer;
  Evaluator(system, *residual, 5).Certify(scenario, answer);
  return answer;
}

Transitions WithUniformNoise(Transitions data, double sigma) {
  Random random{0x756e69666f726d};
  for (double& entry : data.x_next.reshaped()) entry += random.Uniform(-sigma, sigma);
  return data;
}

bool IsCertified(const Answer& answer) { return answer.decision.outcome == Outcome::kCertified; }

}  // namespace

Answer Undeclared::Certify(const Scenario& scenario, double factor) const {
  return Decide(system, factor * lipschitz, 0, data, scenario);
}

Answer Undeclared::CertifyUnderNoise(const Scenario& scenario, double sigma) const {
  return Decide(system, lipschitz, sigma, WithUniformNoise(data, sigma), scenario);
}

bool Undeclared::IsContradicted(double sigma) const {
  const Declaration declaration{lipschitz, Eigen::VectorXd::Constant(system.num_states(), sigma)};
  return FindViolation(declaration, Observe(*system.model, WithUniformNoise(data, sigma))).has_value();
}

bool Undeclared::Contains(const Scenario& scenario, double factor) const {
  const Answer answer = Certify(scenario, factor);
  return answer.decision.outcome != Outcome::kFalsified &&
         Cover(answer, Rollouts(system, scenario, kRollouts)) == Membership::kInside;
}

double Undeclared::EmpiricalFactor(const Scenario& scenario) const {
  const Rollouts rollouts(system, scenario, kRollouts);
  const auto n = static_cast<std::size_t>(system.num_states());
  const auto m = static_cast<Eigen::Index>(system.num_inputs());
  std::vector<double> z(static_cast<std::size_t>(data.z.cols())), observed(n), next(n);
  double largest = 0;
  for (Eigen::Index i = 0; i < data.z.rows(); ++i) {
    std::ranges::copy(data.z.row(i), z.begin());
    system.step(z, observed, next);
    for (int j = 0; j < rollouts.count(); ++j)
      for (int t = 0; t < rollouts.horizon(); ++t) {
        Eigen::VectorXd away(data.z.cols());
        for (std::size_t l = 0; l < n; ++l)
          away[static_cast<Eigen::Index>(l)] = std::abs(rollouts.state(j, t)[l] - z[l]);
        away.tail(m) = (scenario.controls.col(t) - data.z.row(i).tail(m).transpose()).cwiseAbs();
        const Eigen::VectorXd allowed = lipschitz * away;
        for (std::size_t k = 0; k < n; ++k)
          if (const double bound = allowed[static_cast<Eigen::Index>(k)]; bound > 0)
            largest = std::max(largest, std::abs(rollouts.residual(j, t)[k] - observed[k]) / bound);
      }
  }
  return largest;
}

std::optional<ContainmentFactor> FactorForContainment(const Undeclared& task, const Scenario& scenario) {
  double low = kLeastFactor, high = kLargestFactor;
  if (task.Contains(scenario, low) || !task.Contains(scenario, high)) return std::nullopt;
  for (int i = 0; i < kBisections; ++i) {
    const double middle = std::sqrt(low * high);
    (task.Contains(scenario, middle) ? high : low) = middle;
  }
  return ContainmentFactor{high, low, task.Certify(scenario, high).IsComplete()};
}

Scenario InTheWay(const System& system, int index, int step) {
  Scenario scenario = MakeScenario(system, Group::kC, 0, index);
  scenario.obstacle = PlaceBeside(system, scenario.center, scenario.controls, step, 0, scenario.obstacle.radius);
  return scenario;
}

System NextToTheKnee(double lambda) {
  constexpr double kLargestSpeed = 0.6;  // m/s, in each direction
  System system = Escaping(lambda);
  Eigen::VectorXd low = system.quiet_region.lower(), high = system.quiet_region.upper();
  low.segment<2>(2).setConstant(-kLargestSpeed);
  high.segment<2>(2).setConstant(kLargestSpeed);
  system.quiet_region = Box(low, high);
  return system;
}

Scenario ThroughTheKnee(const System& system, int index) {
  constexpr double kSpeed = 0.4, kThrust = 1.5, kTurned = 0.25;  // m/s, m/s^2, a part of group A's v_y
  Scenario scenario = MakeScenario(system, Group::kA, 0, index);
  scenario.center[2] = kSpeed;
  scenario.center[3] *= kTurned;
  scenario.controls.row(0).setConstant(kThrust);
  scenario.controls.row(1).setZero();
  return scenario;
}

namespace {

// ---- false certificates, the factors that their declarations lack, and noise

struct Refusal {
  double sigma;
  Decision decision;
};

// The least uniform noise, declared, under which the plan is no longer certified, and how it is answered then.
std::optional<Refusal> FirstRefusal(const Undeclared& task, const Scenario& scenario) {
  double low = 0, high = kLargestNoise;
  if (IsCertified(task.CertifyUnderNoise(scenario, high))) return std::nullopt;
  for (int i = 0; i < kBisections; ++i) {
    const double middle = (low + high) / 2;
    (IsCertified(task.CertifyUnderNoise(scenario, middle)) ? low : high) = middle;
  }
  return Refusal{high, task.CertifyUnderNoise(scenario, high).decision};
}

struct Counts {
  int tried = 0, certificates = 0, noisy = 0, refused = 0, at_step = 0, contradicted = 0;
  std::vector<ContainmentFactor> factors;
  double empirical = 0;
};

// Of one plan, with each of the obstacles.
void Count(const Undeclared& task, const std::vector<Scenario>& obstacles, int noisy_plans, Counts& counts) {
  const Rollouts target(task.system, obstacles.front(), kRollouts);
  bool is_misjudged = false;
  for (const Scenario& scenario : obstacles) {
    if (target.StayClearOf(scenario.obstacle)) continue;
    ++counts.tried;
    if (!IsCertified(task.Certify(scenario))) continue;
    ++counts.certificates;
    is_misjudged = true;
    if (counts.noisy == noisy_plans) continue;
    ++counts.noisy;
    const std::optional<Refusal> refusal = FirstRefusal(task, scenario);
    if (!refusal || refusal->decision.outcome != Outcome::kSafety) continue;
    ++counts.refused;
    counts.at_step += refusal->decision.step == kPapersStep;
    counts.contradicted += task.IsContradicted(refusal->sigma);
  }
  if (!is_misjudged) return;
  if (const auto needed = FactorForContainment(task, obstacles.front())) counts.factors.push_back(*needed);
  counts.empirical = std::max(counts.empirical, task.EmpiricalFactor(obstacles.front()));
}

void AddRows(const std::string& where, const Undeclared& task, const Counts& counts, Table& table) {
  const auto row = [&](const std::string& what, double ours, int decimals) { table.Add(where + what, ours, decimals); };
  row("contradictions in the data", task.IsContradicted(), 0);
  row("false certificates, of " + std::to_string(counts.tried), counts.certificates, 0);
  if (!counts.factors.empty()) {
    const auto [least, largest] = std::ranges::minmax(counts.factors, {}, &ContainmentFactor::factor);
    row("least factor for containment", least.factor, 3);
    row("largest factor for containment", largest.factor, 3);
    row("slope between observations and the target's states", counts.empirical, 3);
  }
  if (counts.noisy == 0) return;
  const std::string of = ", of " + std::to_string(counts.noisy);
  row("S under uniform noise" + of, counts.refused, 0);
  row("S at step 7" + of, counts.at_step, 0);
  row("data that contradict it under that noise" + of, counts.contradicted, 0);
}

// ---- kept

std::vector<double> LambdasOf(const Scope& scope) {
  return scope.quick ? std::vector<double>{32} : std::vector<double>{2, 4, 8, 16, 32, 64};
}

void AddKept(double lambda, Table& table) {
  const Undeclared task{Escaping(lambda), PointMassSystem().deployed};
  const int horizon = task.system.horizon;
  double factor = 0, empirical = 0;
  int found = 0, complete = 0, wrong = 0;
  for (int index = 0; index < kPlans; ++index) {
    const Scenario scenario = InTheWay(task.system, index, horizon);
    if (const auto needed = FactorForContainment(task, scenario)) {
      factor = std::max(factor, needed->factor);
      complete += needed->is_complete;
      ++found;
    }
    empirical = std::max(empirical, task.EmpiricalFactor(scenario));
    for (int step = 1; step <= horizon; ++step) wrong += IsCertified(task.Certify(InTheWay(task.system, index, step)));
  }
  const std::string where = "lambda = " + std::to_string(static_cast<int>(lambda)) + ": ";
  const auto row = [&](const std::string& what, const Estimate& ours, int decimals) {
    table.Add(where + what, ours, decimals);
  };
  row("factor for containment", found > 0 ? Estimate(factor) : Estimate(), 3);
  row("tubes that are complete at their factor, of " + std::to_string(found), complete, 0);
  row("slope between observations and the target's states", empirical, 3);
  row("contradictions in the data", task.IsContradicted(), 0);
  row("false certificates, of " + std::to_string(kPlans * horizon), wrong, 0);
}

Table KeptTable(const Scope& scope) {
  Table table{"Kept declaration: the factor for containment",
              "The adversarial family, group C, ten plans, noiseless data from below the knee, the declaration of "
              "lambda = 1. The factor: the least on the declaration with which a plan's tube, as far as it goes, "
              "contains the target, by bisection; the largest over the plans. The slope: the largest between an "
              "observation and a state of the target over what the declaration allows. False certificates: the "
              "obstacle stands in the target's way at each of the steps 1 to 12 in turn. The paper's factor is 31.710, "
              "for a plan, data and a family that are not in its text, with one false certificate.",
              {}};
  for (const double lambda : LambdasOf(scope)) AddKept(lambda, table);
  return table;
}

// ---- through the knee

constexpr double kSmallRadius = 0.1;                      // m
constexpr double kAside[] = {-0.9, -0.45, 0, 0.45, 0.9};  // of the radius
constexpr const char* kFactorAndNoise =
    "Of the plans with a false certificate: the factor on the declaration for containment, by bisection; the largest "
    "slope between an observation and a state of the target, over what is declared. Then, for the first ten false "
    "certificates, uniform noise of the least sigma that takes the certificate away, declared. The paper has one such "
    "certificate, a factor of 31.710 and S at step 7 under noise, for a plan and data that are not in its text.";

std::vector<Scenario> Across(const System& system, Scenario scenario) {
  std::vector<Scenario> all;
  for (int step = 1; step <= system.horizon; ++step)
    for (const double aside : kAside) {
      scenario.obstacle =
          PlaceBeside(system, scenario.center, scenario.controls, step, aside * kSmallRadius, kSmallRadius);
      all.push_back(scenario);
    }
  return all;
}

Table ThroughTable(const Scope& scope) {
  Table table{"Kept declaration: plans through the knee",
              "The adversarial family under the declaration of lambda = 1, with noiseless observations from next to "
              "the knee: up to 0.6 m/s in each direction, where the knee is at 0.9 m/s. Ten plans start at 0.4 m/s and "
              "get 1.5 m/s^2, which takes them through the knee. Obstacles of 0.1 m stand at five places across the "
              "target's path at each of the steps 1 to 12; counted are those that it meets. " +
                  std::string(kFactorAndNoise),
              {}};
  for (const double lambda : LambdasOf(scope)) {
    const System system = NextToTheKnee(lambda);
    const Undeclared task{system, PointMassSystem().deployed};
    Counts counts;
    for (int index = 0; index < (scope.quick ? 2 : kPlans); ++index)
      Count(task, Across(system, ThroughTheKnee(system, index)), scope.quick ? 1 : kNoisyPlans, counts);
    AddRows("lambda = " + std::to_string(static_cast<int>(lambda)) + ": ", task, counts, table);
  }
  return table;
}

// ---- small

constexpr double kParts[] = {0.25, 0.1, 1 / 31.710, 0.01};

// Its own obstacle, and some that the target meets at the paper's step.
std::vector<Scenario> ObstaclesOf(const System& system, int index) {
  Scenario scenario = MakeScenario(system, Group::kC, 0, index);
  std::vector<Scenario> all{scenario};
  for (const double aside : {-0.8, -0.4, 0.0, 0.4, 0.8}) {
    const double radius = scenario.obstacle.radius;
    scenario.obstacle = PlaceBeside(system, scenario.center, scenario.controls, kPapersStep, aside * radius, radius);
    all.push_back(scenario);
  }
  return all;
}

void AddSmall(const System& system, double part, const Scope& scope, Table& table) {
  const Undeclared task{system, part * system.deployed};
  Counts counts;
  for (int index = 0; index < (scope.quick ? 10 : kPlansOfSmall); ++index)
    Count(task, ObstaclesOf(system, index), scope.quick ? 1 : kNoisyPlans, counts);
  const std::string where = fmt::format("{}, L times {:.4g}: ", system.name, part);
  AddRows(where, task, counts, table);
  if (counts.factors.empty()) return;
  const double largest = std::ranges::max(counts.factors, {}, &ContainmentFactor::factor).factor;
  table.Add(where + "part of the deployed matrix that lacks a factor of 31.710",
            part * largest / Paper("slopes.containment").value, 5);
}

Table SmallTable(const Scope& scope) {
  Table table{
      "Too small a declaration, plan by plan",
      "Group C, seed 0, noiseless data from below the knee, the largest N; a part of the deployed matrix is declared. "
      "Each plan has its own obstacle, and others that the target meets at step 7; counted are those it does meet. " +
          std::string(kFactorAndNoise),
      {}};
  for (const System* system : Systems())
    for (const double part : kParts) AddSmall(*system, part, scope, table);
  return table;
}

std::vector<Table> Tables(const Results& results) {
  return {KeptTable(results.scope), ThroughTable(results.scope), SmallTable(results.scope)};
}

}  // namespace

Experiment KeptDeclaration() {
  return {
      "kept", "too small a declaration, plan by plan: the factor that it lacks, false certificates, noise", {}, Tables};
}

}  // namespace forereach::research
