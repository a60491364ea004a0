/** A zonotope <c, G> + [-s, s] = {c + G b + diag(s) b' : |b|_inf <= 1, |b'|_inf <= 1}, Eq. (zonotope-definition), in up
to 16 dimensions, with up to 112 generators in G.

The box [-s, s], called the slack, contains the rounding errors. It is separate from G so that errors of 1e-15 do not
count as generators and do not displace a real generator in the order reduction. A set without rounding errors has s =
0.

The type is a value of fixed capacity. It uses no heap and is trivially copyable, so the certify step can work on it in
place. Row k of G, which holds coordinate k of every generator, is contiguous and padded with zeros to a multiple of
kLaneCount, so a sum over generators reads four consecutive doubles at a time. */
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "forereach/numerics/instruction_set.h"
#include "forereach/numerics/interval.h"
#include "forereach/numerics/lanes.h"
#include "forereach/numerics/limits.h"
#include "forereach/numerics/size.h"
#include "forereach/sets/box.h"
#include "forereach/sets/eigen.h"

FOREREACH_ARITHMETIC_BEGIN

namespace forereach {

class Zonotope final {
 public:
  /** The point of dimension 0. */
  Zonotope() = default;

  /** @param center c, n entries. @param generators G, n-by-m with m <= kMaxGenerators; m = 0 gives the point `center`.
  @throws std::invalid_argument if sizes disagree or exceed the capacity, or an entry is not finite. */
  Zonotope(const Eigen::VectorXd& center, const Eigen::MatrixXd& generators);

  /** The set {x : |x - center| <= half_width}, exactly. A zero half-width gives no generator.
  @throws std::invalid_argument if sizes disagree or exceed the capacity, or a half-width is negative or not finite. */
  [[nodiscard]] static Zonotope FromBox(const Eigen::VectorXd& center, const Eigen::VectorXd& half_width);

  /** An axis-aligned zonotope that contains the box, rounded outward. */
  [[nodiscard]] static Zonotope Enclose(const Box& box);

  [[nodiscard]] int dim() const { return dim_; }
  [[nodiscard]] int num_generators() const { return num_generators_; }
  [[nodiscard]] double center(int k) const { return center_[ToSize(k)]; }
  [[nodiscard]] std::span<const double> center() const { return {center_.data(), ToSize(dim_)}; }
  [[nodiscard]] double generator(int k, int j) const { return row(k)[ToSize(j)]; }
  /** Coordinate k of every generator. */
  [[nodiscard]] std::span<const double> row(int k) const { return {rows_[ToSize(k)].data(), ToSize(num_generators_)}; }
  [[nodiscard]] double slack(int k) const { return slack_[ToSize(k)]; }
  [[nodiscard]] Eigen::VectorXd CenterVector() const;
  /** All generators as columns: the columns of G, then s_k e_k for each k with s_k > 0. */
  [[nodiscard]] Eigen::MatrixXd GeneratorMatrix() const;

  /** An upper bound on sum_j |G_kj| + s_k, the half-width of the interval hull in coordinate k. Cost O(m). */
  [[nodiscard]] double HalfWidthUpper(int k) const noexcept;
  /** An interval that contains coordinate k of every point of the set: Box(Z)_k, rounded outward. Cost O(m). */
  [[nodiscard]] Interval Hull(int k) const noexcept;
  /** An upper bound on the support function max {d . z : z in Z}, Eq. (zonotope-support).
  @param direction d, n entries. Cost O(n m). */
  [[nodiscard]] double SupportUpper(std::span<const double> direction) const noexcept;

  /** The row with its padding of zeros. */
  [[nodiscard]] std::span<const double> padded_row(int k) const { return {rows_[ToSize(k)].data(), padded_size()}; }
  /** num_generators() rounded up to a multiple of kLaneCount. */
  [[nodiscard]] std::size_t padded_size() const { return PaddedToLanes(ToSize(num_generators_)); }

  /** @name In-place construction, for kernels that own the set. These functions check nothing. */
  ///@{
  /** Sets the sizes. The caller then writes centers, slacks and rows, and keeps the padding of the rows zero. */
  void Reset(int dim, int num_generators) {
    dim_ = dim;
    num_generators_ = num_generators;
  }
  /** Keeps the first `kept` columns and sets the columns after them, up to `num_generators`, to zero. */
  FOREREACH_INLINE void Resize(int kept, int num_generators) noexcept {
    num_generators_ = num_generators;
    const std::size_t rest = ToSize(kept) % kLaneCount, end = padded_size();
    std::size_t j = ToSize(kept) - rest;
    if (rest > 0) {
      for (int k = 0; k < dim_; ++k) StoreLanes(FirstLanes(LoadLanes(mutable_row(k) + j), rest, 0), mutable_row(k) + j);
      j += kLaneCount;
    }
    for (; j < end; j += kLaneCount)
      for (int k = 0; k < dim_; ++k) StoreLanes(AllLanes(0), mutable_row(k) + j);
  }
  /** Copies only the entries in use of another set: about 2 kB of the 15 kB of the whole value. */
  void Assign(const Zonotope& other) noexcept;
  [[nodiscard]] double& mutable_slack(int k) { return slack_[ToSize(k)]; }
  [[nodiscard]] double& mutable_center(int k) { return center_[ToSize(k)]; }
  /** Arrays of kMaxStates entries; the first dim() are in use. */
  [[nodiscard]] const double* centers() const { return center_.data(); }
  [[nodiscard]] const double* slacks() const { return slack_.data(); }
  [[nodiscard]] double* mutable_slacks() { return slack_.data(); }
  [[nodiscard]] double* mutable_centers() { return center_.data(); }
  [[nodiscard]] double* mutable_row(int k) { return rows_[ToSize(k)].data(); }
  /** Appends the generator length * e_k unless length is zero. */
  void AppendAxis(int k, double length) noexcept;
  ///@}

 private:
  int dim_ = 0, num_generators_ = 0;
  std::array<double, kMaxStates> center_, slack_;
  alignas(32) std::array<std::array<double, kMaxGenerators>, kMaxStates> rows_;
  static_assert(kMaxGenerators % kLaneCount == 0);
};

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
      const Lanes score = Min(sum - largest, AllLanes(kMaxDouble));  // finite, so changing its bits cannot give NaN
      const LaneMask bits = (Bits(score) & ~LaneMask{127, 127, 127, 127}) | index_;
      const LaneMask nonzero = largest > AllLanes(0);
      nonzero_ -= nonzero;
      index_ -= LaneMask{4, 4, 4, 4};
      StoreLanes(nonzero ? FromBits(bits) : AllLanes(-1), &scores_.scores_[first_column]);
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
    LaneMask nonzero_{}, index_{kMaxGenerators, kMaxGenerators - 1, kMaxGenerators - 2, kMaxGenerators - 3};
  };

  /** One score for each column, padded with infinity to a multiple of kBlock. */
  [[nodiscard]] const double* data() const { return scores_.data(); }
  [[nodiscard]] int num_nonzero() const { return num_nonzero_; }

 private:
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
