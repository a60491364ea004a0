// The nominal tube (no data) by what Debian offers beside ForeReach, used plainly: Boost.Interval, twelve steps of
//   natural:    the equations on intervals, X_{t+1} = F(X_t);
//   mean value: f^T(c) + J (X0 - c), the Jacobian of the whole composition by forward differentiation over X0.
// Also the inner hull of sampled rollouts, which no enclosure can be narrower than.
//   comparison [any flag of Google Benchmark]       widths of x, y, theta at the end as counters
#include <array>
#include <random>

#include <benchmark/benchmark.h>
#include <boost/numeric/interval.hpp>

#include "bench/tasks.h"
#include "forereach/dynamics/models/kinematic_bicycle.h"

namespace forereach::bench {
namespace {

namespace bn = boost::numeric;
// Outward rounding by the processor's rounding mode. sin, cos and tan are the C library's in that mode; their errors
// are not bounded, so this is rigorous up to them.
using BoostInterval =
    bn::interval<double,
                 bn::interval_lib::policies<bn::interval_lib::save_state<bn::interval_lib::rounded_transc_std<double>>,
                                            bn::interval_lib::checking_base<double>>>;

constexpr std::size_t kStates = 6, kInputs = 2;

template <class T>
using State = std::array<T, kStates>;

template <class T>
State<T> Rollout(State<T> x, const Eigen::MatrixXd& controls) {
  const KinematicBicycle bicycle{0.1, 2.5};
  for (Eigen::Index t = 0; t < controls.cols(); ++t) {
    std::array<T, kStates + kInputs> z;
    std::copy(x.begin(), x.end(), z.begin());
    for (std::size_t j = 0; j < kInputs; ++j) z[kStates + j] = T(controls(static_cast<Eigen::Index>(j), t));
    bicycle(std::span<const T>(z), std::span<T>(x));
  }
  return x;
}

// A number with its derivatives by the six initial states.
struct Gradient {
  BoostInterval value;
  State<BoostInterval> by{};

  Gradient() = default;
  Gradient(double constant) : value(constant) {}  // NOLINT: a number is a constant
  Gradient(const BoostInterval& v, const State<BoostInterval>& derivatives, const BoostInterval& factor) : value(v) {
    for (std::size_t l = 0; l < kStates; ++l) by[l] = factor * derivatives[l];
  }

  friend Gradient operator+(const Gradient& a, const Gradient& b) {
    Gradient sum(a.value + b.value, a.by, BoostInterval(1));
    for (std::size_t l = 0; l < kStates; ++l) sum.by[l] += b.by[l];
    return sum;
  }
  friend Gradient operator*(const Gradient& a, const Gradient& b) {
    Gradient product(a.value * b.value, a.by, b.value);
    for (std::size_t l = 0; l < kStates; ++l) product.by[l] += a.value * b.by[l];
    return product;
  }
  friend Gradient operator/(const Gradient& a, const Gradient& b) {  // b is a constant
    return Gradient(a.value / b.value, a.by, BoostInterval(1) / b.value);
  }
  friend Gradient sin(const Gradient& x) { return Gradient(bn::sin(x.value), x.by, bn::cos(x.value)); }
  friend Gradient cos(const Gradient& x) { return Gradient(bn::cos(x.value), x.by, -bn::sin(x.value)); }
  friend Gradient tan(const Gradient& x) {
    const BoostInterval t = bn::tan(x.value);
    return Gradient(t, x.by, BoostInterval(1) + bn::square(t));
  }
};

State<BoostInterval> InitialBox(const Task& task) {
  State<BoostInterval> box;
  for (std::size_t k = 0; k < kStates; ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    box[k] = BoostInterval(task.center[i]) + BoostInterval(-task.half_width[i], task.half_width[i]);
  }
  return box;
}

State<BoostInterval> Natural(const Task& task) { return Rollout(InitialBox(task), task.controls); }

State<BoostInterval> MeanValue(const Task& task) {
  const State<BoostInterval> box = InitialBox(task);
  State<BoostInterval> center;
  State<Gradient> x;
  for (std::size_t k = 0; k < kStates; ++k) {
    center[k] = BoostInterval(task.center[static_cast<Eigen::Index>(k)]);
    x[k].value = box[k];
    x[k].by[k] = 1;
  }
  State<BoostInterval> end = Rollout(center, task.controls);
  const State<Gradient> derivatives = Rollout(x, task.controls);
  for (std::size_t k = 0; k < kStates; ++k)
    for (std::size_t l = 0; l < kStates; ++l) end[k] += derivatives[k].by[l] * (box[l] - center[l]);
  return end;
}

// From the corners of X0 and random points of its faces.
State<BoostInterval> SampledHull(const Task& task) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> unit(-1, 1);
  State<BoostInterval> hull;
  bool first = true;
  const auto add = [&](const State<double>& scale) {
    State<double> x;
    for (std::size_t k = 0; k < kStates; ++k)
      x[k] = task.center[static_cast<Eigen::Index>(k)] + scale[k] * task.half_width[static_cast<Eigen::Index>(k)];
    const State<double> end = Rollout(x, task.controls);
    for (std::size_t k = 0; k < kStates; ++k)
      hull[k] = first ? BoostInterval(end[k]) : bn::hull(hull[k], BoostInterval(end[k]));
    first = false;
  };
  for (unsigned corner = 0; corner < 1u << kStates; ++corner) {
    State<double> scale;
    for (std::size_t k = 0; k < kStates; ++k) scale[k] = corner >> k & 1u ? 1 : -1;
    add(scale);
    for (int sample = 0; sample < 2000; ++sample) {  // faces: some coordinates at their ends, others anywhere
      State<double> face = scale;
      for (double& s : face)
        if (unit(random) > 0.3) s = unit(random);
      add(face);
    }
  }
  return hull;
}

void Report(benchmark::State& state, const State<BoostInterval>& end) {
  state.counters["width_x"] = bn::width(end[0]);
  state.counters["width_y"] = bn::width(end[1]);
  state.counters["width_theta"] = bn::width(end[2]);
}

template <auto Enclose>
void Run(benchmark::State& state) {
  const Task task = MakeNominalTube();
  State<BoostInterval> end;
  for (auto _ : state) {
    end = Enclose(task);
    benchmark::DoNotOptimize(end);
  }
  Report(state, end);
}

BENCHMARK_TEMPLATE(Run, Natural)->Name("nominal_tube/boost_natural")->Unit(benchmark::kMicrosecond);
BENCHMARK_TEMPLATE(Run, MeanValue)->Name("nominal_tube/boost_mean_value")->Unit(benchmark::kMicrosecond);
BENCHMARK_TEMPLATE(Run, SampledHull)
    ->Name("nominal_tube/sampled_inner_hull")
    ->Iterations(1)
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace forereach::bench

BENCHMARK_MAIN();
