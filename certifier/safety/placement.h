/** Where the points of the body are, over a slice.

A place is the image of the slice under a map g, here g_q(x) = P x + R(x_heading) q (body.h). It is enclosed as a step
of a model is, to the second order around the center c of the slice,
    g(x) in g(c) + Dg(c) (x - c) + 1/2 (x - c)^T H (x - c),    H in D^2 g(Box(X)),
so it stays correlated with the slice: a place is a zonotope with the generators Dg(c) G, not a box around a box. */
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "certifier/numerics/instruction_set.h"
#include "certifier/safety/body.h"
#include "certifier/safety/projection.h"
#include "certifier/sets/zonotope.h"

namespace forereach {

class Placement final {
 public:
  /** @throws std::invalid_argument with the value and its bound unless P is as Projection requires, the heading is a
  state and p >= 2 or there is none, there are 1 to kMaxBodyParts parts of together 1 to kMaxBodyPoints points, and all
  numbers are finite, the radii and the bounds between samples not negative, the period positive. */
  Placement(const Eigen::MatrixXd& projection, const Body& body, const std::optional<Between>& between, int num_states);

  /** The points of a part are points[first .. first + count). */
  struct Part {
    int first, count;
    double radius;  ///< metres
  };

  [[nodiscard]] const Projection& projection() const { return projection_; }
  [[nodiscard]] int dim() const { return projection_.dim(); }
  [[nodiscard]] std::span<const Part> parts() const { return parts_; }
  [[nodiscard]] int num_points() const { return static_cast<int>(points_.size()); }
  /** True if a certificate holds between the samples, too. */
  [[nodiscard]] bool sweeps() const { return sweeps_; }

  /** True if the body is the point P x. */
  [[nodiscard]] bool is_point() const { return reach_ == 0; }

  /** An upper bound on the distance of any point of the body from P x, and of the deviation of its path: metres. */
  [[nodiscard]] double reach() const { return reach_; }
  /** The largest deviation of point i from its chord because the body turns: |q| (w^2 + alpha) period^2 / 8, metres. */
  [[nodiscard]] double turn(int i) const { return points_[ToSize(i)].turn; }

  /** A hull that contains Box(P X) + [-e, e]. @param half_width n upper bounds on the half-widths of Box(X). Cost
  O(nonzeros of P). */
  [[nodiscard]] Hull EncloseHull(const Zonotope& slice, std::span<const double> half_width) const noexcept;

  /** Sets hulls[i] to a hull that contains the places of all points of part i, widened by [-e, e] and by the points'
  turns, but not by the part's radius. @param hulls one for each part. Cost as Enclose. */
  void EncloseParts(const Zonotope& slice, std::span<const double> half_width, Hull* hulls,
                    InstructionSet instructions = BestInstructionSet()) const noexcept;

  /** Sets places[i] to a zonotope that contains g_i(X) + [-e, e] for each point i. @param places num_points() sets.
  @param half_width as above. @param instructions changes the computing time only, here and above. Cost O(m) for m
  generators for each point, and a sine and a cosine if the body turns. @pre X has at most kMaxGenerators - p
  generators. */
  void Enclose(const Zonotope& slice, std::span<const double> half_width, Zonotope* places,
               InstructionSet instructions = BestInstructionSet()) const noexcept;

 private:
  struct Point {
    Eigen::Vector3d place;  // in the robot's frame
    double length;          // |q| in the plane in which the body turns, from above
    double turn;
  };

  FOREREACH_INLINE void EncloseInline(const Zonotope& slice, std::span<const double> half_width,
                                      Zonotope* places) const noexcept;
  FOREREACH_INLINE void EnclosePartsInline(const Zonotope& slice, std::span<const double> half_width,
                                           Hull* hulls) const noexcept;

  struct Rotation;
  struct Offset;
  struct Image;

  Projection projection_;
  std::array<std::vector<MatrixEntry>, kMaxSafetyDim> rows_;  // of P
  int heading_;
  bool sweeps_;
  double reach_ = 0;
  std::array<double, kMaxSafetyDim> bulge_{};  // e
  std::vector<Part> parts_;
  std::vector<Point> points_;
};

}  // namespace forereach
