// Bounds on the motion between two samples: known suprema, motions that come close to them, and what has no bound.
#include "forereach/declare/motion_bound.h"

#include "tests/test.h"

#include "forereach/declare/mean_value.h"
#include "forereach/dynamics/models/kinematic_bicycle.h"
#include "forereach/dynamics/models/named_models.h"
#include "forereach/dynamics/text_model.h"
#include "tests/text_models.h"

namespace forereach::motion_bound_test {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr double kGap = 1e-5;

Domain DomainOf(const Eigen::VectorXd& lower, const Eigen::VectorXd& upper, const Eigen::VectorXd& input) {
  return {.state = Box(lower, upper), .input = Box(-input, input)};
}

Domain BicycleDomain(double v, double a, double delta) {
  const Eigen::VectorXd upper{{50, 50, 3.2, v, a, delta}}, lower{{-50, -50, -3.2, -0.5, -a, -delta}};
  return DomainOf(lower, upper, Eigen::Vector2d(10, 1));
}

MotionBounds Bound(const NominalModel& model, const Domain& domain, double period, int heading,
                   const Eigen::VectorXd& rest) {
  const auto flow = MakeFlow(model);
  const Eigen::MatrixXd projection = Eigen::MatrixXd::Identity(2, model.num_states());
  return BoundMotion({*flow, domain, period, projection, heading, rest}, {.gap = kGap});
}

Eigen::VectorXd NoRest(int n) { return Eigen::VectorXd::Constant(n, kInfinite); }

TEST(MotionBound, OfAPointMassIsItsLargestControl) {
  const auto model = MakePointMass(0.15);
  const Domain domain = DomainOf(Eigen::Vector4d(-9, -9, -3, -3), Eigen::Vector4d(9, 9, 3, 3), Eigen::Vector2d(2, 0.5));
  const MotionBounds bounds = Bound(*model, domain, 0.15, -1, NoRest(4));
  for (const auto& [bound, supremum] :
       {std::pair{bounds.acceleration.at(0), 2.0}, std::pair{bounds.acceleration.at(1), 0.5}}) {
    EXPECT_FIELDS(bound, (upper, supremum), (lower, supremum));
    EXPECT_TRUE(bound.reached);
  }
  EXPECT_EQ(bounds.turn_rate.upper, 0);
}

// The largest rate is reached at the end of a step, outside the domain.
TEST(MotionBound, OfARateIsItsLargestBetweenTwoSamples) {
  const auto model = MakePointMass(0.125);
  const Domain domain = DomainOf(Eigen::Vector4d(-9, -9, -3, -3), Eigen::Vector4d(9, 9, 3, 3), Eigen::Vector2d(2, 0.5));
  const auto flow = MakeFlow(*model);
  const Eigen::MatrixXd none = Eigen::MatrixXd::Zero(0, 4);
  const MotionBounds bounds =
      BoundMotion({*flow, domain, 0.125, none, -1, NoRest(4), {}, {0, 2, 3}, 0.25}, {.gap = kGap});
  ASSERT_EQ(bounds.rates.size(), 3u);
  EXPECT_GE(bounds.rates[0].upper, 3.5) << "from 3 m/s on for 1/4 s with 2 m/s^2, though samples are half as far apart";
  EXPECT_LE(bounds.rates[0].upper, 3.53);
  EXPECT_FIELDS(bounds.rates[1], (upper, 2), (lower, 2));
  EXPECT_FIELDS(bounds.rates[2], (upper, 0.5), (lower, 0.5));
  EXPECT_GE(bounds.reachable.upper()[2], 3.5);
}

// A watch that ends every search at once, and one that ends those of the second half: what is there by then is valid.
TEST(MotionBound, HoldsWhenItsWatchEndsTheSearch) {
  const auto model = MakeKinematicBicycle(0.1, 2.5);
  const Domain domain = BicycleDomain(12, 3, 0.36);
  const auto flow = MakeFlow(*model);
  const Eigen::MatrixXd projection = Eigen::MatrixXd::Identity(2, 6);
  const auto bound = [&](const MotionWatch& watch) {
    return BoundMotion({*flow, domain, 0.1, projection, 2, NoRest(6), watch}, {.gap = kGap});
  };
  double last = 0;
  const MotionBounds whole = bound([&](double done, double next) {
    EXPECT_LE(last, done);
    EXPECT_LT(done, next);
    EXPECT_LE(next, 1);
    last = done;
    return false;
  });
  EXPECT_GT(last, 0.8);
  for (const double from : {0.0, 0.5}) {
    const MotionBounds ended = bound([&](double done, double next) { return next < 1 && done >= from; });
    const auto expect_looser = [](const MotionBound& loose, const MotionBound& tight) {
      EXPECT_GE(loose.upper, tight.upper);
      EXPECT_LE(loose.boxes, tight.boxes);
      EXPECT_LT(loose.upper, kInfinite);
    };
    for (std::size_t k = 0; k < 2; ++k) expect_looser(ended.acceleration[k], whole.acceleration[k]);
    expect_looser(ended.turn_rate, whole.turn_rate);
    EXPECT_FALSE(ended.acceleration[1].reached && from == 0);
  }
}

TEST(MotionBound, BoundsAMotionThatBeginsAtRestByItsInputs) {
  const auto model = MakePointMass(0.15);
  const Domain domain = DomainOf(Eigen::Vector4d(-9, -9, 0, 0), Eigen::Vector4d(9, 9, 0, 0), Eigen::Vector2d(2, 0.5));
  EXPECT_FIELDS(Bound(*model, domain, 0.15, -1, NoRest(4)).acceleration, (at(0).upper, 2), (at(1).upper, 0.5));
}

// The acceleration is a along the heading and v^2 tan(delta) / wheelbase across it, so its largest component in any
// fixed direction has the length of both. A bit is added to v for the motion between two samples, and nothing to a and
// delta, which move in straight lines.
TEST(MotionBound, OfABicycleThatStopsIsAtTheDomainsEnds) {
  const double v = 12, a = 3, delta = 0.36, wheelbase = 2.5, period = 0.1, jerk = 10;
  Eigen::VectorXd rest = NoRest(6);
  rest[3] = 0.16, rest[4] = 0.02;
  const MotionBounds bounds =
      Bound(*MakeKinematicBicycle(period, wheelbase), BicycleDomain(v, a, delta), period, 2, rest);
  const auto across = [&](double speed) { return speed * speed * std::tan(delta) / wheelbase; };
  const double between = v + jerk * period * period / 8;
  for (const MotionBound& bound : bounds.acceleration) {
    EXPECT_GE(bound.upper, std::hypot(a, across(v)));
    EXPECT_LE(bound.upper, std::hypot(a, across(between)) * (1 + kGap));
    EXPECT_TRUE(bound.reached);
    EXPECT_LE(bound.lower, bound.upper);
  }
  EXPECT_GE(bounds.turn_rate.upper, v * std::tan(delta) / wheelbase);
  EXPECT_LE(bounds.turn_rate.upper, between * std::tan(delta) / wheelbase * (1 + kGap));
  // (v tan(delta))' = a tan(delta) + v delta' / cos(delta)^2
  const auto turning = [&](double speed) {
    return (a * std::tan(delta) + speed / std::pow(std::cos(delta), 2)) / wheelbase;
  };
  EXPECT_GE(bounds.turn_acceleration.upper, turning(v));
  EXPECT_LE(bounds.turn_acceleration.upper, turning(between) * (1 + kGap));
}

// The last sample of a plan is not tested against the domain, so the last step of a plan that need not end at rest goes
// on for a period: delta to 0.36 + 0.1, v to 12 + 0.1 (3 + 10 / 2 0.1).
TEST(MotionBound, OfABicycleThatNeedNotStopIncludesTheLastStep) {
  const double wheelbase = 2.5, period = 0.1;
  const MotionBounds bounds =
      Bound(*MakeKinematicBicycle(period, wheelbase), BicycleDomain(12, 3, 0.36), period, 2, NoRest(6));
  const double rate = 12.35 * std::tan(0.46) / wheelbase;
  EXPECT_GE(bounds.turn_rate.upper, rate);
  EXPECT_LE(bounds.turn_rate.upper, rate * 1.02);
  EXPECT_GE(bounds.acceleration[0].upper, std::hypot(4, 12.35 * rate));
}

// x' = f(x, u), by classical Runge-Kutta with steps so small that its error is far below the bounds' gap.
using State = std::array<double, 8>;
State RateOf(const State& z, double wheelbase) {
  const std::array<double, 2> parameters{0.1, wheelbase};
  State rate{};
  KinematicBicycle::Rate<double>(parameters, z, std::span(rate).first(6));
  return rate;
}
State Sum(const State& z, double h, const State& rate) {
  State sum = z;
  for (std::size_t k = 0; k < 6; ++k) sum[k] += h * rate[k];
  return sum;
}

TEST(MotionBound, NoMotionOfTheBicycleExceedsIt) {
  FreshRandom random;
  const double wheelbase = 2, period = 0.2, v = 6, a = 2, delta = 0.6;
  const Domain domain = BicycleDomain(v, a, delta);
  const MotionBounds free = Bound(*MakeKinematicBicycle(period, wheelbase), domain, period, 2, NoRest(6));
  Eigen::VectorXd rest = NoRest(6);
  rest[3] = 0.2;
  const MotionBounds stops = Bound(*MakeKinematicBicycle(period, wheelbase), domain, period, 2, rest);
  EXPECT_LT(stops.acceleration[0].upper, free.acceleration[0].upper);

  int inside = 0, left = 0;
  double largest = 0;
  for (int motion = 0; motion < 4000; ++motion) {
    State z{};
    for (std::size_t k = 0; k < 8; ++k) {
      const Box& box = k < 6 ? domain.state : domain.input;
      const auto i = static_cast<Eigen::Index>(k < 6 ? k : k - 6);
      // Often an end: there are the largest values.
      const double at = std::uniform_real_distribution(-0.3, 1.3)(random);
      z[k] = box.lower()[i] + std::clamp(at, 0.0, 1.0) * (box.upper()[i] - box.lower()[i]);
    }
    struct Largest {
      double acceleration = 0, rate = 0, turn = 0;
    } seen;
    constexpr int kSubsteps = 100;
    const double h = period / kSubsteps;
    for (int i = 0; i <= kSubsteps; ++i) {
      const double turn_rate = z[3] * std::tan(z[5]) / wheelbase;
      seen.acceleration =
          std::max({seen.acceleration, std::abs(z[4] * std::cos(z[2]) - z[3] * std::sin(z[2]) * turn_rate),
                    std::abs(z[4] * std::sin(z[2]) + z[3] * std::cos(z[2]) * turn_rate)});
      seen.rate = std::max(seen.rate, std::abs(turn_rate));
      seen.turn =
          std::max(seen.turn, std::abs(z[4] * std::tan(z[5]) + z[3] * z[7] / std::pow(std::cos(z[5]), 2)) / wheelbase);
      if (i == kSubsteps) break;
      const State k1 = RateOf(z, wheelbase), k2 = RateOf(Sum(z, h / 2, k1), wheelbase),
                  k3 = RateOf(Sum(z, h / 2, k2), wheelbase), k4 = RateOf(Sum(z, h, k3), wheelbase);
      for (std::size_t k = 0; k < 6; ++k) z[k] += h / 6 * (k1[k] + 2 * k2[k] + 2 * k3[k] + k4[k]);
    }
    const auto expect_within = [&](const MotionBounds& bounds) {
      EXPECT_LE(seen.acceleration, bounds.acceleration[0].upper);
      EXPECT_LE(seen.rate, bounds.turn_rate.upper);
      EXPECT_LE(seen.turn, bounds.turn_acceleration.upper);
    };
    expect_within(free);
    const bool ends_inside = domain.state.Contains(Eigen::Map<const Eigen::VectorXd>(z.data(), 6));
    if (ends_inside || std::abs(z[3]) <= rest[3]) {
      expect_within(stops);
      largest = std::max(largest, seen.acceleration / stops.acceleration[0].upper);
    }
    ++(ends_inside ? inside : left);
  }
  EXPECT_GT(inside, 300);
  EXPECT_GT(left, 300);
  EXPECT_GT(largest, 0.8) << "motions that come close to the bound";
}

TEST(MotionBound, ThereIsNoneOverAPoleOfTheTangent) {
  const auto bound = [](double delta) {
    return Bound(*MakeKinematicBicycle(0.1, 2.5), BicycleDomain(12, 3, delta), 0.1, 2, NoRest(6));
  };
  EXPECT_NO_THROW((void)bound(1.4));  // reaches 1.5 in the last step
  EXPECT_THAT([&] { (void)bound(1.5); },
              ThrowsMessage<std::runtime_error>(HasSubstr("no finite bound on the motion between two samples")));
}

// x' = x^2 from x = 1 is infinite after a second.
TEST(MotionBound, ThereIsNoneWhereTheMotionEndsBeforeThePeriod) {
  const Flow flow({{"x"}, {"u"}, {}, {}}, std::vector<ExpressionText>{{"x^2"}});
  const Domain domain = DomainOf(Eigen::VectorXd::Zero(1), Eigen::VectorXd::Ones(1), Eigen::VectorXd::Ones(1));
  const Eigen::MatrixXd projection = Eigen::MatrixXd::Ones(1, 1);
  const auto bound = [&](double period) {
    return BoundMotion({flow, domain, period, projection, -1, NoRest(1)}).acceleration.at(0);
  };
  EXPECT_THROW((void)bound(1), std::runtime_error);
  // x(s) = 1 / (1 - s) and x'' = 2 x^3.
  const MotionBound early = bound(0.1);
  EXPECT_GE(early.upper, 2 / std::pow(0.9, 3));
  EXPECT_LE(early.upper, 3.5);
}

TEST(MotionBound, StopsAtItsLargestNumberOfBoxesWithAValidBound) {
  const auto flow = MakeFlow(*MakeKinematicBicycle(0.1, 2.5));
  const Domain domain = BicycleDomain(12, 3, 0.36);
  const Eigen::MatrixXd projection = Eigen::MatrixXd::Identity(2, 6);
  const MotionBounds bounds = BoundMotion({*flow, domain, 0.1, projection, -1, NoRest(6)}, {.max_boxes = 10});
  EXPECT_FALSE(bounds.acceleration[0].reached);
  EXPECT_GE(bounds.acceleration[0].upper,
            Bound(*MakeKinematicBicycle(0.1, 2.5), domain, 0.1, -1, NoRest(6)).acceleration[0].lower);
}

TEST(MotionBound, OfWeightedStatesAddsThemUp) {
  const auto flow = MakeFlow(*MakePointMass(0.15));
  const Domain domain = DomainOf(Eigen::Vector4d(-9, -9, -3, -3), Eigen::Vector4d(9, 9, 3, 3), Eigen::Vector2d(2, 0.5));
  const Eigen::MatrixXd projection{{1, -4, 0, 0}};
  EXPECT_EQ(BoundMotion({*flow, domain, 0.15, projection, -1, NoRest(4)}).acceleration.at(0).upper, 4);
}

// A text with rates has the bounds of the compiled model with the same equations.
TEST(MotionBound, OfATextIsThatOfItsRates) {
  ModelText text = BicycleText(0.1, 2.5);
  text.equations = {{"v*cos(theta)"}, {"v*sin(theta)"}, {"v*tan(delta)/wheelbase"}, {"a"}, {"jerk"}, {"steer_rate"}};
  const Domain domain = BicycleDomain(12, 3, 0.36);
  const MotionBounds compiled = Bound(*MakeKinematicBicycle(0.1, 2.5), domain, 0.1, 2, NoRest(6));
  for (const auto integrator : {ModelText::Integrator::kEuler, ModelText::Integrator::kRk4}) {
    text.integrator = integrator;
    const MotionBounds bounds = Bound(*MakeTextModel(text), domain, 0.1, 2, NoRest(6));
    for (std::size_t i = 0; i < 2; ++i) EXPECT_EQ(bounds.acceleration[i].upper, compiled.acceleration[i].upper);
    EXPECT_EQ(bounds.turn_acceleration.upper, compiled.turn_acceleration.upper);
  }
  text.integrator = ModelText::Integrator::kNone;
  EXPECT_EQ(MakeFlow(*MakeTextModel(text)), nullptr);
}

// a = c u with c in [1, 2].
TEST(MotionBound, HoldsForAllParameters) {
  const Flow flow({{"x", "v"}, {"u"}, {{"c", 1, 2}}, {}}, std::vector<ExpressionText>{{"v"}, {"c*u"}});
  const Domain domain = DomainOf(Eigen::Vector2d(-9, -3), Eigen::Vector2d(9, 3), Eigen::VectorXd::Constant(1, 5));
  const Eigen::MatrixXd projection{{1, 0}};
  const MotionBound bound =
      BoundMotion({flow, domain, 0.1, projection, -1, NoRest(2)}, {.max_boxes = 100}).acceleration.at(0);
  EXPECT_GE(bound.upper, 10);
  EXPECT_LE(bound.upper, 10 * (1 + 1e-12));
}

// The arm of config/models/two_link_arm.yaml. Over its whole domain, natural intervals do not exclude that the
// determinant of its mass matrix is zero.
struct TwoLinkArm : testing::Test {
  using Point = std::array<double, 6>;

