#include "simulator/contacts.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace forereach {
namespace {

struct Pose {
  Eigen::VectorXd position;
  double heading;
};

Pose PoseOf(const BodyPlaces& places, std::span<const double> x) { return {places.Position(x), places.Heading(x)}; }

// The nearest approach to each obstacle.
using Approaches = std::vector<Contact>;

Approaches Far(std::size_t count) {
  Approaches approaches(count);
  for (std::size_t o = 0; o < count; ++o) approaches[o].obstacle = static_cast<int>(o);
  return approaches;
}

void Approach(const std::vector<BodyPart>& placed, std::span<const Obstacle> obstacles, std::int64_t utime, double at,
              Approaches& approaches) {
  for (std::size_t o = 0; o < obstacles.size(); ++o)
    for (std::size_t part = 0; part < placed.size(); ++part) {
      const double clearance = ApproximateDistance(obstacles[o], placed[part], utime);
      if (!(clearance < approaches[o].clearance)) continue;
      approaches[o].clearance = clearance;
      approaches[o].part = static_cast<int>(part);
      approaches[o].at = at;
    }
}

double Nearest(const Approaches& approaches) {
  double nearest = kInfinity;
  for (const Contact& contact : approaches) nearest = std::min(nearest, contact.clearance);
  return nearest;
}

std::vector<Contact> ContactsOf(Approaches approaches) {
  std::erase_if(approaches, [](const Contact& contact) { return !(contact.clearance <= 0); });
  return approaches;
}

// The second derivative that the heading may have throughout: |change / T| + |theta''| T / 2 <= turn_rate.
double TurnAcceleration(const Between& between, double change) {
  const double rate_left = between.turn_rate - std::abs(change) / between.period;
  return std::clamp(2 * rate_left / between.period, 0.0, between.turn_acceleration);
}

// Every point on the chord between its two places, and off it.
std::vector<BodyPart> Blend(std::vector<BodyPart> begin, const std::vector<BodyPart>& end, double s,
                            const Eigen::VectorXd& off) {
  for (std::size_t i = 0; i < begin.size(); ++i)
    for (std::size_t j = 0; j < begin[i].points.size(); ++j) {
      Eigen::Vector3d& point = begin[i].points[j];
      point = (1 - s) * point + s * end[i].points[j];
      point.head(off.size()) += off;
    }
  return begin;
}

// The motion with one choice of signs: bit k for coordinate k, bit p for the heading.
Approaches Follow(const Problem& problem, const BodyPlaces& places, std::span<const Obstacle> obstacles,
                  const Sample& from, const Sample& to, const Between& between, unsigned signs) {
  const Pose first = PoseOf(places, from.x);
  Pose last = PoseOf(places, to.x);
  const std::vector<BodyPart> begin = places.At(from.x), end = places.At(to.x);
  if (problem.body.heading >= 0 && problem.model->IsAngle(problem.body.heading))  // the shorter way round
    last.heading = first.heading + std::remainder(last.heading - first.heading, 2 * std::numbers::pi);
  const auto sign = [&](Eigen::Index bit) { return signs >> bit & 1U ? 1.0 : -1.0; };
  Eigen::VectorXd acceleration = between.acceleration;
  for (Eigen::Index k = 0; k < acceleration.size(); ++k) acceleration[k] *= sign(k);
  const double turn_acceleration = sign(acceleration.size()) * TurnAcceleration(between, last.heading - first.heading);
  Approaches approaches = Far(obstacles.size());
  for (int i = 1; i <= kSubsteps; ++i) {
    const double s = static_cast<double>(i) / kSubsteps, bulge = between.period * between.period * s * (1 - s) / 2;
    std::vector<BodyPart> placed = Blend(begin, end, s, bulge * acceleration);
    places.MoveFrame((1 - s) * first.position + s * last.position + bulge * acceleration,
                     (1 - s) * first.heading + s * last.heading + bulge * turn_acceleration, placed);
    const auto passed = std::llround(s * static_cast<double>(to.utime - from.utime));
    Approach(placed, obstacles, from.utime + passed, s, approaches);
  }
  return approaches;
}

}  // namespace

std::vector<Contact> FindContacts(const BodyPlaces& places, std::span<const Obstacle> obstacles, const Sample& sample) {
  Approaches approaches = Far(obstacles.size());
  Approach(places.At(sample.x), obstacles, sample.utime, 1, approaches);
  return ContactsOf(std::move(approaches));
}

std::vector<Contact> FindContacts(const Problem& problem, const BodyPlaces& places, std::span<const Obstacle> obstacles,
                                  const Sample& from, const Sample& to, const Between& between) {
  // The motions at the bounds of what is declared, one for each choice of signs: the nearest of them counts.
  const Eigen::Index free_signs = problem.projection.rows() + (problem.body.heading >= 0 ? 1 : 0);
  Approaches nearest = Far(obstacles.size());
  for (unsigned signs = 0; signs < 1U << free_signs; ++signs)
    if (Approaches found = Follow(problem, places, obstacles, from, to, between, signs);
        Nearest(found) <= Nearest(nearest))
      nearest = std::move(found);
  return ContactsOf(std::move(nearest));
}

}  // namespace forereach
