#include "worlds/commonroad.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include "forereach/numerics/directed.h"
#include "forereach/numerics/limits.h"
#include "forereach/numerics/text.h"
#include "task/config_error.h"
#include "task/files.h"
#include "task/line_reader.h"
#include "task/number.h"
#include "worlds/placed.h"
#include "worlds/xml.h"

namespace forereach {
namespace {

constexpr std::int64_t kLargestScenario = 256 * kMegabyte;
constexpr double kFarthestPoint = 1e8;  // m
constexpr double kLastStep = 1e6;       // of time
constexpr double kMostTurned = 1e5;     // rad

struct Span {
  double lower = 0, upper = 0;

  [[nodiscard]] double middle() const { return lower + (upper - lower) / 2; }
  // Of both sides of the middle, the larger one.
  [[nodiscard]] double half() const { return std::max(SubUp(upper, middle()), SubUp(middle(), lower)); }
  friend bool operator==(const Span&, const Span&) = default;
};

// ---- Elements with their places

class ScenarioReader {
 public:
  explicit ScenarioReader(const std::string& path) : path_(path) {}

  [[noreturn]] void Fail(const XmlElement& at, const std::string& what) const {
    throw ConfigError("{}:{}: {}: {}", path_, at.line, at.name, what);
  }

  [[nodiscard]] const XmlElement& Require(const XmlElement& at, std::string_view child) const {
    if (const XmlElement* found = at.Find(child)) return *found;
    Fail(at, fmt::format("has no {}", child));
  }

  // An element's name. In 2018b an obstacle's is that of its role.
  [[nodiscard]] std::string KindOf(const XmlElement& at) const {
    return at.name == "obstacle" ? std::string(Trimmed(Require(at, "role").text)) + "Obstacle" : at.name;
  }

  [[nodiscard]] double Number(const XmlElement& at, double lower, double upper) const {
    return Checked(at, std::string(Trimmed(at.text)), lower, upper);
  }

  [[nodiscard]] double Checked(const XmlElement& at, const std::string& text, double lower, double upper) const {
    const auto [value, problem] = ParseNumber(text);
    if (!problem.empty()) Fail(at, fmt::format("'{}' {}", text.substr(0, 40), problem));
    if (!(lower <= value && value <= upper))
      Fail(at, fmt::format("{} is outside [{}, {}]", text, ToText(lower), ToText(upper)));
    return value;
  }

  // exact, or intervalStart and intervalEnd.
  [[nodiscard]] Span Interval(const XmlElement& at, double lower, double upper) const {
    if (const XmlElement* exact = at.Find("exact")) {
      const double value = Number(*exact, lower, upper);
      return {value, value};
    }
    const Span span{Number(Require(at, "intervalStart"), lower, upper),
                    Number(Require(at, "intervalEnd"), lower, upper)};
    if (!(span.lower <= span.upper)) Fail(at, "its interval ends before it starts");
    return span;
  }

  [[nodiscard]] PlanePoint Point(const XmlElement& at) const {
    return {Number(Require(at, "x"), -kFarthestPoint, kFarthestPoint),
            Number(Require(at, "y"), -kFarthestPoint, kFarthestPoint)};
  }

  [[nodiscard]] Ring Points(const XmlElement& at) const {
    Ring points;
    for (const XmlElement* point : at.All("point")) points.push_back(Point(*point));
    return points;
  }

 private:
  const std::string& path_;
};

// ---- Shapes

// Convex: the hull of points, and what is within the radius of it. Where it is placed, each of its exact points is
// within `error` of the computed one.
struct Convex {
  std::vector<PlanePoint> points;
  double radius = 0, error = 0;
  double own_reach = 0;  // placed: of the shape in its own frame

  // The largest distance of a point from the origin, rounded up.
  [[nodiscard]] double Reach() const {
    double reach = 0;
    for (const auto& [x, y] : points) reach = std::max(reach, std::hypot(x, y));
    return AddUp(NextUp(NextUp(reach)), AddUp(radius, error));
  }
};

Convex PlacedConvex(const Convex& shape, const Pose& pose) {
  Placed placed = Place(shape.points, pose);
  return {std::move(placed.points), shape.radius, AddUp(shape.error, placed.error)};
}

class ShapeReader {
 public:
  explicit ShapeReader(const ScenarioReader& in) : in_(in) {}

