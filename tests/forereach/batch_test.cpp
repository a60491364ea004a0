// A batch gives the same decisions as single calls, for every number of threads, whatever its plans share.
#include "forereach/certify/batch.h"

#include <atomic>
#include <climits>
#include <mutex>

#include "tests/test.h"

#include "tests/oracle/any_task.h"

namespace forereach::batch_test {

// The hulls of a tube, as far as it was computed.
std::vector<double> Hulls(const Tube& tube) {
  std::vector<double> ends;
  for (int t = 0; t <= tube.length(); ++t)
    for (int k = 0; k < tube.slice(t).dim(); ++k) {
      ends.push_back(tube.hull(t, k).lower);
      ends.push_back(tube.hull(t, k).upper);
    }
  return ends;
}

struct BatchTest : testing::Test {
  static constexpr int kPlans = 300;

  BatchTest() {
    queries_.reserve(kPlans);  // plans refer to their controls
    for (int i = 0; i < kPlans; ++i) {
      queries_.push_back(AnyQuery(random_, *problem_));
      const Eigen::MatrixXd& controls = queries_.back().controls;
      plans_.push_back({controls.data(), 2, static_cast<int>(controls.cols()), 2});
      initial_sets_.push_back(queries_.back().initial_set);
      certifier_.Require(plans_.back(), initial_sets_.back(), obstacles_);
    }
  }

