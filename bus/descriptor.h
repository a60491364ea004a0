/** An open file or socket. */
#pragma once

#include <unistd.h>

namespace forereach {

/** Closes the descriptor in its destructor. A negative number, as a failed open() returns it, is no descriptor. */
class Descriptor final {
 public:
  explicit Descriptor(int number) : number_(number) {}
  ~Descriptor() {
    if (number_ >= 0) ::close(number_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;

  [[nodiscard]] int get() const { return number_; }

 private:
  const int number_;
};

}  // namespace forereach
