/** The certification domain Z_cert: where the declaration and the nominal enclosure hold. Closed and convex. */
#pragma once

#include <array>
#include <span>
#include <utility>
#include <vector>

#include "certifier/numerics/interval.h"
#include "certifier/numerics/lanes.h"
#include "certifier/numerics/limits.h"
#include "certifier/sets/box.h"
#include "certifier/sets/eigen.h"

FOREREACH_ARITHMETIC_BEGIN

namespace forereach {

/** {z = (x, u) : x in state, u in input, all inequalities, all balls}. */
struct Domain {
  /** {z : coefficients . z <= bound}, d_z coefficients. */
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

  /** The range of each coordinate of z, the state's and then the input's. */
  [[nodiscard]] std::vector<Interval> Ranges() const;
  /** The same, lower ends and upper ends. */
  [[nodiscard]] std::pair<std::vector<double>, std::vector<double>> Corners() const;

  /** True only if z provably lies inside. */
  [[nodiscard]] bool Contains(std::span<const double> z) const noexcept;
};

/** Where a box was not proven to stay inside: `value` is what it reaches, `bound` what it may reach. */
struct DomainExit {
  enum class Kind { kNone, kLower, kUpper, kInequality, kBall };
  Kind kind = Kind::kNone;
  int index = -1;  ///< Coordinate of z for kLower and kUpper, else the inequality or ball.
  double value = 0, bound = 0;
};

/** The first constraint that the box of d_z intervals does not provably satisfy; kind kNone if it lies inside. A bound
that is met exactly is inside, for a ball where the squares of radius and distance are doubles; otherwise it may be a
rounding error short of that. NaN is outside. Cost O(d_z) a constraint. */
[[nodiscard]] DomainExit FindExit(const Domain& domain, std::span<const Interval> box) noexcept;

/** The domain in a form that is quick to test against. */
class DomainTest final {
 public:
  /** @param domain outlives the test. */
  explicit DomainTest(const Domain& domain);

  /** FindExit for the box {(x, input) : |x - center| <= half_width}: one that lies inside by a margin is found so in
  plain arithmetic. @param center, half_width n entries, of kMaxStates that can be read. */
  [[nodiscard]] FOREREACH_INLINE DomainExit FindExit(const double* center, const double* half_width,
                                                     std::span<const double> input) const noexcept {
    const bool inside = StateLiesWellInside(center, half_width) && InputLiesWellInside(input);
    if (inside && is_box_) return {};
    return FindExitOf(center, half_width, input, inside);
  }

 private:
  static constexpr double kMargin = 0x1p-48;  // above the rounding of plain arithmetic

  FOREREACH_INLINE bool StateLiesWellInside(const double* center, const double* half_width) const noexcept {
    const Lanes margin = AllLanes(RoundingError(kMargin, 1));
    return HoldsForFirst(
        num_states_, [&](std::size_t k) __attribute__((always_inline)) {
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
  // What else there is to test, where the domain is not a box or the point not well inside of it.
  [[nodiscard, gnu::noinline]] DomainExit FindExitOf(const double* center, const double* half_width,
                                                     std::span<const double> input, bool inside_box) const noexcept;
  [[nodiscard]] bool MeetsConstraintsWell(const double* center, const double* half_width) const noexcept;

  const Domain& domain_;
  std::size_t num_states_, size_;
  bool is_box_;
  std::array<double, kMaxStates> state_lower_{}, state_upper_{};
  std::array<double, kMaxInputs> input_lower_, input_upper_;
};

}  // namespace forereach

FOREREACH_ARITHMETIC_END
