#include "verifier/verifier.h"

#include <algorithm>
#include <array>
#include <limits>
#include <stdexcept>
#include <string>

#include "forereach/numerics/size.h"
#include "forereach/residual/growing_disturbance.h"
#include "verifier/claims.h"
#include "verifier/expressions.h"

namespace forereach::verifier {
namespace {

// A sum of doubles spans 2098 bits, one of products of three doubles 6453: with so many each is exact.
constexpr std::array kBits{256, 2304, 6656};
// What exceeds a record by more than this is no matter of the certifier's rounding.
constexpr double kRounding = 0x1p-40;
// How far a difference between slices may have grown when a claim fails for it.
constexpr double kGrowth = 1024;

bool IsSize(double x) { return 0 <= x && x < std::numeric_limits<double>::infinity(); }

// Those of the disturbance are the tube's (tube.h): here only whether they are expressions.
TaskFunctions FunctionsOf(const Problem& problem) {
  if (const auto& growing = problem.declaration.growing)
    static_cast<void>(Functions(*problem.model, growing->bounds()));
  std::vector<ExpressionText> limits;
  for (const Limit& limit : problem.limits) limits.push_back(limit.that);
  TaskFunctions functions{Functions(*problem.model, limits), {}};
  for (const BodyPart& part : problem.body.parts) functions.places.emplace_back(*problem.model, part.Coordinates());
  return functions;
}

// Body and bounds between the samples.
const char* FindMisfit(const Body& body, Eigen::Index p, int num_states) {
  if (body.heading < -1 || body.heading >= num_states || (body.heading >= 0 && p < 2))
    return "the body's heading is a state, in two coordinates or more";
  if (body.parts.empty()) return "the body has a part";
  for (const BodyPart& part : body.parts)
    if (part.num_points() == 0 || !IsSize(part.radius) ||
        !std::ranges::all_of(part.places, [&](const auto& place) { return std::ssize(place) == p; }) ||
        !std::ranges::all_of(part.points, [](const Eigen::Vector3d& point) { return point.allFinite(); }))
      return "the body's parts have points, finite numbers and no negative radius";
  return nullptr;
}
const char* FindMisfit(const Between& between, Eigen::Index p, const NominalModel& model) {
  if (between.acceleration.size() != p) return "the bounds between samples fit the projection";
  if (!std::ranges::all_of(between.acceleration, IsSize) || !IsSize(between.turn_rate) ||
      !IsSize(between.turn_acceleration) || !IsSize(between.period))
    return "the bounds between samples are finite and not negative";
  for (std::size_t i = 0; i < model.parameters().size(); ++i)
    if (model.parameter_names()[i] == "dt" && !(model.parameters()[i] <= between.period))
      return "the bounds between samples are those of the model's step, or of a longer one";
  return nullptr;
}

// The obstacles' own numbers are checked where they are made.
const char* FindMisfit(const Schedule& schedule, const std::vector<Obstacle>& obstacles) {
  const auto& [start, step, error] = schedule;
  if (start < -Schedule::kLatest || start > Schedule::kLatest || step < 0 || step > Schedule::kLongest || error < 0 ||
      error > Schedule::kLongest)
    return "the schedule lies within its bounds";
  const bool moves =
      std::ranges::any_of(obstacles, [](const Obstacle& obstacle) { return obstacle.motion().has_value(); });
  return moves && step < 1 ? "there is a schedule, since an obstacle moves" : nullptr;
}

// The pieces that the cuts leave of the initial set; none if they are no tree of closed parts.
std::vector<InitialSet> PiecesOf(const Certificate& certificate, int n) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  InitialSet whole = certificate.initial_set;
  if (certificate.cuts.empty()) return {whole};
  whole.from = Eigen::VectorXd::Constant(n, -kInfinity);
  whole.to = Eigen::VectorXd::Constant(n, kInfinity);
  std::vector<InitialSet> parts{whole}, pieces;
  for (const auto& [state, at] : certificate.cuts) {
    if (parts.empty()) return {};
    InitialSet lower = parts.back();
    parts.pop_back();
    if (state < 0) {
      pieces.push_back(std::move(lower));
      continue;
    }
    if (state >= n || !(lower.from[state] <= at && at <= lower.to[state])) return {};
    InitialSet upper = lower;
    lower.to[state] = upper.from[state] = at;
    parts.push_back(std::move(upper));
    parts.push_back(std::move(lower));
  }
  if (!parts.empty()) pieces.clear();
  return pieces;
}

// What does not fit before anything is derived.
std::optional<Failure> FindMisfit(const Problem& problem, const Certificate& certificate) {
  const auto misfit = [](const std::string& what) { return Failure{-1, what, "", ""}; };
  const int n = problem.model->num_states();
  const auto& set = certificate.initial_set;
  if (certificate.controls.rows() != problem.model->num_inputs() || certificate.controls.cols() < 1 ||
      !certificate.controls.allFinite())
    return misfit("the controls are finite and fit the model");
  const bool box = set.lower.size() > 0;
  if (box ? set.lower.size() != n || set.upper.size() != n || !(set.lower.array() <= set.upper.array()).all() ||
                !set.lower.allFinite() || !set.upper.allFinite()
          : set.center.size() != n || set.generators.rows() != n || !set.center.allFinite() ||
                !set.generators.allFinite())
    return misfit("the initial set is finite and fits the model");
  for (const Obstacle& obstacle : certificate.obstacles)
    if (obstacle.dim() != problem.projection.rows()) return misfit("the obstacles fit the projection");
  if (!certificate.stay_in.empty() && problem.projection.rows() != 2)
    return misfit("areas to stay in have two safety coordinates");
  if (const char* what = FindMisfit(problem.body, problem.projection.rows(), n)) return misfit(what);
  if (problem.between)
    if (const char* what = FindMisfit(*problem.between, problem.projection.rows(), *problem.model)) return misfit(what);
  if (const char* what = FindMisfit(certificate.schedule, certificate.obstacles)) return misfit(what);
  if (certificate.first_step < 0 || (certificate.first_step > 0 && !certificate.is_remainder))
    return misfit("the first step is the plan's first");
  if (certificate.slices.empty()) return std::nullopt;
  const auto steps = ToSize(certificate.controls.cols());
  if (certificate.slices.size() != steps + 1)
    return Failure{static_cast<int>(certificate.slices.size()), "the record has a slice for every step",
                   std::to_string(certificate.slices.size()), std::to_string(steps + 1)};
  for (std::size_t t = 0; t <= steps; ++t) {
    const RecordedSlice& slice = certificate.slices[t];
    const auto fits = [&](const Eigen::VectorXd& vector) { return vector.size() == 0 || vector.size() == n; };
    if (!fits(slice.lower) || slice.lower.size() != slice.upper.size() || !fits(slice.center) ||
        slice.center.size() != slice.half_width.size() || (slice.has_generators && slice.generators.rows() != n) ||
        !fits(slice.envelope_lower) || slice.envelope_lower.size() != slice.envelope_upper.size() ||
        !fits(slice.remainder) ||
        (!slice.clearance.empty() && slice.clearance.size() != certificate.obstacles.size()) ||
        (!slice.clearance.empty() && problem.between && t == steps))
      return Failure{static_cast<int>(t), "the recorded slice has the task's sizes", "", ""};
  }
  return std::nullopt;
}

}  // namespace

