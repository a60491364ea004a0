#include "forereach/dynamics/staged_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "forereach/dynamics/evaluate.h"
#include "forereach/dynamics/stages.h"
#include "forereach/numerics/instruction_set.h"
#include "forereach/numerics/lanes.h"
#include "forereach/numerics/size.h"

FOREREACH_ARITHMETIC_BEGIN

namespace forereach {
namespace {

// ---- Rows of numbers c +- r, in plain arithmetic: the radius counts what rounding took.

struct Number {
  double center, radius;

  explicit Number(const Interval& x) : center(x.Middle()), radius(x.DistanceUpper(center)) {}
};

// Above the relative error of a sum of all products for one entry: 24 variables and 136 pairs of them, two roundings
// each. And what is added for underflow; its products are far from subnormal, which processors multiply slowly.
constexpr double kOfSum = 0x1p-44, kUnderflow = 0x1p-400;

// Entry by entry, to + factor * row, for `count` entries. Row sums of radii are finished by Finish.
FOREREACH_INLINE void AddTimes(const Number& factor, const double* center, const double* radius, std::size_t count,
                               double* to_center, double* to_radius) {
  const double size = std::abs(factor.center);
  const Lanes all = AllLanes((size + factor.radius) * (1 + kOfSum)),
              spread = AllLanes((factor.radius + size * kOfSum) * (1 + kOfSum));
  for (std::size_t i = 0; i < count; i += kLaneCount) {
    const Lanes c = LoadLanes(center + i), r = LoadLanes(radius + i);
    StoreLanes(LoadLanes(to_center + i) + AllLanes(factor.center) * c, to_center + i);
    StoreLanes(LoadLanes(to_radius + i) + (all * r + spread * Abs(c)), to_radius + i);
  }
}

// Covers the rounding of the radii themselves.
FOREREACH_INLINE void Finish(std::size_t count, double* radius) {
  for (std::size_t i = 0; i < count; i += kLaneCount)
    StoreLanes(LoadLanes(radius + i) * AllLanes(1 + 2 * kOfSum) + AllLanes(kUnderflow), radius + i);
}

// Products of three numbers below this, and sums of all of them, do not overflow; a NaN fails the comparison.
constexpr double kLargest = 0x1p300;

bool IsModerate(const Interval& x) { return x.lower > -kLargest && x.upper < kLargest; }

// The second derivatives by the columns i and l of one number, for l >= i in groups of four columns.
struct Block {
  int i, first_l;
};
constexpr int kMaxColumns = static_cast<int>(PaddedToLanes(kMaxVariables));
constexpr int kMaxBlocks = 40;  // of 16 states: 4 (4 + 3 + 2 + 1)

}  // namespace

// The integrator's evaluations, the derivatives of the rates that are not zero, and the columns by which a Hessian has
// entries.
class StagedModel::Stages final {
 public:
  Stages(std::shared_ptr<const ProgramDraft> rates, ModelText::Integrator integrator, double dt)
      : draft_(std::move(rates)), rates_(draft_->View()), evaluations_(EvaluationsOf(integrator)), dt_(dt) {
    if (!HasStages(integrator)) throw std::invalid_argument("a model with stages needs the integrator midpoint or rk4");
    Mark();
    for (int l = 0; l < rates_.variables; ++l) all_columns_.push_back(l);
    second_.assign(rates_.hessian.begin(), rates_.hessian.end());
    std::ranges::stable_sort(second_, {}, [](const Program::Second& e) { return std::pair(e.row, e.column); });
    for (int e = 0; e < static_cast<int>(second_.size()); ++e) {
      const Program::Second& entry = second_[ToSize(e)];
      if (pairs_.empty() || pairs_.back().a != entry.row || pairs_.back().b != entry.column)
        pairs_.push_back({entry.row, entry.column, e, e});
      ++pairs_.back().last;
    }
    FindPattern();
  }

