#include "worlds/geojson.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forereach/numerics/directed.h"
#include "forereach/numerics/limits.h"
#include "forereach/numerics/text.h"
#include "task/config_error.h"
#include "task/files.h"
#include "task/json_field.h"
#include "task/json_text.h"
#include "task/keep_in.h"
#include "task/number.h"

namespace forereach {
namespace {

using Json = nlohmann::json;

constexpr std::int64_t kLargestDrawing = 64 * kMegabyte;
constexpr double kFarthest = 1e9;  // m, of a coordinate
// So near to the equator and the prime meridian, where nobody drives, metres of Web Mercator are those of the ground to
// 1.3 millionths: a map's own, whatever the file calls them.
constexpr double kFarthestMercator = 1e4;

// ---- From degrees to metres

// The tangent plane of WGS 84 at the origin, x to the east and y to the north, at height 0.
class TangentPlane {
 public:
  static constexpr double kReach = 1e4, kLatitudes = 80;  // m, degrees
  // Doubles round places on the ellipsoid, of 6.4e6 m, by less than a micrometre after a dozen operations.
  static constexpr double kRounding = 1e-6;

  explicit TangentPlane(const PlanePoint& origin) : origin_(Radians(origin)), at_(OnEllipsoid(origin_)) {}

  // None if the place is out of reach.
  [[nodiscard]] std::optional<PlanePoint> To(const PlanePoint& degrees) const {
    const auto [longitude, latitude] = origin_;
    const Eigen::Vector3d offset = OnEllipsoid(Radians(degrees)) - at_;
    const Eigen::Vector3d east(-std::sin(longitude), std::cos(longitude), 0);
    const Eigen::Vector3d north(-std::sin(latitude) * std::cos(longitude), -std::sin(latitude) * std::sin(longitude),
                                std::cos(latitude));
    if (!(offset.norm() <= kReach)) return std::nullopt;
    return PlanePoint{east.dot(offset), north.dot(offset)};
  }

  // How far a side that is straight in degrees leaves the straight one between its ends, in metres. At constant rates
  // of both angles the acceleration is at most (1 + 2 / sqrt(3) tan(latitude)) v^2 / R: v^2 / R towards the axis of
  // curvature, the rest along the ground. A motion with the acceleration a leaves its chord by a / 8. The constants are
  // larger by what the ellipsoid's radii, and v within the reach, vary.
  [[nodiscard]] double Bend(double length) const {
    constexpr double kSmallestRadius = 6.33e6, kFarther = 0.1 * std::numbers::pi / 180;
    const double tangent = std::tan(std::abs(origin_.y) + kFarther);
    return (1.05 + 1.2 * tangent) * 1.05 * length * length / (8 * kSmallestRadius);
  }

 private:
  static PlanePoint Radians(const PlanePoint& degrees) {
    return {degrees.x * std::numbers::pi / 180, degrees.y * std::numbers::pi / 180};
  }
  static Eigen::Vector3d OnEllipsoid(const PlanePoint& at) {
    constexpr double kEquator = 6378137.0, kFlattening = 1 / 298.257223563;
    constexpr double kSquare = kFlattening * (2 - kFlattening);
    const double sine = std::sin(at.y), radius = kEquator / std::sqrt(1 - kSquare * sine * sine);
    return {radius * std::cos(at.y) * std::cos(at.x), radius * std::cos(at.y) * std::sin(at.x),
            radius * (1 - kSquare) * sine};
  }

  PlanePoint origin_;
  Eigen::Vector3d at_;
};

// ---- The drawing

class Drawing {
 public:
  Drawing(const std::string& path, const GeoJsonOptions& options) : path_(path), options_(options) {
    if (options.origin) plane_.emplace(*options.origin);
  }

