#include "records/finished_runs.h"

#include <algorithm>
#include <filesystem>
#include <limits>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "lcmtypes/codec.h"
#include "records/database.h"
#include "records/output_file.h"
#include "task/files.h"
#include "task/json_text.h"

namespace forereach {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kNameDigits = 32;

// Reads the file in blocks: a log may be larger than the memory.
std::string DigestOfFile(const std::string& path) {
  InputFile file(path, std::numeric_limits<std::int64_t>::max());
  std::vector<char> block(1 << 20);
  Digest digest{};
  while (const std::size_t bytes = file.Read(block.data(), block.size()))
    digest = ChainedDigest(digest, Bytes(reinterpret_cast<const std::uint8_t*>(block.data()), bytes));
  return ToHex(digest);
}

// Names, sizes and times of the kept tasks: the content of each is checked against its name when it is read.
std::string DescribeTasks(const fs::path& directory) {
  std::vector<std::string> files;
  std::error_code error;
  for (fs::recursive_directory_iterator file(directory / "tasks", error), end; !error && file != end;
       file.increment(error)) {
    std::error_code none;
    const auto bytes = file->is_regular_file(none) ? file->file_size(none) : 0;
    files.push_back(fmt::format("{} {} {}\n", file->path().string(), bytes,
                                file->last_write_time(none).time_since_epoch().count()));
  }
  std::ranges::sort(files);
  std::string text;
  for (const std::string& file : files) text += file;
  return text;
}

}  // namespace

std::string DigestOfProgram() { return DigestOfFile(fs::read_symlink("/proc/self/exe").string()); }

FinishedRuns::FinishedRuns(std::string directory, const std::string& job) : directory_(std::move(directory)) {
  std::error_code error;
  fs::create_directories(directory_, error);
  if (error || !fs::is_directory(directory_, error))
    throw OutputError(directory_ + ": cannot be made a directory: " + error.message());
  job_ = DigestOfProgram() + "\n" + job + "\n";
}

FinishedRuns::~FinishedRuns() {
  std::error_code ignored;
  fs::remove(directory_, ignored);  // fails unless it is empty
}

std::string KeyOf(const RunLogs& run, const std::string& job) {
  std::string inputs = job + run.robot + "\n" + run.database + "\n";
  for (const std::string& log : run.logs) inputs += log + "\n" + DigestOfFile(log) + "\n";
  if (!run.database.empty()) {
    Database database(run.database);
    const auto add = [&](const std::string& file) {
      inputs += file + "\n" + ToHex(database.DigestOfRows(file)) + "\n";
    };
    for (const std::string& log : run.logs) add(fs::path(log).filename().string());
    for (const RunRow& row : run.missing) add(row.log_file);
  }
  const std::string& path = run.logs.empty() ? run.database : run.logs.front();
  return ToHex(DigestOf(inputs + DescribeTasks(fs::path(path).parent_path())));
}

std::string FinishedRuns::PathOf(const std::string& key) const {
  return (fs::path(directory_) / (key.substr(0, kNameDigits) + ".json")).string();
}

std::optional<nlohmann::json> FinishedRuns::Find(const std::string& key) const {
  const std::string path = PathOf(key);
  if (!fs::exists(path)) return std::nullopt;
  const std::string bytes = ReadWhole(path, kLargestJsonFile);
  const std::string_view text = std::string_view(bytes).substr(std::min(bytes.size(), kHexDigits));
  if (bytes.size() < kHexDigits || ToHex(DigestOf(key + std::string(text))) != bytes.substr(0, kHexDigits))
    return std::nullopt;
  try {
    return ParseJson(text);
  } catch (const nlohmann::json::exception&) {  // not what Keep writes
    return std::nullopt;
  }
}

void FinishedRuns::Keep(const std::string& key, const nlohmann::json& result) const {
  const std::string text = JsonText(result);
  OutputFile file(PathOf(key), OutputFile::Existing::kReplaced);
  file.Write(ToHex(DigestOf(key + text)));
  file.Write(text);
  file.Close();
}

}  // namespace forereach
