// Random abstentions of all causes of decision_t. Every change that an advice names is applied, and judged by a
// certifier of its own; every remedy of an answer without a judgement likewise, by a gate of its own.
#include "advise/advice.h"

#include "tests/test.h"

#include "advise/gate_advice.h"
#include "advise/hypotheses.h"
#include "forereach/certify/explain.h"
#include "forereach/certify/tube.h"
#include "forereach/numerics/size.h"
#include "lcmtypes/names.h"
#include "tests/advise/answered.h"
#include "tests/oracle/problems.h"
#include "tests/oracle/traced_random.h"
#include "tests/tries.h"

namespace forereach::advice_test {

Case AnyCase(Random& random) {
  const bool bicycle = random.Coin();
  const auto problem = AnyProblem(random, bicycle, random.Integer(5, 30));
  const int n = problem->model->num_states();
  const int special = random.Below(7);
  switch (special) {
    case 0:  // a contradiction, in one row or in several
      for (int k = random.Integer(0, n - 1); k < n; k += random.Integer(1, n))
        problem->transitions.x_next(random.Integer(0, problem->transitions.size() - 1), k) += random.Uniform(1, 4);
      break;
    case 1: problem->rest = {{n - 1, random.Uniform(0, 0.2)}, {n - 2, random.Uniform(0, 1)}}; break;
    case 2:
      problem->limits = {{"speed", {bicycle ? "v" : "vx * vx + vy * vy", 1}, -kInfinity, random.Uniform(0, 6)},
                         {"place", {bicycle ? "x" : "px", 1}, random.Uniform(-8, 0), 8}};
      break;
    case 3:  // steering up to the pole of its tangent and beyond
      if (!bicycle) break;
      problem->domain.state = [&] {
        Eigen::VectorXd reach = StateReach(true);
        reach[5] = 1.8;
        return Box(-reach, reach);
      }();
      break;
    default: break;
  }
  Query query = AnyQuery(random, *problem);
  if (special == 3 && bicycle) {
    Eigen::VectorXd center = query.initial_set.CenterVector();
    center[5] = 1.57 + random.Uniform(-0.03, 0.03);
    query.initial_set = Zonotope::FromBox(center, random.Uniform(0, 0.1) * StateReach(true).cwiseMin(1));
  }
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
  if (sentence) *sentence = Explain(decision, certifier, judged.obstacles, judged.plan(), tube);
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
  EXPECT_EQ(is.declaration.noise_bound == was.declaration.noise_bound,
            change != Change::kNoise && change != Change::kLessNoise);
  EXPECT_EQ(is.declaration.disturbance == was.declaration.disturbance, change != Change::kDisturbance);
  EXPECT_EQ(is.declaration.state_error == was.declaration.state_error, change != Change::kStateError);
  EXPECT_EQ(is.transitions.size() - was.transitions.size(), change == Change::kObservation ? 1
                                                            : change == Change::kOutlier   ? -1
                                                                                           : 0);
  if (change != Change::kDomain)
    EXPECT_FIELDS(is.domain.state, (upper(), was.domain.state.upper()), (lower(), was.domain.state.lower()));
  EXPECT_FIELDS(is, (rest.size(), was.rest.size()), (limits.size(), was.limits.size()));
  EXPECT_EQ(after.obstacles.size(), before.obstacles.size());
}

bool IsJudged(const decision_t& decision) {
  return decision.outcome != decision_t::REJECTED && decision.outcome != decision_t::ABSTAIN_DEADLINE &&
         decision.outcome != decision_t::ABSTAIN_OBSTACLES;
}

// The answer of a gate that has the remedy's value, or of one that enforces where it names none.
decision_t AnswerWith(const Answered& answered, const Remedy& remedy, double value) {
  static const std::map<std::string, double GateOptions::*> keys{
      {"gate.max_age_ms", &GateOptions::max_age_ms},
      {"gate.max_ahead_ms", &GateOptions::max_ahead_ms},
      {"gate.certificate_lifetime_ms", &GateOptions::certificate_lifetime_ms},
      {"gate.decision_budget_ms", &GateOptions::decision_budget_ms},
      {"gate.obstacles_timeout_ms", &GateOptions::obstacles_timeout_ms}};
  Config task = *answered.task;
  task.gate.shadow = false;
  candidate_plan_t candidate = answered.abstention.candidate;
  const std::int64_t now = answered.abstention.decision.utime;
  if (remedy.key == "planner.lead_steps")
    candidate.start_utime += std::llround((value - task.planner.lead_steps) * task.robot.step_period_ms * 1e3);
  else if (!remedy.key.empty())
    task.gate.*keys.at(remedy.key) = value;
  Gate gate(task);
  if (const auto& seen = answered.abstention.last_obstacles) {
    EXPECT_EQ(gate.UpdateObstacles(seen->first, seen->second), "");
    if (!gate.WhyObstaclesUnknown(now).empty()) return answered.abstention.decision;
  }
  return gate.Decide(Encode(candidate), now).decision;
}

// What is said to turn the answer does, and a little less of it doesn't.
void ExpectHolds(const Answered& answered, const Remedy& remedy) {
  EXPECT_FALSE(remedy.what.empty());
  if (!remedy.turns) return;
  EXPECT_TRUE(IsJudged(AnswerWith(answered, remedy, remedy.value)));
  if (remedy.key.empty()) return;
  const double less = remedy.key == "planner.lead_steps" ? 1 : remedy.key == "gate.decision_budget_ms" ? -0.002 : 0.002;
  EXPECT_FALSE(IsJudged(AnswerWith(answered, remedy, remedy.value - less)));
}

// A case that is not certified, and whether an advice turns it.
struct Tried {
  std::string cause;
  bool turned;
  std::int64_t advices = 0, tails = 0;
};

std::optional<Tried> TryJudged(Random& random) {
  const Case abstained = AnyCase(random);
  const Decision decision = Fresh(abstained);
  const std::vector<Advice> given =
      Advise(abstained, Certifier(abstained.problem), {.most_observations = 4, .tails = AnyTails(abstained)});
  if (decision.outcome == Outcome::kCertified) {
    EXPECT_TRUE(given.empty());
    return std::nullopt;
  }
  for (const Advice& advice : given) {
    SCOPED_TRACE(Name(advice.change) + std::string(": ") + advice.what);
    bool turns = true;
    for (const Case& after : advice.after) {
      ExpectOnly(advice.change, abstained, after);
      std::string sentence;
      if (Fresh(after, &sentence).outcome == Outcome::kCertified) continue;
      if (turns) EXPECT_EQ(advice.then, sentence);
      turns = false;
    }
    EXPECT_FIELDS(advice, (turns, turns), (after.empty(), false));
  }
  EXPECT_TRUE(std::ranges::is_partitioned(given, &Advice::turns));
  return Tried{std::string(CauseName(static_cast<std::int16_t>(decision.cause))),
               std::ranges::any_of(given, &Advice::turns), std::ssize(given),
               std::ranges::count(given, Change::kTail, &Advice::change)};
}

std::optional<Tried> TryAnswered(Random& random, std::int16_t cause) {
  const Answered answered = AnyAnswered(random, cause);
  const std::string name(CauseName(answered.abstention.cause));
  SCOPED_TRACE(name);
  const std::optional<Remedy> remedy = RemedyFor(answered.abstention);
  if (IsJudged(answered.abstention.decision)) {
    EXPECT_FALSE(remedy) << remedy->what;
    return std::nullopt;
  }
  EXPECT_TRUE(remedy);
  if (!remedy) return std::nullopt;
  SCOPED_TRACE(remedy->what);
  ExpectHolds(answered, *remedy);
  return Tried{name, remedy->turns, 1};
}

TEST(Advise, EveryAdviceDoesWhatItSays) {
  TracedRandom random(1201);
  std::cout << random.trace() << "\n";
  const int wanted = Tries(1500);
  std::map<std::string, int> abstentions, turned;
  std::int64_t advices = 0, tails = 0;
  int count = 0;
  for (std::size_t trial = 0; count < wanted; ++trial) {
    SCOPED_TRACE(trial);
    const auto tried = trial % 3 < 2 ? TryJudged(random) : TryAnswered(random, kAnswers[trial / 3 % kAnswers.size()]);
    if (testing::Test::HasFailure()) return;
    if (!tried) continue;
    ++count;
    ++abstentions[tried->cause];
    turned[tried->cause] += tried->turned;
    advices += tried->advices;
    tails += tried->tails;
  }
  for (const auto& [cause, number] : abstentions)
    std::cout << cause << ": " << number << " abstentions, " << turned[cause] << " with a change that turns them\n";
  std::cout << count << " abstentions, " << advices << " advices, " << tails << " of them tails\n";
  EXPECT_GT(tails, wanted / 50);
  for (std::int16_t cause = 0; cause < 1000; ++cause) {
    const std::string name(CauseName(cause));
    if (name == "unknown" || cause == decision_t::CAUSE_NONE || cause == decision_t::CAUSE_SECOND_CERTIFIER ||
        cause == decision_t::CAUSE_BETWEEN ||
        cause == decision_t::CAUSE_BOUND)  // a wrong declaration: no advice but its sentence
      continue;
    EXPECT_GE(abstentions[name], wanted / 150) << name;
  }
  for (const char* cause : {"pairwise", "domain_exit", "no_finite_enclosure", "obstacle", "no_stop", "limit", "stale",
                            "future", "deadline", "too_late", "shadow", "no_obstacles"})
    EXPECT_GT(turned[cause], 0) << cause;
  for (const char* cause : {"domain_exit", "obstacle", "no_stop", "limit"})
    EXPECT_GT(turned[cause], abstentions[cause] / 2) << cause;
}

// ---- What a certificate rests on.

TEST(Hypotheses, NameThoseWhoUpholdThemAndNobodyElse) {
  Config config = SmallTask();
  Problem problem = *config.problem;
  problem.declaration.state_error.setConstant(0.1);
  const auto upheld = [&](const std::string& what) {
    config.problem = std::make_shared<const Problem>(problem);
    for (const Hypothesis& each : HypothesesOf(config))
      if (each.what.find(what) != std::string::npos) return each.upheld_by;
    return std::string();
  };
  EXPECT_THAT(upheld("declaration.lipschitz"), HasSubstr("of the file and of the bus"));
  EXPECT_THAT(upheld("a measured state"), HasSubstr("that contradict each other"));
  problem.declaration.given_are_exact = true;
  EXPECT_THAT(upheld("a measured state"), HasSubstr("learned transitions"));
  config.gate.learns = false;
  EXPECT_THAT(upheld("a measured state"), HasSubstr("refuted by nobody"));
  EXPECT_THAT(upheld("declaration.lipschitz"), Not(HasSubstr("of the bus")));
  EXPECT_EQ(upheld("is disturbed"), "");
  problem.declaration.disturbance = Vec({0, 0.5, 0, 0});
  problem.declaration.growing = Growing(*problem.model, {"0", "0", "0.1*abs(vx)", "0"});
  EXPECT_THAT(upheld("disturbed by at most py 0.5, vx 0.1*abs(vx)"), HasSubstr("transitions refute it"));
  problem.declaration.disturbance = {};
  problem.declaration.growing.reset();
  EXPECT_EQ(upheld("changes faster"), "");
  problem.timing.rate_bound = Vec({kInfinity, 2, kInfinity, kInfinity});
  EXPECT_THAT(upheld("changes faster, a second, than py 2"), HasSubstr("model.rate_bound"));
  EXPECT_EQ(upheld("clock"), "");
  config.gate.step_error_ms = 5;
  EXPECT_THAT(upheld("clock runs true"), HasSubstr("declared"));
  EXPECT_EQ(upheld("task.body"), "");
  problem.body.parts[0].radius = 0.5;
  EXPECT_EQ(upheld("task.body"), "declared");
  EXPECT_EQ(upheld("turn"), "");
  problem.model = MakeKinematicBicycle(0.1, 2.5, {2});
  problem.timing.rate_bound = {};
  problem.declaration.state_error = {};
  EXPECT_THAT(upheld("turns theta by three quarters"), HasSubstr("model.angles"));
  config.gate.obstacles = ObstaclesSource::kTask;
  EXPECT_EQ(upheld("after a withdrawal"), "");
  config.gate.obstacles = ObstaclesSource::kBus;
  EXPECT_EQ(upheld("after a withdrawal, which no certificate covers, the robot stops at once"), "declared");
  config.robot.emergency_stop = {{"v", 8}};
  EXPECT_EQ(upheld("the robot stops as robot.emergency_stop says"), "declared");
}

}  // namespace forereach::advice_test
