#include "page/detail.h"

#include <algorithm>
#include <utility>

#include "forereach/certify/explain.h"
#include "forereach/numerics/size.h"
#include "records/outlines.h"

namespace forereach {
namespace {

constexpr int kMostSearched = 20'000;  // observations

void AddBinding(const Tube& tube, PageDetail& detail) {
  const int t = detail.binding;
  if (t < 0 || t > tube.length()) return;
  for (int k = 0; k < tube.slice(t).dim(); ++k) {
    const Interval hull = tube.hull(t, k);
    detail.hull_lower.push_back(hull.lower);
    detail.hull_upper.push_back(hull.upper);
    if (t == tube.length()) continue;
    const ResidualBounds& envelope = tube.step(t).envelope;
    detail.envelope_lower.push_back(envelope.lower[ToSize(k)]);
    detail.envelope_upper.push_back(envelope.upper[ToSize(k)]);
  }
}

// For a person, in plain arithmetic; one pass over the observations.
void AddNearest(const Problem& problem, const JudgedCandidate& judged, const Tube& tube, PageDetail& detail) {
  const int t = detail.binding;
  const Transitions& known = problem.transitions;
  if (t < 0 || t >= tube.length() || t >= judged.candidate.num_steps || known.size() > kMostSearched) return;
  Eigen::VectorXd z(known.z.cols());
  const Eigen::VectorXd center = tube.slice(t).CenterVector();
  z << center, Eigen::Map<const Eigen::VectorXd>(judged.candidate.control[t], z.size() - center.size());
  const Eigen::MatrixXd apart = (known.z.rowwise() - z.transpose()).cwiseAbs();
  for (Eigen::Index k = 0; k < center.size(); ++k) {
    const Eigen::VectorXd weights = problem.declaration.lipschitz.row(k);
    Eigen::Index nearest = -1;
    double distance = kNoNumber;
    if (known.size() > 0 && !weights.isZero(0)) distance = (apart * weights).minCoeff(&nearest);
    detail.nearest.push_back(static_cast<int>(nearest));
    detail.nearest_distance.push_back(distance);
  }
}

void AddBodies(const Problem& problem, const Tube& tube, PageDetail& detail) {
  if (problem.body == Body{}) return;
  const BodyOutlines body(problem);
  std::vector<std::vector<Picture::Polygon>> bodies;
  const int steps = std::min(static_cast<int>(detail.sketch.parts.size()) - 1, tube.length());
  for (int t = 0; t <= steps; ++t) bodies.push_back(body.At(tube.slice(t).CenterVector()));
  if (auto sketch = MakeSketch(bodies)) detail.bodies = std::move(*sketch);
}

// Adds the tube to the detail. @return why there is none; empty otherwise.
std::string AddTube(const Certifier& certifier, const JudgedCandidate& judged, const Decision& again, const Tube& tube,
                    PageDetail& detail) {
  const bool is_certified = again.outcome == Outcome::kCertified;
  detail.part = again.part;
  detail.binding = is_certified ? again.closest_step : again.step;
  if (again.outcome == Outcome::kFalsified && again.step < 0)
    return "the observations contradict the declaration, so there is no tube";
  AddBinding(tube, detail);
  AddNearest(certifier.problem(), judged, tube, detail);
  if (certifier.problem().projection.rows() != 2) return "its safety coordinates are not planar";
  auto sketch = MakeSketch(Sweeps(certifier, tube, is_certified ? tube.length() : again.step));
  if (!sketch) return "its tube has no finite outline";
  detail.sketch = std::move(*sketch);
  AddBodies(certifier.problem(), tube, detail);
  return "";
}

}  // namespace

void Describe(const Certifier& certifier, const JudgedCandidate& judged, const Decision& again, const Tube& tube,
              PageDetail& detail) {
  detail.start_utime = judged.candidate.start_utime;
  detail.step_us = judged.candidate.step_us;
  detail.steps = judged.candidate.num_steps;
  detail.missing = judged.IsAnsweredBy(again) ? AddTube(certifier, judged, again, tube, detail)
                                              : "this program decides it otherwise: replay it";
}

}  // namespace forereach
