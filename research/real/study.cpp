#include "research/real/study.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include <Eigen/QR>

#include "forereach/certify/certifier.h"
#include "forereach/certify/tube.h"
#include "forereach/dynamics/text_model.h"
#include "forereach/numerics/size.h"
#include "forereach/numerics/text.h"
#include "forereach/residual/growing_disturbance.h"
#include "identify/calm_regions.h"
#include "identify/hold_out.h"
#include "identify/noise_floor.h"
#include "identify/proposal.h"
#include "identify/smallest_row.h"
#include "task/model_file.h"

namespace forereach::research {

const char* const kModelFile = FOREREACH_SOURCE_DIR "/research/real/car.yaml";

namespace {

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

std::vector<int> EndsOf(const std::vector<Stretch>& stretches, const Domain* domain) {
  std::vector<int> ends;
  int count = 0;
  for (std::size_t i = 0; i < stretches.size(); ++i) {
    count += Gather({stretches[i]}, domain).size();
    if (i + 1 == stretches.size() || stretches[i + 1].drive != stretches[i].drive) ends.push_back(count);
  }
  return ends;
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

void DeclareStateError(Declaration& declaration, const Fitted& fitted) {
  declaration.state_error = fitted.state_error;
  declaration.noise_bound.setConstant(fitted.state_error.size(), kRounding);
}

// What a growing disturbance grows with, of z in car.yaml.
constexpr const char* kHasty = "abs(v*(steer - before))";
double HastyIn(const Eigen::RowVectorXd& z) { return z[kV] * std::abs(z[kSteer] - z[kBefore]); }

// The line a + b t, a and b not negative, that fits best.
Eigen::Vector2d LineThrough(const Eigen::VectorXd& t, const Eigen::VectorXd& values) {
  const double mean_t = t.mean(), mean = values.mean(), spread = (t.array() - mean_t).square().sum();
  const double b = spread > 0 ? ((t.array() - mean_t) * (values.array() - mean)).sum() / spread : 0;
  if (!(b > 0)) return {mean, 0};
  if (mean - b * mean_t >= 0) return {mean - b * mean_t, b};
  return {0, t.dot(values) / t.squaredNorm()};
}

// s_k a_k and s_k b_k.
std::pair<Eigen::VectorXd, Eigen::VectorXd> GrowingWith(const Fitted& fitted, double quantile) {
  const Eigen::MatrixXd errors = fitted.fit.after.cwiseAbs();
  const Eigen::Index states = errors.cols();
  Eigen::VectorXd hasty(errors.rows());
  for (Eigen::Index i = 0; i < hasty.size(); ++i) hasty[i] = HastyIn(fitted.transitions.z.row(i));
  Eigen::VectorXd base(states), growth(states);
  for (Eigen::Index k = 0; k < states; ++k) {
    const Eigen::Vector2d line = LineThrough(hasty, errors.col(k));
    double factor = 0;
    int begin = 0;
    for (const int end : fitted.ends) {
      std::vector<double> needed;
      for (int i = begin; i < end; ++i) {
        const double more = errors(i, k) - fitted.state_error[k], at = line[0] + line[1] * hasty[i];
        needed.push_back(more > 0 && at > 0 ? more / at : 0);
      }
      if (!needed.empty()) factor = std::max(factor, Quantile(std::move(needed), quantile));
      begin = end;
    }
    base[k] = factor * line[0];
    growth[k] = factor * line[1];
  }
  for (Eigen::VectorXd* const part : {&base, &growth}) part->head(2).setConstant(part->head(2).maxCoeff());
  return {base, growth};
}

// The transitions that do not contradict a residual of zero.
std::vector<int> RowsWithoutResidual(const Problem& problem) {
  const Observations seen = Observe(*problem.model, problem.declaration, problem.transitions);
  const Eigen::ArrayXd error = EpsilonOf(problem.declaration);
  std::vector<int> rows;
  for (int i = 0; i < seen.size(); ++i)
    if ((seen.lower.row(i).transpose().array() <= error && seen.upper.row(i).transpose().array() >= -error).all())
      rows.push_back(i);
  return rows;
}

void KeepOnly(const std::vector<int>& rows, Problem& problem) {
  problem.transitions = RowsAt(problem.transitions, rows);
}

// Less disturbance in regions; x and y have one there, too.
void Calm(Problem& problem, const std::vector<int>& felt, const LearnOptions& options) {
  const Observations seen = Observe(*problem.model, problem.declaration, problem.transitions);
  for (CalmRegion& calm :
       FindCalmRegions(problem.declaration, seen, felt, {.most_cells = options.cells, .factor = options.calm_factor})) {
    calm.region.disturbance.head(2).setConstant(calm.region.disturbance.head(2).maxCoeff());
    problem.declaration.regions.push_back(std::move(calm.region));
  }
}

void DeclareAffine(Problem& problem, const std::vector<int>& felt) {
  constexpr double kLeast = 1e-6;  // a slope that counts has to be declared
  Declaration& declaration = problem.declaration;
  const Observations seen = Observe(*problem.model, declaration, problem.transitions);
  Eigen::MatrixXd phi(seen.size(), std::ssize(felt) + 1);
  phi << seen.z(Eigen::all, felt), Eigen::VectorXd::Ones(seen.size());
  const Eigen::MatrixXd planes = phi.colPivHouseholderQr().solve((seen.lower + seen.upper) / 2);
  declaration.affine = {{kYaw, kV, kR}, felt};
  for (const int k : declaration.affine.rows)
    for (std::size_t j = 0; j < felt.size(); ++j)
      if (declaration.VariableError(felt[j]) > 0)
        declaration.lipschitz(k, felt[j]) = std::max(2 * std::abs(planes(static_cast<Eigen::Index>(j), k)), kLeast);
}

// ---- judging

// Whether transition i begins where the one before it ends.
bool Follows(const Transitions& steps, int i) {
  return steps.z.row(i).head(steps.x_next.cols()) == steps.x_next.row(i - 1);
}

int CountContradicting(const Problem& problem, const Transitions& judged) {
  Problem both = problem;
  const int learned = problem.transitions.size(), count = learned + judged.size();
  both.transitions.z.conservativeResize(count, Eigen::NoChange);
  both.transitions.x_next.conservativeResize(count, Eigen::NoChange);
  both.transitions.z.bottomRows(judged.size()) = judged.z;
  both.transitions.x_next.bottomRows(judged.size()) = judged.x_next;
  return CountContradictions(both, both.declaration, {{{0, learned}}, {{learned, count}}}).contradicting;
}

WindowResult JudgeWindow(const Certifier& certifier, const Learned& learned, const Transitions& judged,
                         const HoldOutWindow& window, Tube& tube) {
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

Problem DrivingProblem() {
  Problem problem;
  problem.model = MakeTextModel(LoadModelFile(kModelFile));
  const Eigen::VectorXd state{{kFar, kFar, kFar, kFastest, kSharpest, 1}}, steer{{-1, kPower}};
  Eigen::VectorXd lowest = -state;
  lowest[kV] = kSlowest;
  problem.domain.state = Box(lowest, state);
  problem.domain.input = Box(steer, Eigen::VectorXd::Ones(2));
  problem.declaration = {Eigen::MatrixXd::Zero(6, 8), Eigen::VectorXd::Zero(6), Eigen::VectorXd::Zero(6)};
  problem.projection = Eigen::MatrixXd::Identity(2, 6);
  return problem;
}

std::vector<Stretch> Whole(const Drive& drive) { return {{&drive, 0, drive.transitions.size()}}; }

Fitted Unfitted(const Problem& driving, const std::vector<Stretch>& stretches, std::vector<int> felt) {
  Fitted fitted{driving,         Gather(stretches, &driving.domain), {}, StateErrorOf(stretches),
                std::move(felt), EndsOf(stretches, &driving.domain)};
  if (fitted.transitions.size() == 0) throw std::invalid_argument("there are no transitions to learn from");
  fitted.fit.before = fitted.fit.after = ErrorsOf(*driving.model, fitted.transitions);
  return fitted;
}

Fitted FitTo(const Problem& driving, const std::vector<Stretch>& stretches) {
  Fitted fitted{driving,
                Gather(stretches, &driving.domain),
                {},
                StateErrorOf(stretches),
                {kV, kR, kBefore, kSteer, kThrottle},
                EndsOf(stretches, &driving.domain)};
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
  Learned learned{problem, all.size(), 0, fitted.state_error, true};
  Declaration& declaration = problem->declaration;
  problem->transitions = all;
  if (options.growing) {
    DeclareStateError(declaration, fitted);
    std::tie(declaration.disturbance, learned.growth) = GrowingWith(fitted, options.quantile);
    std::vector<ExpressionText> bounds;
    for (const double growth : learned.growth) bounds.push_back({ToText(growth) + "*" + kHasty});
    declaration.growing = std::make_shared<const GrowingDisturbance>(*problem->model, std::move(bounds));
    KeepOnly(RowsWithoutResidual(*problem), *problem);
    if (options.cells > 1) Calm(*problem, fitted.felt, options);
    if (options.affine) DeclareAffine(*problem, fitted.felt);
  } else {
    declaration.noise_bound = fitted.state_error.array() + kRounding;
    declaration.disturbance = (QuantilesOf(fitted.fit.after, options.quantile) - declaration.noise_bound).cwiseMax(0);
    if (options.slopes)
      learned.explained = SetSlopes(declaration, *problem->model, all, fitted.felt);
    else
      KeepOnly(RowsWithin(fitted.fit.after, EpsilonOf(declaration)), *problem);
  }
  learned.left_out = all.size() - problem->transitions.size();
  return learned;
}

std::optional<Refutation> RefuteAffine(const Fitted& fitted, const Learned& affine, int k, bool disturbed) {
  Declaration declaration = affine.problem->declaration;
  if (!disturbed) declaration.disturbance.setZero(), declaration.growing.reset();
  return forereach::RefuteAffine(declaration, Observe(*affine.problem->model, declaration, fitted.transitions), k,
                                 affine.problem->domain);
}

Learned Proposed(const Fitted& fitted) {
  auto problem = std::make_shared<Problem>(fitted.driving);
  problem->domain = CoveredBy(problem->domain, fitted.transitions, fitted.felt);
  problem->transitions = fitted.transitions;
  DeclareStateError(problem->declaration, fitted);
  ProposalOptions options;
  options.estimate_disturbance = true;
  options.columns.assign(ToSize(fitted.transitions.x_next.cols()), fitted.felt);
  problem->declaration =
      Propose(problem->declaration, ObserveForProposal(*problem, problem->transitions), options).declaration;
  return {problem, problem->transitions.size(), 0, fitted.state_error, true};
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
  judgement.contradicting = CountContradicting(problem, judged);
  const Certifier certifier(learned.problem);
  Tube tube;
  for (const HoldOutWindow& window : WindowsOf(judged, {{}, {{0, judged.size()}}}, steps))
    judgement.windows.push_back(JudgeWindow(certifier, learned, judged, window, tube));
  return judgement;
}

std::vector<HiddenState> HiddenStates(const Fitted& fitted, const Drive& drive) {
  const Transitions& steps = drive.transitions;
  const Eigen::MatrixXd errors = ErrorsOf(*fitted.driving.model, steps);
  std::vector<int> rows;
  for (int i = 1; i + 1 < steps.size(); ++i)
    if (Follows(steps, i) && Follows(steps, i + 1)) rows.push_back(i);
  const auto count = std::ssize(rows);
  Eigen::MatrixXd hidden(count, 5);
  for (Eigen::Index j = 0; j < count; ++j) {
    const int i = rows[ToSize(j)];
    const auto z = steps.z.row(i), last = steps.z.row(i - 1);
    const double aside = (z[kY] - last[kY]) * std::cos(z[kYaw]) - (z[kX] - last[kX]) * std::sin(z[kYaw]);
    hidden.row(j) << aside, last[kR], last[kBefore], last[kThrottle], steps.z(i + 1, kSteer);
  }
  const Eigen::MatrixXd known = steps.z(rows, fitted.felt), left = errors(rows, Eigen::all);
  // The rms of each state's errors, but for lines in the states of the model and in hidden ones.
  const auto rest = [&](const std::vector<int>& columns) -> Eigen::RowVectorXd {
    Eigen::MatrixXd states(count, known.cols() + std::ssize(columns));
    states << known, hidden(Eigen::all, columns);
    Eigen::MatrixXd lines(count, 1 + 2 * states.cols());
    lines << Eigen::VectorXd::Ones(count), states, states.array().colwise() * known.col(0).array();
    return (left - lines * lines.colPivHouseholderQr().solve(left)).colwise().norm();
  };
  const Eigen::RowVectorXd before = rest({}).cwiseMax(1e-300);
  const auto without = [&](const std::string& name, const std::vector<int>& columns) -> HiddenState {
    return {name, rest(columns).cwiseQuotient(before)};
  };
  return {without("motion aside in the step before", {0}),   without("yaw rate a step before", {1}),
          without("steering command two steps before", {2}), without("throttle a step before", {3}),
          without("the next steering command", {4}),         without("all of them", {0, 1, 2, 3, 4})};
}

}  // namespace forereach::research
