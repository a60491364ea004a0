/** The directory a logger writes to, as the file system sees it: names, sizes, free space. */
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace forereach {

class LogDirectory final {
 public:
  static constexpr const char* kDatabase = "decisions.sqlite";

  /** Makes it if need be. @throws LogError if it cannot. */
  explicit LogDirectory(std::string path);
  /** Makes it again if it is gone. @throws LogError if it cannot. */
  void Make() const;

  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] std::string PathOf(const std::string& file) const;

  /** "events-20260101-120000-000000.lcmlog" of a time in UTC with its microseconds, put off to the first whose name no
  file has and `taken` does not hold for. Names sort as their times do. */
  [[nodiscard]] std::string FreeName(std::int64_t& time_us, const std::function<bool(const std::string&)>& taken) const;

  /** The files with names of this kind, with microseconds or, as they were before, without; sorted. */
  [[nodiscard]] std::vector<std::string> Logs() const;

  /** Bytes of all .lcmlog files but `except`. Cost: one look at each file. */
  [[nodiscard]] std::int64_t LogBytes(const std::string& except = "") const;

  /** Bytes of a file, or nothing if it is not there. */
  [[nodiscard]] std::optional<std::int64_t> Bytes(const std::string& file) const;

  /** Deletes a file; false if it cannot be, or was not there. */
  bool Remove(const std::string& file) const;

 private:
  void ForEachLog(const std::function<void(const std::string&)>& visit) const;

  std::string path_;
};

/** Bytes that an unprivileged process may still write to the disk of a directory; 0 if that cannot be found out. */
[[nodiscard]] std::int64_t FreeBytes(const std::string& directory);

}  // namespace forereach
