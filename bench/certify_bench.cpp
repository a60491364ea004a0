// How long one certify call takes, beside the straightforward version, and each stage of it alone.
//   certify_bench [--largest=N] [any flag of Google Benchmark]
// It is run from the project's directory. Names are scenario/N: what scripts/bench reads from the JSON. --largest
// leaves out tasks of more observations; those of 10^7 take a minute and 8 GB to set up, and run only where it asks for
// them.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include <benchmark/benchmark.h>

#include "bench/run_certify.h"
#include "bench/stages.h"
#include "bench/straightforward.h"
#include "bench/tasks.h"
#include "bench/text_models.h"
#include "bench/without_rounding.h"
#include "forereach/certify/batch.h"
#include "forereach/dynamics/models/named_models.h"
#include "forereach/numerics/parallel.h"
#include "forereach/safety/obstacle_index.h"
#include "task/config.h"

namespace forereach::bench {
namespace {

constexpr std::array kScenarios{Scenario::kBicycle, Scenario::kPointMass, Scenario::kDense};
constexpr std::array kSizes{25, 400, 10'000, 1'000'000, 10'000'000};
constexpr int kLargestUnlessAsked = 1'000'000;
constexpr int kBatch = 10'000;
// In eight dimensions the pairwise test, once when the certifier is made, compares nearly all pairs of observations.
constexpr int kLargestDense = 10'000;

using benchmark::State;

// One benchmark, in microseconds.
template <class Run>
benchmark::internal::Benchmark* Register(const std::string& name, const Run& run) {
  return benchmark::RegisterBenchmark(name.c_str(), run)->Unit(benchmark::kMicrosecond);
}

PlainModel PlainModelOf(Scenario scenario) {
  return scenario == Scenario::kPointMass ? PlainPointMass(0.15) : PlainBicycle(0.1, 2.5);
}

void RunStraightforward(State& state, const Straightforward& plain, const Task& task) {
  const PlainZonotope initial_set{task.center, task.half_width.asDiagonal()};
  if (plain.Certify(task.controls, initial_set, task.obstacles).outcome != Straightforward::Outcome::kCertified)
    return state.SkipWithError("no certificate");
  Straightforward::Answer answer;
  for (auto _ : state) {
    answer = plain.Certify(task.controls, initial_set, task.obstacles);
    benchmark::DoNotOptimize(answer.outcome);
  }
  const Eigen::VectorXd half_width = answer.tube.back().HalfWidth();
  AddWidths(state, [&](int k) { return half_width[k]; });
}

// As many plans as make starting the threads cheap beside them.
void RunBatch(State& state, int observations, unsigned threads) {
  const Task& task = CachedTask(Scenario::kBicycle, observations);
  const Certifier& certifier = CachedCertifier(Scenario::kBicycle, observations);
  const std::vector<Eigen::MatrixXd> controls = MakePlans(task, kBatch);
  std::vector<Plan> plans;
  for (const Eigen::MatrixXd& plan : controls) plans.push_back(Task::PlanOf(plan));
  const std::array initial_set{task.initial_set()};
  for (auto _ : state)
    benchmark::DoNotOptimize(CertifyAll(certifier, plans, initial_set, task.obstacles, {.threads = threads}));
  state.SetItemsProcessed(state.iterations() * kBatch);
}

// 1,000 chunks of 20 steps that share their beginnings five by five, or nothing: by CertifyAll, or with 0 threads one
// after the other.
void RunChunks(State& state, bool kin, unsigned threads) {
  constexpr int kChunks = 1000, kKin = 5, kShared = 15;
  const Task task = MakeChunkTask();
  const Certifier certifier(task.problem);
  std::vector<Eigen::MatrixXd> chunks = MakePlans(task, kChunks);
  for (std::size_t i = 0; kin && i < chunks.size(); ++i)
    chunks[i].leftCols(kShared) = chunks[i - i % kKin].leftCols(kShared);
  std::vector<Plan> plans;
  for (const Eigen::MatrixXd& chunk : chunks) plans.push_back(Task::PlanOf(chunk));
  const std::array start{task.initial_set()};
  const auto all = CertifyAll(certifier, plans, start, task.obstacles);
  if (std::ranges::count(all, Outcome::kCertified, &Decision::outcome) != kChunks)
    return state.SkipWithError("not all are certified");
  Tube tube;
  for (auto _ : state) {
    if (threads > 0)
      benchmark::DoNotOptimize(CertifyAll(certifier, plans, start, task.obstacles, {.threads = threads}));
    for (std::size_t i = 0; threads == 0 && i < plans.size(); ++i)
      benchmark::DoNotOptimize(certifier.Certify(plans[i], start[0], task.obstacles, tube));
  }
  state.SetItemsProcessed(state.iterations() * kChunks);
}

void RegisterCertify(Scenario scenario, int observations) {
  const std::string suffix = NameOf(scenario, observations);
  Register("certify/" + suffix, [=](State& state) {
    RunCertify(state, CachedCertifier(scenario, observations), CachedTask(scenario, observations));
  });
  if (scenario == Scenario::kBicycle && observations <= 400)
    Register("certify_unrounded/" + suffix, [=](State& state) { RunCertifyWithoutRounding(state, observations); });
  const auto register_other = [&](const std::string& name, auto change) {
    Register(name + suffix, [=](State& state) {
      const Task& task = CachedTask(scenario, observations);
      Problem problem = *task.problem;
      change(problem);
      RunCertify(state, Certifier(std::make_shared<const Problem>(std::move(problem))), task);
    });
  };
  if (scenario == Scenario::kBicycle && observations == 400)
    register_other("certify_centred/", [](Problem& problem) { problem.method = Method::kCentred; });
  if (observations == 400 && BestInstructionSet() == InstructionSet::kAvx512)
    register_other("certify_avx2/", [](Problem& problem) { problem.instructions = InstructionSet::kAvx2; });

  // A second a call and more, and the same work a thousand times: not run.
  if (observations > (scenario == Scenario::kDense ? 400 : 10'000)) return;
  for (const auto& [name, spelling] : {std::pair("straightforward/", Straightforward::Spelling::kMatrices),
                                       std::pair("straightforward_loops/", Straightforward::Spelling::kLoops)})
    Register(name + suffix, [=, spelling = spelling](State& state) {
      const Task& task = CachedTask(scenario, observations);
      RunStraightforward(state, Straightforward(task.problem, PlainModelOf(scenario), spelling), task);
    });
}

void RegisterPlainPairwise(int observations) {
  if (observations > 400) return;
  Register("straightforward_pairwise/" + NameOf(Scenario::kBicycle, observations), [=](State& state) {
    const Straightforward plain(CachedTask(Scenario::kBicycle, observations).problem, PlainModelOf(Scenario::kBicycle));
    for (auto _ : state) benchmark::DoNotOptimize(plain.FindViolation());
  });
}

void RegisterNominalTube() {
  for (const auto& [name, method] : {std::pair("nominal_tube/forereach", Method::kCentred),
                                     std::pair("nominal_tube/forereach_paper", Method::kPaper)})
    Register(name, [method = method](State& state) {
      const Task task = MakeNominalTube(method);
      RunCertify(state, Certifier(task.problem), task);
    });
  Register("nominal_tube/straightforward", [](State& state) {
    const Task task = MakeNominalTube();
    RunStraightforward(state, Straightforward(task.problem, PlainModelOf(Scenario::kBicycle)), task);
  });
}

// The paper's bicycle with 400 observations among what a robot meets: the same tube, another test of it.
struct World {
  const char* name;
  Body body;
  std::optional<Between> between;
  bool moves = false;
};

std::vector<World> Worlds() {
  using Eigen::Vector3d;
  const Body disc{2, {{{Vector3d(1.4, 0, 0)}, 0.9}}};
  const Body rectangle{2, {{{{-0.6, -0.6, 0}, {2.4, -0.6, 0}, {2.4, 0.6, 0}, {-0.6, 0.6, 0}}, 0}}};
  const Between between{Eigen::Vector2d(4, 4), 2.5, 1.5, 0.1};
  return {{"point", {}, {}},
          {"disc_at_frame", {2, {{{Vector3d::Zero()}, 0.9}}}, {}},
          {"disc", disc, {}},
          {"rectangle", rectangle, {}},
          {"point_swept", {}, between},
          {"disc_swept", disc, between},
          {"rectangle_swept", rectangle, between},
          {"disc_moving", disc, between, true}};
}

Task TaskIn(const World& world) {
  Task task = CachedTask(Scenario::kBicycle, 400);
  Problem problem = *task.problem;
  problem.body = world.body;
  problem.between = world.between;
  task.problem = std::make_shared<const Problem>(std::move(problem));
  return task;
}

void RegisterWorlds() {
  for (const World& world : Worlds())
    Register(std::string("world/") + world.name, [world](State& state) {
      Task task = TaskIn(world);
      if (world.moves) {
        ObstacleMotion motion;
        motion.velocity = {0.5, 0, 0};
        motion.growth = 0.1;
        task.obstacles[0] = task.obstacles[0].Moving(motion);
        task.schedule = {0, 100'000, 5'000};
      }
      RunCertify(state, Certifier(task.problem), task);
    });
}

// The bicycle among the cells of a map and without them: anywhere, or along both sides of a street and else 3 m away.
// Each cell would leave a certificate if it were 0.3 m larger.
std::vector<Obstacle> MapCells(const Certifier& certifier, const Task& task, bool is_street, int count) {
  const Plan plan = task.plan();
  std::mt19937_64 random(1);
  const auto within = [&](double most) { return (static_cast<double>(random() >> 11) * 0x1p-53 * 2 - 1) * most; };
  std::vector<Obstacle> cells;
  Tube tube;
  static_cast<void>(certifier.Certify(plan, task.initial_set(), {}, tube));
  const auto add = [&](double x, double y, double room) {
    const Obstacle cell = Obstacle::AxisBox(Eigen::Vector2d(x, y), Eigen::Vector2d(x + 0.25, y + 0.25));
    const Decision alone = certifier.JudgeSafety(plan, {&cell, 1}, tube);
    if (alone.outcome == Outcome::kCertified && alone.margin - alone.threshold > room) cells.push_back(cell);
  };
  for (int i = 0; is_street && i < 200; ++i)
    for (const double y : {3.0, -3.25}) add(-25 + 0.25 * i, y, 0.3);
  while (std::ssize(cells) < count) {
    const double x = std::floor(within(25) / 0.25) * 0.25, y = std::floor(within(25) / 0.25) * 0.25;
    add(x, y, is_street ? 3 : 0.3);
  }
  return cells;
}

// A map's cells, and as many predictions of what moves, each for a tenth of a second. Made once, by the first trial.
struct Surroundings {
  explicit Surroundings(const World& world)
      : task(TaskIn(world)),
        certifier(task.problem),
        cells(MapCells(certifier, task, false, 2000)),
        street(MapCells(certifier, task, true, 2000)),
        cells_index(cells),
        street_index(street) {
    for (std::size_t i = 0; i < cells.size(); ++i) {
      ObstacleMotion motion;
      motion.stamp_us = motion.from_us = static_cast<std::int64_t>(i % 40) * 100'000;
      motion.until_us = motion.from_us + 100'000;
      motion.growth = 0.5;
      predicted.push_back(cells[i].Moving(motion));
    }
    predicted_index = ObstacleIndex(predicted);
    task.schedule = {0, 100'000, 5'000};
  }

  Task task;
  Certifier certifier;
  std::vector<Obstacle> cells, street, predicted;
  ObstacleIndex cells_index, street_index, predicted_index;
};

void RegisterMaps() {
  for (const World& world : Worlds()) {
    if (world.moves) continue;
    const auto made = std::make_shared<std::optional<Surroundings>>();
    const auto add = [&](const char* name, auto obstacles_of) {
      Register(std::string("map/") + world.name + "/" + name, [=](State& state) {
        const Surroundings& all = *made ? **made : made->emplace(world);
        RunCertify(state, all.certifier, all.task, obstacles_of(all));
      });
    };
    add("none", [](const Surroundings&) { return ObstacleView(); });
    add("map_2000", [](const Surroundings& all) { return ObstacleView(all.cells, all.cells_index); });
    add("street_2000", [](const Surroundings& all) { return ObstacleView(all.street, all.street_index); });
    add("map_2000_without_index", [](const Surroundings& all) { return ObstacleView(all.cells); });
    add("predicted_2000", [](const Surroundings& all) { return ObstacleView(all.predicted, all.predicted_index); });
  }
}

// Tasks as people write them: ten steps of the middle of their inputs, if that is certified among nothing.
void RegisterTasks() {
  for (const char* name : {"demo", "truck", "arm", "drive/boat", "drive/cart_pole", "drive/differential_drive",
                           "drive/kinematic_bicycle", "drive/planar_quadrotor", "drive/point_mass",
                           "drive/reaching_arm", "drive/single_track", "drive/two_link_arm", "drive/unicycle"}) {
    struct Made {
      explicit Made(const std::string& path) {
        const Config config = LoadConfig(path);
        const Box &inputs = config.problem->domain.input, &set = config.initial_set;
        task.problem = config.problem;
        task.center = (set.lower() + set.upper()) / 2;
        task.half_width = (set.upper() - set.lower()) / 2;
        task.controls = ((inputs.lower() + inputs.upper()) / 2).replicate(1, 10);
        certifier.emplace(task.problem);
        cells = MapCells(*certifier, task, false, 2000);
        index = ObstacleIndex(cells);
      }
      Task task;
      std::optional<Certifier> certifier;
      std::vector<Obstacle> cells;
      ObstacleIndex index;
    };
    const auto made = std::make_shared<std::optional<Made>>();
    for (const bool among_cells : {false, true})
      Register(std::string("task/") + name + (among_cells ? "/map_2000" : "/none"), [=](State& state) {
        const Made& all = *made ? **made : made->emplace(std::string("config/") + name + ".yaml");
        RunCertify(state, *all.certifier, all.task, among_cells ? ObstacleView(all.cells, all.index) : ObstacleView());
      });
  }
}

// The bicycle as text beside the compiled one, its integrators, and a large model.
using Integrator = ModelText::Integrator;
struct NamedTask {
  const char* name;
  Task (*make)();
};
constexpr NamedTask kBicycleMidpoint{"bicycle_midpoint",
                                     [] { return MakeBicycleTextTask(BicycleText(Integrator::kMidpoint), 400); }},
    kBicycleMidpointNext{"bicycle_midpoint_next", [] { return MakeBicycleTextTask(BicycleMidpointText(), 400); }},
    kBicycleRk4{"bicycle_rk4", [] { return MakeBicycleTextTask(BicycleText(Integrator::kRk4), 400); }},
    kQuadrotor{"quadrotor_rk4_20_steps", [] { return MakeQuadrotorTask(); }};

void RegisterTextModels() {
  for (const NamedTask& each :
       {NamedTask{"bicycle_compiled", [] { return CachedTask(Scenario::kBicycle, 400); }},
        NamedTask{"bicycle_text", [] { return MakeBicycleTextTask(BicycleText(Integrator::kNone), 400); }},
        kBicycleMidpoint, kBicycleMidpointNext, kBicycleRk4, kQuadrotor})
    Register(std::string("model/") + each.name, [each](State& state) {
      const Task task = each.make();
      RunCertify(state, Certifier(task.problem), task);
    });
}

// The same calls with steps up to a twentieth off their times, beside those of steps on time (docs/soundness.md, 3.15).
void RegisterOffsets() {
  for (const NamedTask& each :
       {NamedTask{"bicycle", [] { return CachedTask(Scenario::kBicycle, 400); }},
        NamedTask{"point_mass", [] { return CachedTask(Scenario::kPointMass, 400); }},
        NamedTask{"bicycle_text", [] { return MakeBicycleTextTask(BicycleText(Integrator::kEuler), 400); }},
        kBicycleMidpointNext, kBicycleMidpoint, kBicycleRk4, kQuadrotor})
    for (const bool is_off : {false, true})
      Register(std::string("steps/") + each.name + (is_off ? "/off_their_times" : "/on_time"), [=](State& state) {
        const Task task = each.make();
        Problem problem = *task.problem;
        if (is_off) problem.timing.error = StepOf(*problem.model) / 20;
        RunCertify(state, Certifier(std::make_shared<Problem>(problem)), task);
      });
}

void RegisterBatch() {
  const unsigned cores = AllCores();
  const auto add = [](const std::string& name, const auto& run) { Register(name, run)->UseRealTime(); };
  for (unsigned threads = 1; threads <= cores; threads = threads < cores ? std::min(2 * threads, cores) : cores + 1) {
    const std::string suffix = "/" + std::to_string(threads);
    add("batch/bicycle/400" + suffix, [=](State& state) { RunBatch(state, 400, threads); });
    add("chunks/apart" + suffix, [=](State& state) { RunChunks(state, false, threads); });
    add("chunks/kin" + suffix, [=](State& state) { RunChunks(state, true, threads); });
  }
  add("chunks/apart/loop", [](State& state) { RunChunks(state, false, 0); });
  add("chunks/kin/loop", [](State& state) { RunChunks(state, true, 0); });
}

void RegisterAll(int largest) {
  for (const int observations : kSizes) {
    if (observations > largest) continue;
    for (const Scenario scenario : kScenarios)
      if (scenario != Scenario::kDense || observations <= kLargestDense) RegisterCertify(scenario, observations);
    RegisterPlainPairwise(observations);
    RegisterStages(observations);
  }
  RegisterNominalTube();
  RegisterWorlds();
  RegisterMaps();
  RegisterTasks();
  RegisterTextModels();
  RegisterOffsets();
  RegisterBatch();
}

// Takes --largest=N out of the arguments.
int TakeLargest(int& argc, char** argv) {
  constexpr std::string_view flag = "--largest=";
  int largest = kLargestUnlessAsked, kept = 1;
  for (int i = 1; i < argc; ++i) {
    if (std::string_view(argv[i]).starts_with(flag))
      largest = std::atoi(argv[i] + flag.size());
    else
      argv[kept++] = argv[i];
  }
  argc = kept;
  return largest;
}

}  // namespace
}  // namespace forereach::bench

int main(int argc, char** argv) {
  const int largest = forereach::bench::TakeLargest(argc, argv);
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  forereach::bench::RegisterAll(largest);
  benchmark::RunSpecifiedBenchmarks();
}
