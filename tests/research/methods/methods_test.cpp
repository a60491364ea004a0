// What holds of the methods as a family, and of ForeReach among them.

#include "tests/test.h"

#include "research/methods/envelope.h"
#include "tests/research/methods/small_task.h"

namespace forereach::research::methods_test {

TEST(Methods, AreThePapersInItsOrder) {
  std::vector<std::string> names;
  for (const Method& method : Methods()) names.push_back(method.name);
  EXPECT_THAT(names, ElementsAre("ForeReach", "Global calibration", "Regional calibration", "Plug-in Gaussian",
                                 "GP (k=2)", "GP (k=3)", "Alanwar Alg. 6", "CP-SLS-MPC equations", "Scalar envelope"));
}

TEST(Methods, MakeBoundsForBothSystemsThatTheSeedDetermines) {
  const std::array tasks{BicycleTask(150, 1), PointMassTask(100, 1)};
  TracedRandom random(4);
  for (const Task& task : tasks)
    for (const Method& method : Methods()) {
      const auto one = method.make(task.setting(7)), other = method.make(task.setting(7));
      for (int trial = 0; trial < 5; ++trial) {
        const Query query = AnyQueryIn(random, task, 0.05);
        const ResidualBounds bounds = query.Of(*one), again = query.Of(*other);
        for (std::size_t k = 0; k < static_cast<std::size_t>(task.model->num_states()); ++k) {
          EXPECT_LE(bounds.lower[k], bounds.upper[k]) << method.name;
          EXPECT_EQ(bounds.lower[k], again.lower[k]) << method.name;
          EXPECT_EQ(bounds.upper[k], again.upper[k]) << method.name;
        }
      }
    }
}

// The claim of the sound ones.
TEST(Methods, SoundOnesContainTheTrueResidual) {
  TracedRandom random(6);
  const Task bicycle = BicycleTask(60, 2), point_mass = PointMassTask(60, 2);
  const auto check = [&](const Task& task, const auto& residual) {
    for (const Method& method : Methods()) {
      if (method.name != "ForeReach" && method.name != "Alanwar Alg. 6" && method.name != "Scalar envelope") continue;
      const auto enclosure = method.make(task.setting());
      for (int trial = 0; trial < 100; ++trial) {
        const Query query = AnyQueryIn(random, task, 0.2);
        const ResidualBounds bounds = query.Of(*enclosure);
        const Eigen::VectorXd z = query.Point(random);
        std::vector<double> r(static_cast<std::size_t>(task.model->num_states()));
        residual(View(z), std::span<double>(r));
        for (std::size_t k = 0; k < r.size(); ++k) {
          ASSERT_LE(bounds.lower[k], r[k]) << method.name << ' ' << k;
          ASSERT_GE(bounds.upper[k], r[k]) << method.name << ' ' << k;
        }
      }
    }
  };
  check(bicycle, kBicycleResidual);
  check(point_mass, kPointMassResidual);
}

TEST(ForeReach, IsTheEnvelopeByHand) {
  Task task = HandTask(0.5, 1);
  ObserveAt(task, 0, 0, 0.25);
  ObserveAt(task, 2, 1, 0.5);
  // Distances to px in [1, 2], vx = 0: 1 and 1.5.
  const ResidualBounds bounds = HandQuery(1.5, 0, 0.5, 0).Of(*MakeForeReach(task.setting()));
  EXPECT_NEAR(bounds.lower[2], -0.75, 1e-12);
  EXPECT_NEAR(bounds.upper[2], 1.25, 1e-12);
}

TEST(ScalarEnvelope, IsTheOneNormByHand) {
  Task task = HandTask(0.5, 1);
  ObserveAt(task, 0, 0, 0.25);
  const ResidualBounds bounds = HandQuery(1.5, 0, 0.5, 0).Of(*MakeScalarEnvelope(task.setting()));
  EXPECT_NEAR(bounds.lower[2], 0.25 - 2, 1e-12);
  EXPECT_NEAR(bounds.upper[2], 0.25 + 2, 1e-12);
  EXPECT_NEAR(bounds.upper[0], 2, 1e-12);  // a coordinate that was declared constant is no longer
}

TEST(ScalarEnvelope, IsNeverNarrowerThanForeReach) {
  const Task task = BicycleTask(100, 8);
  const auto matrix = MakeForeReach(task.setting()), scalar = MakeScalarEnvelope(task.setting());
  for (TracedRandom random(10); random.Again(50);) {
    const Query query = AnyQueryIn(random, task, 0.1);
    const ResidualBounds tight = query.Of(*matrix), wide = query.Of(*scalar);
    for (std::size_t k = 0; k < 6; ++k) {
      ASSERT_LE(wide.lower[k], tight.lower[k]);
      ASSERT_GE(wide.upper[k], tight.upper[k]);
    }
  }
}

}  // namespace forereach::research::methods_test
