#include "forereach/safety/placement.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "forereach/dynamics/expression.h"
#include "forereach/numerics/require.h"
#include "forereach/numerics/size.h"
#include "forereach/numerics/text.h"
#include "forereach/sets/zonotope.h"

namespace forereach {
namespace {

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
    Require(part.num_points() > 0, name + "no points");
    points += ToSize(part.num_points());
    for (const auto& place : part.places)
      Require(std::ssize(place) == dim, name + "a place has " + std::to_string(place.size()) +
                                            " expressions, there are " + std::to_string(dim) + " safety coordinates");
    if (!part.places.empty()) continue;
    for (const Eigen::Vector3d& point : part.points) {
      Require(point.allFinite(), name + "a point is not finite");
      for (int k = dim; k < kMaxSafetyDim; ++k)
        Require(point[k] == 0, name + "a point has an entry " + std::to_string(k) + ", there are " +
                                   std::to_string(dim) + " safety coordinates");
    }
  }
  Require(points <= kMaxBodyPoints,
          "body: " + std::to_string(points) + " points, must be at most " + std::to_string(kMaxBodyPoints));
}

std::optional<TextEnclosure> ExpressionsOf(const Body& body, const ExpressionNames& names) {
  if (!body.HasPlaces()) return std::nullopt;
  const std::vector<ExpressionText> all = body.Coordinates();
  TextEnclosure expressions(names, all);
  for (int i = 0; i < expressions.num_values(); ++i)
    if (const auto& [text, line, column] = all[ToSize(i)]; expressions.UsesInput(i))
      throw ExpressionError(line, column, "body: the place " + text + " uses an input");
  return expressions;
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

// bound * period^2 / 8, rounded up: how far a motion with this second derivative leaves the chord between two samples
// (docs/soundness.md, 3.9).
double Deviation(double bound, double period) { return MulUp(MulUp(bound, MulUp(period, period)), 0.125); }

double LengthUpper(double x, double y, double z = 0) {
  return SqrtUp((sqr(Interval(x)) + sqr(Interval(y)) + sqr(Interval(z))).upper);
}

// Every number below is computed in plain arithmetic and has an error below kPlaceMargin times the size of what it is
// computed from: a sum of at most kMaxStates + 4 terms, each with a few roundings, and a sine and a cosine within a
// unit of their last place (interval.h) where the heading is at most kLargestHeading.
constexpr double kPlaceMargin = 0x1p-45, kLeastNormal = std::numeric_limits<double>::min(), kLargestHeading = 0x1p20;

}  // namespace

// The rotation at the center of a slice, and how far the slice turns.
struct Placement::Rotation {
  double cosine = 1, sine = 0, half_width = 0;

  Rotation(int heading, const Zonotope& slice, std::span<const double> half_widths) noexcept {
    if (heading < 0) return;
    const double theta = slice.center(heading);
    cosine = std::cos(theta);
    sine = std::sin(theta);
    // The library's sine and cosine are within kPlaceMargin up to there; beyond, nothing is proven.
    half_width = std::abs(theta) <= kLargestHeading ? half_widths[ToSize(heading)] : kInfinity;
  }
};

// With d = theta - c:  R(theta) q = R(c) q + R'(c) q d - d^2 / 2 R(theta') q,  and in each coordinate R(theta') q lies
// within |R'(c) q| r + |q| r^2 / 2 of R(c) q: docs/soundness.md, 3.9, "A place".
void Placement::OverSlice(const Point& point, const Rotation& rotation, Sample::Point& over) const noexcept {
  const Eigen::Vector3d& q = point.place;
  const double r = rotation.half_width, length = point.length;
  const std::array turned{rotation.cosine * q[0] - rotation.sine * q[1], rotation.sine * q[0] + rotation.cosine * q[1]};
  over.size = point.size;
  for (std::size_t k = 0; k < kMaxSafetyDim; ++k) {
    over.offset[k] = k < 2 ? turned[k] : q[2];
    over.spread[k] = bulge_[k];
    over.slope[k] = 0;
  }
  if (r == 0 || length == 0) return;  // NaN goes on, and proves nothing
  const double half_square = 0.5 * r * r;
  for (std::size_t k = 0; k < 2; ++k) {
    const double slope = k == 0 ? -turned[1] : turned[0];
    const double range = std::abs(slope) * r + length * half_square;
    const double below = -std::max(0.0, turned[k] + range) * half_square;
    const double above = std::max(0.0, range - turned[k]) * half_square;
    over.slope[k] = slope;
    over.offset[k] = turned[k] + 0.5 * (below + above);
    over.spread[k] = bulge_[k] + 0.5 * (above - below);
  }
  over.size += length * (r + (1 + r + half_square) * half_square);
}

