#include "research/drift/drift.h"

#include <algorithm>
#include <cmath>
#include <ostream>

#include "forereach/dynamics/text_model.h"
#include "forereach/residual/observations.h"
#include "identify/smallest_row.h"
#include "research/markdown.h"
#include "research/random.h"
#include "research/run_directory.h"
#include "task/model_file.h"

namespace forereach::research {
namespace {

constexpr const char* kNominalFile = FOREREACH_SOURCE_DIR "/config/models/single_track.yaml";
constexpr int kStates = 7, kInputs = 2;
const std::vector<int> kFelt{kDelta, kSpeed, kOmega, kBeta, kStates, kStates + 1};
constexpr double kFar = 1000, kSpin = 0.4;      // m and rad; rad of slip angle
constexpr double kSteering = 0.4;               // rad/s
constexpr double kBrake = -4, kThrottle = 2.5;  // m/s^2
constexpr double kWheelbase = 8.461 * 0.3048;   // m, of the driver

int StepsIn(double dt) { return static_cast<int>(std::lround(dt / kDriftStep)); }

// ---- drives

struct Asked {
  double speed = 0, lateral = 0, until = 0;
};

DriftInput Command(const DriftState& state, const Asked& asked, double dt) {
  const double speed = std::max(state[kSpeed], 1.0);
  const double delta = std::atan(kWheelbase * asked.lateral / (speed * speed));
  return {std::clamp((delta - state[kDelta]) / dt, -kSteering, kSteering),
          std::clamp(asked.speed - state[kSpeed], kBrake, kThrottle)};
}

Drive DriveOnce(const DrivesOptions& options, int number) {
  Random random{options.seed, static_cast<std::uint64_t>(number)};
  DriftState state = Rolling(random.Uniform(options.slowest, options.fastest));
  Asked asked;
  std::vector<DriftState> states{state};
  std::vector<DriftInput> inputs;
  for (double time = 0; time < options.seconds && std::abs(state[kBeta]) < kSpin; time += options.dt) {
    if (time >= asked.until)
      asked = {random.Uniform(options.slowest, options.fastest),
               random.Uniform(-options.most_lateral, options.most_lateral), time + random.Uniform(1, 3)};
    inputs.push_back(Command(state, asked, options.dt));
    state = Drift(state, inputs.back(), options.dt, StepsIn(options.dt));
    states.push_back(state);
  }
  const Eigen::Index count = std::ssize(inputs);
  Drive drive;
  drive.name = "drive " + std::to_string(number);
  drive.transitions = {Eigen::MatrixXd(count, kStates + kInputs), Eigen::MatrixXd(count, kStates)};
  for (Eigen::Index i = 0; i < count; ++i) {
    const auto at = static_cast<std::size_t>(i);
    drive.transitions.z.row(i) << states[at].head(kStates).transpose(), inputs[at].transpose();
    drive.transitions.x_next.row(i) = states[at + 1].head(kStates).transpose();
    drive.times.push_back(static_cast<double>(i) * options.dt);
  }
  drive.deviation = Eigen::VectorXd::Zero(kStates);
  return drive;
}

std::vector<Stretch> All(const std::vector<Drive>& drives) {
  std::vector<Stretch> all;
  for (const Drive& drive : drives) all.push_back(Whole(drive).front());
  return all;
}

// The largest v |omega| in the drives.
double LateralIn(const std::vector<Drive>& drives) {
  double most = 0;
  for (const Drive& drive : drives)
    most = std::max(
        most, drive.transitions.z.col(kSpeed).cwiseProduct(drive.transitions.z.col(kOmega)).cwiseAbs().maxCoeff());
  return most;
}

// ---- tables

const Cells kOutcome{"windows",
                     "complete, %",
                     "inside, %",
                     "half-width, m",
                     "largest, m",
                     "driven, m",
                     "contradictions, per thousand",
                     "outside the domain, %"};

Cells Outcome(const Judgement& judged) {
  const int windows = static_cast<int>(judged.windows.size());
  return {std::to_string(windows),
          Percent(judged.complete(), windows),
          Percent(judged.inside(), judged.slices()),
          Text("%.4f", judged.HalfWidth()),
          Text("%.4f", judged.LargestHalfWidth()),
          Text("%.2f", judged.Distance()),
          Text("%.1f", 1000.0 * judged.contradicting / std::max(1, judged.transitions)),
          Percent(judged.outside_domain, judged.outside_domain + judged.transitions)};
}

std::string Where(const Eigen::RowVectorXd& z) {
  return Text("v %.1f", z[kSpeed]) + Text(", v omega %.1f", z[kSpeed] * z[kOmega]) +
         Text(", steer_rate %.2f", z[kStates]) + Text(", a %.1f", z[kStates + 1]);
}

// ---- the study

constexpr std::uint64_t kLearnSeed = 1, kJudgeSeed = 2;
constexpr double kDt = kOrdinaryStep, kOrdinary = 3;  // s, m/s^2
constexpr int kShort = 5, kLong = 10;                 // steps of a window
constexpr double kSlip = 0.02;                        // of a wheel: what braking at 4 m/s^2 needs

struct Study {
  bool quick;

