/** A reload beside a node's own work: read in a thread of its own, taken by the node when it is ready for it. */
#pragma once

#include <chrono>
#include <functional>
#include <future>
#include <optional>
#include <utility>

namespace forereach {

/** True once the work has ended. */
template <class Result>
[[nodiscard]] bool IsReady(const std::future<Result>& work) {
  return work.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

template <class Result>
class Reloading final {
 public:
  /** @param read runs in a thread of its own, never twice at a time. */
  explicit Reloading(std::function<Result()> read) : read_(std::move(read)) {}

  /** Reads; where it is under way already, once more after it: it may have read before what it is asked for was written. */
  void Ask() {
    if (under_way_.valid()) {
      again_ = true;
    } else {
      under_way_ = std::async(std::launch::async, read_);
    }
  }

  /** What was read, once. Does not wait. */
  [[nodiscard]] std::optional<Result> Take() {
    if (!under_way_.valid() || !IsReady(under_way_)) return std::nullopt;
    std::optional<Result> result(under_way_.get());
    if (std::exchange(again_, false)) Ask();
    return result;
  }

 private:
  const std::function<Result()> read_;
  std::future<Result> under_way_;
  bool again_ = false;
};

}  // namespace forereach