  // All convex parts of a <shape> or <position>.
  [[nodiscard]] std::vector<Convex> Read(const XmlElement& at) const {
    std::vector<Convex> parts;
    for (const auto& child : at.children) {
      if (child->name == "rectangle")
        parts.push_back(Rectangle(*child));
      else if (child->name == "circle")
        parts.push_back(Circle(*child));
      else if (child->name == "polygon")
        AddPolygon(*child, parts);
      else
        in_.Fail(*child, "is no rectangle, circle or polygon");
    }
    if (parts.empty()) in_.Fail(at, "has no rectangle, circle or polygon");
    return parts;
  }

 private:
  [[nodiscard]] PlanePoint Center(const XmlElement& at) const {
    const XmlElement* center = at.Find("center");
    return center ? in_.Point(*center) : PlanePoint{};
  }

  [[nodiscard]] Convex Rectangle(const XmlElement& at) const {
    const double length = in_.Number(in_.Require(at, "length"), 0, kFarthestPoint) / 2;
    const double width = in_.Number(in_.Require(at, "width"), 0, kFarthestPoint) / 2;
    const XmlElement* orientation = at.Find("orientation");
    const PlanePoint center = Center(at);
    const double yaw = orientation ? in_.Number(*orientation, -kMostTurned, kMostTurned) : 0;
    return PlacedConvex({{{-length, -width}, {length, -width}, {length, width}, {-length, width}}},
                        {center.x, center.y, yaw});
  }

  [[nodiscard]] Convex Circle(const XmlElement& at) const {
    return {{Center(at)}, in_.Number(in_.Require(at, "radius"), 0, kFarthestPoint), 0};
  }

  void AddPolygon(const XmlElement& at, std::vector<Convex>& parts) const {
    try {
      for (Ring& piece : ConvexPieces({in_.Points(at), {}}, kMaxObstaclePoints)) parts.push_back({std::move(piece)});
    } catch (const NoPolygon& error) {
      in_.Fail(at, error.what());
    }
  }

  const ScenarioReader& in_;
};

// ---- What an obstacle covers

// At the time steps of `time`: the parts, each with what its state's intervals add to its radius.
struct Occupancy {
  Span time{};
  std::vector<Convex> parts{};
  Span yaw{};
};

class ObstacleReader {
 public:
  ObstacleReader(const ScenarioReader& in, double step, int steps_per_window, World& world)
      : in_(in), shapes_(in), step_(step), steps_per_window_(steps_per_window), world_(world) {}

  void ReadStanding(const XmlElement& at, const std::string& name) {
    AddStanding(name, AtState(shapes_.Read(in_.Require(at, "shape")), in_.Require(at, "initialState")));
  }

  void ReadEnvironment(const XmlElement& at, const std::string& name) {
    AddStanding(name, {{}, shapes_.Read(in_.Require(at, "shape"))});
  }

  void ReadMoving(const XmlElement& at, const std::string& name) {
    std::vector<Occupancy> motion;
    const XmlElement* const shape = at.Find("shape");
    if (const XmlElement* state = at.Find("initialState"); state && shape)
      motion.push_back(AtState(shapes_.Read(*shape), *state));
    std::size_t known = motion.size();
    if (const XmlElement* trajectory = at.Find("trajectory")) {
      const std::vector<Convex> parts = shapes_.Read(in_.Require(at, "shape"));
      for (const XmlElement* state : trajectory->All("state")) motion.push_back(AtState(parts, *state));
    }
    if (const XmlElement* set = at.Find("occupancySet"))
      for (const XmlElement* each : set->All("occupancy"))
        motion.push_back({in_.Interval(in_.Require(*each, "time"), -kLastStep, kLastStep),
                          shapes_.Read(in_.Require(*each, "shape"))});
    // A set that begins with the state covers what both do then.
    if (known == 1 && motion.size() > 1 && motion[0].time == motion[1].time) {
      std::ranges::copy(motion[0].parts, std::back_inserter(motion[1].parts));
      motion[1].yaw = motion[0].yaw;
      motion.erase(motion.begin());
      known = 0;
    }
    if (motion.empty()) in_.Fail(at, "has no state and no occupancy");
    if (motion.size() == known) {
      world_.notes.push_back(fmt::format("No prediction of {}: it is taken to stand where it is.", name));
      return AddStanding(name, motion.front());
    }
    AddMoving(at, name, motion);
  }

  // The last step of the first prediction that ends.
  [[nodiscard]] const std::optional<double>& first_end() const { return first_end_; }
  // How many states do not say which way the obstacle looks.
  [[nodiscard]] int without_orientation() const { return without_orientation_; }