  static std::shared_ptr<const NominalModel> Model() {
    return MakeTextModel(TextModel({{"q1", "w1"},
                                    {"q2", "w2"},
                                    {"w1", "(load1/3 - m12*load2)/determinant"},
                                    {"w2", "(m11*load2 - m12*load1)/determinant"}},
                                   {"torque1", "torque2"}, {{"dt", kPeriod, kPeriod}},
                                   {{"m11", "5/3 + cos(q2)"},
                                    {"m12", "1/3 + cos(q2)/2"},
                                    {"load1", "torque1 + sin(q2)/2*w2*(2*w1 + w2)"},
                                    {"load2", "torque2 - sin(q2)/2*w1^2"},
                                    {"determinant", "m11/3 - m12^2"}},
                                   ModelText::Integrator::kRk4));
  }
  static Domain DomainOfTheArm(double q1, double q2) {
    return {.state = Box(Eigen::Vector4d(-q1, -q2, -1.2, -1.2), Eigen::Vector4d(q1, q2, 1.2, 1.2)),
            .input = Box(Eigen::Vector2d(-8, -4), Eigen::Vector2d(8, 4))};
  }
  static Point Rate(const Point& z) {
    const double c = std::cos(z[1]), s = std::sin(z[1]), m11 = 5.0 / 3 + c, m12 = 1.0 / 3 + c / 2;
    const double load1 = z[4] + s / 2 * z[3] * (2 * z[2] + z[3]), load2 = z[5] - s / 2 * z[2] * z[2];
    const double determinant = 4.0 / 9 - c * c / 4;
    return {z[2], z[3], (load1 / 3 - m12 * load2) / determinant, (m11 * load2 - m12 * load1) / determinant};
  }
  /** The end of the second link, and its acceleration. */
  static std::array<double, 2> AccelerationOfTheHand(const Point& z, const Point& rate) {
    const double a = z[0] + z[1], w = z[2] + z[3], alpha = rate[2] + rate[3];
    return {-std::sin(z[0]) * rate[2] - std::cos(z[0]) * z[2] * z[2] - std::sin(a) * alpha - std::cos(a) * w * w,
            std::cos(z[0]) * rate[2] - std::sin(z[0]) * z[2] * z[2] + std::cos(a) * alpha - std::sin(a) * w * w};
  }
  static constexpr double kPeriod = 0.05;
  static constexpr double kRest = 0.15;

