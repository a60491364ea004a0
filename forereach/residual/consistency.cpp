#include "forereach/residual/consistency.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "forereach/numerics/size.h"
#include "forereach/residual/lipschitz_envelope.h"
#include "forereach/residual/observation_index.h"
#include "forereach/residual/pairs.h"
#include "forereach/residual/retention.h"

namespace forereach {
namespace {

constexpr std::size_t kSuspectsPerRow = 4;  // that are tested before rows at one location are taken together

// A constant coordinate: only the largest lower end against the smallest upper end can be the worst pair.
std::optional<Violation> TestConstant(const Declaration& declaration, const Observations& o, int k) {
  Eigen::Index highest = 0, lowest = 0;
  o.lower.col(k).maxCoeff(&highest);
  o.upper.col(k).minCoeff(&lowest);
  return TestPair(declaration, o, static_cast<int>(std::min(highest, lowest)),
                  static_cast<int>(std::max(highest, lowest)), k);
}

// For values so large that the plain arithmetic of PairSearch may overflow.
std::optional<Violation> TestAllPairs(const Declaration& declaration, const Observations& o, int k) {
  for (int i = 0; i < o.size(); ++i)
    for (int j = i + 1; j < o.size(); ++j)
      if (const auto violation = TestPair(declaration, o, i, j, k)) return violation;
  return std::nullopt;
}

// The rows that decide whether there is a pair at all. Of rows at one location, TestPair has one bound for each
// partner, and its difference grows with the lower end and falls with the upper one: the highest lower end and the
// lowest upper one contradict whatever any of these rows contradicts.
std::vector<int> ExtremesOf(const LipschitzRow& row, const Observations& o, int k) {
  std::vector<int> extremes;
  ForEachLocation(row, o, [&](std::span<int> rows) {
    const int highest = *std::ranges::max_element(rows, {}, [&](int i) { return o.lower(i, k); });
    const int lowest = *std::ranges::min_element(rows, {}, [&](int i) { return o.upper(i, k); });
    extremes.push_back(highest);
    if (lowest != highest) extremes.push_back(lowest);
  });
  return extremes;
}

// Tests coordinate k by the envelope's index of the same entries, or by an index that is built here if there is no
// envelope.
std::optional<Violation> TestRow(const Declaration& declaration, const Observations& o, int k,
                                 const LipschitzEnvelope* envelope) {
  const LipschitzRow row(declaration, k);
  if (row.is_constant()) return TestConstant(declaration, o, k);
  const ObservationIndex::Entries entries = EntriesOf(row, declaration, o, k);
  const double margin = MarginUpper(row, entries, o);
  if (!std::isfinite(margin)) return TestAllPairs(declaration, o, k);
  const auto contradict = [&](int i, int j) { return TestPair(declaration, o, i, j, k).has_value(); };

  const ObservationIndex built = envelope ? ObservationIndex() : ObservationIndex(entries);
  const PairSearch search(envelope ? envelope->index(k) : built, margin);
  std::size_t left = kSuspectsPerRow * ToSize(o.size());
  const bool is_open = search.AnyPair([&](std::uint32_t i, std::uint32_t j) {
    return --left == 0 || contradict(static_cast<int>(i), static_cast<int>(j));
  });
  if (!is_open) return std::nullopt;

  // A contradiction, or many suspects, as of a robot that stands.
  const std::vector<int> extremes = ExtremesOf(row, o, k);
  const ObservationIndex few(EntriesOf(row, declaration, Select(o, extremes), k));
  const PairSearch decisive(few, margin);
  if (left == 0 &&
      !decisive.AnyPair([&](std::uint32_t a, std::uint32_t b) { return contradict(extremes[a], extremes[b]); }))
    return std::nullopt;
  for (int i = 0; i < o.size(); ++i)
    if (decisive.AnyPartner(PointOf(entries, i), [&](std::uint32_t a) { return contradict(i, extremes[a]); }))
      for (int j = i + 1; j < o.size(); ++j)  // no earlier one has a partner
        if (const auto violation = TestPair(declaration, o, i, j, k)) return violation;
  return std::nullopt;
}

}  // namespace

std::optional<Violation> TestPair(const Declaration& declaration, const Observations& o, int i, int j, int k) {
  // The difference is rounded down and its bound up, so only a contradiction in real arithmetic is one. The bound has
  // the errors of both observations.
  const double difference = std::max(SubDown(o.lower(i, k), o.upper(j, k)), SubDown(o.lower(j, k), o.upper(i, k)));
  double bound = MulUp(2, declaration.ObservationError(k));
  for (Eigen::Index l = 0; l < o.z.cols(); ++l) {
    const double slope = declaration.lipschitz(k, l);
    if (slope == 0) continue;
    const double distance = std::max(SubUp(o.z(i, l), o.z(j, l)), SubUp(o.z(j, l), o.z(i, l)));
    bound = AddUp(bound, MulUp(slope, distance));
  }
  if (difference > bound) return Violation{i, j, k, difference, bound};
  return std::nullopt;
}

std::optional<Violation> FindViolation(const Declaration& declaration, const Observations& observations,
                                       const LipschitzEnvelope* envelope) {
  for (int k = 0; k < observations.num_states(); ++k) {
    if (declaration.affine.Contains(k)) continue;
    if (const auto violation = TestRow(declaration, observations, k, envelope)) return violation;
  }
  return std::nullopt;
}

}  // namespace forereach
