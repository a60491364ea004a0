#include "forereach/residual/consistency.h"

#include <algorithm>
#include <cmath>

#include "forereach/residual/lipschitz_envelope.h"
#include "forereach/residual/observation_index.h"
#include "forereach/residual/pairs.h"

namespace forereach {
namespace {

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

// The first contradicting pair, given that there is one: the least first observation, and of its partners the least.
std::optional<Violation> FirstOf(const Declaration& declaration, const Observations& o, int k, const PairSearch& search,
                                 const ObservationIndex::Entries& entries) {
  std::optional<Violation> first;
  for (int i = 0; i < o.size() && !first; ++i)
    search.AnyPartner(PointOf(entries, i), [&](std::uint32_t id) {
      const int j = static_cast<int>(id);
      if (j > i && (!first || j < first->second))
        if (const auto violation = TestPair(declaration, o, i, j, k)) first = violation;
      return false;
    });
  return first;
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
  const ObservationIndex built = envelope ? ObservationIndex() : ObservationIndex(entries);
  const PairSearch search(envelope ? envelope->index(k) : built, margin);
  const bool violated = search.AnyPair([&](std::uint32_t i, std::uint32_t j) {
    return TestPair(declaration, o, static_cast<int>(i), static_cast<int>(j), k).has_value();
  });
  return violated ? FirstOf(declaration, o, k, search, entries) : std::nullopt;
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
  for (int k = 0; k < observations.num_states(); ++k)
    if (const auto violation = TestRow(declaration, observations, k, envelope)) return violation;
  return std::nullopt;
}

}  // namespace forereach
