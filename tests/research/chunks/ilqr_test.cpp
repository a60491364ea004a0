#include "research/chunks/ilqr.h"

#include "tests/test.h"

#include "forereach/dynamics/models/named_models.h"
#include "research/chunks/demonstrations.h"

namespace forereach::research::ilqr_test {

double Cost(const NominalModel& model, const Eigen::VectorXd& start, const Eigen::MatrixXd& controls,
            const Eigen::MatrixXd& reference, const TrackingWeights& weights) {
  return TrackingCost(Rollout(model, start, controls), controls, reference, weights);
}

// A linear model with a quadratic cost has one stationary point: the sum's gradient is zero there.
TEST(Ilqr, IsTheOptimumOfAPointMass) {
  const auto model = MakePointMass(0.15);
  const TrackingWeights weights{Eigen::VectorXd{{1, 2, 0.1, 0.2}}, Eigen::VectorXd{{5, 5, 1, 1}},
                                Eigen::VectorXd{{0.3, 0.7}}};
  const Eigen::VectorXd start = Eigen::VectorXd{{1, -1, 0.5, 0}};
  const Eigen::MatrixXd reference = Eigen::MatrixXd::Zero(4, 11);
  const Box inputs(Eigen::VectorXd{{-9, -9}}, Eigen::VectorXd{{9, 9}});
  const Eigen::MatrixXd best = Track(*model, start, reference, weights, inputs);
  constexpr double kStep = 1e-4;
  for (Eigen::Index i = 0; i < best.size(); ++i) {
    Eigen::MatrixXd more = best, less = best;
    more.reshaped()[i] += kStep;
    less.reshaped()[i] -= kStep;
    const double slope =
        (Cost(*model, start, more, reference, weights) - Cost(*model, start, less, reference, weights)) / (2 * kStep);
    EXPECT_NEAR(slope, 0, 1e-6) << i;
  }
}

TEST(Ilqr, NothingNearbyCostsLessWhereNoControlIsCut) {
  const auto& model = *BicycleSystem().model;
  int uncut = 0;
  for (int i = 0; i < 24; ++i) {
    Random random{7, static_cast<std::uint64_t>(i)};
    const Errand errand = i % 2 ? DrawErrand(kGroups[i % 3], random) : DrawCruise(random);
    const Eigen::MatrixXd& reference = errand.reference.states;
    const Eigen::MatrixXd best = Demonstrate(errand);
    if (best.row(0).cwiseAbs().maxCoeff() == 10 || best.row(1).cwiseAbs().maxCoeff() == 1) continue;
    ++uncut;
    const double cost = Cost(model, errand.state, best, reference, ExpertWeights());
    EXPECT_LT(cost, Cost(model, errand.state, Eigen::MatrixXd::Zero(2, kBlockSteps), reference, ExpertWeights()));
    for (int trial = 0; trial < 40; ++trial) {
      Eigen::MatrixXd other = best;
      for (double& u : other.reshaped()) u += 0.05 * random.Uniform(-1, 1);
      EXPECT_GT(Cost(model, errand.state, other, reference, ExpertWeights()), cost * (1 - 1e-6)) << i;
    }
  }
  EXPECT_GE(uncut, 12);
}

TEST(Ilqr, ControlsStayInTheirBounds) {
  for (int i = 0; i < 40; ++i) {
    Random random{8, static_cast<std::uint64_t>(i)};
    const Eigen::MatrixXd controls = Demonstrate(DrawCruise(random));
    EXPECT_LE(controls.row(0).cwiseAbs().maxCoeff(), 10);
    EXPECT_LE(controls.row(1).cwiseAbs().maxCoeff(), 1);
  }
}

// It is an expert: half a metre, and a tenth of a radian, after two seconds at 9 to 15 m/s.
TEST(Ilqr, TracksTheReferencesOfEveryGroup) {
  for (const Group group : kGroups)
    for (int i = 0; i < 10; ++i) {
      Random random{9, static_cast<std::uint64_t>(group), static_cast<std::uint64_t>(i)};
      const Errand errand = DrawErrand(group, random);
      const Eigen::VectorXd end = Rollout(*BicycleSystem().model, errand.state, Demonstrate(errand)).rightCols<1>();
      const Eigen::VectorXd miss = (end - errand.reference.states.rightCols<1>()).cwiseAbs();
      EXPECT_LT(miss.head<2>().norm(), 0.5) << NameOf(group) << i;
      EXPECT_LT(miss[2], 0.1) << NameOf(group) << i;
    }
}

}  // namespace forereach::research::ilqr_test
