// Files that nobody here made, in folders that the environment names: FOREREACH_WORLDS (maps of ROS, CommonRoad,
// GeoJSON) and FOREREACH_LOGS (maebot.lcmlog). Each is imported, a plan is certified with it, and the picture shows
// both.

#include <fmt/format.h>

#include <random>
#include <regex>

#include "task/config.h"
#include "tests/cli/program.h"

namespace forereach::strangers_test {

struct StrangersTest : testing::Test {
  StrangersTest() {
    scratch_.Write("task.yaml", kTask);
    scratch_.Write("steps.csv", "px,py,vx,vy,ax,ay,px_next,py_next,vx_next,vy_next\n0,0,0,0,0,0,0,0,0,0\n");
    scratch_.Write("plan.csv", "ax,ay\n0.5,0\n0.5,0\n0.5,0\n0,0\n0,0\n-0.5,0\n-0.5,0\n-0.5,0\n");
  }

  static std::vector<std::string> FilesOf(const char* variable, const std::regex& name) {
    std::vector<std::string> files;
    if (const char* folder = std::getenv(variable))
      for (const auto& file : std::filesystem::directory_iterator(folder))
        if (std::regex_match(file.path().filename().string(), name)) files.push_back(file.path().string());
    return files;
  }

  Output CertifyFrom(const Eigen::Vector2d& place) const {
    const std::string center = fmt::format("center: [{}, {},", place[0], place[1]);
    scratch_.Write("from.yaml", Replaced(Read(scratch_ / "out.yaml"), "center: [0, 0,", center));
    return Forereach("certify --config " + scratch_ / "from.yaml" + " --plan " + scratch_ / "plan.csv" + " --picture " +
                     scratch_ / "picture.svg" + " 2>&1");
  }

  // A plan is certified from a free place, and none from the middle of an obstacle.
  void TriesPlansIn(const std::string& file, const std::string& options) const {
    SCOPED_TRACE(file + ", seed 1");
    ASSERT_THAT(Forereach("import-world '" + file + "' " + options + " --whole-task --force --task " +
                          scratch_ / "task.yaml" + " --out " + scratch_ / "out.yaml"),
                Exits(0));
    const std::vector<Obstacle> obstacles = LoadConfig(scratch_ / "out.yaml").obstacles;
    Eigen::Vector3d lower = Eigen::Vector3d::Constant(1e9), upper = -lower;
    std::optional<Eigen::Vector2d> inside;
    for (const Obstacle& obstacle : obstacles)
      for (const Obstacle& piece : obstacle.convex())
        if (piece.lower().allFinite() && piece.upper().allFinite()) {
          lower = lower.cwiseMin(piece.lower()), upper = upper.cwiseMax(piece.upper());
          if (!inside && !obstacle.motion()) inside = ((piece.lower() + piece.upper()) / 2).head<2>();
        }
    ASSERT_TRUE(inside) << "nothing stands there";
    EXPECT_THAT(CertifyFrom(*inside), Exits(1, "may touch"));
    std::mt19937 random(1);
    bool certified = false;
    for (int tried = 0, certificates = 0; tried < 100'000 && certificates < 20 && !certified; ++tried) {
      const auto between = [&](int k) { return std::uniform_real_distribution(lower[k], upper[k])(random); };
      const Eigen::Vector2d place(between(0), between(1));
      const auto distance = [&](const Obstacle& obstacle) { return ApproximateDistance(obstacle, place); };
      if (std::ranges::any_of(obstacles, [&](const Obstacle& obstacle) { return distance(obstacle) < 0.5; })) continue;
      ++certificates;
      certified = CertifyFrom(place).code == 0;
    }
    EXPECT_TRUE(certified);
    ExpectPicture();
  }

  void ExpectPicture() const {
    const std::string picture = Read(scratch_ / "picture.svg");
    const std::regex shape("<(path|polygon|polyline|circle|rect|image)\\b");
    EXPECT_GT(std::distance(std::sregex_iterator(picture.begin(), picture.end(), shape), {}), 3) << picture.size();
  }

