/** A progress bar on standard error, for work that takes longer than a person likes to wait in the dark. */
#pragma once

#include <chrono>
#include <cstddef>
#include <mutex>
#include <string>

namespace forereach {

/** Shows nothing unless standard error is a terminal and the work has taken two seconds. Any thread may tell of it. */
class Progress final {
 public:
  /** @param what the things counted, in the plural. */
  Progress(std::string what, std::size_t total);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /** One or more are done. */
  void Advance(std::size_t count = 1);

  /** The bar, without its carriage return: "[#####.....] 5 of 10 plans, 3 s left". */
  [[nodiscard]] static std::string Line(const std::string& what, std::size_t done, std::size_t total, double seconds);

 private:
  const std::string what_;
  const std::size_t total_;
  const bool terminal_;
  const std::chrono::steady_clock::time_point begin_;
  std::mutex mutex_;
  std::size_t done_ = 0;
  double shown_at_ = 0;
};

}  // namespace forereach