  /** The largest of what a motion has, of those from the domain that last at most a period and end in it or at rest. */
  template <class Seen>
  static std::array<double, 2> Largest(const Domain& domain, Seen seen, std::mt19937& random) {
    std::array<double, 2> largest{};
    for (int motion = 0; motion < 20'000; ++motion) {
      Point z{};
      for (std::size_t k = 0; k < 6; ++k) {
        const Box& box = k < 4 ? domain.state : domain.input;
        const auto i = static_cast<Eigen::Index>(k < 4 ? k : k - 4);
        // Often an end, or the middle: there are the largest values.
        const double at = std::uniform_real_distribution(-0.4, 1.4)(random);
        z[k] = k == 1 && motion % 2 == 0
                   ? 0
                   : box.lower()[i] + std::clamp(at, 0.0, 1.0) * (box.upper()[i] - box.lower()[i]);
      }
      const double h = kPeriod / 20 * std::pow(std::uniform_real_distribution(0.0, 1.0)(random), 3);
      std::array<double, 2> has{};
      for (int i = 0; i <= 20; ++i) {
        const auto now = seen(z, Rate(z));
        for (std::size_t k = 0; k < 2; ++k) has[k] = std::max(has[k], std::abs(now[k]));
        const auto moved = [&](double step, const Point& rate) {
          Point to = z;
          for (std::size_t k = 0; k < 4; ++k) to[k] += step * rate[k];
          return to;
        };
        const Point k1 = Rate(z), k2 = Rate(moved(h / 2, k1)), k3 = Rate(moved(h / 2, k2)), k4 = Rate(moved(h, k3));
        if (i < 20)
          for (std::size_t k = 0; k < 4; ++k) z[k] += h / 6 * (k1[k] + 2 * k2[k] + 2 * k3[k] + k4[k]);
      }
      const bool is_inside = domain.state.Contains(Eigen::Map<const Eigen::VectorXd>(z.data(), 4));
      if (!is_inside && (std::abs(z[2]) > kRest || std::abs(z[3]) > kRest)) continue;
      for (std::size_t k = 0; k < 2; ++k) largest[k] = std::max(largest[k], has[k]);
    }
    return largest;
  }
  static Eigen::VectorXd Rest() { return Eigen::Vector4d(kInfinite, kInfinite, kRest, kRest); }

