// Digests: the same for the same data however it is written, another for other data.
#include "task/canonical.h"

#include "forereach/dynamics/models/named_models.h"
#include "tests/task/task_files.h"

namespace forereach::digest_test {

using Eigen::Vector2d;

TEST(ConfigDigest, IsOfTheFilesBytes) {
  const TaskFiles files;
  EXPECT_EQ(files.Load().grounds.config, DigestOf(std::string_view(kTask)));
  EXPECT_NE(files.Load(std::string(kTask) + "\n").grounds.config, files.Load().grounds.config);
}

TEST(ObservationsDigest, DoesNotDependOnHowTheyAreWritten) {
  const TaskFiles files;
  const Digest digest = files.Load().grounds.observations;
  const std::string reordered =
      "vx_next, vy_next, px_next, py_next, ax, ay, vy, vx, py, px\r\n"
      "1.07, 0.0, 155e-3, 0, 5e-1, 0, 0, 1, 0, -0\r\n"
      "2, 0.42, 1.3, 2.07, 0, -0.5, 0.5, 2, 2, 1\r\n";
  EXPECT_EQ(files.Load(kTask, reordered).grounds.observations, digest);
  EXPECT_EQ(files.Load(std::string(kTask) + "bus: {}\n").grounds.observations, digest);
}

TEST(ObservationsDigest, ChangesWithEveryNumberAndWithTheOrderOfRows) {
  const auto model = MakePointMass(0.15);
  Transitions transitions{Eigen::MatrixXd::Random(3, 6), Eigen::MatrixXd::Random(3, 4)};
  std::set<Digest> seen{ObservationsDigest(*model, transitions)};
  std::size_t tried = 1;
  for (Eigen::MatrixXd* matrix : {&transitions.z, &transitions.x_next})
    for (double& entry : matrix->reshaped()) {
      const double kept = entry;
      entry = std::nextafter(entry, 2);
      seen.insert(ObservationsDigest(*model, transitions));
      ++tried;
      entry = kept;
    }
  transitions.longer = Eigen::VectorXd::Zero(3);
  EXPECT_TRUE(seen.contains(ObservationsDigest(*model, transitions))) << "all lasted dt";
  for (double& longer : transitions.longer) {
    longer = 1e-9;
    seen.insert(ObservationsDigest(*model, transitions));
    ++tried;
    longer = 0;
  }
  transitions.z.row(0).swap(transitions.z.row(1));
  transitions.x_next.row(0).swap(transitions.x_next.row(1));
  seen.insert(ObservationsDigest(*model, transitions));
  EXPECT_EQ(seen.size(), tried + 1);
}

TEST(DeclarationDigest, DoesNotDependOnHowItIsWritten) {
  const TaskFiles files;
  const Digest digest = files.Load().grounds.declaration;
  const std::string by_names = "  lipschitz:\n    vx: {vx: 0.1, vy: 0.05}\n    vy: {vx: 0.05, vy: 0.1}\n";
  const auto with = [&](const std::string& lipschitz) {
    return files.Load(Replaced(kTask, by_names, lipschitz)).grounds.declaration;
  };
  EXPECT_EQ(with("  lipschitz: {vy: {vy: 1e-1, vx: 5e-2}, vx: {vy: 0.0500, vx: 0.1, ax: 0}}\n"), digest);
  EXPECT_EQ(with("  lipschitz: [[0,0,0,0,0,0], [0,0,0,0,0,0], [0,0,0.1,0.05,0,0], [0,0,0.05,0.1,0,0]]\n"), digest);
  EXPECT_NE(with("  lipschitz: {vy: {vy: 0.1, vx: 0.05}, vx: {vy: 0.05, vx: 0.10000000000000002}}\n"), digest);
  EXPECT_NE(files.Load(Replaced(kTask, "[0, 0, 0.01, 0.01]", "[0, 0, 0.01, 0.02]")).grounds.declaration, digest);
}

TEST(DeclarationDigest, NoDisturbanceAndZerosAreTheSame) {
  const TaskFiles files;
  const Digest digest = files.Load().grounds.declaration;
  const auto with = [&](const std::string& disturbance) {
    const std::string line = "  noise_bound: [0, 0, 0.01, 0.01]\n";
    return files.Load(Replaced(kTask, line, line + "  disturbance: " + disturbance + "\n")).grounds.declaration;
  };
  EXPECT_EQ(with("[0, -0.0, 0, 0]"), digest);
  EXPECT_NE(with("[0, 0, 0, 4.9e-324]"), digest);
  EXPECT_NE(with("[0, 0, 0.1, 0]"), with("[0, 0, 0, 0.1]"));
  EXPECT_NE(with("[0, 0, 0.01, 0.01]"), digest);
  EXPECT_EQ(with("{vx: 0}"), digest);
  EXPECT_EQ(with("{vx: 0.1, px: 0.2}"), with("[0.2, 0, 0.1, 0]"));
}

TEST(DeclarationDigest, TellsExpressionsOfTheDisturbanceApart) {
  const TaskFiles files;
  const auto with = [&](const std::string& disturbance) {
    const std::string line = "  noise_bound: [0, 0, 0.01, 0.01]\n";
    return files.Load(Replaced(kTask, line, line + "  disturbance: " + disturbance + "\n")).grounds.declaration;
  };
  const std::set<Digest> different{files.Load().grounds.declaration,
                                   with("{vx: 0.1}"),
                                   with("{vx: 0.1*vx}"),
                                   with("{vx: 0.1*ax}"),
                                   with("{vy: 0.1*vx}"),
                                   with("{vx: 0.1*vx, vy: 0.1}"),
                                   with("{vx: 0.1*vx, vy: 0.1*vx}"),
                                   with("{vx: 0.10000000000000002*vx}")};
  EXPECT_EQ(different.size(), 8u);
  EXPECT_EQ(with("{vx: 0.1*vx}"), with("{vx: \"0.1*vx\"}"));
}

TEST(DeclarationDigest, NoErrorOfRecordsAndZerosAreTheSame) {
  const TaskFiles files;
  const Digest digest = files.Load().grounds.declaration;
  const auto with = [&](const std::string& errors) {
    const std::string line = "  noise_bound: [0, 0, 0.01, 0.01]\n";
    return files.Load(Replaced(kTask, line, line + "  " + errors + "\n")).grounds.declaration;
  };
  EXPECT_EQ(with("state_error: {}"), digest);
  EXPECT_EQ(with("input_error: {ax: 0}"), digest);
  EXPECT_EQ(with("state_error: [0, 0, 0.1, 0]"), with("state_error: {vx: 0.1}"));
  const std::set<Digest> different{digest,
                                   with("state_error: {px: 4.9e-324}"),
                                   with("state_error: {px: 0.1}"),
                                   with("state_error: {py: 0.1}"),
                                   with("disturbance: [0.1, 0, 0, 0]"),
                                   with("input_error: {ax: 0.1}"),
                                   with("input_error: [0, 0.1]")};
  EXPECT_EQ(different.size(), 7u);
}

// Recorded logs and latched faults name it.
TEST(DeclarationDigest, WithoutDisturbanceIsFixed) {
  const Declaration declaration{Eigen::MatrixXd::Ones(4, 6), Eigen::VectorXd::Zero(4)};
  EXPECT_EQ(ToHex(DeclarationDigest(*MakePointMass(0.15), declaration)),
            "13d8edfd9ab9f1a81d4d8912949996af9cff692d0ea4013b26bd69eb41059b6f");
}

TEST(ModelDigest, TellsModelsAndParametersApart) {
  const std::set<Digest> digests{
      ModelDigest(*MakePointMass(0.15)), ModelDigest(*MakePointMass(std::nextafter(0.15, 1))),
      ModelDigest(*MakeKinematicBicycle(0.1, 2.5)), ModelDigest(*MakeKinematicBicycle(2.5, 0.1))};
  EXPECT_EQ(digests.size(), 4u);
  EXPECT_EQ(ModelDigest(*MakePointMass(0.15)), ModelDigest(*MakePointMass(0.15)));
}

TEST(ObstaclesDigest, TellsObstaclesApart) {
  const std::vector<Vector2d> corners{{0, 0}, {1, 0}, {0, 1}};
  const std::vector<Eigen::VectorXd> triangle(corners.begin(), corners.end());
  const Obstacle circle = Obstacle::Circle(Vector2d(1, 2), 0), box = Obstacle::AxisBox(Vector2d(1, 2), Vector2d(1, 2));
  const std::vector<std::vector<Obstacle>> different{{},
                                                     {circle},
                                                     {circle, circle},
                                                     {circle.Named("oak")},
                                                     {circle.Named("oak_2")},
                                                     {circle.Named("oak"), circle},
                                                     {circle, circle.Named("oak")},
                                                     {circle.Named("oak").Moving({})},
                                                     {circle.Moving({})},
                                                     {circle, box},
                                                     {box, circle},
                                                     {Obstacle::Circle(Vector2d(1, 2), 1)},
                                                     {Obstacle::Circle(Vector2d(2, 1), 0)},
                                                     {box},
                                                     {Obstacle::Polygon(triangle)},
                                                     {Obstacle::HalfSpace(Vector2d(1, 2), 0)},
                                                     {Obstacle::HalfSpace(Vector2d(1, 2), 1)},
                                                     {Obstacle::HalfSpace(Eigen::Vector3d(1, 2, 0), 0)}};
  std::set<Digest> digests;
  for (const auto& obstacles : different) digests.insert(ObstaclesDigest(obstacles));
  EXPECT_EQ(digests.size(), different.size());
}

TEST(ObstaclesDigest, DoesNotDependOnHowTheyAreWritten) {
  const TaskFiles files;
  const Digest digest = files.Load().grounds.obstacles;
  EXPECT_EQ(digest, ObstaclesDigest({Obstacle::Circle(Vector2d(3, 2), 0.8)}));
  const auto with = [&](const std::string& list) {
    return files.Load(Replaced(kTask, "[{circle: {center: [3, 2], radius: 0.8}}]", list)).grounds.obstacles;
  };
  EXPECT_EQ(with("\n    - circle:\n        radius: 8e-1\n        center: [3.0, +2]"), digest);
  EXPECT_EQ(with("[{name: oak_2, circle: {center: [3, 2], radius: 0.8}}]"),
            ObstaclesDigest({Obstacle::Circle(Vector2d(3, 2), 0.8).Named("oak_2")}));
}

// The byte string is a contract with every recorded log: a change of it makes them all disagree.
TEST(CanonicalBytes, MatchTheSpecifiedBytes) {
  CanonicalBytes bytes("kind");
  bytes.Texts({"ab"});
  bytes.Number(-0.0);
  bytes.Number(1);
  Eigen::MatrixXd matrix(1, 2);
  matrix << 2, 3;
  bytes.Numbers(matrix);
  const auto word = [](char low) { return std::string{low, 0, 0, 0, 0, 0, 0, 0}; };
  const auto high = [](const std::string& two) { return std::string(6, '\0') + two; };
  const std::string expected = word(4) + "kind" + word(1) + word(2) + "ab" + word(0) + high("\xf0\x3f") + word(1) +
                               word(2) + high(std::string("\0\x40", 2)) + high("\x08\x40");
  EXPECT_EQ(bytes.digest(), DigestOf(std::string_view(expected)));
}

}  // namespace forereach::digest_test
