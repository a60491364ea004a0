/** Behaviour cloning: fits a network to the expert's actions by least squares. Only this code uses dlib. */
#pragma once

#include <cstdint>

#include "planner_bridge/policy.h"
#include "research/chunks/demonstrations.h"

namespace forereach::research {

struct TrainingOptions {
  int demonstrations = 12'000;
  int epochs = 100;
  std::uint64_t seed = 1;  ///< Of demonstrations, first weights and the order of samples
  unsigned threads = 1;    ///< For the demonstrations; the result does not depend on it
};

/** Two hidden layers of 64 with tanh; features and blocks scaled to mean 0 and deviation 1; mini-batches of 64, Adam, a
rate that falls from 2e-3 to 1e-5. The same options give the same policy, to the last bit where the same BLAS runs on
the same instructions. Not for two threads at once. Takes half a minute with the options above. */
[[nodiscard]] Policy TrainPolicy(const TrainingOptions& options);

/** The root mean square over demonstrations and entries of (policy - expert) / output.scale: 1 would be a policy that
knows the mean only. */
[[nodiscard]] double CloningError(const Policy& policy, const Demonstrations& demonstrations);

}  // namespace forereach::research