  [[nodiscard]] std::vector<Drive> Make(double most_lateral, std::uint64_t seed, double dt = kDt) const {
    return RandomDrives({.dt = dt, .most_lateral = most_lateral, .drives = quick ? 2 : 10, .seed = seed});
  }
};

Fitted AsItIs(const std::vector<Drive>& drives, double dt = kDt) {
  return Unfitted(SingleTrackProblem(dt), All(drives), kFelt);
}

std::string Name(const Fitted& fitted, int k) {
  return fitted.driving.model->variable_names()[static_cast<std::size_t>(k)];
}

// For each transition: its seven states with two random pairs of wheel speeds. Half the largest difference of the two
// successors is a lower bound of w, whatever L is.
struct Hidden {
  Eigen::VectorXd floor = Eigen::VectorXd::Zero(kStates), largest = Eigen::VectorXd::Zero(kStates);
};

Hidden DrawWheels(const Fitted& fitted) {
  Random random{3};
  Hidden hidden;
  const auto next = [&](const Eigen::RowVectorXd& z) -> Eigen::VectorXd {
    DriftState state = Rolling(z[kSpeed], z[kDelta]);
    state.head(kStates) = z.head(kStates).transpose();
    state[kFrontWheel] *= 1 - random.Uniform(-kSlip, kSlip);
    state[kRearWheel] *= 1 - random.Uniform(-kSlip, kSlip);
    return Drift(state, z.tail(kInputs).transpose(), kDt, StepsIn(kDt)).head(kStates);
  };
  for (int i = 0; i < fitted.transitions.size(); i += 4) {
    const Transitions both{fitted.transitions.z.row(i).replicate(2, 1), Eigen::MatrixXd(2, kStates)};
    Transitions drawn = both;
    for (int j = 0; j < 2; ++j) drawn.x_next.row(j) = next(both.z.row(j)).transpose();
    hidden.floor = hidden.floor.cwiseMax((drawn.x_next.row(0) - drawn.x_next.row(1)).cwiseAbs().transpose() / 2);
    hidden.largest =
        hidden.largest.cwiseMax(ErrorsOf(*fitted.driving.model, drawn).cwiseAbs().colwise().maxCoeff().transpose());
  }
  return hidden;
}

std::string OneStep(const Fitted& fitted) {
  const Hidden hidden = DrawWheels(fitted);
  std::vector<Cells> rows;
  for (int k = 0; k < kStates; ++k) {
    Eigen::Index at = 0;
    const auto errors = fitted.fit.after.col(k);
    const double largest = errors.cwiseAbs().maxCoeff(&at);
    rows.push_back({Name(fitted, k), Text("%.2g", std::sqrt(errors.squaredNorm() / static_cast<double>(errors.size()))),
                    Text("%.2g", largest), Where(fitted.transitions.z.row(at)), Text("%.2g", hidden.largest[k]),
                    Text("%.2g", hidden.floor[k])});
  }
  return Markdown({"state", "rms", "largest", "at", "largest with random wheels", "of that, w at least"}, rows);
}

// What slopes have to explain once w is the quantile: the steepest entry of each row, and the pair that asks for it.
std::string Slopes(const Fitted& fitted, const Learned& learned) {
  const Transitions& transitions = learned.problem->transitions;
  const Observations observations = Observe(*learned.problem->model, transitions);
  const Eigen::MatrixXd& slopes = learned.problem->declaration.lipschitz;
  std::vector<Cells> rows;
  for (int k = 0; k < kStates; ++k) {
    Eigen::Index steepest = 0;
    const double slope = slopes.row(k).maxCoeff(&steepest);
    if (slope == 0) continue;
    Eigen::RowVectorXd scales = Eigen::RowVectorXd::Constant(slopes.cols(), -1);
    scales[steepest] = 1;
    const SmallestRow row = FindSmallestRow(learned.problem->declaration, observations, k, scales);
    const auto& pair = row.reasons[static_cast<std::size_t>(steepest)];
    rows.push_back({Name(fitted, k), Text("%.2g", learned.problem->declaration.disturbance[k]), Text("%.3g", slope),
                    Name(fitted, static_cast<int>(steepest)),
                    pair ? Where(transitions.z.row(pair->first)) + "; " + Where(transitions.z.row(pair->second)) : ""});
  }
  return Markdown({"state", "w", "largest slope", "in", "pair"}, rows);
}

Learned WithDisturbanceTimes(const Learned& learned, double factor) {
  Learned scaled = learned;
  auto problem = std::make_shared<Problem>(*learned.problem);
  problem->declaration.disturbance *= factor;
  scaled.problem = problem;
  return scaled;
}

std::string Declarations(const Fitted& fitted, const std::vector<Drive>& judge, const Learned& with_slopes,
                         bool quick) {
  std::vector<Cells> rows;
  const auto add = [&](const std::string& w, const std::string& slopes, const Learned& learned) {
    for (const int steps : {kShort, kLong})
      rows.push_back(Join({w, slopes, std::to_string(steps)}, Outcome(Judge(learned, All(judge), steps))));
  };
  add("0.99 quantile", "0", Learn(fitted, {.quantile = 0.99}));
  const Learned all = Learn(fitted, {.quantile = 1});
  for (const double factor : quick ? std::vector<double>{1} : std::vector<double>{1, 1.5, 2})
    add("largest" + (factor > 1 ? Text(" times %g", factor) : ""), "0", WithDisturbanceTimes(all, factor));
  if (with_slopes.explained)
    for (const double factor : quick ? std::vector<double>{1} : std::vector<double>{1, 1.5})
      add("0.9 quantile", Text("smallest times %g", factor), WithSlopesTimes(with_slopes, factor));
  return Markdown(Join({"w", "L", "steps"}, kOutcome), rows);
}

std::string Limits(const Study& study, const Fitted& ordinary) {
  std::vector<Cells> rows;
  for (const double lateral : study.quick ? std::vector<double>{9} : std::vector<double>{3, 5, 7, 9, 11}) {
    const std::vector<Drive> judge = study.Make(lateral, kJudgeSeed);
    const Learned narrow = Learn(ordinary, {.quantile = 1}),
                  wide = Learn(ordinary, {.quantile = 1, .domain_of = All(judge)});
    const Judgement in_domain = Judge(narrow, All(judge), kLong), beyond = Judge(wide, All(judge), kLong);
    const Fitted own = AsItIs(study.Make(lateral, kLearnSeed));
    const Learned relearned = Learn(own, {.quantile = 1});
    const Judgement again = Judge(relearned, All(judge), kLong);
    const Eigen::VectorXd& w = relearned.problem->declaration.disturbance;
    rows.push_back({Text("%g", lateral), Text("%.1f", LateralIn(judge)),
                    Percent(in_domain.outside_domain, in_domain.outside_domain + in_domain.transitions),
                    Text("%.1f", 1000.0 * beyond.contradicting / std::max(1, beyond.transitions)),
                    Percent(beyond.inside(), beyond.slices()), Text("%.2g", w[kSpeed]), Text("%.2g", w[kOmega]),
                    Text("%.2g", w[kBeta]), Text("%.3f", again.HalfWidth())});
  }
  return Markdown({"asked, m/s^2", "reached", "outside the domain, %", "contradictions with its domain, per thousand",
                   "inside, %", "relearned: w of v", "of omega", "of beta", "half-width, m"},
                  rows);
}

std::string Steps(const Study& study) {
  std::vector<Cells> rows;
  for (const double dt : study.quick ? std::vector<double>{kDt} : std::vector<double>{0.02, 0.05, 0.1}) {
    const Learned learned = Learn(AsItIs(study.Make(kOrdinary, kLearnSeed, dt), dt), {.quantile = 1});
    const Eigen::VectorXd& w = learned.problem->declaration.disturbance;
    rows.push_back(Join({Text("%g", dt), Text("%.2g", w[kDriftX]), Text("%.2g", w[kSpeed]), Text("%.2g", w[kOmega]),
                         Text("%.2g", w[kBeta])},
                        Outcome(Judge(learned, All(study.Make(kOrdinary, kJudgeSeed, dt)), kLong))));
  }
  return Markdown(Join({"dt, s", "w of x", "of v", "of omega", "of beta"}, kOutcome), rows);
}

// The largest difference that half the step makes, in one step of any transition from rolling wheels.
std::string Halved(const Fitted& fitted) {
  Eigen::VectorXd most = Eigen::VectorXd::Zero(9);
  for (int i = 0; i < fitted.transitions.size(); i += 20) {
    const Eigen::VectorXd z = fitted.transitions.z.row(i);
    DriftState state = Rolling(z[kSpeed], z[kDelta]);
    state.head(kStates) = z.head(kStates);
    const DriftInput input = z.tail(kInputs);
    most =
        most.cwiseMax((Drift(state, input, kDt, StepsIn(kDt)) - Drift(state, input, kDt, 2 * StepsIn(kDt))).cwiseAbs());
  }
  return Text("%.1g", most.head(kStates).maxCoeff());
}

}  // namespace

std::vector<Drive> RandomDrives(const DrivesOptions& options) {
  std::vector<Drive> drives;
  for (int i = 0; i < options.drives; ++i) drives.push_back(DriveOnce(options, i));
  return drives;
}

Problem SingleTrackProblem(double dt) {
  ModelText text = LoadModelFile(kNominalFile);
  for (ModelText::Parameter& parameter : text.parameters)
    if (parameter.name == "dt") parameter.lower = parameter.upper = dt;
  Problem problem;
  problem.model = MakeTextModel(text);
  const Eigen::VectorXd upper{{kFar, kFar, 1, 50, kFar, 5, 1}}, input{{kSteering, 11.5}};
  Eigen::VectorXd lower = -upper;
  lower[kSpeed] = 1;
  problem.domain.state = Box(lower, upper);
  problem.domain.input = Box(-input, input);
  problem.declaration = {Eigen::MatrixXd::Zero(kStates, kStates + kInputs), Eigen::VectorXd::Zero(kStates),
                         Eigen::VectorXd::Zero(kStates)};
  problem.projection = Eigen::MatrixXd::Identity(2, kStates);
  return problem;
}

Learned OrdinaryDeclaration(double factor) {
  const Study study{false};
  return WithDisturbanceTimes(Learn(AsItIs(study.Make(kOrdinary, kLearnSeed)), {.quantile = 1}), factor);
}

void RunDrift(const DriftOptions& options, std::ostream& out) {
  const Study study{options.quick};
  const std::vector<Drive> learn = study.Make(kOrdinary, kLearnSeed), judge = study.Make(kOrdinary, kJudgeSeed);
  const Fitted fitted = AsItIs(learn);
  const Learned slopes = Learn(fitted, {.quantile = 0.9, .slopes = true});
  const std::string report =
      "# CommonRoad's single-track drift model\n\nMade by `" + options.command + "`. Learned from " +
      std::to_string(fitted.transitions.size()) + " steps of " + Text("%g s", kDt) + ", at most " +
      Text("%.2f m/s^2", LateralIn(learn)) + " sideways. Half the step of " + Text("%g s", kDriftStep) +
      " in the integration changes a state by at most " + Halved(fitted) +
      ".\n\nA declaration that was learned from drives is an assumption.\n\n## One-step errors\n" + OneStep(fitted) +
      "\n## Slopes\n" + (slopes.explained ? Slopes(fitted, slopes) : "None explain the errors.\n") +
      "\n## Declarations on fresh drives\n" + Declarations(fitted, judge, slopes, study.quick) +
      "\n## Up to the limit of the tyres\n" + Limits(study, fitted) + "\n## Against dt\n" + Steps(study);
  out << report << std::flush;
  std::filesystem::create_directories(options.directory);
  WriteFile(options.directory / "drift.md", report);
}

}  // namespace forereach::research
