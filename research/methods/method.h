/** The paper's comparison: methods that bound the residual over a query set, each on its own assumptions. The tube is
then made by the same Propagator, so two methods differ in nothing but their ResidualEnclosure.

Most of them are not sound; the header of each says what it claims. (`Method` here is not forereach::Method, which names
how a remainder is bounded.) */
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>

#include "forereach/dynamics/model.h"
#include "forereach/reach/domain.h"
#include "forereach/residual/declaration.h"
#include "forereach/residual/enclosure.h"
#include "forereach/residual/transitions.h"

namespace forereach::research {

/** What a method may know of a task. */
struct Setting {
  const NominalModel& model;
  const Domain& domain;
  const Declaration& declaration;  // L and sigma
  const Transitions& data;
  std::uint64_t seed;  // for methods that draw
};

/** A peer of the envelope: residual bounds over a query set in, tube out (by the same Propagator). */
struct Method {
  std::string name;  // as in the paper's tables
  std::function<std::unique_ptr<ResidualEnclosure>(const Setting&)> make;
};

/** All of them, ForeReach first, in the order of the paper's tables. */
[[nodiscard]] std::span<const Method> Methods();

}  // namespace forereach::research
