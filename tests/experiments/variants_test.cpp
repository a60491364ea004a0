// Variants: the same target, split in another way; their declarations bound the slopes of what they leave.
#include "experiments/variants.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "tests/oracle/random.h"

namespace forereach::experiments {
namespace {

struct Point {
  std::vector<double> z, residual, next;
};

Point AnyPoint(Random& random, const System& system) {
  const auto n = static_cast<std::size_t>(system.num_states());
  Point point{{}, std::vector<double>(n), std::vector<double>(n)};
  for (const Interval& range : system.domain.Ranges()) point.z.push_back(random.Uniform(range.lower, range.upper));
  system.step(point.z, point.residual, point.next);
  return point;
}

void ExpectDeclared(const System& system, int seed) {
  Random random(seed);
  SCOPED_TRACE(system.name + ", " + random.trace());
  std::vector<double> nominal(static_cast<std::size_t>(system.num_states()));
  Point before = AnyPoint(random, system);
  for (int i = 0; i < 2000; ++i) {
    const Point at = AnyPoint(random, system);
    system.model->Evaluate(at.z, nominal);
    for (std::size_t k = 0; k < nominal.size(); ++k) {
      EXPECT_NEAR(nominal[k] + at.residual[k], at.next[k], 1e-12);
      double reach = 1e-12;  // rounding of both residuals
      for (std::size_t l = 0; l < at.z.size(); ++l)
        reach += system.deployed(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(l)) *
                 std::abs(at.z[l] - before.z[l]);
      EXPECT_LE(std::abs(at.residual[k] - before.residual[k]), reach);
    }
    before = at;
  }
}

TEST(Degraded, LeavesTheTargetAndDeclaresWhatTheModelLacks) {
  for (const System* system : Systems())
    for (const double part : {0.02, 0.5, 0.9}) {
      const System& degraded = Degraded(*system, part);
      ExpectDeclared(degraded, 1);
      Random random(2);
      const Point at = AnyPoint(random, *system);
      std::vector<double> residual(at.residual.size()), next(at.next.size());
      degraded.step(at.z, residual, next);
      EXPECT_EQ(next, at.next);
      EXPECT_EQ(&degraded, &Degraded(*system, part));
      // Nothing is known of x but its own part: its slope by itself is the part lacking.
      EXPECT_NEAR(degraded.deployed(0, 0), part, 1e-12);
    }
}

TEST(LinearPointMass, IsDeclaredExactly) {
  ExpectDeclared(LinearPointMass(), 3);
  EXPECT_NEAR(LinearPointMass().deployed(2, 2), 0.15 * 0.15 * 0.4, 1e-12);
}

}  // namespace
}  // namespace forereach::experiments
