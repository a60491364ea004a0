// A batch gives the same decisions as single calls, for every number of threads.
#include "forereach/certify/batch.h"

#include <atomic>

#include "tests/test.h"

#include "tests/oracle/problems.h"

namespace forereach::batch_test {

auto Fields(const Decision& d) {
  return std::tuple(d.outcome, d.cause, d.step, d.exit.kind, d.exit.index, d.coordinate, d.first_observation,
                    d.second_observation, d.obstacle, d.closest_step, d.margin, d.threshold, d.capped);
}

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

class BatchTest : public testing::Test {
 protected:
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
    const auto decisions = CertifyAll(certifier_, plans_, initial_sets_, obstacles_, threads,
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
  const auto decisions = CertifyAll(certifier_, plans_, first, obstacles_, 3);
  for (std::size_t i = 0; i < kPlans; ++i)
    EXPECT_EQ(Fields(decisions[i]), Fields(certifier_.Certify(plans_[i], first[0], obstacles_, tube))) << i;
}

TEST_F(BatchTest, NoPlansNoDecisions) { EXPECT_TRUE(CertifyAll(certifier_, {}, {}, obstacles_, 4).empty()); }

TEST_F(BatchTest, SaysWhatDoesNotFit) {
  using testing::HasSubstr;
  using testing::ThrowsMessage;
  const std::span two(initial_sets_.data(), 2);
  EXPECT_THAT([&] { (void)CertifyAll(certifier_, plans_, two, obstacles_, 1); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("2 initial sets, must be 1 or 300")));
  EXPECT_THAT([&] { (void)CertifyAll(certifier_, plans_, initial_sets_, obstacles_, 0); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("0 threads")));
}

}  // namespace forereach::batch_test
