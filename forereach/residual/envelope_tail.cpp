#include "forereach/residual/envelope_tail.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace forereach {

EnvelopeTail::EnvelopeTail(const Declaration& declaration, const LipschitzEnvelope& envelope, int capacity)
    : envelope_(envelope), capacity_(capacity) {
  const auto entries = ToSize(capacity), blocks = (entries + kPackSize - 1) / kPackSize;
  for (int k = 0; k < envelope.num_states(); ++k)
    rows_.push_back({declaration.ObservationError(k),
                     std::vector<Pack>(blocks * (envelope.row(k).num_coordinates() + 2)), std::vector<double>(entries),
                     std::vector<double>(entries)});
}

bool EnvelopeTail::Covers(std::span<const double> lower, std::span<const double> upper) const {
  for (int k = 0; k < envelope_.num_states(); ++k) {
    const auto i = ToSize(k);
    const double magnitude = AddUp(std::max(std::abs(lower[i]), std::abs(upper[i])), rows_[i].observation_error);
    // The error of an answer was computed for values up to this limit (soundness 3.5); NaN is beyond it.
    if (!envelope_.row(k).is_constant() && !(magnitude <= envelope_.value_limit(k))) return false;
  }
  return true;
}

void EnvelopeTail::Append(std::span<const double> z, std::span<const double> lower, std::span<const double> upper) {
  const auto entry = ToSize(size_.load(std::memory_order_relaxed)), lane = entry % kPackSize;
  std::array<double, kMaxVariables> coordinates;
  for (int k = 0; k < envelope_.num_states(); ++k) {
    const LipschitzRow& distance = envelope_.row(k);
    Row& row = rows_[ToSize(k)];
    const double floor = SubDown(lower[ToSize(k)], row.observation_error);
    const double negated_ceiling = -AddUp(upper[ToSize(k)], row.observation_error);
    const std::size_t columns = distance.num_coordinates();
    Pack* block = row.blocks.data() + entry / kPackSize * (columns + 2);
    distance.Map([&](int l) { return z[ToSize(l)]; }, coordinates.data());
    for (std::size_t c = 0; c < columns; ++c) block[c].set(lane, coordinates[c]);
    block[columns].set(lane, floor);
    block[columns + 1].set(lane, negated_ceiling);
    // Running extremes: a reader with an older size finds those of its own entries.
    row.floors[entry] = entry == 0 ? floor : std::max(floor, row.floors[entry - 1]);
    row.negated_ceilings[entry] =
        entry == 0 ? negated_ceiling : std::max(negated_ceiling, row.negated_ceilings[entry - 1]);
  }
  // Readers load the size with acquire: who sees the new size sees the whole entry.
  size_.store(static_cast<int>(entry) + 1, std::memory_order_release);
}

double EnvelopeTail::HighestFloor(int k, int count) const {
  return count == 0 ? -kInfinity : rows_[ToSize(k)].floors[ToSize(count - 1)];
}

double EnvelopeTail::HighestNegatedCeiling(int k, int count) const {
  return count == 0 ? -kInfinity : rows_[ToSize(k)].negated_ceilings[ToSize(count - 1)];
}

}  // namespace forereach
