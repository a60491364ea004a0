#include "cli/inner_bound.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include <fmt/format.h>
#include <Eigen/Geometry>

#include "forereach/certify/extremal.h"
#include "forereach/numerics/text.h"
#include "forereach/safety/clearance.h"
#include "forereach/sets/zonogon.h"
#include "verifier/verifier.h"

namespace forereach {
namespace {

// How far the body is from the nearest obstacle in a state at sample t, in plain arithmetic; places at expressions
// count as the frame.
double DistanceIn(const Case& judged, const Eigen::VectorXd& x, int t) {
  const Problem& problem = *judged.problem;
  const Eigen::Vector2d at = problem.projection * x;
  const Eigen::Rotation2Dd turn(problem.body.heading < 0 ? 0 : x[problem.body.heading]);
  double least = std::numeric_limits<double>::infinity();
  for (BodyPart part : problem.body.parts) {
    if (!part.places.empty()) part = {.points = {Eigen::Vector3d::Zero()}, .radius = part.radius};
    for (Eigen::Vector3d& point : part.points) point.head<2>() = (at + turn * point.head<2>()).eval();
    for (const Obstacle& obstacle : judged.obstacles)
      least =
          std::min(least, ApproximateDistance(obstacle, part, judged.schedule.start_us + t * judged.schedule.step_us));
  }
  return least;
}

struct Approach {
  double distance;
  Eigen::Index column;
};

// The rollouts that come closest to an obstacle, at most three.
std::vector<Approach> ClosestOf(const Case& judged, const std::vector<Eigen::MatrixXd>& states) {
  std::vector<Approach> all;
  for (Eigen::Index column = 0; column < states[0].cols(); ++column) {
    all.push_back({std::numeric_limits<double>::infinity(), column});
    for (std::size_t t = 0; t < states.size(); ++t)
      all.back().distance =
          std::min(all.back().distance, DistanceIn(judged, states[t].col(column), static_cast<int>(t)));
  }
  std::ranges::sort(all, {}, &Approach::distance);
  all.resize(std::min<std::size_t>(all.size(), 3));
  return all;
}

double RadiusOf(const Problem& problem, const Zonotope& slice) {
  return RadiusUpper(Zonotope(problem.projection * slice.CenterVector(), problem.projection * slice.GeneratorMatrix()));
}

}  // namespace

std::optional<InnerBound> BoundFromWithin(const Case& judged, const Certifier& certifier, const Tube& tube) {
  const Problem& problem = *judged.problem;
  const Declaration& declaration = problem.declaration;
  const Eigen::VectorXd center = judged.initial_set.CenterVector();
  Eigen::VectorXd half_width(center.size());
  for (Eigen::Index k = 0; k < center.size(); ++k)
    half_width[k] = judged.initial_set.Hull(static_cast<int>(k)).upper - center[k];
  // The corners of its hull are states of X0 only if X0 is a box.
  const bool is_box = ((judged.initial_set.GeneratorMatrix().array() != 0).colwise().count().array() <= 1).all();
  const auto varying = (declaration.lipschitz.array() > 0).rowwise().any().count();
  const Eigen::Index wide = (half_width.array() > 0).count();
  if (!is_box || !declaration.affine.rows.empty() || !declaration.regions.empty() || declaration.HasErrorInZ() ||
      problem.projection.rows() != 2 || certifier.violation() || tube.length() == 0 ||
      problem.transitions.size() > kMostInnerObservations || std::max(varying, wide) > kMostInnerCoordinates)
    return std::nullopt;
  const ExtremalResiduals residuals(declaration, Observe(*problem.model, declaration, problem.transitions));
  // Slightly inside, so that the rounding of a corner does not lie outside.
  const Eigen::MatrixXd starts = CornersOf(center, (1 - 1e-12) * half_width);
  const std::vector<Eigen::MatrixXd> states = ExtremalRollouts(*problem.model, residuals, judged.plan(), starts);
  const int step = tube.length();
  InnerBound bound{step,
                   RadiusOf(problem, tube.slice(step)),
                   HalfSpread(problem.projection, states[static_cast<std::size_t>(step)]),
                   {}};
  const verifier::Verifier verifier(judged.problem, verifier::MethodOf(problem));
  for (const auto& [distance, column] : ClosestOf(judged, states)) {
    if (!(distance < 0)) break;
    verifier::Certificate claimed;
    claimed.initial_set.center = starts.col(column % starts.cols());
    claimed.initial_set.generators = Eigen::MatrixXd(center.size(), 0);
    claimed.controls = judged.controls;
    claimed.obstacles = judged.obstacles;
    claimed.schedule = judged.schedule;
    const auto failure = verifier.FindContact(claimed, residuals.UpperOf(static_cast<int>(column / starts.cols())));
    if (!failure) continue;
    bound.contact = fmt::format("at step {} it is not so that {}", failure->step, failure->what);
    break;
  }
  return bound;
}

std::string Describe(const InnerBound& bound) {
  std::string text = fmt::format("half-width at step {}: {} m; no sound tube is below {} m", bound.step,
                                 RoundedUp(bound.half_width), RoundedDown(bound.least));
  if (!bound.contact.empty())
    text += "; no sound method could certify this with these data: of a system that agrees with all of them, " +
            bound.contact;
  return text;
}

}  // namespace forereach
