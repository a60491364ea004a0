// What a certificate claims, tried: rollouts of many residuals that satisfy data and declaration, in 256 bits, never
// leave a slice of the tube, and under a certified plan never meet an obstacle.
#include "tests/test.h"

#include "forereach/certify/tube.h"
#include "tests/oracle/admissible.h"
#include "tests/oracle/traced_random.h"

namespace forereach::containment_test {

// 113 bits: far beyond the tube's rounding, and fast enough for thousands of directions a slice.
__extension__ typedef __float128 Quad;

Quad ToQuad(const Real& x) {
  const long double high = x.ToLongDouble();
  const Real rest = x - Real(static_cast<double>(high)) - Real(static_cast<double>(high - static_cast<double>(high)));
  return static_cast<Quad>(high) + static_cast<Quad>(rest.ToLongDouble());
}

// Half-spaces whose intersection is the slice or contains it: the hull, the normals of every generator in each pair of
// coordinates (together exactly the slice's projection on that pair), and random directions.
class Membership {
 public:
  Membership(Random& random, const Zonotope& slice) {
    const int n = slice.dim();
    for (int a = 0; a < n; ++a) {
      AddBoth(slice, Eigen::VectorXd::Unit(n, a));
      for (int b = 0; b < a; ++b)
        for (int j = 0; j < slice.num_generators(); ++j) {
          Eigen::VectorXd normal = Eigen::VectorXd::Zero(n);
          normal[a] = slice.generator(b, j);
          normal[b] = -slice.generator(a, j);
          if (!normal.isZero(0)) AddBoth(slice, normal);
        }
    }
    for (int i = 0; i < 25; ++i) AddBoth(slice, random.Vector(n));
  }

  bool Contains(const std::vector<Real>& x) const {
    std::vector<Quad> point;
    for (const Real& entry : x) point.push_back(ToQuad(entry));
    for (const HalfSpace& half_space : half_spaces_) {
      Quad along = 0;
      for (std::size_t k = 0; k < point.size(); ++k)
        along += static_cast<Quad>(half_space.normal[static_cast<Eigen::Index>(k)]) * point[k];
      if (!(along <= half_space.bound)) return false;
    }
    return true;
  }

 private:
  struct HalfSpace {
    Eigen::VectorXd normal;
    Quad bound;
  };

  void AddBoth(const Zonotope& slice, const Eigen::VectorXd& normal) {
    Quad middle = 0, spread = 0;
    for (int k = 0; k < slice.dim(); ++k) middle += static_cast<Quad>(normal[k]) * static_cast<Quad>(slice.center(k));
    for (int j = 0; j < slice.num_generators(); ++j) {
      Quad along = 0;
      for (int k = 0; k < slice.dim(); ++k)
        along += static_cast<Quad>(normal[k]) * static_cast<Quad>(slice.generator(k, j));
      spread += along < 0 ? -along : along;
    }
    for (int k = 0; k < slice.dim(); ++k)
      spread += static_cast<Quad>(std::abs(normal[k])) * static_cast<Quad>(slice.slack(k));
    half_spaces_.push_back({normal, middle + spread});
    half_spaces_.push_back({-normal, spread - middle});
  }

