/** Draws a run from above: obstacles, certified tubes and the driven path. It has shapes only and does not read
logs. */
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "forereach/safety/obstacle.h"
#include "lcmtypes/bad_input.h"
#include "records/svg.h"

namespace forereach {

/** A picture cannot be written; the text names the file and the reason. */
class PictureError : public BadInput {
 public:
  using BadInput::BadInput;
};

/** Everything in metres, x to the right and y up, to one scale. A polygon is convex, its corners in order. */
struct Picture {
  using Polygon = Svg::Points;

  struct Circle {
    Eigen::Vector2d center = Eigen::Vector2d::Zero();
    double radius = 0;
  };

  std::string title;
  std::vector<std::string> key_numbers;  ///< Shown in one line below the title.

  std::vector<Obstacle>
      obstacles;  ///< In the plane; those that move as they are at their stamp, and where they will be.

  std::vector<Polygon> executed;   ///< Certified slices of executed steps, or what the body sweeps in them.
  std::vector<Polygon> certified;  ///< The same of steps that newer plans replaced.
  std::vector<std::vector<Polygon>> abstained;  ///< Tubes refused for an obstacle (S), each up to
                                                ///< the slice that may touch it.

  std::vector<Polygon> expected;  ///< A tube of a plan that was not sent, and what the legend calls it.
  std::string expected_name = "tube without obstacles";
  std::vector<Eigen::Vector2d> observations;  ///< Where recorded transitions begin.

  std::vector<Eigen::Vector2d> path;   ///< Measured positions, from the start on.
  std::vector<Polygon> bodies;         ///< The parts of the robot's body at some of them.
  std::vector<Eigen::Vector2d> stops;  ///< Positions of stops before the goal.
  std::optional<Circle> goal;
};

/** The files for a picture with this name: the name itself if it ends in .svg or .png; NAME.svg and NAME.png if it has
no ending. Creates no file.
@throws PictureError for another ending, for a directory, or if the directory of the file does not exist. */
[[nodiscard]] std::vector<std::string> PictureFiles(const std::string& name);

/** Writes a drawing, on white, to a .svg file, or to a .png file by librsvg.
@param width, height pixels, 200 to 10000 each.
@throws PictureError for another ending or size, OutputError (output_file.h) if the file cannot be written: it is whole,
or not there. */
void WriteSvg(const std::string& path, int width, int height, const std::string& drawing);

/** Writes `picture` to a .svg or .png file. @throws as WriteSvg. */
void DrawPicture(const Picture& picture, const std::string& path, int width = 1200, int height = 800);

}  // namespace forereach
