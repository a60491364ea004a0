/** The directory of a logger: names and sizes of its files, and free space. */
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

  /** Makes the directory if necessary. @throws LogError if it cannot. */
  explicit LogDirectory(std::string path);
  /** Makes the directory again if it is gone. @throws LogError if it cannot. */
  void Make() const;

  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] std::string PathOf(const std::string& file) const;

  /** A name like "events-20260101-120000-000000.lcmlog" of a time in UTC with microseconds. Advances the time to the
  first one whose name no file has and for which `taken` is false. Names sort like their times. */
  [[nodiscard]] std::string FreeName(std::int64_t& time_us, const std::function<bool(const std::string&)>& taken) const;

  /** The files with such names, sorted. */
  [[nodiscard]] std::vector<std::string> Logs() const;

  /** The bytes of all .lcmlog files except `except`. Cost: one call to the file system for each file. */
  [[nodiscard]] std::int64_t LogBytes(const std::string& except = "") const;

  /** The bytes of a file, or nothing if there is none. */
  [[nodiscard]] std::optional<std::int64_t> Bytes(const std::string& file) const;

  /** Deletes a file. False if it cannot be deleted or does not exist. */
  bool Remove(const std::string& file) const;

 private:
  void ForEachLog(const std::function<void(const std::string&)>& visit) const;

  std::string path_;
};

/** The bytes that an unprivileged process can still write to a directory's disk; 0 if that is unknown. */
[[nodiscard]] std::int64_t FreeBytes(const std::string& directory);

}  // namespace forereach