Placement::Placement(const Eigen::MatrixXd& projection, const Body& body, const std::optional<Between>& between,
                     int num_states, const ExpressionNames& names)
    : projection_(projection, num_states), heading_(body.heading), sweeps_(between.has_value()) {
  for (const MatrixEntry& entry : projection_.entries()) rows_[ToSize(entry.row)].push_back(entry);
  Validate(body, dim(), num_states);
  expressions_ = ExpressionsOf(body, names);
  num_inputs_ = static_cast<int>(names.inputs.size());
  double turn = 0;
  if (between) {
    Validate(*between, dim());
    for (std::size_t k = 0; k < ToSize(dim()); ++k)
      bulge_[k] = Deviation(between->acceleration[static_cast<Eigen::Index>(k)], between->period);
    turn = Deviation(AddUp(MulUp(between->turn_rate, between->turn_rate), between->turn_acceleration), between->period);
  }
  int linear = 0;
  for (const BodyPart& part : body.parts) {
    parts_.push_back({num_points(), part.num_points(), part.radius});
    if (!part.places.empty()) {
      for (std::size_t i = 0; i < part.places.size(); ++i, linear += dim())
        points_.push_back({Eigen::Vector3d::Zero(), 0, 0, 0, linear});
      reach_ = std::max(reach_, part.radius);
      is_at_frame_ = false;
      continue;
    }
    has_frame_ = true;
    for (const Eigen::Vector3d& q : part.points) {
      const double length = LengthUpper(q[0], q[1]);
      is_at_frame_ &= q.isZero(0);
      const double turned = heading_ < 0 ? 0 : MulUp(length, turn);
      points_.push_back(
          {q, length, turned, length + std::abs(q[2]) + turned + std::max({bulge_[0], bulge_[1], bulge_[2]})});
      reach_ = std::max(reach_, AddUp(AddUp(LengthUpper(q[0], q[1], q[2]), points_.back().turn), part.radius));
    }
  }
  Require(reach_ < kInfinity, "body: its size is not finite");
  for (std::size_t i = 0; i < PaddedToLanes(points_.size()); ++i) {
    const Point& point = points_[std::min(i, points_.size() - 1)];
    for (std::size_t k = 0; k < kMaxSafetyDim; ++k) outline_.place[k][i] = point.place[static_cast<Eigen::Index>(k)];
    outline_.length[i] = point.length, outline_.turn[i] = point.turn, outline_.size[i] = point.size;
  }
  for (const Part& part : parts_)
    for (int i = part.first; dim() == 2 && i < part.first + part.count; ++i)
      points_[ToSize(i)].side = SideOf(part, i, outline_.place);
  for (const Part& part : parts_)
    for (std::size_t i = ToSize(part.first); i < PaddedToLanes(points_.size()); ++i) outline_.radius[i] = part.radius;
  Require(!has_frame_ || !projection_.entries().empty(), "projection: is zero");
}

void Placement::EncloseHull(const Zonotope& slice, std::span<const double> half_width, Hull& hull) const noexcept {
  projection_.EncloseHull(slice, half_width, hull);
  // Between two samples a point leaves the chord by at most this (soundness 3.9).
  for (std::size_t k = 0; sweeps_ && k < ToSize(dim()); ++k) hull.half_width[k] = AddUp(hull.half_width[k], bulge_[k]);
}

