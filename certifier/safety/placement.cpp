#include "certifier/safety/placement.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
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

// Every number below is computed in plain arithmetic and has an error below kMargin times the size of what it is
// computed from: a sum of at most kMaxStates + 4 terms, each with a few roundings, and a sine and a cosine within a
// unit of their last place (interval.h) where the heading is at most kLargestHeading.
constexpr double kMargin = 0x1p-45, kTiny = std::numeric_limits<double>::min(), kLargestHeading = 0x1p20;

}  // namespace

// The rotation at the center of a slice, and how far the slice turns.
struct Placement::Rotation {
  double cosine = 1, sine = 0, half_width = 0;

  Rotation(int heading, const Zonotope& slice, std::span<const double> half_widths) noexcept {
    if (heading < 0) return;
    const double theta = slice.center(heading);
    cosine = std::cos(theta);
    sine = std::sin(theta);
    half_width = std::abs(theta) <= kLargestHeading ? half_widths[ToSize(heading)] : kInfinity;
  }
};

// Where a point of the body is, relative to the frame: the linear part and, besides it, offset +- spread.
struct Placement::Offset {
  std::array<double, kMaxSafetyDim> offset, spread, slope{};
  double size;  // of what these are computed from

  // With d = theta - c:  R(theta) q = R(c) q + R'(c) q d - d^2 / 2 R(theta') q,  and in each coordinate R(theta') q
  // lies within |R'(c) q| r + |q| r^2 / 2 of R(c) q.
  Offset(const Point& point, const Rotation& rotation, const std::array<double, kMaxSafetyDim>& bulge) noexcept {
    const Eigen::Vector3d& q = point.place;
    const double r = rotation.half_width, length = point.length;
    offset = {rotation.cosine * q[0] - rotation.sine * q[1], rotation.sine * q[0] + rotation.cosine * q[1], q[2]};
    spread = bulge;
    size = length + std::abs(q[2]) + point.turn + std::max({bulge[0], bulge[1], bulge[2]});
    if (r == 0 || length == 0) return;  // NaN goes on, and proves nothing
    slope = {-offset[1], offset[0], 0};
    const double half_square = 0.5 * r * r;
    for (std::size_t k = 0; k < 2; ++k) {
      const double range = std::abs(slope[k]) * r + length * half_square;
      const double below = -std::max(0.0, offset[k] + range) * half_square;
      const double above = std::max(0.0, range - offset[k]) * half_square;
      offset[k] += 0.5 * (below + above);
      spread[k] += 0.5 * (above - below);
    }
    size += length * (r + (1 + r + half_square) * half_square);
  }
};

Placement::Placement(const Eigen::MatrixXd& projection, const Body& body, const std::optional<Between>& between,
                     int num_states)
    : projection_(projection, num_states), heading_(body.heading), sweeps_(between.has_value()) {
  for (const MatrixEntry& entry : projection_.entries()) rows_[ToSize(entry.row)].push_back(entry);
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
      const double length = LengthUpper(q[0], q[1]);
      points_.push_back({q, length, heading_ < 0 ? 0 : MulUp(length, turn)});
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

// The linear images of one slice.
struct Placement::Image {
  const Placement& placement;
  const Zonotope& slice;
  Rotation rotation;
  std::array<double, kMaxSafetyDim> center{}, slack{}, size{};  // of P X

  Image(const Placement& of, const Zonotope& of_slice, std::span<const double> half_width) noexcept
      : placement(of), slice(of_slice), rotation(of.heading_, of_slice, half_width) {
    for (const MatrixEntry& entry : of.projection_.entries()) {
      const auto k = ToSize(entry.row);
      const double weight = entry.value.lower, x = slice.center(entry.column);
      center[k] += weight * x;
      slack[k] += std::abs(weight) * slice.slack(entry.column);
      size[k] += std::abs(weight) * (std::abs(x) + half_width[ToSize(entry.column)]);
    }
  }

  // Coordinate k of the images of the generators j .. j + 3.
  FOREREACH_INLINE Lanes Generators(std::size_t k, const Offset& point, std::size_t j) const noexcept {
    Lanes sum = AllLanes(0);
    for (const MatrixEntry& entry : placement.rows_[k])
      sum += AllLanes(entry.value.lower) * LoadLanes(slice.padded_row(entry.column).data() + j);
    if (point.slope[k] != 0)
      sum += AllLanes(point.slope[k]) * LoadLanes(slice.padded_row(placement.heading_).data() + j);
    return sum;
  }
  // The slack of the image, and the errors of center, generators, their sum and the slack itself.
  [[nodiscard]] double Slack(std::size_t k, const Offset& point) const noexcept {
    const double turned = point.slope[k] == 0 ? 0 : std::abs(point.slope[k]) * slice.slack(placement.heading_);
    return slack[k] + turned + RoundingError(kMargin, size[k] + point.size) + kTiny;
  }
};

void Placement::Enclose(const Zonotope& slice, std::span<const double> half_width, Zonotope* places,
                        InstructionSet instructions) const noexcept {
  Dispatch<&Placement::EncloseInline>(instructions, *this, slice, half_width, places);
}

void Placement::EncloseParts(const Zonotope& slice, std::span<const double> half_width, Hull* hulls,
                             InstructionSet instructions) const noexcept {
  Dispatch<&Placement::EnclosePartsInline>(instructions, *this, slice, half_width, hulls);
}

void Placement::EncloseInline(const Zonotope& slice, std::span<const double> half_width,
                              Zonotope* places) const noexcept {
  if (is_point() && !sweeps_) return projection_.Enclose(slice, half_width, places[0]);
  const Image image(*this, slice, half_width);
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const Offset point(points_[i], image.rotation, bulge_);
    Zonotope& place = places[i];
    place.Reset(dim(), slice.num_generators());
    for (int k = 0; k < dim(); ++k) {
      const auto row = ToSize(k);
      for (std::size_t j = 0; j < slice.padded_size(); j += kLaneCount)
        StoreLanes(image.Generators(row, point, j), place.mutable_row(k) + j);
      place.mutable_center(k) = image.center[row] + point.offset[row];
      place.mutable_slack(k) = image.Slack(row, point);
    }
    for (int k = 0; k < dim(); ++k) place.AppendAxis(k, point.spread[ToSize(k)]);
  }
}

void Placement::EnclosePartsInline(const Zonotope& slice, std::span<const double> half_width,
                                   Hull* hulls) const noexcept {
  const Image image(*this, slice, half_width);
  for (std::size_t part = 0; part < parts_.size(); ++part) {
    for (int i = 0; i < parts_[part].count; ++i) {
      const Point& of_body = points_[ToSize(parts_[part].first + i)];
      const Offset point(of_body, image.rotation, bulge_);
      Hull place{};
      for (std::size_t k = 0; k < ToSize(dim()); ++k) {
        Lanes sum = AllLanes(0);
        for (std::size_t j = 0; j < slice.padded_size(); j += kLaneCount) sum += Abs(image.Generators(k, point, j));
        place.center[k] = image.center[k] + point.offset[k];
        place.half_width[k] = Sum(sum) + image.Slack(k, point) + point.spread[k] + of_body.turn;
      }
      hulls[part] = i == 0 ? place : Join(hulls[part], place, dim());
    }
  }
}

}  // namespace forereach