  [[nodiscard]] Program Lists() const {
    Program lists;
    lists.states = rates_.states;
    lists.variables = rates_.variables;
    lists.jacobian = jacobian_;
    lists.num_first = static_cast<int>(jacobian_.size());
    lists.hessian = hessian_;
    lists.num_second = static_cast<int>(hessian_.size());
    return lists;
  }

  void Evaluate(std::span<const double> z, std::span<const double> parameters,
                std::span<long double> next) const noexcept {
    const auto n = ToSize(rates_.states);
    std::array<long double, kMaxVariables> at{};
    std::array<long double, kMaxStates> k{}, sum{};
    std::ranges::copy(z, at.begin());
    const std::span values(FOREREACH_ON_STACK(long double, rates_.size), ToSize(rates_.size));
    for (const StageEvaluation& evaluation : evaluations_) {
      const auto before = evaluation.before.Of<long double>(dt_), weight = evaluation.weight.Of<long double>(dt_);
      for (std::size_t j = 0; j < n; ++j) at[j] = z[j] + before * k[j];
      forereach::Evaluate<long double>(rates_, values_needed_, parameters, {at.data(), z.size()}, values);
      for (std::size_t j = 0; j < n; ++j) sum[j] += weight * (k[j] = values[ToSize(rates_.value[j])]);
    }
    for (std::size_t j = 0; j < n; ++j) next[j] = z[j] + sum[j];
  }

  void LinearizeOver(std::span<const Interval> box, std::span<const Interval> parameters,
                     Linearization& out) const noexcept {
    std::array<Interval, kMaxVariables> z;
    std::ranges::copy(box, z.begin());
    const std::span values(FOREREACH_ON_STACK(Interval, rates_.size), ToSize(rates_.size));
    Forward forward;
    const bool is_finite =
        Dispatch<&Stages::Run>(BestInstructionSet(), *this, z, parameters, all_columns_, false, values, forward);
    for (std::size_t k = 0; k < ToSize(rates_.states); ++k)
      out.value[k] = is_finite ? forward.sum.value[k] : Interval::Entire();
    out.count = static_cast<int>(jacobian_.size());
    for (std::size_t e = 0; e < jacobian_.size(); ++e) {
      const Program::First& entry = jacobian_[e];
      const auto k = ToSize(entry.row), l = ToSize(entry.column);
      out.entries[e] = {
          entry.row, entry.column,
          is_finite ? Range(forward.sum.slope[k][l], forward.sum.slope_radius[k][l]) : Interval::Entire()};
    }
  }

  void EncloseHessian(std::span<const Interval> box, std::span<const Interval> parameters,
                      HessianEnclosure& out) const noexcept {
    const std::span values(FOREREACH_ON_STACK(Interval, rates_.size), ToSize(rates_.size));
    Forward forward;
    std::array<Interval, kMaxVariables> z;
    std::ranges::copy(box, z.begin());
    const bool is_finite =
        Dispatch<&Stages::Run>(BestInstructionSet(), *this, z, parameters, bent_, true, values, forward);
    out.count = static_cast<int>(hessian_.size());
    for (std::size_t e = 0; e < hessian_.size(); ++e) {
      const Program::Second& entry = hessian_[e];
      const auto k = ToSize(entry.output), at = places_[e];
      out.entries[e] = {
          entry.output, entry.row, entry.column,
          is_finite ? Range(forward.sum.bend[k][at], forward.sum.bend_radius[k][at]) : Interval::Entire()};
    }
  }

 private:
  using Row = std::array<double, ToSize(kMaxColumns)>;
  using BlockRow = std::array<double, kMaxBlocks * kLaneCount>;

  // n numbers with their first and second derivatives by the columns.
  struct Numbers {
    std::array<Interval, kMaxStates> value;
    std::array<Row, kMaxStates> slope, slope_radius;
    std::array<BlockRow, kMaxStates> bend, bend_radius;
    std::array<bool, kMaxStates> is_bent;  // if not, the second derivatives are zero
  };
  struct Forward {
    Numbers start, argument, rate, sum;
    BlockRow product, product_radius;
  };

