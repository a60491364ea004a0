/** Background work of a node: reloads, which read files and may never end, and work on memory, which always ends. */
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

/** Runs the work in its own thread. The future is not valid if no thread can be started. Its destructor waits for the
work, so use it only for work that ends. */
template <class Work>
[[nodiscard]] std::future<std::invoke_result_t<Work>> RunInThread(Work work) try {
  return std::async(std::launch::async, std::move(work));
} catch (const std::system_error&) {
  return {};
}

/** The number of reload threads in the process that have not ended. They may use static objects, so if there are any,
the process ends by std::_Exit. */
inline std::atomic<int> reloads_under_way = 0;

/** Reads in its own thread, for which no other thread waits: a read from a stalled mount may never end. One thread
reads at a time. If it has not ended after `patience`, it counts as stalled, and another may start, up to kMost at once.
If a newer result was taken, older results are discarded. */
template <class Result>
class Reloading final {
 public:
  using SteadyClock = std::chrono::steady_clock;
  static constexpr std::size_t kMost = 2;

  /** @param read runs in its own thread, up to kMost times at once. It has to own the objects that it uses, because
  this object and its owner may be destroyed before it ends. */
  explicit Reloading(std::function<Result()> read, SteadyClock::duration patience = std::chrono::seconds(10))
      : read_(std::move(read)), patience_(patience) {}

  /** Starts a read, or another one after the running read, which may have read an older version of the file. False if
  kMost reads are stalled; the read then starts when one of them has ended. */
  [[nodiscard]] bool Ask() {
    again_ = true;
    BeginIfDue();
    return !again_ || attempts_.size() < kMost || !IsStalled(*attempts_.back());
  }

  /** The newest result that was not taken yet, if any. It does not wait. Call it repeatedly, because it also starts
  pending reads.
  @throws the exception of `read`. */
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
    const SteadyClock::time_point begun = SteadyClock::now();
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

  bool IsStalled(const Attempt& attempt) const {
    return !attempt.ended && SteadyClock::now() - attempt.begun > patience_;
  }

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
  const SteadyClock::duration patience_;
  std::list<std::shared_ptr<Attempt>> attempts_;  // the newest at the back
  bool again_ = false;
};

}  // namespace forereach
