#include "verifier/sweep.h"

#include <algorithm>
#include <iterator>

#include "forereach/numerics/size.h"

namespace forereach::verifier {
namespace {

using RealVector = std::vector<Real>;

// Less than pi. A slice that turns by less is a bend along an arc, one that turns by more along the whole circle.
constexpr double kHalfTurn = 3.14159;

RealVector Image(const Eigen::MatrixXd& projection, const RealVector& x) {
  RealVector y(ToSize(projection.rows()));
  for (Eigen::Index k = 0; k < projection.rows(); ++k)
    for (Eigen::Index l = 0; l < projection.cols(); ++l)
      if (const Real& entry = x[ToSize(l)]; projection(k, l) != 0 && !entry.IsZero())
        y[ToSize(k)] += projection(k, l) == 1 ? entry : Real(projection(k, l)) * entry;
  return y;
}

bool IsZeroVector(const RealVector& vector) {
  return std::ranges::all_of(vector, [](const Real& entry) { return entry.IsZero(); });
}

Real Length(const Real& x, const Real& y) { return y.IsZero() ? abs(x) : sqrt(sqr(x) + sqr(y)); }

// R q in the first two coordinates.
std::array<Real, 2> Rotated(const Turn& turn, const Real& x, const Real& y) {
  const auto& [c, s] = turn;
  return {c * x - s * y, s * x + c * y};
}

// The places of a part's points, with what the declared bounds allow between two samples.
class Places {
 public:
  Places(const Problem& problem, bool sweeps) : problem_(problem), sweeps_(sweeps) {}

  // R(theta) q = R(c) q + R'(c) q d - d^2 / 2 R(theta') q, by Taylor's theorem; the last term is the bend.
  [[nodiscard]] Place Of(const Eigen::Vector3d& point, const Frame& frame, int sample) const {
    Place place = OfFrame(frame, sample);
    for (std::size_t k = 2; k < place.center.size(); ++k) place.center[k] += Real(point[static_cast<int>(k)]);
    const Real x(point[0]), y(place.center.size() > 1 ? point[1] : 0);
    if (!Turns(point)) {
      place.center[0] += x;
      if (place.center.size() > 1) place.center[1] += y;
      return Widened(std::move(place), Real());
    }
    const auto h = ToSize(problem_.body.heading);
    const std::array<Real, 2> turned = Rotated(frame.turns()[1], x, y);
    for (std::size_t k = 0; k < 2; ++k) place.center[k] += turned[k];
    place.generators.clear();
    for (std::size_t j = 0; j < frame.images().size(); ++j) {
      const RealVector& column = frame.slice().columns[j];
      RealVector generator = frame.images()[j];
      if (!column[h].IsZero()) {
        generator[0] -= column[h] * turned[1];
        generator[1] += column[h] * turned[0];
      }
      if (!IsZeroVector(generator)) place.generators.push_back(std::move(generator));
    }
    place.bend = Bend(frame.turns(), frame.heading_half_width(), x, y);
    return Widened(std::move(place), Deviation(point));
  }

  // Within |q| r of R(theta) q: where the slice turns far, tighter across q than what Taylor's theorem leaves.
  [[nodiscard]] Place Near(const Eigen::Vector3d& point, const Frame& frame, int sample) const {
    if (!Turns(point)) return Of(point, frame, sample);
    Place place = OfFrame(frame, sample);
    const Real x(point[0]), y(point[1]);
    const std::array<Real, 2> turned = Rotated(frame.turns()[1], x, y);
    for (std::size_t k = 0; k < place.center.size(); ++k)
      place.center[k] += k < 2 ? turned[k] : Real(point[static_cast<int>(k)]);
    return Widened(std::move(place), Length(x, y) * frame.heading_half_width() + Deviation(point));
  }