 private:
  [[nodiscard]] Occupancy AtState(const std::vector<Convex>& shape, const XmlElement& state) {
    Occupancy at;
    if (const XmlElement* time = state.Find("time")) at.time = in_.Interval(*time, -kLastStep, kLastStep);
    const XmlElement& position = in_.Require(state, "position");
    const XmlElement* const orientation = state.Find("orientation");
    const Span yaw =
        orientation ? in_.Interval(*orientation, -kMostTurned, kMostTurned) : Span{-std::numbers::pi, std::numbers::pi};
    PlanePoint middle;
    const double uncertain = PositionOf(position, middle);
    at.yaw = yaw;
    bool turns = false;
    for (const Convex& part : shape) {
      turns |= part.points.size() > 1 || part.points.front() != PlanePoint{};
      if (!orientation) {  // around the position, whichever way it looks
        at.parts.push_back({{middle}, AddUp(part.Reach(), uncertain)});
        continue;
      }
      Convex placed = PlacedConvex(part, {middle.x, middle.y, yaw.middle()});
      placed.own_reach = part.Reach();
      placed.radius = AddUp(placed.radius, AddUp(uncertain, MulUp(part.Reach(), yaw.half())));
      at.parts.push_back(std::move(placed));
    }
    without_orientation_ += !orientation && turns ? 1 : 0;
    return at;
  }

  // The middle of where it may be, and the largest distance from there, rounded up.
  double PositionOf(const XmlElement& at, PlanePoint& middle) const {
    if (const XmlElement* point = at.Find("point")) {
      middle = in_.Point(*point);
      return 0;
    }
    Span x{kInfinity, -kInfinity}, y = x;
    for (const Convex& part : shapes_.Read(at))
      for (const PlanePoint& p : Grown(part.points, AddUp(part.radius, part.error))) {
        x = {std::min(x.lower, p.x), std::max(x.upper, p.x)};
        y = {std::min(y.lower, p.y), std::max(y.upper, p.y)};
      }
    middle = {x.middle(), y.middle()};
    return NextUp(NextUp(std::hypot(x.half(), y.half())));
  }

  void AddStanding(const std::string& name, const Occupancy& at) {
    for (const Convex& part : at.parts) {
      const double radius = AddUp(part.radius, part.error);
      if (part.points.size() == 1) {
        const PlanePoint& center = part.points.front();
        world_.Add(name, Obstacle::Circle(Eigen::Vector2d(center.x, center.y), radius));
      } else {
        world_.Add(name, Grown(part.points, radius));
      }
    }
  }

  void AddMoving(const XmlElement& at, const std::string& name, const std::vector<Occupancy>& motion) {
    for (std::size_t i = 0; i + 1 < motion.size(); ++i)
      if (!(motion[i].time.lower < motion[i + 1].time.lower && motion[i].time.upper <= motion[i + 1].time.upper))
        in_.Fail(at, "its states are not in the order of time");
    for (std::size_t i = 0; i == 0 || i + 1 < motion.size();) {
      std::size_t last = std::min(i + 1, motion.size() - 1);
      while (last + 1 < motion.size() && motion[last + 1].time.upper - motion[i].time.lower <= steps_per_window_)
        ++last;
      AddWindow(name, {motion.begin() + static_cast<std::ptrdiff_t>(i),
                       motion.begin() + static_cast<std::ptrdiff_t>(last) + 1});
      // The next window begins with the state that ends this one: between them nothing is left out.
      i = std::max(i + 1, last);
    }
    first_end_ = std::min(first_end_.value_or(kInfinity), motion.back().time.upper);
  }

  // The hull of all that is covered at some times. Each part of a shape moves on its own; occupancies that have other
  // parts than the one before are one set.
  void AddWindow(const std::string& name, const std::vector<Occupancy>& at) {
    const Window window{MulDown(at.front().time.lower, step_), MulUp(at.back().time.upper, step_)};
    const bool are_alike =
        std::ranges::all_of(at, [&](const Occupancy& each) { return each.parts.size() == at.front().parts.size(); });
    double turned = 0;
    for (std::size_t i = 0; i + 1 < at.size(); ++i) turned = std::max(turned, TurnedUpper(at[i].yaw, at[i + 1].yaw));
    const std::string label =
        fmt::format("{}, steps {} to {}", name, ToText(at.front().time.lower), ToText(at.back().time.upper));
    std::vector<PlanePoint> all;
    for (std::size_t p = 0; p < at.front().parts.size(); ++p) {
      std::vector<PlanePoint> hull;
      for (const Occupancy& each : at)
        for (std::size_t q = are_alike ? p : 0; q < (are_alike ? p + 1 : each.parts.size()); ++q) {
          const Convex& part = each.parts[q];
          std::ranges::copy(Grown(part.points, AddUp(AddUp(part.radius, part.error), ArcOf(part, turned))),
                            std::back_inserter(hull));
        }
      world_.Add(label, ConvexHull(std::move(hull)), window);
      if (!are_alike) break;
    }
  }

