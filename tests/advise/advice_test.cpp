// Random abstentions of all causes. Every change that an advice names is applied, and judged by a certifier of its own.
#include "advise/advice.h"

#include <algorithm>
#include <map>
#include <string>

#include "certifier/certify/explain.h"
#include "certifier/numerics/size.h"
#include "tests/oracle/problems.h"
#include "tests/tries.h"

namespace forereach {
namespace {

using testing::Contains;
using testing::HasSubstr;

Case AnyCase(Random& random) {
  const bool bicycle = random.Coin();
  const auto problem = AnyProblem(random, bicycle, random.Integer(5, 30));
  const int n = problem->model->num_states();
  switch (random.Below(6)) {
    case 0:  // a contradiction, in one row or in several
      for (int k = random.Integer(0, n - 1); k < n; k += random.Integer(1, n))
        problem->transitions.x_next(random.Integer(0, problem->transitions.size() - 1), k) += random.Uniform(1, 4);
      break;
    case 1: problem->rest = {{n - 1, random.Uniform(0, 0.2)}, {n - 2, random.Uniform(0, 1)}}; break;
    case 2:
      problem->limits = {{"speed", {bicycle ? "v" : "vx * vx + vy * vy", 1}, -kInfinity, random.Uniform(0, 6)},
                         {"place", {bicycle ? "x" : "px", 1}, random.Uniform(-8, 0), 8}};
      break;
    default: break;
  }
  Query query = AnyQuery(random, *problem);
  if (random.Coin(0.2)) {  // too fast, or with too much input, for the domain
    query.initial_set = Zonotope(1.4 / 0.3 * query.initial_set.CenterVector(), query.initial_set.GeneratorMatrix());
    const Eigen::VectorXd reach = StateReach(bicycle), center = query.initial_set.CenterVector();
    query.initial_set = Zonotope::FromBox(center.cwiseMax(-0.97 * reach).cwiseMin(0.97 * reach), 0.01 * reach);
  }
  return {problem, query.controls, query.schedule, query.initial_set, query.obstacles};
}

// Twelve steps against the speed, hard and gently.
BrakingTails AnyTails(const Case& abstained) {
  return [problem = abstained.problem](const Eigen::VectorXd& state) {
    const bool bicycle = state.size() == 6;
    const Box& input = problem->domain.input;
    std::vector<Eigen::MatrixXd> tails;
    for (const double gain : {1.0, 0.3}) {
      Eigen::MatrixXd& tail = tails.emplace_back(input.dim(), 12);
      Eigen::VectorXd x = state, z(problem->model->num_variables()), next(state.size());
      for (Eigen::Index t = 0; t < tail.cols(); ++t) {
        const Eigen::Vector2d wanted =
            bicycle ? Eigen::Vector2d(-4 * (x[4] + gain * x[3]), 0) : Eigen::Vector2d(-gain / 0.15 * x.tail(2));
        tail.col(t) = wanted.cwiseMax(input.lower()).cwiseMin(input.upper());
        z << x, tail.col(t);
        problem->model->Evaluate({z.data(), ToSize(z.size())}, {next.data(), ToSize(next.size())});
        x = next;
      }
    }
    return tails;
  };
}

Decision Fresh(const Case& judged, std::string* sentence = nullptr) {
  const Certifier certifier(judged.problem);
  Tube tube;
  certifier.Require(judged.plan(), judged.initial_set, judged.obstacles);
  const Decision decision = certifier.Certify(judged.plan(), judged.initial_set, judged.obstacles, tube);
  if (sentence) *sentence = Explain(decision, *judged.problem, judged.plan(), tube);
  return decision;
}

// That nothing else was changed.
void ExpectOnly(Change change, const Case& before, const Case& after) {
  const Problem &was = *before.problem, &is = *after.problem;
  if (change == Change::kTail) {
    EXPECT_LT(after.progress_steps, before.progress_steps < 0 ? before.controls.cols() : before.progress_steps);
    EXPECT_EQ(after.controls.leftCols(after.progress_steps), before.controls.leftCols(after.progress_steps));
  } else {
    EXPECT_EQ(before.controls.cols() == after.controls.cols(), change != Change::kHorizon);
    EXPECT_EQ(after.controls, before.controls.leftCols(after.controls.cols()));
  }
  EXPECT_EQ(after.initial_set.CenterVector(), before.initial_set.CenterVector());
  if (change != Change::kInitialSet)
    EXPECT_EQ(after.initial_set.GeneratorMatrix(), before.initial_set.GeneratorMatrix());
  if (change != Change::kSlopes && change != Change::kLargerSlopes)
    EXPECT_EQ(is.declaration.lipschitz, was.declaration.lipschitz);
  EXPECT_EQ(is.declaration.noise_bound == was.declaration.noise_bound, change != Change::kNoise);
  EXPECT_EQ(is.transitions.size() - was.transitions.size(), change == Change::kObservation ? 1
                                                            : change == Change::kOutlier   ? -1
                                                                                           : 0);
  if (change != Change::kDomain) {
    EXPECT_EQ(is.domain.state.upper(), was.domain.state.upper());
    EXPECT_EQ(is.domain.state.lower(), was.domain.state.lower());
  }
  EXPECT_EQ(is.rest.size(), was.rest.size());
  EXPECT_EQ(is.limits.size(), was.limits.size());
  EXPECT_EQ(after.obstacles.size(), before.obstacles.size());
}

std::string CauseOf(const Decision& decision) {
  switch (decision.cause) {
    case Cause::kPairwise: return decision.first_observation < 0 ? "F at a step" : "F";
    case Cause::kDomainExit: return "domain";
    case Cause::kNoFiniteEnclosure: return "no enclosure";
    case Cause::kObstacle: return "obstacle";
    case Cause::kNoStop: return "rest";
    case Cause::kLimit: return "limit";
    case Cause::kNone: break;
  }
  return "none";
}

TEST(Advise, EveryAdviceDoesWhatItSays) {
  Random random(1201);
  SCOPED_TRACE(random.trace());
  const int wanted = Tries(1000);
  std::map<std::string, int> abstentions, turned;
  int count = 0, advices = 0;
  std::ptrdiff_t tails = 0;
  for (int trial = 0; count < wanted; ++trial) {
    SCOPED_TRACE(trial);
    const Case abstained = AnyCase(random);
    const Decision decision = Fresh(abstained);
    const std::vector<Advice> given =
        Advise(abstained, Certifier(abstained.problem), {.most_observations = 4, .tails = AnyTails(abstained)});
    if (decision.outcome == Outcome::kCertified) {
      EXPECT_TRUE(given.empty());
      continue;
    }
    ++count;
    ++abstentions[CauseOf(decision)];
    for (const Advice& advice : given) {
      SCOPED_TRACE(Name(advice.change) + std::string(": ") + advice.what);
      ++advices;
      bool turns = true;
      for (const Case& after : advice.after) {
        ExpectOnly(advice.change, abstained, after);
        std::string sentence;
        if (Fresh(after, &sentence).outcome == Outcome::kCertified) continue;
        if (turns) EXPECT_EQ(advice.then, sentence);
        turns = false;
      }
      EXPECT_EQ(advice.turns, turns);
      EXPECT_FALSE(advice.after.empty());
    }
    EXPECT_TRUE(std::ranges::is_partitioned(given, &Advice::turns));
    turned[CauseOf(decision)] += std::ranges::any_of(given, &Advice::turns);
    tails += std::ranges::count(given, Change::kTail, &Advice::change);
    if (testing::Test::HasFailure()) return;
  }
  for (const auto& [cause, number] : abstentions)
    std::cout << cause << ": " << number << " abstentions, " << turned[cause] << " with a change that turns them\n";
  std::cout << advices << " advices, " << tails << " of them tails\n";
  EXPECT_GT(tails, wanted / 50);
  for (const char* cause : {"F", "domain", "obstacle", "rest", "limit"})
    EXPECT_GT(abstentions[cause], wanted / 50) << cause;
  for (const char* cause : {"domain", "obstacle", "rest", "limit"})
    EXPECT_GT(turned[cause], abstentions[cause] / 2) << cause;
}

}  // namespace
}  // namespace forereach
