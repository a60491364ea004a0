/** A disk that a test may fill. Needs root. */
#pragma once

#include <filesystem>
#include <string>

#include <sched.h>
#include <sys/mount.h>

namespace forereach {

/** A small file system of this process's own on a directory; `mounted` is false where that is not allowed. */
class SmallDisk final {
 public:
  /** @param options of tmpfs. */
  SmallDisk(const std::string& path, const std::string& options, unsigned long flags = 0) : path_(path) {
    std::filesystem::create_directories(path);
    mounted = ::unshare(CLONE_NEWNS) == 0 && ::mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0 &&
              ::mount("tmpfs", path.c_str(), "tmpfs", flags, options.c_str()) == 0;
  }
  ~SmallDisk() {
    if (mounted) ::umount2(path_.c_str(), MNT_DETACH);
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;

  /** MS_RDONLY or 0. The kernel refuses to make it read-only while a file is open to be written. */
  [[nodiscard]] bool Remount(unsigned long flags) const {
    return ::mount("none", path_.c_str(), nullptr, MS_REMOUNT | flags, nullptr) == 0;
  }

  bool mounted = false;

 private:
  std::string path_;
};

}  // namespace forereach