  // The most that it turns from one state to the next, the shorter way.
  static double TurnedUpper(const Span& from, const Span& to) {
    const double turned = std::abs(std::remainder(to.middle() - from.middle(), 2 * std::numbers::pi));
    if (turned + from.half() + to.half() == 0) return 0;
    return AddUp(turned + 0x1p-30, AddUp(from.half(), to.half()));  // for the rounding of both middles
  }

  // How far a corner leaves its chord while the shape turns evenly by so much: r (1 - cos(turned / 2)) <= r turned^2
  // / 8.
  static double ArcOf(const Convex& part, double turned) { return MulUp(part.own_reach, MulUp(turned, turned) / 8); }

  const ScenarioReader& in_;
  const ShapeReader shapes_;
  const double step_;
  const int steps_per_window_;
  World& world_;
  std::optional<double> first_end_;
  int without_orientation_ = 0;
};

// ---- The road

constexpr std::string_view kNotDriven[] = {"sidewalk", "crosswalk", "bicycleLane"};

struct Lanelet {
  std::string id;
  Ring left, right, area;
  std::string left_id, right_id;  // its neighbours'
  PlanePoint lower, upper;
  Span height{};
  bool is_driven = true;  // not for walking or cycling alone

  /** Whether what lies in it is road for who drives on the other one: a bridge is none for the road below. */
  [[nodiscard]] bool IsRoadFor(const Lanelet& other) const {
    return this != &other && is_driven && height.lower <= other.height.upper && other.height.lower <= height.upper;
  }
};

class RoadReader {
 public:
  RoadReader(const ScenarioReader& in, double thickness, World& world)
      : in_(in), thickness_(thickness), world_(world) {}

  void Read(const XmlElement& root) {
    for (const XmlElement* at : root.All("lanelet")) lanelets_.push_back(ReadLanelet(*at));
    for (const Lanelet& lanelet : lanelets_) {
      AddBound(lanelet, lanelet.left, lanelet.left_id, fmt::format("left bound of lanelet {}", lanelet.id));
      AddBound(lanelet, lanelet.right, lanelet.right_id, fmt::format("right bound of lanelet {}", lanelet.id));
    }
  }

  [[nodiscard]] std::size_t count() const { return lanelets_.size(); }
  [[nodiscard]] auto not_driven() const { return std::ranges::count(lanelets_, false, &Lanelet::is_driven); }
  [[nodiscard]] int inside() const { return inside_; }

 private:
  [[nodiscard]] std::string IdOf(const XmlElement& at) const {
    const std::string* id = at.Attribute("id");
    return id ? *id : "?";
  }

  [[nodiscard]] static std::string NeighbourOf(const XmlElement& at, const char* side) {
    const XmlElement* neighbour = at.Find(side);
    const std::string* id = neighbour ? neighbour->Attribute("ref") : nullptr;
    return id ? *id : "";
  }

  [[nodiscard]] Lanelet ReadLanelet(const XmlElement& at) const {
    Lanelet lanelet;
    lanelet.id = IdOf(at);
    lanelet.left = in_.Points(in_.Require(at, "leftBound"));
    lanelet.right = in_.Points(in_.Require(at, "rightBound"));
    if (lanelet.left.size() < 2 || lanelet.right.size() < 2) in_.Fail(at, "a bound has fewer than two points");
    lanelet.left_id = NeighbourOf(at, "adjacentLeft");
    lanelet.right_id = NeighbourOf(at, "adjacentRight");
    lanelet.height = HeightOf(at);
    for (const XmlElement* type : at.All("laneletType"))
      lanelet.is_driven &= std::ranges::find(kNotDriven, Trimmed(type->text)) == std::end(kNotDriven);
    lanelet.area = lanelet.right;
    lanelet.area.insert(lanelet.area.end(), lanelet.left.rbegin(), lanelet.left.rend());
    lanelet.lower = lanelet.upper = lanelet.area.front();
    for (const auto& [x, y] : lanelet.area) {
      lanelet.lower = {std::min(lanelet.lower.x, x), std::min(lanelet.lower.y, y)};
      lanelet.upper = {std::max(lanelet.upper.x, x), std::max(lanelet.upper.y, y)};
    }
    return lanelet;
  }

