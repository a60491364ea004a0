/** The derivatives of an integrator's step (stages.h) from those of the rates at its stages. With F and F_j the first
and second derivatives of f at a stage's argument x_s,

    D k = F D x_s,    D^2 k_j = sum_l F_jl D^2 x_s,l + (D x_s)^T F_j (D x_s).

Numbers are c +- r in plain arithmetic: the radius counts what rounding took. Four of them are a cell, of one row: first
derivatives by four columns, or second derivatives by four pairs of columns. Which cells a stage computes, of which
others, is known before; those that are zero, and those that are zeros and ones, cost nothing. */
#pragma once

#include <array>
#include <span>
#include <vector>

#include "forereach/dynamics/program.h"
#include "forereach/dynamics/stages.h"
#include "forereach/numerics/instruction_set.h"
#include "forereach/numerics/interval_pair.h"
#include "forereach/numerics/lanes.h"
#include "forereach/numerics/size.h"

FOREREACH_ARITHMETIC_BEGIN

namespace forereach {

/** Factors are blocks of two numbers, each as the second and the fourth entry of three vectors: c, and what it is in a
bound on the radius of a product. A rule reads the fourth, or the second if it is given the block two doubles before. */
inline constexpr int kFactorBlock = 3 * static_cast<int>(kLaneCount);

/** Above the relative error of a sum of all products for one entry: 24 variables and 136 pairs of them, two roundings
each. docs/soundness.md, 3.3. */
inline constexpr double kOfSum = 0x1p-44;

/** Stores the block of two intervals. @param pair moderate. */
FOREREACH_INLINE void StoreFactors(const Lanes& pair, double* to) {
  const Lanes center = (pair - Swapped(pair)) * AllLanes(0.5);  // -c, c of each
  const Lanes distance = pair - center, radius = Max(distance, Swapped(distance)), size = Abs(center);
  StoreLanes(center, to);
  StoreLanes((size + radius) * AllLanes(1 + kOfSum), to + kLaneCount);
  StoreLanes((radius + size * AllLanes(kOfSum)) * AllLanes(1 + kOfSum), to + 2 * kLaneCount);
}

class ChainRule final {
 public:
  /** Two columns, or two variables. */
  struct Pair {
    int row, column;
    friend bool operator==(const Pair&, const Pair&) = default;
  };

  /** @param rates the program of f. @param columns the variables by which there are first derivatives. @param pairs of
  columns, those of the second derivatives. Others are zero in each stage. @param dt the step, s. */
  ChainRule(const Program& rates, std::span<const StageEvaluation> evaluations, double dt, std::vector<int> columns,
            std::vector<Pair> pairs);

  /** The doubles that the rule works on. */
  [[nodiscard]] std::size_t size() const { return ToSize(num_cells_) * kCell; }
  /** Makes them ready for the first stage. */
  void Begin(double* cells) const noexcept;
  /** Adds stage s. False if a number is not moderate (interval_pair.h): then nothing is bounded.
  @param factors block e of first derivative e, in the order of the program's, and behind these the second derivatives,
  two in a block. */
  [[nodiscard]] bool Advance(std::size_t s, const double* factors, double* cells,
                             InstructionSet instructions = BestInstructionSet()) const noexcept;

  /** Where the center of a derivative of the successor is, after the last stage; its radius is kLaneCount behind. */
  [[nodiscard]] std::size_t Place(int output, int column) const;
  [[nodiscard]] std::size_t Place(int output, Pair pair) const;

 private:
  static constexpr std::size_t kCell = 2 * kLaneCount;
  static constexpr int kConstants = 16;  // the first cells: of zeros and ones, cell b has ones where b has bits

  // cells[to] = entries from other cells
  struct Gather {
    std::array<int, kLaneCount> from;  // doubles
    int to;
  };
  // cells[to] = a b + c d, or a b if c is -1
  struct Product {
    int a, b, c, d, to;
  };
  struct Term {
    int factor, cell;  // a double of the factors
  };
  // A cell k of the rates: the terms from the last target's on; next = start + before k, sum = base + weight k.
  struct Target {
    int last, start, next, base, sum;
  };
  struct Number {
    double center, all, spread;
    Number(const StepPart& part, double dt);
  };
  struct Stage {
    Number before_next, weight;
    bool has_next, has_weight;
    std::vector<Gather> gathers;
    std::vector<Product> products;
    std::vector<Term> terms;
    std::vector<Target> targets;
  };
  // Cells of each row.
  using Table = std::vector<std::vector<int>>;
  class Builder;

  [[nodiscard]] inline bool AdvanceInline(std::size_t s, const double* factors, double* cells) const noexcept;

  std::vector<int> columns_;
  std::vector<Pair> pairs_;
  std::vector<Stage> stages_;
  Table first_, second_;  // of the sum
  int num_cells_ = kConstants;
};

}  // namespace forereach

FOREREACH_ARITHMETIC_END
