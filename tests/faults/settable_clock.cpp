// Preloaded into a process (LD_PRELOAD), moves its wall clock by what the file FOREREACH_CLOCK_FILE says, from one
// reading to the next: what std::chrono and GLib read, and the kernel's stamps of datagrams, which are the times
// messages came. The steady clock stays as it is.
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include <dlfcn.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <time.h>

#include "tests/faults/clock_file.h"

namespace {

std::int64_t OffsetUs() {
  static forereach::ClockFile* const file = [] {
    const char* path = std::getenv("FOREREACH_CLOCK_FILE");
    forereach::ClockFile* mapped = path ? forereach::MapClockFile(path) : nullptr;
    if (mapped) return mapped;
    std::fputs("settable clock: FOREREACH_CLOCK_FILE is no file that can be mapped\n", stderr);
    std::abort();
  }();
  ++file->reads;
  return file->offset_us;
}

template <class Function>
Function* Next(const char* name) {
  return reinterpret_cast<Function*>(::dlsym(RTLD_NEXT, name));
}

// `part`: the part of a second that is counted beside the seconds, `parts_per_us` of them a microsecond.
template <class Part>
void Move(time_t& seconds, Part& part, std::int64_t parts_per_us) {
  const std::int64_t second = 1'000'000 * parts_per_us;
  const std::int64_t sum = seconds * second + part + OffsetUs() * parts_per_us;
  seconds = sum / second;
  part = sum % second;
}

}  // namespace

extern "C" {

int clock_gettime(clockid_t clock, timespec* time) noexcept {
  static auto* const next = Next<int(clockid_t, timespec*)>("clock_gettime");
  const int result = next(clock, time);
  if (result == 0 && (clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE))
    Move(time->tv_sec, time->tv_nsec, 1000);
  return result;
}

int gettimeofday(timeval* time, void* zone) noexcept {
  static auto* const next = Next<int(timeval*, void*)>("gettimeofday");
  const int result = next(time, zone);
  if (result == 0) Move(time->tv_sec, time->tv_usec, 1);
  return result;
}

ssize_t recvmsg(int socket, msghdr* message, int flags) {
  static auto* const next = Next<ssize_t(int, msghdr*, int)>("recvmsg");
  const ssize_t size = next(socket, message, flags);
  for (cmsghdr* part = size < 0 ? nullptr : CMSG_FIRSTHDR(message); part; part = CMSG_NXTHDR(message, part)) {
    if (part->cmsg_level != SOL_SOCKET || part->cmsg_type != SCM_TIMESTAMP) continue;
    timeval stamp;
    std::memcpy(&stamp, CMSG_DATA(part), sizeof stamp);
    Move(stamp.tv_sec, stamp.tv_usec, 1);
    std::memcpy(CMSG_DATA(part), &stamp, sizeof stamp);
  }
  return size;
}

}  // extern "C"
