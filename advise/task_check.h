/** An examination of one task: what in it keeps plans from being certified, and what its numbers lead to. */
#pragma once

#include <string>
#include <vector>

#include "advise/hypotheses.h"
#include "records/picture.h"

namespace forereach {

struct TaskCheckOptions {
  std::string config;
  std::string plan;  ///< A plan's CSV file. Empty: the inputs closest to zero.
  int steps = 0;     ///< Of the plan without a file, 1 to kMaxSteps. 0: as many as the planner's plans have at most.
};

/** One thing to change. */
struct TaskFinding {
  std::string place;   ///< "file:line: key: "
  std::string what;    ///< Value and bound.
  std::string advice;  ///< What to do.
  /** A remark: it may cost width or time, and keeps nothing from being certified. */
  bool is_remark = false;
};

struct TaskCheck {
  /** A coordinate's domain and data. */
  struct Coordinate {
    std::string name;
    double lower = 0, upper = 0;    ///< The domain.
    double least = 0, largest = 0;  ///< The data; all of them, also those outside the domain.
    bool matters = false;           ///< The declaration lets the residual depend on it.
  };
  /** The largest share that two transitions use of the difference of residuals that is declared; above 1: they
  contradict the declaration. */
  struct Row {
    std::string name;
    bool is_declared = false;  ///< Otherwise nothing may differ but for rounding, and `used` says nothing.
    double used = 0;
    int first = 0, second = 0;  ///< Lines of the data file.
  };

  std::vector<TaskFinding> findings;  ///< Remarks included.
  std::string data;                   ///< The transitions' file.
  int transitions = 0;                ///< In it; 0 if there is none.
  std::vector<Coordinate> coordinates;
  std::vector<Row> rows;
  bool all_pairs = true;  ///< False: `rows` is of a sample of the transitions.

  std::vector<Hypothesis> rests_on;  ///< Of a certificate of this task.
  std::vector<std::string> states;
  double period = 0;                             ///< s
  int planned_steps = 0;                         ///< Of the plan.
  std::vector<std::vector<double>> half_widths;  ///< Of the slices 0, 1, ... without obstacles, for each state.
  std::string tube;                              ///< The decision without obstacles; empty if there could be none.
  Picture picture;
  bool is_planar = false;  ///< The picture shows something.

  /** Whether some finding is no remark. */
  [[nodiscard]] bool HasFindings() const;
};

/** Examines a task. Cost: one tube, and all pairs of at most 1500 transitions.
@throws ConfigError if the task, its transitions (other than that there is no such file, or that some lie outside the
domain) or the plan cannot be read. */
[[nodiscard]] TaskCheck CheckTask(const TaskCheckOptions& options);

}  // namespace forereach
