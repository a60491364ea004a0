/** Commands over the cases of runs, divided among shards (records/shard.h): each writes a file, and `forereach merge`
makes of all of them what the command prints without --shard. */
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "command_line/command_line.h"
#include "records/log_trust.h"
#include "records/result.h"
#include "records/run_logs.h"
#include "records/shard.h"

namespace forereach {

/** --shard and --out. */
struct ShardOptions {
  std::string shard, out;

  void AddTo(std::vector<Option>& options);
  [[nodiscard]] bool is_given() const { return !shard.empty(); }
  /** All cases without --shard. @throws BadInput if it is not I/N, or if the file cannot be replaced. */
  [[nodiscard]] Shard Get() const;
};

/** A command whose results can be merged. */
struct ShardedCommand {
  std::string name;     ///< replay, compare, verify, advise or export
  std::string options;  ///< Of those, the ones that change its result.
  std::string config;   ///< The task file as it was named; empty for none.
  LogKey key;
  nlohmann::json arguments = {};  ///< What merge needs of the command line.
  std::string pieces = {};        ///< A file whose content follows the results (records/export.h).
};

/** The results of one run are null if it could not be read. */
template <class Result>
using ResultsOfRuns = std::vector<std::optional<CaseResults<Result>>>;

/** Writes the file of a shard, and says so. It replaces another file of a shard. @return the exit code.
@param results of each run, as JSON. @throws BadInput if it cannot be written, or a text of the result is not UTF-8. */
int WriteShard(const ShardOptions& options, const ShardedCommand& command, const NamedRuns& named,
               const nlohmann::json& results);
template <class Result>
int WriteShard(const ShardOptions& options, const ShardedCommand& command, const NamedRuns& named,
               const ResultsOfRuns<Result>& results) {
  nlohmann::json all = nlohmann::json::array();
  for (const auto& each : results) all.push_back(each ? nlohmann::json(*each) : nlohmann::json());
  return WriteShard(options, command, named, all);
}

/** The files of all shards of one command. */
class Shards final {
 public:
  /** @throws BadInput with file and reason, unless they are all the shards of one command, of this program's. */
  explicit Shards(const std::vector<std::string>& files);

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] const std::string& config() const { return config_; }
  /** Of the runs, only their robots and names. */
  [[nodiscard]] const NamedRuns& named() const { return named_; }
  [[nodiscard]] const nlohmann::json& arguments() const { return arguments_; }
  /** In the order of their numbers. */
  [[nodiscard]] std::vector<std::string> files() const;
  /** For a command that reads the logs again. @throws BadInput if these are others than the shards'. */
  void RequireSameRuns(const NamedRuns& found) const;
  /** Of all cases. @throws BadInput if a shard does not say the same of a run as another, or has no such results. */
  template <class Result>
  [[nodiscard]] ResultsOfRuns<Result> Results() const {
    ResultsOfRuns<Result> sum(named_.runs.size());
    for (const auto& [file, results] : results_)
      for (std::size_t run = 0; run < sum.size(); ++run) Join(file, results, run, sum[run]);
    return sum;
  }

 private:
  struct OfShard {
    std::string file;
    nlohmann::json results;  // of each run
  };

  template <class Result>
  void Join(const std::string& file, const nlohmann::json& results, std::size_t run,
            std::optional<CaseResults<Result>>& sum) const {
    const bool is_first = file == results_.front().file;
    std::optional<CaseResults<Result>> next;
    try {
      if (!results.at(run).is_null()) next = results[run].get<CaseResults<Result>>();
    } catch (const nlohmann::json::exception&) {
      RefuseResults(file);
    }
    if (is_first)
      sum = std::move(next);
    else if (sum.has_value() != next.has_value() ||
             (sum && (sum->cases != next->cases || nlohmann::json(sum->of_run) != nlohmann::json(next->of_run))))
      RefuseRun(file, run);
    else if (sum)
      sum->Join(*std::move(next));
  }
  [[noreturn]] static void RefuseResults(const std::string& file);
  [[noreturn]] void RefuseRun(const std::string& file, std::size_t run) const;

  std::string name_, config_;
  NamedRuns named_;
  nlohmann::json arguments_, runs_;
  std::vector<OfShard> results_;  // in the order of their numbers
};

// Print what the command without --shard prints. They return its exit code.
int PrintMergedReplay(const Shards& shards, bool json);
int PrintMergedComparison(const Shards& shards, bool json);
int PrintMergedVerification(const Shards& shards, bool json);
int PrintMergedAdvice(const Shards& shards, bool json);
int WriteMergedExport(const Shards& shards, const std::string& out);

}  // namespace forereach