  std::vector<HalfSpace> half_spaces_;
};

// The distance from P x to the obstacle's core is at least what its dual bound in 256 bits says; the obstacles are
// convex, so being outside is being beyond one of their sides, or away from the centre.
bool Collides(const Obstacle& obstacle, const Eigen::MatrixXd& projection, const std::vector<Real>& x) {
  std::vector<Real> y;
  for (Eigen::Index k = 0; k < projection.rows(); ++k) {
    y.emplace_back(0.0);
    for (std::size_t l = 0; l < x.size(); ++l) y.back() += Real(projection(k, static_cast<Eigen::Index>(l))) * x[l];
  }
  const auto& points = obstacle.points();
  switch (obstacle.kind()) {
    case Obstacle::Kind::kCircle: {
      const Real dx = y[0] - points[0][0], dy = y[1] - points[0][1];
      return dx * dx + dy * dy <= Real(obstacle.radius()) * Real(obstacle.radius());
    }
    case Obstacle::Kind::kBox:
      return Real(points[0][0]) <= y[0] && y[0] <= Real(points[1][0]) && Real(points[0][1]) <= y[1] &&
             y[1] <= Real(points[1][1]);
    case Obstacle::Kind::kHalfSpace:
      return Real(points[0][0]) * y[0] + Real(points[0][1]) * y[1] >= Real(obstacle.offset());
    case Obstacle::Kind::kPolygon:
    case Obstacle::Kind::kGrid: break;  // none is made here
  }
  bool left = true, right = true;  // of every side of the triangle
  for (std::size_t i = 0; i < 3; ++i) {
    const Eigen::VectorXd &a = points[i], &b = points[(i + 1) % 3];
    const Real cross = (Real(b[0]) - a[0]) * (y[1] - a[1]) - (Real(b[1]) - a[1]) * (y[0] - a[0]);
    left = left && cross >= Real(0);
    right = right && cross <= Real(0);
  }
  return left || right;
}

// The model, whether its steps are disturbed, and whether they may be off their times.
class Containment : public testing::TestWithParam<std::tuple<bool, bool, bool>> {};

// Half of the problems know their transitions from a robot that records with errors, and the rollouts are those of the
// true ones, under inputs that are off the plan's by the same errors.
TEST_P(Containment, NoAdmissibleRolloutLeavesTheTubeOrMeetsAnObstacle) {
  const auto [bicycle, disturbed, shifted] = GetParam();
  TracedRandom random(801 + bicycle), winds(811 + bicycle), records(841 + bicycle);
  int certified = 0, rollouts = 0, slices = 0;
  for (int trial = 0; trial < 70; ++trial) {
    SCOPED_TRACE("trial " + std::to_string(trial));
    const auto truth = AnyProblem(random, bicycle, random.Integer(1, 12));
    if (disturbed) Disturb(winds, *truth);
    if (shifted) Shift(winds, *truth);
    const auto problem = records.Coin() ? Recorded(records, *truth) : truth;
    const Certifier certifier(problem);
    ASSERT_FALSE(certifier.violation()) << "the data come from a residual that satisfies the declaration";
    Tube tube;
    for (int q = 0; q < 2; ++q) {
      const Query query = AnyQuery(random, *problem);
      const Decision decision = certifier.Certify(query.plan(), query.initial_set, query.obstacles, tube);
      ASSERT_NE(decision.outcome, Outcome::kFalsified);
      certified += decision.outcome == Outcome::kCertified;
      ASSERT_EQ(tube.slice(0).GeneratorMatrix(), query.initial_set.GeneratorMatrix());
      ASSERT_EQ(tube.slice(0).CenterVector(), query.initial_set.CenterVector());
      std::vector<Membership> members;
      for (int t = 0; t <= tube.length(); ++t) members.emplace_back(random, tube.slice(t));
      // X_0 is the set the state was drawn from, with nothing to spare for the judge's own rounding.
      const auto holds = [&](int t, const std::vector<Real>& x) {
        ++slices;
        return (t == 0 || members[static_cast<std::size_t>(t)].Contains(x)) &&
               (decision.outcome != Outcome::kCertified ||
                std::ranges::none_of(query.obstacles, [&](const Obstacle& obstacle) {
                  return Collides(obstacle, problem->projection, x);
                }));
      };
      for (int r = 0; r < 6; ++r, ++rollouts)
        ASSERT_EQ(FirstFailure(random, winds, records, *problem, query, tube.length(),
                               AdmissibleResidual(random, *truth), holds),
                  -1)
            << "outside that slice, or in an obstacle";
    }
  }
  RecordProperty("rollouts", rollouts);
  RecordProperty("slices", slices);
  RecordProperty("certified", certified);
  EXPECT_GT(certified, shifted ? 10 : 20);
  EXPECT_GT(slices, 2000);
}

// How far a slice reaches beyond the other tube's in some coordinate, in half-widths of that slice.
double Excess(const Tube& tube, const Tube& of) {
  double most = 0;
  for (int t = 0; t <= std::min(tube.length(), of.length()); ++t)
    for (int k = 0; k < tube.slice(0).dim(); ++k) {
      const Interval hull = of.hull(t, k);
      const double beyond = std::max(tube.hull(t, k).upper - hull.upper, hull.lower - tube.hull(t, k).lower);
      if (beyond > 0) most = std::max(most, beyond / hull.HalfWidthUpper());
    }
  return most;
}

// A certificate is about all residuals that the observations of its moment admit. More observations admit some of
// these, so it holds for them; whether it could be derived again is not said.
TEST_P(Containment, ACertificateHoldsForEveryResidualThatMoreObservationsAdmit) {
  const auto [bicycle, disturbed, shifted] = GetParam();
  TracedRandom random(821 + bicycle), winds(831 + bicycle);
  int rollouts = 0, plans = 0, wider = 0;
  double farthest = 0;
  for (int trial = 0; trial < 60; ++trial) {
    SCOPED_TRACE("trial " + std::to_string(trial));
    const auto all = AnyProblem(random, bicycle, random.Integer(4, 16));
    if (disturbed) Disturb(winds, *all);
    if (shifted) Shift(winds, *all);
    const int last = static_cast<int>(all->transitions.z.rows()),
              first = random.Coin() ? last - 1 : random.Integer(1, 3);
    const auto some = std::make_shared<Problem>(*all);
    some->transitions = {all->transitions.z.topRows(first), all->transitions.x_next.topRows(first)};
    Certifier certifier(some);
    const Query query = AnyQuery(random, *all);
    Tube issued, again;
    const Decision decision = certifier.Certify(query.plan(), query.initial_set, {}, issued);
    for (Eigen::Index i = first; i < all->transitions.z.rows(); ++i) {
      const Eigen::VectorXd z = all->transitions.z.row(i), next = all->transitions.x_next.row(i);
      ASSERT_EQ(certifier.Learn(View(z), View(next)), Learned::kAdded);
    }
    ASSERT_FALSE(certifier.violation()) << "the data come from a residual that satisfies the declaration";
    if (decision.outcome != Outcome::kCertified) continue;
    ++plans;
    std::vector<Membership> members;
    for (int t = 0; t <= issued.length(); ++t) members.emplace_back(random, issued.slice(t));
    const auto holds = [&](int t, const std::vector<Real>& x) {
      return t == 0 || members[static_cast<std::size_t>(t)].Contains(x);
    };
    for (int r = 0; r < 3; ++r, ++rollouts)
      ASSERT_EQ(
          FirstFailure(random, winds, winds, *all, query, issued.length(), AdmissibleResidual(random, *all), holds), -1)
          << "outside that slice";
    static_cast<void>(certifier.Certify(query.plan(), query.initial_set, {}, again));
    const double excess = Excess(again, issued);
    wider += excess > 1e-9;
    farthest = std::max(farthest, excess);
  }
  RecordProperty("rollouts", rollouts);
  RecordProperty("plans", plans);
  RecordProperty("wider", wider);
  std::cout << rollouts << " rollouts; of " << plans << " certified plans, " << wider
            << " have a slice that is wider when derived from more observations, by up to " << farthest
            << " of its half-width\n";
  EXPECT_GT(rollouts, 40);
}

INSTANTIATE_TEST_SUITE_P(Models, Containment, testing::Combine(testing::Bool(), testing::Bool(), testing::Bool()));

// The rollouts reach the bounds of the offsets: a tube that knows less of them does not contain one. It has no other
// spread: a point moves at 2 m/s, and after five steps it is where the last offset lets it be.
TEST(ContainmentJudge, NoticesAnOffsetThatIsLargerThanDeclared) {
  auto problem =
      std::make_shared<Problem>(WorldOf(MakePointMass(0.125), Within(Vec({9, 9, 6, 6})), Within(Vec({3, 3}))));
  problem->transitions = {Eigen::MatrixXd::Zero(1, 6), Eigen::MatrixXd::Zero(1, 4)};
  problem->timing.error = 0.03125;
  const Certifier certifier(problem);
  Tube tube;
  const Eigen::MatrixXd controls = Eigen::MatrixXd::Zero(2, 5);
  const Query query{Zonotope::FromBox(Vec({0, 0, 2, 0}), Vec({0, 0, 0, 0})), controls, {}};
  ASSERT_EQ(certifier.Certify(query.plan(), query.initial_set, {}, tube).outcome, Outcome::kCertified);
  TracedRandom random(805);
  for (int t = 1; t <= 5; ++t) {
    const Membership slice(random, tube.slice(t));
    const auto at = [&](double offset) { return std::vector<Real>{2 * (0.125 * t + offset), 0.0, 2.0, 0.0}; };
    for (const double sign : {1.0, -1.0}) {
      EXPECT_TRUE(slice.Contains(at(sign * 0.03125))) << t;
      EXPECT_FALSE(slice.Contains(at(sign * (0.03125 + 0x1p-40)))) << t;
    }
  }
}

// The rollouts reach the bounds of the disturbance: a tube that knows less of it does not contain them.
TEST(ContainmentJudge, NoticesADisturbanceThatIsLargerThanDeclared) {
  TracedRandom random(804);
  for (const bool bicycle : {false, true}) {
    const auto problem = AnyProblem(random, bicycle, 1);
    problem->declaration.lipschitz.setZero();
    problem->declaration.noise_bound.setZero();
    problem->declaration.disturbance = Eigen::VectorXd::Constant(problem->model->num_states(), 0.125);
    const AdmissibleResidual residual(random, *problem);
    problem->declaration.disturbance *= 1 - 0x1p-40;
    const Certifier certifier(problem);
    Tube tube;
    const Query query = AnyQuery(random, *problem);
    ASSERT_NE(certifier
                  .Certify(query.plan(),
                           Zonotope::FromBox(query.initial_set.CenterVector(), 0 * query.initial_set.CenterVector()),
                           {}, tube)
                  .step,
              0);
    const Membership first(random, tube.slice(1));
    std::vector<Real> z(tube.slice(0).center().begin(), tube.slice(0).center().end());
    for (const double u : query.plan().input(0)) z.emplace_back(u);
    const std::vector<Real> nominal = NominalSuccessor(bicycle, z);
    const auto at = [&](double share) {
      std::vector<Real> next;
      for (std::size_t k = 0; k < nominal.size(); ++k) {
        const auto i = static_cast<Eigen::Index>(k);
        // The step's bound beyond the highest residual that the observation allows.
        const Real observed =
            Real(problem->transitions.x_next(0, i)) -
            NominalSuccessor(bicycle, {problem->transitions.z.row(0).begin(), problem->transitions.z.row(0).end()})[k];
        next.push_back(nominal[k] + observed + Real(2 * 0.125 * share));
      }
      return next;
    };
    EXPECT_TRUE(first.Contains(at(1 - 0x1p-39)));
    EXPECT_FALSE(first.Contains(at(1)));
  }
}

// A bound that grows with state and input counts where the step is: from one state its slice ends at that bound, and
// from a set at the largest one in it, under any input that may act.
TEST(ContainmentJudge, NoticesADisturbanceThatIsLargerThanTheExpressionAllows) {
  TracedRandom random(806);
  for (const double half_width : {0.0, 0.25})
    for (const double input_error : {0.0, 0.5}) {
      auto problem = std::make_shared<Problem>(PointMassInHalves());
      problem->declaration.input_error = Vec({input_error, 0});
      problem->declaration.growing = Growing(*problem->model, {"0", "0", "0", "0.125*vx*(vy - ax)"});
      const Certifier certifier(problem);
      Tube tube;
      const Query query{Zonotope::FromBox(Vec({0, 0, 2, 0.5}), Vec({0, 0, half_width, 0})), Vec({1, 0}), {}};
      ASSERT_EQ(certifier.Certify(query.plan(), query.initial_set, {}, tube).outcome, Outcome::kCertified);
      const Membership slice(random, tube.slice(1));
      const double vx = 2 + half_width, ax = 1 + input_error, bound = 0.125 * vx * (ax - 0.5);
      const auto at = [&](double w) { return std::vector<Real>{0.5 * vx + 0.125 * ax, 0.25, vx + 0.5 * ax, 0.5 + w}; };
      for (const double sign : {1.0, -1.0}) {
        EXPECT_TRUE(slice.Contains(at(sign * bound))) << half_width << " " << input_error;
        EXPECT_FALSE(slice.Contains(at(sign * (bound + 0x1p-40)))) << half_width << " " << input_error;
      }
    }
}

// The judge itself: it has to notice a state just outside.
TEST(ContainmentJudge, NoticesAStateJustOutside) {
  for (TracedRandom random(803); random.Again(50);) {
    const Zonotope slice = random.AnyZonotope(6, 20);
    const Membership member(random, slice);
    const int k = random.Below(6);
    std::vector<Real> x(slice.center().begin(), slice.center().end());
    for (int j = 0; j < 20; ++j) {
      const double sign = slice.generator(k, j) < 0 ? -1 : 1;
      for (int l = 0; l < 6; ++l) x[static_cast<std::size_t>(l)] += Real(sign) * Real(slice.generator(l, j));
    }
    std::vector<Real> inside = x, outside = x;
    inside[static_cast<std::size_t>(k)] = inside[static_cast<std::size_t>(k)] - Real(1e-25);
    for (std::size_t l = 0; l < 6; ++l)
      inside[l] =
          Real(slice.center(static_cast<int>(l))) + (inside[l] - slice.center(static_cast<int>(l))) * Real(1 - 1e-10);
    outside[static_cast<std::size_t>(k)] += Real(1e-25);
    EXPECT_TRUE(member.Contains(inside));
    EXPECT_FALSE(member.Contains(outside));
  }
}

}  // namespace forereach::containment_test
