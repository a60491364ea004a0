/** The values of limits (limit.h) in single states, in plain arithmetic: for planning, simulation and display, not for
bounds. */
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "forereach/dynamics/model.h"
#include "forereach/dynamics/text_program.h"
#include "forereach/safety/limit.h"

namespace forereach {

/** Immutable. */
class LimitValues final {
 public:
  /** @throws as TextEnclosure (text_enclosure.h) if an expression is wrong. */
  LimitValues(const NominalModel& model, std::vector<Limit> limits);

  [[nodiscard]] std::size_t size() const { return limits_.size(); }
  [[nodiscard]] const Limit& operator[](std::size_t i) const { return limits_[i]; }
  [[nodiscard]] bool UsesInput(std::size_t i) const { return uses_input_[i]; }
  [[nodiscard]] bool SomeUseInputs() const;

  /** Sets room[i] to the distance of limit i from being exceeded, in its unit: the lesser of at_most - h_i(x, u) and
  h_i(x, u) - at_least, for the middles of the parameters. It is negative if the limit is exceeded, and NaN if h_i is
  not defined there.
  @param x n entries. @param u m entries, or none: then a limit that uses an input has infinite room.
  @param room size() entries. */
  void Room(std::span<const double> x, std::span<const double> u, std::span<double> room) const;

  /** True if every limit has at least this room. @param margin size() entries. */
  [[nodiscard]] bool Keep(std::span<const double> x, std::span<const double> u, std::span<const double> margin) const;

 private:
  std::vector<Limit> limits_;
  std::vector<bool> uses_input_;
  std::optional<TextFunction> values_;  // none without limits: the names of a model need not fit the language
};

}  // namespace forereach
