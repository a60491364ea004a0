#include "records/log_directory.h"

#include <algorithm>
#include <ctime>
#include <filesystem>
#include <limits>
#include <utility>

#include <sys/statvfs.h>

#include <fmt/chrono.h>
#include <fmt/core.h>

#include "records/event_log.h"

namespace forereach {
namespace {

constexpr const char *kBeginning = "events-", *kEnding = ".lcmlog";
constexpr std::int64_t kSecond = 1'000'000;

}  // namespace

LogDirectory::LogDirectory(std::string path) : path_(std::move(path)) { Make(); }

void LogDirectory::Make() const {
  std::error_code error;
  std::filesystem::create_directories(path_, error);
  if (error) throw LogError(fmt::format("logger: cannot make the directory {}: {}", path_, error.message()));
}

std::string LogDirectory::PathOf(const std::string& file) const {
  return (std::filesystem::path(path_) / file).string();
}

std::string LogDirectory::FreeName(std::int64_t& time_us, const std::function<bool(const std::string&)>& taken) const {
  for (;; ++time_us) {
    const auto seconds = static_cast<std::time_t>(time_us / kSecond);
    std::string name =
        fmt::format("{}{:%Y%m%d-%H%M%S}-{:06}{}", kBeginning, fmt::gmtime(seconds), time_us % kSecond, kEnding);
    if (!Bytes(name) && !taken(name)) return name;
  }
}

std::vector<std::string> LogDirectory::Logs() const {
  std::vector<std::string> names;
  ForEachLog([&](const std::string& name) {
    if (name.starts_with(kBeginning)) names.push_back(name);
  });
  std::ranges::sort(names);
  return names;
}

std::int64_t LogDirectory::LogBytes(const std::string& except) const {
  std::int64_t bytes = 0;
  ForEachLog([&](const std::string& name) {
    if (name != except) bytes += Bytes(name).value_or(0);
  });
  return bytes;
}

void LogDirectory::ForEachLog(const std::function<void(const std::string&)>& visit) const {
  std::error_code error;
  for (std::filesystem::directory_iterator file(path_, error), end; !error && file != end; file.increment(error))
    if (file->path().extension() == kEnding) visit(file->path().filename().string());
}

std::optional<std::int64_t> LogDirectory::Bytes(const std::string& file) const {
  std::error_code error;
  const std::uintmax_t bytes = std::filesystem::file_size(PathOf(file), error);
  return error ? std::nullopt : std::optional(static_cast<std::int64_t>(bytes));
}

bool LogDirectory::Remove(const std::string& file) const {
  std::error_code error;
  return std::filesystem::remove(PathOf(file), error) && !error;
}

std::int64_t FreeBytes(const std::string& directory) {
  struct statvfs disk {};
  if (::statvfs(directory.c_str(), &disk) != 0) return 0;
  constexpr auto kMost = static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());
  const std::uint64_t block = disk.f_frsize, blocks = disk.f_bavail;
  return static_cast<std::int64_t>(block > 0 && blocks > kMost / block ? kMost : blocks * block);
}

}  // namespace forereach
