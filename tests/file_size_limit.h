/** Disks that take no more. */
#pragma once

#include <csignal>
#include <cstdint>

#include <sys/resource.h>

#include <gtest/gtest.h>

namespace forereach {

/** While it lives, no file of this process grows beyond so many bytes: writes stop there and fail. */
class FileSizeLimit final {
 public:
  explicit FileSizeLimit(std::uintmax_t bytes) {
    std::signal(SIGXFSZ, SIG_IGN);
    EXPECT_EQ(getrlimit(RLIMIT_FSIZE, &before_), 0);
    Set({static_cast<rlim_t>(bytes), before_.rlim_max});
  }
  ~FileSizeLimit() { Set(before_); }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;

 private:
  static void Set(const rlimit& limit) { EXPECT_EQ(setrlimit(RLIMIT_FSIZE, &limit), 0); }

  rlimit before_{};
};

}  // namespace forereach
