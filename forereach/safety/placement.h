/** Where the points of the body are, over a slice.

A place is the image of the slice under a map g: g_q(x) = P x + R(x_heading) q of a point in the robot's frame, or
expressions of the state (body.h). It is enclosed as a step of a model is, to the second order around the center c of
the slice, g(x) in g(c) + Dg(c) (x - c) + 1/2 (x - c)^T H (x - c),    H in D^2 g(Box(X)), so it stays correlated with
the slice: a place is a zonotope with the generators Dg(c) G, not a box around a box. Where expressions have no finite
H, it is the box of their ranges. */
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "forereach/dynamics/text_enclosure.h"
#include "forereach/numerics/instruction_set.h"
#include "forereach/numerics/lanes.h"
#include "forereach/safety/body.h"
#include "forereach/safety/projection.h"

namespace forereach {

class Zonotope;

class Placement final {
 public:
  /** @throws std::invalid_argument with the value and its bound unless P is as Projection requires, the heading is a
  state and p >= 2 or there is none, there are 1 to kMaxBodyParts parts of together 1 to kMaxBodyPoints points, and all
  numbers are finite, the radii and the bounds between samples not negative, the period positive. P may be zero only if
  every part stands at expressions; each of these has p, of `names` but the inputs. @throws ExpressionError
  (expression.h) if one is wrong. @param names only read if there are expressions. */
  Placement(const Eigen::MatrixXd& projection, const Body& body, const std::optional<Between>& between, int num_states,
            const ExpressionNames& names = {});

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

  /** True if all points of the body are P x: it is a point or a ball around it. */
  [[nodiscard]] bool is_at_frame() const { return is_at_frame_; }

  /** An upper bound on the distance of any point of the body from P x or, of a part at expressions, from the places of
  its points, and of the deviation of its path: metres. */
  [[nodiscard]] double reach() const { return reach_; }
  /** Whether some point stands at expressions. */
  [[nodiscard]] bool has_expressions() const { return expressions_.has_value(); }
  /** The largest deviation of point i from its chord because the body turns: |q| (w^2 + alpha) period^2 / 8, metres. */
  [[nodiscard]] double turn(int i) const { return points_[ToSize(i)].turn; }

  /** Sets `hull` to one that contains Box(P X) + [-e, e]. @param half_width n upper bounds on the half-widths of
  Box(X). Cost O(nonzeros of P). @pre no point stands at expressions. */
  void EncloseHull(const Zonotope& slice, std::span<const double> half_width, Hull& hull) const noexcept;

  using Coordinates = std::array<std::array<double, kMaxBodyPoints>, kMaxSafetyDim>;
  /** Where the body is over one slice, loosely: the place of point i, as Enclose gives it, lies in middle[.][i] +
  [-width, width] + {|y| <= around[i]}, up to rounding. */
  struct Pose {
    Hull frame;                               ///< As EncloseHull gives it.
    std::array<double, kMaxSafetyDim> width;  // that of the frame; 0 if no point is in it
    double cosine, sine, turn;                // the last: the heading's half-width
    bool is_known;                            ///< Otherwise the points may be anywhere.
    Coordinates middle;
    std::array<double, kMaxBodyPoints> around;
  };
  /** Cost O(nonzeros of P), O(1) for each point, a sine and a cosine. @pre no point stands at expressions. */
  void PoseOver(const Zonotope& slice, std::span<const double> half_width, Pose& pose,
                InstructionSet instructions = BestInstructionSet()) const noexcept;
  /** A hull that contains all of the body there. Cost O(points). */
  [[nodiscard]] Hull EncloseBody(const Pose& pose, InstructionSet instructions = BestInstructionSet()) const noexcept;
  struct Farthest {
    double support = -kInfinity;
    double x = 0, y = 0;  ///< the point
  };
  /** Raises `farthest.support` to an upper bound, up to rounding, on max {d . y} for the places of a part's points, as
  Enclose gives them, and sets its point to one of them that is about as far; or leaves both if the bound is larger: p =
  2, d of length 1. It is tighter than by the middles and what is around them. Cost O(m) for m generators and each point
  that may be the farthest. @pre the pose is that of the slice, and known; no point stands at expressions. */
  void FindFarthest(const Pose& pose, const Zonotope& slice, const Part& part, const std::array<double, 2>& d,
                    Farthest& farthest, InstructionSet instructions = BestInstructionSet()) const noexcept;
  /** The outward normal, of length 1, of the side from point i to the next of its part, p = 2, at the pose; zero if it
  has no length. */
  [[nodiscard]] std::array<double, 2> Side(const Pose& pose, const Part& part, int i) const noexcept {
    const Point& point = points_[ToSize(i)];
    if (point.linear >= 0) return SideOf(part, i, pose.middle);
    const auto& [x, y] = point.side;
    return {pose.cosine * x - pose.sine * y, pose.sine * x + pose.cosine * y};
  }

  /** The linear map and what is left over of every g_i over one slice: what all bounds on places are made of. */
  struct Sample {
    struct Point {
      // g_i(x) - P x, as offset + slope (x_heading - c_heading) +- spread. At expressions: g_i(x), as offset + slope of
      // `linear` . (x - c) +- spread, and `slope` is zero. `slack`: what rounding may add to spread
      std::array<double, kMaxSafetyDim> offset, spread, slope, slack;
      double size;  // of what these are computed from
    };

