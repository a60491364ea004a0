#include "research/drift/drive.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <ostream>

#include "command_line/progress.h"
#include "research/drift/drift.h"
#include "research/markdown.h"
#include "research/random.h"
#include "research/run_directory.h"
#include "task/config.h"

namespace forereach::research {
namespace {

namespace fs = std::filesystem;

constexpr const char* kTaskFile = FOREREACH_SOURCE_DIR "/research/drift/drive.yaml";
constexpr const char* kNominalFile = FOREREACH_SOURCE_DIR "/config/models/single_track.yaml";
constexpr std::int64_t kStartUs = 1'700'000'000'000'000;

std::string Read(const char* path) {
  std::ifstream file(path);
  if (!file) throw std::runtime_error(std::string(path) + ": cannot be read");
  return {std::istreambuf_iterator<char>(file), {}};
}

// What the task says of the learned: model, domain, declaration.
std::string Head(const Problem& problem, const std::string& transitions) {
  return "# A declaration that was learned from drives is an assumption. research/higher-order-car.md.\nmodel: {file: "
         "drift-model.yaml, parameters: {dt: " +
         Text("%g", kOrdinaryStep) + "}}\ndomain:\n  state: {lower: " + List(problem.domain.state.lower()) +
         ", upper: " + List(problem.domain.state.upper()) +
         "}\n  input: {lower: " + List(problem.domain.input.lower()) +
         ", upper: " + List(problem.domain.input.upper()) +
         "}\ndeclaration:\n  lipschitz: {}\n  noise_bound: " + List(problem.declaration.noise_bound) +
         "\n  state_error: {}\n  disturbance: " + List(problem.declaration.disturbance) +
         "\ntransitions: " + transitions + "\n\n";
}

// The same with each transition moved to begin at the origin, and a domain around the way to the goal: the car does not
// depend on its place, and the planner's map has cells of a size that the domain gives.
Problem AboutTheWay(const Problem& learned) {
  Problem problem = learned;
  problem.transitions.x_next.leftCols(2) -= problem.transitions.z.leftCols(2);
  problem.transitions.z.leftCols(2).setZero();
  Eigen::VectorXd lower = learned.domain.state.lower(), upper = learned.domain.state.upper();
  lower.head(2) << -20, -12;
  upper.head(2) << 260, 12;
  problem.domain.state = Box(lower, upper);
  return problem;
}

void Widen(Between& most, const Between& other) {
  most.acceleration = most.acceleration.cwiseMax(other.acceleration);
  most.turn_rate = std::max(most.turn_rate, other.turn_rate);
  most.turn_acceleration = std::max(most.turn_acceleration, other.turn_acceleration);
}

bool IsWithin(const Between& motion, const Between& bound) {
  return (motion.acceleration.array() <= bound.acceleration.array()).all() && motion.turn_rate <= bound.turn_rate &&
         motion.turn_acceleration <= bound.turn_acceleration;
}

// Discs beside or on the way, and a start that is not quite where the planner would like it.
void Draw(Config& config, int seed) {
  Random random{4, static_cast<std::uint64_t>(seed)};
  for (const double x : {45, 80, 115, 150, 185})
    config.obstacles.push_back(
        Obstacle::Circle(Eigen::Vector2d(x + random.Uniform(-5, 5), random.Uniform(-1.5, 1.5)), 1));
  config.robot.start[kDriftY] = random.Uniform(-1, 1);
  config.robot.start[kSpeed] = random.Uniform(9, 13);
}

// Ends a drive where the robot stands before the goal: a car does not stand still from one sample to the next.
class FirstStop final : public Node {
 public:
  explicit FirstStop(const Lockstep& lockstep) : lockstep_(lockstep) {}

  void Tick(std::int64_t now_us) override {
    if (now_us < next_us_) return;
    next_us_ = now_us + 50'000;
    has_stopped_ = CountsOf(lockstep_).stops > 0;
  }
  [[nodiscard]] bool done() const override { return has_stopped_; }