void Placement::EncloseHull(const Sample& sample, Hull& hull) const noexcept {
  if (has_frame_) EncloseHull(*sample.slice, sample.half_width, hull);
  bool is_first = !has_frame_;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    if (points_[i].linear < 0) continue;
    for (std::size_t k = 0; k < ToSize(dim()); ++k) {
      const AffineEnclosure& linear = sample.linear[ToSize(points_[i].linear) + k];
      double reach = sample.points[i].spread[k];
      for (std::size_t l = 0; l < sample.half_width.size(); ++l)
        reach = AddUp(reach, MulUp(std::abs(linear.slope[l]), sample.half_width[l]));
      const double middle = sample.points[i].offset[k];
      Interval range(SubDown(middle, reach), AddUp(middle, reach));
      if (!is_first)
        range = Join(range, {SubDown(hull.center[k], hull.half_width[k]), AddUp(hull.center[k], hull.half_width[k])});
      hull.center[k] = range.IsFinite() ? range.Middle() : 0;
      hull.half_width[k] = range.DistanceUpper(hull.center[k]);
    }
    is_first = false;
  }
}

void Placement::PoseOver(const Zonotope& slice, std::span<const double> half_width, Pose& pose,
                         InstructionSet instructions) const noexcept {
  Dispatch<&Placement::PoseInline>(instructions, *this, slice, half_width, pose);
}
Hull Placement::EncloseBody(const Pose& pose, InstructionSet instructions) const noexcept {
  return Dispatch<&Placement::BodyInline>(instructions, *this, pose);
}

// |R(theta) q - R(c) q| <= |q| r, and what OverSlice adds to it is of the second order: in each coordinate at most
// (|q| + |q| r + |q| r^2 / 2) r^2 / 2.
void Placement::PoseInline(const Zonotope& slice, std::span<const double> half_width, Pose& pose) const noexcept {
  EncloseHull(slice, half_width, pose.frame);
  const Rotation rotation(heading_, slice, half_width);
  pose.cosine = rotation.cosine;
  pose.sine = rotation.sine;
  pose.turn = rotation.half_width;
  const double r = rotation.half_width, half_square = 0.5 * r * r, turn = r + 1.5 * half_square * (1 + r + half_square);
  double size = turn + reach_;
  const auto& c = pose.frame.center;
  for (std::size_t k = 0; k < ToSize(dim()); ++k) size += std::abs(c[k]) + pose.frame.half_width[k];
  pose.is_known = size < 0x1p400;  // NaN is not
  pose.width = pose.frame.half_width;
  const auto load = [](const auto& from, std::size_t i) __attribute__((always_inline)) { return LoadLanes(&from[i]); };
  const Lanes cosine = AllLanes(pose.cosine), sine = AllLanes(pose.sine);
  for (std::size_t i = 0; i < points_.size(); i += kLaneCount) {
    const Lanes x = load(outline_.place[0], i), y = load(outline_.place[1], i);
    StoreLanes(AllLanes(c[0]) + (cosine * x - sine * y), &pose.middle[0][i]);
    StoreLanes(AllLanes(c[1]) + (sine * x + cosine * y), &pose.middle[1][i]);
    if (dim() == 3) StoreLanes(AllLanes(c[2]) + load(outline_.place[2], i), &pose.middle[2][i]);
    StoreLanes(load(outline_.length, i) * AllLanes(turn) + load(outline_.turn, i), &pose.around[i]);
  }
}

