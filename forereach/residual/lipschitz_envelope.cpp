#include "forereach/residual/lipschitz_envelope.h"

#include <algorithm>
#include <cmath>

#include "forereach/residual/envelope_tail.h"
#include "forereach/residual/observation_rows.h"
#include "forereach/residual/pairs.h"
#include "forereach/residual/search.h"

namespace forereach {
namespace {

constexpr int kPatternsPerLeaf = 64;
constexpr double kHuge = 0x1p960;  // far from overflow, and nothing next to the largest double

// The least power of two >= x; infinity if x is huge. @pre x >= 0.
double PowerOfTwoUp(double x) {
  if (!(x < kHuge)) return kInfinity;
  int exponent = 0;
  return std::frexp(x, &exponent) > 0.5 ? std::ldexp(1, exponent) : x;
}

}  // namespace

template <class Rows>
LipschitzEnvelope::LipschitzEnvelope(const Declaration& declaration, const Rows& observations,
                                     std::span<const double> domain_lower, std::span<const double> domain_upper,
                                     const EnvelopeOptions& options)
    : options_(options) {
  for (int k = 0; k < observations.num_states(); ++k) {
    Row& row = rows_.emplace_back(Row{.distance = LipschitzRow(declaration, k)});
    const ObservationIndex::Entries entries = EntriesOf(row.distance, declaration, observations, k);
    row.floor = std::ranges::max(entries.floors);
    row.negated_ceiling = -std::ranges::min(entries.ceilings);
    uses_hull_distance_ |= row.distance.columns().size() > ToSize(kMaxExactColumns);
    constant_lower_[ToSize(k)] = row.floor;
    constant_upper_[ToSize(k)] = -row.negated_ceiling;
    if (row.distance.is_constant()) continue;
    active_.push_back(k);
    Measure(row, observations, domain_lower, domain_upper);
    RaiseLimit(k, LargestValue(entries));
    row.index = std::make_shared<const ObservationIndex>(entries);
  }
}

template LipschitzEnvelope::LipschitzEnvelope(const Declaration&, const Observations&, std::span<const double>,
                                              std::span<const double>, const EnvelopeOptions&);
template LipschitzEnvelope::LipschitzEnvelope(const Declaration&, const LastRows&, std::span<const double>,
                                              std::span<const double>, const EnvelopeOptions&);

// Sets S and W of the header.
template <class Rows>
void LipschitzEnvelope::Measure(Row& row, const Rows& observations, std::span<const double> domain_lower,
                                std::span<const double> domain_upper) {
  for (const LipschitzRow::Column& column : row.distance.columns()) {
    const auto l = ToSize(column.variable);
    double farthest = std::max(std::abs(domain_lower[l]), std::abs(domain_upper[l]));
    for (int i = 0; i < observations.size(); ++i)
      farthest = std::max(farthest, std::abs(observations.z(i, column.variable)));
    const double width = Interval(domain_lower[l], domain_upper[l]).HalfWidthUpper();
    row.locations = AddUp(row.locations, MulUp(column.slope, farthest));
    if (column.variable < observations.num_states()) row.widths = AddUp(row.widths, MulUp(column.slope, width));
    // L c and L z are rounded products, v their rounded difference; L r <= 2 L farthest is a rounded product.
    row.component_errors.push_back(PlainErrorUpper(MulUp(4, MulUp(column.slope, farthest)), 4, 4));
  }
}

// Sets V and E_k of the header. E_k bounds the rounding of every answer before there is a query, since a query's hull
// lies in the domain; docs/soundness.md, 3.5, counts the a + 24 roundings and the products that may underflow.
void LipschitzEnvelope::RaiseLimit(int k, double value) {
  Row& row = rows_[ToSize(k)];
  row.value_limit = std::max(row.value_limit, PowerOfTwoUp(value));
  const auto a = static_cast<int>(row.distance.columns().size());
  const double magnitude = AddUp(AddUp(row.value_limit, MulUp(2, row.locations)), MulUp(3, row.widths));
  row.error = PlainErrorUpper(magnitude, a + 24, a * (kMaxGenerators + 4));
  row.pair_margin = PairMarginUpper(row.value_limit, row.locations, row.distance.columns().size());
  if (magnitude < kHuge) return;
  // Where a sum may overflow, no rounding bound holds: the row then has no finite bound, and the answer is D.
  row.error = kInfinity;
  std::erase(active_, k);
  constant_lower_[ToSize(k)] = -kInfinity;
  constant_upper_[ToSize(k)] = kInfinity;
}

void LipschitzEnvelope::RaiseLimits(std::span<const double> values) {
  for (int k = 0; k < num_states(); ++k)  // those that are not searched any more, too: a tail has to cover their values
    if (!row(k).is_constant()) RaiseLimit(k, values[ToSize(k)]);
}

using internal::Budget;
using internal::Sides;

struct LipschitzEnvelope::BoundSearch {
  const LipschitzEnvelope& envelope;
  const QuerySet& set;
  const EnvelopeTail* tail;
  std::size_t tail_count;  // entries
  ResidualBounds& bounds;

