#include "bench/stages.h"

#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <benchmark/benchmark.h>

#include "bench/tasks.h"
#include "forereach/certify/extender.h"
#include "forereach/certify/tube.h"
#include "forereach/reach/propagator.h"
#include "forereach/residual/consistency.h"
#include "forereach/residual/lipschitz_envelope.h"
#include "forereach/residual/observation_store.h"
#include "forereach/residual/observations.h"
#include "forereach/safety/separation.h"
#include "forereach/sets/order_reduction.h"

namespace forereach::bench {
namespace {

using benchmark::State;

// In the middle of the run, where the slice has all its generators.
constexpr int kStep = 8;

// The slice X_8 of a task's tube, and what the stages need beside it.
struct Midway {
  Midway(const Task& the_task, const Certifier& certifier)
      : task(the_task),
        observations(Observe(*task.problem->model, task.problem->transitions)),
        envelope(task.problem->declaration, observations, Ends(&Box::lower), Ends(&Box::upper)) {
    Tube tube;
    (void)certifier.Certify(task.plan(), task.initial_set(), task.obstacles, tube);
    slice = tube.slice(kStep);
    for (int k = 0; k < slice.dim(); ++k) half_width[static_cast<std::size_t>(k)] = slice.HalfWidthUpper(k);
  }

  [[nodiscard]] std::span<const double> input() const { return task.plan().input(kStep); }
  [[nodiscard]] QuerySet query() const {
    return {slice, input(), {half_width.data(), static_cast<std::size_t>(slice.dim())}};
  }

  // Lower or upper ends of the domain over z.
  [[nodiscard]] std::vector<double> Ends(const Eigen::VectorXd& (Box::*ends)() const) const {
    const Eigen::VectorXd &state = (task.problem->domain.state.*ends)(), &input = (task.problem->domain.input.*ends)();
    std::vector<double> both(state.begin(), state.end());
    both.insert(both.end(), input.begin(), input.end());
    return both;
  }

