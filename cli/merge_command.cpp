#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <limits>
#include <map>
#include <memory>
#include <string_view>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "bus/bus_options.h"
#include "bus/keys.h"
#include "cli/commands.h"
#include "cli/shards.h"
#include "lcmtypes/codec.h"
#include "lcmtypes/grounds.h"
#include "lcmtypes/printable.h"
#include "records/output_file.h"
#include "task/config.h"
#include "task/files.h"
#include "task/json_text.h"

namespace forereach {
namespace {

namespace fs = std::filesystem;

using PrintMerged = int (*)(const Shards&, bool json);
const std::map<std::string, PrintMerged> kMerged = {{"advise", PrintMergedAdvice},
                                                    {"compare", PrintMergedComparison},
                                                    {"replay", PrintMergedReplay},
                                                    {"verify", PrintMergedVerification}};

constexpr std::string_view kBeginning = "{\"command\":\"";  // of a shard's file

// ---- On what a result depends.

// Reads the file in blocks: a log may be larger than the memory.
std::string DigestOfFile(const std::string& path) {
  InputFile file(path, std::numeric_limits<std::int64_t>::max());
  std::vector<char> block(1 << 20);
  Digest digest{};
  while (const std::size_t bytes = file.Read(block.data(), block.size()))
    digest = ChainedDigest(digest, Bytes(reinterpret_cast<const std::uint8_t*>(block.data()), bytes));
  return ToHex(digest);
}

// Of what is behind the first line.
std::string DigestOfRest(const std::string& path) {
  std::ifstream file(path);
  std::string first;
  std::getline(file, first);
  std::vector<char> block(1 << 20);
  Digest digest{};
  while (file.read(block.data(), std::ssize(block)), file.gcount() > 0)
    digest = ChainedDigest(
        digest, Bytes(reinterpret_cast<const std::uint8_t*>(block.data()), static_cast<std::size_t>(file.gcount())));
  return ToHex(digest);
}

std::string DigestOfProgram() { return DigestOfFile(fs::read_symlink("/proc/self/exe").string()); }

// Names and sizes of the kept tasks, which are digests: the content of each is checked against its name when it is
// read. A copy on another machine has other times.
std::string DescribeTasks(const fs::path& directory) {
  std::vector<std::string> files;
  std::error_code error;
  for (fs::recursive_directory_iterator file(directory / "tasks", error), end; !error && file != end;
       file.increment(error)) {
    std::error_code none;
    const auto bytes = file->is_regular_file(none) ? file->file_size(none) : 0;
    files.push_back(fmt::format("{} {}\n", file->path().string(), bytes));
  }
  std::ranges::sort(files);
  std::string text;
  for (const std::string& file : files) text += file;
  return text;
}

// Tells a log from others and from a longer one, without reading it once more: its size, and blocks spread over it.
std::string SampleOf(const std::string& path) {
  constexpr std::int64_t kBlocks = 32, kBytes = 4096;
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  const std::int64_t size = file.tellg();
  std::array<char, kBytes> block{};
  Digest digest{};
  for (std::int64_t i = 0; i <= kBlocks && file; ++i) {
    file.seekg(std::max<std::int64_t>(size - kBytes, 0) * i / kBlocks);
    file.read(block.data(), std::min(size, kBytes));
    digest = ChainedDigest(digest, Bytes(reinterpret_cast<const std::uint8_t*>(block.data()), block.size()));
  }
  if (!file) throw ConfigError("{}: cannot be read", path);
  return fmt::format("{} {}", size, ToHex(digest));
}

// What a run is made of. Rows of a database are not in it: other rows are other cases, which merge finds.
std::string DigestOfRun(const RunLogs& run) {
  std::string inputs = run.robot + "\n" + run.database + "\n";
  for (const std::string& log : run.logs) inputs += log + "\n" + SampleOf(log) + "\n";
  return ToHex(DigestOf(inputs + DescribeTasks(fs::path(NameOf(run)).parent_path())));
}

nlohmann::json DescribeRuns(const NamedRuns& named) {
  nlohmann::json runs = nlohmann::json::array();
  for (const RunLogs& run : named.runs)
    runs.push_back({{"robot", run.robot}, {"name", NameOf(run)}, {"digest", DigestOfRun(run)}});
  return runs;
}

// Everything besides the runs.
std::string JobOf(const ShardedCommand& command) {
  std::string job = fmt::format("{} {}", command.name, command.options);
  BusOptions bus;
  if (!command.config.empty()) {
    const Config task = LoadConfig(command.config);
    for (const auto& [name, digest] : kGrounds) job += " " + ToHex(task.grounds.*digest);
    bus = task.bus;
  }
  command.key.Override(bus);
  job += command.key.none ? "\nno key" : "\nkey";
  if (const std::optional<KeyRing> keys = PublicKeysOf(bus)) {
    job += " " + keys->robot();
    // With other keys, other messages count as authentic.
    for (const Role role : kAllRoles) job += " " + ToHex(DigestOf(Bytes(keys->public_key(role))));
  }
  return job;
}

// ---- Their files.

// The file of one shard.
struct ShardFile {
  std::string path;
  nlohmann::json document;