  World Read(const Json& document) {
    const bool are_degrees = TakeReferenceSystem(document);
    TakeObject(JsonField(path_, document), nullptr, 0);
    // Degrees that are taken for metres make a world of the size of a coin, in which nothing is hit.
    if (!options_.origin && !options_.are_metres && any_ && (are_degrees || LooksLikeDegrees()))
      throw ConfigError(
          "{}: the coordinates look like degrees; give --origin LON,LAT, where x = y = 0, or --metres if "
          "they are metres",
          path_);
    AddStayIn();
    if (plane_)
      world_.notes.push_back(
          fmt::format("x east and y north in the tangent plane of WGS 84; each piece grown by up to {} m, for sides "
                      "that are straight in degrees.",
                      RoundedUp(largest_bend_, 3)));
    return std::move(world_);
  }

 private:
  struct Style {
    std::string name;
    bool keep_in = false;
    std::optional<double> width, radius;
  };

  // What GeoJSON before RFC 7946 says its coordinates are, by the properties of its crs or by a text instead of them.
  // Whether they are degrees.
  [[nodiscard]] bool TakeReferenceSystem(const Json& document) {
    if (!document.is_object() || !document.contains("crs")) return false;
    const Json* at = &document["crs"];
    for (const char* key : {"properties", "name"})
      if (at->is_object() && at->contains(key)) at = &(*at)[key];
    if (!at->is_string()) return false;
    const std::string system = at->get<std::string>();
    const auto is = [&](std::string_view code) { return system.ends_with(code); };
    if (is(":3857") || is(":900913") || is(":3785")) {
      if (!options_.are_metres || options_.origin)
        throw ConfigError(
            "{}: crs: {} is Web Mercator, whose metres are not those of the ground; `ogr2ogr -t_srs EPSG:4326` makes "
            "degrees of them, for --origin. If the file says so of a map's own metres, as editors of routes do, give "
            "--metres",
            path_, system.substr(0, 80));
      farthest_ = kFarthestMercator;
    }
    if (is("CRS84") || is(":4326")) return true;
    world_.notes.push_back(
        fmt::format("Coordinates are taken as metres of a plane, with the crs {}.", system.substr(0, 80)));
    return false;
  }

  // ---- Objects

  void TakeObject(const JsonField& at, const JsonField* properties, int depth) {
    const std::string type = at["type"].Text();
    if (type == "FeatureCollection") {
      const JsonField features = at["features"];
      for (std::size_t i = 0; i < features.Count(); ++i) TakeObject(features[i], nullptr, depth);
    } else if (type == "Feature") {
      const JsonField geometry = at["geometry"];
      const bool has_properties = at.json().contains("properties") && at.json()["properties"].is_object();
      const JsonField own = has_properties ? at["properties"] : at;
      const Json id = at.json().value("id", Json());
      feature_ = id.is_string() || id.is_number_integer()
                     ? fmt::format("feature {}", id.is_string() ? id.get<std::string>() : id.dump())
                     : std::string();
      if (!geometry.json().is_null()) TakeObject(geometry, has_properties ? &own : nullptr, depth);
    } else if (type == "GeometryCollection") {
      const JsonField geometries = at["geometries"];
      // Each level is a call on the stack.
      if (depth > 8) at.Fail("is nested too deeply");
      for (std::size_t i = 0; i < geometries.Count(); ++i) TakeObject(geometries[i], properties, depth + 1);
    } else {
      TakeGeometry(type, at, StyleOf(properties, type));
    }
  }

  void TakeGeometry(const std::string& type, const JsonField& at, Style style) {
    constexpr std::string_view kTypes[] = {"Polygon",         "MultiPolygon", "LineString",
                                           "MultiLineString", "Point",        "MultiPoint"};
    if (std::ranges::find(kTypes, type) == std::end(kTypes)) at.Fail(fmt::format("type {} is none of GeoJSON's", type));
    if (style.name.empty()) style.name = !feature_.empty() ? feature_ : at.name().empty() ? type : at.name();
    const JsonField coordinates = at["coordinates"];
    const auto each = [&](const auto& take) {
      for (std::size_t i = 0; i < coordinates.Count(); ++i) take(coordinates[i], style);
    };
    if (type == "Polygon") return TakeArea(coordinates, style);
    if (type == "MultiPolygon") return each([this](const auto& c, const auto& s) { TakeArea(c, s); });
    if (type == "LineString") return TakeLine(coordinates, style);
    if (type == "MultiLineString") return each([this](const auto& c, const auto& s) { TakeLine(c, s); });
    if (type == "Point") return TakePoint(coordinates, style);
    each([this](const auto& c, const auto& s) { TakePoint(c, s); });
  }

