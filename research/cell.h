/** The unit of work: all plans of one system and seed, under one method, declaration and data set. */
#pragma once

#include <array>
#include <functional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "research/membership.h"
#include "research/methods/method.h"
#include "research/scenarios.h"

namespace forereach::research {

/** A declared L with its name in tables. The valid ones bound the slopes of r*. */
struct NamedLipschitz {
  std::string name;  ///< "deployed", ...: letters, digits, '.', '-' and '_'
  Eigen::MatrixXd matrix;
};

struct Cell {
  const System* system = nullptr;
  Method method;
  NamedLipschitz declared;
  int observations = 0;  ///< N
  double noise = 0;      ///< s; sigma_k = NoiseBound(s, cut)
  int seed = 0;          ///< From 0
  int zonotope_order = 5;
  Layout layout = Layout::kCorridor;
  double cut = kNoiseCut;  ///< Another cut needs another name of the declaration: the key has only that.

  /** What it is, in one word that is a file name: "bicycle-ForeReach-deployed-N400-s0-order5-corridor-seed0". */
  [[nodiscard]] std::string key() const;
};

/** ForeReach as the paper runs it: the deployed matrix, order 5, data in the corridor. */
[[nodiscard]] Cell PaperCell(const System& system, int observations, double noise, int seed);

/** How much is done in each cell. */
struct Effort {
  int scenarios, rollouts;  ///< At most so many as the system's own
};

/** CP-SLS-MPC's budget summed over the steps of each plan in turn whose query is known. */
struct PlanBudgets {
  std::vector<double> drift, tube, total;  ///< -1 for all three where a step is starved
  std::vector<double> least_mass;          ///< min_k sum_i w_i
  std::vector<double> at_cap;              ///< Part of the weights whose d_TV is at its cap, mean over the steps
  std::vector<int> complete;               ///< 1 where all steps are in the sum
};

/** What came of the plans of one group. */
struct Tally {
  char group = 'A';
  int plans = 0;
  int safe = 0;                                              ///< Target-safe: no rollout touches the obstacle
  int certified = 0, falsified = 0, domain = 0, safety = 0;  ///< Add up to plans, with vacuous
  int vacuous = 0;  ///< Nothing else is in the way, but the method's own budget leaves no probability: CP-SLS-MPC
  int certified_safe = 0;
  int covered = 0;         ///< Of the complete tubes, certified + safety
  int prefix_covered = 0;  ///< Of the tubes that D ended
  int undecided = 0;       ///< Tubes that count as not covered because membership could not be decided
  std::vector<int> domain_steps, safety_steps;  ///< By step, 0..T
  std::vector<double> areas;      ///< Of P X_T of each plan in turn, m^2; -1 where the tube is not complete
  std::string answers;            ///< Of each plan in turn: C for a certificate, D, S, F, or V for a vacuous budget
  std::vector<double> distances;  ///< d of each plan in turn (chunks/support.h), where the system has a scale for it
  PlanBudgets budgets;            ///< CP-SLS-MPC's

  [[nodiscard]] int complete() const { return certified + safety + vacuous; }
  [[nodiscard]] int false_certificates() const { return certified - certified_safe; }
};

/** In the order of kGroups. */
using CellResult = std::array<Tally, 3>;

/** What came of one plan. */
struct PlanOutcome {
  char group = 'A';
  int plan = 0;
  char answer = 'S';  ///< As in Tally::answers
  int step = -1;      ///< At which D or S was decided; else -1
  bool safe = false, complete = false;
  Membership cover = Membership::kInside;  ///< Of the tube, as far as it goes; undecided for F
  double area = -1;                        ///< As in Tally::areas
};

/** Runs the pairwise test once, if the method is ForeReach: a violation makes every plan F. Then each plan in
turn, each shown to `see` if there is one. Deterministic. Cost: for each plan its rollouts and one certify call, some
0.3 ms for the bicycle. */
[[nodiscard]] CellResult RunCell(const Cell& cell, const Effort& effort,
                                 const std::function<void(const PlanOutcome&)>& see = {});

}  // namespace forereach::research
