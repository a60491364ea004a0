// A step under residual bounds with a slope, against exact rationals: the successor contains the image of the slice for
// every admissible residual, and is not wider than rounding makes it.
#include "tests/test.h"

#include "forereach/dynamics/models/named_models.h"
#include "forereach/reach/propagator.h"
#include "tests/oracle/exact.h"
#include "tests/oracle/traced_random.h"

namespace forereach::slope_oracle_test {

constexpr std::size_t kStates = 4;
constexpr double kStep = 0.125;  // its square and half of it are doubles

struct Sloped final : ResidualEnclosure {
  explicit Sloped(Random& random) {
    const double scale = random.Coin(0.2) ? 0x1p-500 : random.Coin(0.2) ? 100 : 0.1;
    for (std::size_t k = 0; k < kStates; ++k) {
      lower[k] = random.Coin(0.3) ? 0 : random.Uniform(-0.1, 0.1);
      upper[k] = lower[k] + (random.Coin(0.3) ? 0 : random.Uniform(0, 0.1));
      for (std::size_t l = 0; l < kStates; ++l) slope[k][l] = random.Coin(0.3) ? 0 : scale * random.Uniform(-1, 1);
    }
  }
  void Enclose(const QuerySet&, ResidualBounds& bounds) const noexcept override {
    std::ranges::copy(lower, bounds.lower.begin());
    std::ranges::copy(upper, bounds.upper.begin());
    for (std::size_t k = 0; k < kStates; ++k) std::ranges::copy(slope[k], bounds.slope[k].begin());
    bounds.capped = false;
    bounds.has_slope = true;
  }

  std::array<double, kStates> lower, upper;
  std::array<std::array<double, kStates>, kStates> slope;
};

// Entry (k, l) of J + A, J the point mass's.
Rational Entry(const Sloped& residual, std::size_t k, std::size_t l) {
  const Rational nominal = k == l ? 1 : l == k + 2 ? kStep : 0;
  return nominal + Rational(residual.slope[k][l]);
}

// max d . (f0(x, u) + A (x - c) + e), x in the slice, lower <= e <= upper.
Rational Support(const Zonotope& slice, const std::array<double, 2>& input, const Sloped& residual,
                 const Eigen::VectorXd& d) {
  Rational sum = 0;
  std::array<Rational, kStates> along;  // d^T (J + A)
  for (std::size_t k = 0; k < kStates; ++k) {
    const Rational weight(d[static_cast<Eigen::Index>(k)]), u(input[k % 2]);
    const Rational moved =
        k < 2 ? Rational(slice.center(static_cast<int>(k) + 2)) * kStep + u * (kStep * kStep / 2) : Rational(u * kStep);
    sum += weight * (Rational(slice.center(static_cast<int>(k))) + moved);
    sum += std::max(Rational(weight * residual.lower[k]), Rational(weight * residual.upper[k]));
    for (std::size_t l = 0; l < kStates; ++l) along[l] += weight * Entry(residual, k, l);
  }
  for (int j = 0; j < slice.num_generators(); ++j) {
    Rational part = 0;
    for (std::size_t l = 0; l < kStates; ++l) part += along[l] * Rational(slice.generator(static_cast<int>(l), j));
    sum += abs(part);
  }
  for (std::size_t l = 0; l < kStates; ++l) sum += abs(along[l]) * Rational(slice.slack(static_cast<int>(l)));
  return sum;
}

TEST(SlopeOracle, TheSuccessorContainsTheImageAndIsNotMuchWider) {
  const auto model = MakePointMass(kStep);
  Domain domain;
  domain.state = Box(Eigen::VectorXd::Constant(4, -1000), Eigen::VectorXd::Constant(4, 1000));
  domain.input = Box(Eigen::VectorXd::Constant(2, -3), Eigen::VectorXd::Constant(2, 3));
  int reduced = 0;
  for (TracedRandom random(617); random.Again(3000);) {
    const Sloped residual(random);
    const int order = random.Integer(1, 5);
    const Propagator propagator(*model, domain, residual, {}, order, Method::kCentred);
    Zonotope slice(random.Vector(4), random.Matrix(4, random.Integer(0, 4 * order)));
    const bool has_slack = random.Coin();
    for (int k = 0; k < 4; ++k)
      if (has_slack) ArraysOf(slice).mutable_slack(k) = random.Uniform(0, 1);
    const std::array<double, 2> input{random.Uniform(-3, 3), random.Uniform(-3, 3)};
    StepRecord record;
    Propagator::HalfWidths(slice, record.half_width.data());
    Zonotope next;
    std::array<double, kMaxStates> next_half_width;
    ASSERT_EQ(propagator.Step(slice, input, record, next, next_half_width.data()).status, StepResult::Status::kDone);
    const bool is_whole = slice.num_generators() + 4 <= 4 * order;
    reduced += !is_whole;
    for (int i = 0; i < 8; ++i) {
      const Eigen::VectorXd d = i < 4 ? Eigen::VectorXd(Eigen::VectorXd::Unit(4, i)) : random.Vector(4);
      const std::span<const double> direction(d.data(), kStates);
      const Rational exactly = Support(slice, input, residual, d), bound = exact::Support(next, direction);
      ASSERT_GE(bound, exactly) << random.trial();
      if (is_whole && !has_slack) ASSERT_LE(bound, exactly + Rational(1e-10)) << random.trial();
    }
    for (std::size_t k = 0; k < kStates; ++k)
      ASSERT_GE(Rational(next_half_width[k]), exact::HalfWidth(next, static_cast<int>(k)));
  }
  EXPECT_GT(reduced, 500);
}

}  // namespace forereach::slope_oracle_test
