#include "certifier/safety/placement.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

#include "certifier/numerics/size.h"
#include "certifier/numerics/text.h"

namespace forereach {
namespace {

void Require(bool good, const std::string& what) {
  if (!good) throw std::invalid_argument(what);
}

void RequireSize(double size, const std::string& what) {
  Require(size >= 0 && size < kInfinity, what + " " + ToText(size) + " is negative or not finite");
}

void Validate(const Body& body, int dim, int num_states) {
  Require(body.heading < num_states && (body.heading < 0 || dim >= 2),
          "body: heading " + std::to_string(body.heading) + " is no state, or the body is in one dimension");
  Require(1 <= body.parts.size() && body.parts.size() <= kMaxBodyParts,
          "body: " + std::to_string(body.parts.size()) + " parts, must be 1 to " + std::to_string(kMaxBodyParts));
  std::size_t points = 0;
  for (std::size_t i = 0; i < body.parts.size(); ++i) {
    const BodyPart& part = body.parts[i];
    const std::string name = "body: part " + std::to_string(i) + ": ";
    RequireSize(part.radius, name + "radius");
    Require(!part.points.empty(), name + "no points");
    for (const Eigen::Vector3d& point : part.points) {
      Require(point.allFinite(), name + "a point is not finite");
      for (int k = dim; k < kMaxSafetyDim; ++k)
        Require(point[k] == 0, name + "a point has an entry " + std::to_string(k) + ", there are " +
                                   std::to_string(dim) + " safety coordinates");
    }
    points += part.points.size();
  }
  Require(points <= kMaxBodyPoints,
          "body: " + std::to_string(points) + " points, must be at most " + std::to_string(kMaxBodyPoints));
}

void Validate(const Between& between, int dim) {
  Require(between.acceleration.size() == dim,
          "between: " + std::to_string(between.acceleration.size()) + " accelerations, must be " + std::to_string(dim));
  for (const double bound : between.acceleration) RequireSize(bound, "between: acceleration");
  RequireSize(between.turn_rate, "between: turn_rate");
  RequireSize(between.turn_acceleration, "between: turn_acceleration");
  Require(between.period > 0 && between.period < kInfinity,
          "between: period " + ToText(between.period) + " is not positive or not finite");
}

// bound * period^2 / 8, rounded up.
double Deviation(double bound, double period) { return MulUp(MulUp(bound, MulUp(period, period)), 0.125); }

double LengthUpper(double x, double y, double z = 0) {
  return SqrtUp((sqr(Interval(x)) + sqr(Interval(y)) + sqr(Interval(z))).upper);
}

// The rotation over a slice.
struct Rotation {
  Interval cosine, sine;              // at the center
  Interval cosine_range, sine_range;  // over the slice
  Interval half_square;               // (x_heading - c)^2 / 2 over the slice

  Rotation(double center, double half_width) noexcept
      : cosine(cos(Interval(center))),
        sine(sin(Interval(center))),
        cosine_range(cos(Interval(SubDown(center, half_width), AddUp(center, half_width)))),
        sine_range(sin(Interval(SubDown(center, half_width), AddUp(center, half_width)))),
        half_square(0, HalfUp(MulUp(half_width, half_width))) {}
};

}  // namespace

Placement::Placement(const Eigen::MatrixXd& projection, const Body& body, const std::optional<Between>& between,
                     int num_states)
    : projection_(projection, num_states), heading_(body.heading), sweeps_(between.has_value()) {
  Validate(body, dim(), num_states);
  double turn = 0;
  if (between) {
    Validate(*between, dim());
    for (std::size_t k = 0; k < ToSize(dim()); ++k)
      bulge_[k] = Deviation(between->acceleration[static_cast<Eigen::Index>(k)], between->period);
    turn = Deviation(AddUp(MulUp(between->turn_rate, between->turn_rate), between->turn_acceleration), between->period);
  }
  for (const BodyPart& part : body.parts) {
    parts_.push_back({num_points(), static_cast<int>(part.points.size()), part.radius});
    for (const Eigen::Vector3d& q : part.points) {
      points_.push_back({q, heading_ < 0 ? 0 : MulUp(LengthUpper(q[0], q[1]), turn)});
      reach_ = std::max(reach_, AddUp(AddUp(LengthUpper(q[0], q[1], q[2]), points_.back().turn), part.radius));
    }
  }
  Require(reach_ < kInfinity, "body: its size is not finite");
}

Hull Placement::EncloseHull(const Zonotope& slice, std::span<const double> half_width) const noexcept {
  Hull hull = projection_.EncloseHull(slice, half_width);
  for (std::size_t k = 0; k < ToSize(dim()); ++k) hull.half_width[k] = AddUp(hull.half_width[k], bulge_[k]);
  return hull;
}

void Placement::Enclose(const Zonotope& slice, std::span<const double> half_width, Zonotope* places) const noexcept {
  const std::span<const MatrixEntry> linear = projection_.entries();
  std::array<Interval, kMaxSafetyDim> frame;
  frame.fill(Interval(0));
  for (const MatrixEntry& entry : linear)
    frame[ToSize(entry.row)] += entry.value * Interval(slice.center(entry.column));

  std::array<MatrixEntry, kMaxSafetyDim * kMaxStates + 2> jacobian;
  std::ranges::copy(linear, jacobian.begin());
  std::optional<Rotation> rotation;
  if (heading_ >= 0) rotation.emplace(slice.center(heading_), half_width[ToSize(heading_)]);
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const Interval forward(points_[i].place[0]), left(points_[i].place[1]), up(points_[i].place[2]);
    std::array<Interval, kMaxSafetyDim> value = frame;
    std::array<double, kMaxSafetyDim> spread = bulge_;
    std::size_t entries = linear.size();
    if (heading_ < 0 || points_[i].place.isZero(0)) {
      value[0] += forward, value[1] += left, value[2] += up;
    } else {
      const Rotation& r = *rotation;
      value[0] += r.cosine * forward - r.sine * left;
      value[1] += r.sine * forward + r.cosine * left;
      value[2] += up;
      jacobian[entries++] = {0, heading_, -(r.sine * forward + r.cosine * left)};
      jacobian[entries++] = {1, heading_, r.cosine * forward - r.sine * left};
      const std::array remainder{-(r.cosine_range * forward - r.sine_range * left) * r.half_square,
                                 -(r.sine_range * forward + r.cosine_range * left) * r.half_square};
      for (std::size_t k = 0; k < remainder.size(); ++k) {
        const double middle = remainder[k].Middle();
        value[k] += Interval(middle);
        spread[k] = AddUp(spread[k], remainder[k].DistanceUpper(middle));
      }
    }
    EncloseAffineImage({value.data(), ToSize(dim())}, {jacobian.data(), entries}, slice, half_width, places[i]);
    for (int k = 0; k < dim(); ++k) places[i].AppendAxis(k, spread[ToSize(k)]);
  }
}

}  // namespace forereach