    const Zonotope* slice;
    std::span<const double> half_width;
    std::array<double, kMaxSafetyDim> center, slack, size;  // of P X
    std::array<Point, kMaxBodyPoints> points;
    std::array<AffineEnclosure, ToSize(kMaxBodyPoints* kMaxSafetyDim)> linear;  // p for each point at expressions
  };

  /** About where point i is in the middle of the slice, coordinate k. */
  [[nodiscard]] double middle(const Sample& sample, int i, std::size_t k) const {
    const double offset = sample.points[ToSize(i)].offset[k];
    return points_[ToSize(i)].linear < 0 ? sample.center[k] + offset : offset;
  }

  /** Sets `hull` to one that contains the places of all points and, if some are in the frame, Box(P X), all of it
  widened by [-e, e]. Cost O(n) for each point at expressions. */
  void EncloseHull(const Sample& sample, Hull& hull) const noexcept;
  /** As the other PoseOver, wherever the points stand. Besides, it costs what EncloseHull does. */
  void PoseOver(const Sample& sample, Pose& pose, InstructionSet instructions = BestInstructionSet()) const noexcept;

  /** The sample of a slice, which has to stay as it is while the sample is in use. @param half_width as above. Cost
  O(nonzeros of P) and O(1) for each point, a sine and a cosine if the body turns, and O(operations) of expressions. */
  void Observe(const Zonotope& slice, std::span<const double> half_width, Sample& sample) const noexcept;

  /** An upper bound on max {d . y : y in g_i(X) + [-e, e] + turn(i) ball, i a point of the part}: the support of what
  Enclose gives, without making it. Infinite or NaN if there is no bound. @param d finite, its unused entries are 0.
  @param instructions changes the computing time only, here and below. Cost O(m) for m generators for each point. */
  [[nodiscard]] double SupportUpper(const Sample& sample, const Part& part, const Eigen::Vector3d& d,
                                    InstructionSet instructions = BestInstructionSet()) const noexcept;

  /** A bit for each state that moves at most one coordinate of every place: what of a slice is along its axis may be
  slack, and no place gets larger. */
  [[nodiscard]] unsigned SeparableStates() const;

  /** Sets places[i] to a zonotope that contains g_i(X) + [-e, e] for each point i. @param places num_points() sets.
  Cost O(m) for m generators for each point. @pre X has at most
  kMaxGenerators - p generators. */
  void Enclose(const Sample& sample, Zonotope* places,
               InstructionSet instructions = BestInstructionSet()) const noexcept;

 private:
  struct Point {
    Eigen::Vector3d place;  // in the robot's frame
    double length;          // |q| in the plane in which the body turns, from above
    double turn;
    double size;                   // of these and the bulge
    int linear = -1;               // at expressions: their place in Sample::linear
    std::array<double, 2> side{};  // as Side, in the robot's frame
  };

  struct Rotation;

  // As a structure of arrays, of the points in the frame; the last one again up to a full vector.
  struct Outline {
    Coordinates place;
    std::array<double, kMaxBodyPoints> length, turn, radius, size;
  };

  void OverSlice(const Point& point, const Rotation& rotation, Sample::Point& over) const noexcept;
  void OverSlice(Sample& sample, std::size_t i) const noexcept;
  // Side, of a part whose points have these coordinates.
  static std::array<double, 2> SideOf(const Part& part, int i, const Coordinates& of) noexcept;
  FOREREACH_INLINE double SupportInline(const Sample& sample, const Part& part,
                                        const Eigen::Vector3d& d) const noexcept;
  FOREREACH_INLINE void PoseInline(const Zonotope& slice, std::span<const double> half_width,
                                   Pose& pose) const noexcept;
  FOREREACH_INLINE Hull BodyInline(const Pose& pose) const noexcept;
  FOREREACH_INLINE void FarthestInline(const Pose& pose, const Zonotope& slice, const Part& part,
                                       const std::array<double, 2>& d, Farthest& farthest) const noexcept;
  FOREREACH_INLINE void EncloseInline(const Sample& sample, Zonotope* places) const noexcept;
  // Of a point that stands at expressions.
  FOREREACH_INLINE double SupportAtExpressions(const Sample& sample, int i, const Eigen::Vector3d& d) const noexcept;
  FOREREACH_INLINE void EncloseAtExpressions(const Sample& sample, std::size_t i, Zonotope& place) const noexcept;
  [[nodiscard]] double Slack(const Sample& sample, std::size_t i, std::size_t k) const noexcept;

  Projection projection_;
  std::array<std::vector<MatrixEntry>, kMaxSafetyDim> rows_;  // of P
  int heading_;
  bool sweeps_, is_at_frame_ = true;
  double reach_ = 0;
  std::array<double, kMaxSafetyDim> bulge_{};  // e
  std::vector<Part> parts_;
  std::vector<Point> points_;
  Outline outline_{};
  std::optional<TextEnclosure> expressions_;
  int num_inputs_ = 0;      // that expressions could name
  bool has_frame_ = false;  // some point is in the frame
};

}  // namespace forereach
