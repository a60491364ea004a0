// A step of an affine model against exact rationals: the successor's support is nowhere below that of the exact image,
// whichever way the model is expanded.
#include "tests/test.h"

#include "forereach/certify/certifier.h"
#include "forereach/certify/tube.h"
#include "forereach/reach/propagator.h"
#include "tests/oracle/exact.h"
#include "tests/oracle/traced_random.h"
#include "tests/worlds.h"

namespace forereach::propagator_oracle_test {

constexpr double kDt = 0.15;
constexpr int kStates = 4, kInputs = 2, kOrder = 5;

// The point mass with a constant residual, observed once with an error of up to sigma.
struct Task {
  std::shared_ptr<Problem> problem = std::make_shared<Problem>();
  std::array<Rational, kStates> lowest, highest;  // of what an admissible residual and a disturbance add to a step

  // @param reach of the domain: beyond some size the expansion is made of intervals.
  Task(Random& random, double reach, bool disturbed) {
    *problem = WorldOf(MakePointMass(kDt), Within({reach, reach, reach, reach}), Within({3, 3}));
    problem->zonotope_order = kOrder;
    for (int k = 0; k < kStates; ++k) {  // from rest at the origin: f0 is zero, and the successor is the residual
      const double residual = random.Coin(0.3) ? 0 : random.Uniform(-1, 1) * std::ldexp(1, -random.Integer(0, 40));
      const double sigma = random.Coin() ? 0 : std::ldexp(random.Uniform(0, 1), -random.Integer(0, 40));
      problem->transitions.x_next(0, k) = residual;
      problem->declaration.noise_bound[k] = sigma;
      const auto i = static_cast<std::size_t>(k);
      lowest[i] = Rational(residual) - Rational(sigma);
      highest[i] = Rational(residual) + Rational(sigma);
    }
    if (!disturbed) return;
    problem->declaration.disturbance = Eigen::Vector4d::Zero();
    for (int k = 0; k < kStates; ++k) {
      if (random.Coin(0.3)) continue;
      const double bound = std::ldexp(random.Uniform(0, 1), -random.Integer(0, 60));
      problem->declaration.disturbance[k] = bound;
      const auto i = static_cast<std::size_t>(k);
      lowest[i] -= 2 * Rational(bound);  // of the observed step, and of this one
      highest[i] += 2 * Rational(bound);
    }
  }
};

// max {d . x+ : x in slice, residual and disturbance admissible}.
Rational ImageSupport(const Task& task, const Zonotope& slice, std::span<const double> input,
                      std::span<const double> d) {
  const Rational dt(kDt), half_square = dt * dt / 2;
  std::array<Rational, kStates> pulled;  // A^T d
  Rational support = 0;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const Rational of_position(d[axis]), of_speed(d[axis + 2]), u(input[axis]);
    pulled[axis] = of_position;
    pulled[axis + 2] = dt * of_position + of_speed;
    support += (half_square * of_position + dt * of_speed) * u;
  }
  for (int k = 0; k < kStates; ++k) {
    const auto i = static_cast<std::size_t>(k);
    support += pulled[i] * Rational(slice.center(k)) + abs(pulled[i]) * Rational(slice.slack(k));
    support += std::max<Rational>(Rational(d[i]) * task.lowest[i], Rational(d[i]) * task.highest[i]);
  }
  for (int j = 0; j < slice.num_generators(); ++j) {
    Rational along = 0;
    for (int k = 0; k < kStates; ++k) along += pulled[static_cast<std::size_t>(k)] * Rational(slice.generator(k, j));
    support += abs(along);
  }
  return support;
}

class StepOracle : public testing::TestWithParam<double> {};

