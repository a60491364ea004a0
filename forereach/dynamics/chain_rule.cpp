#include "forereach/dynamics/chain_rule.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>
#include <utility>

#include "forereach/numerics/interval_pair.h"
#include "forereach/numerics/size.h"

FOREREACH_ARITHMETIC_BEGIN

namespace forereach {
namespace {

// Covers the rounding of a radius itself.
FOREREACH_INLINE Lanes Finished(const Lanes& radius) {
  return radius * AllLanes(1 + 2 * kOfSum) + AllLanes(kAboveUnderflow);
}

}  // namespace

ChainRule::Number::Number(const StepPart& part, double dt) {
  const auto x = part.Of<Interval>(dt);
  center = x.Middle();
  const double radius = x.DistanceUpper(center), size = std::abs(center);
  all = (size + radius) * (1 + kOfSum);
  spread = (radius + size * kOfSum) * (1 + kOfSum);
}

// Chooses what each stage computes.
class ChainRule::Builder final {
 public:
  Builder(ChainRule& rule, const Program& rates) : rule_(rule), rates_(rates) {
    const auto cells_for = [](std::size_t count) { return PaddedToLanes(count) / kLaneCount; };
    const std::size_t width = cells_for(rule.columns_.size()), rows = ToSize(rates.states);
    start_.assign(ToSize(rates.variables), std::vector<int>(width, 0));
    for (std::size_t c = 0; c < rule.columns_.size(); ++c)
      start_[ToSize(rule.columns_[c])][c / kLaneCount] = 1 << c % kLaneCount;
    rule.first_.assign(start_.begin(), start_.begin() + rates.states);
    rule.second_.assign(rows, std::vector<int>(cells_for(rule.pairs_.size()), 0));
    slope_ = start_;
    bend_ = rule.second_;
    for (auto* kept : {&kept_first_, &kept_second_})
      kept->assign(rows, std::vector<std::array<int, 3>>(kept == &kept_first_ ? width : cells_for(rule.pairs_.size()),
                                                         {-1, -1, -1}));
  }

  void Add(Stage& stage, bool into_second) {
    stage_ = &stage;
    gathered_.clear();
    multiplied_.clear();
    temporary_ = 0;
    Table slope = start_, bend(bend_.size(), std::vector<int>(rule_.pairs_.empty() ? 0 : bend_[0].size(), 0));
    for (std::size_t j = 0; j < ToSize(rates_.states); ++j) {
      for (std::size_t g = 0; g < start_[j].size(); ++g) {
        AddFirst(j, g, slope_);
        Close(kept_first_[j][g], into_second, start_[j][g], slope[j][g], rule_.first_[j][g]);
      }
      for (std::size_t g = 0; g < bend[j].size(); ++g) {
        AddFirst(j, g, bend_);
        for (int e = 0; e < rates_.num_second; ++e) {
          const Program::Second& entry = rates_.hessian[ToSize(e)];
          if (ToSize(entry.output) != j) continue;
          const int block = rates_.num_first + e / 2;
          AddTerm(kFactorBlock * block + (e % 2 == 0 ? 1 : 3), Multiplied(entry.row, entry.column, g));
        }
        Close(kept_second_[j][g], into_second, 0, bend[j][g], rule_.second_[j][g]);
      }
    }
    slope_ = std::move(slope);
    bend_ = std::move(bend);
    most_temporary_ = std::max(most_temporary_, temporary_);
  }

  // Gives the cells of products and gathers, which are counted from -1 down, the places behind the others.
  void Finish() {
    const int kept = rule_.num_cells_;
    const auto place = [&](int& cell) {
      if (cell < -1) cell = kept - 2 - cell;
    };
    for (Stage& stage : rule_.stages_) {
      for (Gather& gather : stage.gathers) place(gather.to);
      for (Product& product : stage.products)
        for (int* cell : {&product.a, &product.b, &product.c, &product.d, &product.to}) place(*cell);
      for (Term& term : stage.terms) place(term.cell);
    }
    rule_.num_cells_ += most_temporary_;
  }

 private:
  [[nodiscard]] static bool IsConstant(int cell) { return cell >= 0 && cell < kConstants; }
  int Temporary() { return -2 - temporary_++; }

