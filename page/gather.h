/** Gathers what a page shows, from event logs and decision databases. */
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "page/page_data.h"
#include "records/kept_obstacles.h"
#include "records/log_tasks.h"
#include "records/log_trust.h"
#include "records/recorded_case.h"
#include "records/run_logs.h"

namespace forereach {

/** Bounds on one page, so that it does not grow with the logs. */
struct PageBounds {
  /** Of the rows the last ones by time; of gaps, faults and withdrawals so many each. */
  std::size_t decisions = 60'000, events = 200'000, others = 20'000;
  /** Drawn are the last certified plans, and the last abstentions. */
  std::size_t certified = 2000, abstained = 2000;
  /** Of all drawings, before they are packed. */
  std::size_t bytes = 60'000'000;
};

/** What the command line says of the tasks of all runs. */
struct PageTasks {
  std::string config;  ///< The task file; empty: the tasks that the logger kept next to the logs.
  LogKey key;
  RunTasks of_run;
};

/** The last decisions of a timeline whose tubes a page may have, and the states in which the robot executed them. */
class LastCases final : public TimelineUser {
 public:
  struct Entry {
    RecordedCase recorded;
    std::vector<PageState> executed;
    std::set<int> steps;  ///< That have a state.
  };

  explicit LastCases(const PageBounds& bounds) : bounds_(bounds) {}

  void OnStart(const Config& task) override;
  void OnEvent(const LogEvent& event) override;
  void OnDecision(const RecordedDecision& recorded) override;

  /** In the order of the log. */
  [[nodiscard]] std::map<std::int64_t, Entry>& entries() { return entries_; }

 private:
  const PageBounds bounds_;
  BusOptions channels_;
  std::int64_t next_ = 0;
  std::map<std::int64_t, Entry> entries_;
  std::deque<std::int64_t> certified_, abstained_;  // their places
  KeptObstacles obstacles_;                         // theirs, while the logs are read
  std::map<std::int64_t, std::int64_t> executing_;  // by plan
};

/** What one pass over the logs of a run leaves. */
struct PagePass {
  explicit PagePass(const PageBounds& bounds) : cases(bounds) {}

  PageRun rows{};
  LastCases cases;
  std::vector<TimelineUser*> others{};                 ///< Who else is told of the run; set before the pass.
  std::vector<std::shared_ptr<const Config>> tasks{};  ///< Of the cases.
};

/** Reads the rows of one run, without drawings, and its cases. Rows of a database need no log; faults and withdrawals
come from the logs beside it, and what keeps these from being read is a note. Cost: the logs are read once.
@param threads that certify a shadow's plans again.
@throws BadInput if a run without a database cannot be read. */
void ReadPass(const RunLogs& run, const PageTasks& tasks, const PageBounds& bounds, unsigned threads, PagePass& pass);

/** Forgets what a page of all these runs has no room for. @param passes may be null. */
void KeepLast(const std::vector<PagePass*>& passes, const PageBounds& bounds);

/** Puts the rows of one run behind those of others. */
void AddRows(PageRun& page, PageRun&& run);

/** The tubes of some decisions of a run.
@param pass of which cases that are drawn are forgotten. @param decisions their places in `page`.
@param threads that it may use. @return only details and tasks. */
[[nodiscard]] PageRun GatherDetails(PagePass& pass, const PageRun& page, const std::vector<std::size_t>& decisions,
                                    std::size_t bytes, unsigned threads);

/** Puts the tubes of one run into a page, as far as there is room. @param bytes for which there is room. */
void AddDetails(PageRun& page, PageRun&& details, std::size_t& bytes);

/** The decisions whose tubes a page has: of each part their places, the last ones by time. */
[[nodiscard]] std::vector<std::vector<std::size_t>> ChooseDetails(const PageRun& page, const PageBounds& bounds);

/** The last decisions by time that are no certificates, likewise. @param most how many of the whole page. */
[[nodiscard]] std::vector<std::vector<std::size_t>> ChooseAdvised(const PageRun& page, std::size_t most);

/** Names the event of a decision as a Timeline does that names files. */
[[nodiscard]] std::string EventNameOf(const PageDecision& decision);

/** When the last `most` of these times begin; the least number if there are no more. */
[[nodiscard]] std::int64_t BeginOfLast(std::vector<std::int64_t> times, std::size_t most);

/** A set of obstacles and the time of the decision under it. */
using DatedSet = std::pair<std::int64_t, std::shared_ptr<const std::vector<Obstacle>>>;
/** When the last of these sets begin that have room together, as KeptObstacles counts them; the least number if all
have. Cost O(n log n), and the obstacles of each set once. */
[[nodiscard]] std::int64_t BeginOfKept(std::vector<DatedSet> sets, std::size_t most = KeptObstacles::kMost);

/** Notes what could not be read. */
void AddMissing(PageRun& page, const NamedRuns& named);

/** The page's name and inputs, before rows are added. */
[[nodiscard]] PageRun EmptyPage(const std::vector<std::string>& inputs);

}  // namespace forereach
