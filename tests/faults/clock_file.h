/** The wall clock of a process that runs with the library made of settable_clock.cpp: a file that the process and
whoever sets its clock both map. */
#pragma once

#include <atomic>
#include <cstdint>

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

namespace forereach {

struct ClockFile {
  std::atomic<std::int64_t> offset_us;  ///< The process's wall clock minus the machine's.
  std::atomic<std::int64_t> reads;      ///< How often the process has looked at it.
};
static_assert(std::atomic<std::int64_t>::is_always_lock_free);

/** Makes the file if need be, with zeros. @return null if it cannot be mapped. */
inline ClockFile* MapClockFile(const char* path) {
  const int file = ::open(path, O_RDWR | O_CREAT | O_CLOEXEC, S_IRUSR | S_IWUSR);
  if (file < 0) return nullptr;
  void* memory = MAP_FAILED;
  if (::ftruncate(file, sizeof(ClockFile)) == 0)
    memory = ::mmap(nullptr, sizeof(ClockFile), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  ::close(file);
  return memory == MAP_FAILED ? nullptr : static_cast<ClockFile*>(memory);
}

struct UnmapClockFile {
  void operator()(ClockFile* file) const { ::munmap(file, sizeof *file); }
};

}  // namespace forereach