  // The nodes that values need, those that first derivatives need too, and all.
  void Mark() {
    std::vector<unsigned char> marks(ToSize(rates_.size), 0);
    const auto with_operands = [&] {
      MarkOperands(rates_.nodes, marks);
      return marks;
    };
    for (const int node : rates_.value) marks[ToSize(node)] = 1;
    values_needed_ = with_operands();
    for (const Program::First& entry : rates_.jacobian) marks[ToSize(entry.node)] = 1;
    first_needed_ = with_operands();
    for (const Program::Second& entry : rates_.hessian) marks[ToSize(entry.node)] = 1;
    all_needed_ = with_operands();
  }

  // Which derivatives of the successor may be different from zero, by propagation of what depends on what.
  void FindPattern() {
    const auto n = ToSize(rates_.states);
    using Rows = std::array<std::uint32_t, kMaxStates>;
    Rows argument{}, sum{};
    std::array<Rows, kMaxStates> argument_bent{}, sum_bent{};
    for (std::size_t j = 0; j < n; ++j) argument[j] = sum[j] = 1u << j;
    for (std::size_t s = 0; s < evaluations_.size(); ++s) {
      Rows rate{};
      std::array<Rows, kMaxStates> rate_bent{};
      for (const Program::First& entry : rates_.jacobian) {
        const auto j = ToSize(entry.row), l = ToSize(entry.column);
        rate[j] |= l < n ? argument[l] : 1u << l;
        for (std::size_t i = 0; i < n && l < n; ++i) rate_bent[j][i] |= argument_bent[l][i];
      }
      for (const Program::Second& entry : rates_.hessian) {
        const std::uint32_t a = argument[ToSize(entry.row)], b = argument[ToSize(entry.column)];
        for (std::size_t i = 0; i < n; ++i)
          rate_bent[ToSize(entry.output)][i] |= (a >> i & 1 ? b : 0) | (b >> i & 1 ? a : 0);
      }
      for (std::size_t j = 0; j < n; ++j) {
        argument[j] = 1u << j | rate[j];
        argument_bent[j] = rate_bent[j];
        sum[j] |= rate[j];
        for (std::size_t i = 0; i < n; ++i) sum_bent[j][i] |= rate_bent[j][i];
      }
    }
    std::uint32_t bent = 0;
    for (const Rows& rows : sum_bent)
      for (std::size_t i = 0; i < n; ++i) bent |= rows[i] | (rows[i] != 0 ? 1u << i : 0);
    ChooseColumns(bent);
    const auto place_of = [&](int l) { return static_cast<int>(std::ranges::find(bent_, l) - bent_.begin()); };
    for (std::size_t k = 0; k < n; ++k)
      for (short l = 0; l < rates_.variables; ++l) {
        if ((sum[k] >> l & 1) == 0) continue;
        jacobian_.push_back({static_cast<short>(k), l, -1, false});
        for (short i = 0; i <= l && l < rates_.states; ++i) {
          if ((sum_bent[k][ToSize(i)] >> l & 1) == 0) continue;
          hessian_.push_back({static_cast<short>(k), i, l, -1});
          const int column = place_of(l);
          const auto block = std::ranges::find_if(
              blocks_, [&](const Block& b) { return b.i == place_of(i) && b.first_l == column / 4 * 4; });
          places_.push_back(ToSize(block - blocks_.begin()) * kLaneCount + ToSize(column % 4));
        }
      }
  }

  // Second derivatives by other columns than these bits are zero at every stage.
  void ChooseColumns(std::uint32_t bent) {
    for (int l = 0; l < rates_.states; ++l)
      if ((bent >> l & 1) != 0) bent_.push_back(l);
    for (int i = 0; i < static_cast<int>(bent_.size()); ++i)
      for (int l = i / 4 * 4; l < static_cast<int>(bent_.size()); l += 4) blocks_.push_back({i, l});
  }

