/** A declaration proposed from observations alone, with what it rests on. Nothing in it is proven: data can refute a
declaration and cannot establish one. */
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <stdexcept>
#include <vector>

#include "forereach/certify/problem.h"
#include "identify/noise_floor.h"
#include "identify/smallest_row.h"

namespace forereach {

struct ProposalOptions {
  double factor = 1.5;          ///< Proposed slope over the smallest consistent one, at least 1; likewise for scatter.
  bool estimate_noise = false;  ///< Raise sigma to what the data show: NoiseFloor::repeated and three deviations.
  /** Raise w^_k to `factor` times w^_k + scatter, where there is any: it acts again in every step, sigma does not. */
  bool estimate_disturbance = false;
  /** For each coordinate k: the columns of z on which its residual may depend. */
  std::vector<std::vector<int>> columns;
  /** Called twice for each coordinate, as the work goes on; may be empty. */
  std::function<void()> advance = {};
  bool find_trades = false;  ///< ProposedRow::trades
};

struct ProposedRow {
  SmallestRow smallest;  ///< With the proposed sigma and w^.
  NoiseFloor noise;
  /** The least error sigma_k + w^_k with which near places need no slope (FindScatter); with less, slopes explain what
  is none, and are steep. 0: near places show no error. */
  double knee = 0;
  double declared = 0;     ///< sigma_k, raised if that is asked for, + w^_k before it is raised.
  bool is_raised = false;  ///< sigma_k was raised, so `declared` is not what the task declares.
  double proposed = 0;     ///< Behind that.
  double scatter = 0;      ///< By how much `declared` is below the knee.
  struct Trade {
    double error = 0;                          ///< sigma_k + w^_k
    std::optional<Eigen::RowVectorXd> slopes;  ///< The smallest. None: no slopes are consistent.
  };
  static constexpr std::array kShares{0.5, 0.75, 0.9, 1.0, 1.5};
  std::vector<Trade>
      trades;  ///< With these shares of the knee as error, if there is one; and behind them with `declared`.
  Eigen::RowVectorXd least;  ///< FindSmallestEntry of each column with a slope, the others as proposed.
  /** What other estimators (slopes.h) say of the row's size, as factors of `smallest`; 0 for a row without slopes. */
  double strongin = 0, knuth_chou = 0;
};

struct ProposedDeclaration {
  Declaration declaration;  ///< L = factor * smallest, sigma and w^, rounded up to kDigits; no pair contradicts it.
  std::vector<ProposedRow> rows;
  std::vector<int> constant;  ///< Columns of z that never vary: the data say nothing about their slopes, L has zeros.

  static constexpr int kDigits = 6;
};

/** Two observations that no L explains. */
struct Unexplained : std::runtime_error {
  Unexplained(int state, const ObservedPair& found)
      : std::runtime_error("no slopes are consistent with the observations"), coordinate(state), pair(found) {}
  int coordinate;
  ObservedPair pair;
};

/** A double that is at least x and prints with kDigits digits. */
[[nodiscard]] double RoundedToPrint(double x);

/** `scales` of the columns, -1 for those that are not given or never vary: for FindSmallestRow. */
[[nodiscard]] Eigen::RowVectorXd FreeScales(const Eigen::RowVectorXd& scales, const std::vector<int>& columns);

/** The observations for Propose: what the declared errors of the records make of the residual itself is left out, since
that depends on the slopes, so the proposed ones may be larger than they have to be. */
[[nodiscard]] Observations ObserveForProposal(const Problem& problem, const Transitions& transitions);

/** @param declaration its sigma and disturbance are those of the task; its L is not read.
@throws Unexplained if no row is consistent, which a w^ that is estimated always is. Cost: n (2 + columns) linear
programs, and 6 n for the trades; the other estimators take at most 1000 observations, evenly chosen. */
[[nodiscard]] ProposedDeclaration Propose(const Declaration& declaration, const Observations& observations,
                                          const ProposalOptions& options);

}  // namespace forereach
