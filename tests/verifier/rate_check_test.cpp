// Rates between two samples, confirmed to the last bit.
#include "verifier/rate_check.h"

#include "tests/test.h"

#include "forereach/dynamics/text_model.h"
#include "tests/text_models.h"
#include "tests/worlds.h"

namespace forereach::rate_check_test {

using verifier::Answer;
using verifier::RateClaim;

constexpr double kPeriod = 0.125;

// A mass with v = x', |v| <= 3 and |v'| <= 2 at its samples: |v| <= 3.25 between them.
struct RateCheck : testing::Test {
  verifier::RateVerdict Check(const std::vector<RateClaim>& claims) {
    return verifier::CheckRates(*model_, domain_, kPeriod, reachable_, claims);
  }

  std::shared_ptr<const NominalModel> model_ = MakeTextModel(
      TextModel({{"x", "v"}, {"v", "u"}}, {"u"}, {{"dt", kPeriod, kPeriod}}, {}, ModelText::Integrator::kRk4));
  Domain domain_{.state = Box(Vec({-1, -3}), Vec({1, 3})), .input = Box(Vec({-2}), Vec({2}))};
  Box reachable_{Vec({-1.5, -3.25, -2}), Vec({1.5, 3.25, 2})};
};

TEST_F(RateCheck, ConfirmsTheLargestRateAndRefutesALesserOne) {
  EXPECT_EQ(Check({{0, 3.25}, {1, 2}}).answer, Answer::kYes);
  EXPECT_FIELDS(Check({{0, std::nextafter(3.25, 0)}}), (answer, Answer::kNo), (state, 0));
  EXPECT_FIELDS(Check({{0, 3.25}, {1, std::nextafter(2, 0)}}), (answer, Answer::kNo), (state, 1));
  EXPECT_FIELDS(Check({{0, 3}}), (answer, Answer::kNo), (state, 0));
}

TEST_F(RateCheck, ConfirmsNothingOverABoxThatAMotionMayLeave) {
  const auto within = [&](const Eigen::VectorXd& lower, const Eigen::VectorXd& upper) {
    reachable_ = Box(lower, upper);
    return Check({{0, 9}});
  };
  EXPECT_EQ(within(Vec({-1.5, -3.25, -2}), Vec({1.5, 3.25, 2})).answer, Answer::kYes);
  EXPECT_FIELDS(within(Vec({-1.5, -3.25, -2}), Vec({1.5, std::nextafter(3.25, 0), 2})), (answer, Answer::kUnknown),
                (state, 1));
  EXPECT_FIELDS(within(Vec({-1.4, -3.25, -2}), Vec({1.5, 3.25, 2})), (answer, Answer::kUnknown), (state, 0));
  EXPECT_EQ(within(Vec({-1.5, -2, -2}), Vec({1.5, 3.25, 2})).answer, Answer::kUnknown) << "nor without the domain";
  EXPECT_EQ(within(Vec({-1.5, -3.25, -1}), Vec({1.5, 3.25, 2})).answer, Answer::kUnknown) << "and all inputs";
  EXPECT_EQ(within(Vec({-1.5, -3.25}), Vec({1.5, 3.25})).answer, Answer::kUnknown);
}

// The rate of a model whose rates use dt is at dt, not at a step of no duration.
TEST_F(RateCheck, TakesDtInARateForANumber) {
  model_ = MakeTextModel(
      TextModel({{"x", "v + dt"}, {"v", "u"}}, {"u"}, {{"dt", kPeriod, kPeriod}}, {}, ModelText::Integrator::kEuler));
  EXPECT_EQ(Check({{0, 3.375}}).answer, Answer::kYes);
  EXPECT_EQ(Check({{0, std::nextafter(3.375, 0)}}).answer, Answer::kNo);
}

TEST_F(RateCheck, OverAPoleIsNotConfirmed) {
  model_ = MakeTextModel(
      TextModel({{"x", "1/v"}, {"v", "u"}}, {"u"}, {{"dt", kPeriod, kPeriod}}, {}, ModelText::Integrator::kEuler));
  EXPECT_NE(Check({{0, 1e9}}).answer, Answer::kYes);
}

}  // namespace forereach::rate_check_test
