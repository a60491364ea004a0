// The remainder's bound against exact rationals: no quadratic form over the slice leaves it.
#include "tests/test.h"

#include "forereach/dynamics/models/named_models.h"
#include "forereach/reach/propagator.h"
#include "tests/oracle/exact.h"
#include "tests/oracle/traced_random.h"

namespace forereach::remainder_oracle_test {

// A slice, generators alike in some coordinates, and Hessians that are anything.
struct Case {
  Zonotope slice;
  std::array<double, kMaxStates> half_width;
  std::vector<PlainInterval> hessian;
  std::vector<double> error;

  Case(Random& random, const Program& program) {
    const int m = random.Integer(0, 12);
    const double scale = std::ldexp(1, random.Coin(0.2) ? random.Integer(-540, -150) : random.Integer(-30, 10));
    Eigen::MatrixXd generators = random.Matrix(program.states, m, scale);
    if (random.Coin()) generators.row(3) = generators.row(2) * random.Uniform(-2, 2);
    if (random.Coin(0.3)) generators.row(random.Below(program.states)).setZero();
    slice = Zonotope(random.Vector(program.states), generators);
    for (int k = 0; k < program.states; ++k)
      if (random.Coin(0.3)) ArraysOf(slice).mutable_slack(k) = random.Uniform(0, scale);
    Propagator::HalfWidths(slice, half_width.data());
    for (int e = 0; e < program.num_second; ++e) {
      const double a = random.Uniform(-2, 2), b = random.Coin() ? a : random.Uniform(-2, 2);
      hessian.push_back({std::min(a, b), std::max(a, b)});
      error.push_back(random.Coin() ? 0 : random.Uniform(0, 0.01));
    }
  }

