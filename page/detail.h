/** What a page shows of one decision: found by certifying its candidate again. */
#pragma once

#include <vector>

#include <nlohmann/json.hpp>

#include "forereach/certify/certifier.h"
#include "page/page_data.h"
#include "records/recorded_case.h"
#include "records/svg.h"

namespace forereach {

/** Fills in what the second decision on a candidate found, or why there is no tube: also if it differs from the first.
@param tube of `again`, which `certifier` has made. @param obstacles of both. */
void Describe(const Certifier& certifier, const JudgedCandidate& judged, const Decision& again, const Tube& tube,
              const std::vector<Obstacle>& obstacles, PageDetail& detail);

/** Draws what a body sweeps in each unit of a tube, and the body in each, or nothing for a point. False if that has no
place in the plane; nothing is drawn then.
@param deciding the obstacle that does, or -1. @param detail its times, its binding step and its states are used. */
[[nodiscard]] bool DrawTube(const std::vector<std::vector<Svg::Points>>& units,
                            const std::vector<std::vector<Svg::Points>>& bodies, const std::vector<Obstacle>& obstacles,
                            int deciding, PageDetail& detail);

/** A group for each obstacle (DrawObstacle in records/outlines.h), in one more for those outside of an area to stay in.
@param has_names with its name, or else its number. */
void DrawObstacles(const std::vector<Obstacle>& obstacles, const std::vector<double>& times_us,
                   const Eigen::AlignedBox2d& frame, int deciding, bool has_names, Svg& svg);

/** A detail without its drawing, for page/shared.js. */
[[nodiscard]] nlohmann::json ToJson(const PageDetail& detail);

}  // namespace forereach