  static constexpr std::uint64_t kSeed = 20260117;
  Random random_{kSeed};
  const std::shared_ptr<const Problem> problem_ = AnyProblem(random_, true, 40);
  const Certifier certifier_{problem_};
  const std::vector<Obstacle> obstacles_{Obstacle::Circle(Eigen::Vector2d(3, 1), 2)};
  std::vector<Query> queries_;
  std::vector<Plan> plans_;
  std::vector<Zonotope> initial_sets_;
};

TEST_F(BatchTest, DecisionsAndTubesAreThoseOfSingleCalls) {
  Tube tube;
  std::vector<Decision> single;
  std::vector<std::vector<double>> hulls;
  std::map<Outcome, int> outcomes;
  for (std::size_t i = 0; i < kPlans; ++i) {
    single.push_back(certifier_.Certify(plans_[i], initial_sets_[i], obstacles_, tube));
    hulls.push_back(Hulls(tube));
    ++outcomes[single.back().outcome];
  }
  EXPECT_GE(outcomes.size(), 2u) << "answers differ, so their order is tested";

  for (const unsigned threads : {1u, 2u, 5u, 1000u}) {
    std::vector<std::vector<double>> told(kPlans);
    std::vector<std::atomic<int>> times(kPlans);
    const auto decisions = CertifyAll(certifier_, plans_, initial_sets_, obstacles_, {.threads = threads},
                                      [&](std::size_t i, const Decision& decision, const Tube& its) {
                                        ++times[i];
                                        EXPECT_EQ(Fields(decision), Fields(single[i]));
                                        told[i] = Hulls(its);
                                      });
    ASSERT_EQ(decisions.size(), single.size());
    for (std::size_t i = 0; i < kPlans; ++i) {
      EXPECT_EQ(Fields(decisions[i]), Fields(single[i])) << "plan " << i << ", " << threads << " threads";
      EXPECT_EQ(times[i], 1);
    }
    EXPECT_EQ(told, hulls) << threads << " threads";
  }
}

TEST_F(BatchTest, OneInitialSetServesAll) {
  const std::span first(initial_sets_.data(), 1);
  Tube tube;
  const auto decisions = CertifyAll(certifier_, plans_, first, obstacles_, {.threads = 3});
  for (std::size_t i = 0; i < kPlans; ++i)
    EXPECT_EQ(Fields(decisions[i]), Fields(certifier_.Certify(plans_[i], first[0], obstacles_, tube))) << i;
}

TEST_F(BatchTest, NoPlansNoDecisions) {
  EXPECT_TRUE(CertifyAll(certifier_, {}, {}, obstacles_, {.threads = 4}).empty());
}

TEST_F(BatchTest, SaysWhatDoesNotFit) {
  const std::span two(initial_sets_.data(), 2);
  EXPECT_THAT([&] { (void)CertifyAll(certifier_, plans_, two, obstacles_); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("2 initial sets, must be 1 or 300")));
  EXPECT_THAT([&] { (void)CertifyAll(certifier_, plans_, initial_sets_, obstacles_, {.threads = 0}); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("0 threads")));
}

// All numbers of a tube, as they are in memory.
std::string BitsOf(const Tube& tube) {
  std::string bits;
  const auto add = [&](std::span<const double> numbers) {
    bits.append(reinterpret_cast<const char*>(numbers.data()), numbers.size_bytes());
  };
  for (int t = 0; t <= tube.length(); ++t) {
    const Zonotope& slice = tube.slice(t);
    add(slice.center());
    for (int k = 0; k < slice.dim(); ++k) {
      const double slack = slice.slack(k);
      add(slice.row(k));
      add({&slack, 1});
    }
    add(tube.half_width(t));
    if (t == tube.length()) break;
    const ResidualBounds& envelope = tube.step(t).envelope;
    add(std::span(envelope.lower).first(ToSize(slice.dim())));
    add(std::span(envelope.upper).first(ToSize(slice.dim())));
  }
  return bits;
}

// Each plan is a beginning of an earlier one and steps of its own; -0 and 0 are not the same control.
std::vector<Eigen::MatrixXd> AnyFamily(Random& random, const Eigen::MatrixXd& one, int count) {
  std::vector<Eigen::MatrixXd> plans{one};
  while (std::ssize(plans) < count) {
    Eigen::MatrixXd next = plans[ToSize(random.Below(static_cast<int>(plans.size())))];
    const Eigen::Index steps = random.Integer(1, 16), kept = next.cols();
    next.conservativeResize(Eigen::NoChange, steps);
    if (steps > kept) next.rightCols(steps - kept) = random.Matrix(2, static_cast<int>(steps - kept), 0.5);
    const int own = random.Below(static_cast<int>(steps) + 1);
    next.rightCols(own) += random.Matrix(2, own, 0.2);
    if (random.Coin(0.2)) next(0, random.Below(static_cast<int>(steps))) = random.Coin() ? 0.0 : -0.0;
    plans.push_back(next);
  }
  return plans;
}

TEST(SharedControls, ChangeNoBitOfADecisionOrATube) {
  std::map<Outcome, int> outcomes;
  int steps = 0, with_limit = 0, moving = 0;
  for (std::uint64_t seed = 1; seed <= 150; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    const bool bicycle = random.Coin();
    const auto problem = AnyTask(random, bicycle);
    const Certifier certifier(problem);
    const Query query = AnyDrive(random, *problem);
    const std::vector<Eigen::MatrixXd> family = AnyFamily(random, query.controls, random.Integer(2, 40));
    std::vector<Plan> plans;
    for (const Eigen::MatrixXd& controls : family)
      plans.push_back({controls.data(), 2, static_cast<int>(controls.cols()), 2, query.schedule});
    Tube tube;
    const std::span one(&query.initial_set, 1);
    static_cast<void>(certifier.Certify(plans[0], query.initial_set, {}, tube));
    std::vector<Obstacle> obstacles;
    for (int o = random.Integer(0, 3); o > 0; --o)
      if (const auto approach = AnyApproach(random, *problem, tube, query.schedule)) {
        obstacles.push_back(approach->At(random.Uniform(0, 30)));
        moving += obstacles.back().motion().has_value();
      }
    std::vector<Decision> single;
    std::vector<std::string> bits;
    for (const Plan& plan : plans) {
      certifier.Require(plan, query.initial_set, obstacles);
      single.push_back(certifier.Certify(plan, query.initial_set, obstacles, tube));
      bits.push_back(BitsOf(tube));
      ++outcomes[single.back().outcome];
      with_limit += single.back().cause == Cause::kLimit;
      steps += tube.length();
    }
    const BatchOptions options{.threads = static_cast<unsigned>(random.Integer(1, 3))};
    const auto decisions = CertifyAll(
        certifier, plans, one, obstacles, options,
        [&](std::size_t i, const Decision&, const Tube& its) { EXPECT_EQ(BitsOf(its), bits[i]) << "plan " << i; });
    for (std::size_t i = 0; i < plans.size(); ++i) EXPECT_EQ(Fields(decisions[i]), Fields(single[i])) << "plan " << i;

    const auto first = std::ranges::find(single, Outcome::kCertified, &Decision::outcome) - single.begin();
    const auto until = CertifyAll(certifier, plans, one, obstacles, {options.threads, true});
    for (std::ptrdiff_t i = 0; i < std::ssize(plans); ++i)
      EXPECT_EQ(Fields(until[ToSize(i)]), Fields(i <= first ? single[ToSize(i)] : Decision{})) << "plan " << i;
  }
  EXPECT_EQ(outcomes[Outcome::kNone], 0);
  EXPECT_GT(outcomes[Outcome::kCertified], 100);
  EXPECT_GT(outcomes[Outcome::kDomain], 100);
  EXPECT_GT(outcomes[Outcome::kSafety], 100);
  EXPECT_GT(with_limit, 20);
  EXPECT_GT(moving, 20);
  EXPECT_GT(steps, 5000);
}

// No residual; counts the steps that are propagated.
struct CountingEnclosure final : ResidualEnclosure {
  void Enclose(const QuerySet&, ResidualBounds& bounds) const noexcept override {
    bounds.lower.fill(0);
    bounds.upper.fill(0);
    bounds.capped = false;
    ++steps;
  }
  mutable std::atomic<int> steps = 0;
};

// A point mass that drives along x, among nothing.
struct SharingTest : testing::Test {
  // Plans of 4 steps by their accelerations along x.
  void Plans(const std::vector<std::array<double, 4>>& accelerations) {
    for (const auto& each : accelerations) {
      Eigen::MatrixXd& controls = controls_.emplace_back(Eigen::MatrixXd::Zero(2, 4));
      for (int t = 0; t < 4; ++t) controls(0, t) = each[ToSize(t)];
    }
    for (const Eigen::MatrixXd& controls : controls_) plans_.push_back({controls.data(), 2, 4, 2});
  }