Hull Placement::BodyInline(const Pose& pose) const noexcept {
  std::array<Lanes, kMaxSafetyDim> lower, upper;
  lower.fill(AllLanes(kInfinity));
  upper.fill(AllLanes(-kInfinity));
  Lanes sizes = AllLanes(0);
  for (std::size_t i = 0; i < points_.size(); i += kLaneCount) {
    const Lanes around = LoadLanes(&pose.around[i]) + LoadLanes(&outline_.radius[i]);
    for (std::size_t k = 0; k < ToSize(dim()); ++k) {
      const Lanes middle = LoadLanes(&pose.middle[k][i]);
      lower[k] = Min(middle - around, lower[k]);
      upper[k] = Max(middle + around, upper[k]);
    }
    sizes = Max(LoadLanes(&outline_.size[i]) + around, sizes);
  }
  const auto largest = [](const Lanes& x) __attribute__((always_inline)) {
    return std::max(std::max(x[0], x[1]), std::max(x[2], x[3]));
  };
  const double size = largest(sizes);
  Hull hull{};
  for (std::size_t k = 0; k < ToSize(dim()); ++k) {
    const auto& [center, half_width] = pose.frame;
    const double slack = RoundingError(kPlaceMargin, std::abs(center[k]) + half_width[k] + size) + kLeastNormal;
    const double least = -largest(-lower[k]), most = largest(upper[k]);
    hull.center[k] = pose.is_known ? 0.5 * (least + most) : 0;
    hull.half_width[k] = pose.is_known ? 0.5 * (most - least) + pose.width[k] + slack : kInfinity;
  }
  return hull;
}

// Points in the order of the clock have their sides' normals turned round.
std::array<double, 2> Placement::SideOf(const Part& part, int i, const Coordinates& of) noexcept {
  const auto& [x, y, z] = of;
  const auto next = [&](int j) { return ToSize(j + 1 < part.first + part.count ? j + 1 : part.first); };
  double area = 0;
  for (int j = part.first; j < part.first + part.count; ++j)
    area += x[ToSize(j)] * y[next(j)] - y[ToSize(j)] * x[next(j)];
  const double along_x = x[next(i)] - x[ToSize(i)], along_y = y[next(i)] - y[ToSize(i)],
               length = std::sqrt(along_x * along_x + along_y * along_y),
               scale = length > 0x1p-300 && length < 0x1p300 ? std::copysign(1 / length, area) : 0;
  return {scale * along_y, -scale * along_x};
}

void Placement::PoseOver(const Sample& sample, Pose& pose, InstructionSet instructions) const noexcept {
  PoseOver(*sample.slice, sample.half_width, pose, instructions);
  if (!expressions_) return;
  EncloseHull(sample, pose.frame);
  if (!has_frame_) pose.width = {};
  double size = 0;
  for (std::size_t i = 0; i < PaddedToLanes(points_.size()); ++i) {
    const std::size_t point = std::min(i, points_.size() - 1);
    if (points_[point].linear < 0) continue;
    double square = 0;
    for (std::size_t k = 0; k < ToSize(dim()); ++k) {
      const AffineEnclosure& linear = sample.linear[ToSize(points_[point].linear) + k];
      double reach = sample.points[point].spread[k] + sample.points[point].slack[k];
      for (std::size_t l = 0; l < sample.half_width.size(); ++l)
        reach += std::abs(linear.slope[l]) * sample.half_width[l];
      pose.middle[k][i] = sample.points[point].offset[k];
      square += reach * reach;
      size += std::abs(pose.middle[k][i]) + reach;
    }
    pose.around[i] = std::sqrt(square);
  }
  pose.is_known &= size < 0x1p400;  // NaN is not
}

