/** Work beside a node's own: reloads, which read files and may never end, and work on memory, which does. */
#pragma once

#include <atomic>
#include <chrono>
#include <exception>
#include <functional>
#include <future>
#include <list>
#include <memory>
#include <optional>
#include <system_error>
#include <thread>
#include <type_traits>
#include <utility>

namespace forereach {

/** True once the work has ended. */
template <class Result>
[[nodiscard]] bool IsReady(const std::future<Result>& work) {
  return work.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

/** The work in a thread of its own; not valid where the machine has none to give. The future's destructor waits for it:
only for work that ends. */
template <class Work>
[[nodiscard]] std::future<std::invoke_result_t<Work>> Beside(Work work) try {
  return std::async(std::launch::async, std::move(work));
} catch (const std::system_error&) {
  return {};
}

/** How many threads of reloads have not ended, in the whole process. While there are any, they may use static objects:
the process then ends by std::_Exit. */
inline std::atomic<int> reloads_under_way = 0;

/** Reads in a thread of its own that nobody waits for: one that reads from a mount that stalls may never end. One reads
at a time; where it has not ended after `patience` it is stalled, and another may begin beside it, of at most kMost.
Where a newer result was taken an older one is dropped. */
template <class Result>
class Reloading final {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::size_t kMost = 2;

  /** @param read runs in a thread of its own, up to kMost times at once; it owns whatever it uses, since this object
  and its owner may be gone before it ends. */
  explicit Reloading(std::function<Result()> read, Clock::duration patience = std::chrono::seconds(10))
      : read_(std::move(read)), patience_(patience) {}

  /** Reads, or reads once more after what is under way: that may have read before what it is asked for was written.
  False where kMost are stalled: it is read once one of them has ended. */
  [[nodiscard]] bool Ask() {
    again_ = true;
    BeginIfDue();
    return !again_ || attempts_.size() < kMost || !IsStalled(*attempts_.back());
  }

  /** What was read, once, the newest first. Does not wait. To be called again and again: it begins what is due.
  @throws what `read` threw. */
  [[nodiscard]] std::optional<Result> Take() {
    std::shared_ptr<Attempt> newest;
    for (auto at = attempts_.end(); at != attempts_.begin();) {
      const std::shared_ptr<Attempt> attempt = *--at;
      attempt->dropped |= newest != nullptr;
      if (!attempt->ended) continue;
      if (!attempt->dropped) newest = attempt;
      at = attempts_.erase(at);
    }
    BeginIfDue();
    if (!newest) return std::nullopt;
    if (newest->error) std::rethrow_exception(newest->error);
    return std::move(newest->result);
  }

  /** True once for each attempt that is stalled. It may end all the same. */
  [[nodiscard]] bool TakeStall() {
    if (attempts_.empty() || attempts_.back()->dropped || !IsStalled(*attempts_.back())) return false;
    return !std::exchange(attempts_.back()->told, true);
  }

 private:
  // Shared by the thread and the node. The thread writes result and error, and `ended` after them; the node reads them
  // after it.
  struct Attempt {
    std::optional<Result> result;
    std::exception_ptr error;
    std::atomic<bool> ended = false;
    const Clock::time_point begun = Clock::now();
    bool dropped = false,
         told = false;  // a newer one was taken; it was told that this one is stalled. Of the node alone

    void Run(const std::function<Result()>& read) noexcept {
      try {
        result.emplace(read());
      } catch (...) {
        error = std::current_exception();
      }
      ended = true;
    }
  };

  bool IsStalled(const Attempt& attempt) const { return !attempt.ended && Clock::now() - attempt.begun > patience_; }

  // A machine without another thread to give is asked again the next time.
  void BeginIfDue() {
    if (!again_ || attempts_.size() >= kMost || (!attempts_.empty() && !IsStalled(*attempts_.back()))) return;
    auto attempt = std::make_shared<Attempt>();
    ++reloads_under_way;
    try {
      std::thread([attempt, read = read_]() mutable {
        attempt->Run(read);
        attempt.reset();  // what nobody has taken is gone before the thread counts as ended
        --reloads_under_way;
      }).detach();
    } catch (const std::system_error&) {
      --reloads_under_way;
      return;
    }
    attempts_.push_back(std::move(attempt));
    again_ = false;
  }

  const std::function<Result()> read_;
  const Clock::duration patience_;
  std::list<std::shared_ptr<Attempt>> attempts_;  // the newest at the back
  bool again_ = false;
};

}  // namespace forereach