  // One function for each metric and instruction set, so that each has the registers to itself.
  template <class Metric>
  void EncloseRow(std::size_t i) const {
    const Row& row = envelope.rows_[i];
    Budget budget{envelope.options_.max_leaf_visits, kPatternsPerLeaf * envelope.options_.max_leaf_visits};
    const Sides best = Best(MetricOf<Metric>(row), i, row, budget);
    // A cap on the search leaves a sound bound: any subset of the observations gives one.
    bounds.lower[i] = best.floor - row.error;
    bounds.upper[i] = -(best.negated_ceiling - row.error);
    bounds.capped |= budget.capped;
  }

  template <class Metric>
  [[nodiscard]] Metric MetricOf(const Row& row) const {
    const double margin = 4 * row.error;  // of bounds in the search, and for the bits that say which child they are of
    if constexpr (Metric::kRefines)
      return Metric(row.distance, set, margin, std::span<const double>(row.component_errors));
    else
      return Metric(row.distance, set, margin);
  }

  template <class Metric>
  [[nodiscard]] Sides Best(const Metric& metric, std::size_t i, const Row& row, Budget& budget) const {
    const ObservationIndex& index = *row.index;
    Sides best{-kInfinity, -kInfinity};
    if (index.num_blocks() <= MaxFlatBlocks<Metric>())
      best = ScanBlocks(metric, index.block(0), index.num_blocks(), best, budget);
    else
      best = internal::TreeSearch<Metric>(metric, index, bounds.found[i], budget).Run();
    if (tail_count > 0) best = ScanTail(metric, tail->blocks(static_cast<int>(i)), best, budget);
    return {best.floor - metric.common(), best.negated_ceiling - metric.common()};
  }

  // The last block may be written to while it is read: only the lanes that count are.
  template <class Metric>
  [[nodiscard]] Sides ScanTail(const Metric& metric, const Pack* blocks, Sides best, Budget& budget) const {
    const std::size_t coordinates = metric.coordinates(), full = tail_count / kPackSize, rest = tail_count % kPackSize;
    std::array<Pack, kMaxVariables + 2> last;
    for (std::size_t p = 0; p < coordinates + 2; ++p) {
      last[p] = Fill(p < coordinates ? 0 : -kInfinity);
      for (std::size_t lane = 0; lane < rest; ++lane) last[p].set(lane, blocks[full * (coordinates + 2) + p].at(lane));
    }
    const std::size_t end = rest > 0 ? 2 : 1;
#pragma GCC unroll 1  // each call is inlined, which takes long to compile
    for (std::size_t part = full > 0 ? 0 : 1; part < end; ++part)
      best = ScanBlocks(metric, part == 0 ? blocks : last.data(), part == 0 ? full : 1, best, budget);
    return best;
  }

  // The boxes of a tree say little in many coordinates, and an entry that is refined costs more than a block.
  template <class Metric>
  [[nodiscard]] std::size_t MaxFlatBlocks() const {
    const auto most = ToSize(envelope.options_.max_flat_blocks);
    return Metric::kRefines ? std::min(8 * most, internal::kMaxRefinedBlocks) : most;
  }

  template <template <class> class Metric>
  void With(std::size_t i) const {
    Dispatch<&BoundSearch::EncloseRow<Metric<Pack>>, &BoundSearch::EncloseRow<Metric<WidePack>>>(
        envelope.options_.instructions, *this, i);
  }
  template <class P>
  using OneColumn = internal::PatternMetric<1, P>;
  template <class P>
  using TwoColumns = internal::PatternMetric<2, P>;
  template <class P>
  using ThreeColumns = internal::PatternMetric<3, P>;

  void Enclose(std::size_t i) const {
    const std::size_t columns = envelope.rows_[i].distance.columns().size();
    if (columns == 1) return With<OneColumn>(i);
    if (columns == 2) return With<TwoColumns>(i);
    if (columns == 3) return With<ThreeColumns>(i);
    if (columns > ToSize(kMaxExactColumns)) return With<internal::HullMetric>(i);
    With<internal::SignMetric>(i);
  }
};

void LipschitzEnvelope::Enclose(const QuerySet& set, ResidualBounds& bounds) const noexcept {
  EncloseAll(set, nullptr, 0, bounds);
}

void LipschitzEnvelope::Enclose(const QuerySet& set, const EnvelopeTail& tail, int count,
                                ResidualBounds& bounds) const noexcept {
  EncloseAll(set, &tail, count, bounds);
}

void LipschitzEnvelope::EncloseAll(const QuerySet& set, const EnvelopeTail* tail, int count,
                                   ResidualBounds& bounds) const noexcept {
  bounds.lower = constant_lower_;
  bounds.upper = constant_upper_;
  bounds.capped = false;
  if (count > 0)
    for (int k = 0; k < num_states(); ++k) {
      if (!row(k).is_constant()) continue;
      const auto i = ToSize(k);
      bounds.lower[i] = std::max(bounds.lower[i], tail->HighestFloor(k, count));
      bounds.upper[i] = std::min(bounds.upper[i], -tail->HighestNegatedCeiling(k, count));
    }
  const BoundSearch search{*this, set, tail, ToSize(count), bounds};
  for (const int k : active_) search.Enclose(ToSize(k));
}

}  // namespace forereach
