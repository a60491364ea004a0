// What a body sweeps, between samples and seen from obstacles that move: distances known by hand, true by a hair and
// false by a hair, and motions within the declared bounds that no proof of clearance may exclude.
#include <cmath>

#include "tests/oracle/traced_random.h"
#include "tests/verifier/hand_made.h"
#include "verifier/separation.h"

namespace forereach::verifier::sweep_test {

constexpr double kHair = 1e-12;

Eigen::VectorXd Vector(std::initializer_list<double> entries) {
  Eigen::VectorXd vector(std::ssize(entries));
  std::ranges::copy(entries, vector.begin());
  return vector;
}

Eigen::Vector2d Rotated(const Eigen::Vector2d& q, double angle) {
  return {std::cos(angle) * q.x() - std::sin(angle) * q.y(), std::sin(angle) * q.x() + std::cos(angle) * q.y()};
}

// ---- The hull of several places.

Place At(std::vector<Real> center, double ball = 0) { return {std::move(center), {}, Bend(), Real(ball), 0}; }

Answer Clear(const Sweep& sweep, const Obstacle& obstacle, double clearance) {
  Real best;
  const Precision precision(2400);
  return IsClear(sweep, obstacle, clearance, best);
}

void ExpectClearBy(const Sweep& sweep, const Obstacle& obstacle, double distance) {
  EXPECT_EQ(Clear(sweep, obstacle, distance), Answer::kYes);
  EXPECT_EQ(Clear(sweep, obstacle, Up(distance)), Answer::kNo);
}

TEST(Hull, IsTheSegmentBetweenTwoPoints) {
  ExpectClearBy({{At({0.0}), At({2.0})}, 0.0}, Obstacle::AxisBox(Vector({2.5}), Vector({3})), 0.5);
  const Sweep planar({At({0.0, 0.0}), At({4.0, 0.0})}, 0.0);
  ExpectClearBy(planar, Obstacle::Circle(Eigen::Vector2d(2, 3), 1), 2);  // neither end is as close
  ExpectClearBy(planar, Obstacle::Circle(Eigen::Vector2d(7, 4), 1), 4);  // its end
  ExpectClearBy(planar, Obstacle::HalfSpace(Eigen::Vector2d(3, 4), 17), 1);
  const Sweep spatial({At({0.0, 0.0, 0.0}), At({0.0, 0.0, 4.0})}, 0.0);
  ExpectClearBy(spatial, Obstacle::AxisBox(Eigen::Vector3d(3, 4, 1), Eigen::Vector3d(9, 9, 2)), 5);
}

TEST(Hull, OfSlicesReachesAsFarAsEither) {
  Place wide = At({0.0, 0.0}), thin = At({6.0, 0.0});
  wide.generators = {{Real(1.0), Real()}, {Real(), Real(3.0)}};
  thin.generators = {{Real(1.0), Real()}};
  // Its upper edge runs from (1, 3) to (7, 0): the point (4, 1.5) is on it.
  const Sweep sweep({wide, thin}, 0.0);
  const Obstacle square = Obstacle::Polygon({Vector({4 + 1, 1.5 + 2}), Vector({9, 9}), Vector({5, 9})});
  const double distance = std::sqrt(5.0);  // along (1, 2)
  EXPECT_EQ(Clear(sweep, square, distance - kHair), Answer::kYes);
  EXPECT_EQ(Clear(sweep, square, distance + kHair), Answer::kNo);
}

TEST(Hull, RadiusAndEqualBallsReduceTheDistance) {
  const Sweep sweep({At({0.0, 0.0}, 0.5), At({4.0, 0.0}, 0.5)}, 0.25);
  ExpectClearBy(sweep, Obstacle::Circle(Eigen::Vector2d(2, 3), 1), 1.25);
  ExpectClearBy(sweep, Obstacle::HalfSpace(Eigen::Vector2d(0, 2), 4), 1.25);
}

// A point and a ball of 15 at 25 from it: the tangent from the point runs along (4, 3) / 5.
TEST(Hull, OfAPointAndABallIsRound) {
  const Sweep sweep({At({0.0, 0.0}), At({25.0, 0.0}, 15)}, 0.0);
  const auto expect_clear_by = [&](double x, double y, double distance) {
    const Obstacle circle = Obstacle::Circle(Eigen::Vector2d(x, y), 2);
    EXPECT_EQ(Clear(sweep, circle, distance - kHair), Answer::kYes);
    EXPECT_EQ(Clear(sweep, circle, distance + kHair), Answer::kNo);
  };
  expect_clear_by(5, 10, 3);    // beside the tangent
  expect_clear_by(25, 20, 3);   // above the ball
  expect_clear_by(-4, -3, 3);   // before the point
  expect_clear_by(49, 18, 13);  // beyond the ball: 24, 18 and 30
  EXPECT_EQ(Clear(sweep, Obstacle::Circle(Eigen::Vector2d(25, 0), 0.5), 0), Answer::kNo);
}

// ---- The place of a point of a body that turns.

std::shared_ptr<Problem> WithBody(const Body& body) {
  auto problem = Halves();
  problem->body = body;
  return problem;
}

constexpr int kVx = 2, kVy = 3;  // any state may be the heading

// The corner (x, y) alone, with the heading as it is named.
Body Corner(int heading, double x, double y) { return {heading, {{{Eigen::Vector3d(x, y, 0)}, 0}}}; }

Answer ClearOfAny(const std::vector<Sweep>& sweeps, const Obstacle& obstacle, double clearance) {
  Answer answer = Answer::kNo;
  for (const Sweep& sweep : sweeps)
    if (Clear(sweep, obstacle, clearance) == Answer::kYes) answer = Answer::kYes;
  return answer;
}

Slice SliceOf(const Eigen::VectorXd& center, const Eigen::MatrixXd& columns) {
  Slice slice;
  slice.center.assign(center.begin(), center.end());
  for (const auto column : columns.colwise()) slice.columns.emplace_back(column.begin(), column.end());
  return slice;
}

TEST(Turning, AKnownHeadingPlacesTheCorner) {
  const auto problem = WithBody(Corner(kVy, 3, 4));
  const double angle = 0.5;
  const Slice slice = SliceOf(Eigen::Vector4d(1, 2, 0, angle), Eigen::MatrixXd(4, 0));
  const auto sweeps = SweepsOf(*problem, problem->body.parts[0], Frame(*problem, slice), nullptr);
  const Eigen::Vector2d corner = Eigen::Vector2d(1, 2) + Rotated({3, 4}, angle);
  for (const Eigen::Vector2d& d :
       {Eigen::Vector2d(1, 0), Eigen::Vector2d(0, 1), Eigen::Vector2d(-1, 0), Eigen::Vector2d(0, -1)}) {
    EXPECT_EQ(ClearOfAny(sweeps, Obstacle::HalfSpace(d, d.dot(corner) + kHair), 0), Answer::kYes);
    EXPECT_EQ(ClearOfAny(sweeps, Obstacle::HalfSpace(d, d.dot(corner) - kHair), 0), Answer::kNo);
  }
}

// Ahead the corner (2, 0) is farthest where the heading is zero. Aside it is within 2 r of there, tighter than the
// tangent's 2 r with its bend. From r = 1 on the corner's circle is tighter still.
TEST(Turning, AnUncertainHeadingBendsThePlace) {
  const auto problem = WithBody(Corner(kVy, 2, 0));
  for (const double r : {0.125, 0.75, 2.0, 4.0}) {
    Eigen::MatrixXd column = Eigen::MatrixXd::Zero(4, 1);
    column(kVy, 0) = r;
    const Slice slice = SliceOf(Eigen::Vector4d::Zero(), column);
    const auto sweeps = SweepsOf(*problem, problem->body.parts[0], Frame(*problem, slice), nullptr);
    EXPECT_EQ(ClearOfAny(sweeps, Obstacle::HalfSpace(Eigen::Vector2d(1, 0), Up(2)), 0), Answer::kYes);
    EXPECT_EQ(ClearOfAny(sweeps, Obstacle::HalfSpace(Eigen::Vector2d(1, 0), 2), 0), Answer::kNo);
    const double aside = std::min(2.0, 2 * r);
    EXPECT_EQ(ClearOfAny(sweeps, Obstacle::HalfSpace(Eigen::Vector2d(0, 1), aside + kHair), 0), Answer::kYes);
    EXPECT_EQ(ClearOfAny(sweeps, Obstacle::HalfSpace(Eigen::Vector2d(0, 1), aside - kHair), 0), Answer::kNo);
  }
}

TEST(Turning, TheBendHasTheSupportOfItsArc) {
  TracedRandom random(17);
  for (int trial = 0; trial < 400; ++trial) {
    const double theta = random.Uniform(-4, 4), r = random.Uniform(0, random.Coin() ? 0.5 : 4);
    const Eigen::Vector2d q = random.Vector(2, 3), d = random.Vector(2);
    const auto [support, point] = Bend(TurnsAround(theta, r), r, q.x(), q.y()).Farthest({d.x(), d.y()});
    double largest = 0;
    for (int i = -500; i <= 500; ++i) largest = std::max(largest, -r * r / 2 * d.dot(Rotated(q, theta + r * i / 500)));
    ASSERT_GE(support.ToDouble(), largest - kHair) << "trial " << trial;
    ASSERT_LE(support.ToDouble(), largest + 1e-4 * r * r * q.norm() * d.norm()) << "trial " << trial;
    ASSERT_NEAR(d.x() * point[0].ToDouble() + d.y() * point[1].ToDouble(), support.ToDouble(), kHair);
  }
}

// Where the frame moves left as the robot turns right, the corner stays: the place is no box.
TEST(Turning, ThePlaceIsCorrelatedWithTheSlice) {
  const auto problem = WithBody(Corner(kVy, 2, 0));
  const double r = 0x1p-10;
  Eigen::MatrixXd column = Eigen::MatrixXd::Zero(4, 1);
  column(1, 0) = 2 * r;
  column(kVy, 0) = -r;
  const Slice slice = SliceOf(Eigen::Vector4d::Zero(), column);
  const auto sweeps = SweepsOf(*problem, problem->body.parts[0], Frame(*problem, slice), nullptr);
  EXPECT_EQ(ClearOfAny(sweeps, Obstacle::HalfSpace(Eigen::Vector2d(0, 1), 1.001 * r * r * r), 0), Answer::kYes);
}

// Samples of motions within the bounds: the verifier's proof excludes none of them.
TEST(Turning, NoAdmissibleMotionMeetsWhatIsProvenClear) {
  int close = 0;
  for (TracedRandom random(16); random.Again(300);) {
    const bool spatial = random.Coin(0.3);
    const int p = spatial ? 3 : 2, n = 4, heading = spatial ? 3 : random.Integer(2, 3);
    auto problem = Halves();
    problem->projection =
        Eigen::MatrixXd::Identity(p, n) + (random.Coin() ? random.Matrix(p, n, 0.2) : Eigen::MatrixXd::Zero(p, n));
    BodyPart part{{}, random.Coin() ? 0 : random.Uniform(0, 0.5)};
    for (int i = random.Integer(1, 4); i > 0; --i) {
      part.points.emplace_back(Eigen::Vector3d::Zero());
      part.points.back().head(p) = random.Vector(p, 3);
    }
    problem->body = {random.Coin(0.8) ? heading : -1, {part}};
    const Eigen::Vector4d centers[] = {random.Vector(4, 2), random.Vector(4, 2)};
    const Eigen::MatrixXd columns[] = {random.Matrix(4, 5, random.Coin() ? 0.05 : 0.5),
                                       random.Matrix(4, 5, random.Coin() ? 0.05 : 0.5)};
    const Slice slices[] = {SliceOf(centers[0], columns[0]), SliceOf(centers[1], columns[1])};
    const double period = 0.5;
    Eigen::VectorXd states[2];
    for (int sample = 0; sample < 2; ++sample) {
      Eigen::VectorXd weights = random.Vector(5);
      if (random.Coin()) weights = weights.cwiseSign();
      states[sample] = centers[sample] + columns[sample] * weights;
    }
    // With theta'' = alpha and y'' = a all the time.
    const double alpha = random.Uniform(-4, 4), turned = states[1][heading] - states[0][heading];
    const Eigen::VectorXd acceleration = random.Vector(p, 4);
    problem->between.emplace();
    problem->between->acceleration = acceleration.cwiseAbs();
    problem->between->turn_rate = std::abs(turned) / period + std::abs(alpha) * period / 2;
    problem->between->turn_acceleration = std::abs(alpha);
    problem->between->period = period;
    const double s = random.Coin(0.2) ? random.Below(2) : random.Coin() ? 0.5 : random.Uniform(0, 1);
    const double bend = period * period * s * (s - 1) / 2, angle = states[0][heading] + s * turned + alpha * bend;
    Eigen::VectorXd point = problem->projection * ((1 - s) * states[0] + s * states[1]) + bend * acceleration;
    Eigen::Vector3d q = Eigen::Vector3d::Zero();  // of the part: between two of its points, and its radius
    const double share = random.Coin() ? 1 : random.Uniform(0, 1);
    q = share * part.points.front() + (1 - share) * part.points.back();
    if (problem->body.heading >= 0) q.head(2) = Rotated(q.head(2), angle);
    const Eigen::VectorXd d = random.Vector(p).normalized();
    point += q.head(p) + part.radius * d;

    ObstacleMotion motion;
    motion.velocity.head(p) = random.Vector(p, 10);
    motion.stamp_us = random.Integer(-2'000'000, 2'000'000);
    motion.uncertainty = random.Uniform(0, 0.2);
    motion.growth = random.Uniform(0, 0.2);
    motion.growth_rate = random.Uniform(0, 0.2);
    const Schedule schedule{random.Integer(-1'000'000, 1'000'000), 500'000,
                            random.Coin() ? 0 : random.Integer(0, 100'000)};
    const double off = random.Uniform(-1, 1) * static_cast<double>(schedule.clock_error_us);
    const double tau =
        (static_cast<double>(schedule.start_us + 7 * 500'000 - motion.stamp_us) + s * 500'000 + off) * 1e-6;
    const double growth = motion.uncertainty + motion.growth * std::abs(tau) + motion.growth_rate * tau * tau / 2;
    // The obstacle's point, farthest from its core against d, is then at `point`, but for a hair for this test's
    // doubles.
    const Eigen::VectorXd core = point + (growth - kHair) * d - motion.velocity.head(p) * tau;
    const Obstacle obstacle = Obstacle::AxisBox(core, core + random.Vector(p).cwiseAbs()).Moving(motion);
    const Passage passage = PassageOf(obstacle, schedule, 7, 8);
    ASSERT_TRUE(passage.is_there);
    const Frame first(*problem, slices[0]), last(*problem, slices[1]);
    for (const Sweep& sweep : SweepsOf(*problem, part, first, &last)) {
      Real best;
      ASSERT_NE(IsClear(sweep, obstacle, 0, best, passage), Answer::kYes) << "trial " << random.trial();
      const Obstacle away = Obstacle::AxisBox(core + 20 * d, core + 20 * d).Moving(motion);
      close += IsClear(sweep, away, 0, best, passage) == Answer::kYes;
    }
  }
  EXPECT_GT(close, 100) << "proofs that may fail";
}

// ---- Certificates of one step, 0.5 s, in which the robot drives from (0, 0) to (4, 0), but for kTiny.

Certificate Driving() {
  return {.initial_set = {{}, {}, Eigen::Vector4d(0, 0, 8, 0), Eigen::MatrixXd(4, 0)},
          .controls = Eigen::Vector2d(0, 0),
          .schedule = {1'000, 500'000, 0}};
}

Between Curving(double ax, double ay, double turn_rate = 0, double turn_acceleration = 0) {
  return {Eigen::Vector2d(ax, ay), turn_rate, turn_acceleration, 0.5};
}

std::shared_ptr<Problem> AtAllTimes(const Between& between, const Body& body = {}) {
  auto problem = WithBody(body);
  problem->between = between;
  return problem;
}

Verdict With(const std::shared_ptr<Problem>& problem, const Obstacle& obstacle,
             const Schedule& schedule = {1'000, 500'000, 0}) {
  Certificate certificate = Driving();
  certificate.obstacles = {obstacle};
  certificate.schedule = schedule;
  return Judge(problem, certificate);
}

Obstacle Post(double x, double y, double radius) { return Obstacle::Circle(Eigen::Vector2d(x, y), radius); }

// 16 m/s^2 over 0.5 s bend the path by 16 / 32 m.
TEST(BetweenSamples, APostBesideThePathIsMetByTheDeclaredCurvature) {
  ExpectConfirmed(With(Halves(), Post(2, 0, 0.5)));  // at the samples alone
  ExpectConfirmed(With(AtAllTimes(Curving(0, 16)), Post(2, 1, Down(0.5))));
  ExpectRefuted(With(AtAllTimes(Curving(0, 16)), Post(2, 1, 0.5)), 0,
                "the motion to the next sample keeps clear of obstacle 0");
  ExpectConfirmed(With(AtAllTimes(Curving(0, 0)), Post(2, 1, Down(1))));
  ExpectRefuted(With(AtAllTimes(Curving(0, 0)), Post(2, 1, 1)), 0, "keeps clear");
  ExpectConfirmed(With(AtAllTimes(Curving(32, 0)), Post(-2, 0, Down(1))));  // e = 1 ahead and behind
  ExpectRefuted(With(AtAllTimes(Curving(32, 0)), Post(-2, 0, 1)), 0, "keeps clear");
}

// w^2 + alpha = 8 moves a point at 2 m from the frame by 2 * 8 / 32 m from its chord, towards everywhere.
TEST(BetweenSamples, ATurningBodyLeavesTheChordOfItsPoints) {
  const Body nose = Corner(kVy, 2, 0);
  for (const Between& between : {Curving(0, 0, 2, 4), Curving(0, 0, 0, 8)}) {
    ExpectConfirmed(With(AtAllTimes(between, nose), Obstacle::HalfSpace(Eigen::Vector2d(0, 1), Up(0.5))));
    ExpectRefuted(With(AtAllTimes(between, nose), Obstacle::HalfSpace(Eigen::Vector2d(0, 1), 0.5)), 0, "keeps clear");
    ExpectConfirmed(With(AtAllTimes(between, nose), Obstacle::HalfSpace(Eigen::Vector2d(1, 0), Up(6.5))));
    ExpectRefuted(With(AtAllTimes(between, nose), Obstacle::HalfSpace(Eigen::Vector2d(1, 0), 6.5)), 0, "keeps clear");
  }
  const Body still = Corner(-1, 2, 0);  // it does not turn, whatever the bounds
  ExpectConfirmed(With(AtAllTimes(Curving(0, 0, 2, 4), still), Obstacle::HalfSpace(Eigen::Vector2d(0, 1), kTiny * 2)));
  ExpectConfirmed(With(AtAllTimes(Curving(0, 0, 2, 4)), Obstacle::HalfSpace(Eigen::Vector2d(0, 1), kTiny * 2)));
}

// The heading goes from 0 to 4 in half a second, within recorded hulls that leave it 4 - 2 kBit. They are given by
// their ends, as on the bus, or by their middles, as in a decision.
TEST(BetweenSamples, ATurnThatNoMotionMakesIsRefuted) {
  constexpr double kBit = 0x1p-30;
  const Body body = Corner(0, 0.5, 0);
  for (const bool by_ends : {true, false}) {
    Certificate certificate = Driving();
    for (const double heading : {0.0, 4.0}) {
      const Eigen::Vector4d middle(heading, 0, 8, 0), half_width = Eigen::Vector4d::Constant(kBit);
      RecordedSlice& slice = certificate.slices.emplace_back();
      if (by_ends)
        slice.lower = middle - half_width, slice.upper = middle + half_width;
      else
        slice.center = middle, slice.half_width = half_width;
    }
    ExpectConfirmed(Judge(AtAllTimes(Curving(0, 0, 8 - 4 * kBit), body), certificate));
    ExpectRefuted(Judge(AtAllTimes(Curving(0, 0, 8 - 5 * kBit), body), certificate), 0,
                  "the least change of px from the slice to the next");
  }
}

// A transition changes py, the heading, by 1 in half a second.
TEST(BetweenSamples, DataThatTurnFasterThanDeclaredAreRefuted) {
  const auto with = [](double turn_rate, double rate_bound = INFINITY, double longer = 0) {
    auto problem = AtAllTimes(Curving(0, 0, turn_rate), Corner(1, 0.5, 0));
    problem->transitions.longer = Eigen::VectorXd::Constant(problem->transitions.size(), longer);
    problem->transitions.z(0, kVy) = 2;
    problem->transitions.x_next(0, 1) = 1;
    problem->transitions.x_next(0, kVy) = 2;
    problem->timing.rate_bound = Eigen::Vector4d(INFINITY, rate_bound, INFINITY, INFINITY);
    Certificate certificate = Driving();
    certificate.schedule.step_us = 500'000;
    return Judge(problem, certificate);
  };
  constexpr double kBit = 0x1p-30;
  ExpectConfirmed(with(2));
  ExpectRefuted(with(2 - kBit), -1, "no known transition changes py faster than is declared");
  ExpectConfirmed(with(3, 2));
  ExpectRefuted(with(3, 2 - kBit), -1, "no known transition changes py faster");
  ExpectConfirmed(with(1, INFINITY, 0x1p-10));  // longer than a plan's
}

TEST(BetweenSamples, ARecordedClearanceIsThatOfTheMotionAfterTheSample) {
  Certificate certificate = Driving();
  certificate.obstacles = {Post(2, 3, 1)};
  certificate.slices.resize(2);
  certificate.slices[0].clearance = {Down(2)};
  const auto problem = AtAllTimes(Curving(0, 0));
  ExpectConfirmed(Judge(problem, certificate));
  certificate.slices[0].clearance = {2};
  ExpectRefuted(Judge(problem, certificate), 0, "by what is recorded");
  ExpectConfirmed(Judge(Halves(), certificate));  // of the sample alone
  certificate.slices[1].clearance = {1};
  ExpectRefuted(Judge(problem, certificate), 1, "the task's sizes");
}

// ---- Bodies.

TEST(Bodies, EveryPartAndItsRadiusIsHeldClear) {
  Body body{-1, {{{Eigen::Vector3d(0, 1, 0)}, 0.5}, {{Eigen::Vector3d(0, -1, 0), Eigen::Vector3d(0, -2, 0)}, 0.25}}};
  const auto problem = WithBody(body);
  const Eigen::Vector2d left(0, 1), right(0, -1);
  ExpectConfirmed(With(problem, Obstacle::HalfSpace(left, Up(1.5))));
  ExpectRefuted(With(problem, Obstacle::HalfSpace(left, 1.5)), 0, "keeps clear of obstacle 0 with part 0");
  ExpectConfirmed(With(problem, Obstacle::HalfSpace(right, Up(2.25))));
  ExpectRefuted(With(problem, Obstacle::HalfSpace(right, 2.25)), 0, "keeps clear of obstacle 0 with part 1");
  // Between the parts, in the gap from y = -0.75 to 0.5.
  ExpectConfirmed(With(problem, Post(0, -0.125, Down(0.625))));
  ExpectRefuted(With(problem, Post(0, -0.125, 0.625)), 0, "keeps clear");
}

// A rectangle 4 m ahead, 1 m to both sides, turns by -1.3 rad in its step: its corner cuts what no sample meets.
TEST(Bodies, TheCornerOfATurningRectangleIsMetBetweenTheSamples) {
  Body truck{kVy, {{{}, 0}}};
  for (const double x : {0.0, 4.0})
    for (const double y : {-1.0, 1.0}) truck.parts[0].points.emplace_back(x, y, 0);
  Certificate certificate = Driving();
  certificate.initial_set.center = Eigen::Vector4d(0, 0, 0, 0.65);
  certificate.controls = Eigen::Vector2d(0, -2.6);
  const auto problem = AtAllTimes(Curving(0, 0, 2.6, 0), truck);
  problem->domain.input = Box(Eigen::Vector2d(-2.6, -2.6), Eigen::Vector2d(2.6, 2.6));
  // The frame moves from (0, 0) to (0, 0.65 / 2 - 2.6 / 8) = (0, 0), but for rounding. At both samples the front
  // reaches x = 4 cos(0.65) + sin(0.65); between them the chord of the corner deviates by its distance, times 2.6^2
  // / 32.
  const double front = 4 * std::cos(0.65) + std::sin(0.65), deviation = std::sqrt(17.0) * 2.6 * 2.6 / 32;
  const auto judge = [&](const std::shared_ptr<Problem>& task, double offset) {
    certificate.obstacles = {Obstacle::HalfSpace(Eigen::Vector2d(1, 0), offset)};
    return Judge(task, certificate);
  };
  ExpectConfirmed(judge(problem, front + deviation + kHair));
  ExpectRefuted(judge(problem, front + deviation - kHair), 0, "keeps clear");
  const auto at_samples = WithBody(truck);
  at_samples->domain = problem->domain;
  ExpectConfirmed(judge(at_samples, front + kHair));
  ExpectRefuted(judge(at_samples, front - kHair), 0, "keeps clear");
}

// ---- Obstacles that move.

Obstacle Crossing(double radius, ObstacleMotion motion = {}) {
  motion.velocity = Eigen::Vector3d(0, -6, 0);
  if (motion.stamp_us == 0) motion.stamp_us = 1'000;
  return Post(0, 5, radius).Moving(motion);
}

// Seen from the disc the robot drives from (0, 0) to (4, 3): 4 m beside (0, 5). At the samples 5 and sqrt(20) m.
TEST(Moving, ADiscThatCrossesBetweenTheSamplesIsMet) {
  ExpectConfirmed(With(Halves(), Crossing(4.25)));
  ExpectRefuted(With(Halves(), Crossing(4.5)), 1, "the slice keeps clear of obstacle 0");
  const auto problem = AtAllTimes(Curving(0, 0));
  ExpectConfirmed(With(problem, Crossing(Down(4))));
  ExpectRefuted(With(problem, Crossing(4)), 0, "the motion to the next sample keeps clear of obstacle 0");
  ExpectConfirmed(With(problem, Post(0, 5, Down(5))));  // it stands
}

TEST(Moving, TimesAreExactFarFromTheEpoch) {
  const auto problem = AtAllTimes(Curving(0, 0));
  const std::int64_t start = Schedule::kLatest - 1;  // not a double
  ObstacleMotion motion;
  motion.stamp_us = start;
  ExpectConfirmed(With(problem, Crossing(Down(4), motion), {start, 500'000, 0}));
  ExpectRefuted(With(problem, Crossing(4, motion), {start, 500'000, 0}), 0, "keeps clear");
  motion.stamp_us = -start;
  EXPECT_EQ(With(problem, Crossing(Down(4), motion), {-start, 500'000, 0}).status, Status::kConfirmed);
}

// The step is from 1000 to 501000 us, and 10 us more on either side.
TEST(Moving, AWindowCountsToItsLastMicrosecond) {
  const auto problem = AtAllTimes(Curving(0, 0));
  const Schedule schedule{1'000, 500'000, 10};
  const auto within = [](std::int64_t from, std::int64_t until) {
    ObstacleMotion motion{.from_us = from, .until_us = until};
    return Crossing(4, motion);
  };
  constexpr std::int64_t kAlways = ObstacleMotion::kAlways;
  ExpectConfirmed(With(problem, within(-kAlways, 989), schedule));
  ExpectRefuted(With(problem, within(-kAlways, 990), schedule), 0, "keeps clear");
  ExpectConfirmed(With(problem, within(501'011, kAlways), schedule));
  ExpectRefuted(With(problem, within(501'010, kAlways), schedule), 0, "keeps clear");
  ExpectRefuted(With(problem, within(300'000, 300'000), schedule), 0, "keeps clear");
  // At the samples alone, only those at which it is there.
  ObstacleMotion motion{.from_us = 1'011, .until_us = 500'989};
  ExpectConfirmed(With(Halves(), Crossing(9, motion), schedule));
  motion.until_us = 500'990;
  ExpectRefuted(With(Halves(), Crossing(9, motion), schedule), 1, "the slice keeps clear");
}

TEST(Moving, TheClockErrorMovesTheObstacle) {
  const auto problem = AtAllTimes(Curving(0, 0));
  const Schedule schedule{1'000, 500'000, 500'000};  // 3 m at 6 m/s
  ExpectConfirmed(With(problem, Crossing(Down(1)), schedule));
  ExpectRefuted(With(problem, Crossing(1), schedule), 0, "keeps clear");
}

TEST(Moving, TheUncertaintyGrowsAwayFromTheStamp) {
  ObstacleMotion motion{.stamp_us = 1'000, .uncertainty = 0.25, .growth = 0.5, .growth_rate = 2};
  const auto problem = AtAllTimes(Curving(0, 0));
  // |tau| <= 1/2 s: 1/4 + 1/4 + 1/4 m.
  ExpectConfirmed(With(problem, Crossing(Down(3.25), motion)));
  ExpectRefuted(With(problem, Crossing(3.25, motion)), 0, "keeps clear");
  // One second before its stamp, half a second after, and as long with the clock's error: 1/4 + 1/2 + 1 m.
  for (const auto& [stamp, error] : {std::pair{1'001'000, 0}, {1'000, 500'000}, {501'000, 500'000}}) {
    motion.stamp_us = stamp;
    const auto standing = [&](double radius) { return Post(2, 4, radius).Moving(motion); };
    ExpectConfirmed(With(problem, standing(Down(2.25)), {1'000, 500'000, error}));
    ExpectRefuted(With(problem, standing(2.25), {1'000, 500'000, error}), 0, "keeps clear");
  }
}

TEST(Moving, AWallMovesAlongItsNormal) {
  const auto problem = AtAllTimes(Curving(0, 0));
  ObstacleMotion motion{.stamp_us = 1'000, .velocity = Eigen::Vector3d(-4, 0, 0)};
  const auto wall = [&](double x) { return Obstacle::HalfSpace(Eigen::Vector2d(2, 0), 2 * x).Moving(motion); };
  ExpectConfirmed(With(problem, wall(Up(6))));  // at the end it is at 4
  ExpectRefuted(With(problem, wall(6)), 0, "keeps clear");
}

TEST(Moving, AnInfiniteClearanceSaysThatTheObstacleIsNowhere) {
  const auto problem = AtAllTimes(Curving(0, 0));
  Certificate certificate = Driving();
  ObstacleMotion motion;
  motion.until_us = 999;
  certificate.obstacles = {Crossing(9, motion)};
  certificate.slices.resize(2);
  certificate.slices[0].clearance = {HUGE_VAL};
  ExpectConfirmed(Judge(problem, certificate));
  certificate.obstacles = {Post(0, 1000, 1)};
  ExpectRefuted(Judge(problem, certificate), 0, "by what is recorded");
}

// ---- What does not fit.

TEST(Misfit, ABodyOrBoundsThatDoNotFitAreRefuted) {
  const auto expect_misfit = [](const std::shared_ptr<Problem>& problem, const char* what) {
    ExpectRefuted(Judge(problem, Driving()), -1, what);
  };
  for (const int heading : {-2, 4}) expect_misfit(WithBody(Corner(heading, 1, 0)), "heading");
  ExpectConfirmed(Judge(WithBody(Corner(3, 1, 0)), Driving()));
  const auto on_a_line = WithBody(Corner(kVx, 1, 0));
  on_a_line->projection = Eigen::MatrixXd::Identity(1, 4);
  expect_misfit(on_a_line, "heading");
  expect_misfit(WithBody({-1, {}}), "has a part");
  expect_misfit(WithBody({-1, {{{}, 0}}}), "have points");
  expect_misfit(WithBody({-1, {{{Eigen::Vector3d::Zero()}, -kTiny}}}), "no negative radius");
  expect_misfit(WithBody({-1, {{{Eigen::Vector3d::Zero()}, HUGE_VAL}}}), "no negative radius");
  expect_misfit(WithBody(Corner(-1, std::nan(""), 0)), "finite numbers");

  ExpectConfirmed(Judge(AtAllTimes(Curving(0, 0)), Driving()));
  expect_misfit(AtAllTimes({Eigen::Vector3d::Zero(), 0, 0, 0.5}), "fit the projection");
  for (const double bad : {-kTiny, HUGE_VAL, std::nan("")}) {
    expect_misfit(AtAllTimes(Curving(0, bad)), "finite and not negative");
    expect_misfit(AtAllTimes(Curving(0, 0, bad)), "finite and not negative");
    expect_misfit(AtAllTimes(Curving(0, 0, 0, bad)), "finite and not negative");
  }
  expect_misfit(AtAllTimes({Eigen::Vector2d::Zero(), 0, 0, Down(0.5)}), "the model's step");
}

TEST(Misfit, AScheduleThatDoesNotFitIsRefuted) {
  const auto judge = [](const Schedule& schedule, bool moves) {
    return With(Halves(), moves ? Crossing(1) : Post(0, 5, 1), schedule);
  };
  ExpectConfirmed(judge({0, 0, 0}, false));
  ExpectRefuted(judge({0, 0, 0}, true), -1, "there is a schedule");
  ExpectConfirmed(judge({0, 1, 0}, true));
  constexpr std::int64_t kLatest = Schedule::kLatest, kLongest = Schedule::kLongest;
  ExpectConfirmed(judge({kLatest, kLongest, kLongest}, false));
  for (const Schedule& bad : {Schedule{kLatest + 1, 1, 0}, Schedule{-kLatest - 1, 1, 0}, Schedule{0, -1, 0},
                              Schedule{0, kLongest + 1, 0}, Schedule{0, 1, -1}, Schedule{0, 1, kLongest + 1}})
    ExpectRefuted(judge(bad, false), -1, "the schedule lies within its bounds");
}

}  // namespace forereach::verifier::sweep_test
