#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <iostream>

#include <fmt/format.h>

#include "cli/commands.h"
#include "cli/each_run.h"
#include "cli/shards.h"
#include "lcmtypes/printable.h"
#include "records/export.h"
#include "records/output_file.h"

namespace forereach {
namespace {

namespace fs = std::filesystem;

struct ExportArguments {
  std::vector<std::string> inputs;
  std::string format, output;
  ExportOptions what;
  unsigned jobs = AllCores();
  ShardOptions shard;

  [[nodiscard]] bool is_table() const {
    return what.format == ExportFormat::kCsv || what.format == ExportFormat::kJsonLines;
  }
};

// The name of a log, of characters that no program minds.
std::string PlainStem(const std::string& path) {
  std::string stem = fs::path(path).stem().string();
  for (char& c : stem)
    if (!std::isalnum(static_cast<unsigned char>(c)) && c != '-' && c != '.') c = '_';
  return stem;
}

// The names of what is written, beside each other: a file of each run, or those of all runs together.
std::vector<std::string> NamesOf(const ExportArguments& options, const NamedRuns& named) {
  if (options.what.format == ExportFormat::kCsv) return ExportFiles(options.what.format);
  std::vector<std::string> names;
  for (std::size_t i = 0; i < named.runs.size(); ++i)
    names.push_back(fmt::format("{:04}-{}.{}", i + 1, PlainStem(NameOf(named.runs[i])), options.format));
  return names;
}

// For csv, and for npz and mcap of several runs.
bool IsDirectory(const ExportArguments& options, const NamedRuns& named) {
  return options.what.format == ExportFormat::kCsv || (!options.is_table() && named.is_many);
}

void RequireNoOutput(const ExportArguments& options, const NamedRuns& named) {
  std::error_code error;
  if (!IsDirectory(options, named) || !fs::is_directory(options.output, error) || fs::is_symlink(options.output, error))
    return static_cast<void>(OutputFile(options.output));
  if (!fs::is_empty(options.output, error))
    throw OutputError(
        fmt::format("{}: the directory is not empty, and is not changed; choose another name", options.output));
}

void WriteTable(const ExportArguments& options, const std::vector<std::optional<ExportResult>>& results, std::size_t k,
                const std::string& path) {
  std::vector<std::string> parts;
  for (const auto& result : results)
    if (result) parts.push_back(result->files[k]);
  JoinTables(options.what.format, parts, path);
}

// What is written before it has its name. After a kill it stays.
struct PartsDirectory {
  explicit PartsDirectory(const std::string& output) {
    // Beside the output: a rename cannot leave its file system.
    std::string name = output + ".part-XXXXXX";
    if (!mkdtemp(name.data())) throw OutputError(fmt::format("{}: cannot be made: {}", name, std::strerror(errno)));
    path = name;
  }
  ~PartsDirectory() {
    std::error_code ignored;
    fs::remove_all(path, ignored);
  }
  PartsDirectory(const PartsDirectory&) = delete;
  PartsDirectory& operator=(const PartsDirectory&) = delete;

