/** The certification domain Z_cert: the set of z = (x, u) on which the declaration and the nominal enclosure hold. It
is closed and convex. Coordinates are in the units of the model, the states first, then the inputs. */
#pragma once

#include <array>
#include <span>
#include <utility>
#include <vector>

#include "forereach/numerics/interval.h"
#include "forereach/numerics/lanes.h"
#include "forereach/numerics/limits.h"
#include "forereach/sets/box.h"
#include "forereach/sets/eigen.h"

FOREREACH_ARITHMETIC_BEGIN

namespace forereach {

/** Z_cert = {z = (x, u) : x in state, u in input, z in every inequality, z in every ball}; d_z = n + m coordinates. */
struct Domain {
  /** {z : coefficients . z <= bound} with d_z coefficients. */
  struct Inequality {
    Eigen::VectorXd coefficients;
    double bound;
  };
  /** {z : |z_S - center|_2 <= radius} over the named coordinates S of z. */
  struct Ball {
    std::vector<int> coordinates;
    Eigen::VectorXd center;
    double radius;
  };

  Box state, input;
  std::vector<Inequality> inequalities;
  std::vector<Ball> balls;

  /** @throws std::invalid_argument naming the constraint if a size does not fit d_z or a number is not finite. */
  void Validate(int num_states, int num_inputs) const;

  /** The range of each of the d_z coordinates, from the boxes `state` and `input`. */
  [[nodiscard]] std::vector<Interval> Ranges() const;
  /** The lower ends and the upper ends of Ranges(). */
  [[nodiscard]] std::pair<std::vector<double>, std::vector<double>> Corners() const;

  /** True only if z (d_z entries) provably lies in the domain. False if an entry is NaN. */
  [[nodiscard]] bool Contains(std::span<const double> z) const noexcept;
};

/** The constraint that a box does not provably satisfy. `value` is the extreme value over the box, `bound` the
limit. */
struct DomainExit {
  enum class Kind { kNone, kLower, kUpper, kInequality, kBall };
  Kind kind = Kind::kNone;
  int index = -1;  ///< Coordinate of z for kLower and kUpper; otherwise the index of the inequality or ball.
  double value = 0, bound = 0;
};

/** Tests whether a box of d_z intervals lies in the domain. Returns the first constraint that the box does not provably
satisfy, in the order box, inequalities, balls, or kind kNone if all are satisfied. A value equal to its bound is
inside; for a ball this holds if the squares of radius and distance are doubles, and otherwise the test may refuse
values within a rounding error of the bound. NaN is outside. Cost O(d_z) for each constraint. */
[[nodiscard]] DomainExit FindExit(const Domain& domain, std::span<const Interval> box) noexcept;

/** A fast form of FindExit for the boxes of the certify step. */
class DomainTest final {
 public:
  /** @param domain must outlive this object. @param input_error m entries, finite and not negative, or none: zeros. */
  explicit DomainTest(const Domain& domain, const Eigen::VectorXd& input_error = {});

  /** FindExit for the box {(x, u) : |x - center| <= half_width, |u - input| <= input_error}. Plain arithmetic decides
  for a box that is inside by a margin; directed rounding decides otherwise.
  @tparam kStates n, if it is a constant.
  @param center, half_width n entries; kMaxStates entries must be readable.
  @param input m entries. */
  template <std::size_t kStates = 0>
  [[nodiscard]] FOREREACH_INLINE DomainExit FindExit(const double* center, const double* half_width,
                                                     std::span<const double> input) const noexcept {
    const std::size_t n = kStates > 0 ? kStates : num_states_;
    const bool inside = StateLiesWellInside(n, center, half_width) && InputLiesWellInside(input);
    if (inside && is_box_) return {};
    return FindExitOf(center, half_width, input, inside);
  }

 private:
  static constexpr double kMargin = 0x1p-48;  // larger than the rounding error of plain arithmetic

  FOREREACH_INLINE bool StateLiesWellInside(std::size_t n, const double* center,
                                            const double* half_width) const noexcept {
    const Lanes margin = AllLanes(RoundingError(kMargin, 1));
    return HoldsForFirst(
        n, [&](std::size_t k) __attribute__((always_inline)) {
          const Lanes c = LoadLanes(center + k), r = LoadLanes(half_width + k), reach = r + margin * (Abs(c) + r);
          return (LoadLanes(&state_lower_[k]) < c - reach) & (c + reach < LoadLanes(&state_upper_[k]));
        });
  }
  FOREREACH_INLINE bool InputLiesWellInside(std::span<const double> input) const noexcept {
    bool inside = true;
    for (std::size_t l = 0; l < input.size(); ++l) {
      const double reach = RoundingError(kMargin, std::abs(input[l]));
      inside &= (input_lower_[l] < input[l] - reach) & (input[l] + reach < input_upper_[l]);
    }
    return inside;
  }
  // The remaining tests, for a domain that is not a box and for a box that is not inside by the margin.
  [[nodiscard, gnu::noinline]] DomainExit FindExitOf(const double* center, const double* half_width,
                                                     std::span<const double> input, bool inside_box) const noexcept;
  [[nodiscard]] bool MeetsConstraintsWell(const double* center, const double* half_width) const noexcept;

  const Domain& domain_;
  std::size_t num_states_, size_;
  bool is_box_;
  std::array<double, kMaxStates> state_lower_{}, state_upper_{};
  std::array<double, kMaxInputs> input_lower_, input_upper_;  // of the input itself, without its error
  std::array<double, kMaxInputs> input_error_{};
};

}  // namespace forereach

FOREREACH_ARITHMETIC_END