  // Of its points; without z, zero.
  [[nodiscard]] Span HeightOf(const XmlElement& at) const {
    Span height{kFarthestPoint, -kFarthestPoint};
    for (const char* bound : {"leftBound", "rightBound"})
      for (const XmlElement* point : in_.Require(at, bound).All("point")) {
        const XmlElement* given = point->Find("z");
        const double z = given ? in_.Number(*given, -kFarthestPoint, kFarthestPoint) : 0;
        height = {std::min(height.lower, z), std::max(height.upper, z)};
      }
    return height;
  }

  // The parts of the segment where no other lanelet has the road on both sides. A computed end is rounded, and its part
  // grown by that error.
  [[nodiscard]] std::vector<Ring> OffTheRoad(const Lanelet& own, const PlanePoint& a, const PlanePoint& b) const {
    std::vector<const Ring*> areas;
    for (const Lanelet& other : lanelets_)
      if (other.IsRoadFor(own) && other.lower.x <= std::max(a.x, b.x) && std::min(a.x, b.x) <= other.upper.x &&
          other.lower.y <= std::max(a.y, b.y) && std::min(a.y, b.y) <= other.upper.y)
        areas.push_back(&other.area);
    std::vector<Ring> parts;
    const double rounding = 0x1p-48 * (std::abs(a.x) + std::abs(a.y) + std::abs(b.x) + std::abs(b.y));
    const auto at = [&](double share) {
      return share == 0 ? a : share == 1 ? b : PlanePoint{a.x + share * (b.x - a.x), a.y + share * (b.y - a.y)};
    };
    for (const auto& part : SharesOutside(a, b, areas)) {
      const Ring ends{at(part.first), at(part.second)};
      parts.push_back(ends == Ring{a, b} ? ends : Grown(ends, rounding));
    }
    return parts;
  }

  // Whether the segment lies along the neighbour, which the file may lack.
  [[nodiscard]] bool IsBeside(const Lanelet& own, const std::string& neighbour, const PlanePoint& a,
                              const PlanePoint& b) const {
    constexpr double kPiece = 0.5, kMostPieces = 1e4;
    const double x = b.x - a.x, y = b.y - a.y, pieces = std::ceil(std::hypot(x, y) / kPiece);
    if (neighbour.empty() || !(pieces <= kMostPieces)) return false;
    return std::ranges::any_of(lanelets_, [&](const Lanelet& other) {
      if (!other.IsRoadFor(own) || other.id != neighbour) return false;
      for (double i = 0; i <= pieces; ++i)
        if (!IsNearTo(other.area, {a.x + x * (i / pieces), a.y + y * (i / pieces)})) return false;
      return true;
    });
  }
  [[nodiscard]] static bool IsNearTo(const Ring& area, const PlanePoint& p) {
    for (std::size_t i = 0; i < area.size(); ++i) {
      const PlanePoint &a = area[i], &b = area[(i + 1) % area.size()];
      const double x = b.x - a.x, y = b.y - a.y, square = x * x + y * y;
      const double share = square > 0 ? std::clamp(((p.x - a.x) * x + (p.y - a.y) * y) / square, 0.0, 1.0) : 0;
      if (std::hypot(p.x - a.x - share * x, p.y - a.y - share * y) <= CommonRoadOptions::kBeside) return true;
    }
    return false;
  }

  void AddBound(const Lanelet& own, const Ring& bound, const std::string& neighbour, const std::string& name) {
    Ring run{bound.front()};
    for (std::size_t i = 0; i + 1 < bound.size(); ++i) {
      if (bound[i] == bound[i + 1]) continue;
      const bool is_beside = IsBeside(own, neighbour, bound[i], bound[i + 1]);
      const std::vector<Ring> parts = is_beside ? std::vector<Ring>() : OffTheRoad(own, bound[i], bound[i + 1]);
      if (parts != std::vector<Ring>{Ring{bound[i], bound[i + 1]}}) {
        inside_ += is_beside ? 0 : 1;
        if (run.size() > 1) world_.Add(name, run);
        for (const Ring& part : parts) world_.Add(name, part);
        run = {bound[i + 1]};
        continue;
      }
      run.push_back(bound[i + 1]);
      if (IsThin(run)) continue;
      run.pop_back();
      world_.Add(name, run);
      run = {bound[i], bound[i + 1]};
    }
    if (run.size() > 1) world_.Add(name, run);
  }