  [[nodiscard]] Style StyleOf(const JsonField* properties, const std::string& type) const {
    Style style{"", options_.keep_in, options_.line_width, options_.point_radius};
    if (!properties) return style;
    const Json& json = properties->json();
    if (json.contains("name") && json["name"].is_string()) style.name = json["name"].get<std::string>();
    if (json.contains("keep_in")) style.keep_in = (*properties)["keep_in"].Bool();
    // An area may have them, too, and there they may be anything.
    if (json.contains("width") && type.ends_with("LineString")) style.width = Size((*properties)["width"]);
    if (json.contains("radius") && type.ends_with("Point")) style.radius = Size((*properties)["radius"]);
    return style;
  }

  static double Size(const JsonField& at) {
    // Maps of others have texts in all properties.
    const Parsed<double> text = at.json().is_string() ? ParseNumber(at.json().get<std::string>()) : Parsed<double>{};
    if (!text.problem.empty())
      at.Fail(fmt::format("'{}' {}", at.json().get<std::string>().substr(0, 40), text.problem));
    const double size = at.json().is_string() ? text.value : at.Number();
    if (!(size >= 0 && size <= kFarthest)) at.Fail(fmt::format("{} is outside [0, {}]", ToText(size), kFarthest));
    return size;
  }

  // ---- Coordinates

  PlanePoint PointAt(const JsonField& at) {
    if (at.Count() < 2) at.Fail(fmt::format("has {} entries, has to have two or three", at.Count()));
    PlanePoint point{at[std::size_t{0}].Number(), at[std::size_t{1}].Number()};
    if (plane_) {
      if (!(std::abs(point.x) <= 180 && std::abs(point.y) <= TangentPlane::kLatitudes))
        at.Fail(fmt::format("is no longitude and a latitude of at most {} degrees", TangentPlane::kLatitudes));
      const std::optional<PlanePoint> place = plane_->To(point);
      if (!place)
        at.Fail(fmt::format("is more than {} m from the origin, where a plane is no map of the ground any more",
                            TangentPlane::kReach));
      point = *place;
    }
    if (!(std::abs(point.x) <= farthest_ && std::abs(point.y) <= farthest_))
      at.Fail(fmt::format("is farther than {} m{}", farthest_,
                          farthest_ < kFarthest ? ", where metres of Web Mercator are not those of the ground" : ""));
    lower_ = {std::min(lower_.x, point.x), std::min(lower_.y, point.y)};
    upper_ = {std::max(upper_.x, point.x), std::max(upper_.y, point.y)};
    any_ = true;
    return point;
  }

  Ring PointsAt(const JsonField& at) {
    Ring points;
    for (std::size_t i = 0; i < at.Count(); ++i) points.push_back(PointAt(at[i]));
    if (points.empty()) at.Fail("has no points");
    return points;
  }

  [[nodiscard]] bool LooksLikeDegrees() const {
    constexpr double kDegrees = 1;  // 111 km
    return std::abs(lower_.x) <= 180 && std::abs(upper_.x) <= 180 && std::abs(lower_.y) <= 90 &&
           std::abs(upper_.y) <= 90 && upper_.x - lower_.x < kDegrees && upper_.y - lower_.y < kDegrees;
  }