  [[nodiscard]] Remainder Bound(const NominalModel& model, Method method) const {
    const Program& program = model.program();
    Remainder remainder;
    ExpansionError off;
    std::ranges::copy(error, off.hessian.begin());
    std::array<double, kMaxVariables> reach{};
    std::copy_n(half_width.begin(), program.states, reach.begin());
    const StepError step = BoundStepError(program, off, reach);
    model.EncloseRemainder(method, slice, half_width.data(), hessian.data(), step.remainder.data(), remainder);
    return remainder;
  }
};

// Corners mostly, where quadratic forms are largest.
std::vector<Rational> RationalPointOf(Random& random, const Zonotope& slice) {
  std::vector<Rational> d;
  for (int k = 0; k < slice.dim(); ++k) d.push_back(Rational(random.Sign()) * Rational(slice.slack(k)));
  for (int j = 0; j < slice.num_generators(); ++j) {
    const Rational weight(random.Coin(0.8) ? random.Sign() : random.Uniform(-1, 1));
    for (int k = 0; k < slice.dim(); ++k) d[static_cast<std::size_t>(k)] += weight * Rational(slice.generator(k, j));
  }
  return d;
}

// rho(d) with each second derivative at one end or the other.
std::vector<Rational> FormAt(Random& random, const Case& c, const Program& program, const std::vector<Rational>& d) {
  std::vector<Rational> form(static_cast<std::size_t>(program.states));
  for (int e = 0; e < program.num_second; ++e) {
    const auto i = static_cast<std::size_t>(e);
    const Program::Second& entry = program.hessian[i];
    const bool low = random.Coin();
    Rational h(low ? c.hessian[i].lower : c.hessian[i].upper);
    h += Rational(low ? -c.error[i] : c.error[i]);
    const Rational once(entry.row == entry.column ? 0.5 : 1.0);
    form[static_cast<std::size_t>(entry.output)] +=
        once * h * d[static_cast<std::size_t>(entry.row)] * d[static_cast<std::size_t>(entry.column)];
  }
  return form;
}

void ExpectContainsForms(Random& random, const Case& c, const NominalModel& model) {
  for (const Method method : {Method::kPaper, Method::kCentred}) {
    const Remainder bound = c.Bound(model, method);
    for (int sample = 0; sample < 6; ++sample) {
      const std::vector<Rational> form = FormAt(random, c, model.program(), RationalPointOf(random, c.slice));
      for (std::size_t k = 0; k < form.size(); ++k)
        ASSERT_LE(abs(form[k] - Rational(bound.center[k])), Rational(bound.half_width[k])) << "output " << k;
    }
  }
}

TEST(RemainderOracle, ContainsEveryQuadraticFormOfTheSlice) {
  TracedRandom random(611);
  const auto model = MakeKinematicBicycle(0.1, 2.5);
  for (int trial = 0; trial < 3000 && !testing::Test::HasFatalFailure(); ++trial)
    ExpectContainsForms(random, Case(random, model->program()), *model);
}

// Every size is a power of two of its own, so that some products are subnormal numbers or zero and others are large.
TEST(RemainderOracle, ContainsEveryQuadraticFormWhereProductsUnderflow) {
  TracedRandom random(614);
  const auto model = MakeKinematicBicycle(0.1, 2.5);
  const auto any = [&](int lowest, int highest) {
    return random.Sign() * std::ldexp(1, random.Integer(lowest, highest));
  };
  for (int trial = 0; trial < 3000 && !testing::Test::HasFatalFailure(); ++trial) {
    Case c(random, model->program());
    Eigen::MatrixXd generators(6, random.Integer(1, 3));
    for (double& entry : generators.reshaped()) entry = any(-600, 200);
    c.slice = Zonotope(Eigen::VectorXd::Zero(6), generators);
    Propagator::HalfWidths(c.slice, c.half_width.data());
    for (PlainInterval& h : c.hessian) {
      const double a = random.Coin(0.3) ? 0 : any(-1060, 0), b = random.Coin() ? a : any(-1060, 0);
      h = {std::min(a, b), std::max(a, b)};
    }
    std::ranges::fill(c.error, 0);
    ExpectContainsForms(random, c, *model);
  }
}

// Lower and upper ends that are odd subnormals, so that neither half of their sum nor of their difference is a double.
TEST(RemainderOracle, ContainsEveryQuadraticFormWhereHalvingRounds) {
  TracedRandom random(616);
  const auto model = MakeKinematicBicycle(0.1, 2.5);
  for (int trial = 0; trial < 3000 && !testing::Test::HasFatalFailure(); ++trial) {
    Case c(random, model->program());
    Eigen::MatrixXd generators = Eigen::MatrixXd::Identity(6, 6);
    for (int k = 0; k < 6; ++k)
      generators(k, k) = random.Coin() ? 1 : std::ldexp(random.Integer(1, 3), -random.Integer(0, 3));
    c.slice = Zonotope(Eigen::VectorXd::Zero(6), generators);
    Propagator::HalfWidths(c.slice, c.half_width.data());
    for (PlainInterval& h : c.hessian) {
      const double a = random.Integer(-5, 5) * 0x1p-1074, b = random.Coin() ? a : random.Integer(-5, 5) * 0x1p-1074;
      h = {std::min(a, b), std::max(a, b)};
    }
    std::ranges::fill(c.error, 0);
    ExpectContainsForms(random, c, *model);
  }
}

TEST(RemainderOracle, IsNotFiniteWhereADerivativeIsNan) {
  Random random(615);
  const auto model = MakeKinematicBicycle(0.1, 2.5);
  const Program& program = model->program();
  for (std::size_t e = 0; e < static_cast<std::size_t>(program.num_second); ++e)
    for (const bool low : {true, false}) {
      Case c(random, program);
      c.slice = Zonotope(Eigen::VectorXd::Zero(6), Eigen::MatrixXd::Identity(6, 6));
      Propagator::HalfWidths(c.slice, c.half_width.data());
      (low ? c.hessian[e].lower : c.hessian[e].upper) = std::numeric_limits<double>::quiet_NaN();
      const auto output = static_cast<std::size_t>(program.hessian[e].output);
      EXPECT_FALSE(c.Bound(*model, Method::kCentred).half_width[output] < kInfinity) << "derivative " << e;
    }
}

TEST(RemainderOracle, CentredIsNeverWiderThanThePapers) {
  const auto model = MakeKinematicBicycle(0.1, 2.5);
  int narrower = 0;
  for (TracedRandom random(612); random.Again(1000);) {
    const Case c(random, model->program());
    const Remainder paper = c.Bound(*model, Method::kPaper);
    const Remainder centred = c.Bound(*model, Method::kCentred);
    for (std::size_t k = 0; k < 6; ++k) {
      EXPECT_EQ(paper.center[k], 0);
      ASSERT_LE(centred.half_width[k], paper.half_width[k] * (1 + 1e-12) + 0x1p-1040);
      narrower += centred.half_width[k] < 0.9 * paper.half_width[k];
    }
  }
  EXPECT_GT(narrower, 500);
}

TEST(RemainderOracle, OfAnAffineModelIsExactlyZero) {
  Random random(613);
  const auto model = MakePointMass(0.15);
  const Case c(random, model->program());
  for (std::size_t k = 0; k < 4; ++k) EXPECT_EQ(c.Bound(*model, Method::kCentred).half_width[k], 0);
}

}  // namespace forereach::remainder_oracle_test
