#include "page/drawing_json.h"

#include <utility>

#include "lcmtypes/printable.h"
#include "records/outlines.h"

namespace forereach {
namespace {

using Json = nlohmann::json;

Json ObstacleJson(const Obstacle& obstacle) {
  Json json{{"radius", obstacle.radius()}};
  if (obstacle.kind() == Obstacle::Kind::kHalfSpace) {
    json["normal"] = std::vector(obstacle.points()[0].begin(), obstacle.points()[0].end());
    json["offset"] = obstacle.offset();
  } else {
    Json points = Json::array();
    for (const Eigen::Vector2d& corner : CornersOf(obstacle)) points.push_back({corner.x(), corner.y()});
    json["points"] = std::move(points);
  }
  if (const auto& motion = obstacle.motion())
    json["motion"] = {{"stamp", motion->stamp_us},          {"velocity", {motion->velocity.x(), motion->velocity.y()}},
                      {"uncertainty", motion->uncertainty}, {"growth", motion->growth},
                      {"growth_rate", motion->growth_rate}, {"from", motion->from_us},
                      {"until", motion->until_us}};
  return json;
}

}  // namespace

Json ToJson(const std::vector<Obstacle>& obstacles) {
  Json all = Json::array();
  for (const Obstacle& obstacle : obstacles) all.push_back(obstacle.dim() == 2 ? ObstacleJson(obstacle) : Json());
  return all;
}

Json ToJson(const PageDetail& detail) {
  Json executed = Json::array();
  for (const PageState& state : detail.executed) executed.push_back({state.step, state.x, state.y});
  return {{"row", detail.decision},
          {"missing", Printable(detail.missing)},
          {"task", detail.task},
          {"obstacles", detail.obstacles},
          {"start", detail.start_utime},
          {"step_us", detail.step_us},
          {"steps", detail.steps},
          {"binding", detail.binding},
          {"part", detail.part},
          {"hull", {detail.hull_lower, detail.hull_upper}},
          {"envelope", {detail.envelope_lower, detail.envelope_upper}},
          {"executed", std::move(executed)},
          {"nearest", detail.nearest},
          {"nearest_distance", detail.nearest_distance},
          {"body_units", detail.bodies.parts.size()},
          {"body_grid", {detail.bodies.x, detail.bodies.y, detail.bodies.quantum}},
          {"units", detail.sketch.parts.size()},
          {"grid", {detail.sketch.x, detail.sketch.y, detail.sketch.quantum}}};
}

}  // namespace forereach
