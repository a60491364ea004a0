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
              Exits(0, "8 by 8 cells of 1 m", "Unknown cells are occupied", "import-world: 5 obstacles in"));
  EXPECT_EQ(LoadConfig(scratch_ / "out.yaml").obstacles.size(), 5u) << "a wall and four half-planes";
  EXPECT_THAT(Certify("out.yaml"), Exits(0, "certified: the robot stays clear at all times"));
  scratch_.Write("plan.csv", "ax,ay\n1,0\n1,0\n1,0\n1,0\n1,0\n1,0\n1,0\n1,0\n1,0\n1,0\n1,0\n1,0\n1,0\n1,0\n");
  EXPECT_THAT(Certify("out.yaml"), Exits(1, "may touch obstacle 0"));
}

TEST_F(ImportWorldTest, WritesAPartOfATaskFile) {
  ASSERT_EQ(ImportWorld(scratch_ / "map.yaml" + " --unknown free").code, 0);
  const std::string text = Read(scratch_ / "out.yaml");
  EXPECT_THAT(text, StartsWith("# The obstacles of map.yaml, by forereach import-world.\n"));
  EXPECT_THAT(text, HasSubstr("\ntask:\n  obstacles:\n    - box: {lower: [2, -4], upper: [3, 4]}  # 1 by 8 cells"));
  EXPECT_THAT(ImportWorld(scratch_ / "map.yaml"), Exits(2, "the file exists, and is not changed"));
}

TEST_F(ImportWorldTest, MoreThanATaskTakesAreNotWritten) {
  std::string image = fmt::format("P2 {} 3 255\n", 2 * kMostObstacles + 2);
  for (int i = 0; i < 3 * (2 * kMostObstacles + 2); ++i) image += i % 2 == 0 ? "0 " : "254 ";
  scratch_.Write("map.pgm", image);
  EXPECT_THAT(
      ImportWorld(scratch_ / "map.yaml" + " --unknown free"),
      Exits(1, fmt::format("{} obstacles, and a task takes {}: nothing is written", kMostObstacles + 1, kMostObstacles),
            "--task or --region", "--coarsen"));
  EXPECT_FALSE(std::filesystem::exists(scratch_ / "out.yaml"));
  EXPECT_THAT(ImportWorld(scratch_ / "map.yaml" + " --unknown free --region 0,0,9,9"), Exits(0));
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
