#include "records/outlines.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <memory>
#include <numeric>
#include <utility>

#include <fmt/format.h>

#include "forereach/certify/tube.h"
#include "forereach/numerics/size.h"
#include "forereach/sets/zonogon.h"

namespace forereach {
namespace {

using Eigen::Vector2d;

constexpr int kCornersOfDisc = 16;

// Of the corners of a disc, the last before the outward normal of an edge of a counter-clockwise polygon: 0 to 15.
int SectorOf(const Vector2d& edge) {
  const double turns = std::atan2(-edge.x(), edge.y()) / (2 * M_PI);
  return std::min(static_cast<int>((turns < 0 ? turns + 1 : turns) * kCornersOfDisc), kCornersOfDisc - 1);
}

}  // namespace

// The corners of the convex hull, by Andrew's monotone chain.
Svg::Points HullOf(const std::vector<Vector2d>& points, double radius) {
  static const auto kDisc = [] {
    std::array<Vector2d, kCornersOfDisc> disc;
    for (int i = 0; i < kCornersOfDisc; ++i)
      disc[ToSize(i)] = Eigen::Rotation2Dd(2 * M_PI * i / kCornersOfDisc) * Vector2d::UnitX();
    return disc;
  }();
  Svg::Points all = points;
  if (radius > 0) {
    const Svg::Points inner = HullOf(points);
    const auto at = [&](std::size_t i) -> const Vector2d& { return inner[i % inner.size()]; };
    all.clear();
    // A corner of the result is one of a disc around a corner of `inner`, between the normals of the edges there. One
    // more on either side costs little; edges that are not finite have no normal.
    for (std::size_t i = 0; i < inner.size(); ++i) {
      const Vector2d before = at(i) - at(i + inner.size() - 1), after = at(i + 1) - at(i);
      int first = 0, last = kCornersOfDisc - 1;
      if (inner.size() > 2 && before.allFinite() && after.allFinite()) {
        first = SectorOf(before) - 1;
        last = first + std::min((SectorOf(after) - first + kCornersOfDisc) % kCornersOfDisc + 2, last);
      }
      for (int k = first; k <= last; ++k)
        all.push_back(at(i) + radius * kDisc[ToSize((k + kCornersOfDisc) % kCornersOfDisc)]);
    }
  }
  if (all.size() < 2) return all;
  std::ranges::sort(all, {}, [](const Vector2d& a) { return std::pair(a.x(), a.y()); });
  Svg::Points hull;
  for (int pass = 0; pass < 2; ++pass) {
    const std::size_t base = hull.size();
    for (const Vector2d& point : all) {
      while (hull.size() >= base + 2) {
        const Vector2d edge = hull.back() - hull[hull.size() - 2], next = point - hull.back();
        if (edge.x() * next.y() - edge.y() * next.x() > 0) break;
        hull.pop_back();
      }
      hull.push_back(point);
    }
    hull.pop_back();
    std::ranges::reverse(all);
  }
  return hull;
}

std::vector<std::vector<Svg::Points>> Sweeps(const Certifier& certifier, const Tube& tube, int last) {
  const Placement& placement = certifier.safety().placement();
  std::vector<Zonotope> places(ToSize(placement.num_points()));
  const auto sample = std::make_unique<Placement::Sample>();
  // The corners of the places of each part's points at a sample.
  const auto corners_at = [&](int t) {
    placement.Observe(tube.slice(t), tube.half_width(t), *sample);
    placement.Enclose(*sample, places.data());
    std::vector<std::vector<Vector2d>> corners;
    for (const Placement::Part& part : placement.parts()) {
      std::vector<Vector2d>& of_part = corners.emplace_back();
      for (int i = part.first; i < part.first + part.count; ++i)
        std::ranges::move(Outline(places[ToSize(i)]), std::back_inserter(of_part));
    }
    return corners;
  };
  std::vector<std::vector<Svg::Points>> sweeps;
  const int units = std::min(last + 1, certifier.safety().NumUnits(tube));
  auto corners = corners_at(0);
  for (int t = 0; t < units; ++t) {
    auto next = t < tube.length() ? corners_at(t + 1) : corners;
    std::vector<Svg::Points>& unit = sweeps.emplace_back();
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const Placement::Part& part = placement.parts()[i];
      double turn = 0;
      for (int k = part.first; k < part.first + part.count; ++k) turn = std::max(turn, placement.turn(k));
      if (placement.sweeps()) std::ranges::copy(next[i], std::back_inserter(corners[i]));
      unit.push_back(HullOf(corners[i], part.radius + turn));
    }
    corners = std::move(next);
  }
  return sweeps;
}

BodyOutlines::BodyOutlines(const Problem& problem) : problem_(problem) {
  for (const BodyPart& part : problem.body.parts) {
    std::vector<TextFunction>& functions = places_.emplace_back();
    for (const auto& place : part.places) functions.emplace_back(NamesOf(*problem.model), place);
  }
}

std::vector<Svg::Points> BodyOutlines::At(const Eigen::VectorXd& x) const {
  if (problem_.body == Body{}) return {};
  const Vector2d position = problem_.projection * x;
  const Eigen::Rotation2Dd turn(problem_.body.heading < 0 ? 0 : x[problem_.body.heading]);
  std::vector<Svg::Points> parts;
  for (std::size_t i = 0; i < places_.size(); ++i) {
    const BodyPart& part = problem_.body.parts[i];
    std::vector<Vector2d> points;
    if (part.places.empty())
      for (const Eigen::Vector3d& point : part.points) points.push_back(position + turn * point.head<2>());
    for (const TextFunction& function : places_[i]) {
      std::vector<double> z(x.begin(), x.end());
      z.resize(ToSize(function.num_variables()));
      std::array<long double, 2> at;
      function.Evaluate(z, at);
      points.emplace_back(static_cast<double>(at[0]), static_cast<double>(at[1]));
    }
    parts.push_back(HullOf(points, part.radius));
  }
  return parts;
}