// A place without a finite second order is the box of the ranges; where a coordinate has none, there may be no place at
// all, and it is everything. The margin of its slack is above the rounding of sums over the states and of sums over the
// generators.
void Placement::OverSlice(Sample& sample, std::size_t i) const noexcept {
  Sample::Point& over = sample.points[i];
  over.slope = {};
  over.size = 0;
  for (std::size_t k = 0; k < kMaxSafetyDim; ++k) over.offset[k] = over.spread[k] = 0;
  bool is_bounded = true;
  for (std::size_t k = 0; k < ToSize(dim()); ++k) {
    AffineEnclosure& linear = sample.linear[ToSize(points_[i].linear) + k];
    if (!linear.offset.IsFinite()) {
      linear.slope.fill(0);
      linear.offset = linear.range;
    }
    const bool is_finite = linear.offset.IsFinite();
    is_bounded &= is_finite;
    over.offset[k] = is_finite ? linear.offset.Middle() : 0;
    over.spread[k] = is_finite ? AddUp(bulge_[k], linear.offset.DistanceUpper(over.offset[k])) : kInfinity;
    double size = std::abs(over.offset[k]) + over.spread[k];
    for (std::size_t l = 0; l < sample.half_width.size(); ++l) size += std::abs(linear.slope[l]) * sample.half_width[l];
    over.size = std::max(over.size, size);
  }
  if (!is_bounded) std::fill_n(over.spread.begin(), dim(), kInfinity);
}

void Placement::Observe(const Zonotope& slice, std::span<const double> half_width, Sample& sample) const noexcept {
  sample.slice = &slice;
  sample.half_width = half_width;
  sample.center = sample.slack = sample.size = {};
  for (const MatrixEntry& entry : projection_.entries()) {
    const auto k = ToSize(entry.row);
    const double weight = entry.value.lower, x = slice.center(entry.column);
    sample.center[k] += weight * x;
    sample.slack[k] += std::abs(weight) * slice.slack(entry.column);
    sample.size[k] += std::abs(weight) * (std::abs(x) + half_width[ToSize(entry.column)]);
  }
  const Rotation rotation(is_at_frame_ ? -1 : heading_, slice, half_width);
  if (expressions_) {
    constexpr std::array<double, kMaxInputs> kNoInput{};
    expressions_->Enclose(slice.center(), half_width, {kNoInput.data(), ToSize(num_inputs_)},
                          {sample.linear.data(), ToSize(expressions_->num_values())});
  }
  for (std::size_t i = 0; i < points_.size(); ++i) {
    if (points_[i].linear < 0)
      OverSlice(points_[i], rotation, sample.points[i]);
    else
      OverSlice(sample, i);
    for (std::size_t k = 0; k < ToSize(dim()); ++k) sample.points[i].slack[k] = Slack(sample, i, k);
  }
}

unsigned Placement::SeparableStates() const {
  // An expression may use any state, and twice.
  if (expressions_) return 0;
  unsigned seen = heading_ >= 0 ? 1u << heading_ : 0, twice = seen;
  for (const MatrixEntry& entry : projection_.entries()) {
    twice |= seen & 1u << entry.column;
    seen |= 1u << entry.column;
  }
  return ~twice;
}

// The slack of the image, and the errors of center, generators, their sum and the slack itself.
double Placement::Slack(const Sample& sample, std::size_t i, std::size_t k) const noexcept {
  const Sample::Point& point = sample.points[i];
  if (points_[i].linear >= 0) {
    const AffineEnclosure& linear = sample.linear[ToSize(points_[i].linear) + k];
    double slack = RoundingError(kPlaceMargin, point.size) + kLeastNormal;
    for (std::size_t l = 0; l < sample.half_width.size(); ++l)
      slack += std::abs(linear.slope[l]) * sample.slice->slack(static_cast<int>(l));
    return slack;
  }
  const double turned = point.slope[k] == 0 ? 0 : std::abs(point.slope[k]) * sample.slice->slack(heading_);
  return sample.slack[k] + turned + RoundingError(kPlaceMargin, sample.size[k] + point.size) + kLeastNormal;
}

double Placement::SupportUpper(const Sample& sample, const Part& part, const Eigen::Vector3d& d,
                               InstructionSet instructions) const noexcept {
  return Dispatch<&Placement::SupportInline>(instructions, *this, sample, part, d);
}

void Placement::Enclose(const Sample& sample, Zonotope* places, InstructionSet instructions) const noexcept {
  Dispatch<&Placement::EncloseInline>(instructions, *this, sample, places);
}