 private:
  const Lockstep& lockstep_;
  std::int64_t next_us_ = 0;
  bool has_stopped_ = false;
};

Cells Row(const std::string& name, const DriftDrives& all) {
  const DriveCounts& counts = all.counts;
  std::string causes;
  for (const auto& [cause, count] : counts.abstained)
    causes += (causes.empty() ? "" : ", ") + cause + " " + std::to_string(count);
  return {name,
          std::to_string(counts.goals) + " of " + std::to_string(counts.drives),
          std::to_string(counts.contacts),
          std::to_string(counts.limits),
          std::to_string(counts.outside) + " of " + std::to_string(counts.steps),
          std::to_string(counts.certified) + " of " + std::to_string(counts.proposed),
          Percent(counts.certified, counts.proposed),
          causes.empty() ? "none" : causes,
          std::to_string(counts.searches - counts.proposed),
          std::to_string(counts.lost_rounds) + " of " + std::to_string(counts.rounds),
          std::to_string(counts.stops),
          std::to_string(all.faulted),
          std::to_string(all.beyond_between)};
}

}  // namespace

void DriftCar::Step(std::span<const double> x, std::span<const double> u, std::span<double> next) {
  const Eigen::Map<const Eigen::VectorXd> measured(x.data(), std::ssize(x));
  if (!has_begun_ || x[kSpeed] != state_[kSpeed]) state_ = Rolling(x[kSpeed], x[kDelta]);  // or it was braked
  has_begun_ = true;
  state_.head(measured.size()) = measured;
  const DriftInput input(u[0], u[1]);
  const auto parts = std::lround(dt_ / kDriftStep);
  for (long i = 0; i < parts; ++i) {
    Note(input);
    state_ = Drift(state_, input, dt_ / static_cast<double>(parts), 1);
  }
  std::copy_n(state_.data(), next.size(), next.data());
}

void DriftCar::Note(const DriftInput& input) {
  const DriftState rate = DriftRate(state_, input);
  const double course = state_[kPsi] + state_[kBeta], along = rate[kSpeed],
               across = state_[kSpeed] * (rate[kPsi] + rate[kBeta]);
  const Eigen::Vector2d acceleration(along * std::cos(course) - across * std::sin(course),
                                     along * std::sin(course) + across * std::cos(course));
  Widen(most_, {acceleration.cwiseAbs(), std::abs(rate[kPsi]), std::abs(rate[kOmega]), 0});
}

DriftDrives DriveOnDrift(const std::string& task, int seed) {
  Config config = LoadConfig(task);
  config.planner.seed = seed;
  Draw(config, seed);
  DriftCar car(config.period);
  DriftDrives driven;
  Lockstep lockstep(config, config, kStartUs, [&](auto x, auto u, auto next, double) {
    car.Step(x, u, next);
    driven.most_lateral = std::max(driven.most_lateral, std::abs(next[kSpeed] * next[kOmega]));
  });
  FirstStop first_stop(lockstep);
  lockstep.Run(&first_stop);
  driven.counts = CountsOf(lockstep);
  driven.most = car.most();
  driven.beyond_between = !IsWithin(driven.most, *config.problem->between);
  driven.faulted = driven.counts.abstained.contains("pairwise") || driven.counts.abstained.contains("bound") ||
                   driven.counts.rejected.contains("fault");
  return driven;
}

std::string WriteDriveTask(const fs::path& directory, double factor) {
  const Problem problem = AboutTheWay(*OrdinaryDeclaration(factor).problem);
  fs::create_directories(directory);
  fs::copy_file(kNominalFile, directory / "drift-model.yaml", fs::copy_options::overwrite_existing);
  const std::string transitions = "drift-transitions.csv";
  SaveTransitions((directory / transitions).string(), *problem.model, problem.transitions);
  const fs::path task = directory / ("drift-task-" + Text("%g", factor) + ".yaml");
  WriteFile(task, Head(problem, transitions) + Read(kTaskFile));
  return task.string();
}

void RunDriftDrives(const DriftDriveOptions& options, std::ostream& out) {
  SilenceLog();
  std::vector<Cells> rows;
  DriftDrives most;
  for (const double factor : options.quick ? std::vector<double>{1.5} : std::vector<double>{1, 1.5, 2}) {
    const std::string task = WriteDriveTask(options.directory, factor), name = Text("largest times %g", factor);
    DriftDrives all;
    Progress progress("drives with w " + name, static_cast<std::size_t>(options.seeds));
    for (int seed = 1; seed <= options.seeds; ++seed) {
      const DriftDrives driven = DriveOnDrift(task, seed);
      all.counts += driven.counts;
      all.beyond_between += driven.beyond_between;
      all.faulted += driven.faulted;
      Widen(most.most, driven.most);
      most.most_lateral = std::max(most.most_lateral, driven.most_lateral);
      progress.Advance();
    }
    rows.push_back(Row(name, all));
  }
  const std::string report =
      "# The closed loop on CommonRoad's single-track drift model\n\nMade by `" + options.command + "`.\n" +
      Markdown({"w", "goals", "contacts", "limits exceeded", "steps outside their slices", "certified", "certified, %",
                "abstained", "searches without a candidate", "rounds without a certificate", "ended by a stop",
                "drives with a candidate refused for a contradiction or fault", "drives beyond between"},
               rows) +
      "\nThe largest in any drive: acceleration " + List(most.most.acceleration) + " m/s^2, turn rate " +
      Text("%.2f rad/s", most.most.turn_rate) + ", turn acceleration " +
      Text("%.2f rad/s^2", most.most.turn_acceleration) + ", v omega " + Text("%.2f m/s^2", most.most_lateral) + ".\n";
  out << report << std::flush;
  WriteFile(options.directory / "drift-drive.md", report);
}

}  // namespace forereach::research
