// The guard alone, as a robot links it: without a certified plan it executes nothing.
#include "robot/guard.h"

int main() {
  forereach::GuardOptions options;
  options.num_states = 6;
  options.num_inputs = 2;
  options.step_us = 100'000;
  forereach::Guard guard(options);
  const std::uint8_t nonsense[] = {1, 2, 3};
  const auto verdict = guard.Accept(nonsense, 0);
  return verdict.ok() || guard.executing() != nullptr;
}