std::optional<ObstaclePlace> PlaceOf(const Obstacle& obstacle, double time_us) {
  if (obstacle.kind() == Obstacle::Kind::kHalfSpace) return std::nullopt;
  if (obstacle.grid()) {
    std::vector<Vector2d> corners;
    for (const Obstacle& block : obstacle.convex())
      for (const Eigen::Vector3d& point : block.hull()) corners.push_back(point.head<2>());
    return ObstaclePlace{HullOf(corners), Vector2d::Zero(), 0};
  }
  ObstaclePlace place{{}, Vector2d::Zero(), obstacle.radius()};
  if (const auto& motion = obstacle.motion()) {
    if (time_us < static_cast<double>(motion->from_us) || static_cast<double>(motion->until_us) < time_us)
      return std::nullopt;
    const double tau = (time_us - static_cast<double>(motion->stamp_us)) * 1e-6;
    place.shift = (motion->velocity * tau).head<2>();
    place.radius += motion->uncertainty + motion->growth * std::abs(tau) + motion->growth_rate * tau * tau / 2;
    if (!(place.radius < Svg::kFarthest)) place.radius = Svg::kFarthest;  // it may be anywhere
  }
  std::vector<Vector2d> points;
  for (const Eigen::Vector3d& point : obstacle.hull()) points.push_back(point.head<2>() + place.shift);
  place.points = HullOf(points);
  return place;
}

std::vector<Svg::Points> PredictionOf(const Obstacle& obstacle, std::int64_t from_us) {
  std::vector<Svg::Points> outlines;
  if (obstacle.motion())
    for (double after_us = 0; after_us <= 2e6; after_us += 5e5)
      if (const auto place = PlaceOf(obstacle, static_cast<double>(from_us) + after_us))
        outlines.push_back(HullOf(place->points, place->radius));
  return outlines;
}

namespace {

// What a discrete animation goes through, one value a second.
template <class Of>
std::string Animated(const char* attribute, const std::vector<std::optional<ObstaclePlace>>& places, const Of& of) {
  std::string values;
  for (const auto& place : places) values += (values.empty() ? "" : ";") + of(place);
  const bool moves = attribute == std::string_view("transform");
  return fmt::format(
      "<animate{0} attributeName=\"{1}\"{2} calcMode=\"discrete\" dur=\"{3}s\" fill=\"freeze\" values=\"{4}\"/>",
      moves ? "Transform" : "", attribute, moves ? " type=\"translate\"" : "", places.size(), values);
}

void DrawHalfPlane(const Obstacle& obstacle, const Eigen::AlignedBox2d& frame, Svg& svg) {
  const Vector2d all = obstacle.points()[0], normal = all.normalized(), along(-normal.y(), normal.x());
  const double far = 50 * frame.sizes().maxCoeff();
  const Vector2d foot = frame.center() + (obstacle.offset() / all.norm() - normal.dot(frame.center())) * normal;
  svg.Polygon({foot - far * along, foot + far * along, foot + far * (along + normal), foot + far * (normal - along)});
}

}  // namespace

void DrawObstacle(const Obstacle& obstacle, const std::vector<double>& times_us, const Eigen::AlignedBox2d& frame,
                  std::string_view name, Svg& svg) {
  if (obstacle.dim() != 2) return;
  if (obstacle.kind() == Obstacle::Kind::kHalfSpace) return DrawHalfPlane(obstacle, frame, svg);
  if (obstacle.grid()) {
    for (const Obstacle& block : obstacle.convex())
      if (frame.intersects({block.lower().head<2>(), block.upper().head<2>()}))
        DrawObstacle(block, {0}, frame, "", svg);
    return;
  }
  std::vector<std::optional<ObstaclePlace>> places;
  for (const double time : times_us) places.push_back(PlaceOf(obstacle, time));
  const auto found = std::ranges::find_if(places, [](const auto& place) { return place.has_value(); });
  if (found == places.end()) return;
  const ObstaclePlace first = **found;
  std::string size;  // how the shape grows
  const bool is_circle = first.points.size() == 1, moves = places.size() > 1 && obstacle.motion();
  const auto width = [&](double radius) { return svg.Length(is_circle ? radius : 2 * radius); };
  if (moves) {
    const auto value = [](const auto& of) {
      return [of](const auto& place) { return place ? of(*place) : std::string("0"); };
    };
    svg.Add(
        Animated("visibility", places, [](const auto& place) { return std::string(place ? "inherit" : "hidden"); }));
    svg.Add(Animated("transform", places,
                     value([&](const ObstaclePlace& place) { return svg.Shift(place.shift - first.shift); })));
    size = Animated(is_circle ? "r" : "stroke-width", places,
                    value([&](const ObstaclePlace& place) { return width(place.radius); }));
  }
  if (is_circle)
    svg.Circle(first.points[0], first.radius, "", size);
  else  // with a disc around each point it is as large as with a round border
    svg.Polygon(
        first.points,
        first.radius > 0 || moves ? fmt::format("class=\"round\" stroke-width=\"{}\"", width(first.radius)) : "", size);
  if (name.empty()) return;
  const Vector2d center = std::accumulate(first.points.begin(), first.points.end(), Vector2d(0, 0)) /
                          static_cast<double>(first.points.size());
  svg.Text(center, name);
}

}  // namespace forereach