  void AddTerm(int factor, int cell) {
    if (cell != 0) stage_->terms.push_back({factor, cell});
  }
  // sum_l F_jl of row l
  void AddFirst(std::size_t j, std::size_t g, const Table& rows) {
    for (int e = 0; e < rates_.num_first; ++e) {
      const Program::First& entry = rates_.jacobian[ToSize(e)];
      if (ToSize(entry.row) == j && ToSize(entry.column) < rows.size())
        AddTerm(kFactorBlock * e + 3, rows[ToSize(entry.column)][g]);
    }
  }
  // Makes the terms since the last target one, if there are any. A row's cells of the argument are in two places in
  // turn, since the stage reads those of its own.
  void Close(std::array<int, 3>& kept, bool into_second, int start, int& next, int& sum) {
    const auto last = static_cast<int>(stage_->terms.size());
    if (last == (stage_->targets.empty() ? 0 : stage_->targets.back().last)) return;
    const auto take = [&](int& cell) { return cell >= 0 ? cell : cell = rule_.num_cells_++; };
    Target target{last, start, 0, 0, 0};
    if (stage_->has_next) target.next = next = take(kept[into_second ? 1 : 0]);
    if (stage_->has_weight) {
      target.base = sum;
      target.sum = sum = take(kept[2]);
    }
    stage_->targets.push_back(target);
  }

  // The entries of row a by the rows of the pairs of cell g, or by their columns.
  int Gathered(int a, bool by_column, std::size_t g) {
    const auto [place, is_new] = gathered_.try_emplace({a, by_column, g}, 0);
    if (!is_new) return place->second;
    Gather gather{};
    int ones = 0;
    bool is_constant = true;
    for (std::size_t lane = 0; lane < kLaneCount; ++lane) {
      const std::size_t p = g * kLaneCount + lane;
      if (p >= rule_.pairs_.size()) continue;  // zero, as the first double of the first cell
      const int column = by_column ? rule_.pairs_[p].column : rule_.pairs_[p].row;
      const auto c = ToSize(std::ranges::find(rule_.columns_, column) - rule_.columns_.begin());
      const int cell = slope_[ToSize(a)][c / kLaneCount];
      gather.from[lane] = cell * static_cast<int>(kCell) + static_cast<int>(c % kLaneCount);
      is_constant = is_constant && IsConstant(cell);
      if (IsConstant(cell) && (cell >> c % kLaneCount & 1) != 0) ones |= 1 << lane;
    }
    if (is_constant) return place->second = ones;
    gather.to = Temporary();
    stage_->gathers.push_back(gather);
    return place->second = gather.to;
  }

  // g_a g_b^T + g_b g_a^T, or g_a g_a^T, g the first derivatives of the argument.
  int Multiplied(int a, int b, std::size_t g) {
    const auto [place, is_new] = multiplied_.try_emplace({a, b, g}, 0);
    if (!is_new) return place->second;
    std::array<int, 4> sides{Gathered(a, false, g), Gathered(b, true, g), Gathered(b, false, g), Gathered(a, true, g)};
    auto& [one, two, three, four] = sides;
    if (std::ranges::all_of(sides, IsConstant))
      return place->second = a == b ? one & two : (one & two) | (three & four);
    const bool has_first = one != 0 && two != 0, has_other = a != b && three != 0 && four != 0;
    if (!has_first && !has_other) return 0;
    Product product{one, two, has_other ? three : -1, four, Temporary()};
    if (!has_first) product = {three, four, -1, 0, product.to};
    stage_->products.push_back(product);
    return place->second = product.to;
  }

