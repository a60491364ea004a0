#include "research/sides.h"

#include <cmath>

namespace forereach::research {
namespace {

bool AreNear(std::optional<double> ours, std::optional<double> paper) {
  return ours && paper ? std::abs(*ours - *paper) <= kPointBand : ours.has_value() == paper.has_value();
}

}  // namespace

std::string SideOf(const Point& point) {
  const bool is_unsound = point.coverage && *point.coverage < 1 - kSideBand;
  const bool is_useless = !point.recall || *point.recall <= kSideBand;
  if (is_unsound) return is_useless ? "unsound and uninformative" : "unsound";
  return is_useless ? "uninformative" : "sound and informative";
}

bool IsReproduced(const Point& ours, const Point& paper) {
  return SideOf(ours) == SideOf(paper) && AreNear(ours.coverage, paper.coverage) && AreNear(ours.recall, paper.recall);
}

}  // namespace forereach::research