Method MethodOf(const Problem& problem) {
  switch (problem.method) {
    case forereach::Method::kPaper: return Method::kPaper;
    case forereach::Method::kCentred: return Method::kCentred;
  }
  throw std::invalid_argument("problem: method " + std::to_string(static_cast<int>(problem.method)) + " is unknown");
}

Verifier::Verifier(const std::shared_ptr<const Problem>& problem, Method method)
    : problem_(std::make_unique<Problem>(*problem)), method_(method) {
  try {
    equations_ = EquationsOf(*problem_->model);
    functions_ = std::make_unique<TaskFunctions>(FunctionsOf(*problem_));
  } catch (const ExpressionError& error) {
    reason_ = std::string(", ") + error.what();
  }
}

const TubeMaker& Verifier::MakerOf(int bits) const {
  const std::lock_guard lock(mutex_);
  auto& maker = makers_[bits];
  if (!maker) {
    const Precision precision(bits);
    maker = std::make_unique<TubeMaker>(*problem_, *equations_, method_);
  }
  return *maker;
}

void Verifier::Learn(Transitions transitions) {
  problem_->transitions = std::move(transitions);
  for (const auto& [bits, maker] : makers_) {
    const Precision precision(bits);
    maker->Learn();
  }
}

Tube Verifier::Derive(const Certificate& certificate) const {
  const Precision precision(kBits[0]);
  return MakerOf(kBits[0]).Make(certificate.initial_set, certificate.controls, {.known = certificate.known});
}

