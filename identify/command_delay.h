/** By how many rows of a log the robot follows a command late.

For each delay d the log is imported with the input of d rows earlier, and what the model's next state is off is
compared over the same steps: the delay under which the model explains the log best is where that is least. Delays are
told apart by their likelihood under normal errors of a spread of its own for each state: d is ruled out if
    D = sum_k (log s_k(d)^2 - log s_k(best)^2) > kLeast and N / 2 D > kOdds,
s_k the root mean square of state k without its mean, for N steps that do not overlap. */
#pragma once

#include <span>
#include <vector>

#include "identify/import.h"

namespace forereach {

struct CommandDelay {
  static constexpr double kOdds = 8;                 ///< e^8, about 3000 to 1.
  static constexpr Eigen::Index kMostRows = 20'000;  ///< Of all logs, from the first on.
  static constexpr double kLeast = 0.02;  ///< One per cent of s: a smaller difference may be the model's own.

  std::vector<Eigen::VectorXd> error;  ///< s of each state, by the delay in rows: 0, 1, ...; empty if no step is known.
  double steps = 0;                    ///< N
  int best = 0;
  int least = 0, largest = 0;  ///< Of the delays that are not ruled out.

  [[nodiscard]] bool IsKnown() const { return !error.empty() && least == largest; }
};

/** @param tables of logs, with the columns that Import takes. @param most the largest delay that is tried. Cost: `most`
+ 1 imports of up to kMostRows rows. @throws as Import. */
[[nodiscard]] CommandDelay EstimateDelay(std::span<const LogTable* const> tables, const Problem& problem,
                                         ImportOptions options, int most);

}  // namespace forereach
