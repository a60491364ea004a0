// Affine consistency sets worked by hand.
#include "research/methods/affine.h"

#include "tests/test.h"

#include "tests/research/methods/small_task.h"

namespace forereach::research::affine_test {

// r_vx at vx = 0 and 1 is 0 and 2, each known to 0.1.
Task TwoPoints() {
  Task task = HandTask(0, 1);
  task.declaration.noise_bound[2] = 0.1;
  ObserveAt(task, 0, 0, 0);
  ObserveAt(task, 0, 1, 2);
  return task;
}

TEST(AffineEnclosure, ExtrapolatesWhatTwoObservationsLeave) {
  const Task task = TwoPoints();
  const AffineEnclosure affine(task.setting());
  EXPECT_TRUE(affine.IsConsistent());
  // r(2) = 2 r(1) - r(0), each within 0.1: 4 +- 0.3.
  const ResidualBounds beyond = HandQuery(0, 2).Of(affine);
  EXPECT_NEAR(beyond.lower[2], 3.7, 1e-8);
  EXPECT_NEAR(beyond.upper[2], 4.3, 1e-8);
  EXPECT_LE(beyond.lower[2], 3.7);
  EXPECT_GE(beyond.upper[2], 4.3);
  // From the right end of [1, 2] up, from its left end down.
  const ResidualBounds wide = HandQuery(0, 1.5, 0, 0.5).Of(affine);
  EXPECT_NEAR(wide.lower[2], 1.9, 1e-8);
  EXPECT_NEAR(wide.upper[2], 4.3, 1e-8);
  // The other coordinates are constant and known.
  EXPECT_NEAR(wide.lower[0], 0, 1e-8);
  EXPECT_NEAR(wide.upper[0], 0, 1e-8);
}

TEST(AffineEnclosure, IsEmptyWhereNoLineFits) {
  Task task = TwoPoints();
  ObserveAt(task, 0, 0.5, 1.25);  // the line leaves 1 +- 0.1, and this one 1.15 at least
  const AffineEnclosure affine(task.setting());
  EXPECT_FALSE(affine.IsConsistent());
  const ResidualBounds bounds = HandQuery(0, 0).Of(affine);
  EXPECT_GT(bounds.lower[2], bounds.upper[2]);
}

TEST(AffineEnclosure, OfTooFewObservationsIsUnbounded) {
  Task task = HandTask(0, 1);
  ObserveAt(task, 0, 1, 2);
  EXPECT_FIELDS(HandQuery(0, 3).Of(AffineEnclosure(task.setting())), (lower[2], -kInfinity), (upper[2], kInfinity));
}

}  // namespace forereach::research::affine_test
