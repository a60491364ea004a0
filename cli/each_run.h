/** Commands that go through many runs: on all cores, with a progress bar. */
#pragma once

#include <algorithm>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <fmt/core.h>

#include "cli/commands.h"
#include "command_line/progress.h"
#include "forereach/numerics/parallel.h"
#include "lcmtypes/bad_input.h"
#include "records/log_trust.h"
#include "records/output_file.h"
#include "records/run_logs.h"

namespace forereach {

/** --key and --no-key. */
inline void AddKeyOptions(std::vector<Option>& options, LogKey& key) {
  options.push_back({"--key", &key.file, "PATH",
                     "Directory of keys, verify.pub or any key file: messages of a log that its roles did not sign are "
                     "passed over; by default the task file's bus.key"});
  options.push_back(Excluding("--key", {"--no-key", &key.none, "", "Believe every message of a log, whoever sent it"}));
}

/** What the work on one run is given. */
class RunWork final {
 public:
  RunWork(unsigned most, Progress& progress) : threads(most), progress_(progress) {}

  /** Tells that these bytes of its logs were read. Not necessary. */
  void Read(std::int64_t bytes) {
    for (pending_ += bytes; pending_ >= kUnit; pending_ -= kUnit, ++told_) progress_.Advance();
  }
  /** The run is finished. */
  void Finish(std::size_t units) {
    if (units > told_) progress_.Advance(units - told_);
  }

  static constexpr std::int64_t kUnit = 1 << 20;
  static std::size_t UnitsOf(const RunLogs& run) { return static_cast<std::size_t>(BytesOf(run) / kUnit + 1); }

  const unsigned threads;  ///< That it may use.

 private:
  Progress& progress_;
  std::int64_t pending_ = 0;
  std::size_t told_ = 0;
};

/** Calls one(run, work) for each run, on `jobs` threads in all, and returns the results in the order of the
runs. A run that cannot be read has none: its reason is added to `named.missing` if several runs were named, and is
thrown otherwise. An error of the output ends everything.
@tparam One Result(const RunLogs&, RunWork&).
@param done what is done with the logs, for the progress bar: "replayed". @throws BadInput. */
template <class Result, class One>
std::vector<std::optional<Result>> ForEachRun(NamedRuns& named, unsigned jobs, const std::string& done,
                                              const One& one) {
  const std::size_t count = named.runs.size();
  std::vector<std::optional<Result>> results(count);
  std::vector<std::string> reasons(count);
  const auto threads = static_cast<unsigned>(std::max<std::size_t>(jobs / std::max<std::size_t>(count, 1), 1));
  std::size_t units = 0;
  for (const RunLogs& run : named.runs) units += RunWork::UnitsOf(run);
  Progress progress(fmt::format("MB of logs {}", done), units);
  const auto make = [&](const RunLogs& run) -> Result {
    RunWork work(threads, progress);
    Result result = one(run, work);
    work.Finish(RunWork::UnitsOf(run));
    return result;
  };
  ForEachInParallel(count, jobs, [&](std::size_t i, std::size_t) {
    try {
      results[i] = make(named.runs[i]);
    } catch (const OutputError&) {
      throw;
    } catch (const BadInput& error) {
      if (!named.is_many) throw;
      reasons[i] = error.what();
    } catch (const std::invalid_argument& error) {  // a task that no certifier accepts
      if (!named.is_many) throw;
      reasons[i] = fmt::format("{}: {}", NameOf(named.runs[i]), error.what());
    }
  });
  for (std::string& reason : reasons)
    if (!reason.empty()) named.missing.push_back(std::move(reason));
  return results;
}

}  // namespace forereach
