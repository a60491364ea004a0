/** What the fuzzers share. A property that fails ends the process, which libFuzzer takes for a finding. */
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include <fuzzer/FuzzedDataProvider.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "lcmtypes/bad_input.h"
#include "lcmtypes/codec.h"

namespace forereach {

inline void Require(bool holds) {
  if (!holds) std::abort();
}

/** A file in memory, which each Write fills anew; its path opens it. Only its owner can read it. */
class MemoryFile final {
 public:
  MemoryFile() : file_(::memfd_create("fuzzed", MFD_CLOEXEC)), path_("/proc/self/fd/" + std::to_string(file_)) {
    Require(file_ >= 0 && ::fchmod(file_, S_IRUSR | S_IWUSR) == 0);
  }

  const std::string& Write(Bytes bytes) {
    Require(::ftruncate(file_, 0) == 0);
    Require(::pwrite(file_, bytes.data(), bytes.size(), 0) == static_cast<ssize_t>(bytes.size()));
    return path_;
  }
  const std::string& Write(std::string_view text) {
    return Write(Bytes(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
  }

 private:
  int file_;
  std::string path_;
};

/** Calls `read`, which may refuse its input in the one way in which people are told of it: any other exception ends the
process. @return whether it did not refuse. */
template <class Read>
bool IsTaken(Read read) {
  try {
    read();
    return true;
  } catch (const BadInput& refusal) {
    Require(*refusal.what() != '\0');
    return false;
  }
}

/** Numbers that are likelier to break something than others. */
inline double OddNumber(FuzzedDataProvider& input) {
  using Limits = std::numeric_limits<double>;
  constexpr double kOdd[] = {0.0, -0.0, 1.0, -1.0, 0.05, 3.0, Limits::infinity(), -Limits::infinity(), Limits::quiet_NaN(),
                             Limits::max(), Limits::lowest(), Limits::min(), Limits::denorm_min(), Limits::epsilon()};
  return input.PickValueInArray(kOdd);
}

/** Replaces a few of the bytes: by a number of any kind, in the order of the bus, or by any bytes. */
inline void Damage(FuzzedDataProvider& input, std::vector<std::uint8_t>& bytes) {
  for (int left = input.ConsumeIntegralInRange(0, 8); left > 0 && !bytes.empty(); --left) {
    const auto at = input.ConsumeIntegralInRange<std::size_t>(0, bytes.size() - 1);
    const auto size = std::min<std::size_t>(bytes.size() - at, std::size_t{1} << input.ConsumeIntegralInRange(0, 3));
    std::uint64_t value = input.ConsumeBool() ? std::bit_cast<std::uint64_t>(OddNumber(input)) : input.ConsumeIntegral<std::uint64_t>();
    for (std::size_t i = size; i-- > 0; value >>= 8) bytes[at + i] = static_cast<std::uint8_t>(value);
  }
  if (input.ConsumeIntegralInRange(0, 15) == 0) bytes.resize(input.ConsumeIntegralInRange<std::size_t>(0, bytes.size() + 8));
}

/** A message of this type that was damaged on its way, or something else altogether. */
template <class Message>
std::vector<std::uint8_t> Damaged(FuzzedDataProvider& input, const Message& message) {
  if (input.ConsumeIntegralInRange(0, 31) == 0) return input.ConsumeBytes<std::uint8_t>(input.ConsumeIntegralInRange<std::size_t>(0, 64));
  std::vector<std::uint8_t> bytes = Encode(message);
  Damage(input, bytes);
  return bytes;
}

}  // namespace forereach