  // At expressions: the places of all points of a part. None if one has no finite bound.
  [[nodiscard]] std::vector<Place> At(const Functions& functions, const Slice& slice, int sample) const {
    const std::vector<Real> no_input(ToSize(problem_.model->num_inputs()));
    const std::vector<Enclosed> coordinates = functions.Over(slice, no_input);
    const std::size_t p = ToSize(problem_.projection.rows());
    std::vector<Place> places;
    for (std::size_t first = 0; first < coordinates.size(); first += p) {
      Place place{std::vector<Real>(p), {}, Bend(), Real(), sample};
      std::vector<RealVector> axes;
      for (std::size_t k = 0; k < p; ++k) {
        const Enclosed& at = coordinates[first + k];
        const Real around = at.bend.IsFinite() ? at.value + at.bend : at.range;
        if (!around.IsFinite()) return {};
        place.center[k] = around.middle();
        RealVector axis(p);
        axis[k] = abs(around - place.center[k]).upper();
        if (!axis[k].IsZero()) axes.push_back(std::move(axis));
      }
      for (const RealVector& column : slice.columns) {
        RealVector generator(p);
        for (std::size_t k = 0; k < p; ++k) {
          const Enclosed& at = coordinates[first + k];
          for (std::size_t l = 0; at.bend.IsFinite() && l < column.size(); ++l)
            if (!column[l].IsZero() && !at.slope[l].IsZero()) generator[k] += at.slope[l] * column[l];
        }
        if (!IsZeroVector(generator)) place.generators.push_back(std::move(generator));
      }
      place.generators.insert(place.generators.end(), axes.begin(), axes.end());
      places.push_back(Widened(std::move(place), Real()));
    }
    return places;
  }

  // Where no heading is known: the ball of the points' distance from the frame.
  [[nodiscard]] Place Around(const BodyPart& part, const Frame& frame, int sample) const {
    Real ball;
    for (const Eigen::Vector3d& point : part.points) {
      const Real flat = Length(Real(point[0]), Real(point[1]));
      ball = max(ball, Length(flat, Real(point[2])) + Deviation(point));
    }
    return Widened(OfFrame(frame, sample), ball);
  }

  [[nodiscard]] bool Turns(const Eigen::Vector3d& point) const {
    return problem_.body.heading >= 0 && (point[0] != 0 || point[1] != 0);
  }

 private:
  [[nodiscard]] static Place OfFrame(const Frame& frame, int sample) {
    Place place{frame.center(), {}, Bend(), Real(), sample};
    for (const RealVector& image : frame.images())
      if (!IsZeroVector(image)) place.generators.push_back(image);
    return place;
  }

  // How far a point that turns may be from its chord.
  [[nodiscard]] Real Deviation(const Eigen::Vector3d& point) const {
    if (!sweeps_ || !Turns(point)) return {};
    const Between& between = *problem_.between;
    return Length(Real(point[0]), Real(point[1])) * (sqr(Real(between.turn_rate)) + Real(between.turn_acceleration)) *
           EighthOfSquare();
  }

  [[nodiscard]] Real EighthOfSquare() const { return sqr(Real(problem_.between->period)) * Real(0.125); }

  [[nodiscard]] Place Widened(Place place, const Real& ball) const {
    place.ball = ball;
    for (std::size_t k = 0; sweeps_ && k < place.center.size(); ++k) {
      RealVector axis(place.center.size());
      axis[k] = Real(problem_.between->acceleration[static_cast<Eigen::Index>(k)]) * EighthOfSquare();
      if (!axis[k].IsZero()) place.generators.push_back(std::move(axis));
    }
    return place;
  }

