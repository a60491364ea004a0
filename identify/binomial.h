/** Bounds on a probability from counts. */
#pragma once

namespace forereach {

/** Clopper & Pearson's upper bound: the largest p with P(X <= count) >= 1 - confidence for X ~ Binomial(trials, p),
rounded up. In `trials` independent trials that each succeed with probability p, of which `count` did, p is at most the
bound with at least this confidence, whatever p is. It is 1 if every trial succeeded.
@pre 0 <= count <= trials, trials >= 1, 0 < confidence < 1. */
[[nodiscard]] double ProbabilityUpper(int count, int trials, double confidence);

}  // namespace forereach
