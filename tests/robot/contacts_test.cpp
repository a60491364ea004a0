// What the simulated robot touches between two samples, just inside and just outside of what the bounds admit.
#include "simulator/contacts.h"

#include "tests/test.h"

#include "tests/worlds.h"

namespace forereach::contacts_test {

using Eigen::Vector2d;

constexpr double kLittle = 1e-9;
constexpr std::int64_t kT0 = 1'700'000'000'000'000;

// A bicycle with P = (x, y), so that both coordinates and the heading can bulge.
Problem Bicycle() {
  Problem problem = WorldOf(MakeKinematicBicycle(0.2, 2.5), Within({40, 40, 3, 25, 3, 0.48}), Within({20, 2}));
  problem.between = Between{Vector2d(0, 4), 0, 0, 0.2};
  return problem;
}

BodyPlaces PlacesOf(const Problem& problem) { return {*problem.model, problem.projection, problem.body}; }

const std::vector<double> kFrom{0, 0, 0, 12, 0, 0}, kTo{2.4, 0, 0, 12, 0, 0};

std::vector<Contact> Contacts(const Problem& problem, const Obstacle& obstacle, const std::vector<double>& from = kFrom,
                              const std::vector<double>& to = kTo) {
  return FindContacts(problem, PlacesOf(problem), std::vector{obstacle}, {from, kT0}, {to, kT0 + 200'000},
                      *problem.between);
}

Obstacle Post(double x, double y) { return Obstacle::Circle(Vector2d(x, y), 0.05); }

TEST(Contacts, AreMetAtTheFullBulgeOnEitherSide) {
  const double bulge = 4 * 0.2 * 0.2 / 8;
  for (const double side : {-1, 1}) {
    const auto met = Contacts(Bicycle(), Post(1.2, side * (bulge + 0.05 - kLittle)));
    ASSERT_THAT(met, SizeIs(1));
    EXPECT_FIELDS(met[0], (obstacle, 0), (part, 0), (at, 0.5));
    EXPECT_NEAR(met[0].clearance, -kLittle, 1e-14);
    EXPECT_THAT(Contacts(Bicycle(), Post(1.2, side * (bulge + 0.05 + kLittle))), IsEmpty());
  }
}

TEST(Contacts, AreFoundAtASampleWhateverTheBound) {
  Problem problem = Bicycle();
  problem.between->acceleration = Vector2d(40, 40);
  EXPECT_THAT(Contacts(problem, Post(2.4, 0.05 - kLittle)), SizeIs(1));
  problem.between->acceleration.setZero();
  EXPECT_THAT(Contacts(problem, Post(2.4, 0.05 - kLittle)), SizeIs(1));
  EXPECT_THAT(Contacts(problem, Post(2.4, 0.05 + kLittle)), IsEmpty());
  EXPECT_THAT(Contacts(problem, Post(0, 0)), IsEmpty()) << "the first sample belongs to the step before";
}

TEST(Contacts, OfABodyThatTurnsAreMetWhereItsCornersBulge) {
  Problem problem = Bicycle();
  problem.body = {.heading = 2, .parts = {{{{-5, 0, 0}}, 0}, {{{4, 0, 0}}, 0.5}}};
  *problem.between = {Vector2d::Zero(), 0.1, 0.6, 0.2};
  const std::vector<double> standing{0, 0, 0, 0, 0, 0};
  // The heading swings by 0.6 0.2^2 / 8 in the middle of the step; its rate there is 0.06 at most.
  const double angle = 0.003;
  const Vector2d nose(4 * std::cos(angle), 4 * std::sin(angle));
  const auto met = Contacts(problem, Post(nose.x(), nose.y() + 0.55 - kLittle), standing, standing);
  ASSERT_THAT(met, SizeIs(1));
  EXPECT_EQ(met[0].part, 1);
  EXPECT_THAT(Contacts(problem, Post(nose.x(), nose.y() + 0.55 + kLittle), standing, standing), IsEmpty());

  problem.between->turn_rate = 0.03;  // now this bounds the swing: the second derivative is 2 0.03 / 0.2
  const double less = 0.3 * 0.04 / 8;
  const Vector2d nose_then(4 * std::cos(less), 4 * std::sin(less));
  EXPECT_THAT(Contacts(problem, Post(nose_then.x(), nose_then.y() + 0.55 - kLittle), standing, standing), SizeIs(1));
  EXPECT_THAT(Contacts(problem, Post(nose_then.x(), nose_then.y() + 0.55 + kLittle), standing, standing), IsEmpty());
}

TEST(Contacts, WithAMovingObstacleAreMetAtTheirTime) {
  Problem problem = Bicycle();
  problem.between->acceleration.setZero();
  ObstacleMotion motion{.stamp_us = kT0, .velocity = {0, 10, 0}};
  const auto crossing = [&](double y) { return Post(1.2, y).Moving(motion); };
  const auto met = Contacts(problem, crossing(-1));  // at (1.2, 0) after 0.1 s, as the robot
  ASSERT_THAT(met, SizeIs(1));
  EXPECT_EQ(met[0].at, 0.5);
  EXPECT_THAT(Contacts(problem, crossing(-2)), IsEmpty()) << "when it crosses the path the robot has passed";
  motion.until_us = kT0 + 99'999;
  EXPECT_THAT(Contacts(problem, crossing(-1)), IsEmpty()) << "it is nowhere by then";
}

// A mast at the end of an arm of 2 m along the heading, which swings to the left in the step.
TEST(Contacts, OfPartsAtExpressionsAreMetOnTheirOwnWay) {
  Problem problem = Bicycle();
  problem.body.parts = {BodyPart{{}, 0.5, {{{"x + 2*cos(theta)"}, {"y + 2*sin(theta)"}}}}};
  problem.between->acceleration = Vector2d(0, 4);
  const std::vector<double> from{0, 0, 0, 0, 0, 0}, to{0, 0, 0.1, 0, 0, 0};
  const double bulge = 4 * 0.2 * 0.2 / 8;
  const auto met = Contacts(problem, Post(2 * std::cos(0.1), 2 * std::sin(0.1) + 0.55 - kLittle), from, to);
  ASSERT_THAT(met, SizeIs(1)) << "at the end of the step";
  EXPECT_EQ(met[0].at, 1);
  EXPECT_THAT(Contacts(problem, Post(2 * std::cos(0.1), 2 * std::sin(0.1) + 0.55 + kLittle), from, to), IsEmpty());
  const auto standing = Contacts(problem, Post(2, bulge + 0.55 - kLittle), from, from);
  ASSERT_THAT(standing, SizeIs(1));
  EXPECT_EQ(standing[0].at, 0.5);
  EXPECT_THAT(Contacts(problem, Post(2, bulge + 0.55 + kLittle), from, from), IsEmpty());
  EXPECT_THAT(Contacts(problem, Post(0, 0), from, to), IsEmpty()) << "the frame is no part of this body";
}

TEST(Contacts, AtASampleCoverTheWholeBody) {
  Problem problem = Bicycle();
  problem.body = {.heading = 2, .parts = {{{{2, 1, 0}, {2, -1, 0}, {-1, -1, 0}, {-1, 1, 0}}, 0}}};
  const std::vector<Obstacle> obstacles{Post(2 + 0.05 + kLittle, 0), Post(2 + 0.05 - kLittle, 0), Post(9, 9)};
  const auto met = FindContacts(PlacesOf(problem), obstacles, {kFrom, kT0});
  ASSERT_THAT(met, SizeIs(1));
  EXPECT_EQ(met[0].obstacle, 1);
}

}  // namespace forereach::contacts_test