  // How far the true sides between these points may be off the straight ones.
  double BendOf(const Ring& points) {
    if (!plane_) return 0;
    double bend = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const PlanePoint &a = points[i], &b = points[(i + 1) % points.size()];
      bend = std::max(bend, plane_->Bend(std::hypot(a.x - b.x, a.y - b.y)));
    }
    largest_bend_ = std::max(largest_bend_, bend + TangentPlane::kRounding);
    return bend + TangentPlane::kRounding;
  }

  // ---- Shapes

  void TakeArea(const JsonField& at, const Style& style) {
    Area area;
    double bend = 0;
    for (std::size_t i = 0; i < at.Count(); ++i) {
      Ring ring = PointsAt(at[i]);
      bend = std::max(bend, BendOf(ring));
      if (i == 0) area.outer = std::move(ring);
      if (i > 0) area.holes.push_back(std::move(ring));
    }
    if (at.Count() == 0) at.Fail("has no ring");
    if (!style.keep_in) {
      const int most = bend > 0 ? kMaxObstaclePoints - 4 : kMaxObstaclePoints;  // a grown piece may have four more
      for (const Ring& piece : Cut(at.name(), [&] { return ConvexPieces(area, most); }))
        world_.Add(style.name, Grown(piece, bend));
      return;
    }
    static_cast<void>(Cut(at.name(), [&] { return ConvexPieces(area, 3); }));  // an error of its own has its place
    stay_in_name_ = stay_in_.empty() ? style.name : "all areas";
    stay_in_.push_back(std::move(area));
    stay_in_bend_ = std::max(stay_in_bend_, bend);
  }

  // What `pieces` gives of areas.
  template <class Pieces>
  [[nodiscard]] auto Cut(const std::string& place, const Pieces& pieces) const -> decltype(pieces()) {
    try {
      return pieces();
    } catch (const NoPolygon& error) {
      throw ConfigError("{}: {}: {}", path_, place, error.what());
    }
  }

  void TakeLine(const JsonField& at, const Style& style) {
    const Ring points = PointsAt(at);
    if (points.size() < 2) at.Fail("has one point, a line has two");
    if (!style.width) at.Fail("has no width; give --line-width, or its feature the property width");
    for (std::size_t i = 0; i + 1 < points.size(); ++i) {
      const Ring side{points[i], points[i + 1]};
      world_.Add(style.name, Grown(side, AddUp(HalfUp(*style.width), BendOf(side))));
    }
  }

  void TakePoint(const JsonField& at, const Style& style) {
    const PlanePoint point = PointAt(at);
    if (!style.radius) at.Fail("has no radius; give --point-radius, or its feature the property radius");
    const double radius = AddUp(*style.radius, BendOf({point}));
    world_.Add(style.name, Obstacle::Circle(Eigen::Vector2d(point.x, point.y), radius));
  }

  void AddStayIn() {
    if (stay_in_.empty()) return;
    for (const Obstacle& obstacle : Cut("the areas to stay in", [this] { return OutsideOf(stay_in_, stay_in_bend_); }))
      world_.Add(std::string(kOutside) + stay_in_name_, obstacle);
  }

  const std::string& path_;
  const GeoJsonOptions& options_;
  std::optional<TangentPlane> plane_;
  std::string feature_;  // by its id, if it has one
  World world_;
  std::vector<Area> stay_in_;
  std::string stay_in_name_;
  double stay_in_bend_ = 0, largest_bend_ = 0;
  double farthest_ = kFarthest;
  PlanePoint lower_{kInfinity, kInfinity}, upper_{-kInfinity, -kInfinity};
  bool any_ = false;
};

}  // namespace

World ReadGeoJson(const std::string& path, const GeoJsonOptions& options) {
  const std::string text = ReadWhole(path, kLargestDrawing);
  Json document;
  try {
    document = ParseJson(text);
  } catch (const Json::exception& error) {
    throw ConfigError("{}: {}", path, DescribeJsonError(error));
  }
  return Drawing(path, options).Read(document);
}

}  // namespace forereach
