/** Transitions (z_i, x_i+) of a log of states and inputs.

A sample is a row of the log with a stamp t_i, a state x_i and an input u_i. The input of a row holds from its stamp
until the next row's (zero-order hold). The transition that starts at sample i is
    ((x_i, u), x_j),   t_j the stamp nearest to t_i + dt,   |t_j - t_i - dt| <= tolerance,
where u is u_i and every input of the rows i .. j - 1 lies within the input's tolerance of it; or, with `input_mean`, u
is the mean of those inputs over time. States are never interpolated, and no transition spans a row that was lost, a
stamp that does not increase, or the end of a log.

What a transition cannot know is part of its error, and the summary says how much that is: the state moves between t_j
and t_i + dt, and the true input differs from u. */
#pragma once

#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "forereach/certify/problem.h"
#include "identify/log_table.h"

namespace forereach {

struct ImportOptions {
  double period = 0;     ///< dt, s, positive.
  double tolerance = 0;  ///< Of a stamp, s, not negative and less than dt / 2.
  /** The rounding of stamps to doubles is no distance, up to this share of dt. */
  static constexpr long double kRounding = 1e-5L;
  /** The stamps are in the table's first column, and one of their units is so many seconds. Not positive: there is no
  such column, and the rows are `row_spacing` apart. */
  long double time_unit = 1;
  double row_spacing = 0;            ///< s
  std::vector<long double> factors;  ///< Of each state, then each input: model's value = factor * logged value.
  Eigen::VectorXd input_tolerance;   ///< In the model's units, not negative.
  bool input_mean = false;
  /** The robot follows a command so many samples after its row: the input of a row is that of so many samples before it
  in its piece, and no number where there is none. */
  int command_delay = 0;
  /** Every sample may start a transition. Otherwise the next one starts where the last one ended, or, behind a sample
  that starts none, at the next sample. */
  bool overlapping = false;
  /** Transitions::longer is |t_j - t_i - dt|. Otherwise there is none, and that is part of the error. */
  bool counts_durations = false;
  /** States, each with an input: its column is not read, and it holds the input of the step before. For a robot that
  obeys one step late. */
  std::vector<std::pair<int, int>> held;
  std::vector<int> unwrapped;  ///< States that are angles: 2 pi is added to x_j or subtracted until it is near x_i.
  /** Only samples at so many seconds after the first stamp of their log. */
  double from = -std::numeric_limits<double>::infinity(), until = std::numeric_limits<double>::infinity();
};

/** Why a row is no sample, or a sample starts no transition. */
enum class Dropped {
  kRowLost,         ///< The row has another number of fields than the header, or breaks the rules of CSV.
  kNoStamp,         ///< No number.
  kRepeatedRow,     ///< The same stamp as the row before, and the same values.
  kRepeatedStamp,   ///< The same stamp as another row, with other values: neither counts.
  kBackwards,       ///< The stamp is before that of the row before. A new piece of the log begins.
  kOutsideWindow,   ///< Before `from` or after `until`.
  kEnd,             ///< The log, or its piece, ends within the step.
  kGap,             ///< No stamp near t_i + dt.
  kNoState,         ///< A state at one of the two ends is no number.
  kNoInput,         ///< An input during the step is no number.
  kInputChanges,    ///< An input changes during the step by more than its tolerance.
  kOutsideDomain,   ///< z is not in the task's domain.
  kNearTheEdge,     ///< Within the declared errors of states and inputs, z may be outside the domain.
  kNoNominalValue,  ///< The nominal model has no value there, or no derivative within those errors.
  kAmbiguousAngle,  ///< An angle is more than a quarter of a turn away from the nominal model's.
  kCount
};

struct DroppedWords {
  const char *word, *line;  ///< One for programs, one line for people
  const char* remedy;       ///< What gets fewer such rows in a log; empty where none are missed
};
[[nodiscard]] const DroppedWords& WordsOf(Dropped dropped);

struct ImportedLog {
  Transitions transitions;
  std::vector<int> lines;  ///< Where the sample stands that starts each.
  int samples = 0;
  /** Rows of the file that hold something to use: without those that repeat another or lie outside the window, and with
  those that were lost. */
  std::int64_t rows = 0;
  std::int64_t rows_used = 0;  ///< Those of them that lie in a transition, its two ends included.
  double typical_spacing = 0;  ///< Median of the stamps' differences, s; 0 if there is none.
  std::vector<Finding> dropped = std::vector<Finding>(static_cast<std::size_t>(Dropped::kCount));
  double largest_offset = 0;  ///< max |t_j - t_i - dt|, s; what may be rounding of stamps to doubles counts as 0.
  double median_gap = 0;      ///< Median of |t_j - t_i - dt| over the starts dropped for kGap, s; 0 if there is none.
  double largest_gap = 0;     ///< Their largest.
  Eigen::VectorXd largest_rate;     ///< max |x_j - x_i| / dt for each state
  Eigen::VectorXd input_deviation;  ///< max |true input - u| over the rows of a step, for each input

  [[nodiscard]] Finding& At(Dropped cause) { return dropped[static_cast<std::size_t>(cause)]; }
  [[nodiscard]] const Finding& At(Dropped cause) const { return dropped[static_cast<std::size_t>(cause)]; }
};

/** Makes the transitions of one log, in the order of their starts. Cost: linear in the samples and in the rows of all
steps.
@param table columns: the stamp, unless there is none, the states, the inputs. @param problem its model and domain.
@throws ConfigError if the log's rows are typically further apart than 1.1 dt and the tolerance; the message names both,
or the stamps that go back. */
[[nodiscard]] ImportedLog Import(const LogTable& table, const Problem& problem, const ImportOptions& options);

}  // namespace forereach
