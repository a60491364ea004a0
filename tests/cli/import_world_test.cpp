// `forereach import-world`: files of others become the obstacles of a task, in which a plan is certified.

#include <fmt/format.h>

#include "task/config.h"
#include "task/most_obstacles.h"
#include "tests/cli/program.h"

namespace forereach::import_world_test {

struct ImportWorldTest : testing::Test {
  ImportWorldTest() {
    scratch_.Write(
        "map.yaml",
        "image: map.pgm\nresolution: 1\norigin: [-4, -4, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.2\n");
    std::string image = "P2 8 8 255\n";
    for (int row = 0; row < 8; ++row)
      for (int column = 0; column < 8; ++column) image += row == 1 || column == 6 ? "0 " : "254 ";
    scratch_.Write("map.pgm", image);
    scratch_.Write("task.yaml", kTask);
    scratch_.Write("steps.csv", "px,py,vx,vy,ax,ay,px_next,py_next,vx_next,vy_next\n0,0,1,0,0,0,0.1,0,1,0\n");
    scratch_.Write("plan.csv", "ax,ay\n0,0\n0,0\n0,0\n0,0\n0,0\n0,0\n0,0\n0,0\n0,0\n0,0\n");
  }
  Output ImportWorld(const std::string& what) const {
    return Forereach("import-world " + what + " --out " + scratch_ / "out.yaml" + " 2>&1");
  }
  Output Certify(const std::string& config) const {
    return Forereach("certify --config " + scratch_ / config + " --plan " + scratch_ / "plan.csv" + " 2>&1");
  }

  static constexpr const char* kTask = R"(model: {name: point_mass, dt: 0.1}
domain:
  state: {lower: [-3, -3, -3, -3], upper: [3, 1, 3, 3]}
  input: {lower: [-1, -1], upper: [1, 1]}
declaration: {lipschitz: {}, noise_bound: [0, 0, 0, 0], state_error: {}}
transitions: steps.csv
task:
  initial_set: {center: [0, 0, 1, 0], half_width: [0.01, 0.01, 0.01, 0.01]}
  projection: [px, py]
  between: {acceleration: [1, 1]}
  obstacles: []  # of the map
gate: {obstacles: task, require_stop: false}
robot: {step_error_ms: 0}
)";
  ScratchDirectory scratch_;
};

TEST_F(ImportWorldTest, APlanIsCertifiedAmongTheObstaclesOfAMap) {
  EXPECT_THAT(ImportWorld(scratch_ / "map.yaml" + " --task " + scratch_ / "task.yaml --whole-task"),
              Exits(0, "8 by 8 cells of 1 m", "Unknown cells are occupied", "import-world: 1 obstacles in"));
  const Obstacle grid = LoadConfig(scratch_ / "out.yaml").obstacles.at(0);
  EXPECT_EQ(grid.convex().size(), 7u) << "three rectangles and four half-planes";
  EXPECT_THAT(Certify("out.yaml"), Exits(0, "certified: the robot stays clear at all times"));
  scratch_.Write("plan.csv", "ax,ay\n1,0\n1,0\n1,0\n1,0\n1,0\n1,0\n1,0\n1,0\n1,0\n1,0\n1,0\n1,0\n1,0\n1,0\n");
  EXPECT_THAT(Certify("out.yaml"), Exits(1, "may touch cells (6, 0) to (6, 5) of map"));
}

// The robot drives a metre along x. Messages, the check and the verifier know the area.
TEST_F(ImportWorldTest, APlanIsCertifiedInAnAreaToStayIn) {
  const auto task = [&](const std::string& area) {
    return std::string(kTask).replace(std::string(kTask).find("[]  # of the map"), 16, "[]\n  keep_in: " + area);
  };
  // Between two arms.
  const std::string lawn =
      "[{name: lawn, vertices: [[-2, -2], [2, -2], [2, -1], [1.5, -1], [1.5, 0.5], [2, 0.5], [2, 1], [-2, 1]]";
  scratch_.Write("lawn.yaml", task(lawn + "}]"));
  const Config config = LoadConfig(scratch_ / "lawn.yaml");
  EXPECT_EQ(config.keep_in.front().name, "lawn");
  EXPECT_EQ(config.num_listed, 0u);
  EXPECT_TRUE(std::ranges::all_of(config.obstacles, IsOutside));
  EXPECT_THAT(Certify("lawn.yaml"), Exits(0, "certified: the robot stays clear at all times"));
  const std::string certificate = scratch_ / "certificate.json";
  const auto certify = [&](const char* config_file) {
    return Forereach("certify --json --config " + scratch_ / config_file + " --plan " + scratch_ / "plan.csv" + " > " +
                     certificate);
  };
  ASSERT_EQ(certify("lawn.yaml").code, 0);
  EXPECT_THAT(Forereach("verify " + certificate), Exits(0));
  EXPECT_THAT(Forereach("check " + scratch_ / "lawn.yaml" + " --plan " + scratch_ / "plan.csv" + " 2>&1"), Exits(0));
  scratch_.Write("hole.yaml", task(lawn + ", holes: [[[0.5, -0.1], [0.6, 0], [0.5, 0.1]]]}]"));
  EXPECT_THAT(Certify("hole.yaml"), Exits(1, "the robot may leave lawn (by "));
  scratch_.Write("far.yaml", task("[{vertices: [[1, 1], [2, 1], [2, 2]]}]"));
  EXPECT_THAT(Certify("far.yaml"), Exits(1, "the robot may leave keep_in (by "));
  EXPECT_THAT(Forereach("check " + scratch_ / "far.yaml" + " 2>&1"),
              Exits(1, "task.keep_in: the robot may leave keep_in at the start"));
}

