/** Drawings in GeoJSON (RFC 7946): areas to keep out of or to stay in, lines and points. */
#pragma once

#include <optional>
#include <string>

#include "worlds/world.h"

namespace forereach {

struct GeoJsonOptions {
  /** The longitude and latitude in degrees where x = y = 0, x to the east and y to the north. None: coordinates are
  metres. */
  std::optional<PlanePoint> origin;
  bool are_metres = false;  ///< Coordinates are metres even if they look like degrees.
  bool keep_in = false;     ///< Areas without a property keep_in are to stay in.
  /** Of lines without a property `width`, and of points without a property `radius`, m. None: such a line or point is
  an error. */
  std::optional<double> line_width, point_radius;
};

/** A feature's Polygon or MultiPolygon is an area to keep out of or, with the property keep_in: true, one to stay in;
of these the union counts, and their boundaries are outside of it. A line is all points within half its width, a point a
disc. Areas to keep out of are exact, but with an origin: then each piece is grown by a bound on what the plane and
straight sides make of the ground, which a note states. The bound holds within 10 km of the origin and up to 80 degrees
of latitude; what lies beyond is refused. Heights are ignored. Outside of the areas to stay in is what OutsideOf
(task/keep_in.h) makes of them.
@throws ConfigError with file and place: no GeoJSON, a side that meets another one, a number out of range. */
[[nodiscard]] World ReadGeoJson(const std::string& path, const GeoJsonOptions& options);

}  // namespace forereach