double Placement::SupportAtExpressions(const Sample& sample, int i, const Eigen::Vector3d& d) const noexcept {
  const Zonotope& slice = *sample.slice;
  const Sample::Point& point = sample.points[ToSize(i)];
  const auto first = ToSize(points_[ToSize(i)].linear);
  std::array<double, kMaxStates> weight{};
  double support = 0, size = 0;
  for (std::size_t k = 0; k < ToSize(dim()); ++k) {
    const double along = d[static_cast<Eigen::Index>(k)], magnitude = std::abs(along);
    for (std::size_t l = 0; l < ToSize(slice.dim()); ++l) weight[l] += along * sample.linear[first + k].slope[l];
    support += along * point.offset[k] + magnitude * (point.slack[k] + point.spread[k]);
    size += magnitude * point.size;
  }
  Lanes spread = AllLanes(0);
  for (std::size_t j = 0; j < slice.padded_size(); j += kLaneCount) {
    Lanes sum = AllLanes(0);
    for (int l = 0; l < slice.dim(); ++l)
      sum += AllLanes(weight[ToSize(l)]) * LoadLanes(slice.padded_row(l).data() + j);
    spread += Abs(sum);
  }
  return support + Sum(spread) + RoundingError(kPlaceMargin, size) + kLeastNormal;
}

void Placement::EncloseAtExpressions(const Sample& sample, std::size_t i, Zonotope& place) const noexcept {
  const Zonotope& slice = *sample.slice;
  ArraysOf(place).Reset(dim(), slice.num_generators());
  for (int k = 0; k < dim(); ++k) {
    const AffineEnclosure& linear = sample.linear[ToSize(points_[i].linear + k)];
    for (std::size_t j = 0; j < slice.padded_size(); j += kLaneCount) {
      Lanes sum = AllLanes(0);
      for (int l = 0; l < slice.dim(); ++l)
        sum += AllLanes(linear.slope[ToSize(l)]) * LoadLanes(slice.padded_row(l).data() + j);
      StoreLanes(sum, ArraysOf(place).mutable_row(k) + j);
    }
    ArraysOf(place).mutable_center(k) = sample.points[i].offset[ToSize(k)];
    ArraysOf(place).mutable_slack(k) = 0;
  }
  for (int k = 0; k < dim(); ++k)
    ArraysOf(place).AppendAxis(k, AddUp(sample.points[i].spread[ToSize(k)], sample.points[i].slack[ToSize(k)]));
}

namespace {

struct Term {
  double weight;
  const double* row;
};

FOREREACH_INLINE Lanes AbsSum(const Term* terms, std::size_t count, std::size_t j) noexcept {
  Lanes sum = AllLanes(terms[0].weight) * LoadLanes(terms[0].row + j);
  for (std::size_t l = 1; l < count; ++l) sum += AllLanes(terms[l].weight) * LoadLanes(terms[l].row + j);
  return Abs(sum);
}

// The sum over the columns of |the sum of the terms|. Two sums side by side: an addition waits for the one before.
FOREREACH_INLINE double Spread(const Term* terms, std::size_t count, std::size_t columns) noexcept {
  Lanes even = AllLanes(0), odd = AllLanes(0);
  std::size_t j = 0;
  for (; j + kLaneCount < columns; j += 2 * kLaneCount) {
    even += AbsSum(terms, count, j);
    odd += AbsSum(terms, count, j + kLaneCount);
  }
  if (j < columns) even += AbsSum(terms, count, j);
  return Sum(even + odd);
}

}  // namespace

