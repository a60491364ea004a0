#include "bus/realtime.h"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <string>

#include <fmt/core.h>
#include <sched.h>
#include <sys/mman.h>

#include "bus/log.h"
#include "lcmtypes/bad_input.h"

namespace forereach {

void BecomeRealtime(const RealtimeOptions& options) {
  using Lock = RealtimeOptions::Lock;
  if (options.lock_memory != Lock::kNo && ::mlockall(MCL_CURRENT | MCL_FUTURE) != 0) {
    const std::string why =
        fmt::format("cannot lock memory: {}; as root, or with `ulimit -l unlimited` or LimitMEMLOCK=infinity",
                    std::strerror(errno));
    if (options.lock_memory == Lock::kRequire) throw BadInput(fmt::format("realtime.lock_memory: {}", why));
    logging::Warn("{}", why);
  }
  if (options.fifo_priority == 0) return;
  sched_param parameter{};
  parameter.sched_priority = options.fifo_priority;
  for (const auto& thread : std::filesystem::directory_iterator("/proc/self/task"))
    if (::sched_setscheduler(std::stoi(thread.path().filename()), SCHED_FIFO | SCHED_RESET_ON_FORK, &parameter) != 0)
      throw BadInput(fmt::format("realtime.fifo_priority: {}; as root, or with `ulimit -r 99` or LimitRTPRIO=99",
                                 std::strerror(errno)));
}

}  // namespace forereach
