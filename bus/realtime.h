/** What a process asks of the operating system so that nothing keeps it waiting. */
#pragma once

namespace forereach {

struct RealtimeOptions {
  enum class Lock { kNo, kTry, kRequire };
  Lock lock_memory = Lock::kTry;
  int fifo_priority = 0;  ///< SCHED_FIFO, 1..99; 0 leaves the scheduler alone.

  bool keep_warm = false;  ///< Gate::KeepWarm while nothing waits.

  friend bool operator==(const RealtimeOptions&, const RealtimeOptions&) = default;
};

/** As the options say: locks the process's memory, now and to come, and puts every thread that runs now, those of the
bus too, under SCHED_FIFO. Threads that are started later do work beside (a reload, an index) and are ordinary ones.
Logs what it could not get, unless it is required. @throws BadInput, with what to do about it. */
void BecomeRealtime(const RealtimeOptions& options);

}  // namespace forereach
