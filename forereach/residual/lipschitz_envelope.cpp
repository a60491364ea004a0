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
    BoundErrors(row, entries, observations, domain_lower, domain_upper);
    row.index = ObservationIndex(entries);
  }
}

template LipschitzEnvelope::LipschitzEnvelope(const Declaration&, const Observations&, std::span<const double>,
                                              std::span<const double>, const EnvelopeOptions&);
template LipschitzEnvelope::LipschitzEnvelope(const Declaration&, const ObservationRows&, std::span<const double>,
                                              std::span<const double>, const EnvelopeOptions&);

// Sets row.error, E_k of the header. It bounds the rounding of every answer before there is a query, since a query's
// hull lies in the domain; docs/soundness.md, 3.5, counts the a + 24 roundings and the products that may underflow.
template <class Rows>
void LipschitzEnvelope::BoundErrors(Row& row, const ObservationIndex::Entries& entries, const Rows& observations,
                                    std::span<const double> domain_lower, std::span<const double> domain_upper) const {
  double locations = 0, widths = 0;  // S, W
  for (const LipschitzRow::Column& column : row.distance.columns()) {
    const auto l = ToSize(column.variable);
    double farthest = std::max(std::abs(domain_lower[l]), std::abs(domain_upper[l]));
    for (int i = 0; i < observations.size(); ++i)
      farthest = std::max(farthest, std::abs(observations.z(i, column.variable)));
    const double width = Interval(domain_lower[l], domain_upper[l]).HalfWidthUpper();
    locations = AddUp(locations, MulUp(column.slope, farthest));
    if (column.variable < observations.num_states()) widths = AddUp(widths, MulUp(column.slope, width));
    // L c and L z are rounded products, v their rounded difference; L r <= 2 L farthest is a rounded product.
    row.component_errors.push_back(PlainErrorUpper(MulUp(4, MulUp(column.slope, farthest)), 4, 4));
  }
  const auto a = static_cast<int>(row.distance.columns().size());
  row.value_limit = MulUp(options_.value_headroom, LargestValue(entries));
  const double magnitude = AddUp(AddUp(row.value_limit, MulUp(2, locations)), MulUp(3, widths));
  row.error = PlainErrorUpper(magnitude, a + 24, a * (kMaxGenerators + 4));
  // Where a sum may overflow, no rounding bound holds: the row then has no finite bound, and the answer is D.
  if (!(magnitude < kHuge)) row.error = kInfinity;
  row.pair_margin = PairMarginUpper(row.value_limit, locations, row.distance.columns().size());
}

using internal::Budget;
using internal::Sides;

struct LipschitzEnvelope::BoundSearch {
  const Row& row;
  const EnvelopeOptions& options;
  Budget& budget;
  FoundIn& found;
  const Pack* tail = nullptr;  // blocks
  std::size_t tail_count = 0;  // entries

  template <class Metric>
  [[nodiscard]] Sides Run(const Metric& metric) const {
    const ObservationIndex& index = row.index;
    Sides best{-kInfinity, -kInfinity};
    if (index.num_blocks() <= MaxFlatBlocks<Metric>())
      best = ScanBlocks(metric, index.block(0), index.num_blocks(), best, budget);
    else
      best = internal::TreeSearch<Metric>(metric, index, found, budget).Run();
    if (tail_count > 0) best = ScanTail(metric, best);
    return {best.floor - metric.common(), best.negated_ceiling - metric.common()};
  }

  // The last block may be written to while it is read: only the lanes that count are.
  template <class Metric>
  [[nodiscard]] Sides ScanTail(const Metric& metric, Sides best) const {
    const std::size_t coordinates = row.distance.num_coordinates(), full = tail_count / kPackSize,
                      rest = tail_count % kPackSize;
    if (full > 0) best = ScanBlocks(metric, tail, full, best, budget);
    if (rest == 0) return best;
    std::array<Pack, kMaxVariables + 2> last;
    for (std::size_t p = 0; p < coordinates + 2; ++p) {
      last[p] = Fill(p < coordinates ? 0 : -kInfinity);
      for (std::size_t lane = 0; lane < rest; ++lane) last[p].set(lane, tail[full * (coordinates + 2) + p].at(lane));
    }
    return ScanBlocks(metric, last.data(), 1, best, budget);
  }

  // The boxes of a tree say little in many coordinates, and an entry that is refined costs more than a block.
  template <class Metric>
  [[nodiscard]] std::size_t MaxFlatBlocks() const {
    const auto most = ToSize(options.max_flat_blocks);
    return Metric::kRefines ? std::min(8 * most, internal::kMaxRefinedBlocks) : most;
  }

  // One function for each metric and instruction set, so that each has the registers to itself.
  template <class Metric, class... More>
  [[nodiscard]] Sides RunWith(const QuerySet& set, const More&... more) const {
    return Run(Metric(row.distance, set, more...));
  }
  template <template <class> class Metric, class... More>
  [[nodiscard]] Sides With(const QuerySet& set, const More&... more) const {
    return Dispatch<&BoundSearch::RunWith<Metric<Pack>, More...>, &BoundSearch::RunWith<Metric<WidePack>, More...>>(
        options.instructions, *this, set, more...);
  }
  template <class P>
  using OneColumn = internal::PatternMetric<1, P>;
  template <class P>
  using TwoColumns = internal::PatternMetric<2, P>;
  template <class P>
  using ThreeColumns = internal::PatternMetric<3, P>;

  [[nodiscard]] Sides Best(const QuerySet& set) const {
    const std::size_t columns = row.distance.columns().size();
    const double margin = 4 * row.error;  // of bounds in the search, and for the bits that say which child they are of
    if (columns == 1) return With<OneColumn>(set, margin);
    if (columns == 2) return With<TwoColumns>(set, margin);
    if (columns == 3) return With<ThreeColumns>(set, margin);
    if (columns > ToSize(kMaxExactColumns)) return With<internal::HullMetric>(set, margin);
    return With<internal::SignMetric>(set, margin, std::span<const double>(row.component_errors));
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
  for (const int k : active_) {
    const auto i = ToSize(k);
    const Row& row = rows_[i];
    Budget budget{options_.max_leaf_visits, kPatternsPerLeaf * options_.max_leaf_visits};
    Sides best{-kInfinity, -kInfinity};
    if (std::isfinite(row.error))
      best = BoundSearch{row, options_, budget, bounds.found[i], tail ? tail->blocks(k) : nullptr, ToSize(count)}.Best(
          set);
    // Infinite errors leave no bound. A cap on the search leaves a sound one: any subset of the observations gives one.
    bounds.lower[i] = best.floor - row.error;
    bounds.upper[i] = -(best.negated_ceiling - row.error);
    bounds.capped |= budget.capped;
  }
}

}  // namespace forereach
