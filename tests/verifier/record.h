/** A certifier's tube as a record for the verifier: what `forereach certify --json` writes, without the file. */
#pragma once

#include <algorithm>
#include <span>

#include "forereach/certify/certifier.h"
#include "forereach/certify/tube.h"
#include "forereach/safety/separation.h"
#include "forereach/sets/zonogon.h"
#include "verifier/verifier.h"

namespace forereach {

[[nodiscard]] inline verifier::RecordedSlice RecordOf(const Certifier& certifier, const Tube& tube, int t,
                                                      std::span<const Obstacle> obstacles, const Schedule& schedule) {
  const Zonotope& slice = tube.slice(t);
  const int n = slice.dim();
  verifier::RecordedSlice record;
  record.center = slice.CenterVector();
  record.half_width.resize(n);
  record.lower.resize(n);
  record.upper.resize(n);
  for (int k = 0; k < n; ++k) {
    record.half_width[k] = slice.HalfWidthUpper(k);
    record.lower[k] = slice.Hull(k).lower;
    record.upper[k] = slice.Hull(k).upper;
  }
  record.generators = slice.GeneratorMatrix();
  record.has_generators = true;
  Zonotope projected;
  certifier.projection().Enclose(slice, tube.half_width(t), projected);
  if (t < certifier.safety().NumUnits(tube))
    for (const Obstacle& obstacle : obstacles)
      record.clearance.push_back(certifier.SeparateSlice(tube, t, obstacle, schedule).clearance());
  record.radius = RadiusUpper(projected);
  if (t == tube.length()) return record;
  const StepRecord& step = tube.step(t);
  record.envelope_lower = Eigen::Map<const Eigen::VectorXd>(step.envelope.lower.data(), n);
  record.envelope_upper = Eigen::Map<const Eigen::VectorXd>(step.envelope.upper.data(), n);
  record.remainder = Eigen::Map<const Eigen::VectorXd>(step.remainder.half_width.data(), n);
  return record;
}

[[nodiscard]] inline verifier::Certificate CertificateOf(const Certifier& certifier, const Plan& plan,
                                                         const Zonotope& initial_set,
                                                         const std::vector<Obstacle>& obstacles, const Tube& tube) {
  verifier::Certificate certificate;
  certificate.initial_set.center = initial_set.CenterVector();
  certificate.initial_set.generators = initial_set.GeneratorMatrix();
  certificate.controls.resize(plan.num_inputs, plan.num_steps);
  for (int t = 0; t < plan.num_steps; ++t)
    for (int i = 0; i < plan.num_inputs; ++i) certificate.controls(i, t) = plan.input(t)[static_cast<std::size_t>(i)];
  certificate.obstacles = obstacles;
  certificate.schedule = plan.schedule;
  for (int t = 0; t <= tube.length(); ++t)
    certificate.slices.push_back(RecordOf(certifier, tube, t, obstacles, plan.schedule));
  return certificate;
}

}  // namespace forereach
