// The paper's two systems: the deployed declarations are valid, smaller ones are not, and the data have the right form.
#include "research/systems.h"

#include "tests/test.h"

#include "forereach/residual/consistency.h"
#include "forereach/residual/observations.h"
#include "research/norm_ratio.h"
#include "research/random.h"
#include "research/scenarios.h"

namespace forereach::research::systems_test {

// The largest |r_k(z) - r_k(z')| / sum_l L_kl |z_l - z'_l| over random near pairs of the domain.
double LargestSlopeRatio(const System& system, const Eigen::MatrixXd& lipschitz) {
  Random random{1};
  const auto d = static_cast<std::size_t>(system.model->num_variables());
  const auto n = static_cast<std::size_t>(system.num_states());
  Eigen::VectorXd lower(d), upper(d);
  lower << system.domain.state.lower(), system.domain.input.lower();
  upper << system.domain.state.upper(), system.domain.input.upper();
  std::vector<double> a(d), b(d), residual_a(n), residual_b(n), next(n);
  double largest = 0;
  for (int i = 0; i < 200'000; ++i) {
    for (std::size_t l = 0; l < d; ++l) {
      const auto row = static_cast<Eigen::Index>(l);
      a[l] = random.Uniform(lower[row], upper[row]);
      b[l] = std::clamp(a[l] + random.Uniform(-1e-3, 1e-3), lower[row], upper[row]);
    }
    if (!system.domain.Contains(a) || !system.domain.Contains(b)) continue;
    system.step(a, residual_a, next);
    system.step(b, residual_b, next);
    for (std::size_t k = 0; k < n; ++k) {
      double allowed = 0;
      for (std::size_t l = 0; l < d; ++l)
        allowed += lipschitz(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(l)) * std::abs(a[l] - b[l]);
      const double difference = std::abs(residual_a[k] - residual_b[k]);
      if (difference > 0) largest = std::max(largest, difference / allowed);
    }
  }
  return largest;
}

TEST(Systems, TheDeployedDeclarationHoldsAndHalfOfItDoesNot) {
  for (const System* system : Systems()) {
    const double ratio = LargestSlopeRatio(*system, system->deployed);
    EXPECT_LT(ratio, 1) << system->name;
    EXPECT_GT(ratio, 0.5) << system->name;
  }
}

TEST(Systems, NormRatiosAreThePapersToTheDigit) {
  EXPECT_EQ(std::round(NormRatio(PointMassSystem(), PointMassSystem().deployed / 1.5) * 1000), 18481);
  EXPECT_EQ(std::round(NormRatio(BicycleSystem(), BicycleSystem().deployed / 1.5) * 1000), 11368);
}

// Nearly half of the bicycle's region has next to no residual, so points drawn at random miss its median by a quarter.
TEST(Systems, TheMedianResidualIsThatOfTheRegionAndNotOfPointsDrawn) {
  const double median = MedianResidual(BicycleSystem());
  EXPECT_NEAR(median, 1.079e-4, 1e-7);
  EXPECT_NEAR(MedianResidual(BicycleSystem(), 500) / median, 1, 0.005);
  EXPECT_NEAR(MedianResidual(PointMassSystem(), 250) / MedianResidual(PointMassSystem()), 1, 0.001);
}

TEST(Systems, NamesAreKnown) {
  EXPECT_EQ(&SystemNamed("bicycle"), &BicycleSystem());
  EXPECT_EQ(&SystemNamed("point_mass"), &PointMassSystem());
  EXPECT_THROW((void)SystemNamed("unicycle"), std::invalid_argument);
}

TEST(Data, OfASmallerCountAreTheFirstOfALarger) {
  for (const System* system : Systems()) {
    const Transitions few = MakeData(*system, Layout::kCorridor, 3, 25, 1e-3),
                      many = MakeData(*system, Layout::kCorridor, 3, 60, 1e-3);
    EXPECT_FIELDS(few, (z, many.z.topRows(25)), (x_next, many.x_next.topRows(25)));
    EXPECT_NE(few.z, MakeData(*system, Layout::kCorridor, 4, 25, 1e-3).z);
  }
}

TEST(Data, LieInTheirRegionAndTheDomain) {
  for (const System* system : Systems()) {
    const Transitions data = MakeData(*system, Layout::kCorridor, 0, 400, 0);
    for (int i = 0; i < data.size(); ++i) {
      const Eigen::VectorXd z = data.z.row(i);
      EXPECT_TRUE(system->data_region.Contains(z));
      EXPECT_TRUE(system->domain.Contains({z.data(), static_cast<std::size_t>(z.size())}));
    }
  }
}

TEST(Data, NoiseMovesNoPointAndStaysWithinItsBound) {
  const System& bicycle = BicycleSystem();
  const double scale = 1e-3;
  const Transitions quiet = MakeData(bicycle, Layout::kCorridor, 0, 400, 0),
                    noisy = MakeData(bicycle, Layout::kCorridor, 0, 400, scale);
  EXPECT_EQ(quiet.z, noisy.z);
  const Eigen::MatrixXd noise = noisy.x_next - quiet.x_next;
  EXPECT_LE(noise.cwiseAbs().maxCoeff(), NoiseBound(scale) + 1e-14);
  EXPECT_GT(noise.cwiseAbs().maxCoeff(), 2.5 * scale);
  // 2400 draws: the mean is within five standard errors, the spread that of a Gaussian cut at 3 s, 0.9866 s.
  EXPECT_LT(std::abs(noise.mean()), 5 * scale / std::sqrt(2400.0));
  EXPECT_NEAR(std::sqrt(noise.array().square().mean()), 0.9866 * scale, 0.05 * scale);
}

TEST(Data, FromBelowTheKneeShowNothing) {
  for (const System* system : Systems()) {
    const Transitions data = MakeData(*system, Layout::kBelowKnee, 0, 400, 0);
    const Declaration hundredth{system->deployed / 100, Eigen::VectorXd::Zero(system->num_states())};
    EXPECT_FALSE(FindViolation(hundredth, Observe(*system->model, data))) << system->name;
  }
}

TEST(Data, DoNotContradictTheDeployedDeclaration) {
  for (const System* system : Systems())
    for (const double noise : {0.0, system->noise_scale}) {
      const Transitions data = MakeData(*system, Layout::kCorridor, 0, 400, noise);
      const Declaration declaration{system->deployed,
                                    Eigen::VectorXd::Constant(system->num_states(), NoiseBound(noise))};
      EXPECT_FALSE(FindViolation(declaration, Observe(*system->model, data))) << system->name << " " << noise;
      const Declaration tenth{system->deployed / 10, declaration.noise_bound};
      EXPECT_TRUE(FindViolation(tenth, Observe(*system->model, data))) << system->name << " " << noise;
    }
}

}  // namespace forereach::research::systems_test
