#include "bench/without_rounding.h"

#include "bench/run_certify.h"

static_assert(!forereach::kCountsRounding);

void RunCertifyWithoutRounding(benchmark::State& state, int observations) {
  using namespace forereach::bench;
  RunCertify(state, CachedCertifier(Scenario::kBicycle, observations), CachedTask(Scenario::kBicycle, observations));
}