  fs::path path;
};

void Write(const ExportArguments& options, const NamedRuns& named,
           const std::vector<std::optional<ExportResult>>& results, const fs::path& parts) {
  if (!IsDirectory(options, named)) {
    if (options.is_table()) return WriteTable(options, results, 0, options.output);
    return GiveName(results.front()->files.front(), options.output);
  }
  const fs::path made = parts / "out";
  std::error_code error;
  fs::create_directory(made, error);  // if it fails, so does the first file in it
  const std::vector<std::string> names = NamesOf(options, named);
  for (std::size_t k = 0; k < names.size(); ++k) {
    if (options.is_table())
      WriteTable(options, results, k, (made / names[k]).string());
    else if (results[k])
      GiveName(results[k]->files.front(), (made / names[k]).string());
  }
  fs::rename(made, options.output, error);
  if (error) throw OutputError(fmt::format("{}: cannot be written: {}", options.output, error.message()));
}

void Describe(const ExportArguments& options, const ExportResult& result, const NamedRuns& named) {
  for (const std::string& missing : named.missing) std::cerr << "forereach: " << Printable(missing) << std::endl;
  if (result.damage.places > 0)
    std::cerr << "forereach: damaged in " << result.damage.places << " places, " << result.damage.bytes
              << " bytes; everything else was exported" << std::endl;
  std::cout << "export: ";
  if (options.what.format == ExportFormat::kNpz) {
    std::cout << result.tubes << " tubes of certified plans";
  } else if (options.what.format == ExportFormat::kMcap) {
    std::cout << result.messages << " messages";
  } else {
    std::cout << result.decisions << " decisions, " << result.executions << " execution events, " << result.withdrawals
              << " withdrawals, " << result.gaps << " gaps";
    if (result.without_candidate > 0) std::cout << "; the candidates of " << result.without_candidate << " are missing";
  }
  if (result.left_out > 0)
    std::cout << "; " << result.left_out
              << (options.what.format == ExportFormat::kMcap ? " messages of other types left out"
                                                             : " with impossible counts left out");
  if (named.is_many) std::cout << "; " << named.runs.size() << " runs";
  std::cout << DescribePassedOver(result.passed_over) << "; written to " << options.output << std::endl;
}

void SetFormat(ExportArguments& options, bool is_many) {
  const auto found = std::ranges::find(kExportFormats, options.format);
  if (found == kExportFormats.end()) throw ConfigError("no format of an export is called {}", options.format);
  options.what.format = static_cast<ExportFormat>(found - kExportFormats.begin());
  options.what.names_robot = is_many;
  if (options.output.size() > 1 && options.output.ends_with('/')) options.output.pop_back();
}

// The files of a run before they are joined.
std::vector<std::string> FilesOf(const ExportArguments& options, const PartsDirectory& parts, std::ptrdiff_t run) {
  std::vector<std::string> files;
  for (const std::string& name : ExportFiles(options.what.format))
    files.push_back(parts.path / fmt::format("{}.{}", run, name));
  return files;
}

int Finish(const ExportArguments& options, const NamedRuns& named,
           const std::vector<std::optional<ExportResult>>& results, const PartsDirectory& parts) {
  Write(options, named, results, parts.path);
  ExportResult sum;
  for (const auto& result : results)
    if (result) sum += *result;
  Describe(options, sum, named);
  if (!sum.has_messages) std::cerr << "forereach: nothing in it is a message of ForeReach's" << std::endl;
  return sum.has_messages && sum.damage.places == 0 && named.missing.empty() ? 0 : 1;
}

int WriteShardOfExport(const ExportArguments& options, NamedRuns& named) {
  const Shard shard = options.shard.Get();
  const PartsDirectory parts(options.output);
  const auto of_run = [&](std::ptrdiff_t run) { return (parts.path / std::to_string(run)).string(); };
  const auto results =
      ForEachRun<CaseResults<ExportResult>>(named, options.jobs, "exported", [&](const RunLogs& run, RunWork& work) {
        const std::ptrdiff_t number = &run - named.runs.data();
        return ExportShard(run, number, options.what, shard, of_run(number),
                           [&](std::int64_t bytes) { work.Read(bytes); });
      });
  OutputFile pieces(parts.path / "pieces");
  pieces.Write("\n");  // where the results stand in the shard's file
  for (std::ptrdiff_t run = 0; run < std::ssize(results); ++run)
    if (results[static_cast<std::size_t>(run)]) pieces.WriteContentOf(of_run(run));
  pieces.Write("}\n");
  pieces.Close();
  return WriteShard(options.shard,
                    {.name = "export",
                     .options = options.format,
                     .config = options.what.config,
                     .key = options.what.key,
                     .arguments = {{"format", options.format}},
                     .pieces = pieces.path()},
                    named, results);
}

int RunExport(ExportArguments options) {
  NamedRuns named = RunsNamedBy(options.inputs, options.jobs);
  SetFormat(options, named.is_many);
  options.shard.out = options.output;
  if (options.shard.is_given()) return WriteShardOfExport(options, named);
  RequireNoOutput(options, named);  // before the logs are read
  const PartsDirectory parts(options.output);
  const auto results =
      ForEachRun<ExportResult>(named, options.jobs, "exported", [&](const RunLogs& run, RunWork& work) {
        return ExportRun(run, options.what, FilesOf(options, parts, &run - named.runs.data()),
                         [&](std::int64_t bytes) { work.Read(bytes); });
      });
  return Finish(options, named, results, parts);
}

}  // namespace

int WriteMergedExport(const Shards& shards, const std::string& out) {
  ExportArguments options;
  shards.arguments().at("format").get_to(options.format);
  options.output = out;
  const NamedRuns& named = shards.named();
  SetFormat(options, named.is_many);
  RequireNoOutput(options, named);
  const PartsDirectory parts(options.output);
  std::vector<ShardPieces> pieces;
  for (const std::string& file : shards.files()) pieces.emplace_back(file);
  std::vector<std::optional<ExportResult>> results;
  for (auto& of_run : shards.Results<ExportResult>()) {
    const std::ptrdiff_t run = std::ssize(results);
    auto& result = results.emplace_back();
    if (!of_run) continue;
    result = ExportPieces(named.runs[static_cast<std::size_t>(run)].robot, run, of_run->cases, options.what, pieces,
                          FilesOf(options, parts, run));
    *result += std::move(*of_run).Sum();
  }
  if (!named.is_many && (results.size() != 1 || !results.front()))
    throw ConfigError("{}: has not the result of one run", shards.files().front());
  return Finish(options, named, results, parts);
}

Command ExportCommand() {
  const auto options = std::make_shared<ExportArguments>();
  Command command{.name = "export",
                  .footer =
                      "csv     a directory: decisions.csv, controls.csv, executions.csv, withdrawals.csv, gaps.csv\n"
                      "jsonl   the same records, one JSON object a line, in the order of the log\n"
                      "npz     the tubes and controls of certified plans as NumPy arrays\n"
                      "mcap    every message as JSON with its schema, for PlotJuggler and Foxglove\n"
                      "For a directory, a database or logs of several runs, npz and mcap write a directory with a file "
                      "for each run.\n\n"
                      "Examples:\n  forereach export run/log --format csv -o tables\n"
                      "  forereach export run/log/events-20260101-120000-000000.lcmlog --format mcap -o run.mcap\n"
                      "  forereach export run/log --format jsonl --shard 2/7 -o part2",
                  .options = {Required({"inputs", &options->inputs, "LOG|DATABASE|DIRECTORY", kRuns}),
                              Required(OneOf(kExportFormats, {"--format", &options->format, "", "What is written"})),
                              Required({"-o,--out", &options->output, "FILE|DIR",
                                        "A new file, or a directory; files that exist are not changed"}),
                              {"--config", &options->what.config, "FILE",
                               "The task file of the recording, for its channels and its key; by default the one that "
                               "the logger kept next to the log, in tasks/, otherwise the usual channels"},
                              {.name = "--shard",
                               .variable = &options->shard.shard,
                               .type = "I/N",
                               .help = "Write the part I of N of each run's records, I from 1, to the file --out; "
                                       "forereach merge makes of all N files what would have been written"}},
                  .run = [options] { return RunExport(*options); }};
  command.options.push_back(JobsOption(options->jobs));
  AddKeyOptions(command.options, options->what.key);
  return command;
}

}  // namespace forereach
