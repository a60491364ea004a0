/** A parallel for-loop. */
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

#include "forereach/numerics/compilation.h"

namespace forereach {

/** The number of threads that this machine runs at once, 1 if it does not say. */
inline unsigned AllCores() { return std::max(1u, std::thread::hardware_concurrency()); }

/** Calls work(i, thread) once for each i < count, in no fixed order, on min(threads, count) threads. `thread` is the
number of the calling thread; the caller's own is 0. After an exception no further i is started, and the last exception
is rethrown.
@pre threads >= 1. */
template <class Work>
void ForEachInParallel(std::size_t count, unsigned threads, const Work& work) {
  std::atomic<std::size_t> next = 0;
  std::mutex mutex;
  std::exception_ptr failure;
  const auto run = [&](std::size_t thread) {
    try {
      for (std::size_t i = next++; i < count; i = next++) work(i, thread);
    } catch (...) {
      const std::lock_guard lock(mutex);
      failure = std::current_exception();
      next = count;
    }
  };
  {
    std::vector<std::jthread> others;  // joined at the end of this block
    for (std::size_t t = 1; t < std::min<std::size_t>(threads, count); ++t) others.emplace_back(run, t);
    run(0);
  }
  if (failure) std::rethrow_exception(failure);
}

}  // namespace forereach
