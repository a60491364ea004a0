#include "research/chunks/training.h"

#include "tests/test.h"

#include "research/chunks/blocks.h"

namespace forereach::research::training_test {

TrainingOptions Few(int epochs, std::uint64_t seed) { return {384, epochs, seed, 1}; }

TEST(Training, TheSameSeedGivesTheSamePolicyOnAnyNumberOfThreads) {
  const Policy one = TrainPolicy(Few(3, 5));
  TrainingOptions options = Few(3, 5);
  options.threads = 3;
  const Policy two = TrainPolicy(options), other = TrainPolicy(Few(3, 6));
  ASSERT_EQ(one.layers.size(), 3u);
  for (std::size_t l = 0; l < 3; ++l) {
    EXPECT_EQ(one.layers[l].weight, two.layers[l].weight) << l;
    EXPECT_EQ(one.layers[l].bias, two.layers[l].bias) << l;
    EXPECT_NE(one.layers[l].weight, other.layers[l].weight) << l;
  }
}

TEST(Training, IsTwoLayersOf64From12To40) {
  const Policy policy = TrainPolicy(Few(1, 1));
  EXPECT_EQ(policy.num_features(), 12);
  EXPECT_EQ(policy.num_inputs * policy.num_steps(), 40);
  EXPECT_FIELDS(policy, (layers[0].bias.size(), 64), (layers[1].bias.size(), 64));
}

TEST(Training, LearnsWhatItIsShown) {
  const Demonstrations shown = MakeDemonstrations(384, 5, 1);
  const double little = CloningError(TrainPolicy(Few(1, 5)), shown);
  const double more = CloningError(TrainPolicy(Few(60, 5)), shown);
  EXPECT_LT(more, 0.5);
  EXPECT_LT(more, 0.6 * little);
}

// What `research/run train` gives and what is checked in agree on errands that neither was taught.
TEST(Training, TheShippedPolicyDoesAsTheExpertDoes) {
  EXPECT_LT(CloningError(ShippedPolicy(), MakeDemonstrations(300, 2, 1)), 0.16);
}

}  // namespace forereach::research::training_test
