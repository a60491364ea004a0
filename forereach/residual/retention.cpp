#include "forereach/residual/retention.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>
#include <utility>

#include "forereach/numerics/size.h"
#include "forereach/residual/pairs.h"

namespace forereach {
namespace {

constexpr std::uint32_t kNone = ObservationIndex::kNone;

// What each observation gains, and the others that would speak for it if it went.
struct Gains {
  std::vector<double> gain;  // in units of the range of r~_k, zero if it never attains the envelope
  std::vector<std::vector<std::uint32_t>> instead;  // where it gains
};

void Take(Gains& gains, std::size_t i, double gain, std::uint32_t other) {
  if (!(gain > 0)) return;
  gains.gain[i] = std::max(gains.gain[i], gain);
  if (other != kNone) gains.instead[i].push_back(other);
}

// For a constant coordinate: the first of the highest values alone makes the bound, and gains by its distance to the
// next.
void TakeConstant(Gains& gains, const std::vector<double>& values, double range) {
  std::size_t best = 0, second = values.size();
  for (std::size_t i = 1; i < values.size(); ++i) {
    if (values[i] > values[best])
      second = best, best = i;
    else if (second == values.size() || values[i] > values[second])
      second = i;
  }
  const bool alone = second == values.size();
  const double gain = alone ? 1 : (values[best] - values[second]) / range;
  Take(gains, best, std::max(gain, kUnitRoundoff), alone ? kNone : static_cast<std::uint32_t>(second));
}

double Range(const ObservationIndex::Entries& entries) {
  const double range = std::ranges::max(entries.ceilings) - std::ranges::min(entries.floors);
  return range > 0 && std::isfinite(range) ? range : 1;
}

// Ascending. Of rows at one location the highest of each side alone can gain, and the next one says by how much.
std::vector<int> HighestTwo(const LipschitzRow& row, const Observations& o, const ObservationIndex::Entries& entries) {
  std::vector<int> highest;
  ForEachLocation(row, o, [&](std::span<int> rows) {
    const std::size_t two = std::min<std::size_t>(rows.size(), 2);
    const auto take = [&](const auto& value) {
      std::ranges::partial_sort(rows, rows.begin() + static_cast<std::ptrdiff_t>(two),
                                [&](int i, int j) { return std::pair(value(i), i) < std::pair(value(j), j); });
      highest.insert(highest.end(), rows.begin(), rows.begin() + static_cast<std::ptrdiff_t>(two));
    };
    take([&](int i) { return -entries.floors[ToSize(i)]; });
    take([&](int i) { return entries.ceilings[ToSize(i)]; });
  });
  std::ranges::sort(highest);
  highest.erase(std::unique(highest.begin(), highest.end()), highest.end());
  return highest;
}

void TakeRow(Gains& gains, const Declaration& declaration, const Observations& all, int k) {
  const LipschitzRow row(declaration, k);
  ObservationIndex::Entries entries = EntriesOf(row, declaration, all, k);
  const double range = Range(entries);
  if (row.is_constant()) {
    TakeConstant(gains, entries.floors, range);
    for (double& ceiling : entries.ceilings) ceiling = -ceiling;
    return TakeConstant(gains, entries.ceilings, range);
  }
  const double margin = MarginUpper(row, entries, all);
  if (!std::isfinite(margin)) return;  // values this large say nothing: any choice is sound
  const std::vector<int> rows = HighestTwo(row, all, entries);
  entries = EntriesOf(row, declaration, Select(all, rows), k);
  const ObservationIndex index(entries);
  const PairSearch search(index, margin);
  for (std::size_t b = 0; b < index.num_blocks();
       ++b)  // in the order of the index, whose neighbours need the same leaves
    for (std::size_t lane = 0; lane < kPackSize; ++lane) {
      const std::uint32_t id = index.ids(b)[lane];
      if (id == kNone) continue;
      const PairSearch::Point point = PointOf(entries, static_cast<int>(id));
      for (std::size_t side = 0; side < 2; ++side) {
        const double own = side == 0 ? point.floor : point.negated_ceiling;
        const PairSearch::Other other = search.BestOther(point, side, id, own);  // what is no gain need not be exact
        const bool alone = other.id == kNone;
        Take(gains, ToSize(rows[id]), alone ? 1 : (own - other.value) / range,
             alone ? kNone : static_cast<std::uint32_t>(rows[other.id]));
      }
    }
}

Gains GainsOf(const Declaration& declaration, const Observations& observations) {
  const auto count = ToSize(observations.size());
  Gains gains{std::vector<double>(count), std::vector<std::vector<std::uint32_t>>(count)};
  for (int k = 0; k < observations.num_states(); ++k) TakeRow(gains, declaration, observations, k);
  return gains;
}

// Removes observations without gain, then those of least gain until `most` are left. It removes no observation because
// of which another one is removed in the same round.
std::vector<int> OneRound(const Gains& gains, std::size_t most) {
  std::vector<std::uint32_t> order(gains.gain.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, {}, [&](std::uint32_t i) { return gains.gain[i]; });
  std::vector<char> needed(order.size(), 0);
  std::vector<int> kept;
  std::size_t left = order.size();
  for (const std::uint32_t i : order) {
    const bool goes = left > 1 && !needed[i] && (gains.gain[i] == 0 || left > most);
    if (!goes) {
      kept.push_back(static_cast<int>(i));
      continue;
    }
    --left;
    if (gains.gain[i] == 0) continue;
    for (const std::uint32_t other : gains.instead[i]) needed[other] = 1;
  }
  std::ranges::sort(kept);
  return kept;
}

}  // namespace

Observations Select(const Observations& o, const std::vector<int>& indices) {
  return {o.z(indices, Eigen::all), o.lower(indices, Eigen::all), o.upper(indices, Eigen::all)};
}

std::vector<int> MostUseful(const Declaration& declaration, const Observations& observations, std::size_t most) {
  std::vector<int> kept(ToSize(observations.size()));
  std::iota(kept.begin(), kept.end(), 0);
  // Any choice is sound, since any subset of the observations bounds the residual (soundness 3.5); this one is tight.
  while (kept.size() > most) {
    std::vector<int> again = OneRound(GainsOf(declaration, Select(observations, kept)), most);
    for (int& i : again) i = kept[ToSize(i)];
    kept = std::move(again);  // at least the first in the order went
  }
  return kept;
}

}  // namespace forereach
