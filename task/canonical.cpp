#include "task/canonical.h"

#include <bit>

#include "forereach/residual/growing_disturbance.h"
#include "forereach/safety/grid_map.h"

namespace forereach {
namespace {

void AppendLittleEndian(std::string& bytes, std::uint64_t word) {
  for (int shift = 0; shift < 64; shift += 8) bytes.push_back(static_cast<char>(word >> shift & 0xff));
}

CanonicalBytes Begin(std::string_view kind, const NominalModel& model) {
  CanonicalBytes bytes(kind);
  bytes.Texts(model.state_names());
  bytes.Texts(model.input_names());
  return bytes;
}

}  // namespace

void CanonicalBytes::Text(std::string_view text) {
  Count(static_cast<std::int64_t>(text.size()));
  bytes_ += text;
}

void CanonicalBytes::Texts(const std::vector<std::string>& texts) {
  Count(static_cast<std::int64_t>(texts.size()));
  for (const std::string& text : texts) Text(text);
}

void CanonicalBytes::Count(std::int64_t count) { AppendLittleEndian(bytes_, static_cast<std::uint64_t>(count)); }

void CanonicalBytes::Number(double value) {
  AppendLittleEndian(bytes_, std::bit_cast<std::uint64_t>(value == 0 ? 0.0 : value));
}

void CanonicalBytes::Numbers(const Eigen::Ref<const Eigen::MatrixXd>& matrix) {
  Count(matrix.rows());
  Count(matrix.cols());
  for (Eigen::Index i = 0; i < matrix.rows(); ++i)
    for (Eigen::Index j = 0; j < matrix.cols(); ++j) Number(matrix(i, j));
}

Digest TaskDigest(std::string_view task, std::string_view model) {
  if (model.empty()) return DigestOf(task);
  CanonicalBytes bytes("forereach task");
  bytes.Text(task);
  bytes.Text(model);
  return bytes.digest();
}

Digest ModelDigest(const NominalModel& model) {
  CanonicalBytes bytes = Begin("forereach model", model);
  bytes.Text(model.description());
  return bytes.digest();
}

Digest DeclarationDigest(const NominalModel& model, const Declaration& declaration) {
  CanonicalBytes bytes = Begin("forereach declaration", model);
  bytes.Numbers(declaration.lipschitz);
  bytes.Numbers(declaration.noise_bound);
  const auto add = [&](const char* name, const Eigen::VectorXd& bounds) {
    if (bounds.isZero(0)) return;  // none and zeros declare the same
    bytes.Text(name);
    bytes.Numbers(bounds);
  };
  // What is not declared adds no bytes: a key that is new changes the digest of no task without it.
  add("disturbance", declaration.disturbance);
  if (declaration.growing) {
    bytes.Text("growing disturbance");
    for (const ExpressionText& bound : declaration.growing->bounds()) bytes.Text(bound.text);
  }
  add("state_error", declaration.state_error);
  add("input_error", declaration.input_error);
  if (declaration.given_are_exact && declaration.HasErrorInZ()) bytes.Text("given are exact");
  if (!declaration.affine.rows.empty()) {
    bytes.Text("affine");
    for (const std::vector<int>* indices : {&declaration.affine.rows, &declaration.affine.columns}) {
      bytes.Count(std::ssize(*indices));
      for (const int index : *indices) bytes.Count(index);
    }
    if (!declaration.affine.rest.isZero(0)) {
      bytes.Text("rest");
      bytes.Numbers(declaration.affine.rest);
    }
  }
  if (!declaration.regions.empty()) {
    bytes.Text("regions");
    bytes.Count(std::ssize(declaration.regions));
    for (const Region& region : declaration.regions) {
      bytes.Count(std::ssize(region.box));
      for (const auto& [variable, range] : region.box) {
        bytes.Count(variable);
        bytes.Number(range.lower);
        bytes.Number(range.upper);
      }
      bytes.Numbers(region.lipschitz);
    }
    for (const auto& [of, name] :
         {std::pair(&Region::disturbance, "disturbance in regions"),
          std::pair(&Region::noise_bound, "noise in regions"), std::pair(&Region::bound, "bounds in regions")}) {
      if (!declaration.AnyRegionHas(of)) continue;
      bytes.Text(name);
      for (const Region& region : declaration.regions) bytes.Numbers(region.*of);
    }
  }
  return bytes.digest();
}

Digest ObservationsDigest(const NominalModel& model, const Transitions& transitions) {
  CanonicalBytes bytes = Begin("forereach observations", model);
  bytes.Numbers(transitions.z);
  bytes.Numbers(transitions.x_next);
  if (!transitions.longer.isZero(0)) {
    bytes.Text("dt_error");
    bytes.Numbers(transitions.longer);
  }
  return bytes.digest();
}

Digest ObstaclesDigest(const std::vector<Obstacle>& obstacles) {
  CanonicalBytes bytes("forereach obstacles");
  bytes.Count(static_cast<std::int64_t>(obstacles.size()));
  for (const Obstacle& obstacle : obstacles) {
    bytes.Count(static_cast<std::int64_t>(obstacle.kind()));
    bytes.Count(static_cast<std::int64_t>(obstacle.points().size()));
    for (const Eigen::VectorXd& point : obstacle.points()) bytes.Numbers(point);
    bytes.Number(obstacle.radius());
    bytes.Number(obstacle.offset());
    if (obstacle.grid()) {
      const GridMap& map = MapOf(obstacle);
      for (const double number : {map.resolution, map.origin[0], map.origin[1], map.yaw}) bytes.Number(number);
      for (const int count : {map.width, map.height, map.outside_is_free ? 1 : 0}) bytes.Count(count);
      std::string cells;
      for (const bool is_occupied : map.occupied) cells += is_occupied ? '#' : '.';
      bytes.Text(cells);
    }
    // A word before each: obstacles with different fields never have the same bytes.
    if (!obstacle.name().empty()) {
      bytes.Text("named");
      bytes.Text(obstacle.name());
    }
    if (!obstacle.motion()) continue;
    const ObstacleMotion& motion = *obstacle.motion();
    bytes.Text("motion");
    bytes.Numbers(motion.velocity);
    for (const double number : {motion.uncertainty, motion.growth, motion.growth_rate}) bytes.Number(number);
    for (const std::int64_t time : {motion.stamp_us, motion.from_us, motion.until_us}) bytes.Count(time);
  }
  return bytes.digest();
}

Grounds GroundsOf(const Digest& config, const Problem& problem, const std::vector<Obstacle>& obstacles) {
  const NominalModel& model = *problem.model;
  return {config, ModelDigest(model), DeclarationDigest(model, problem.declaration),
          ObservationsDigest(model, problem.transitions), ObstaclesDigest(obstacles)};
}

}  // namespace forereach
