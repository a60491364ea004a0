/** What stands and moves in a plane, read from a map, a scenario or a drawing, and written as a task's obstacles. */
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "forereach/safety/obstacle.h"
#include "forereach/sets/box.h"
#include "task/plane.h"

namespace forereach {

/** Seconds from the start of a plan, closed. */
struct Window {
  double from = 0, until = 0;
};

struct World {
  struct Piece {
    std::string name;  ///< What it is a part of.
    Obstacle obstacle;
    std::optional<Window> window;  ///< None: always.
  };

  std::vector<Piece> pieces;
  std::vector<std::string> notes;  ///< Sentences: what was assumed, what was left out.

  /** Adds an obstacle and gives it the name that ObstacleName makes of `name`. */
  void Add(const std::string& name, const Obstacle& obstacle, std::optional<Window> window = {});
  /** Adds the convex hull of points, in pieces of at most kMaxObstaclePoints corners. Exact. */
  void Add(const std::string& name, const std::vector<PlanePoint>& points, std::optional<Window> window = {});
  /** Adds the half-plane {y : sign y_axis >= sign at}. */
  void AddBeyond(int axis, int sign, double at, const std::string& name);
};

/** An obstacle's name (WhyNoName) after what its source calls it, up to the first comma: each other character becomes
"_", those before the first letter are dropped, and the end is cut off. Empty if it begins with a digit, as a
description of cells does, or nothing is left. */
[[nodiscard]] std::string ObstacleName(std::string_view text);

/** What of a world may lie in a box of the plane. What does not is replaced by half-planes along the sides of the box
behind which it lies: outside of them nothing is known any more, so it counts as occupied. A plan that is certified in
the rest is clear of the whole. */
[[nodiscard]] World Cropped(World world, const Box& region);

/** The obstacles as a part of a task file, each with its name, if it has one, and what it is a part of as a comment,
after the notes. The numbers read back as the same doubles. @param origin what it was made of, for the first line. */
[[nodiscard]] std::string ObstaclesText(const World& world, const std::string& origin);

/** A task file's text with the obstacles in the place of its line `obstacles: []`, and the notes before them.
@throws ConfigError if it has no such line, or several. @param path its name in the message. */
[[nodiscard]] std::string WithObstacles(const std::string& task, const World& world, const std::string& origin,
                                        const std::string& path);

}  // namespace forereach