  const unsigned seed_ = std::random_device{}();
  std::mt19937 random_{seed_};
};

TEST_F(TwoLinkArm, ItsBoundIsThatOfTheMotionsItHas) {
  SCOPED_TRACE("seed " + std::to_string(seed_));
  const auto flow = MakeFlow(*Model());
  const Domain domain = DomainOfTheArm(1, 2.5);
  Flow::Derivatives whole;
  flow->Enclose(domain.Ranges(), whole);
  ASSERT_FALSE(whole.first[3].value.IsFinite()) << "its equations have no enclosure in one piece";
  const MotionBounds bounds =
      BoundMotion({*flow, domain, kPeriod, Eigen::MatrixXd::Identity(2, 4), -1, Rest()}, {.gap = 0.01});
  const auto largest = Largest(
      domain,
      [](const Point&, const Point& rate) {
        return std::array{rate[2], rate[3]};
      },
      random_);
  for (std::size_t k = 0; k < 2; ++k) {
    EXPECT_TRUE(bounds.acceleration[k].reached);
    EXPECT_GE(bounds.acceleration[k].upper, largest[k]);
    EXPECT_LE(bounds.acceleration[k].upper, 1.1 * largest[k]);
  }
}

TEST_F(TwoLinkArm, TheBoundOfItsHandIsThatOfTheMotionsItHas) {
  SCOPED_TRACE("seed " + std::to_string(seed_));
  const Body body{-1, {BodyPart{{}, 0, {{{"cos(q1) + cos(q1 + q2)", 1, 1}, {"sin(q1) + sin(q1 + q2)", 1, 1}}}}}};
  const auto flow = MakeFlow(*Model(), body.Coordinates());
  const Domain domain = DomainOfTheArm(0.2, 2);
  const MotionBounds bounds =
      BoundMotion({*flow, domain, kPeriod, Eigen::MatrixXd::Zero(2, 4), -1, Rest()}, {.gap = 0.1});
  const auto largest = Largest(domain, AccelerationOfTheHand, random_);
  for (std::size_t k = 0; k < 2; ++k) {
    EXPECT_TRUE(bounds.acceleration[k].reached) << bounds.acceleration[k].boxes;
    EXPECT_GE(bounds.acceleration[k].upper, largest[k]);
    EXPECT_LE(bounds.acceleration[k].upper, 1.4 * largest[k]);
  }
}

// Its denominator is at least 1/4 + c, which natural intervals do not see.
TEST(MotionBound, ThereIsOneIffTheDenominatorHasNoZero) {
  const auto bound = [](double c) {
    const Flow flow({{"x", "v"}, {"u"}, {{"c", c, c}}, {}}, std::vector<ExpressionText>{{"v"}, {"u/(x^2 + x + c)"}});
    const Domain domain = DomainOf(Eigen::Vector2d(-2, -1), Eigen::Vector2d(2, 1), Eigen::VectorXd::Constant(1, 3));
    return BoundMotion({flow, domain, 0.01, Eigen::MatrixXd{{1, 0}}, -1, NoRest(2)}, {.gap = 0.01}).acceleration.at(0);
  };
  const MotionBound one = bound(0.75);  // u / (1/2 + (x + 1/2)^2)
  EXPECT_TRUE(one.reached);
  EXPECT_GE(one.upper, 6);
  EXPECT_LE(one.upper, 6.1);
  EXPECT_THROW((void)bound(0.25), std::runtime_error);
  EXPECT_THROW((void)bound(0.2), std::runtime_error);
}

// The mean-value form bounds by what it expands: nothing in the range has more.
TEST(MeanValue, ExpansionBoundsEveryPointOfTheRange) {
  for (const Interval rise : {Interval(-1, 3), Interval(-3, 1), Interval(-2, 2), Interval(-1e300, 1e300)}) {
    const Interval range(-1, 7);
    const ExpansionPoint at = ExpandForUpperBound(range, rise);
    EXPECT_TRUE(range.Contains(at.point));
    for (const double x : {range.lower, at.point, range.upper})
      EXPECT_GE(at.excess, std::max(rise.lower * (x - at.point), rise.upper * (x - at.point)));
    EXPECT_LE(at.excess, 8.01 * rise.Magnitude());
  }
}

// A position and a heading, which may turn by 0.2 rad more than the model says.
std::shared_ptr<const NominalModel> Turning(std::vector<std::string> angles) {
  ModelText text{.name = "turning", .angles = std::move(angles)};
  for (const char* state : {"s", "theta"}) text.states.push_back({state, ""});
  text.inputs.push_back({"rate", ""});
  text.parameters = {{"dt", 0.5, 0.5}};
  text.equations = {{"s"}, {"theta + dt*rate"}};
  return MakeTextModel(text);
}

// It turns by 1.5, 2 and 4.5 rad from 2.5 on: to 4, 6 and 10.5.
TEST(MeasureMotion, KnowsAnAngleThatIsRecordedWrapped) {
  constexpr double kTurn = 2 * std::numbers::pi;
  Transitions transitions;
  transitions.z = Eigen::MatrixXd{{0, 2.5, 2.8}, {0, 4 - kTurn, 4.2}, {0, 6 - kTurn, 8.8}};
  transitions.x_next = Eigen::MatrixXd{{0, 4 - kTurn}, {0, 6}, {0, 10.5 - 2 * kTurn}};  // the second is not wrapped
  const Eigen::MatrixXd projection{{1, 0}};
  const MeasuredMotion measured = MeasureMotion(*Turning({"theta"}), transitions, projection, Body{.heading = 1}, 0.5);
  EXPECT_EQ(measured.triples, 2);
  EXPECT_NEAR(measured.turn_rate, 4.5 / 0.5, 1e-13);
  EXPECT_NEAR(measured.turn_acceleration, 2.5 / 0.25, 1e-12);
  EXPECT_GT(MeasureMotion(*Turning({}), transitions, projection, Body{.heading = 1}, 0.5).turn_rate, 9)
      << "no angle is unwrapped";
}

// A point that turns with q on a circle of 1 m: q' = w, w' = u. Its acceleration has the length of w^2 and u together,
// and some q turns that into any direction.
struct OnACircle : testing::Test {
  static std::shared_ptr<const NominalModel> Model() {
    return MakeTextModel(
        TextModel({{"q", "w"}, {"w", "u"}}, {"u"}, {{"dt", 0.01, 0.01}}, {}, ModelText::Integrator::kRk4));
  }
  Body body_{-1, {BodyPart{{}, 0, {{{"0", 1, 1}, {"0", 1, 1}}, {{"cos(q)", 1, 1}, {"sin(q)", 1, 1}}}}}};
  const Eigen::MatrixXd none_ = Eigen::MatrixXd::Zero(2, 2);
};

TEST_F(OnACircle, TheAccelerationOfAPlaceIsBounded) {
  const auto model = Model();
  const auto flow = MakeFlow(*model, body_.Coordinates());
  ASSERT_EQ(flow->num_places(), 4u);
  const Domain domain = DomainOf(Eigen::Vector2d(-4, -2), Eigen::Vector2d(4, 2), Eigen::VectorXd::Constant(1, 3));
  const MotionBounds bounds = BoundMotion({*flow, domain, 0.01, none_, -1, NoRest(2)}, {.gap = 0.01});
  const double least = std::hypot(2.03 * 2.03, 3), most = 1.01 * std::hypot(2.032 * 2.032, 3);  // in the last step
  for (const MotionBound& bound : bounds.acceleration) {
    EXPECT_TRUE(bound.reached);
    EXPECT_GE(bound.upper, least);
    EXPECT_LE(bound.upper, most);
    EXPECT_LE(bound.lower, bound.upper);
    EXPECT_GE(bound.lower, 5 * 0.99);
  }
}

TEST_F(OnACircle, TheAccelerationOfAPlaceIsMeasured) {
  Transitions transitions{.z = Eigen::MatrixXd{{0, 1, 0}, {0.5, 2, 0}}, .x_next = Eigen::MatrixXd{{0.5, 2}, {1.5, 2}}};
  const MeasuredMotion measured = MeasureMotion(*Model(), transitions, none_, body_, 0.5);
  EXPECT_EQ(measured.triples, 1);
  EXPECT_NEAR(measured.acceleration[0], std::abs(std::cos(1.5) - 2 * std::cos(0.5) + 1) / 0.25, 1e-12);
  EXPECT_NEAR(measured.acceleration[1], std::abs(std::sin(1.5) - 2 * std::sin(0.5)) / 0.25, 1e-12);
}

TEST(MeasureMotion, TakesSecondDifferencesOfTransitionsThatFollowOneAnother) {
  Transitions transitions;
  // From 0 by 1, 4 and 9; then elsewhere.
  transitions.z = Eigen::MatrixXd{{0, 0, 0}, {1, 0.5, 0}, {5, 0.25, 0}, {7, 1, 0}};
  transitions.x_next = Eigen::MatrixXd{{1, 0.5}, {5, 0.25}, {14, 0}, {8, 3}};
  const Eigen::MatrixXd projection{{1, 0}};
  const MeasuredMotion measured = MeasureMotion(*Turning({}), transitions, projection, Body{.heading = 1}, 0.5);
  EXPECT_FIELDS(measured, (triples, 2), (acceleration[0], (14 - 2 * 5 + 1) / 0.25), (turn_rate, 1),
                (turn_acceleration, 0.75 / 0.25));
  EXPECT_EQ(MeasureMotion(*Turning({}), transitions, projection, Body(), 0.5).turn_rate, 0);
  transitions.z(1, 0) = std::nextafter(1.0, 2.0);
  EXPECT_EQ(MeasureMotion(*Turning({}), transitions, projection, Body{.heading = 1}, 0.5).triples, 1);
}

}  // namespace forereach::motion_bound_test
