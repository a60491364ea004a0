/** A problem whose numbers are known by hand, and what the verifier says of certificates of it. */
#pragma once

#include "tests/test.h"
#include "tests/worlds.h"
#include "verifier/verifier.h"

namespace forereach::verifier {

inline constexpr double kTiny = std::numeric_limits<double>::denorm_min();

inline double Up(double x) { return std::nextafter(x, HUGE_VAL); }
inline double Down(double x) { return std::nextafter(x, -HUGE_VAL); }

// dt = 1/2, so that every number of a step is a double. The one observation is of the nominal model: its residual is
// known to a last bit of zero, the smallest double there is, in every coordinate.
inline std::shared_ptr<Problem> Halves() {
  return std::make_shared<Problem>(WorldOf(MakePointMass(0.5), Within({8, 8, 8, 8}), Within({2, 2})));
}

inline Verdict Judge(const std::shared_ptr<const Problem>& problem, const Certificate& certificate,
                     Method method = Method::kPaper) {
  return Verifier(problem, method).Verify(certificate);
}

inline void ExpectConfirmed(const Verdict& verdict) {
  EXPECT_EQ(verdict.status, Status::kConfirmed) << verdict.failure.what << ": " << verdict.failure.found;
}

inline void ExpectRefuted(const Verdict& verdict, int step, const std::string& what) {
  EXPECT_FIELDS(verdict, (status, Status::kRefuted), (failure.step, step));
  EXPECT_THAT(verdict.failure.what, HasSubstr(what));
}

}  // namespace forereach::verifier
