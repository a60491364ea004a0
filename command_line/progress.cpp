#include "command_line/progress.h"

#include <unistd.h>

#include <cmath>
#include <iostream>

namespace forereach {
namespace {

constexpr double kPatience = 2, kBetween = 0.1;  // s
constexpr std::size_t kWidth = 30;

}  // namespace

Progress::Progress(std::string what, std::size_t total)
    : what_(std::move(what)),
      total_(total),
      terminal_(isatty(STDERR_FILENO) != 0),
      begin_(std::chrono::steady_clock::now()) {}

Progress::~Progress() {
  if (shown_at_ > 0) std::cerr << "\r\x1b[K" << std::flush;
}

void Progress::Advance(std::size_t count) {
  const std::lock_guard lock(mutex_);
  done_ += count;
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
  if (!terminal_ || seconds < kPatience || seconds < shown_at_ + kBetween) return;
  shown_at_ = seconds;
  std::cerr << "\r\x1b[K" << Line(what_, done_, total_, seconds) << std::flush;
}

std::string Progress::Line(const std::string& what, std::size_t done, std::size_t total, double seconds) {
  const std::size_t full = total == 0 ? kWidth : done * kWidth / total;
  std::string line(1, '[');
  line.append(full, '#').append(kWidth - full, '.');
  line += "] " + std::to_string(done) + " of " + std::to_string(total) + " " + what;
  if (done == 0 || done >= total) return line;
  const double left = seconds / static_cast<double>(done) * static_cast<double>(total - done);
  return line + ", " + std::to_string(std::lround(std::ceil(left))) + " s left";
}

}  // namespace forereach