  ChainRule& rule_;
  const Program& rates_;
  Stage* stage_ = nullptr;
  Table start_, slope_, bend_;  // of the state; of the argument
  // Of each cell: its places in the two arguments, and in the sum.
  std::vector<std::vector<std::array<int, 3>>> kept_first_, kept_second_;
  std::map<std::tuple<int, bool, std::size_t>, int> gathered_;
  std::map<std::tuple<int, int, std::size_t>, int> multiplied_;
  int temporary_ = 0, most_temporary_ = 0;
};

ChainRule::ChainRule(const Program& rates, std::span<const StageEvaluation> evaluations, double dt,
                     std::vector<int> columns, std::vector<Pair> pairs)
    : columns_(std::move(columns)), pairs_(std::move(pairs)) {
  Builder builder(*this, rates);
  for (std::size_t s = 0; s < evaluations.size(); ++s) {
    const bool has_next = s + 1 < evaluations.size();
    const StepPart before = has_next ? evaluations[s + 1].before : StepPart{0}, weight = evaluations[s].weight;
    stages_.push_back({Number(before, dt), Number(weight, dt), has_next, !weight.is_nothing(), {}, {}, {}, {}});
    builder.Add(stages_.back(), s % 2 == 0);
  }
  builder.Finish();
}

void ChainRule::Begin(double* cells) const noexcept {
  static constexpr auto kOnesAndZeros = [] {
    std::array<double, kConstants * kCell> all{};
    for (std::size_t b = 0; b < kConstants; ++b)
      for (std::size_t i = 0; i < kLaneCount; ++i) all[b * kCell + i] = (b >> i & 1) != 0 ? 1 : 0;
    return all;
  }();
  std::ranges::copy(kOnesAndZeros, cells);
}

bool ChainRule::AdvanceInline(std::size_t s, const double* factors, double* cells) const noexcept {
  const Stage& stage = stages_[s];
  const auto at = [&](int cell) { return cells + ToSize(cell) * kCell; };
  const auto store = [&](const Lanes& center, const Lanes& radius, int cell) __attribute__((always_inline)) {
    StoreLanes(center, at(cell));
    StoreLanes(radius, at(cell) + kLaneCount);
  };
  for (const Gather& gather : stage.gathers) {
    const auto entries = [&](const double* from) __attribute__((always_inline)) {
      return Lanes{from[gather.from[0]], from[gather.from[1]], from[gather.from[2]], from[gather.from[3]]};
    };
    store(entries(cells), entries(cells + kLaneCount), gather.to);
  }
  for (const Product& product : stage.products) {
    Lanes center = AllLanes(0), radius = AllLanes(0);
    const auto add = [&](int one, int other) __attribute__((always_inline)) {
      const Lanes c = LoadLanes(at(one)), r = LoadLanes(at(one) + kLaneCount), d = LoadLanes(at(other)),
                  q = LoadLanes(at(other) + kLaneCount);
      center += c * d;
      radius += Abs(c) * q + r * (Abs(d) + q) + AllLanes(kOfSum) * Abs(c * d);
    };
    add(product.a, product.b);
    if (product.c >= 0) add(product.c, product.d);
    store(center, Finished(radius), product.to);
  }
  LaneMask is_moderate = AllLanes(0) == AllLanes(0);
  const Term* term = stage.terms.data();
  for (const Target& target : stage.targets) {
    Lanes center = AllLanes(0), radius = AllLanes(0);
    for (const Term* const last = stage.terms.data() + target.last; term != last; ++term) {
      const double* const factor = factors + term->factor;
      const Lanes c = LoadLanes(at(term->cell)), r = LoadLanes(at(term->cell) + kLaneCount);
      center += AllLanes(factor[0]) * c;
      radius += AllLanes(factor[kLaneCount]) * r + AllLanes(factor[2 * kLaneCount]) * Abs(c);
    }
    radius = Finished(radius);
    is_moderate &= IsModerate(Abs(center) + radius);
    const auto add = [&](int from, const Number& part, int to) __attribute__((always_inline)) {
      const Lanes c = LoadLanes(at(from)), r = LoadLanes(at(from) + kLaneCount);  // the sum rounds once more
      store(c + AllLanes(part.center) * center,
            Finished((r + AllLanes(kOfSum) * Abs(c)) +
                     (AllLanes(part.all) * radius + AllLanes(part.spread) * Abs(center))),
            to);
    };
    if (stage.has_next) add(target.start, stage.before_next, target.next);
    if (stage.has_weight) add(target.base, stage.weight, target.sum);
  }
  return BitsOf(is_moderate) == 15;
}

bool ChainRule::Advance(std::size_t s, const double* factors, double* cells,
                        InstructionSet instructions) const noexcept {
  return Dispatch<&ChainRule::AdvanceInline>(instructions, *this, s, factors, cells);
}

std::size_t ChainRule::Place(int output, int column) const {
  const auto c = ToSize(std::ranges::find(columns_, column) - columns_.begin());
  return ToSize(first_[ToSize(output)][c / kLaneCount]) * kCell + c % kLaneCount;
}

std::size_t ChainRule::Place(int output, Pair pair) const {
  const auto p = ToSize(std::ranges::find(pairs_, pair) - pairs_.begin());
  return ToSize(second_[ToSize(output)][p / kLaneCount]) * kCell + p % kLaneCount;
}

}  // namespace forereach

FOREREACH_ARITHMETIC_END
