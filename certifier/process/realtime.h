/** What a process asks of the operating system so that nothing keeps it waiting. */
#pragma once

#include "certifier/task/config.h"

namespace forereach {

/** As the options say: locks the process's memory, now and to come, and puts every thread that runs now, those of the
bus too, under SCHED_FIFO. Threads that are started later do work beside (a reload, an index) and are ordinary ones.
Says in the log what it could not get, unless it is required. @throws BadInput, with what to do about it. */
void BecomeRealtime(const RealtimeOptions& options);

}  // namespace forereach
