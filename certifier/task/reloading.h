/** A reload beside a node's own work: read in a thread of its own, taken by the node when it is ready for it. */
#pragma once

#include <chrono>
#include <functional>
#include <future>
#include <optional>
#include <system_error>
#include <type_traits>
#include <utility>

namespace forereach {

/** True once the work has ended. */
template <class Result>
[[nodiscard]] bool IsReady(const std::future<Result>& work) {
  return work.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

/** The work in a thread of its own; not valid where the machine has none to give. */
template <class Work>
[[nodiscard]] std::future<std::invoke_result_t<Work>> Beside(Work work) try {
  return std::async(std::launch::async, std::move(work));
} catch (const std::system_error&) {
  return {};
}

template <class Result>
class Reloading final {
 public:
  /** @param read runs in a thread of its own, never twice at a time. */
  explicit Reloading(std::function<Result()> read) : read_(std::move(read)) {}

  /** Reads; where it is under way already, once more after it: it may have read before what it is asked for was written.
  A machine without another thread to give is asked again by each Take. */
  void Ask() {
    again_ = under_way_.valid();
    if (again_) return;
    under_way_ = Beside(read_);
    again_ = !under_way_.valid();
  }

  /** What was read, once. Does not wait. */
  [[nodiscard]] std::optional<Result> Take() {
    std::optional<Result> result;
    if (under_way_.valid() && IsReady(under_way_)) result = under_way_.get();
    if (again_ && !under_way_.valid()) Ask();
    return result;
  }

 private:
  const std::function<Result()> read_;
  std::future<Result> under_way_;
  bool again_ = false;
};

}  // namespace forereach