  static constexpr const char* kTask = R"(model: {name: point_mass, dt: 0.1}
domain:
  state: {lower: [-1000000, -1000000, -3, -3], upper: [1000000, 1000000, 3, 3]}
  input: {lower: [-1, -1], upper: [1, 1]}
declaration: {lipschitz: {}, noise_bound: [0, 0, 0, 0], state_error: {}}
transitions: steps.csv
task:
  initial_set: {center: [0, 0, 0, 0], half_width: [0.01, 0.01, 0.01, 0.01]}
  projection: [px, py]
  between: {acceleration: [1, 1]}
  obstacles: []
gate: {obstacles: task, require_stop: false}
robot: {step_error_ms: 0}
)";
  ScratchDirectory scratch_;
};

TEST_F(StrangersTest, MapsOfRos) {
  const std::vector<std::string> files = FilesOf("FOREREACH_WORLDS", std::regex(".*\\.yaml"));
  if (files.empty()) GTEST_SKIP() << "FOREREACH_WORLDS names no folder with a map (.yaml)";
  for (const std::string& file : files) TriesPlansIn(file, "--format ros");
}

TEST_F(StrangersTest, ScenariosOfCommonRoad) {
  const std::vector<std::string> files = FilesOf("FOREREACH_WORLDS", std::regex(".*\\.xml"));
  if (files.empty()) GTEST_SKIP() << "FOREREACH_WORLDS names no folder with a scenario (.xml)";
  for (const std::string& file : files) TriesPlansIn(file, "");
}

// Degrees, as the format's specification has it, about the first place.
TEST_F(StrangersTest, GeoJson) {
  const std::vector<std::string> files = FilesOf("FOREREACH_WORLDS", std::regex(".*\\.(geo)?json"));
  if (files.empty()) GTEST_SKIP() << "FOREREACH_WORLDS names no folder with GeoJSON (.geojson, .json)";
  for (const std::string& file : files) {
    const std::string text = Read(file);
    std::smatch place;
    ASSERT_TRUE(std::regex_search(text, place, std::regex("\\[\\s*(-?[0-9.]+)\\s*,\\s*(-?[0-9.]+)"))) << file;
    TriesPlansIn(file,
                 "--format geojson --line-width 0.2 --point-radius 0.2 --origin=" + place.str(1) + "," + place.str(2));
  }
}

// A small differential drive, whose stamps go back once. It is taken to go where its heading points.
TEST_F(StrangersTest, LogOfLcm) {
  const std::vector<std::string> files = FilesOf("FOREREACH_LOGS", std::regex("maebot\\.lcmlog"));
  if (files.empty()) GTEST_SKIP() << "FOREREACH_LOGS names no folder with maebot.lcmlog";
  scratch_.Write("pose.lcm", "struct pose_t { int64_t utime; float x; float y; float theta; }");
  scratch_.Write("from.yaml", R"(model:
  states: {x: m, y: m}
  inputs: {heading: rad}
  parameters: {dt: 0.15, speed: 0.05}
  next: {x: x + dt*speed*cos(heading), y: y + dt*speed*sin(heading)}
domain: {state: {lower: [-9, -9], upper: [9, 9]}, input: {lower: [-4], upper: [4]}}
declaration: {lipschitz: {x: {heading: 0.1}, y: {heading: 0.1}}, noise_bound: [0.1, 0.1], state_error: {}}
transitions: imported.csv
task:
  initial_set: {center: [0, 0], half_width: [0.01, 0.01]}
  projection: [x, y]
  between: samples
  obstacles: [circle: {center: [5, 0], radius: 0.5}]
gate: {obstacles: task, require_stop: false}
robot: {step_error_ms: any}
)");
  scratch_.Write("plan.csv", "heading\n0\n0\n0\n");
  EXPECT_THAT(Forereach("import --config " + scratch_ / "from.yaml" + " --lcm-types " + scratch_ / "pose.lcm" +
                        " --state x=SLAM_POSE.x --state y=SLAM_POSE.y --input heading=SLAM_POSE.theta --input-mean "
                        "--tolerance-ms 30 --out " +
                        scratch_ / "imported.csv" + " '" + files.front() + "'"),
              Exits(0, "380 transitions of 0.15 s", "35 of 457 rows"));
  EXPECT_THAT(Forereach("certify --config " + scratch_ / "from.yaml" + " --plan " + scratch_ / "plan.csv" +
                        " --picture " + scratch_ / "picture.svg" + " 2>&1"),
              Exits(0, "certified"));
  ExpectPicture();
}

}  // namespace forereach::strangers_test