// The generators of the image of the slice along d are sums over the states of a weight times a row each.
double Placement::SupportInline(const Sample& sample, const Part& part, const Eigen::Vector3d& d) const noexcept {
  const Zonotope& slice = *sample.slice;
  std::array<Term, kMaxSafetyDim * kMaxStates + 1> terms;
  std::size_t count = 0;
  for (const MatrixEntry& entry : projection_.entries())
    terms[count++] = {d[entry.row] * entry.value.lower, slice.padded_row(entry.column).data()};
  if (heading_ >= 0) terms[count++] = {0, slice.padded_row(heading_).data()};
  double largest = -kInfinity;
  for (int i = part.first; i < part.first + part.count; ++i) {
    if (points_[ToSize(i)].linear >= 0) {
      const double support = SupportAtExpressions(sample, i, d);
      // Written so that NaN becomes the largest, and stays: it proves no separation.
      if (!(support <= largest)) largest = support;
      if (std::isnan(support)) break;
      continue;
    }
    const Sample::Point& point = sample.points[ToSize(i)];
    const double turn = points_[ToSize(i)].turn == 0 ? 0 : d.norm() * points_[ToSize(i)].turn;
    double turned = 0, support = 0, size = 0;
    for (std::size_t k = 0; k < ToSize(dim()); ++k) {
      const double along = d[static_cast<Eigen::Index>(k)], magnitude = std::abs(along);
      turned += along * point.slope[k];
      support += along * middle(sample, i, k) + magnitude * (point.slack[k] + point.spread[k]);
      size += magnitude * (sample.size[k] + point.size);
    }
    if (heading_ >= 0) terms[count - 1].weight = turned;
    const std::size_t columns = slice.padded_size();
    const double spread = count == 3 ? Spread(terms.data(), 3, columns)  // what turns in the plane: unrolled
                                     : Spread(terms.data(), count, columns);
    support += spread + (turn + RoundingError(kPlaceMargin, size + turn)) + kLeastNormal;
    if (!(support <= largest)) largest = support;
    if (std::isnan(support)) break;
  }
  return largest;
}

// As SupportInline, but for what is of the second order, which is bounded as in PoseOver and not part of the point. Of
// most points the box and the ball show that others are farther.
void Placement::FarthestInline(const Pose& pose, const Zonotope& slice, const Part& part,
                               const std::array<double, 2>& d, Farthest& farthest) const noexcept {
  const auto [dx, dy] = d;
  const double box = std::abs(dx) * pose.width[0] + std::abs(dy) * pose.width[1];
  const std::size_t first = ToSize(part.first), end = ToSize(part.first + part.count);
  std::array<double, kMaxBodyPoints> most{};
  std::size_t i = first;
  for (std::size_t other = first; other < end; ++other) {
    most[other] = dx * pose.middle[0][other] + dy * pose.middle[1][other] + pose.around[other] + box;
    if (most[other] > most[i]) i = other;
  }
  if (!(most[i] > farthest.support)) return;
  const std::size_t columns = slice.padded_size();
  alignas(32) std::array<std::array<double, kMaxGenerators>, 2> sums;  // where a row of P does not copy a coordinate
  std::array<const double*, 2> frame;
  std::array<double, 2> slack;
  for (std::size_t k = 0; k < 2; ++k) {
    const auto& row = rows_[k];
    slack[k] = bulge_[k];
    for (const MatrixEntry& entry : row) slack[k] += std::abs(entry.value.lower) * slice.slack(entry.column);
    const bool copies = row.size() == 1 && row[0].value.lower == 1;
    frame[k] = copies ? slice.padded_row(row[0].column).data() : sums[k].data();
    for (std::size_t j = 0; !copies && j < columns; j += kLaneCount) {
      Lanes sum = AllLanes(0);
      for (const MatrixEntry& entry : row)
        sum += AllLanes(entry.value.lower) * LoadLanes(slice.padded_row(entry.column).data() + j);
      StoreLanes(sum, &sums[k][j]);
    }
  }
  const double* const heading = slice.padded_row(std::max(heading_, 0)).data();
  const double of_heading = heading_ < 0 ? 0 : slice.slack(heading_);
  const LaneMask sign{INT64_MIN, INT64_MIN, INT64_MIN, INT64_MIN};
  do {
    // R'(c) q
    const double slope_x = heading_ < 0 ? 0 : pose.frame.center[1] - pose.middle[1][i],
                 slope_y = heading_ < 0 ? 0 : pose.middle[0][i] - pose.frame.center[0];
    Lanes sum_x = AllLanes(0), sum_y = AllLanes(0);
    for (std::size_t j = 0; j < columns; j += kLaneCount) {
      const Lanes turned = LoadLanes(heading + j), x = LoadLanes(frame[0] + j) + AllLanes(slope_x) * turned,
                  y = LoadLanes(frame[1] + j) + AllLanes(slope_y) * turned;
      const LaneMask is_away = Bits(AllLanes(dx) * x + AllLanes(dy) * y) & sign;
      sum_x += FromBits(Bits(x) ^ is_away);
      sum_y += FromBits(Bits(y) ^ is_away);
    }
    const double x = pose.middle[0][i] + Sum(sum_x), y = pose.middle[1][i] + Sum(sum_y), turn = points_[i].turn;
    const double support = dx * x + dy * y + std::abs(dx) * slack[0] + std::abs(dy) * slack[1] +
                           std::abs(dx * slope_x + dy * slope_y) * of_heading + pose.around[i] -
                           points_[i].length * pose.turn;
    if (support > farthest.support)
      farthest = {support, x + turn * dx + std::copysign(slack[0], dx), y + turn * dy + std::copysign(slack[1], dy)};
    most[i] = -kInfinity;
    for (std::size_t other = first; other < end; ++other)
      if (most[other] > most[i]) i = other;
  } while (most[i] > farthest.support);
}

