/** How often fresh transitions contradict what was learned from others: the transitions are cut into blocks of time,
the first, third, ... to learn from and the others to judge by. */
#pragma once

#include <vector>

#include "forereach/certify/problem.h"

namespace forereach {

/** A split of transitions 0..N-1, which stand in the order of time. */
struct Split {
  struct Block {
    int begin = 0, end = 0;
    [[nodiscard]] int size() const { return end - begin; }
  };
  std::vector<Block> learn, judge;  ///< Contiguous, of nearly equal size, alternating.
};

/** @throws std::invalid_argument unless 2 <= blocks <= count. */
[[nodiscard]] Split SplitByTime(int count, int blocks);

/** The rows of the blocks, in order. */
[[nodiscard]] Transitions RowsOf(const Transitions& transitions, const std::vector<Split::Block>& blocks);

/** What the judging blocks say against a declaration and the learning transitions. A transition counts if it provably
contradicts one of the learning transitions or, in an affine row, what they leave of it; those among each other do not
count. */
struct ContradictionCounts {
  int transitions = 0, contradicting = 0;
  int blocks = 0, blocks_contradicting = 0;
};

/** Cost: one descent of a search tree over the learning transitions for each judging one and each row of L; of an
affine row, AffineSet::Derive and Enclose. */
[[nodiscard]] ContradictionCounts CountContradictions(const Problem& problem, const Declaration& declaration,
                                                      const Split& split);

/** A stretch of a block whose transitions follow one another: each begins in the state in which the one before it ends.
 */
struct HoldOutWindow {
  int begin = 0, steps = 0;
};

/** The stretches of exactly `steps` transitions in the judging blocks that do not overlap, in order. */
[[nodiscard]] std::vector<HoldOutWindow> WindowsOf(const Transitions& transitions, const Split& split, int steps);

/** Clopper & Pearson's upper bound: the largest p with P(X <= count) >= 1 - confidence for X ~ Binomial(trials, p),
rounded up. In `trials` independent trials that each succeed with probability p, of which `count` did, p is at most the
bound with at least this confidence, whatever p is. It is 1 if every trial succeeded.
@pre 0 <= count <= trials, trials >= 1, 0 < confidence < 1. */
[[nodiscard]] double ProbabilityUpper(int count, int trials, double confidence);

}  // namespace forereach
