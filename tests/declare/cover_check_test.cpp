// The verifier's check of covers: whole ones hold; with a part missing, a bound lowered or a leaf moved they do not.
#include "verifier/cover_check.h"

#include "tests/test.h"

#include "tests/declare/families.h"
#include "verifier/ranges.h"

namespace forereach::verifier::cover_check_test {

SlopeClaim ClaimOf(const Family& family, int row, int column, double gap = 1e-7) {
  const SlopeBound bound = family.Bound(row, column, {gap});
  return {row, column, bound.upper, bound.cover};
}

// The leaf with the largest bound, close to the largest slope.
Cover::Node& Largest(Cover& cover) {
  return *std::ranges::max_element(
      cover.nodes, {}, [](const Cover::Node& node) { return node.argument < 0 && !node.outside ? node.number : 0; });
}

struct Covers : testing::Test {
  CoverVerdict Check() const { return CoverChecker(family_.domain, family_.residual).Check(claim_); }
  void ExpectRefuted(const char* text) const {
    const CoverVerdict verdict = Check();
    EXPECT_EQ(verdict.answer, Answer::kNo);
    EXPECT_THAT(verdict.what, HasSubstr(text));
  }

  Family family_ = Bicycle();
  SlopeClaim claim_ = ClaimOf(family_, 2, 3);
};

TEST_F(Covers, ACoverHoldsAsItIsWritten) {
  EXPECT_EQ(Check().answer, Answer::kYes);
  claim_ = ClaimOf(family_, 2, 5);
  EXPECT_EQ(Check().answer, Answer::kYes);
}

TEST_F(Covers, OfParameterBoxesHold) {
  family_ = Bicycle(0.1);
  for (const int column : {3, 5}) {
    claim_ = ClaimOf(family_, 2, column);
    EXPECT_EQ(Check().answer, Answer::kYes) << Check().what;
  }
}

TEST_F(Covers, OfABallHold) {
  family_ = PointMassInBall();
  for (const int column : {2, 3}) {
    claim_ = ClaimOf(family_, 3, column, 1e-2);
    EXPECT_EQ(Check().answer, Answer::kYes) << Check().what;
  }
}

TEST_F(Covers, AMissingPartIsSeen) {
  for (auto part : {&Cover::Node::below, &Cover::Node::above}) {
    const Cover before = claim_.cover;
    claim_.cover.nodes[0].*part = -1;
    ExpectRefuted("a part of the domain is missing");
    claim_.cover = before;
  }
  claim_.cover.nodes.clear();
  ExpectRefuted("a part of the domain is missing");
}

TEST_F(Covers, ALoopIsNoCover) {
  claim_.cover.nodes[1] = {3, false, 5, 1, 1};
  ExpectRefuted("missing");
}

TEST_F(Covers, ALoweredBoundIsSeen) {
  Cover::Node& leaf = Largest(claim_.cover);
  leaf.number *= 1 - 1e-6;
  ExpectRefuted("but the slope is");
}

TEST_F(Covers, ALoweredDeclarationIsSeen) {
  claim_.bound *= 1 - 1e-6;
  ExpectRefuted("above the declared");
}

TEST_F(Covers, ALeafSaidToLieOutsideIsSeen) {
  Largest(claim_.cover).outside = true;
  ExpectRefuted("said to lie outside");
}

TEST_F(Covers, ACutOutsideItsBoxIsSeen) {
  for (const double at : {26.0, -1.0, std::nan("")}) {
    claim_.cover.nodes[0] = {3, false, at, 1, 2};
    ExpectRefuted("outside of its box");
  }
}

TEST_F(Covers, ForALargerDomainDoesNotHold) {
  family_ = Bicycle(0.05);
  EXPECT_NE(Check().answer, Answer::kYes);
}

TEST_F(Covers, ACoverOfAnEntryThatIsZeroIsRefuted) {
  claim_.row = 0;
  ExpectRefuted("zero");
}

// ---- Slopes against the paper's formulas, written by hand.

using Reals = std::vector<Real>;

// With t = |tan delta|, x = beta v^2 t / l, E = x - beta mu g, c = dt kappa / l, phi the gate:
//   |d r_theta / d v|     = c t (phi(E) + 2 x phi'(E)),
//   |d r_theta / d delta| = c |v| (1 + t^2) (phi(E) + x phi'(E)).
// w = (x, y, theta, v, a, delta, jerk, steer_rate, dt, l, kappa, mu, g, beta).
Real HeadingSlope(int, int column, const Reals& w) {
  const Real &v = w[3], &dt = w[8], &wheelbase = w[9], &kappa = w[10], &beta = w[13], t = abs(tan(w[5]));
  const Real c = dt * kappa / wheelbase, x = beta * sqr(v) * t / wheelbase, e = x - beta * w[11] * w[12];
  const Real phi = Gate(e), slope = x * GateSlope(e);
  return column == 3 ? c * t * (phi + Real(2.0) * slope) : c * abs(v) * (Real(1.0) + sqr(t)) * (phi + slope);
}

// With s^2 = |v|^2 + delta_s, l = t log(1 + exp((s - k) / t)), p its derivative, nu = (s + eps) p - l:
//   d a_i / d v_j = l / (s + eps) M_ij + nu / (s (s + eps)^2) (M v)_i v_j,  M = [-gamma, -kappa; kappa, -gamma],
// times dt^2/2 for the positions, dt for the velocities. w = (px, py, vx, vy, ax, ay, dt, gamma, kappa, k, t, eps,
// delta_s).
Real KneeSlope(int row, int column, const Reals& w) {
  const Real &vx = w[2], &vy = w[3], &dt = w[6], &gamma = w[7], &kappa = w[8], &t = w[10];
  const Real s = sqrt(sqr(vx) + sqr(vy) + w[12]), excess = s - w[9], reach = s + w[11];
  const Real ramp = SoftRamp(excess, t), nu = reach * Logistic(excess / t) - ramp;
  const bool first = row % 2 == 0, along = row % 2 == column - 2;
  const Real m = along ? -gamma : first ? -kappa : kappa;
  const Real mv = first ? -(gamma * vx) - kappa * vy : kappa * vx - gamma * vy;
  const Real slope = ramp / reach * m + nu / (s * sqr(reach)) * (mv * (column == 2 ? vx : vy));
  return abs((row < 2 ? sqr(dt) * Real(0.5) : dt) * slope);
}

TEST(SlopesOfATextTest, AreThePapersFormulas) {
  std::mt19937_64 random(9);
  const auto within = [&](const Interval& range) {
    return Real(range.lower + (range.upper - range.lower) * static_cast<double>(random() >> 11) * 0x1p-53);
  };
  const auto compare = [&](const Family& family, Real (*formula)(int, int, const Reals&), std::size_t entries) {
    const Slopes slopes(family.residual);
    ASSERT_EQ(slopes.Entries().size(), entries);
    for (int trial = 0; trial < 300; ++trial) {
      Reals w;
      for (const Interval& range : family.domain.Ranges()) w.push_back(within(range));
      for (const Interval& range : family.parameters) w.push_back(within(range));
      for (const auto& [row, column] : slopes.Entries()) {
        const Real by_hand = formula(row, column, w), value = abs(slopes.At(row, column, w, false).value);
        EXPECT_TRUE(CertainlyAtMost(abs(value - by_hand), 1e-60)) << value.text() << " " << by_hand.text();
      }
    }
  };
  compare(Bicycle(0.1), HeadingSlope, 2);
  compare(PointMassInBall(0.1), KneeSlope, 8);
}

// The slope |y| sign(x) is zero in the middle of the box, and 1 at its corners: no expansion may leave the kink out.
TEST(SlopesOfATextTest, SlopesOverAKinkAreNotExpanded) {
  const Family family = Made(Square(1), "abs(x)*y", "0");
  const auto check = [&](double bound) {
    Cover cover;
    cover.nodes.push_back({.number = bound});
    return CoverChecker(family.domain, family.residual).Check({0, 0, bound, cover});
  };
  EXPECT_EQ(check(1).answer, Answer::kYes);
  EXPECT_NE(check(std::nextafter(1, 0)).answer, Answer::kYes);
  EXPECT_EQ(check(0.5).answer, Answer::kNo);
}

// A box of a text: with its own derivatives, at a kink, where it is undefined, and where a power of zero hides a name.
TEST(SlopesOfATextTest, OverBoxesAreRanges) {
  const auto at = [](const char* text, const Real& x, const Real& y) {
    const Family family = Made(Square(1), text, "0");
    return Slopes(family.residual).At(0, 0, Reals{x, y, 0.0, 1.0}, true);
  };
  const Slope square = at("x^2*y", Real::FromTo(1.0, 2.0), Real::FromTo(3.0, 4.0));  // 2 x y
  EXPECT_TRUE(CertainlyAtMost(square.value, 16.0) && CertainlyAtMost(6.0, square.value));
  EXPECT_TRUE(CertainlyAtMost(square.gradient[0], 8.0) && CertainlyAtMost(6.0, square.gradient[0]));
  EXPECT_TRUE(CertainlyAtMost(square.gradient[1], 4.0) && CertainlyAtMost(2.0, square.gradient[1]));
  const Slope kink = at("abs(x)", Real::FromTo(-1.0, 1.0), 0.0);
  EXPECT_TRUE(CertainlyAtMost(kink.value, 1.0) && CertainlyAtMost(-1.0, kink.value));
  EXPECT_FALSE(kink.gradient[0].IsFinite());
  EXPECT_FALSE(at("x + log(y)", 1.0, Real::FromTo(-1.0, 1.0)).value.IsFinite());
  const Family hidden = Made(Square(1), "x^0*u + c", "y");
  EXPECT_EQ(Slopes(hidden.residual).Entries(), (std::vector<std::pair<int, int>>{{0, 2}, {1, 1}}));
  for (int column = 0; column < 3; ++column) EXPECT_EQ(hidden.slopes.Occurs(0, column), column == 2);
}

}  // namespace forereach::verifier::cover_check_test
