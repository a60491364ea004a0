/** Whether a method falls where the paper has it: on which side, and how far from the paper's point. */
#pragma once

#include <optional>
#include <string>

namespace forereach::research {

/** A method at one N: coverage of complete tubes in group B, none where no tube is complete, and recall of group C. */
struct Point {
  std::optional<double> coverage, recall;
};

/** A coverage this much below one is a missed target, and a recall up to this of no use. */
inline constexpr double kSideBand = 0.05;
/** As near as this, in coverage and in recall, a point is the paper's. */
inline constexpr double kPointBand = 0.1;

/** "unsound": coverage below 1 - kSideBand. "uninformative": recall at most kSideBand. Or both, or
"sound and informative". No complete tube misses nothing. */
[[nodiscard]] std::string SideOf(const Point& point);

/** Whether ours has the paper's side, and a coverage and recall within kPointBand of the paper's. A coverage that
only one of the two has is not reproduced. */
[[nodiscard]] bool IsReproduced(const Point& ours, const Point& paper);

}  // namespace forereach::research
