#include <csignal>
#include <ctime>
#include <filesystem>
#include <iostream>
#include <memory>
#include <set>

#include "bus/log.h"
#include "cli/commands.h"
#include "cli/each_run.h"
#include "fleet/ingest.h"
#include "lcmtypes/printable.h"
#include "records/log_directory.h"
#include "records/shard.h"
#include "task/config_error.h"

namespace forereach {
namespace {

struct IngestArguments {
  std::vector<std::string> inputs;
  std::string database, shard;
  IngestOptions ingest;
  bool follow = false;
};

void Print(const Ingested& sum) {
  std::cout << "ingest: " << sum.logs << " logs, " << sum.decisions << " decisions, " << sum.events
            << " execution events, " << sum.gaps << " gaps, " << sum.transitions << " transitions sent; " << sum.added
            << " of them are new in the store" << std::endl;
}

// Waits for SIGTERM or SIGINT, which are blocked. @return whether one came.
bool IsStoppedWithin(int seconds) {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int signal : {SIGTERM, SIGINT}) sigaddset(&signals, signal);
  sigprocmask(SIG_BLOCK, &signals, nullptr);
  const timespec time{seconds, 0};
  return sigtimedwait(&signals, nullptr, &time) > 0;
}

// Sends what the logger writes, until it is told to end. @return 1 if rows still wait in the directory.
int Follow(const IngestArguments& options) {
  if (options.inputs.size() != 1 || !std::filesystem::is_directory(options.inputs[0]))
    throw ConfigError("--follow: names one logger's directory");
  const std::string path = options.inputs[0] + "/" + LogDirectory::kDatabase;
  Store store(options.database);
  std::unique_ptr<DatabaseIngest> ingest;
  Ingested sum;
  std::string trouble;
  for (bool is_last = IsStoppedWithin(0);; is_last = IsStoppedWithin(trouble.empty() ? 1 : 5)) {
    std::string why;
    try {
      if (!ingest && std::filesystem::exists(path))
        ingest = std::make_unique<DatabaseIngest>(path, store, options.ingest);
      if (ingest) sum += ingest->Send();
    } catch (const StoreAway& error) {
      why = error.what();
    } catch (const DatabaseError& error) {
      why = error.what();
    }
    if (why != trouble) {
      if (why.empty())
        logging::Info("the store takes rows again");
      else
        logging::Warn("{}; the rows wait in {}", why, options.inputs[0]);
      trouble = why;
    }
    if (is_last) break;
  }
  Print(sum);
  return trouble.empty() ? 0 : 1;
}

// Whether a log is only missing beside its database, which has its rows.
bool HasRows(const RunLogs& run, const std::string& missing) {
  return std::ranges::any_of(run.missing, [&](const RunRow& row) { return missing.starts_with(row.log_file + ": "); });
}

int Ingest(IngestArguments options) {
  options.ingest.shard = ShardOf(options.shard);
  if (!Store::IsAddress(options.database))
    throw ConfigError("--database: is no address of a PostgreSQL server: postgresql://[USER@]HOST[:PORT]/DATABASE");
  if (options.follow) return Follow(options);
  Store store(options.database);
  NamedRuns named = RunsNamedBy(options.inputs, 1);
  Ingested sum;
  std::set<std::string> databases;
  for (const RunLogs& run : named.runs) {
    std::erase_if(named.missing, [&](const std::string& missing) { return HasRows(run, missing); });
    try {
      if (run.database.empty())
        sum += IngestLogs(run, store, options.ingest);
      else if (databases.insert(run.database).second)
        sum += DatabaseIngest(run.database, store, options.ingest).Send();
    } catch (const StoreError&) {
      throw;
    } catch (const BadInput& error) {
      if (!named.is_many) throw;
      named.missing.push_back(error.what());
    }
  }
  for (const std::string& missing : named.missing) std::cout << Printable(missing) << "\n";
  Print(sum);
  return named.missing.empty() ? 0 : 1;
}

}  // namespace

Command IngestCommand() {
  const auto options = std::make_shared<IngestArguments>();
  Command command{
      .name = "ingest",
      .footer =
          "A row that is there is not written again, so the same logs may be sent any number of times, and by several "
          "programs. See docs/fleet.md.\n\n"
          "Examples:\n"
          "  forereach ingest run/log --database postgresql://fleet.example/forereach --robot r1\n"
          "  forereach ingest run/log --database postgresql://fleet.example/forereach --follow",
      .options = {Required({"logs", &options->inputs, "LOG|DATABASE|DIRECTORY", kRuns}),
                  Required({"--database", &options->database, "URL", kDatabaseAddress}),
                  {"--robot", &options->ingest.robot, "NAME", "Whose logs they are where the logger had no keys"},
                  {"--config", &options->ingest.config, "FILE", kTaskOfLogs},
                  {"--shard", &options->shard, "I/N", "Send the part I of N of each log's rows, I from 1"},
                  Excluding("--shard", {"--follow", &options->follow, "",
                                        "Send what a logger writes into its directory, until SIGTERM or Ctrl-C; while "
                                        "the server is away, the rows wait there"})},
      .run = [options] { return Ingest(*options); }};
  AddKeyOptions(command.options, options->ingest.key);
  return command;
}

}  // namespace forereach
