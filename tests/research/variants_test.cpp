// Variants: the same target, split in another way; their declarations bound the slopes of the rest.
#include "research/variants.h"

#include "tests/test.h"

#include "research/scenarios.h"
#include "tests/oracle/random.h"

namespace forereach::research::variants_test {

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

TEST(Degraded, OfAnyReadingDeclaresTheSlopesOfItsResidual) {
  for (const System* system : Systems())
    for (const Lacking lacking :
         {Lacking::kModel, Lacking::kMotion, Lacking::kDeclaration, Lacking::kDeclarationOfMotion}) {
      const System& degraded = Degraded(*system, 0.3, lacking);
      ExpectDeclared(degraded, 3);
      const bool is_whole = lacking == Lacking::kDeclaration || lacking == Lacking::kDeclarationOfMotion;
      EXPECT_EQ(degraded.model == system->model, is_whole) << degraded.name;
      // Of the motion nothing lacks that the state keeps by itself.
      const bool of_motion = lacking == Lacking::kMotion || lacking == Lacking::kDeclarationOfMotion;
      EXPECT_EQ(degraded.deployed(0, 0) > 0.2, !of_motion) << degraded.name;
    }
}

TEST(Degraded, OfMotionMovesByAPart) {
  const System& half = Degraded(PointMassSystem(), 0.5, Lacking::kMotion);
  std::vector<double> next(4);
  half.model->Evaluate(std::vector<double>{1, 2, 3, -4, 0, 0}, next);
  EXPECT_NEAR(next[0], 1 + 0.5 * 0.15 * 3, 1e-12);
  EXPECT_NEAR(next[1], 2 - 0.5 * 0.15 * 4, 1e-12);
  EXPECT_NEAR(next[2], 3, 1e-12);
}

TEST(WithFewerPlans, KeepsTheFirstPlans) {
  const System& few = WithFewerPlans(BicycleSystem(), 40);
  EXPECT_EQ(few.scenarios, 40);
  EXPECT_NE(few.name, BicycleSystem().name);
  EXPECT_EQ(MakeScenario(few, Group::kC, 1, 7).center, MakeScenario(BicycleSystem(), Group::kC, 1, 7).center);
  EXPECT_EQ(WithFewerPlans(PointMassSystem(), 10'000).scenarios, PointMassSystem().scenarios);
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

// The largest |d r_k / d z_l| at speeds above the knee and angles all around, by differences.
double SteepestBeyondTheKnee(const System& system, std::size_t k, std::size_t l) {
  constexpr double kStep = 1e-5;
  double steepest = 0;
  for (int i = 0; i < 50 * 200; ++i) {
    const double speed = 5.4 - 0.09 * (i / 200), angle = 2 * std::numbers::pi * (i % 200) / 200;
    std::vector<double> z{0, 0, speed * std::cos(angle), speed * std::sin(angle), 0, 0}, before(4), after(4), next(4);
    system.step(z, before, next);
    z[l] += kStep;
    system.step(z, after, next);
    steepest = std::max(steepest, std::abs(after[k] - before[k]) / kStep);
  }
  return steepest;
}

TEST(Escaping, IsDeclaredWithinAPercent) {
  for (const double lambda : {1.0, 32.0}) {
    const System& system = Escaping(lambda);
    ExpectDeclared(system, 4);
    for (const int k : {0, 1, 2, 3})
      for (const int l : {2, 3}) {
        const double steepest = SteepestBeyondTheKnee(system, static_cast<std::size_t>(k), static_cast<std::size_t>(l));
        EXPECT_NEAR(steepest / system.deployed(k, l), 1, 0.01) << lambda << " " << k << " " << l;
      }
  }
  EXPECT_GT(Escaping(32).deployed(2, 2), 25 * Escaping(1).deployed(2, 2));
}

TEST(Escaping, MembersAgreeBelowTheKneeAndTheFirstIsTheKnee) {
  const auto successors = [](const System& system, Layout layout) {
    return MakeData(system, layout, 0, 100, 0).x_next;
  };
  for (const Layout layout : {Layout::kBelowKnee, Layout::kCorridor})
    EXPECT_EQ(successors(Escaping(1), layout), successors(PointMassSystem(), layout));
  EXPECT_EQ(successors(Escaping(32), Layout::kBelowKnee), successors(Escaping(1), Layout::kBelowKnee));
  EXPECT_NE(successors(Escaping(32), Layout::kCorridor), successors(Escaping(1), Layout::kCorridor));
  EXPECT_EQ(EscapeAt(32, 0.9), EscapeAt(1, 0.9));
  EXPECT_GT(EscapeAt(32, 3), 29 * EscapeAt(1, 3));
}

}  // namespace forereach::research::variants_test
