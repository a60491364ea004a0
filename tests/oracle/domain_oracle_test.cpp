// The domain test against rational arithmetic: a set that leaves the domain by any amount is never found inside, and
// one that stays inside by more than rounding always is.
#include "tests/test.h"

#include "forereach/reach/domain.h"
#include "tests/oracle/exact.h"
#include "tests/oracle/traced_random.h"

namespace forereach::domain_oracle_test {

using Kind = DomainExit::Kind;

constexpr int kStates = 4, kInputs = 2, kSize = kStates + kInputs;

// {z : |z - center| <= half_width}; the inputs are points. Padded as DomainTest reads it.
struct Query {
  std::vector<double> center, half_width;

  Query() : center(kMaxStates), half_width(kMaxStates) {}
  explicit Query(Random& random) : Query() {
    for (std::size_t l = 0; l < kSize; ++l) center[l] = random.Uniform(-1, 1) * std::ldexp(1, random.Integer(-3, 3));
    for (std::size_t l = 0; l < kStates; ++l)
      half_width[l] = random.Coin(0.2) ? 0 : std::ldexp(random.Uniform(1, 2), random.Integer(-30, 3));
  }

  [[nodiscard]] Rational Lower(std::size_t l) const { return Rational(center[l]) - Rational(half_width[l]); }
  [[nodiscard]] Rational Upper(std::size_t l) const { return Rational(center[l]) + Rational(half_width[l]); }
  [[nodiscard]] std::vector<Interval> Box() const {
    std::vector<Interval> box;
    for (std::size_t l = 0; l < kSize; ++l)
      box.emplace_back(SubDown(center[l], half_width[l]), AddUp(center[l], half_width[l]));
    return box;
  }
};

Domain Around(double reach) {
  Domain domain;
  domain.state = Box(Eigen::VectorXd::Constant(kStates, -reach), Eigen::VectorXd::Constant(kStates, reach));
  domain.input = Box(Eigen::VectorXd::Constant(kInputs, -reach), Eigen::VectorXd::Constant(kInputs, reach));
  return domain;
}

// max {coefficients . z} over the query.
Rational Largest(const Eigen::VectorXd& coefficients, const Query& query) {
  Rational largest = 0;
  for (std::size_t l = 0; l < kSize; ++l) {
    const Rational c(coefficients[static_cast<Eigen::Index>(l)]);
    largest += std::max<Rational>(c * query.Lower(l), c * query.Upper(l));
  }
  return largest;
}

// max |z_S - center|^2 over the query.
Rational LargestSquare(const Domain::Ball& ball, const Query& query) {
  Rational square = 0;
  for (std::size_t i = 0; i < ball.coordinates.size(); ++i) {
    const auto l = static_cast<std::size_t>(ball.coordinates[i]);
    const Rational middle(ball.center[static_cast<Eigen::Index>(i)]);
    const Rational away = std::max<Rational>(abs(query.Lower(l) - middle), abs(query.Upper(l) - middle));
    square += away * away;
  }
  return square;
}

// Both ways to the answer: the plain test with what follows it, and the rounded one alone.
std::vector<DomainExit> FindExits(const Domain& domain, const Query& query) {
  return {DomainTest(domain).FindExit(query.center.data(), query.half_width.data(),
                                      std::span(query.center).subspan(kStates, kInputs)),
          FindExit(domain, query.Box())};
}

// A bound next to `value`: below it by an ulp or a few, above it by as much, or far enough above to be seen in plain
// arithmetic.
double Beside(const Rational& value, Random& random) {
  double bound = random.Coin() ? Floor(value) : Ceiling(value);
  switch (random.Below(4)) {
    case 0: return NextDown(Floor(value));
    case 1: return NextUp(Ceiling(value));
    case 2:
      for (int ulps = random.Below(16); ulps > 0; --ulps) bound = NextDown(bound);
      return bound;
    default: return bound + std::abs(bound) * std::ldexp(random.Uniform(-1, 1), -random.Integer(40, 54));
  }
}

TEST(FindExit, AgainstAnInequalityNoSetOutsideIsFoundInside) {
  int inside = 0, outside = 0;
  for (TracedRandom random(601); random.Again(40000);) {
    const Query query(random);
    Eigen::VectorXd coefficients = random.Vector(kSize, std::ldexp(1, random.Integer(-4, 4)));
    for (double& c : coefficients)
      if (random.Coin(0.3)) c = 0;
    const Rational largest = Largest(coefficients, query);
    Domain domain = Around(1e3);
    domain.inequalities.push_back({Eigen::VectorXd::Zero(kSize), 1});  // holds everywhere
    domain.inequalities.push_back({coefficients, Beside(largest, random)});
    const Rational bound(domain.inequalities[1].bound), rounding = Rational(0x1p-42) * (abs(largest) + 64);
    for (const DomainExit& exit : FindExits(domain, query)) {
      if (exit.kind == Kind::kNone) {
        ASSERT_LE(largest, bound) << "found inside";
        ++inside;
        continue;
      }
      ASSERT_EQ(exit.kind, Kind::kInequality);
      ASSERT_EQ(exit.index, 1);
      ASSERT_EQ(exit.bound, domain.inequalities[1].bound);
      ASSERT_GE(Rational(exit.value), largest);
      ASSERT_GT(largest, bound - rounding) << "found outside";
      outside += largest > bound;
    }
  }
  EXPECT_GT(inside, 10000);
  EXPECT_GT(outside, 10000);
}

TEST(FindExit, AgainstABallNoSetOutsideIsFoundInside) {
  int inside = 0, outside = 0;
  for (TracedRandom random(602); random.Again(40000);) {
    Query query(random);
    Domain::Ball ball;
    for (int l = 0; l < kSize; ++l)
      if (random.Coin(0.4)) ball.coordinates.push_back(l);
    if (ball.coordinates.empty()) ball.coordinates = {1};
    ball.center = random.Vector(static_cast<int>(ball.coordinates.size()), std::ldexp(1, random.Integer(-4, 3)));
    if (random.Coin(0.3)) ball.center.setZero(), std::ranges::fill(query.center, 0);  // no difference that cancels
    const Rational square = LargestSquare(ball, query);
    const Rational root(std::sqrt(square.get_d()));
    ball.radius = std::max(0.0, Beside(root, random));
    Domain domain = Around(1e3);
    domain.balls = {{{0}, Eigen::VectorXd::Zero(1), 1e3}, ball};
    const Rational radius(ball.radius), bound = radius * radius;
    for (const DomainExit& exit : FindExits(domain, query)) {
      if (exit.kind == Kind::kNone) {
        ASSERT_LE(square, bound) << "found inside";
        ++inside;
        continue;
      }
      ASSERT_EQ(exit.kind, Kind::kBall);
      ASSERT_EQ(exit.index, 1);
      ASSERT_EQ(exit.bound, ball.radius);
      ASSERT_GE(Rational(exit.value) * Rational(exit.value), square);
      const Rational nearly = radius - Rational(0x1p-44) * (radius + 16);  // the ends of the box are rounded
      if (nearly > 0) ASSERT_GT(square, nearly * nearly) << "found outside";
      outside += square > bound;
    }
  }
  EXPECT_GT(inside, 10000);
  EXPECT_GT(outside, 10000);
}

TEST(FindExit, AgainstTheBoxNoSetOutsideIsFoundInside) {
  for (TracedRandom random(603); random.Again(20000);) {
    const Query query(random);
    const int at = random.Below(kSize);
    const auto l = static_cast<std::size_t>(at);
    const bool above = random.Coin();
    const double bound = Beside(above ? query.Upper(l) : query.Lower(l), random);
    Domain domain = Around(1e3);
    Box& part = at < kStates ? domain.state : domain.input;
    Eigen::VectorXd lower = part.lower(), upper = part.upper();
    (above ? upper : lower)[at < kStates ? at : at - kStates] = bound;
    part = Box(lower, upper);
    const bool leaves = above ? query.Upper(l) > Rational(bound) : query.Lower(l) < Rational(bound);
    const bool leaves_by_an_ulp = above ? AddUp(query.center[l], query.half_width[l]) > bound
                                        : SubDown(query.center[l], query.half_width[l]) < bound;
    for (const DomainExit& exit : FindExits(domain, query)) {
      ASSERT_EQ(exit.kind, !leaves_by_an_ulp ? Kind::kNone : above ? Kind::kUpper : Kind::kLower);
      ASSERT_TRUE(!leaves || exit.kind != Kind::kNone);
      if (exit.kind == Kind::kNone) continue;
      ASSERT_EQ(exit.index, at);
      ASSERT_EQ(exit.bound, bound);
    }
  }
}

// Numbers of few bits: what is computed is exact, and a bound that is met is inside to the last bit.
TEST(FindExit, ABoundThatIsMetIsInsideAndOneUlpBelowIsOutside) {
  Query query;
  query.center = {3, -2, 0.5, 1, 0.25, -1};
  query.half_width = {0.5, 1, 0.25, 0, 0, 0};
  query.center.resize(kMaxStates), query.half_width.resize(kMaxStates);
  const Eigen::VectorXd coefficients{{2, -1, 4, 0, 8, -3}};
  const double largest = 2 * 3.5 + 3 + 4 * 0.75 + 2 + 3;
  const Domain::Ball ball{{0, 1}, Eigen::Vector2d(0.5, 1), 5};  // |(3.5 - 0.5, -3 - 1)| = 5
  for (const bool by_ball : {false, true}) {
    Domain domain = Around(10);
    const auto set = [&](double bound) {
      domain.inequalities.clear(), domain.balls.clear();
      if (by_ball)
        domain.balls = {{ball.coordinates, ball.center, bound}};
      else
        domain.inequalities = {{coefficients, bound}};
    };
    const double met = by_ball ? ball.radius : largest;
    set(met);
    for (const DomainExit& exit : FindExits(domain, query)) EXPECT_EQ(exit.kind, Kind::kNone);
    set(NextDown(met));
    for (const DomainExit& exit : FindExits(domain, query))
      EXPECT_EQ(exit.kind, by_ball ? Kind::kBall : Kind::kInequality);
  }
}

TEST(FindExit, NanAndInfinityLieOutsideTheDomain) {
  Query query;
  Domain domain = Around(10);
  domain.inequalities = {{Eigen::VectorXd::Ones(kSize), 100}};
  domain.balls = {{{0, 2}, Eigen::Vector2d::Zero(), 50}};
  for (const DomainExit& exit : FindExits(domain, query)) ASSERT_EQ(exit.kind, Kind::kNone);
  for (std::size_t l = 0; l < kSize; ++l) {
    std::vector<Interval> half_known = query.Box();
    half_known[l].upper = std::nan("");
    EXPECT_EQ(FindExit(domain, half_known).kind, Kind::kUpper);
    half_known[l] = {std::nan(""), 0};
    EXPECT_EQ(FindExit(domain, half_known).kind, Kind::kLower);
    for (const double bad : {std::nan(""), kInfinity, -kInfinity}) {
      Query broken = query;
      broken.center[l] = bad;
      for (const DomainExit& exit : FindExits(domain, broken)) EXPECT_NE(exit.kind, Kind::kNone);
      if (l >= kStates) continue;
      broken = query;
      broken.half_width[l] = std::abs(bad);
      for (const DomainExit& exit : FindExits(domain, broken)) EXPECT_NE(exit.kind, Kind::kNone);
    }
  }
}

}  // namespace forereach::domain_oracle_test