  const Problem& problem_;
  const bool sweeps_;
};

}  // namespace

ProjectedSlice::ProjectedSlice(const Slice& slice, const Eigen::MatrixXd& projection)
    : center_(Image(projection, slice.center)) {
  for (const auto& column : slice.columns)
    if (RealVector g = Image(projection, column); !IsZeroVector(g)) generators_.push_back(std::move(g));
}

// The farthest point is a corner; in the plane its signs are those of a direction next to some generator's normal.
// Doubles choose, brought to a size near one.
Real ProjectedSlice::Radius() const {
  long exponent = -100000;
  for (const RealVector& g : generators_)
    for (const Real& entry : g) exponent = std::max(exponent, entry.exponent());
  const auto p = std::ssize(center_);
  Eigen::MatrixXd rough = Eigen::MatrixXd::Zero(3, std::ssize(generators_));
  for (Eigen::Index j = 0; j < rough.cols(); ++j)
    for (Eigen::Index k = 0; k < p; ++k) rough(k, j) = generators_[ToSize(j)][ToSize(k)].ToDouble(-exponent);
  Eigen::VectorXd best = Eigen::VectorXd::Ones(rough.cols()), signs;
  double longest = -1;
  for (Eigen::Index j = 0; j < rough.cols(); ++j) {
    const Eigen::Vector3d g = rough.col(j);
    const Eigen::Vector3d normal(-g.y(), g.x(), g.z());
    for (const Eigen::Vector3d& d : {g, Eigen::Vector3d(normal + 1e-9 * g), Eigen::Vector3d(normal - 1e-9 * g)}) {
      signs = (rough.transpose() * d).unaryExpr([](double along) { return along < 0 ? -1.0 : 1.0; });
      if (const double length = (rough * signs).norm(); length > longest) longest = length, best = signs;
    }
  }
  RealVector sum(center_.size());
  Real square;
  for (Eigen::Index j = 0; j < best.size(); ++j) {
    const RealVector& g = generators_[ToSize(j)];
    for (std::size_t k = 0; k < sum.size(); ++k) sum[k] = best[j] < 0 ? sum[k] - g[k] : sum[k] + g[k];
  }
  for (const Real& entry : sum)
    if (!entry.IsZero()) square += entry * entry;
  return sqrt(square).lower();
}

std::array<Turn, 3> TurnsAround(const Real& theta, const Real& r) {
  const Real before = theta - r, behind = theta + r;
  return {{{cos(before), sin(before)}, {cos(theta), sin(theta)}, {cos(behind), sin(behind)}}};
}

Frame::Frame(const Problem& problem, const Slice& slice)
    : slice_(&slice), center_(Image(problem.projection, slice.center)) {
  for (const RealVector& column : slice.columns) images_.push_back(Image(problem.projection, column));
  if (problem.body.heading < 0) return;
  heading_half_width_ = slice.HalfWidth(problem.body.heading);
  turns_ = TurnsAround(slice.center[ToSize(problem.body.heading)], heading_half_width_);
}

Bend::Bend(const std::array<Turn, 3>& turns, const Real& r, const Real& qx, const Real& qy) {
  if (r.IsZero()) return;
  const Real half_square = Real(0.5) * sqr(r);
  for (const Turn& turn : turns) {
    const std::array<Real, 2> turned = Rotated(turn, qx, qy);
    arc_.push_back({-(half_square * turned[0]), -(half_square * turned[1])});
  }
  radius_ = half_square * Length(qx, qy);
  is_circle_ = !CertainlyBelow(r, kHalfTurn);
}

// The point of the bend farthest along d: an end of the arc, or where the circle meets d. In an arc shorter than a half
// turn, d is met inside if the arc runs towards d at its start and away at its end.
Bend::Extreme Bend::Farthest(const std::vector<Real>& d) const {
  Extreme best;
  const auto consider = [&](const Real& value, const std::array<Real, 2>& point) {
    if (CertainlyBelow(best.value.middle(), value.middle())) best.point = point;
    best.value = max(best.value, value);
  };
  for (const auto& point : arc_) consider(d[0] * point[0] + d[1] * point[1], point);
  const auto towards = [&](const std::array<Real, 2>& point) { return d[1] * point[0] - d[0] * point[1]; };
  bool inside = is_circle_;
  for (std::size_t i = 0; i + 1 < arc_.size(); ++i)
    inside |= !CertainlyAtMost(towards(arc_[i]), Real()) && !CertainlyAtMost(Real(), towards(arc_[i + 1]));
  const Real length = Length(d[0], d[1]);
  if (!inside || !CertainlyBelow(Real(), length)) return best;
  consider(radius_ * length, {radius_ * d[0] / length, radius_ * d[1] / length});
  return best;
}

Sweep::Sweep(const ProjectedSlice& slice) : Sweep({{slice.center(), slice.generators(), Bend(), Real(), 0}}, Real()) {}

Sweep::Sweep(std::vector<Place> places, const Real& radius) : places_(std::move(places)), radius_(radius) {
  for (const Place& place : places_) {
    std::vector<Bounds>& box = boxes_[ToSize(place.sample)];
    const bool is_first = box.empty();
    box.resize(place.center.size());
    for (std::size_t k = 0; k < box.size(); ++k) {
      Real reach = place.ball + place.bend.radius();
      for (const RealVector& g : place.generators) reach += abs(g[k]);
      const Real lower = place.center[k] - reach, upper = place.center[k] + reach;
      box[k] = is_first ? Bounds{lower, upper} : Bounds{min(box[k].lower, lower), max(box[k].upper, upper)};
    }
  }
}

std::vector<Sweep> SweepsOf(const Problem& problem, const BodyPart& part, const Frame& first, const Frame* last,
                            const Functions* functions) {
  const Places places(problem, last != nullptr);
  std::vector<Place> around, exact, near;
  for (int sample = 0; sample < (last ? 2 : 1); ++sample) {
    const Frame& frame = sample == 0 ? first : *last;
    if (!part.places.empty()) {
      std::vector<Place> at = places.At(*functions, frame.slice(), sample);
      if (at.empty()) return {};
      std::ranges::move(at, std::back_inserter(exact));
      continue;
    }
    around.push_back(places.Around(part, frame, sample));
    for (const Eigen::Vector3d& point : part.points) {
      exact.push_back(places.Of(point, frame, sample));
      near.push_back(places.Near(point, frame, sample));
    }
  }
  const Real radius(part.radius);
  const bool turns = std::ranges::any_of(part.points, [&](const auto& point) { return places.Turns(point); });
  std::vector<Sweep> sweeps;
  if (turns) sweeps.emplace_back(std::move(around), radius);
  sweeps.emplace_back(std::move(exact), radius);
  if (turns) sweeps.emplace_back(std::move(near), radius);
  return sweeps;
}

Passage PassageOf(const Obstacle& obstacle, const Schedule& schedule, int first, int last) {
  if (!obstacle.motion()) return {};
  const ObstacleMotion& motion = *obstacle.motion();
  const auto time = [&](int t) {
    return Real::Integer(schedule.start_us) + Real::Integer(t) * Real::Integer(schedule.step_us);
  };
  const Real error = Real::Integer(schedule.clock_error_us), stamp = Real::Integer(motion.stamp_us);
  const Real begin = time(first) - error, end = time(last) + error, million(1e6);
  Passage passage;
  passage.is_there =
      !CertainlyBelow(Real::Integer(motion.until_us), begin) && !CertainlyBelow(end, Real::Integer(motion.from_us));
  if (!passage.is_there) return passage;
  Real speed;
  for (int k = 0; k < obstacle.dim(); ++k) {
    const Real velocity(motion.velocity[k]);
    passage.shift[0].push_back(velocity * (time(first) - stamp) / million);
    passage.shift[1].push_back(velocity * (time(last) - stamp) / million);
    speed = Length(speed, velocity);
  }
  const Real tau = max(abs(begin - stamp), abs(end - stamp)) / million;
  passage.growth = Real(motion.uncertainty) + Real(motion.growth) * tau +
                   Real(0.5) * Real(motion.growth_rate) * sqr(tau) + speed * error / million;
  return passage;
}

}  // namespace forereach::verifier