TEST_P(StepOracle, TheSuccessorContainsTheExactImage) {
  TracedRandom random(630);
  for (int trial = 0; trial < 200; ++trial) {
    const Task task(random, GetParam(), trial % 2 == 1);
    const Certifier certifier(task.problem);
    Eigen::VectorXd center = random.Vector(kStates, std::ldexp(1, random.Integer(-20, 3)));
    for (int axis = 0; axis < 2; ++axis)  // position and the way of a step often cancel
      if (random.Coin()) center[axis] = -kDt * center[axis + 2] * (1 + random.Integer(-2, 2) * 0x1p-52);
    const int columns = random.Coin(0.2) ? 0 : random.Integer(1, kOrder * kStates);
    const Zonotope initial_set(center, random.Matrix(kStates, columns, std::ldexp(1, -random.Integer(4, 20))));
    const Eigen::MatrixXd controls =
        random.Coin(0.3) ? Eigen::MatrixXd(Eigen::MatrixXd::Zero(2, 3)) : random.Matrix(2, 3);
    const Plan plan{controls.data(), kInputs, 3, kInputs};
    Tube tube;
    ASSERT_EQ(certifier.Certify(plan, initial_set, {}, tube).outcome, Outcome::kCertified);
    for (int t = 0; t < 3; ++t) {
      for (int i = 0; i < 8; ++i) {
        Eigen::VectorXd d = random.Vector(kStates);
        if (i < kStates) d = random.Sign() * Eigen::VectorXd::Unit(kStates, i);
        ASSERT_GE(exact::Support(tube.slice(t + 1), View(d)), ImageSupport(task, tube.slice(t), plan.input(t), View(d)))
            << "trial " << trial << ", step " << t;
      }
      for (int k = 0; k < kStates; ++k)
        ASSERT_GE(Rational(tube.half_width(t + 1)[static_cast<std::size_t>(k)]), exact::HalfWidth(tube.slice(t + 1), k))
            << "trial " << trial << ", step " << t;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(DomainsOfAnySize, StepOracle, testing::Values(100.0, 1e12));

// Bounds of the residual that somebody supplies, and that know nothing of the disturbance.
class Given final : public ResidualEnclosure {
 public:
  explicit Given(double bound) : bound_(bound) {}
  void Enclose(const QuerySet&, ResidualBounds& bounds) const noexcept override {
    bounds.lower.fill(-bound_);
    bounds.upper.fill(bound_);
    bounds.capped = false;
  }

 private:
  double bound_;
};

// The sum of both does not fit into a double, and the residual's part of it is what would be rounded away.
TEST(PropagatorOracle, ADisturbanceFarAboveTheResidualIsRoundedOutward) {
  Random random(632);
  const Task task(random, 0x1p-40, false);  // so small that the rounding of the model hides nothing
  task.problem->domain.input = Box(Eigen::Vector2d::Constant(-0x1p-40), Eigen::Vector2d::Constant(0x1p-40));
  for (const double small : {0x1.8p-55, 0x1p-54, 0x1p-300, 0.1}) {
    const Given residual(small);
    const Propagator propagator(*task.problem->model, task.problem->domain, residual, Eigen::Vector4d::Ones(), kOrder,
                                Method::kCentred);
    const Zonotope origin = Zonotope::FromBox(Eigen::Vector4d::Zero(), Eigen::Vector4d::Zero());
    StepRecord record{};
    std::array<double, kMaxStates> half_width{};
    Zonotope next;
    const std::array<double, kInputs> input{};
    ASSERT_EQ(propagator.Step(origin, input, record, next, half_width.data()).status, StepResult::Status::kDone);
    for (int k = 0; k < kStates; ++k) {
      const Rational exactly = Rational(1) + Rational(small);
      EXPECT_GE(exact::HalfWidth(next, k), exactly) << small;
      EXPECT_LE(exact::HalfWidth(next, k), exactly * (Rational(1) + Rational(0x1p-48))) << small;
    }
  }
}

TEST(PropagatorOracle, HalfWidthsAreNeverBelowTheExactOnes) {
  for (TracedRandom random(631); random.Again(2000);) {
    Zonotope slice = random.AnyZonotope(kStates, random.Integer(0, 60), std::ldexp(1, random.Integer(-40, 40)));
    for (int k = 0; k < kStates; ++k)
      if (random.Coin()) ArraysOf(slice).mutable_slack(k) = random.Uniform(0, 1);
    std::array<double, kMaxStates> half_width{};
    Propagator::HalfWidths(slice, half_width.data());
    for (int k = 0; k < kStates; ++k)
      ASSERT_GE(Rational(half_width[static_cast<std::size_t>(k)]), exact::HalfWidth(slice, k))
          << "trial " << random.trial();
  }
}

}  // namespace forereach::propagator_oracle_test
