#include "page/detail.h"

#include <algorithm>
#include <optional>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "forereach/certify/explain.h"
#include "forereach/numerics/size.h"
#include "lcmtypes/printable.h"
#include "records/outlines.h"

namespace forereach {
namespace {

constexpr int kMostSearched = 20'000;  // observations

void AddBinding(const Tube& tube, PageDetail& detail) {
  const int t = detail.binding;
  if (t < 0 || t > tube.length()) return;
  for (int k = 0; k < tube.slice(t).dim(); ++k) {
    const Interval hull = tube.hull(t, k);
    detail.hull_lower.push_back(hull.lower);
    detail.hull_upper.push_back(hull.upper);
    if (t == tube.length()) continue;
    const Interval residual = ResidualOver(tube, t, k);
    detail.envelope_lower.push_back(residual.lower);
    detail.envelope_upper.push_back(residual.upper);
  }
}

// For a person, in plain arithmetic; one pass over the observations.
void AddNearest(const Problem& problem, const JudgedCandidate& judged, const Tube& tube, PageDetail& detail) {
  const int t = detail.binding;
  const Transitions& known = problem.transitions;
  if (t < 0 || t >= tube.length() || t >= judged.candidate.num_steps || known.size() > kMostSearched) return;
  Eigen::VectorXd z(known.z.cols());
  const Eigen::VectorXd center = tube.slice(t).CenterVector();
  z << center, Eigen::Map<const Eigen::VectorXd>(judged.candidate.control[t], z.size() - center.size());
  const Eigen::MatrixXd apart = (known.z.rowwise() - z.transpose()).cwiseAbs();
  for (Eigen::Index k = 0; k < center.size(); ++k) {
    const Eigen::VectorXd weights = problem.declaration.lipschitz.row(k);
    Eigen::Index nearest = -1;
    double distance = kNoNumber;
    if (known.size() > 0 && !weights.isZero(0)) distance = (apart * weights).minCoeff(&nearest);
    detail.nearest.push_back(static_cast<int>(nearest));
    detail.nearest_distance.push_back(distance);
  }
}

using Units = std::vector<std::vector<Svg::Points>>;

Units BodiesOf(const Problem& problem, const Tube& tube, std::size_t units) {
  if (problem.body == Body{}) return {};
  const BodyOutlines body(problem);
  Units bodies;
  const int steps = std::min(static_cast<int>(units) - 1, tube.length());
  for (int t = 0; t <= steps; ++t) bodies.push_back(body.At(tube.slice(t).CenterVector()));
  return bodies;
}

// The tube and the measured states, and the obstacle that decides if it is not much larger.
Eigen::AlignedBox2d FrameOf(const Units& units, const PageDetail& detail, const std::optional<ObstaclePlace>& decides) {
  Eigen::AlignedBox2d frame;
  for (const auto& unit : units)
    for (const Svg::Points& polygon : unit)
      for (const Eigen::Vector2d& corner : polygon) frame.extend(corner);
  for (const PageState& state : detail.executed)
    if (const Eigen::Vector2d at(state.x, state.y); Svg::CanBeDrawn(at)) frame.extend(at);
  if (!Svg::CanBeDrawn(frame)) return frame;
  const double size = std::max(frame.sizes().maxCoeff(), 1e-3);
  const Eigen::Vector2d center = frame.center();
  if (decides && decides->radius < size)
    for (const Eigen::Vector2d& point : decides->points)
      if ((point - center).cwiseAbs().maxCoeff() < 1.5 * size)
        for (const double way : {-decides->radius, decides->radius})
          frame.extend(point + Eigen::Vector2d::Constant(way));
  // A margin; and what is flat, as a drive along a line, gets the height of a page's drawing.
  Eigen::Vector2d half = frame.sizes() / 2 + Eigen::Vector2d::Constant(std::max(0.12 * frame.sizes().maxCoeff(), 1e-3));
  half.y() = std::max(half.y(), 0.45 * half.x());
  return {frame.center() - half, frame.center() + half};
}

void DrawExecuted(const std::vector<PageState>& executed, Svg& svg) {
  Svg::Points path;
  for (const PageState& state : executed)
    if (const Eigen::Vector2d at(state.x, state.y); Svg::CanBeDrawn(at)) path.push_back(at);
  svg.Open("class=\"path\"");
  if (path.size() > 1) svg.Line(path);
  for (const PageState& state : executed) svg.Dot({state.x, state.y}, fmt::format("class=\"dot s{}\"", state.step));
  svg.Close();
}

// Adds the tube to the detail. @return why there is none; empty otherwise.
std::string AddTube(const Certifier& certifier, const JudgedCandidate& judged, const Decision& again, const Tube& tube,
                    const std::vector<Obstacle>& obstacles, PageDetail& detail) {
  const bool is_certified = again.outcome == Outcome::kCertified;
  detail.part = again.part;
  detail.binding = is_certified ? again.closest_step : again.step;
  if (again.outcome == Outcome::kFalsified && again.step < 0)
    return "the observations contradict the declaration, so there is no tube";
  AddBinding(tube, detail);
  AddNearest(certifier.problem(), judged, tube, detail);
  if (certifier.problem().projection.rows() != 2) return "its safety coordinates are not planar";
  const Units units = Sweeps(certifier, tube, is_certified ? tube.length() : again.step);
  return DrawTube(units, BodiesOf(certifier.problem(), tube, units.size()), obstacles, again.obstacle, detail)
             ? ""
             : "its tube has no finite outline";
}

}  // namespace

bool DrawTube(const Units& units, const Units& bodies, const std::vector<Obstacle>& obstacles, int deciding,
              PageDetail& detail) {
  const auto time_of = [&](double step) {
    return static_cast<double>(detail.start_utime) + step * static_cast<double>(detail.step_us);
  };
  const bool is_known = 0 <= deciding && deciding < std::ssize(obstacles);
  const auto frame =
      FrameOf(units, detail,
              is_known ? PlaceOf(obstacles[ToSize(deciding)], time_of(std::max(detail.binding, 0))) : std::nullopt);
  if (!Svg::CanBeDrawn(frame)) return false;
  std::vector<double> times;
  for (std::size_t t = 0; t < units.size(); ++t) times.push_back(time_of(static_cast<double>(t)));
  std::set<std::size_t> executed;
  for (const PageState& state : detail.executed) executed.insert(static_cast<std::size_t>(state.step));
  Svg svg(frame);
  DrawObstacles(obstacles, times, frame, is_known ? deciding : -1, true, svg);
  svg.Open("class=\"tube\"");
  for (std::size_t t = 0; t < units.size(); ++t)
    for (const Svg::Points& polygon : units[t])
      svg.Polygon(polygon, fmt::format("class=\"s{}{}{}\"", t, executed.contains(t) ? " executed" : "",
                                       static_cast<int>(t) == detail.binding ? " binding" : ""));
  svg.Close();
  DrawExecuted(detail.executed, svg);
  svg.Open("class=\"bodies\"");
  for (std::size_t t = 0; t < bodies.size(); ++t)
    for (const Svg::Points& polygon : bodies[t]) svg.Polygon(polygon, fmt::format("class=\"s{}\"", t));
  svg.Close();
  detail.svg = svg.Done();
  detail.frame = frame;
  detail.units = units.size();
  detail.has_body = !bodies.empty();
  return true;
}

void DrawObstacles(const std::vector<Obstacle>& obstacles, const std::vector<double>& times_us,
                   const Eigen::AlignedBox2d& frame, int deciding, bool has_names, Svg& svg) {
  const auto is_outside = [&](std::size_t k) { return k < obstacles.size() && IsOutside(obstacles[k]); };
  for (std::size_t k = 0; k < obstacles.size(); ++k) {
    if (is_outside(k) && !is_outside(k - 1)) svg.Open("class=\"outside\"");  // as one, without what is between pieces
    svg.Open(static_cast<int>(k) == deciding ? "class=\"obstacle binding\"" : "class=\"obstacle\"");
    DrawObstacle(obstacles[k], times_us, frame,
                 !has_names || is_outside(k)   ? ""
                 : obstacles[k].name().empty() ? std::to_string(k)
                                               : obstacles[k].name(),
                 svg);
    svg.Close();
    if (is_outside(k) && !is_outside(k + 1)) svg.Close();
  }
}

nlohmann::json ToJson(const PageDetail& detail) {
  nlohmann::json frame;
  if (!detail.svg.empty())
    frame = {detail.frame.min().x(), -detail.frame.max().y(), detail.frame.sizes().x(), detail.frame.sizes().y()};
  return {{"row", detail.decision},
          {"missing", Printable(detail.missing)},
          {"task", detail.task},
          {"steps", detail.steps},
          {"binding", detail.binding},
          {"part", detail.part},
          {"hull", {detail.hull_lower, detail.hull_upper}},
          {"envelope", {detail.envelope_lower, detail.envelope_upper}},
          {"executed", !detail.executed.empty()},
          {"nearest", detail.nearest},
          {"nearest_distance", detail.nearest_distance},
          {"has_body", detail.has_body},
          {"units", detail.units},
          {"frame", std::move(frame)}};
}

void Describe(const Certifier& certifier, const JudgedCandidate& judged, const Decision& again, const Tube& tube,
              const std::vector<Obstacle>& obstacles, PageDetail& detail) {
  detail.start_utime = judged.candidate.start_utime;
  detail.step_us = judged.candidate.step_us;
  detail.steps = judged.candidate.num_steps;
  detail.missing = judged.IsAnsweredBy(again) ? AddTube(certifier, judged, again, tube, obstacles, detail)
                                              : "this program decides it otherwise: replay it";
}

}  // namespace forereach