  // Whether all points lie near the chord, none of them behind its ends.
  [[nodiscard]] bool IsThin(const Ring& run) const {
    constexpr std::size_t kLongest = 1000;
    const PlanePoint &a = run.front(), &b = run.back();
    const double x = b.x - a.x, y = b.y - a.y, length = std::hypot(x, y);
    if (run.size() > kLongest || !(length > 0)) return false;
    return std::ranges::all_of(run, [&](const PlanePoint& p) {
      const double along = ((p.x - a.x) * x + (p.y - a.y) * y) / length;
      const double across = std::abs(x * (p.y - a.y) - y * (p.x - a.x)) / length;
      return -thickness_ <= along && along <= length + thickness_ && (across <= thickness_ || Turn(a, b, p) == 0);
    });
  }

  const ScenarioReader& in_;
  const double thickness_;
  World& world_;
  std::vector<Lanelet> lanelets_;
  int inside_ = 0;
};

}  // namespace

World ReadCommonRoad(const std::string& path, const CommonRoadOptions& options) {
  const std::unique_ptr<XmlElement> root = ReadXml(path, ReadWhole(path, kLargestScenario));
  const ScenarioReader in(path);
  if (root->name != "commonRoad") in.Fail(*root, "is no scenario of CommonRoad");
  const std::string* version = root->Attribute("commonRoadVersion");
  const std::string* step_text = root->Attribute("timeStepSize");
  if (!version || (*version != "2020a" && *version != "2018b"))
    in.Fail(*root, fmt::format(
                       "commonRoadVersion is {}, has to be 2020a or 2018b; commonroad-io reads others and writes 2020a",
                       version ? *version : "missing"));
  if (!step_text) in.Fail(*root, "has no timeStepSize");
  const double step = in.Checked(*root, *step_text, 1e-6, 1e3);
  World world;
  RoadReader road(in, options.thickness, world);
  road.Read(*root);
  ObstacleReader obstacles(in, step, options.steps_per_window, world);
  std::map<std::string, int> counts;
  for (const auto& child : root->children) {
    const std::string kind = in.KindOf(*child);
    if (!kind.ends_with("Obstacle")) continue;
    ++counts[kind];
    const std::string* id = child->Attribute("id");
    const std::string name = fmt::format("{} {}", kind, id ? *id : "?");
    if (kind == "staticObstacle")
      obstacles.ReadStanding(*child, name);
    else if (kind == "environmentObstacle")
      obstacles.ReadEnvironment(*child, name);
    else if (kind == "dynamicObstacle" || kind == "phantomObstacle")
      obstacles.ReadMoving(*child, name);
    else
      in.Fail(*child, "is no kind of obstacle that is known");
  }
  std::string text = fmt::format("{} lanelets", road.count());
  for (const auto& [kind, count] : counts) text += fmt::format(", {} {}", count, kind);
  world.notes.insert(world.notes.begin(), text + ".");
  world.notes.push_back(fmt::format(
      "The boundary: bounds of lanelets where no neighbour is within {} m; {} segments are left out where they lie "
      "inside another lanelet. Lanelets have open ends, and a change to a neighbour's lane in the other direction is "
      "allowed.",
      CommonRoadOptions::kBeside, road.inside()));
  if (road.not_driven() > 0)
    world.notes.push_back(fmt::format("{} lanelets are {}: no road, so bounds beside and under them stay.",
                                      road.not_driven(), fmt::join(kNotDriven, ", ")));
  if (obstacles.without_orientation() > 0)
    world.notes.push_back(
        fmt::format("{} states have no orientation: there an obstacle covers what it does whichever way it looks.",
                    obstacles.without_orientation()));
  if (obstacles.first_end())
    world.notes.push_back(fmt::format(
        "Windows are seconds from time step 0, of {} s. From one state to the next, an obstacle is taken to move on a "
        "straight line and to turn evenly. The first prediction ends at {} s: of later times nothing is known.",
        ToText(step), RoundedDown(*obstacles.first_end() * step)));
  return world;
}

}  // namespace forereach
