// The yardstick of the benchmarks computes what the certifier computes: same tube, same answer; and the tasks are what
// they claim to be.
#include "bench/straightforward.h"

#include "tests/test.h"

#include "bench/latencies.h"
#include "bench/tasks.h"
#include "forereach/certify/tube.h"
#include "tests/oracle/problems.h"
#include "tests/oracle/traced_random.h"

namespace forereach::bench::straightforward_test {

constexpr double kTolerance = 1e-9;

PlainZonotope PlainOf(const Zonotope& set) { return {set.CenterVector(), set.GeneratorMatrix()}; }

PlainModel PlainModelOf(const Problem& problem) {
  return problem.model->num_states() == 6 ? PlainBicycle(0.1, 2.5) : PlainPointMass(0.15);
}

Straightforward::Outcome OutcomeOf(const Decision& decision) {
  switch (decision.outcome) {
    case Outcome::kCertified: return Straightforward::Outcome::kCertified;
    case Outcome::kSafety: return Straightforward::Outcome::kSafety;
    default: return Straightforward::Outcome::kDomain;
  }
}

void ExpectNear(const Zonotope& slice, const PlainZonotope& plain, int t) {
  const Eigen::VectorXd half_width = plain.HalfWidth();
  for (int k = 0; k < half_width.size(); ++k) {
    EXPECT_NEAR(slice.HalfWidthUpper(k), half_width[k], kTolerance * std::max(1.0, half_width[k]))
        << "t " << t << " k " << k;
    EXPECT_NEAR(slice.center(k), plain.center[k], kTolerance) << "t " << t << " k " << k;
  }
}

// Returns how many steps both have completed.
int ExpectSame(const std::shared_ptr<const Problem>& problem, const Eigen::MatrixXd& controls,
               const Zonotope& initial_set, const std::vector<Obstacle>& obstacles) {
  Tube tube;
  const Decision decision = Certifier(problem).Certify(Task::PlanOf(controls), initial_set, obstacles, tube);
  for (const auto spelling : {Straightforward::Spelling::kMatrices, Straightforward::Spelling::kLoops}) {
    const Straightforward plain(problem, PlainModelOf(*problem), spelling);
    const auto answer = plain.Certify(controls, PlainOf(initial_set), obstacles);
    EXPECT_EQ(OutcomeOf(decision), answer.outcome);
    EXPECT_EQ(tube.length() + 1, static_cast<int>(answer.tube.size()));
    for (int t = 0; t <= std::min(tube.length(), static_cast<int>(answer.tube.size()) - 1); ++t)
      ExpectNear(tube.slice(t), answer.tube[static_cast<std::size_t>(t)], t);
  }
  return tube.length();
}

TEST(StraightforwardTest, AgreesOnRandomTasks) {
  int steps = 0, questions = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    TracedRandom random(seed);
    const auto problem = AnyProblem(random, random.Coin(), random.Integer(1, 60));
    problem->method = Method::kPaper;
    ASSERT_FALSE(Straightforward(problem, PlainModelOf(*problem)).FindViolation());
    for (int question = 0; question < 5; ++question, ++questions) {
      Query query = AnyQuery(random, *problem);
      std::erase_if(query.obstacles, [](const Obstacle& o) { return o.kind() != Obstacle::Kind::kCircle; });
      steps += ExpectSame(problem, query.controls, query.initial_set, query.obstacles);
    }
  }
  EXPECT_GT(steps, 4 * questions);  // most tubes are several steps long
}

TEST(StraightforwardTest, AgreesOnTheBenchmarkTasks) {
  for (const Scenario scenario : {Scenario::kBicycle, Scenario::kPointMass, Scenario::kDense}) {
    SCOPED_TRACE(NameOf(scenario));
    for (const Task& task : {MakeTask(scenario, 25), MakeBlockedTask(scenario, 25)})
      EXPECT_EQ(ExpectSame(task.problem, task.controls, task.initial_set(), task.obstacles), 12);
  }
  // Long plans with errors of observation: axes of real size in every row, and reductions that lose some.
  for (const Scenario scenario : {Scenario::kBicycle, Scenario::kPointMass})
    for (const double noise : {0.0, 1e-4}) {
      Task task = MakeTask(scenario, 60);
      Problem problem = *task.problem;
      problem.declaration.noise_bound.setConstant(noise);
      task.controls = (0.1 * task.controls.replicate(1, 3)).eval();
      EXPECT_GT(ExpectSame(std::make_shared<const Problem>(problem), task.controls, task.initial_set(), {}), 15);
    }
  const Task nominal = MakeNominalTube();
  EXPECT_EQ(ExpectSame(nominal.problem, nominal.controls, nominal.initial_set(), {}), 12);
}

TEST(StraightforwardTest, SeesAViolatingPair) {
  auto problem = std::make_shared<Problem>(*MakeTask(Scenario::kBicycle, 25).problem);
  EXPECT_FALSE(Straightforward(problem, PlainModelOf(*problem)).FindViolation());
  problem->transitions.x_next(7, 4) += 1e-6;  // row 4 of L is zero
  EXPECT_EQ(Straightforward(problem, PlainModelOf(*problem)).FindViolation(), std::pair(0, 7));
  EXPECT_TRUE(Certifier(problem).violation());
}

TEST(TasksTest, CertifiesAtEachNumberOfObservationsAndAbstainsWhereThePathIsBlocked) {
  for (const Scenario scenario : {Scenario::kBicycle, Scenario::kPointMass, Scenario::kDense}) {
    SCOPED_TRACE(NameOf(scenario));
    for (const int observations : {25, 400}) {
      Tube tube;
      const Task& task = CachedTask(scenario, observations);
      const auto outcome = [&](const std::vector<Obstacle>& obstacles) {
        const Certifier& certifier = CachedCertifier(scenario, observations);
        return certifier.Certify(task.plan(), task.initial_set(), obstacles, tube).outcome;
      };
      EXPECT_EQ(outcome(task.obstacles), Outcome::kCertified);
      EXPECT_EQ(outcome(MakeBlockedTask(scenario, observations).obstacles), Outcome::kSafety);
    }
  }
}

TEST(LatenciesTest, PercentilesAreMeasuredLatencies) {
  Latencies latencies(100);
  for (int i = 100; i > 0; --i) latencies.Add(i);
  EXPECT_EQ(latencies.Percentile(0.5), 50);
  EXPECT_EQ(latencies.Percentile(0.99), 99);
  EXPECT_EQ(latencies.Percentile(0.9999), 100);
  EXPECT_EQ(latencies.Percentile(1), 100);
}

TEST(TasksTest, FewerObservationsAreTheFirstOfMore) {
  const Task few = MakeTask(Scenario::kDense, 25), more = MakeTask(Scenario::kDense, 400);
  EXPECT_EQ(few.problem->transitions.x_next, more.problem->transitions.x_next.topRows(25));
}

}  // namespace forereach::bench::straightforward_test