void Placement::FindFarthest(const Pose& pose, const Zonotope& slice, const Part& part, const std::array<double, 2>& d,
                             Farthest& farthest, InstructionSet instructions) const noexcept {
  Dispatch<&Placement::FarthestInline>(instructions, *this, pose, slice, part, d, farthest);
}

void Placement::EncloseInline(const Sample& sample, Zonotope* places) const noexcept {
  const Zonotope& slice = *sample.slice;
  if (is_at_frame_ && !sweeps_) {
    for (int i = 0; i < num_points(); ++i) projection_.Enclose(slice, sample.half_width, places[i]);
    return;
  }
  const std::size_t columns = slice.padded_size(), p = ToSize(dim());
  alignas(32) std::array<std::array<double, kMaxGenerators>, kMaxSafetyDim> frame;  // P G
  for (std::size_t row = 0; has_frame_ && row < p; ++row)
    for (std::size_t j = 0; j < columns; j += kLaneCount) {
      Lanes sum = AllLanes(0);
      for (const MatrixEntry& entry : rows_[row])
        sum += AllLanes(entry.value.lower) * LoadLanes(slice.padded_row(entry.column).data() + j);
      StoreLanes(sum, &frame[row][j]);
    }
  for (std::size_t i = 0; i < points_.size(); ++i) {
    if (points_[i].linear >= 0) {
      EncloseAtExpressions(sample, i, places[i]);
      continue;
    }
    const Sample::Point& point = sample.points[i];
    Zonotope& place = places[i];
    ArraysOf(place).Reset(dim(), slice.num_generators());
    for (int k = 0; k < dim(); ++k) {
      const auto row = ToSize(k);
      const double slope = point.slope[row], *turned = slope != 0 ? slice.padded_row(heading_).data() : nullptr;
      double* to = ArraysOf(place).mutable_row(k);
      for (std::size_t j = 0; j < columns; j += kLaneCount) {
        const Lanes sum = LoadLanes(&frame[row][j]);
        StoreLanes(turned == nullptr ? sum : sum + AllLanes(slope) * LoadLanes(turned + j), to + j);
      }
      ArraysOf(place).mutable_center(k) = sample.center[row] + point.offset[row];
      ArraysOf(place).mutable_slack(k) = 0;
    }
    for (int k = 0; k < dim(); ++k)
      ArraysOf(place).AppendAxis(k, AddUp(point.spread[ToSize(k)], point.slack[ToSize(k)]));
  }
}

}  // namespace forereach
