// `forereach declare --from-data` and `--hold-out`: what they propose goes into a task file, and what they say is true.
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "certifier/certify/certifier.h"
#include "certifier/task/config.h"
#include "tests/cli/program.h"
#include "tests/config/task_files.h"

namespace forereach {
namespace {

using testing::HasSubstr;
using testing::Not;
using Json = nlohmann::json;

class DeclareDataTest : public testing::Test {
 protected:
  // A point mass in one long drive. The residual of vx is -0.02 |vx|, observed to within 0.001.
  DeclareDataTest() {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> uniform(-1, 1);
    std::ostringstream rows;
    rows.precision(17);
    rows << "px,py,vx,vy,ax,ay,px_next,py_next,vx_next,vy_next\n";
    double px = 0, vx = 0;
    for (int i = 0; i < 200; ++i) {
      const double ax = uniform(random) - 0.1 * px - 0.3 * vx, next_px = px + 0.15 * vx + 0.5 * 0.15 * 0.15 * ax,
                   next_vx = vx + 0.15 * ax - 0.02 * std::abs(vx) + 0.001 * uniform(random);
      rows << px << ",0," << vx << ",0," << ax << ",0," << next_px << ",0," << next_vx << ",0\n";
      px = next_px;
      vx = next_vx;
    }
    scratch_.Write("steps.csv", rows.str());
    scratch_.Write("task.yaml", Replaced(kTask, "[0, 0, 0.01, 0.01]", "[0.001, 0, 0.0015, 0.01]"));
  }
  Output Declare(const std::string& options) const {
    return Forereach("declare --config " + task_ + " --from-data " + options + " 2>&1");
  }

  ScratchDirectory scratch_;
  const std::string task_ = scratch_ / "task.yaml";
};

TEST_F(DeclareDataTest, ItsLinesGoIntoATaskFileThatNoTransitionContradicts) {
  const Json document = Json::parse(Declare("--by vx --noise estimated --json").text);
  EXPECT_FALSE(document["proven"]);
  const std::string task = Read(task_);
  const std::size_t begin = task.find("declaration:"), end = task.find("transitions:");
  std::ofstream(task_) << task.substr(0, begin) + document["yaml"].get<std::string>() + task.substr(end);
  const Config config = LoadConfig(task_);
  EXPECT_FALSE(Certifier(config.problem).violation());
  const double declared = config.problem->declaration.lipschitz(2, 2);
  EXPECT_EQ(declared, document["lipschitz"][2][2]);
  ASSERT_EQ(document["entries"].size(), 1u) << document;
  const Json& entry = document["entries"][0];
  EXPECT_LE(entry["smallest"], 0.02);
  EXPECT_LE(entry["at_least"], entry["smallest"].get<double>() * (1 + 1e-6));
  EXPECT_NEAR(entry["proposed"], 1.5 * entry["smallest"].get<double>(), 1e-6);
  EXPECT_EQ(document["never_varied"], Json({"py", "vy", "ay"}));
}

TEST_F(DeclareDataTest, SaysWhatIsNotProven) {
  const Output output = Declare("--by vx");
  EXPECT_EQ(output.code, 0);
  EXPECT_THAT(output.text, HasSubstr("an estimate and no proof"));
  EXPECT_THAT(output.text, HasSubstr("Nothing of this is proven."));
  EXPECT_THAT(output.text,
              HasSubstr("Never varied in these transitions, so that nothing is known of their slopes: py, vy, ay."));
}

TEST_F(DeclareDataTest, SaysSoIfNoSlopesAreConsistent) {
  const Output output = Declare("--by px= --by vx=vy");
  EXPECT_EQ(output.code, 1);
  EXPECT_THAT(output.text, HasSubstr("no L is consistent"));
  EXPECT_THAT(output.text, HasSubstr("their residuals of vx differ by"));
}

TEST_F(DeclareDataTest, HoldOutCountsAndDraws) {
  const std::string picture = scratch_ / "trade";
  const Json document = Json::parse(Declare("--by vx --hold-out --blocks 8 --json --picture " + picture).text);
  ASSERT_EQ(document["factors"].size(), 7u);
  int last = 101;
  for (const Json& row : document["factors"]) {
    EXPECT_EQ(row["transitions"], 100);
    EXPECT_EQ(row["blocks"], 4);
    EXPECT_LE(row["contradicting"], last);
    EXPECT_GE(row["block_rate_at_most"], row["blocks_contradicting"].get<int>() / 4.0);
    EXPECT_EQ(row["stretches"], 8) << "25 transitions of a block give two stretches of 10";
    EXPECT_LE(row["states_inside"], row["states"]);
    last = row["contradicting"];
  }
  EXPECT_NEAR(document["factors"][6]["block_rate_at_most"], 1 - std::pow(0.05, 0.25), 1e-6);
  for (const char* ending : {".svg", ".png"}) EXPECT_GT(std::filesystem::file_size(picture + ending), 1000u);
  EXPECT_THAT(Read(picture + ".svg"), HasSubstr("<svg"));
}

TEST_F(DeclareDataTest, BadInputIsExitTwo) {
  const std::pair<const char*, const char*> cases[] = {
      {"--by vz", "--by: the model has no 'vz'"},
      {"--by vx=px --by vx=py", "--by: vx is given twice"},
      {"--hold-out --blocks 201", "--blocks: 201 is more than the task's 200 transitions"},
      {"--factor 0.9", "not in range"},
      {"--hold-out --picture trade.gif", "ends in .gif"},
      {"--between", "excludes"}};
  for (const auto& [options, words] : cases) {
    const Output output = Declare(options);
    EXPECT_EQ(output.code, 2) << options;
    EXPECT_THAT(output.text, HasSubstr(words)) << options;
  }
  EXPECT_EQ(Forereach("declare --config " + task_ + " --hold-out 2>&1").code, 2) << "it needs --from-data";
}

}  // namespace
}  // namespace forereach