  const Task& task;
  Observations observations;
  LipschitzEnvelope envelope;
  Zonotope slice;
  std::array<double, kMaxStates> half_width{};
};

const Midway& CachedMidway(Scenario scenario, int observations) {
  static std::map<std::pair<Scenario, int>, std::unique_ptr<const Midway>> known;
  auto& midway = known[{scenario, observations}];
  if (!midway)
    midway =
        std::make_unique<const Midway>(CachedTask(scenario, observations), CachedCertifier(scenario, observations));
  return *midway;
}

void RunStep(State& state, const Midway& midway) {
  const Problem& problem = *midway.task.problem;
  const Propagator propagator(*problem.model, problem.domain, midway.envelope, problem.declaration.disturbance,
                              problem.zonotope_order, problem.method);
  Zonotope next;
  StepRecord record;
  record.half_width = midway.half_width;
  std::array<double, kMaxStates> next_half_width;
  for (auto _ : state)
    benchmark::DoNotOptimize(propagator.Step(midway.slice, midway.input(), record, next, next_half_width.data()));
}

void RunEnvelope(State& state, const Midway& midway) {
  ResidualBounds bounds;
  for (auto _ : state) {
    midway.envelope.Enclose(midway.query(), bounds);
    benchmark::DoNotOptimize(bounds);
  }
}

void RunPairwise(State& state, const Midway& midway) {
  for (auto _ : state) benchmark::DoNotOptimize(FindViolation(midway.task.problem->declaration, midway.observations));
}

void RunExpand(State& state, const Midway& midway) {
  std::vector<double> z(midway.slice.center().begin(), midway.slice.center().end());
  z.insert(z.end(), midway.input().begin(), midway.input().end());
  std::vector<PlainInterval> box;
  for (std::size_t l = 0; l < z.size(); ++l) {
    const double half_width = l < static_cast<std::size_t>(midway.slice.dim()) ? midway.half_width[l] : 0;
    box.push_back({z[l] - half_width, z[l] + half_width});
  }
  Expansion out;
  for (auto _ : state) {
    midway.task.problem->model->Expand(z, box, out);
    benchmark::DoNotOptimize(out);
  }
}

void RunReduction(State& state, const Midway& midway) {
  constexpr std::array<double, kMaxStates> kNone{};
  Zonotope full = midway.slice;
  for (int extra = 0; extra < 2; ++extra)
    for (int k = 0; k < full.dim(); ++k) ArraysOf(full).AppendAxis(k, 0.01);
  for (auto _ : state) {
    Zonotope set = full;  // the copy is part of the time
    AppendAndReduce(set, kNone.data(), kNone.data(), midway.task.problem->zonotope_order);
    benchmark::DoNotOptimize(set);
  }
}

void RunSeparation(State& state, const Midway& midway) {
  Zonotope projected;
  const std::span<const double> half_width(midway.half_width.data(), static_cast<std::size_t>(midway.slice.dim()));
  Projection(midway.task.problem->projection, midway.slice.dim()).Enclose(midway.slice, half_width, projected);
  for (auto _ : state) benchmark::DoNotOptimize(Separate(projected, midway.task.obstacles.front()));
}

// The same step of a tree, with the tests of its slice.
void RunExtension(State& state, const Midway& midway) {
  const Certifier certifier(midway.task.problem);
  Tube tube;
  Extender extender(certifier, midway.task.obstacles, midway.task.schedule, tube, false);
  TubeNode node, next;
  bool proven = extender.Begin(midway.task.initial_set(), node).outcome == Outcome::kNone;
  for (int t = 0; t < kStep && proven; ++t)
    proven = extender.Extend(node, midway.task.plan().input(t), node).outcome == Outcome::kNone;
  if (!proven) return state.SkipWithError("not the task's tube");
  for (auto _ : state) benchmark::DoNotOptimize(extender.Extend(node, midway.input(), next));
  state.counters["bytes"] = static_cast<double>(next.bytes());
}

using Run = void (*)(State&, const Midway&);

void Register(const char* stage, Scenario scenario, int observations, Run run) {
  const std::string name = std::string("stage/").append(stage).append("/").append(NameOf(scenario, observations));
  benchmark::RegisterBenchmark(name.c_str(), [=](State& state) {
    run(state, CachedMidway(scenario, observations));
  })->Unit(benchmark::kMicrosecond);
}

// The last observations of a task, one after the other, into a store of those before them: as many as its tail takes
// without an index having to be built. Each is tested against all that are there.
void RegisterInsertion(int observations) {
  const int tail = StoreOptions{}.tail_capacity, inserted = std::min(tail, observations / 2);
  const std::string name = std::string("stage/insertion/").append(NameOf(Scenario::kBicycle, observations));
  benchmark::RegisterBenchmark(
      name.c_str(),
      [=](State& state) {
        const Midway& midway = CachedMidway(Scenario::kBicycle, observations);
        const Observations& all = midway.observations;
        const int before = all.size() - inserted;
        ObservationStore store(midway.task.problem->declaration,
                               {all.z.topRows(before), all.lower.topRows(before), all.upper.topRows(before)},
                               midway.Ends(&Box::lower), midway.Ends(&Box::upper));
        // A column each, so that one observation's numbers lie together.
        const Eigen::MatrixXd z = all.z.bottomRows(inserted).transpose(),
                              lower = all.lower.bottomRows(inserted).transpose(),
                              upper = all.upper.bottomRows(inserted).transpose();
        const auto column = [](const Eigen::MatrixXd& matrix, Eigen::Index i) {
          return std::span(matrix.col(i).data(), static_cast<std::size_t>(matrix.rows()));
        };
        Eigen::Index i = 0;
        for (auto _ : state) {
          const auto insertion = store.Insert(column(z, i), column(lower, i), column(upper, i));
          if (insertion.id < 0 || insertion.violation) return state.SkipWithError("an observation was not taken");
          ++i;
        }
      })
      ->Iterations(inserted)
      ->Unit(benchmark::kMicrosecond);
}

}  // namespace

void RegisterStages(int observations) {
  for (const Scenario scenario : {Scenario::kBicycle, Scenario::kPointMass, Scenario::kDense}) {
    if (scenario == Scenario::kDense && observations > 10'000) continue;  // its pairwise test takes many minutes
    Register("pairwise", scenario, observations, RunPairwise);
    Register("envelope", scenario, observations, RunEnvelope);
  }
  Register("step", Scenario::kBicycle, observations, RunStep);
  Register("extension", Scenario::kBicycle, observations, RunExtension);
  RegisterInsertion(observations);
  if (observations != 400) return;  // the others do not look at observations
  Register("expansion", Scenario::kBicycle, observations, RunExpand);
  Register("reduction", Scenario::kBicycle, observations, RunReduction);
  Register("separation_exact", Scenario::kBicycle, observations, RunSeparation);
}

}  // namespace forereach::bench
