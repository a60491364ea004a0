/** What a process asks of the operating system so that nothing keeps it waiting. */
#pragma once

#include "certifier/task/config.h"

namespace forereach {

/** Locks the process's memory, now and to come, and takes a place under SCHED_FIFO, as the options say. Says in the log
what it could not get, unless it is required. @throws BadInput, with what to do about it. */
void BecomeRealtime(const RealtimeOptions& options);

}  // namespace forereach