  // The indices of the plans in the order in which one thread judges them.
  std::vector<std::size_t> Begun(BatchOptions options = {}) {
    std::vector<std::size_t> begun;
    std::mutex mutex;
    decisions_ = CertifyAll(certifier_, plans_, std::span(&start_, 1), obstacles_, options,
                            [&](std::size_t i, const Decision&, const Tube&) {
                              const std::lock_guard lock(mutex);
                              begun.push_back(i);
                            });
    return begun;
  }

  std::vector<bool> Certified() const {
    std::vector<bool> all;
    for (const Decision& decision : decisions_) all.push_back(decision.outcome == Outcome::kCertified);
    return all;
  }

  const CountingEnclosure residual_{};
  const Certifier certifier_{std::make_shared<Problem>(PointMassInHalves(100)), residual_};
  const Zonotope start_ = Zonotope::FromBox(Eigen::VectorXd::Zero(4), Eigen::VectorXd::Constant(4, 0.01));
  std::vector<Obstacle> obstacles_;
  std::vector<Eigen::MatrixXd> controls_;
  std::vector<Plan> plans_;
  std::vector<Decision> decisions_;
};

TEST_F(SharingTest, PropagatesWhatPlansShareOnce) {
  Plans({{1, 1, 1, 1}, {2, 2, 2, 2}, {1, 1, 2, 2}, {2, 2, 2, 1}, {1, 1, 1, 1}});
  EXPECT_EQ(Begun(), (std::vector<std::size_t>{0, 4, 2, 1, 3})) << "kin follow one another, each in its order";
  EXPECT_EQ(residual_.steps, 4 + 0 + 2 + 4 + 1);
}

TEST_F(SharingTest, KeepsTheOrderOfPlansThatShareNothing) {
  Plans({{2, 1, 1, 1}, {1, 1, 1, 1}, {-1, 1, 1, 1}, {0, 1, 1, 1}, {-0.0, 1, 1, 1}});
  EXPECT_EQ(Begun(), (std::vector<std::size_t>{0, 1, 2, 3, 4}));
  EXPECT_EQ(residual_.steps, 5 * 4);
}

TEST_F(SharingTest, UsesTheTubesThatItIsGiven) {
  Plans({{2, 1, 1, 1}, {1, 1, 1, 1}});
  std::array<Tube, 2> tubes;
  static_cast<void>(Begun({.tubes = tubes}));
  EXPECT_EQ(tubes[0].length(), 4);
  EXPECT_THROW(Begun({.threads = 3, .tubes = tubes}), std::invalid_argument);
  EXPECT_EQ(Begun({.threads = UINT_MAX}).size(), 2u) << "no more threads than plans";
}

TEST_F(SharingTest, SharesNothingOfAPlanThatBeginsElsewhere) {
  Plans({{1, 1, 1, 1}, {1, 1, 1, 1}});
  const std::array<Zonotope, 2> starts{start_, Zonotope::FromBox(Vec({5, 0, 0, 0}), Vec({0.1, 0.1, 0.1, 0.1}))};
  static_cast<void>(CertifyAll(certifier_, plans_, starts, {}));
  EXPECT_EQ(residual_.steps, 2 * 4);
}

TEST_F(SharingTest, GoesOnWhereAPlanThatSharesControlsLeftTheDomain) {
  Plans({{2, 200, 1, 1}, {2, 200, 1, 2}, {2, 2, 1, 1}});
  EXPECT_EQ(Begun(), (std::vector<std::size_t>{0, 1, 2}));
  EXPECT_EQ(decisions_[0].cause, Cause::kDomainExit);
  EXPECT_EQ(Fields(decisions_[1]), Fields(decisions_[0]));
  EXPECT_EQ(Certified(), (std::vector<bool>{false, false, true}));
}

TEST_F(SharingTest, JudgesNothingAfterTheFirstCertifiedPlan) {
  Plans({{2, 2, 2, 2}, {1, 1, 1, 1}, {0, 0, 0, 0}, {2, 1, 1, 1}});
  obstacles_ = {Obstacle::Circle(Eigen::Vector2d(4, 0), 0.1)};
  EXPECT_EQ(Begun({.until_certified = true}), (std::vector<std::size_t>{0, 3, 1}))
      << "the last one shares a control with the first";
  EXPECT_EQ(decisions_[0].outcome, Outcome::kSafety);
  EXPECT_EQ(decisions_[1].outcome, Outcome::kCertified);
  EXPECT_EQ(decisions_[2].outcome, Outcome::kNone);
  EXPECT_EQ(decisions_[3].outcome, Outcome::kNone) << "it was judged, but comes after the certified one";
}

TEST_F(SharingTest, BeginsNoPlanAfterTheDeadline) {
  Plans({{2, 1, 1, 1}, {1, 1, 1, 1}, {0, 1, 1, 1}});
  std::atomic<std::int64_t> now = 100;
  const auto clock = [&] { return now++; };
  EXPECT_EQ(Begun({.clock = clock, .deadline = 102}), (std::vector<std::size_t>{0, 1}));
  EXPECT_EQ(Certified(), (std::vector<bool>{true, true, false}));
  EXPECT_EQ(decisions_[2].outcome, Outcome::kNone);
  EXPECT_EQ(Begun({.clock = clock, .deadline = 102}), std::vector<std::size_t>{}) << "it is past";
  EXPECT_EQ(Certified(), (std::vector<bool>{false, false, false}));
}

}  // namespace forereach::batch_test
