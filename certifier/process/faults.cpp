#include "certifier/process/faults.h"

#include <utility>

#include <fmt/core.h>

namespace forereach {

FoundFault PlainFault(std::int16_t cause, std::string why) {
  fault_t fault{};
  fault.cause = cause;
  fault.plan_id = fault.first_observation = fault.second_observation = -1;
  fault.step = fault.coordinate = -1;
  return {fault, std::move(why)};
}

FoundFault SliceLeft(const PlanLedger::Departure& departure) {
  const std::string error = departure.error > 0 ? fmt::format(" +- {}", departure.error) : "";
  FoundFault found = PlainFault(
      fault_t::SLICE_LEFT,
      fmt::format("plan {}: state coordinate {} is {}{} at step {}, its certified slice is [{}, {}]", departure.plan_id,
                  departure.coordinate, departure.value, error, departure.step, departure.lower, departure.upper));
  found.fault.plan_id = departure.plan_id;
  found.fault.step = static_cast<std::int16_t>(departure.step);
  found.fault.coordinate = static_cast<std::int16_t>(departure.coordinate);
  found.fault.value = departure.value;
  found.fault.lower = departure.lower;
  found.fault.upper = departure.upper;
  return found;
}

FoundFault UncertifiedPlan(const PlanLedger::Stranger& stranger) {
  FoundFault found = PlainFault(fault_t::UNCERTIFIED_PLAN, stranger.why);
  found.fault.plan_id = stranger.plan_id;
  found.fault.step = static_cast<std::int16_t>(stranger.step);
  return found;
}

FoundFault DeclarationFalsified(const Violation& violation, const AffineRows& affine) {
  const auto& [first, second, coordinate, difference, bound] = violation;
  std::string why;
  if (const int region = Violation::RegionOf(second); region >= 0)
    why = fmt::format(
        "the executed transition {} contradicts declaration.regions[{}]: residual coordinate {} is at least {} in "
        "size, {} is declared",
        first, region, coordinate, difference, bound);
  else if (second < 0)
    why = fmt::format(
        "the executed transition {} contradicts a declared rate: state coordinate {} changes by at least {} a second, "
        "{} is declared",
        first, coordinate, difference, bound);
  else if (affine.Contains(coordinate))
    why = fmt::format(
        "the executed transition {} contradicts the declaration: no affine residual {} agrees with it, observation {} "
        "and a few others; {}",
        second, coordinate, first,
        bound > 0 ? fmt::format("one slope is {}, not {}", difference, bound)
                  : fmt::format("one is {} off", difference));
  else
    why = fmt::format(
        "the executed transition {} contradicts the declaration: with observation {} its residual {} differs by {}, "
        "the declaration allows {}",
        second, first, coordinate, difference, bound);
  FoundFault found = PlainFault(fault_t::DECLARATION_FALSIFIED, std::move(why));
  found.fault.coordinate = static_cast<std::int16_t>(coordinate);
  found.fault.first_observation = first;
  found.fault.second_observation = second;
  found.fault.value = difference;
  found.fault.upper = bound;
  return found;
}

}  // namespace forereach
