/** Girard's order reduction of a zonotope in place, Eq. (order-reduction): scores of its columns, and the reduction. */
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "forereach/numerics/instruction_set.h"
#include "forereach/numerics/interval.h"
#include "forereach/numerics/lanes.h"
#include "forereach/numerics/limits.h"

FOREREACH_ARITHMETIC_BEGIN

namespace forereach {

class Zonotope;

/** The scores |g|_1 - |g|_inf of all columns, Eq. (order-reduction). The last bits of a score hold the column's index,
so no two scores are equal, and of two equal values the earlier column's score is larger. Zero columns have score -1. */
class ColumnScores {
 public:
  static constexpr std::size_t kBlock = 8 * kLaneCount;

  /** Writes the scores of four columns at a time. Use it as a local variable, so that its state stays in registers. */
  class Writer {
   public:
    FOREREACH_INLINE explicit Writer(ColumnScores& scores) : scores_(scores) {}
    /** Writes the next four scores. @param sum |g|_1 of each column. @param largest |g|_inf of each column. */
    FOREREACH_INLINE void Add(std::size_t first_column, const Lanes& sum, const Lanes& largest) {
      StoreLanes(Scores(sum, largest, index_), &scores_.scores_[first_column]);
      nonzero_ -= largest > AllLanes(0);
      index_ -= LaneMask{4, 4, 4, 4};
    }
    /** Writes the padding. Call it after all `count` columns. */
    FOREREACH_INLINE void Finish(std::size_t count) {
      scores_.num_nonzero_ = static_cast<int>((nonzero_[0] + nonzero_[1]) + (nonzero_[2] + nonzero_[3]));
      double* scores = scores_.scores_.data();
      const std::size_t rest = count % kLaneCount;
      if (rest > 0) StoreLanes(FirstLanes(LoadLanes(scores + count - rest), rest, kInfinity), scores + count - rest);
      for (std::size_t j = PaddedToLanes(count); j % kBlock != 0; j += kLaneCount)
        StoreLanes(AllLanes(kInfinity), scores + j);
    }

   private:
    ColumnScores& scores_;
    LaneMask nonzero_{}, index_ = kFirstIndices;
  };

  /** Writes the score of one column again. @param sum, largest its |g|_1 and |g|_inf. */
  FOREREACH_INLINE void Rewrite(std::size_t column, double sum, double largest) {
    const std::int64_t index = kMaxGenerators - static_cast<std::int64_t>(column);
    double& score = scores_[column];
    num_nonzero_ -= static_cast<int>(score >= 0);
    score = Scores(AllLanes(sum), AllLanes(largest), LaneMask{index, index, index, index})[0];
    num_nonzero_ += static_cast<int>(score >= 0);
  }

  /** One score for each column, padded with infinity to a multiple of kBlock. */
  [[nodiscard]] const double* data() const { return scores_.data(); }
  [[nodiscard]] int num_nonzero() const { return num_nonzero_; }

 private:
  static constexpr LaneMask kFirstIndices{kMaxGenerators, kMaxGenerators - 1, kMaxGenerators - 2, kMaxGenerators - 3};

  FOREREACH_INLINE static Lanes Scores(const Lanes& sum, const Lanes& largest, const LaneMask& index) {
    const Lanes score = Min(sum - largest, AllLanes(kMaxDouble));  // finite, so changing its bits cannot give NaN
    const LaneMask bits = (Bits(score) & ~LaneMask{127, 127, 127, 127}) | index;
    return largest > AllLanes(0) ? FromBits(bits) : AllLanes(-1);
  }

  int num_nonzero_;
  alignas(32) std::array<double, (kMaxGenerators + kBlock - 1) / kBlock * kBlock> scores_;
};

/** Computes the scores of all columns of the set. Cost O(n m). */
void ScoreColumns(const Zonotope& set, ColumnScores& scores) noexcept;

/** Appends the nonzero generators among first_k e_k, then among second_k e_k, and reduces the order by Girard's method,
Eq. (order-reduction). If the set then has more than order * n generators, it keeps the (order - 1) * n columns of
largest |g|_1 - |g|_inf and encloses the others in a box, rounded outward. Of columns whose scores agree to 45 bits, the
earlier one is kept. Zero columns are removed. The slack does not change. The result contains the set with all
generators.
@param scores those of the set's columns. @param first, second n lengths; kMaxStates entries must be readable.
@param instructions changes the computing time only.
Cost O(n m + m^2) for m generators. */
void AppendAndReduce(Zonotope& set, const ColumnScores& scores, const double* first, const double* second, int order,
                     InstructionSet instructions = BestInstructionSet()) noexcept;

}  // namespace forereach

FOREREACH_ARITHMETIC_END
