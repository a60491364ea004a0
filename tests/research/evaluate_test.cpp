// One plan under one method: the certifier's own answers, and a coverage test that detects missing coverage.
#include "research/evaluate.h"

#include "tests/test.h"

#include "forereach/certify/certifier.h"
#include "research/cell.h"
#include "research/methods/envelope.h"

namespace forereach::research::evaluate_test {

// Claims that the residual is zero.
struct NoResidual final : ResidualEnclosure {
  void Enclose(const QuerySet& query, ResidualBounds& bounds) const noexcept override {
    for (std::size_t k = 0; k < query.half_width.size(); ++k) bounds.lower[k] = bounds.upper[k] = 0;
    bounds.capped = false;
  }
};

// Claims that it is anywhere in +-bound in each coordinate.
class Bounded final : public ResidualEnclosure {
 public:
  explicit Bounded(double bound) : bound_(bound) {}
  void Enclose(const QuerySet& query, ResidualBounds& bounds) const noexcept override {
    for (std::size_t k = 0; k < query.half_width.size(); ++k) bounds.lower[k] = -bound_, bounds.upper[k] = bound_;
    bounds.capped = false;
  }

 private:
  double bound_;
};

struct Deployed {
  const System& system;
  Transitions data = MakeData(system, Layout::kCorridor, 0, 100, 0);
  Declaration declaration{system.deployed, Eigen::VectorXd::Zero(system.num_states())};
  std::unique_ptr<ResidualEnclosure> envelope =
      PaperCell(system, 100, 0, 0).method.make({*system.model, system.domain, declaration, data, 0});
};

// Of each system, the answers to the first scenarios of each group. @param judge takes the system, scenario and answer.
template <class Judge>
void ForEachAnswer(int scenarios, Judge judge) {
  for (const System* system : Systems()) {
    const Deployed deployed{*system};
    const Evaluator evaluator(*system, *deployed.envelope, 5);
    Answer answer;
    for (const Group group : kGroups)
      for (int i = 0; i < scenarios; ++i) {
        SCOPED_TRACE(system->name + (NameOf(group) + std::to_string(i)));
        const Scenario s = MakeScenario(*system, group, 0, i);
        evaluator.Certify(s, answer);
        judge(*system, s, answer);
      }
  }
}

TEST(Evaluator, AnswersAsTheCertifierDoes) {
  for (const System* system : Systems()) {
    const Deployed deployed{*system};
    auto problem = std::make_shared<Problem>();
    problem->model = system->model;
    problem->domain = system->domain;
    problem->declaration = deployed.declaration;
    problem->transitions = deployed.data;
    problem->projection = system->projection();
    problem->method = forereach::Method::kPaper;
    const Certifier certifier(problem);
    const Evaluator evaluator(*system, *deployed.envelope, 5);
    Tube tube;
    Answer answer;
    int outcomes[5] = {};
    for (const Group group : kGroups)
      for (int i = 0; i < 40; ++i) {
        const Scenario s = MakeScenario(*system, group, 0, i);
        const Obstacle obstacle = Obstacle::Circle(s.obstacle.center, s.obstacle.radius);
        const auto m = static_cast<int>(s.controls.rows());
        const Plan plan{s.controls.data(), m, static_cast<int>(s.controls.cols()), m};
        const Decision decision =
            certifier.Certify(plan, Zonotope::FromBox(s.center, system->initial_half_width), {&obstacle, 1}, tube);
        evaluator.Certify(s, answer);
        EXPECT_EQ(answer.decision.outcome, decision.outcome) << system->name << " " << NameOf(group) << i;
        EXPECT_EQ(answer.decision.step, decision.step);
        ASSERT_EQ(answer.tube.length(), tube.length());
        for (int k = 0; k < system->num_states(); ++k)
          EXPECT_EQ(answer.tube.slice(answer.tube.length()).HalfWidthUpper(k),
                    tube.slice(tube.length()).HalfWidthUpper(k));
        ++outcomes[static_cast<int>(decision.outcome)];
      }
    EXPECT_GT(outcomes[static_cast<int>(Outcome::kCertified)], 0);
    EXPECT_GT(outcomes[static_cast<int>(Outcome::kDomain)], 0);
    EXPECT_GT(outcomes[static_cast<int>(Outcome::kSafety)], 0);
  }
}

TEST(Cover, AValidDeclarationCoversEveryTubeAndPrefix) {
  ForEachAnswer(20, [](const System& system, const Scenario& s, const Answer& answer) {
    EXPECT_EQ(Cover(answer, Rollouts(system, s, 80)), Membership::kInside);
  });
}

TEST(Cover, ATubeThatDeniesTheResidualIsNotCovered) {
  const System& system = BicycleSystem();
  const NoResidual none;
  const Evaluator evaluator(system, none, 5);
  Answer answer;
  int outside = 0;
  for (int i = 0; i < 20; ++i) {
    const Scenario s = MakeScenario(system, Group::kC, 0, i);
    evaluator.Certify(s, answer);
    ASSERT_TRUE(answer.IsComplete());
    outside += Cover(answer, Rollouts(system, s, 80)) == Membership::kOutside;
  }
  EXPECT_GE(outside, 15);  // slow ones with little steering stay below the knee
}

TEST(Cover, AnEnvelopeThatIsLeftMayStillLeadToATubeThatIsNot) {
  // In A the residual is about 1e-9: outside the envelope [0, 0], inside the slices, which are wider by the remainder.
  const System& system = PointMassSystem();
  const NoResidual none;
  const Evaluator evaluator(system, none, 5);
  Answer answer;
  int inside = 0, residuals = 0;
  for (int i = 0; i < 20; ++i) {
    const Scenario s = MakeScenario(system, Group::kA, 0, i);
    const Rollouts center(system, s, 1);
    evaluator.Certify(s, answer);
    residuals += center.residual(0, 0)[2] != 0;
    inside += Cover(answer, center) == Membership::kInside;
  }
  EXPECT_EQ(residuals, 20);
  EXPECT_GT(inside, 10);
}

int CountOf(Membership wanted, const Answer& answer, const Rollouts& rollouts) {
  int count = 0;
  for (int i = 0; i < rollouts.count(); ++i) count += LocateRollout(answer, rollouts, i) == wanted;
  return count;
}

TEST(LocateRollout, FindsEachRolloutInAValidTubeAndLeavesNoneOpen) {
  ForEachAnswer(3, [](const System& system, const Scenario& s, const Answer& answer) {
    EXPECT_EQ(CountOf(Membership::kInside, answer, Rollouts(system, s, 80)), 80);
  });
}

TEST(LocateRollout, CatchesANarrowedTubeThatTheEnvelopesDoNotShow) {
  // X0 of half the width, so every later slice is too narrow; the residuals still lie in the recorded envelopes, and
  // the theorem, whose premise does not hold, would have every rollout inside.
  for (const System* system : Systems()) {
    const Deployed deployed{*system};
    System narrowed = *system;
    narrowed.initial_half_width /= 2;
    const Evaluator evaluator(narrowed, *deployed.envelope, 5);
    Answer answer;
    int trusted = 0, caught = 0;
    for (int i = 0; i < 10; ++i) {
      const Scenario s = MakeScenario(*system, Group::kC, 0, i);
      const Rollouts rollouts(*system, s, 80);
      evaluator.Certify(s, answer);
      trusted += Cover(answer, rollouts) == Membership::kInside;
      caught += CountOf(Membership::kOutside, answer, rollouts) > 0;
    }
    EXPECT_GT(trusted, 0) << system->name;
    EXPECT_EQ(caught, 10) << system->name;
  }
}

TEST(LocateRollout, CatchesANarrowedEnvelope) {
  const System& system = PointMassSystem();
  const Deployed deployed{system};
  const auto narrowed =
      MakeScaledForeReach({*system.model, system.domain, deployed.declaration, deployed.data, 0}, 0.1);
  const Evaluator evaluator(system, *narrowed, 5);
  Answer answer;
  int caught = 0;
  for (int i = 0; i < 10; ++i) {
    const Scenario s = MakeScenario(system, Group::kB, 0, i);
    evaluator.Certify(s, answer);
    caught += CountOf(Membership::kOutside, answer, Rollouts(system, s, 80)) > 0;
  }
  EXPECT_GE(caught, 5);
}

TEST(Evaluator, LeavesTheDomainWhereTheResidualMayTakeItThere) {
  const System& system = BicycleSystem();
  const Bounded wild(1);
  const Evaluator evaluator(system, wild, 5);
  Answer answer;
  evaluator.Certify(MakeScenario(system, Group::kC, 0, 0), answer);
  EXPECT_EQ(answer.decision.outcome, Outcome::kDomain);
  EXPECT_EQ(answer.decision.step, 1);  // delta reaches beyond 0.48 after one step
  EXPECT_EQ(answer.tube.length(), 1);
}

TEST(Evaluator, OrderOneMakesBoxes) {
  const Deployed deployed{BicycleSystem()};
  const Evaluator boxes(BicycleSystem(), *deployed.envelope, 1), zonotopes(BicycleSystem(), *deployed.envelope, 5);
  Answer box, zonotope;
  const Scenario s = MakeScenario(BicycleSystem(), Group::kC, 0, 0);
  boxes.Certify(s, box);
  zonotopes.Certify(s, zonotope);
  ASSERT_EQ(box.tube.length(), BicycleSystem().horizon);
  for (int t = 0; t <= box.tube.length(); ++t) {
    const Eigen::MatrixXd generators = box.tube.slice(t).GeneratorMatrix();
    for (Eigen::Index j = 0; j < generators.cols(); ++j) EXPECT_EQ((generators.col(j).array() != 0).count(), 1);
  }
  EXPECT_LT(ProjectedArea(zonotope.tube.slice(zonotope.tube.length())),
            0.9 * ProjectedArea(box.tube.slice(box.tube.length())));
}

TEST(ProjectedArea, OfABoxAndAHexagon) {
  EXPECT_DOUBLE_EQ(ProjectedArea(Zonotope::FromBox(Eigen::Vector3d(9, 9, 9), Eigen::Vector3d(2, 3, 5))), 24);
  // Generators a, b, c of the plane: 4 (|a x b| + |a x c| + |b x c|).
  EXPECT_DOUBLE_EQ(ProjectedArea(Zonotope(Eigen::Vector2d(1, 1), Eigen::Matrix<double, 2, 3>{{1, 0, 1}, {0, 1, 1}})),
                   12);
}

TEST(RunCell, CountsAddUpAndADeclarationThatDataContradictIsF) {
  Cell cell = PaperCell(BicycleSystem(), 100, 0, 1);
  for (const Tally& tally : RunCell(cell, {10, 20})) {
    EXPECT_EQ(tally.plans, 10);
    EXPECT_EQ(tally.certified + tally.falsified + tally.domain + tally.safety, tally.plans);
    EXPECT_FIELDS(tally, (falsified, 0), (covered, tally.complete()), (false_certificates(), 0), (areas.size(), 10u));
  }
  cell.declared = {"hundredth", cell.declared.matrix / 100};
  for (const Tally& tally : RunCell(cell, {10, 20})) EXPECT_EQ(tally.falsified, tally.plans);
}

}  // namespace forereach::research::evaluate_test