  static Interval Range(double center, double radius) { return {SubDown(center, radius), AddUp(center, radius)}; }

  // Value and derivatives of the successor by the columns, in forward.sum. False if a number is not moderate.
  [[nodiscard]] bool Run(const std::array<Interval, kMaxVariables>& z, std::span<const Interval> parameters,
                         const std::vector<int>& columns, bool second, std::span<Interval> values,
                         Forward& forward) const noexcept {
    const auto n = ToSize(rates_.states);
    const Extent extent{PaddedToLanes(columns.size()), second ? blocks_.size() * kLaneCount : 0};
    auto& [start, argument, rate, sum, product, product_radius] = forward;
    for (Numbers* numbers : {&start, &argument, &sum}) SetState(z, columns, extent, *numbers);
    std::array<Interval, kMaxVariables> at = z;
    for (const auto& [before, weight] : evaluations_) {
      AddScaled(start, rate, before, extent, argument);
      std::copy_n(argument.value.begin(), n, at.begin());
      forereach::Evaluate<Interval>(rates_, second ? all_needed_ : first_needed_, parameters,
                                    {at.data(), ToSize(rates_.variables)}, values);
      if (!AreModerate(values, second)) return false;
      for (std::size_t j = 0; j < n; ++j) rate.value[j] = values[ToSize(rates_.value[j])];
      Differentiate(values, columns, extent, forward);
      if (!AreModerate(rate, extent)) return false;
      AddScaled(sum, rate, weight, extent, sum);
    }
    return AreModerate(sum, extent);
  }

  // Entries of a row of first and of second derivatives, in whole lanes.
  struct Extent {
    std::size_t slopes, bends;
  };

  // The state itself: x_j has the derivative 1 by x_j.
  void SetState(std::span<const Interval> z, const std::vector<int>& columns, const Extent& extent,
                Numbers& numbers) const noexcept {
    for (std::size_t j = 0; j < ToSize(rates_.states); ++j) {
      numbers.value[j] = z[j];
      for (std::size_t c = 0; c < extent.slopes; ++c)
        numbers.slope[j][c] = c < columns.size() && ToSize(columns[c]) == j ? 1 : 0;
      std::fill_n(numbers.slope_radius[j].begin(), extent.slopes, 0.0);
      std::fill_n(numbers.bend[j].begin(), extent.bends, 0.0);
      std::fill_n(numbers.bend_radius[j].begin(), extent.bends, 0.0);
      numbers.is_bent[j] = false;
    }
  }

  // to = a + part b; nothing to do without a part.
  FOREREACH_INLINE void AddScaled(const Numbers& a, const Numbers& b, const StepPart& part, const Extent& extent,
                                  Numbers& to) const noexcept {
    if (part.is_nothing()) return;
    const auto factor = part.Of<Interval>(dt_);
    const Number scale(factor);
    const auto add = [&](const double* center, const double* radius, const double* b_center, const double* b_radius,
                         std::size_t count, double* to_center, double* to_radius) __attribute__((always_inline)) {
      for (std::size_t i = 0; i < count; i += kLaneCount) {  // the sum rounds once more
        const Lanes c = LoadLanes(center + i);
        StoreLanes(c, to_center + i);
        StoreLanes(LoadLanes(radius + i) + AllLanes(kOfSum) * Abs(c), to_radius + i);
      }
      AddTimes(scale, b_center, b_radius, count, to_center, to_radius);
      Finish(count, to_radius);
    };
    for (std::size_t j = 0; j < ToSize(rates_.states); ++j) {
      to.value[j] = a.value[j] + factor * b.value[j];
      add(a.slope[j].data(), a.slope_radius[j].data(), b.slope[j].data(), b.slope_radius[j].data(), extent.slopes,
          to.slope[j].data(), to.slope_radius[j].data());
      to.is_bent[j] = a.is_bent[j] || b.is_bent[j];
      if (to.is_bent[j])
        add(a.bend[j].data(), a.bend_radius[j].data(), b.bend[j].data(), b.bend_radius[j].data(), extent.bends,
            to.bend[j].data(), to.bend_radius[j].data());
    }
  }

