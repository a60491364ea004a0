/** What the page of a run shows, as plain data: it knows neither logs nor HTML. */
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "records/event_log.h"
#include "records/rows.h"

namespace forereach {

/** Rows of which the last are kept, so that they do not grow with the logs. */
template <class Row>
struct PageRows : std::deque<Row> {
  std::int64_t left_out = 0;  ///< So many before them.

  void KeepLast(std::size_t most) {
    for (; this->size() > most; ++left_out) this->pop_front();
  }
};

/** Of a DecisionRow what a page shows. */
struct PageDecision {
  PageDecision(const DecisionRow& row);  // NOLINT(google-explicit-constructor): rows are what pages are made of

  std::string log_file;
  std::int64_t event_number, utime, sequence, plan_id;
  std::string source, outcome, cause, message;
  int step, coordinate, obstacle, first_observation, second_observation;
  double margin, threshold;
  float elapsed_us, latency_us;
  Digest plan_digest;  ///< Zeros for what is none, here and below.
  std::array<Digest, kGrounds.size()> grounds;
};

struct PageEvent {
  std::int64_t utime = 0, plan_id = -1;
  std::string kind;
};

struct PageGap {
  std::int64_t utime = 0, lost = 0;
  std::string reason, channel, source;
};

/** A task under which decisions were made. */
struct PageTask {
  std::string config_digest, name;          ///< Of the task file, and of the model.
  std::vector<std::string> states, inputs;  ///< Names of the coordinates.
  std::string holds;                        ///< HoldsName
  std::size_t parts = 1;                    ///< Of the body.
};

struct PageFault {
  std::int64_t utime = 0, plan_id = -1;
  std::string cause, message;
};

struct PageWithdrawal {
  std::int64_t utime = 0, plan_id = -1;
  std::string source, cause, message;
  int valid_steps = 0;
};

/** A state that the robot measured while it executed a plan, in the plane. */
struct PageState {
  int step = 0;
  double x = 0, y = 0;
};

/** What was found by certifying a recorded candidate again. */
struct PageDetail {
  std::size_t decision = 0;  ///< Index in PageRun::decisions.
  std::string missing;       ///< Why there is no tube; empty if there is one.
  int task = -1;             ///< Index in PageRun::tasks.
  std::int64_t start_utime = 0, step_us = 0;
  int steps = 0;     ///< Of the plan.
  int binding = -1;  ///< The step that decided: the first that fails, or the closest.
  int part = -1;     ///< Of the body.
  /** At the binding step, of each state: the hull of the slice, and the envelope of the residual if the step was made.
   */
  std::vector<double> hull_lower, hull_upper, envelope_lower, envelope_upper;
  /** Of each state at the binding step: the observation of the task's file that is nearest to the slice's center and
  the step's input by the row of L, and what this distance allows the residual to differ, in the state's unit. -1: its
  row is zero, or they were not looked for. */
  std::vector<int> nearest;
  std::vector<double> nearest_distance;
  std::vector<PageState> executed;
  /** The drawing (records/svg.h), empty if there is none: groups "obstacle", "tube", "path" and "bodies". What belongs
  to a unit of the tube has the class "sN". Obstacles that move do so by the drawing's clock, one unit a second. */
  std::string svg;
  Eigen::AlignedBox2d frame;  ///< What of the plane is shown, metres.
  std::size_t units = 0;      ///< Of the tube.
  bool has_body = false;      ///< More than a point.
};

/** What would have turned a decision that is no certificate (docs/advise.md). */
struct PageAdvice {
  struct Group {
    std::string heading;
    bool is_folded = false;
    std::vector<std::string> clauses = {};
  };
  std::size_t decision = 0;  ///< Index in PageRun::decisions.
  std::string missing;       ///< Why there is none; empty if there is some.
  std::vector<Group> groups;
};

/** The rows of one run among several. */
struct PagePart {
  std::string robot;  ///< As in RunLogs.
  /** By log file: the start of a command that decides again, "forereach replay run/log/a.lcmlog". */
  std::map<std::string, std::string> replays;
  std::size_t decisions = 0, events = 0, gaps = 0, faults = 0, withdrawals = 0;  ///< Numbers of rows.
};

/** One side of a page: a run, or several. */
struct PageRun {
  std::string name;
  PageRows<PageDecision> decisions;
  PageRows<PageEvent> events;
  PageRows<PageGap> gaps;
  PageRows<PageFault> faults;            ///< Without repetitions. Only logs have them.
  PageRows<PageWithdrawal> withdrawals;  ///< Likewise.
  std::vector<PageTask> tasks;
  std::vector<PageDetail> details;
  std::vector<PageAdvice> advice;
  std::vector<PagePart> parts;  ///< The rows of each run, one behind the other.
  LogDamage damage;
  std::string shadow;  ///< What a gate in shadow mode would have done, as sentences; empty if there was none.
  std::vector<std::string> notes;  ///< What is not on the page, as sentences.
};

}  // namespace forereach
