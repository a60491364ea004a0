/** Unsafe sets O in the safety coordinates y = P x in R^p, in metres. All are closed, and convex but for a grid, which
is a union of convex ones.

A convex unsafe set is a core plus a ball. The core is the convex hull of points, or a half-space:
    O = core + {y : |y|_2 <= radius}. */
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "forereach/numerics/directed.h"
#include "forereach/numerics/limits.h"
#include "forereach/safety/motion.h"
#include "forereach/sets/eigen.h"

namespace forereach {

/** Bytes of an obstacle's name: a message on the bus has room for it. */
inline constexpr int kMaxObstacleName = 31;

/** What keeps a text from being a name; empty if nothing does. A name begins with a letter; letters, digits and any of
_-.:/ follow, all of them ASCII. So it cannot break a log line, a page or a terminal, nor pass for a sentence. */
[[nodiscard]] std::string WhyNoName(std::string_view text);

class OccupancyGrid;

class Obstacle final {
 public:
  // As in lcmtypes/obstacle_shape_t.lcm.
  enum class Kind { kCircle = 1, kBox = 2, kPolygon = 3, kHalfSpace = 4, kGrid = 5 };

  /** @name Factories. Each throws std::invalid_argument with value and bound if a size is wrong, an entry is not
  finite, the radius is negative, or lower > upper. */
  ///@{
  /** {y : |y - center|_2 <= radius}, p = 2. */
  [[nodiscard]] static Obstacle Circle(const Eigen::VectorXd& center, double radius);
  /** {y : lower <= y <= upper}, p = 1, 2 or 3. */
  [[nodiscard]] static Obstacle AxisBox(const Eigen::VectorXd& lower, const Eigen::VectorXd& upper);
  /** The convex hull of 3 to 16 points in any order, p = 2. */
  [[nodiscard]] static Obstacle Polygon(const std::vector<Eigen::VectorXd>& vertices);
  /** {y : normal . y >= offset}, p = 1, 2 or 3. The normal points into the unsafe side and is not zero. */
  [[nodiscard]] static Obstacle HalfSpace(const Eigen::VectorXd& normal, double offset);
  /** The occupied cells of a map (occupancy_grid.h), p = 2. @param grid not null. */
  [[nodiscard]] static Obstacle Grid(std::shared_ptr<const OccupancyGrid> grid);
  /** This obstacle, moving: the points and the radius are those at the motion's stamp. A number that is not finite, a
  negative growth or an empty window throws, too, and so does a grid. */
  [[nodiscard]] Obstacle Moving(const ObstacleMotion& motion) const;
  /** This obstacle with a name for people, by which nothing is decided; empty: none. Several obstacles may have the
  same name, as the pieces of one thing do. Throws if WhyNoName has a reason. */
  [[nodiscard]] Obstacle Named(std::string_view name) const;
  ///@}

  [[nodiscard]] Kind kind() const { return kind_; }
  [[nodiscard]] int dim() const { return dim_; }
  /** Nothing if the obstacle stands. */
  [[nodiscard]] const std::optional<ObstacleMotion>& motion() const { return motion_; }
  /** Empty if it has none. */
  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] double radius() const { return radius_; }
  [[nodiscard]] double offset() const { return offset_; }
  /** Null if it is no grid. */
  [[nodiscard]] const std::shared_ptr<const OccupancyGrid>& grid() const { return grid_; }
  /** The convex obstacles whose union it is: a grid's blocks; of another, itself. They have no motion and no name of
  their own. */
  [[nodiscard]] std::span<const Obstacle> convex() const;
  /** The defining vectors, none of a grid: a circle's center, a box's lower and upper corner, a polygon's vertices in
  the given order, or a half-space's normal. */
  [[nodiscard]] const std::vector<Eigen::VectorXd>& points() const { return points_; }
  /** The points whose convex hull is the core; for a box its 2^p corners. Empty for a half-space and a grid. */
  [[nodiscard]] const std::vector<Eigen::Vector3d>& hull() const { return hull_; }
  /** @name The bounding box of the core, or of all blocks. For a half-space it is all of R^p. Unused coordinates are
   * zero. */
  ///@{
  [[nodiscard]] const Eigen::Vector3d& lower() const { return lower_; }
  [[nodiscard]] const Eigen::Vector3d& upper() const { return upper_; }
  ///@}

 private:
  Obstacle(Kind kind, int dim) : kind_(kind), dim_(dim) {}
  void SetHull(std::vector<Eigen::Vector3d> hull);

  Kind kind_;
  int dim_;
  double radius_ = 0, offset_ = 0;
  std::vector<Eigen::VectorXd> points_;
  std::shared_ptr<const OccupancyGrid> grid_;
  std::optional<ObstacleMotion> motion_;
  std::string name_;
  std::vector<Eigen::Vector3d> hull_;
  Eigen::Vector3d lower_ = Eigen::Vector3d::Constant(-kInfinity), upper_ = Eigen::Vector3d::Constant(kInfinity);
};

/** How a sentence calls an obstacle: by its name, or "obstacle 6" by its index; of a grid with the block, "cell (12,
40) of map". @param index may be that of none. @param block of a grid; -1: all of it. */
[[nodiscard]] std::string NameOf(std::span<const Obstacle> obstacles, int index, int block = -1);

/** What names of pieces begin with that together are all outside of an area to stay in: "outside:lawn". Sentences and
drawings look at it, no decision does. */
inline constexpr std::string_view kOutside = "outside:";
[[nodiscard]] inline bool IsOutside(const Obstacle& obstacle) { return obstacle.name().starts_with(kOutside); }

/** "may touch oak_2"; of a piece outside of an area to stay in, "may leave lawn". */
[[nodiscard]] std::string MayTouch(std::span<const Obstacle> obstacles, int index, int block = -1);

/** The distance in metres from a point y (p entries) to the obstacle, negative inside, in plain arithmetic. A motion is
ignored. Use it for planning, simulation and display, not for bounds. */
[[nodiscard]] double ApproximateDistance(const Obstacle& obstacle, const Eigen::VectorXd& y);

}  // namespace forereach