  // The chain rule: forward.rate's derivatives from those of the rates and of the argument.
  FOREREACH_INLINE void Differentiate(std::span<const Interval> values, const std::vector<int>& columns,
                                      const Extent& extent, Forward& forward) const noexcept {
    const auto n = ToSize(rates_.states);
    const auto& argument = forward.argument;
    Numbers& rate = forward.rate;
    for (std::size_t j = 0; j < n; ++j) {
      for (Row* row : {&rate.slope[j], &rate.slope_radius[j]}) std::fill_n(row->begin(), extent.slopes, 0.0);
      for (BlockRow* row : {&rate.bend[j], &rate.bend_radius[j]}) std::fill_n(row->begin(), extent.bends, 0.0);
      rate.is_bent[j] = false;
    }
    for (const Program::First& entry : rates_.jacobian) {
      const auto j = ToSize(entry.row), l = ToSize(entry.column);
      const Number slope(values[ToSize(entry.node)]);
      if (l < n) {
        AddTimes(slope, argument.slope[l].data(), argument.slope_radius[l].data(), extent.slopes, rate.slope[j].data(),
                 rate.slope_radius[j].data());
        if (!argument.is_bent[l]) continue;
        rate.is_bent[j] = true;
        AddTimes(slope, argument.bend[l].data(), argument.bend_radius[l].data(), extent.bends, rate.bend[j].data(),
                 rate.bend_radius[j].data());
      } else if (const auto c = ToSize(std::ranges::find(columns, static_cast<int>(l)) - columns.begin());
                 c < columns.size()) {  // an input, which no stage changes
        rate.slope[j][c] += slope.center;
        rate.slope_radius[j][c] += slope.radius + std::abs(slope.center) * kOfSum;
      }
    }
    if (extent.bends > 0)
      for (const auto& [a, b, first, last] : pairs_) {
        MultiplySlopes(ToSize(a), ToSize(b), forward);
        for (int e = first; e < last; ++e) {
          const Program::Second& entry = second_[ToSize(e)];
          const auto j = ToSize(entry.output);
          rate.is_bent[j] = true;
          AddTimes(Number(values[ToSize(entry.node)]), forward.product.data(), forward.product_radius.data(),
                   extent.bends, rate.bend[j].data(), rate.bend_radius[j].data());
        }
      }
    for (std::size_t j = 0; j < n; ++j) {
      Finish(extent.slopes, rate.slope_radius[j].data());
      if (rate.is_bent[j]) Finish(extent.bends, rate.bend_radius[j].data());
    }
  }

  // g_a g_b^T + g_b g_a^T, or g_a g_a^T, in blocks, g the first derivatives of the argument.
  FOREREACH_INLINE void MultiplySlopes(std::size_t a, std::size_t b, Forward& forward) const noexcept {
    const auto& slope = forward.argument.slope;
    const auto& radius = forward.argument.slope_radius;
    for (std::size_t k = 0; k < blocks_.size(); ++k) {
      const auto i = ToSize(blocks_[k].i), l = ToSize(blocks_[k].first_l);
      Lanes center = AllLanes(0), spread = AllLanes(0);
      const auto add = [&](std::size_t one, std::size_t other) __attribute__((always_inline)) {
        const Lanes c = AllLanes(slope[one][i]), r = AllLanes(radius[one][i]), d = LoadLanes(&slope[other][l]),
                    s = LoadLanes(&radius[other][l]);
        center += c * d;
        spread += Abs(c) * s + r * (Abs(d) + s) + AllLanes(kOfSum) * Abs(c * d);
      };
      add(a, b);
      if (a != b) add(b, a);
      StoreLanes(center, &forward.product[k * kLaneCount]);
      StoreLanes(spread * AllLanes(1 + 2 * kOfSum) + AllLanes(kUnderflow), &forward.product_radius[k * kLaneCount]);
    }
  }

