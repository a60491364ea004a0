#include "forereach/numerics/arithmetic.h"

#include <atomic>
#include <stdexcept>

namespace forereach {
namespace {

std::atomic<bool> all_files_are_as_written{true};

// Halfway cases of a sum tell the modes apart.
bool RoundsToNearest() {
  volatile double one = 1, half_unit = 0x1p-53, more = 0x1.8p-53;
  return one + half_unit == 1 && one + more == 1 + 0x1p-52 && -one - half_unit == -1 && -one - more == -1 - 0x1p-52;
}

bool HasSubnormals() {
  volatile double smallest = 0x1p-1074, smallest_normal = 0x1p-1022;
  volatile double half = smallest_normal / 2, twice = smallest * 2;
  return half > 0 && twice > smallest && smallest > 0;
}

}  // namespace

void RequireExactArithmetic() {
  if (!all_files_are_as_written)
    throw std::runtime_error(
        "this program has a file that includes ForeReach's headers and is compiled so that operations are fused or "
        "reordered, and bounds need each rounded by itself: compile with -ffp-contract=off and without -ffast-math");
  if (!RoundsToNearest())
    throw std::runtime_error("this thread does not round to nearest, which bounds need: see fesetround");
  if (!HasSubnormals())
    throw std::runtime_error(
        "this thread takes subnormal numbers for zero, and bounds need them: link without -ffast-math and -Ofast, and "
        "do "
        "not set FTZ or DAZ");
}

namespace internal {

void ReportFile(bool computes_as_written) noexcept {
  if (!computes_as_written) all_files_are_as_written = false;
}

}  // namespace internal
}  // namespace forereach
