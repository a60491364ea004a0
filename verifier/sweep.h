/** What a part of the body sweeps, in high precision: the convex hull of the places of its points over a slice, or over
two consecutive slices and the time between them.

The place of a point q is g_q(x) = P x + R(x_h) q, with h the heading. Over a slice x = c + D b, |b|_inf <= 1, with
theta = c_h and r the half-width of the slice in h, every direction d has an angle xi with |xi - theta| <= r and

    d . g_q(x) = d . (P c + R(theta) q) + d . (P + R'(theta) q e_h^T) D b - 1/2 (D b)_h^2 d . R(xi) q,

by Taylor's theorem for d . R(.) q, whose second derivative is its negative. (D b)_h^2 lies in [0, r^2]. Where r is
large, these are tighter: always |g_q(x) - P x| <= |q|, and |g_q(x) - P x - R(theta) q| <= |q| r.

A point at expressions is at g(c) + Dg(c) D b, each coordinate within its bend (functions.h). A coordinate without a
finite bend is anywhere in its range over the slice's hull. */
#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>

#include "forereach/certify/problem.h"
#include "verifier/functions.h"
#include "verifier/real.h"
#include "verifier/tube.h"

namespace forereach::verifier {

/** The projection P X of a slice, p = 1, 2 or 3. */
class ProjectedSlice final {
 public:
  ProjectedSlice(const Slice& slice, const Eigen::MatrixXd& projection);

  [[nodiscard]] int dim() const { return static_cast<int>(center_.size()); }
  [[nodiscard]] const std::vector<Real>& center() const { return center_; }
  [[nodiscard]] const std::vector<std::vector<Real>>& generators() const { return generators_; }

  /** A lower bound on max {|y - P c|_2 : y in P X}; for p <= 2 it is the maximum. */
  [[nodiscard]] Real Radius() const;

 private:
  std::vector<Real> center_;
  std::vector<std::vector<Real>> generators_;
};

/** Cosine and sine of an angle. */
using Turn = std::array<Real, 2>;

/** The turns by theta - r, theta and theta + r. */
[[nodiscard]] std::array<Turn, 3> TurnsAround(const Real& theta, const Real& r);

/** A slice as the places of all points of a body see it. */
class Frame final {
 public:
  /** @param slice must outlive it. */
  Frame(const Problem& problem, const Slice& slice);

  [[nodiscard]] const Slice& slice() const { return *slice_; }
  [[nodiscard]] const std::vector<Real>& center() const { return center_; }  ///< P c
  /** P g of each column g, zeros too. */
  [[nodiscard]] const std::vector<std::vector<Real>>& images() const { return images_; }
  /** Around the heading, by the half-width of the slice in it. @pre the body has one. */
  [[nodiscard]] const std::array<Turn, 3>& turns() const { return turns_; }
  [[nodiscard]] const Real& heading_half_width() const { return heading_half_width_; }

 private:
  const Slice* slice_;
  std::vector<Real> center_;
  std::vector<std::vector<Real>> images_;
  std::array<Turn, 3> turns_;
  Real heading_half_width_;
};

/** The second-order part of a place: conv {-1/2 s R(xi) q : 0 <= s <= r^2, |xi - theta| <= r}, the hull of the origin
and an arc, in the first two coordinates. By default {0}. */
class Bend final {
 public:
  Bend() = default;
  /** @param turns TurnsAround(theta, r) */
  Bend(const std::array<Turn, 3>& turns, const Real& r, const Real& qx, const Real& qy);

  [[nodiscard]] bool IsZero() const { return arc_.empty(); }
  /** max {d . y : y in this}, and a point that attains it but for rounding. @pre d has at least 2 entries. */
  struct Extreme {
    Real value;
    std::array<Real, 2> point;
  };
  [[nodiscard]] Extreme Farthest(const std::vector<Real>& d) const;
  /** No point of it is farther from the origin. */
  [[nodiscard]] const Real& radius() const { return radius_; }

 private:
  std::vector<std::array<Real, 2>> arc_;  // its points at theta - r, theta and theta + r
  Real radius_;
  bool is_circle_ = false;  // r may be pi or more
};

/** A set that contains the place of a point: <center, generators> + bend + {y : |y|_2 <= ball}. */
struct Place {
  std::vector<Real> center;
  std::vector<std::vector<Real>> generators;
  Bend bend;
  Real ball;
  int sample = 0;  ///< 0: at the first sample of the sweep; 1: at the last.
};

/** conv {places} + {y : |y|_2 <= radius}. */
class Sweep final {
 public:
  /** The point P x over one slice. */
  Sweep(const ProjectedSlice& slice);  // NOLINT: a set is the hull of itself
  Sweep(std::vector<Place> places, const Real& radius);

  [[nodiscard]] int dim() const { return static_cast<int>(places_.front().center.size()); }
  [[nodiscard]] const std::vector<Place>& places() const { return places_; }
  [[nodiscard]] const Real& radius() const { return radius_; }
  /** Of each coordinate a range that contains the places of a sample, without the radius; none if it has no place. */
  [[nodiscard]] const std::array<std::vector<Bounds>, 2>& boxes() const { return boxes_; }

 private:
  std::vector<Place> places_;
  Real radius_;
  std::array<std::vector<Bounds>, 2> boxes_;
};

/** Sets each of which contains all that `part` of the body sweeps: over the slice `first` or, with `last`, from one
sample to the next, where Problem::between widens the hull by [-e, e], e_k = acceleration_k period^2 / 8, and the place
of q by a ball of |q| (turn_rate^2 + turn_acceleration) period^2 / 8. One set is by Taylor's theorem. A part that turns
has two others, before it of P X and a ball of the largest |q|, after it of P X + R(theta) q and balls of |q| r. None if
an expression has no finite bound. @param places the expressions of a part that stands at some, one point after the
other. @pre a Certifier accepts the problem. */
[[nodiscard]] std::vector<Sweep> SweepsOf(const Problem& problem, const BodyPart& part, const Frame& first,
                                          const Frame* last, const Functions* places = nullptr);

/** How a moving obstacle is met between two samples of a plan, seen from the obstacle. By default: it stands. */
struct Passage {
  bool is_there = true;                    ///< False: the obstacle's window and the time between the samples are apart.
  std::array<std::vector<Real>, 2> shift;  ///< velocity tau at the first and at the last sample; empty: zero.
  Real growth;                             ///< Added to the obstacle's radius.
};

/** The passage between the samples first <= last, at the times start + t step, each known up to the clock error:

    is_there: until >= first time - error, and from <= last time + error,
    growth = uncertainty + growth |tau| + growth_rate tau^2 / 2 + |velocity| error,

with tau the time since the stamp, and |tau| the largest that the error allows. */
[[nodiscard]] Passage PassageOf(const Obstacle& obstacle, const Schedule& schedule, int first, int last);

}  // namespace forereach::verifier
