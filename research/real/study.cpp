#include "research/real/study.h"

#include <algorithm>
#include <cmath>

#include "forereach/certify/certifier.h"
#include "forereach/dynamics/text_model.h"
#include "forereach/numerics/limits.h"
#include "forereach/numerics/size.h"
#include "identify/hold_out.h"
#include "identify/noise_floor.h"
#include "identify/smallest_row.h"
#include "task/model_file.h"

namespace forereach::research {

const char* const kModelFile = FOREREACH_SOURCE_DIR "/research/real/car.yaml";

namespace {

constexpr double kBlock = 10, kStep = 0.1;  // s
constexpr double kWall = 0.05;              // m, thickness of a corridor's walls

// Coordinates of z in car.yaml.
enum Coordinate { kX, kY, kYaw, kV, kR, kBefore, kSteer, kThrottle };

// A limit on place and heading that no drive reaches; an error that covers the rounding of a mean of commands.
constexpr double kFar = 1000, kRounding = 1e-9;

constexpr double kSlowest = 1, kFastest = 10, kSharpest = 20;  // m/s, m/s, rad/s
constexpr double kPower = 0.2;                                 // throttle below which the car brakes

Transitions Gather(const std::vector<Stretch>& stretches, const Domain* domain) {
  std::vector<Eigen::RowVectorXd> z, next;
  for (const Stretch& stretch : stretches)
    for (int i = stretch.begin; i < stretch.end; ++i) {
      const Eigen::VectorXd location = stretch.drive->transitions.z.row(i);
      if (domain && !domain->Contains({location.data(), ToSize(location.size())})) continue;
      z.emplace_back(location.transpose());
      next.emplace_back(stretch.drive->transitions.x_next.row(i));
    }
  Transitions all;
  if (z.empty()) return all;
  all = {Eigen::MatrixXd(std::ssize(z), z.front().size()), Eigen::MatrixXd(std::ssize(z), next.front().size())};
  for (std::size_t i = 0; i < z.size(); ++i) {
    all.z.row(static_cast<Eigen::Index>(i)) = z[i];
    all.x_next.row(static_cast<Eigen::Index>(i)) = next[i];
  }
  return all;
}

Transitions RowsAt(const Transitions& transitions, const std::vector<int>& rows) {
  return {transitions.z(rows, Eigen::all), transitions.x_next(rows, Eigen::all)};
}

Transitions Thinned(const Transitions& transitions, int most) {
  if (most <= 0 || most >= transitions.size()) return transitions;
  std::vector<int> rows;
  rows.reserve(ToSize(most));
  for (int i = 0; i < most; ++i)
    rows.push_back(static_cast<int>(static_cast<std::int64_t>(i) * transitions.size() / most));
  return RowsAt(transitions, rows);
}

Domain CoveredBy(const Domain& driving, const Transitions& transitions, const std::vector<int>& felt) {
  Eigen::VectorXd lower = driving.state.lower(), upper = driving.state.upper();
  for (const int k : felt) {
    if (k >= lower.size()) continue;
    const double low = transitions.z.col(k).minCoeff(), high = transitions.z.col(k).maxCoeff();
    lower[k] = low - (high - low) / 10;
    upper[k] = high + (high - low) / 10;
  }
  Domain covered = driving;
  covered.state = Box(lower, upper);
  const auto inputs = transitions.z.rightCols(driving.input.lower().size());
  covered.input = Box(inputs.colwise().minCoeff(), inputs.colwise().maxCoeff());
  return covered;
}

ModelText WithParameters(ModelText text, const Fit& fit) {
  for (const FittedParameter& fitted : fit.parameters)
    for (ModelText::Parameter& parameter : text.parameters)
      if (parameter.name == fitted.name) parameter.lower = parameter.upper = fitted.after;
  return text;
}

// Fitted twice: the second fit weighs each state by what the first one left of its errors.
Fit FitTwice(const ModelText& text, const Transitions& transitions) {
  std::vector<std::string> names;
  for (const ModelText::Parameter& parameter : text.parameters)
    if (parameter.name != "dt") names.push_back(parameter.name);
  const Fit first = FitParameters(text, transitions, names);
  Fit second = FitParameters(WithParameters(text, first), transitions, names);
  second.before = first.before;
  for (std::size_t p = 0; p < names.size(); ++p) second.parameters[p].before = first.parameters[p].before;
  return second;
}

double Quantile(std::vector<double> values, double share) {
  const auto last = static_cast<double>(values.size() - 1);
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(std::ceil(share * last));
  std::ranges::nth_element(values, at);
  return *at;
}

Eigen::VectorXd QuantilesOf(const Eigen::MatrixXd& errors, double share) {
  Eigen::VectorXd quantiles(errors.cols());
  for (Eigen::Index k = 0; k < errors.cols(); ++k) {
    const Eigen::VectorXd sizes = errors.col(k).cwiseAbs();
    quantiles[k] = Quantile({sizes.begin(), sizes.end()}, share);
  }
  return quantiles;
}

Eigen::VectorXd StateErrorOf(const std::vector<Stretch>& stretches) {
  Eigen::VectorXd largest;
  for (const Stretch& stretch : stretches)
    largest = largest.size() == 0 ? Eigen::VectorXd(3 * stretch.drive->deviation)
                                  : largest.cwiseMax(3 * stretch.drive->deviation);
  return largest;
}

std::vector<int> RowsWithin(const Eigen::MatrixXd& errors, const Eigen::VectorXd& bound) {
  std::vector<int> rows;
  for (Eigen::Index i = 0; i < errors.rows(); ++i)
    if ((errors.row(i).transpose().cwiseAbs().array() <= bound.array()).all()) rows.push_back(static_cast<int>(i));
  return rows;
}

// The smallest slopes; false if there are none.
bool SetSlopes(Declaration& declaration, const NominalModel& model, const Transitions& transitions,
               const std::vector<int>& felt) {
  const Observations observations = Observe(model, transitions);
  const Eigen::RowVectorXd all = ScalesOf(observations);
  Eigen::RowVectorXd scales = Eigen::RowVectorXd::Constant(all.size(), -1);
  for (const int l : felt)
    if (all[l] > 0) scales[l] = all[l];
  for (int k = 0; k < static_cast<int>(transitions.x_next.cols()); ++k) {
    const SmallestRow row = FindSmallestRow(declaration, observations, k, scales);
    if (row.unexplained) return false;
    declaration.lipschitz.row(k) = row.slopes;
  }
  return true;
}

Eigen::VectorXd EpsilonOf(const Declaration& declaration) {
  Eigen::VectorXd epsilon(declaration.noise_bound.size());
  for (Eigen::Index k = 0; k < epsilon.size(); ++k) epsilon[k] = declaration.ObservationError(k);
  return epsilon;
}

// ---- judging

int CountContradicting(const Problem& problem, const Transitions& judged) {
  Problem both = problem;
  const int learned = problem.transitions.size(), count = learned + judged.size();
  both.transitions.z.conservativeResize(count, Eigen::NoChange);
  both.transitions.x_next.conservativeResize(count, Eigen::NoChange);
  both.transitions.z.bottomRows(judged.size()) = judged.z;
  both.transitions.x_next.bottomRows(judged.size()) = judged.x_next;
  return CountContradictions(both, both.declaration, {{{0, learned}}, {{learned, count}}}).contradicting;
}

// Walls to both sides of a path, each a piece a step, straight between the samples.
std::vector<Obstacle> CorridorAbout(const Eigen::Matrix2Xd& path, double half_width) {
  std::vector<Obstacle> walls;
  for (const double side : {1.0, -1.0})
    for (Eigen::Index t = 0; t + 1 < path.cols(); ++t) {
      const auto place = [&](Eigen::Index at, double away) -> Eigen::VectorXd {
        const Eigen::Vector2d ahead =
            (path.col(std::min(at + 1, path.cols() - 1)) - path.col(std::max<Eigen::Index>(at - 1, 0))).normalized();
        return path.col(at) + side * away * Eigen::Vector2d(-ahead[1], ahead[0]);
      };
      walls.push_back(Obstacle::Polygon({place(t, half_width), place(t + 1, half_width),
                                         place(t + 1, half_width + kWall), place(t, half_width + kWall)}));
    }
  return walls;
}

WindowResult JudgeWindow(const Certifier& certifier, const Learned& learned, const Transitions& judged,
                         const Window& window, Tube& tube) {
  const int steps = window.steps, count = static_cast<int>(judged.x_next.cols()),
            inputs = static_cast<int>(judged.z.cols()) - count;
  Eigen::MatrixXd states(count, steps + 1);
  states.leftCols(steps) = judged.z.block(window.begin, 0, steps, count).transpose();
  states.col(steps) = judged.x_next.row(window.begin + steps - 1);
  const Eigen::MatrixXd controls = judged.z.block(window.begin, count, steps, inputs).transpose();
  const Plan plan{controls.data(), inputs, steps, inputs};
  const Zonotope start = Zonotope::FromBox(states.col(0), learned.state_error);

  WindowResult result;
  result.path = states.topRows(2);
  certifier.Require(plan, start, {});
  result.complete = certifier.Certify(plan, start, {}, tube).outcome == Outcome::kCertified;
  result.center.resize(2, tube.length() + 1);
  result.half_width.resize(2, tube.length() + 1);
  for (int t = 0; t <= tube.length(); ++t) {
    bool in = true;
    for (int k = 0; k < count; ++k) {
      const Interval hull = tube.hull(t, k);
      const double x = states(k, t), error = learned.state_error[k] + kRounding;
      in &= hull.lower - error <= x && x <= hull.upper + error;
    }
    result.inside += t > 0 && in;
    for (int k = 0; k < 2; ++k) {
      result.center(k, t) = tube.slice(t).center(k);
      result.half_width(k, t) = tube.half_width(t)[ToSize(k)];
    }
  }
  for (const double half_width : kCorridors) {
    const std::vector<Obstacle> walls = CorridorAbout(result.path, half_width);
    certifier.Require(plan, start, walls);
    result.certified.push_back(certifier.Certify(plan, start, walls, tube).outcome == Outcome::kCertified);
  }
  return result;
}

}  // namespace

Eigen::MatrixXd ErrorsOf(const NominalModel& model, const Transitions& transitions) {
  const Eigen::Index states = transitions.x_next.cols();
  Eigen::MatrixXd errors(transitions.size(), states);
  Eigen::VectorXd z, next(states);
  for (Eigen::Index i = 0; i < errors.rows(); ++i) {
    z = transitions.z.row(i);
    model.Evaluate({z.data(), ToSize(z.size())}, {next.data(), ToSize(next.size())});
    errors.row(i) = transitions.x_next.row(i) - next.transpose();
  }
  return errors;
}

Problem DrivingProblem(double most_change) {
  Problem problem;
  problem.model = MakeTextModel(LoadModelFile(kModelFile));
  const Eigen::VectorXd state{{kFar, kFar, kFar, kFastest, kSharpest, 1}}, steer{{-1, kPower}};
  Eigen::VectorXd lowest = -state;
  lowest[kV] = kSlowest;
  problem.domain.state = Box(lowest, state);
  problem.domain.input = Box(steer, Eigen::VectorXd::Ones(2));
  for (const double sign : {1.0, -1.0}) {
    Eigen::VectorXd change = Eigen::VectorXd::Zero(8);
    change[kSteer] = sign;
    change[kBefore] = -sign;
    problem.domain.inequalities.push_back({change, most_change + kRounding});
  }
  problem.declaration = {Eigen::MatrixXd::Zero(6, 8), Eigen::VectorXd::Zero(6), Eigen::VectorXd::Zero(6)};
  problem.projection = Eigen::MatrixXd::Identity(2, 6);
  return problem;
}

std::vector<Stretch> Blocks(const Drive& drive, bool odd) {
  std::vector<Stretch> blocks;
  const auto block_of = [](double time) { return std::floor((time + 1e-6) / kBlock); };
  for (int i = 0; i < std::ssize(drive.times); ++i) {
    const double time = drive.times[ToSize(i)], block = block_of(time);
    const bool across = block_of(time + kStep - 2e-6) != block;
    if ((std::fmod(block, 2) == 1) != odd || across) continue;
    if (!blocks.empty() && blocks.back().end == i)
      ++blocks.back().end;
    else
      blocks.push_back({&drive, i, i + 1});
  }
  return blocks;
}

std::vector<Stretch> Whole(const Drive& drive) { return {{&drive, 0, drive.transitions.size()}}; }

Fitted Unfitted(const Problem& driving, const std::vector<Stretch>& stretches, std::vector<int> felt) {
  Fitted fitted{driving, Gather(stretches, &driving.domain), {}, StateErrorOf(stretches), std::move(felt)};
  if (fitted.transitions.size() == 0) throw std::invalid_argument("there are no transitions to learn from");
  fitted.fit.before = fitted.fit.after = ErrorsOf(*driving.model, fitted.transitions);
  return fitted;
}

Fitted FitTo(const Problem& driving, const std::vector<Stretch>& stretches, int most) {
  Fitted fitted{driving,
                Thinned(Gather(stretches, &driving.domain), most),
                {},
                StateErrorOf(stretches),
                {kV, kR, kBefore, kSteer, kThrottle}};
  if (fitted.transitions.size() == 0) throw std::invalid_argument("there are no transitions to learn from");
  fitted.fit = FitTwice(*driving.model->text(), fitted.transitions);
  fitted.driving.model = MakeTextModel(WithParameters(*driving.model->text(), fitted.fit));
  return fitted;
}

Learned Learn(const Fitted& fitted, const LearnOptions& options) {
  const Transitions& all = fitted.transitions;
  auto problem = std::make_shared<Problem>(fitted.driving);
  problem->domain = CoveredBy(
      problem->domain, options.domain_of.empty() ? all : Gather(options.domain_of, &problem->domain), fitted.felt);
  Declaration& declaration = problem->declaration;
  declaration.noise_bound = fitted.state_error.array() + kRounding;
  declaration.disturbance = (QuantilesOf(fitted.fit.after, options.quantile) - declaration.noise_bound).cwiseMax(0);
  problem->transitions = all;
  Learned learned{problem, all.size(), 0, fitted.state_error, true};
  if (options.slopes) {
    learned.explained = SetSlopes(declaration, *problem->model, all, fitted.felt);
  } else {
    problem->transitions = RowsAt(all, RowsWithin(fitted.fit.after, EpsilonOf(declaration)));
    learned.left_out = all.size() - problem->transitions.size();
  }
  return learned;
}

Learned WithSlopesTimes(const Learned& learned, double factor) {
  auto problem = std::make_shared<Problem>(*learned.problem);
  problem->declaration.lipschitz *= factor;
  Learned scaled = learned;
  scaled.problem = problem;
  return scaled;
}

void Judgement::Add(const Judgement& other) {
  transitions += other.transitions;
  outside_domain += other.outside_domain;
  contradicting += other.contradicting;
  beyond += other.beyond;
  windows.insert(windows.end(), other.windows.begin(), other.windows.end());
}

int Judgement::slices() const {
  int count = 0;
  for (const WindowResult& window : windows) count += static_cast<int>(window.center.cols()) - 1;
  return count;
}

int Judgement::inside() const {
  int count = 0;
  for (const WindowResult& window : windows) count += window.inside;
  return count;
}

int Judgement::complete() const { return static_cast<int>(std::ranges::count(windows, true, &WindowResult::complete)); }

int Judgement::certified(std::size_t corridor) const {
  int count = 0;
  for (const WindowResult& window : windows) count += window.certified[corridor];
  return count;
}

std::optional<double> Judgement::HalfWidth() const {
  std::vector<double> widths;
  for (const WindowResult& window : windows)
    widths.push_back(window.complete ? window.half_width.col(steps).maxCoeff() : kInfinity);
  if (widths.empty()) return std::nullopt;
  return Quantile(widths, 0.5);
}

std::optional<double> Judgement::LargestHalfWidth() const {
  std::optional<double> largest;
  for (const WindowResult& window : windows)
    if (window.complete) largest = std::max(largest.value_or(0), window.half_width.col(steps).maxCoeff());
  return largest;
}

std::optional<double> Judgement::Distance() const {
  std::vector<double> distances;
  for (const WindowResult& window : windows) {
    double sum = 0;
    for (int t = 0; t < steps; ++t) sum += (window.path.col(t + 1) - window.path.col(t)).norm();
    distances.push_back(sum);
  }
  if (distances.empty()) return std::nullopt;
  return Quantile(distances, 0.5);
}

Judgement Judge(const Learned& learned, const std::vector<Stretch>& stretches, int steps) {
  const Problem& problem = *learned.problem;
  const Transitions judged = Gather(stretches, &problem.domain);
  Judgement judgement;
  judgement.steps = steps;
  judgement.transitions = judged.size();
  judgement.outside_domain = Gather(stretches, nullptr).size() - judged.size();
  if (judged.size() == 0) return judgement;
  judgement.beyond =
      judged.size() -
      static_cast<int>(std::ssize(RowsWithin(ErrorsOf(*problem.model, judged), EpsilonOf(problem.declaration))));
  judgement.contradicting = CountContradicting(problem, judged);
  const Certifier certifier(learned.problem);
  Tube tube;
  for (const Window& window : WindowsOf(judged, {{}, {{0, judged.size()}}}, steps))
    judgement.windows.push_back(JudgeWindow(certifier, learned, judged, window, tube));
  return judgement;
}

}  // namespace forereach::research
