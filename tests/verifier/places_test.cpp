// Bodies at expressions in certificates: clear by a hair, touching by a hair.
#include "tests/verifier/hand_made.h"

namespace forereach::verifier::places_test {

constexpr double kHair = 1e-9;

BodyPart Places(const std::vector<std::array<const char*, 2>>& places, double radius) {
  BodyPart part{{}, radius, {}};
  for (const auto& [x, y] : places) part.places.push_back({{x, 1, 1}, {y, 1, 1}});
  return part;
}

// The angle px and the length py of an arm; both stand.
Verdict Judge(const BodyPart& part, const Obstacle& obstacle, double half_width = 0, double turn = 0,
              std::optional<double> acceleration = std::nullopt) {
  const auto problem = Halves();
  problem->projection.setZero();
  problem->body.parts = {part};
  if (acceleration) problem->between = Between{Eigen::Vector2d::Constant(*acceleration), 0, 0, 0.5};
  Certificate certificate;
  certificate.initial_set.lower = Eigen::Vector4d(-half_width, 2 - half_width, turn, 0);
  certificate.initial_set.upper = Eigen::Vector4d(half_width, 2 + half_width, turn, 0);
  certificate.controls = Eigen::Vector2d(0, 0);
  certificate.obstacles = {obstacle};
  return Judge(problem, certificate);
}

const BodyPart kArm = Places({{"0", "0"}, {"py*cos(px)", "py*sin(px)"}}, 0.25);

TEST(PlacesOf, AnArmAreDecidedWithinAHair) {
  const auto wall = [](double offset) { return Obstacle::HalfSpace(Eigen::Vector2d(1, 0), offset); };
  ExpectConfirmed(Judge(kArm, wall(2.25 + kHair)));
  ExpectRefuted(Judge(kArm, wall(2.25 - kHair)), 0, "keeps clear of obstacle 0");
  ExpectConfirmed(Judge(kArm, Obstacle::Circle(Eigen::Vector2d(1, 1), 0.75 - kHair)));
  ExpectRefuted(Judge(kArm, Obstacle::Circle(Eigen::Vector2d(1, 1), 0.75 + kHair)), 0, "keeps clear");
  // A quarter turn later its end is at (0, 2).
  ExpectRefuted(Judge(kArm, Obstacle::Circle(Eigen::Vector2d(0, 2), 0.1), 0, M_PI), 1, "keeps clear");
}

// Up to second order: 2 + 0.1 along x, 2.1 0.1 along y.
TEST(PlacesOf, AnUncertainArmAreCorrelated) {
  const auto above = [](double offset) { return Obstacle::HalfSpace(Eigen::Vector2d(0, 1), offset); };
  ExpectConfirmed(Judge(kArm, above(0.25 + 0.2 + 0.015), 0.1));
  EXPECT_NE(Judge(kArm, above(0.25 + 2.1 * std::sin(0.1) - kHair), 0.1).status, Status::kConfirmed);
}

TEST(PlacesOf, AKinkAreInTheirRange) {
  const BodyPart part = Places({{"abs(px)", "0"}}, 0);
  ExpectConfirmed(Judge(part, Obstacle::HalfSpace(Eigen::Vector2d(-1, 0), kHair), 0.25));
  EXPECT_NE(Judge(part, Obstacle::HalfSpace(Eigen::Vector2d(-1, 0), -kHair), 0.25).status, Status::kConfirmed);
  EXPECT_NE(Judge(Places({{"1/px", "0"}}, 0), Obstacle::Circle(Eigen::Vector2d(99, 99), 1), 0.25).status,
            Status::kConfirmed);
}

// From (2, 0) to (0, 2), with e = 0.5 along each axis.
TEST(PlacesOf, AMotionAreOnTheChordAndItsBulge) {
  const BodyPart part = Places({{"py*cos(px)", "py*sin(px)"}}, 0);
  const auto wall = [](double offset) { return Obstacle::HalfSpace(Eigen::Vector2d(1, 1), offset); };
  ExpectConfirmed(Judge(part, wall(3 + kHair), 0, M_PI, 16));
  ExpectRefuted(Judge(part, wall(3 - kHair), 0, M_PI, 16), 0, "the motion to the next sample keeps clear");
}

}  // namespace forereach::verifier::places_test