Verdict Verifier::Verify(const Certificate& certificate) const {
  if (!equations_)
    return {Status::kCannotVerify,
            {-1, "cannot verify: no equations for the model " + problem_->model->name() + reason_, "", ""}};
  if (!functions_)
    return {Status::kCannotVerify,
            {-1, "cannot verify: a limit, place or disturbance is no expression" + reason_, "", ""}};
  if (const auto misfit = FindMisfit(*problem_, certificate)) return {Status::kRefuted, *misfit};
  const std::vector<InitialSet> pieces = PiecesOf(certificate, problem_->model->num_states());
  if (pieces.empty()) return {Status::kRefuted, {-1, "the pieces of the initial set cover it", "", ""}};
  Certificate piece = certificate;
  for (const InitialSet& set : pieces) {
    piece.initial_set = set;
    if (Verdict verdict = VerifyWhole(piece); verdict.status != Status::kConfirmed) return verdict;
  }
  return {Status::kConfirmed, {}};
}

Verdict Verifier::VerifyWhole(const Certificate& certificate) const {
  std::optional<Failure> failure;
  for (const int bits : kBits) {
    const Precision precision(bits);
    failure = Check(MakerOf(bits), certificate);
    if (!failure) return {Status::kConfirmed, {}};
    if (failure->certain) return {Status::kRefuted, *failure};
  }
  return {Status::kCannotVerify, *failure};
}

std::optional<Failure> Verifier::FindContact(const Certificate& claimed, const std::vector<bool>& upper) const {
  // Bounds on what happens between samples may rule the motion out.
  if (!equations_ || !functions_ || problem_->between || FindMisfit(*problem_, claimed)) return std::nullopt;
  const Precision precision(kBits[0]);
  const auto motion = MakerOf(kBits[0]).Follow(claimed.initial_set, claimed.controls, upper, claimed.known);
  if (!motion) return std::nullopt;
  Certificate of_motion = claimed;
  of_motion.is_remainder = true;  // nothing is claimed of its end
  std::optional<Failure> failure = FindFalseClaim(*problem_, of_motion, *functions_, *motion);
  if (failure && !failure->certain) failure.reset();
  return failure;
}

// The certifier's own rules first. Where these leave a choice, its rounding may have taken it otherwise. What proves
// the claims as well is a tube that follows the record from slice to slice; and, if they fail by no more than the
// choice may matter, tubes that need none: never reduced, and with a tighter remainder.
std::optional<Failure> Verifier::Check(const TubeMaker& maker, const Certificate& certificate) const {
  double ambiguity = 0;
  const auto attempt = [&](const TubeOptions& options) {
    const Tube tube = maker.Make(certificate.initial_set, certificate.controls, options);
    ambiguity = std::max(ambiguity, tube.ambiguity);
    return tube.failure ? tube.failure : FindFalseClaim(*problem_, certificate, *functions_, tube);
  };
  const KnownRows& known = certificate.known;
  if (auto too_much = maker.FindTooMuch(known)) return too_much;
  const std::optional<Failure> failure = attempt({.known = known});
  if (!failure) return std::nullopt;
  std::vector<RecordedSet> recorded;
  for (const RecordedSlice& slice : certificate.slices)
    if (slice.has_generators) recorded.push_back({slice.center, slice.generators});
  const bool is_recorded = recorded.size() > ToSize(certificate.controls.cols());
  const bool is_text = problem_->model->text() != nullptr;
  for (const bool split : {false, true})
    if (is_recorded && (!split || is_text) && !attempt({.split_remainder = split, .known = known, .follow = &recorded}))
      return std::nullopt;
  // The centred remainder may shrink where its center moves; by a rounding error, that is no difference of rules.
  const double rounding = method_ == Method::kCentred ? kRounding : 0;
  if (!(failure->excess < std::max(kGrowth * ambiguity, rounding))) return failure;
  for (const bool split : {false, true})
    if (!attempt({.reduce = false, .split_remainder = split, .known = known})) return std::nullopt;
  return failure;
}

}  // namespace forereach::verifier
