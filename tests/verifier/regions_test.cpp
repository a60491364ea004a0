// Certificates of residuals with regions: what the certifier claims, the verifier derives by its own ways.
#include "tests/test.h"

#include "forereach/residual/region_grid.h"
#include "tests/oracle/region_problems.h"
#include "tests/oracle/traced_random.h"
#include "tests/verifier/is_confirmed.h"
#include "tests/verifier/record.h"
#include "verifier/ways.h"

namespace forereach::verifier::regions_test {

TEST(RegionalCertificates, AreConfirmedUnlessTheyAreTooNarrowOrTheRegionsAreNotDeclared) {
  int certified = 0, need_regions = 0, falsified = 0;
  for (TracedRandom random(2121); random.Again(80);) {
    SCOPED_TRACE("trial " + std::to_string(random.trial()));
    const bool bicycle = random.Coin();
    auto problem = AnyRegionalProblem(random, bicycle, random.Integer(2, 8), random.Coin());
    if (random.Coin(0.3)) problem = Recorded(random, *problem);
    if (random.Coin(0.3)) Shift(random, *problem);
    const Certifier certifier(problem);
    ASSERT_FALSE(certifier.violation());
    const Verifier judge(problem, MethodOf(*problem));
    forereach::Tube tube;
    const Query query = AnyQuery(random, *problem);
    const Decision decision = certifier.Certify(query.plan(), query.initial_set, query.obstacles, tube);
    if (decision.outcome != Outcome::kCertified) continue;
    ++certified;
    const Certificate certificate = CertificateOf(certifier, query.plan(), query.initial_set, query.obstacles, tube);
    EXPECT_TRUE(IsConfirmed(judge.Verify(certificate)));
    Certificate narrower = certificate;
    RecordedSlice& last = narrower.slices.back();
    Eigen::Index widest = 0;
    (last.upper - last.lower).maxCoeff(&widest);
    last.upper[widest] -= 0.6 * (last.upper - last.lower)[widest];
    EXPECT_NE(judge.Verify(narrower).status, Status::kConfirmed);
    // By L alone the tube is wider.
    const auto plain = std::make_shared<Problem>(*problem);
    plain->declaration.regions = {};
    const Certifier wide(plain);
    forereach::Tube wider;
    static_cast<void>(wide.Certify(query.plan(), query.initial_set, {}, wider));
    const bool is_narrower =
        wider.length() < tube.length() || wider.half_width(tube.length())[0] > 1.01 * tube.half_width(tube.length())[0];
    if (!is_narrower) continue;
    ++need_regions;
    EXPECT_NE(Verifier(plain, MethodOf(*plain)).Verify(certificate).status, Status::kConfirmed);
    // Data that contradict the regions and not L.
    const auto false_data = std::make_shared<Problem>(*problem);
    false_data->declaration.regions = {Region{{{0, {-1e3, 1e3}}}, 0 * problem->declaration.lipschitz}};
    const Verdict of_false = Verifier(false_data, MethodOf(*false_data)).Verify(certificate);
    falsified += of_false.failure.what.find("consistent with data") != std::string::npos;
  }
  EXPECT_GT(certified, 25);
  EXPECT_GT(need_regions, 5);
  EXPECT_GT(falsified, 2);
}

TEST(Ways, BoundWhatTheGridSays) {
  for (TracedRandom random(2123); random.Again(300);) {
    const auto problem = AnyRegionalProblem(random, random.Coin(), 1, true);
    const Declaration& declaration = problem->declaration;
    const auto [lower, upper] = problem->domain.Corners();
    const RegionGrid grid(declaration, lower, upper);
    const Ways ways(*problem);
    RegionGrid::Box box;
    Ways::Box same;
    for (std::size_t l = 0; l < lower.size(); ++l) {
      box.lower[l] = random.Coin(0.3) ? random.Integer(-2, 2) * upper[l] / 2 : random.Uniform(lower[l], upper[l]);
      box.upper[l] = random.Coin(0.3) ? box.lower[l] : random.Uniform(box.lower[l], upper[l]);
      same.emplace_back(box.lower[l], box.upper[l]);
    }
    for (int k = 0; k < problem->model->num_states(); ++k) {
      const auto at = static_cast<std::size_t>(k);
      EXPECT_EQ(ways.Largest(&Region::disturbance, k, declaration.DisturbanceBound(k), same),
                grid.LargestBound(RegionBound::kDisturbance, at, box));
      EXPECT_EQ(ways.Largest(&Region::noise_bound, k, declaration.noise_bound[k], same),
                grid.LargestBound(RegionBound::kNoise, at, box));
      EXPECT_EQ(ways.Largest(&Region::bound, k, kInfinity, same), grid.LargestBound(RegionBound::kResidual, at, box));
    }
  }
}

// The grid's costs are never below those of the ways, and both find the same where no point lies on a side.
TEST(Ways, CostWhatTheGridSays) {
  int equal = 0;
  for (TracedRandom random(2122); random.Again(300);) {
    const auto problem = AnyRegionalProblem(random, random.Coin(), 1, false);
    const auto [lower, upper] = problem->domain.Corners();
    const RegionGrid grid(problem->declaration, lower, upper);
    const Ways ways(*problem);
    RegionGrid::Box from, to;
    Ways::Box box;
    Eigen::VectorXd at(std::ssize(lower));
    for (std::size_t l = 0; l < lower.size(); ++l) {
      from.lower[l] = from.upper[l] = at[static_cast<Eigen::Index>(l)] = random.Uniform(lower[l], upper[l]);
      to.lower[l] = random.Uniform(lower[l], upper[l]);
      to.upper[l] = random.Uniform(to.lower[l], upper[l]);
      box.emplace_back(to.lower[l], to.upper[l]);
    }
    grid.Find(from);
    grid.Find(to);
    for (std::size_t i = 0; i < grid.rows().size(); ++i) {
      EXPECT_TRUE(ways.Narrow(grid.rows()[i]));
      const double cost = grid.CostUpper(i, from, to);
      const Real least = ways.Cheapest<Real>(grid.rows()[i], at, box);
      EXPECT_TRUE(CertainlyAtMost(least, Real(cost)));
      EXPECT_NEAR(cost, least.ToDouble(), 1e-13 * cost);
      EXPECT_NEAR(ways.Cheapest<double>(grid.rows()[i], at, box), cost, 1e-13 * cost);
      ++equal;
    }
  }
  EXPECT_GT(equal, 500);
}

}  // namespace forereach::verifier::regions_test