  [[nodiscard]] const nlohmann::json& operator[](const char* key) const { return document.at(key); }
  [[nodiscard]] int number() const { return (*this)["shard"].get<int>(); }
  [[nodiscard]] int count() const { return (*this)["of"].get<int>(); }
  [[nodiscard]] std::string Name() const { return fmt::format("shard {} of {}", number(), count()); }
};

[[noreturn]] void RefuseShard(const std::string& path, const std::string& why) {
  throw ConfigError("{}: {}", path, why);
}

std::string DigestOfDocument(const nlohmann::json& document) { return ToHex(DigestOf(JsonText(document))); }

std::string FirstLine(const std::string& path) {
  InputFile file(path, std::numeric_limits<std::int64_t>::max());
  std::string line;
  std::vector<char> block(1 << 16);
  while (const std::size_t bytes = file.Read(block.data(), block.size())) {
    const std::string_view read(block.data(), bytes);
    const std::size_t end = read.find('\n');
    line += read.substr(0, end);
    if (end != std::string_view::npos) break;
    if (std::ssize(line) > kLargestJsonFile) RefuseShard(path, "not the file of a shard: its first line is too long");
  }
  return line;
}

ShardFile ReadShard(const std::string& path) {
  try {
    ShardFile file{path, ParseJson(FirstLine(path))};
    const auto digest = file["digest"].get<std::string>();
    file.document.erase("digest");
    if (DigestOfDocument(file.document) != digest || DigestOfRest(path) != file["pieces"])
      RefuseShard(path, "is damaged: its digest is that of other content");
    // Results are this program's own structs: the numbers of another version may mean something else.
    if (file["program"] != DigestOfProgram()) RefuseShard(path, "another version of this program wrote it");
    if (file.number() < 1 || file.number() > file.count() || file.count() > kMostShards ||
        file["results"].size() != file["runs"].size() ||
        !(file["command"] == "export" || kMerged.contains(file["command"].get<std::string>())))
      RefuseShard(path, "no shard is such");
    return file;
  } catch (const nlohmann::json::exception& error) {
    RefuseShard(path, fmt::format("not the file of a shard: it {}", DescribeJsonError(error)));
  }
}

// Whether two files are of one command.
void RequireTogether(const ShardFile& first, const ShardFile& file) {
  const auto refuse = [&](const std::string& how) {
    RefuseShard(file.path, fmt::format("{} than {}", how, first.path));
  };
  if (file["command"] != first["command"]) refuse("is of another command");
  if (file["job"] != first["job"] || file["config"] != first["config"] || file["options"] != first["options"])
    refuse("was made with another task, key or option");
  for (const char* key : {"runs", "is_many", "missing"})
    if (file[key] != first[key]) refuse("is of other runs");
  if (file.count() != first.count())
    RefuseShard(file.path, fmt::format("is {}, and {} is one of {}", file.Name(), first.path, first.count()));
}

// In the order of their numbers.
std::map<int, ShardFile> ReadAllShards(const std::vector<std::string>& paths) {
  std::map<int, ShardFile> shards;
  for (const std::string& path : paths) {
    ShardFile file = ReadShard(path);
    if (!shards.empty()) RequireTogether(shards.begin()->second, file);
    const int number = file.number();
    const auto [found, is_new] = shards.try_emplace(number, std::move(file));
    if (!is_new) RefuseShard(path, fmt::format("is {}, and so is {}", found->second.Name(), found->second.path));
  }
  const int count = shards.begin()->second.count();
  for (int number = 1; number <= count; ++number)
    if (!shards.contains(number))
      RefuseShard(shards.begin()->second.path, fmt::format("shard {} of {} is missing", number, count));
  return shards;
}

struct MergeArguments {
  std::vector<std::string> files;
  std::string out;
  bool json = false;
};

int Merge(const MergeArguments& options) try {
  const Shards shards(options.files);
  const bool is_export = shards.name() == "export";
  if (is_export == options.out.empty())
    throw ConfigError(is_export
                          ? "--out: is needed, since these are the shards of an export"
                          : fmt::format("--out: is for the shards of an export, and these are of {}", shards.name()));
  if (is_export) return WriteMergedExport(shards, options.out);
  return kMerged.at(shards.name())(shards, options.json);
} catch (const nlohmann::json::exception&) {
  RefuseShard(options.files.front(), "has no results of this command");
}

}  // namespace

void ShardOptions::AddTo(std::vector<Option>& options) {
  options.push_back(
      Excluding("--json", Needing("--out", {"--shard", &shard, "I/N",
                                            "Judge the part I of N of each run's cases, I from 1, and write what was "
                                            "found to --out; forereach merge makes one result of all N files"})));
  options.push_back(Needing("--shard", {"--out", &out, "FILE", "The file of the shard; an older one is replaced"}));
}

Shard ShardOptions::Get() const {
  const Shard chosen = ShardOf(shard);
  if (is_given() && std::filesystem::exists(out) && ReadBeginning(out, kBeginning.size()) != kBeginning)
    throw OutputError(fmt::format("{}: is not the file of a shard, and is not replaced", out));
  return chosen;
}

int WriteShard(const ShardOptions& options, const ShardedCommand& command, const NamedRuns& named,
               const nlohmann::json& results) {
  const Shard shard = options.Get();
  nlohmann::json document{
      {"shard", shard.index + 1},     {"of", shard.count},        {"program", DigestOfProgram()},
      {"command", command.name},      {"job", JobOf(command)},    {"config", command.config},
      {"options", command.arguments}, {"is_many", named.is_many}, {"missing", named.missing},
      {"runs", DescribeRuns(named)},  {"results", results},       {"pieces", DigestOfRest(command.pieces)}};
  if (ParseJson(JsonText(document)) != document)
    throw OutputError(
        fmt::format("{}: a name or text of the result is not UTF-8, which this file cannot hold", options.out));
  document["digest"] = DigestOfDocument(document);
  OutputFile file(options.out, OutputFile::Existing::kReplaced);
  file.Write(JsonText(document) + "\n");
  if (!command.pieces.empty()) file.WriteContentOf(command.pieces, true);
  file.Close();
  std::cout << "shard " << options.shard << " of " << command.name << " is written to " << Printable(options.out)
            << std::endl;
  return 0;
}

Shards::Shards(const std::vector<std::string>& files) {
  for (auto& [number, file] : ReadAllShards(files)) {
    try {
      if (results_.empty()) {
        name_ = file["command"].get<std::string>();
        config_ = file["config"].get<std::string>();
        named_.is_many = file["is_many"].get<bool>();
        file["missing"].get_to(named_.missing);
        arguments_ = file["options"];
        runs_ = file["runs"];
        for (const nlohmann::json& run : file["runs"])
          named_.runs.push_back({.robot = run.at("robot").get<std::string>(),
                                 .logs = {run.at("name").get<std::string>()},
                                 .database = {},
                                 .missing = {}});
      }
    } catch (const nlohmann::json::exception&) {
      RefuseResults(file.path);
    }
    results_.push_back({file.path, file["results"]});
  }
}

std::vector<std::string> Shards::files() const {
  std::vector<std::string> files;
  for (const OfShard& each : results_) files.push_back(each.file);
  return files;
}

void Shards::RefuseResults(const std::string& file) { RefuseShard(file, "has no results of this command"); }

void Shards::RequireSameRuns(const NamedRuns& found) const {
  if (DescribeRuns(found) != runs_)
    RefuseShard(results_.front().file, "is of other logs than those that are there now");
}

void Shards::RefuseRun(const std::string& file, std::size_t run) const {
  RefuseShard(file, fmt::format("found other cases or messages in {} than {}", NameOf(named_.runs[run]),
                                results_.front().file));
}

Command MergeCommand() {
  const auto options = std::make_shared<MergeArguments>();
  return {.name = "merge",
          .footer =
              "It prints what the command prints without --shard, byte for byte, with its exit code. The files have to "
              "be all N, of\nthe same command, program, options, task, key and logs under the same names.\n\n"
              "Examples:\n  forereach replay run/log --shard 1/2 --out part1.json\n"
              "  forereach replay run/log --shard 2/2 --out part2.json\n"
              "  forereach merge part1.json part2.json\n"
              "  forereach export run/log --format csv --shard 1/2 --out part1\n"
              "  forereach export run/log --format csv --shard 2/2 --out part2\n"
              "  forereach merge part1 part2 --out tables",
          .options = {Required({"files", &options->files, "FILE", "The files of all shards, in any order"}),
                      {"-o,--out", &options->out, "FILE|DIR", "Of an export: what is written, as by its own --out"},
                      Excluding("--out", JsonFlag(options->json))},
          .run = [options] { return Merge(*options); }};
}

}  // namespace forereach
