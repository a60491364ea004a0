/** What the fuzzers share. A property that fails ends the process, which libFuzzer takes for a finding.

Choices are made so that zero, which is also what an input gives once it is used up, is the choice with nothing odd in
it: short inputs are valid runs, and each byte more makes one thing different. */
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

/** What each target is: one execution. @return whether the input got past everything that refuses; how many do is
printed when the process ends, for a fuzzer in which none does tries little. */
bool Try(Bytes input);

/** A file in memory, which each Write fills anew; its path opens it. Only its owner can read it. */
class MemoryFile final {
 public:
  MemoryFile() : file_(::memfd_create("fuzzed", MFD_CLOEXEC)), path_("/proc/self/fd/" + std::to_string(file_)) {
    Require(file_ >= 0 && ::fchmod(file_, S_IRUSR | S_IWUSR) == 0);
  }

  const std::string& Write(Bytes bytes) {
    Require(::ftruncate(file_, static_cast<off_t>(bytes.size())) == 0);
    Require(::pwrite(file_, bytes.data(), bytes.size(), 0) == static_cast<ssize_t>(bytes.size()));
    return path_;
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
  constexpr double kOdd[] = {0.0,
                             -0.0,
                             1.0,
                             -1.0,
                             0.05,
                             3.0,
                             Limits::infinity(),
                             -Limits::infinity(),
                             Limits::quiet_NaN(),
                             Limits::max(),
                             Limits::lowest(),
                             Limits::min(),
                             Limits::denorm_min(),
                             Limits::epsilon()};
  return input.PickValueInArray(kOdd);
}

/** An odd one, or a plain one. */
inline double AnyNumber(FuzzedDataProvider& input) {
  return input.ConsumeBool() ? OddNumber(input) : input.ConsumeIntegral<std::int8_t>() / 16.0;
}

/** A number within `reach` of `middle`, next to the ends of its range, or any number. */
inline std::int64_t AnyInteger(FuzzedDataProvider& input, std::int64_t middle, std::int64_t reach) {
  switch (input.ConsumeIntegralInRange(0, 4)) {
    case 0: return middle;
    case 1:
      return static_cast<std::int64_t>(static_cast<std::uint64_t>(middle) +  // which may be at an end
                                       static_cast<std::uint64_t>(input.ConsumeIntegralInRange(-reach, reach)));
    case 2: return std::numeric_limits<std::int64_t>::max() - input.ConsumeIntegralInRange(0, 2);
    case 3: return std::numeric_limits<std::int64_t>::min() + input.ConsumeIntegralInRange(0, 2);
    default: return input.ConsumeIntegral<std::int64_t>();
  }
}

/** For sizes and kinds: one that is in use, or any. */
inline std::int16_t AnySmall(FuzzedDataProvider& input, std::int16_t largest) {
  return input.ConsumeBool() ? input.ConsumeIntegral<std::int16_t>()
                             : input.ConsumeIntegralInRange<std::int16_t>(-1, largest);
}

/** The number of anomalies: zero half of the time, otherwise up to seven. */
inline int NumOdd(FuzzedDataProvider& input) { return input.ConsumeIntegralInRange(0, 15) - 8; }

/** Of any values, and up to so many. */
inline std::vector<std::uint8_t> AnyBytes(FuzzedDataProvider& input, std::size_t at_most) {
  return input.ConsumeBytes<std::uint8_t>(input.ConsumeIntegralInRange<std::size_t>(0, at_most));
}

/** Replaces a few of the bytes: by a number of any kind, in the order of the bus, or by any bytes. Or changes the
length. */
inline void Damage(FuzzedDataProvider& input, std::vector<std::uint8_t>& bytes) {
  for (int left = NumOdd(input); left > 0 && !bytes.empty(); --left) {
    const auto at = input.ConsumeIntegralInRange<std::size_t>(0, bytes.size() - 1);
    const auto size = std::min<std::size_t>(bytes.size() - at, std::size_t{1} << input.ConsumeIntegralInRange(0, 3));
    const auto value = BigEndian(input.ConsumeBool() ? std::bit_cast<std::uint64_t>(OddNumber(input))
                                                     : input.ConsumeIntegral<std::uint64_t>());
    std::copy(value.end() - static_cast<std::ptrdiff_t>(size), value.end(),
              bytes.begin() + static_cast<std::ptrdiff_t>(at));
  }
  if (input.ConsumeIntegralInRange(0, 15) == 15)
    bytes.resize(input.ConsumeIntegralInRange<std::size_t>(0, bytes.size() + 8));
}

/** A damaged message of this type, or random bytes. */
template <class Message>
std::vector<std::uint8_t> Damaged(FuzzedDataProvider& input, const Message& message) {
  if (input.ConsumeIntegralInRange(0, 31) == 31) return AnyBytes(input, 64);
  std::vector<std::uint8_t> bytes = Encode(message);
  Damage(input, bytes);
  return bytes;
}

}  // namespace forereach
