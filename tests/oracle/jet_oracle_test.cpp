// Jets of the elementary functions against closed formulas for their derivatives in 256 bits.
#include "forereach/dynamics/jet.h"

#include "tests/test.h"

#include "tests/oracle/exact.h"
#include "tests/oracle/traced_random.h"

namespace forereach::jet_oracle_test {

struct Derivatives {
  Real value, first, second;
};

struct Unary {
  const char* name;
  Jet (*jet)(const Jet&);
  Derivatives (*at)(const Real&);
  double lower, upper;  // where arguments are drawn
  friend void PrintTo(const Unary& f, std::ostream* out) { *out << f.name; }
};

template <int kExponent>
Derivatives PowerAt(const Real& x) {
  return {pow(x, kExponent), Real(kExponent) * pow(x, kExponent - 1),
          Real(kExponent * (kExponent - 1)) * pow(x, kExponent - 2)};
}

const std::array kFunctions{
    Unary{"log", [](const Jet& a) { return log(a); },
          [](const Real& x) {
            return Derivatives{log(x), Real(1) / x, Real(-1) / (x * x)};
          },
          1e-3, 10},
    Unary{"asin", [](const Jet& a) { return asin(a); },
          [](const Real& x) {
            const Real rest = Real(1) - x * x;
            return Derivatives{asin(x), Real(1) / sqrt(rest), x / (rest * sqrt(rest))};
          },
          -1, 1},
    Unary{"acos", [](const Jet& a) { return acos(a); },
          [](const Real& x) {
            const Real rest = Real(1) - x * x;
            return Derivatives{acos(x), Real(-1) / sqrt(rest), -x / (rest * sqrt(rest))};
          },
          -1, 1},
    Unary{"atan", [](const Jet& a) { return atan(a); },
          [](const Real& x) {
            const Real sum = Real(1) + x * x;
            return Derivatives{atan(x), Real(1) / sum, Real(-2) * x / (sum * sum)};
          },
          -20, 20},
    Unary{"tanh", [](const Jet& a) { return tanh(a); },
          [](const Real& x) {
            const Real t = tanh(x), slope = Real(1) - t * t;
            return Derivatives{t, slope, Real(-2) * t * slope};
          },
          -30, 30},
    Unary{"signed_square", [](const Jet& a) { return SignedSquare(a); },
          [](const Real& x) {
            const Real sign = x < Real(0) ? Real(-1) : Real(1);
            return Derivatives{sign * x * x, Real(2) * sign * x, Real(2) * sign};
          },
          -3, 3},
    Unary{"sqrt", [](const Jet& a) { return sqrt(a); },
          [](const Real& x) {
            const Real root = sqrt(x);
            return Derivatives{root, Real(0.5) / root, Real(-0.25) / (x * root)};
          },
          1e-3, 10},
    Unary{"exp", [](const Jet& a) { return exp(a); },
          [](const Real& x) {
            return Derivatives{exp(x), exp(x), exp(x)};
          },
          -30, 30},
    Unary{"pow_minus_3", [](const Jet& a) { return pow(a, -3); }, PowerAt<-3>, 0.1, 3},
    Unary{"pow_minus_1", [](const Jet& a) { return pow(a, -1); }, PowerAt<-1>, -3, -0.1},
    Unary{"pow_0", [](const Jet& a) { return pow(a, 0); }, PowerAt<0>, -3, 3},
    Unary{"pow_1", [](const Jet& a) { return pow(a, 1); }, PowerAt<1>, -3, 3},
    Unary{"pow_2", [](const Jet& a) { return pow(a, 2); }, PowerAt<2>, -3, 3},
    Unary{"pow_3", [](const Jet& a) { return pow(a, 3); }, PowerAt<3>, -3, 3},
    Unary{"pow_6", [](const Jet& a) { return pow(a, 6); }, PowerAt<6>, -3, 3},
};

Interval Around(double center, double half, double lower, double upper) {
  return {std::max(center - half, lower), std::min(center + half, upper)};
}

double PointIn(Random& random, const Interval& x) {
  return random.Coin()   ? std::clamp(random.Uniform(x.lower, x.upper), x.lower, x.upper)
         : random.Coin() ? x.lower
                         : x.upper;
}

class UnaryJet : public testing::TestWithParam<Unary> {};

// Of a linear argument a = 3 w_0 - 2 w_1, so that the chain rule counts.
TEST_P(UnaryJet, ContainsValueSlopeAndCurvature) {
  const Unary& f = GetParam();
  int finite = 0;
  for (TracedRandom random(520); random.Again(4000);) {
    const double size = std::ldexp(1, -random.Integer(0, 40)), center = random.Uniform(f.lower, f.upper);
    const Interval a = Around(center, size, f.lower, f.upper);
    const Interval v = Around(random.Uniform(-1, 1), 0, -1, 1);
    // w_0 such that a stays where it is: (a + 2 v) / 3, up to rounding that the exact values below share
    const Interval w = Interval((a.lower + 2 * v.lower) / 3, (a.upper + 2 * v.lower) / 3);
    if (!(w.lower <= w.upper)) continue;
    const Jet jet = f.jet(Jet(3.0) * Jet::Argument(w, 0, true) - Jet(2.0) * Jet::Argument(v, 1, false));
    finite += jet.value.IsFinite() && jet.slope.IsFinite() && jet.curvature[0].IsFinite();
    for (int sample = 0; sample < 4; ++sample) {
      const Real x = Real(3) * Real(PointIn(random, w)) - Real(2) * Real(v.lower);
      if (x <= Real(f.lower) || x >= Real(f.upper)) continue;
      const Derivatives exact = f.at(x);
      SCOPED_TRACE(testing::Message() << "at " << x << " in [" << a.lower << ", " << a.upper << "]");
      ASSERT_TRUE(Inside(exact.value, jet.value));
      ASSERT_TRUE(Inside(Real(3) * exact.first, jet.slope));
      ASSERT_TRUE(Inside(Real(3) * exact.first, jet.gradient[0]));
      ASSERT_TRUE(Inside(Real(-2) * exact.first, jet.gradient[1]));
      ASSERT_TRUE(Inside(Real(9) * exact.second, jet.curvature[0]));
      ASSERT_TRUE(Inside(Real(-6) * exact.second, jet.curvature[1]));
    }
  }
  EXPECT_GT(finite, 3000);
}

// Over narrow boxes the enclosures are narrow too.
TEST_P(UnaryJet, IsTightOverNarrowBoxes) {
  const Unary& f = GetParam();
  for (TracedRandom random(521); random.Again(2000);) {
    const double center = random.Uniform(f.lower * 0.9 + f.upper * 0.1, f.upper * 0.9 + f.lower * 0.1);
    const Jet jet = f.jet(Jet::Argument(Interval(center), 0, true));
    const Derivatives exact = f.at(Real(center));
    const auto expect_near = [](const Interval& range, const Real& value) {
      ASSERT_LE(range.upper - range.lower, 1e-13 * (1 + std::abs(value.ToDouble()))) << value;
    };
    expect_near(jet.value, exact.value);
    expect_near(jet.slope, exact.first);
    expect_near(jet.curvature[0], exact.second);
  }
}

INSTANTIATE_TEST_SUITE_P(All, UnaryJet, testing::ValuesIn(kFunctions),
                         [](const auto& f) { return std::string(f.param.name); });

TEST(JetAtan2, ContainsValueGradientAndCurvature) {
  int finite = 0;
  for (TracedRandom random(522); random.Again(20000);) {
    const double size = std::ldexp(1, -random.Integer(0, 40));
    const Interval y = Around(random.Uniform(-2, 2), size, -3, 3), x = Around(random.Uniform(-2, 2), size, -3, 3);
    const bool by_y = random.Coin();
    const Jet jet = atan2(Jet::Argument(y, 0, by_y), Jet::Argument(x, 1, !by_y));
    if (y.Contains(0) && x.lower <= 0) {
      ASSERT_EQ(jet.value, Interval::Entire());
      for (const Interval& derivative : {jet.slope, jet.gradient[0], jet.gradient[1], jet.curvature[0]})
        ASSERT_EQ(derivative, Interval::Entire());
      continue;
    }
    finite += jet.curvature[0].IsFinite() && jet.curvature[1].IsFinite();
    for (int sample = 0; sample < 4; ++sample) {
      const Real t = PointIn(random, y), s = PointIn(random, x), square = s * s + t * t;
      const Real by_tt = Real(-2) * s * t / (square * square), by_st = (t * t - s * s) / (square * square);
      ASSERT_TRUE(Inside(atan2(t, s), jet.value));
      ASSERT_TRUE(Inside(s / square, jet.gradient[0]));
      ASSERT_TRUE(Inside(-t / square, jet.gradient[1]));
      ASSERT_TRUE(Inside(by_y ? s / square : -t / square, jet.slope));
      ASSERT_TRUE(Inside(by_y ? by_tt : by_st, jet.curvature[0]));
      ASSERT_TRUE(Inside(by_y ? by_st : -by_tt, jet.curvature[1]));
    }
  }
  EXPECT_GT(finite, 15000);
}

// Derivatives of what is undefined may have formulas with values; the value says that they do not count.
TEST(JetOutsideTheDomain, HasNoFiniteValueWhateverItIsMultipliedBy) {
  const auto at = [](double lower, double upper) { return Jet::Argument({lower, upper}, 0, true); };
  for (const Jet& undefined : {log(at(-2, -1)), log(at(0, 1)), sqrt(at(-2, -1)), asin(at(0, 1.5)), acos(at(2, 3)),
                               pow(at(-1, 1), -1), Jet(1.0) / at(-1, 1), atan2(at(0, 1), Jet(-1.0))}) {
    const Jet off = SmoothGate(at(-3, -1));
    EXPECT_EQ(off.value, Interval(0));
    for (const Jet& result :
         {undefined, off * undefined, undefined * off, off / undefined, sin(undefined), cos(undefined), exp(undefined),
          tanh(undefined), atan(undefined), SmoothGate(undefined), abs(undefined), max(undefined, Jet(1.0)),
          min(Jet(1.0), undefined), pow(undefined, 0), min(abs(undefined), Jet(-1.0)), Softplus(undefined, Jet(1.0))})
      EXPECT_EQ(result.value, Interval::Entire());
  }
  for (const Jet& undefined : {log(at(-2, -1)), asin(at(0, 1.5)), sqrt(at(-2, -1))}) {
    EXPECT_FIELDS(undefined, (slope, Interval::Entire()), (curvature[0], Interval::Entire()));
  }
}

}  // namespace forereach::jet_oracle_test