TEST_F(ImportWorldTest, AnAreaToStayInThatIsNoneIsAnError) {
  const auto why = [&](const std::string& area) {
    scratch_.Write("area.yaml", std::string(kTask).replace(std::string(kTask).find("[]  # of the map"), 16,
                                                           "[]\n  keep_in: " + area));
    return Thrown<ConfigError>([&] { static_cast<void>(LoadConfig(scratch_ / "area.yaml")); });
  };
  EXPECT_THAT(why("[{vertices: [[0, 0], [4, 4], [4, 0], [0, 4]]}]"),
              AllOf(HasSubstr("area.yaml:12: task.keep_in[0]: the side from (0, 0) to (4, 4) meets")));
  EXPECT_THAT(why("[{vertices: [[0, 0], [4, 0], [2, 0]]}]"), HasSubstr("meets the side"));
  EXPECT_THAT(why("[{vertices: [[0, 0], [4, 0]]}]"), HasSubstr("2"));
  EXPECT_THAT(why("[{vertices: [[0, 0], [4, 0], [.nan, 0]]}]"), HasSubstr("task.keep_in[0].vertices[2][0]"));
  EXPECT_THAT(why("[{vertices: [[0, 0], [4, 0], [1e300, 5]]}]"), HasSubstr("is outside [-1e+09, 1e+09]"));
  EXPECT_THAT(why("[{vertices: [[0, 0], [4, 0], [4, 4, 1]]}]"), HasSubstr("task.keep_in[0].vertices[2]"));
  EXPECT_THAT(why("[{name: 9lives, vertices: [[0, 0], [4, 0], [4, 4]]}]"), HasSubstr("must begin with a letter"));
  EXPECT_THAT(why("[{name: a234567890123456789012345, vertices: [[0, 0], [4, 0], [4, 4]]}]"),
              HasSubstr("has 25 characters, must have 1 to 23"));
  std::string many;
  for (int i = 0; i < 100'000; ++i) many += fmt::format("{}[{}, {}]", i > 0 ? ", " : "", i, i % 2);
  EXPECT_THAT(why("[{vertices: [" + many + "]}]"), HasSubstr("task.keep_in[0].vertices: has 100000 entries"));
  EXPECT_THAT(why("[{vertices: [[0, 0], [4, 0], [4, 4]], holes: [[[5, 5], [6, 5], [6, 6]]]}]"),
              HasSubstr("the hole at (6, 6) is not inside"));
}

TEST_F(ImportWorldTest, WritesAPartOfATaskFile) {
  ASSERT_EQ(ImportWorld(scratch_ / "map.yaml" + " --unknown free --as rectangles").code, 0);
  const std::string text = Read(scratch_ / "out.yaml");
  EXPECT_THAT(text, StartsWith("# The obstacles of map.yaml, by forereach import-world.\n"));
  EXPECT_THAT(text, HasSubstr("\ntask:\n  obstacles:\n    - box: {lower: [2, -4], upper: [3, 2]}\n"));
  EXPECT_THAT(ImportWorld(scratch_ / "map.yaml"), Exits(2, "the file exists, and is not changed"));
}

TEST_F(ImportWorldTest, MoreThanATaskTakesAreNotWritten) {
  std::string image = fmt::format("P2 {} 3 255\n", 2 * kMostObstacles + 2);
  for (int i = 0; i < 3 * (2 * kMostObstacles + 2); ++i) image += i % 2 == 0 ? "0 " : "254 ";
  scratch_.Write("map.pgm", image);
  EXPECT_THAT(
      ImportWorld(scratch_ / "map.yaml" + " --unknown free --as rectangles"),
      Exits(1, fmt::format("{} obstacles, and a task takes {}: nothing is written", kMostObstacles + 1, kMostObstacles),
            "--task or --region", "--as grid"));
  EXPECT_FALSE(std::filesystem::exists(scratch_ / "out.yaml"));
  EXPECT_THAT(ImportWorld(scratch_ / "map.yaml" + " --unknown free --as rectangles --region 0,0,9,9"), Exits(0));
  EXPECT_THAT(ImportWorld(scratch_ / "map.yaml" + " --unknown free --force"), Exits(0, "1 obstacles"));
  EXPECT_THAT(Read(scratch_ / "out.yaml"), AllOf(HasSubstr("    - grid:\n        resolution: 1\n"),
                                                 HasSubstr(fmt::format("size: [{}, 3]\n", 2 * kMostObstacles + 2))));
}

TEST_F(ImportWorldTest, SaysWhatIsWrongWithItsOptions) {
  EXPECT_THAT(ImportWorld(scratch_ / "map.pgm"), Exits(2, "is an image; name the YAML file of the map"));
  EXPECT_THAT(ImportWorld(scratch_ / "plan.csv"), Exits(2, "give --format"));
  EXPECT_THAT(ImportWorld(scratch_ / "map.yaml" + " --region 0,0,1"),
              Exits(2, "--region: has 3 numbers, has to have 4"));
  EXPECT_THAT(ImportWorld(scratch_ / "map.yaml" + " --region 0,0,1,x"), Exits(2, "--region: 'x'"));
  EXPECT_THAT(ImportWorld(scratch_ / "map.yaml" + " --region 1,0,0,1"), Exits(2, "--region: its upper corner"));
  EXPECT_THAT(ImportWorld(scratch_ / "map.yaml" + " --whole-task"), Exits(2, "--task"));
  scratch_.Write("task.yaml", std::string(kTask).replace(std::string(kTask).find("[]  # of"), 2, "\n    - {}"));
  EXPECT_THAT(ImportWorld(scratch_ / "map.yaml" + " --task " + scratch_ / "task.yaml --whole-task"), Exits(2));
}

}  // namespace forereach::import_world_test
