/** A bus without threads, for tests of the logger's node. */
#pragma once

#include <utility>
#include <vector>

#include "bus/bus.h"
#include "forereach/logger_status_t.hpp"
#include "records/check.h"
#include "tests/test.h"

namespace forereach {

/** Whatever happened to the logger, the rows that a directory has follow from the logs that it has. */
inline void ExpectRowsOfTheLogs(const std::string& directory, const LogKey& key = {}) {
  try {
    for (const LogCheck& check : CheckLogs(directory, "", key)) EXPECT_THAT(check.rows, IsEmpty()) << ToText({check});
  } catch (const BadInput& error) {  // a test that leaves no database, or none of ours
    SUCCEED() << error.what();
  }
}

inline constexpr std::int64_t kStart = 1'700'000'000'000'000;  // 2023-11-14 22:13:20 UTC

/** Hands every message to the subscribers at once, but the logger's own heartbeats: these it keeps. */
class DirectBus final : public Bus {
 public:
  explicit DirectBus(std::int64_t start = kStart) : now_us(start) {}

  using Bus::Publish;
  void Subscribe(const std::string& channel, Handler handler) override {
    handlers_.emplace_back(channel, std::move(handler));
  }
  bool Publish(const std::string& channel, Bytes bytes) override {
    if (const auto status = Decoded<logger_status_t>(bytes)) {
      heartbeats.push_back(*status);
      return true;
    }
    for (const auto& [pattern, handler] : handlers_)
      if (pattern == ".*" || pattern == channel) handler({channel, bytes, now_us, bytes});
    return true;
  }
  void Disconnect() { handlers_.clear(); }
  int Dispatch(int) override { return 0; }
  std::int64_t dropped() const override { return dropped_count; }

  std::int64_t now_us;
  std::int64_t dropped_count = 0;
  std::vector<logger_status_t> heartbeats;

 private:
  std::vector<std::pair<std::string, Handler>> handlers_;
};

}  // namespace forereach