  // Whether values and derivatives of the rates are moderate.
  [[nodiscard]] bool AreModerate(std::span<const Interval> values, bool second) const noexcept {
    const auto is_moderate = [&](const auto& entry) { return IsModerate(values[ToSize(entry.node)]); };
    return std::ranges::all_of(rates_.value, [&](int node) { return IsModerate(values[ToSize(node)]); }) &&
           std::ranges::all_of(rates_.jacobian, is_moderate) &&
           (!second || std::ranges::all_of(rates_.hessian, is_moderate));
  }

  [[nodiscard]] FOREREACH_INLINE bool AreModerate(const Numbers& numbers, const Extent& extent) const noexcept {
    const auto are = [](const double* center, const double* radius, std::size_t count) __attribute__((always_inline)) {
      return HoldsForFirst(
          count, [&](std::size_t i) __attribute__((always_inline)) {
            return Abs(LoadLanes(center + i)) + LoadLanes(radius + i) < AllLanes(kLargest);
          });
    };
    for (std::size_t j = 0; j < ToSize(rates_.states); ++j)
      if (!IsModerate(numbers.value[j]) ||
          !are(numbers.slope[j].data(), numbers.slope_radius[j].data(), extent.slopes) ||
          (numbers.is_bent[j] && !are(numbers.bend[j].data(), numbers.bend_radius[j].data(), extent.bends)))
        return false;
    return true;
  }

  std::shared_ptr<const ProgramDraft> draft_;
  Program rates_;
  std::vector<StageEvaluation> evaluations_;
  double dt_;
  std::vector<unsigned char> values_needed_, first_needed_, all_needed_;
  std::vector<int> all_columns_, bent_;  // bent_: the states by which the successor has second derivatives
  std::vector<Block> blocks_;
  // Two variables with a second derivative of some rate, and the entries [first, last) of second_ that have it.
  struct Pair {
    int a, b, first, last;
  };
  std::vector<Pair> pairs_;
  std::vector<Program::Second> second_;   // the rates' second derivatives, by pairs
  std::vector<Program::First> jacobian_;  // of the successor
  std::vector<Program::Second> hessian_;
  std::vector<std::size_t> places_;  // of each entry of hessian_ in a BlockRow
};

StagedModel::StagedModel(std::shared_ptr<const ProgramDraft> rates, double dt, std::vector<Interval> parameters,
                         ModelNames names)
    : StagedModel(
          std::make_shared<const Stages>(
              std::move(rates), names.text == nullptr ? ModelText::Integrator::kNone : names.text->integrator, dt),
          std::move(parameters), names) {}

StagedModel::StagedModel(std::shared_ptr<const Stages> stages, std::vector<Interval> parameters, ModelNames names)
    : InterpretedModel(stages->Lists(), std::move(parameters), std::move(names)), stages_(std::move(stages)) {}

void StagedModel::EvaluateWide(std::span<const double> z, std::span<long double> next) const noexcept {
  stages_->Evaluate(z, parameters(), next);
}

void StagedModel::LinearizeOver(std::span<const Interval> box, Linearization& out) const noexcept {
  stages_->LinearizeOver(box, parameter_ranges(), out);
}

void StagedModel::EncloseHessian(std::span<const Interval> box, HessianEnclosure& out) const noexcept {
  stages_->EncloseHessian(box, parameter_ranges(), out);
}

ExpansionError StagedModel::BoundError(std::span<const Interval> /*domain*/) const {
  return ExpansionError::None(program());
}

void StagedModel::Expand(std::span<const double> /*z*/, std::span<const PlainInterval> /*box*/, Expansion& out,
                         InstructionSet /*instructions*/) const noexcept {
  out.value.fill(std::numeric_limits<double>::quiet_NaN());
}

}  // namespace forereach

FOREREACH_ARITHMETIC_END
