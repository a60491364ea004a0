/** When this process was not run: it was stopped, swapped out, starved, or held up by a disk. What it has not heard
meanwhile is not the fault of who sends it. A function of times; no clock. */
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>

namespace forereach {

class Pauses final {
 public:
  /** Of the time between two calls, from which on it is a pause. A node is called every few milliseconds, and what it
  does in one turn takes some tens of them. */
  static constexpr std::int64_t kPauseUs = 100'000;
  static constexpr std::size_t kRemembered = 16;  ///< The last ones.

  /** The process runs. @param now_us microseconds since the Unix epoch. @param steady_us by a monotonic clock. */
  void Call(std::int64_t now_us, std::int64_t steady_us);

  /** The sum of the pauses between `since_us` and the last call, microseconds. @param since_us as Call's now_us. */
  [[nodiscard]] std::int64_t Since(std::int64_t since_us) const;

  /** Ends a sentence about what is older than allowed: ": this certifier itself did not run for 1998 ms". Empty unless
  it would be young enough without the pauses. @param since_us when it was heard. @param most_us how old it may be. */
  [[nodiscard]] std::string Explain(std::int64_t since_us, std::int64_t most_us) const;

 private:
  struct Pause {
    std::int64_t begin_us, end_us;  // since the Unix epoch
  };

  std::int64_t now_us_ = 0;
  std::optional<std::int64_t> last_steady_us_;
  std::deque<Pause> pauses_;  // the oldest first
};

}  // namespace forereach
