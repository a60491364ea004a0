// `forereach import`: a log in another's format becomes the transitions of a task; the commands of docs/data.md.
#include "tests/test.h"

#include "task/config.h"
#include "tests/cli/program.h"
#include "tests/config/task_files.h"
#include "tests/paths.h"

namespace forereach::import_test {

using Json = nlohmann::json;

class ImportCommandTest : public testing::Test {
 protected:
  ImportCommandTest() {
    scratch_.Write("task.yaml", kTask);
    scratch_.Write("log.csv",
                   "stamp;x pos;py;vx;vy;cmd;ay\n0;100;0;1;0;0.5;0\n150;115.5;0;1.07;0;0.5;0\n300;131;0;1;0;0;0\n");
  }
  Output Import(const std::string& options) const {
    return Forereach("import --config " + scratch_ / "task.yaml" + " --out " + out_ + " " + options + " 2>&1");
  }
  const std::string columns_ = "--time stamp --time-unit ms --state 'px=x pos' --unit px=cm --input ax=cmd ";

  ScratchDirectory scratch_;
  const std::string out_ = scratch_ / "steps.csv", log_ = scratch_ / "log.csv";
};

TEST_F(ImportCommandTest, ItsTransitionsAreReadWithTheTask) {
  const Output output = Import(columns_ + log_);
  EXPECT_EQ(output.code, 0) << output.text;
  EXPECT_THAT(output.text, HasSubstr("import: 2 transitions of 0.15 s in " + out_));
  const Transitions transitions = LoadConfig(scratch_ / "task.yaml").problem->transitions;
  ASSERT_EQ(transitions.size(), 2);
  EXPECT_DOUBLE_EQ(transitions.z(0, 0), 1);
  EXPECT_DOUBLE_EQ(transitions.x_next(0, 0), 1.155);
  EXPECT_EQ(transitions.z(0, 4), 0.5);
  EXPECT_EQ(transitions.x_next(1, 2), 1);
}

TEST_F(ImportCommandTest, AColumnOfTimeNeedsNoOption) {
  scratch_.Write("log.csv", "px,py,vx,vy,ax,ay,time\n0,0,1,0,0,0,0\n0.15,0,1,0,0,0,0.15\n");
  EXPECT_EQ(Import(log_).code, 0) << Import(log_).text;
  EXPECT_THAT(Import("--rate 5 " + log_).text, HasSubstr("a step of the task is")) << "--rate takes no stamps";
  scratch_.Write("log.csv", "0,0,1,0,0,0,0\n0.15,0,1,0,0,0,0.15\n");
  EXPECT_EQ(Import("--header px,py,vx,vy,ax,ay,time " + log_).code, 0);
}

TEST_F(ImportCommandTest, SaysHowFarTheNearestStampsAre) {
  std::string rows = "time,px,py,vx,vy,ax,ay\n";
  for (const char* stamp : {"0", "0.079", "0.146", "0.225", "0.3"}) rows += std::string(stamp) + ",0,0,0,0,0,0\n";
  scratch_.Write("log.csv", rows);
  const Output output = Import(log_);
  EXPECT_EQ(output.code, 1);
  EXPECT_THAT(output.text, HasSubstr("3  starts without a stamp near t + dt; first in line 2\n             the nearest "
                                     "is 4"));
  EXPECT_THAT(output.text, HasSubstr("at most; --tolerance-ms is 0.001\n"));
  const Json gap = Json::parse(Import("--json " + log_).text)["logs"][0]["dropped"]["gap"];
  EXPECT_NEAR(gap["median_distance_s"], 0.004, 1e-9);
  EXPECT_NEAR(gap["largest_distance_s"], 0.004, 1e-9);
  EXPECT_EQ(Import("--tolerance-ms 4.01 " + log_).code, 0);
}

TEST_F(ImportCommandTest, JsonHasEveryCause) {
  scratch_.Write("log.csv", Read(log_) + "450;1\n\n# end\n600;1;0;nan;0;0;0\n750;1;0;0;0;0;0\n900;1;0;0;0;0;9\n");
  const Json document = Json::parse(Import(columns_ + "--json " + log_).text);
  EXPECT_EQ(document["transitions"], 3);
  EXPECT_EQ(document["out"], out_);
  const Json& log = document["logs"][0];
  EXPECT_EQ(log["dropped"]["row_lost"]["first_line"], 5);
  EXPECT_EQ(log["dropped"]["no_state"]["first"], "vx");
  EXPECT_EQ(log["not_a_number"]["vx"]["count"], 1);
  EXPECT_EQ(log["blank_lines"], 1);
  EXPECT_EQ(log["comments"], 1);
  EXPECT_EQ(log["spacing_s"], 0.15);
}

TEST_F(ImportCommandTest, NoTransitionIsExitOneAndNoFile) {
  scratch_.Write("log.csv", "stamp;x pos;py;vx;vy;cmd;ay\n0;100;0;1;0;5;0\n150;115.5;0;1.07;0;0.5;0\n");
  const Output output = Import(columns_ + log_);
  EXPECT_EQ(output.code, 1);
  EXPECT_THAT(output.text, HasSubstr("1  starts outside the task's domain; first in line 2 (ax 5)"));
  EXPECT_THAT(output.text, HasSubstr(out_ + " is not written"));
  EXPECT_FALSE(std::filesystem::exists(out_));
}

TEST_F(ImportCommandTest, BadInputIsExitTwoWithWhatIsWrong) {
  const std::pair<std::string, const char*> cases[] = {
      {log_, "give either --time, the column of the stamps, or --rate"},
      {"--time stamp --rate 10 " + log_, "give either --time, the column of the stamps, or --rate"},
      {"--time stamp " + log_, "log.csv:1: no column 'px'"},
      {columns_ + "--state pz=1 " + log_, "--state: the model has no 'pz'; did you mean px?"},
      {columns_ + "--state px=py " + log_, "--state: px is given twice"},
      {columns_ + "--state px " + log_, "--state: 'px' is not NAME=VALUE"},
      {columns_ + "--unit vx=kph " + log_, "--unit: vx='kph' is no unit that is known here"},
      {columns_ + "--tolerance-ms 75 " + log_, "has to be below half a step of the task, 75 ms"},
      {columns_ + "--unwrap ax " + log_, "--unwrap: the model has no state 'ax'"},
      {columns_ + "--input-tolerance ax=-1 " + log_, "--input-tolerance: ax: '-1' is no number from 0 up"},
      {columns_ + "--input-tolerance ax=1 --input-mean " + log_, "excludes"},
      {columns_ + "--delimiter comma " + log_, "log.csv:1: no column 'stamp'"},
      {columns_ + scratch_ / "none.csv", "none.csv: cannot be read"},
      {"--time stamp --state 'px=x pos' --input ax=cmd " + log_, "typically 150 s apart"}};
  for (const auto& [options, words] : cases) {
    const Output output = Import(options);
    EXPECT_EQ(output.code, 2) << options;
    EXPECT_THAT(output.text, HasSubstr(words)) << options;
  }
}

TEST_F(ImportCommandTest, AnOptionOfAListTakesOneValueAndLeavesTheFiles) {
  EXPECT_EQ(Import(columns_ + log_ + " --unwrap px " + log_).code, 0);
  EXPECT_EQ(
      Import("--time stamp --time-unit ms --unit px=cm --input ax=cmd --state 'px=x pos' " + log_ + " " + log_).code,
      0);
}

// ---- docs/data.md: its commands are run, in a folder of their own.

TEST(DataDocument, CommandsPrintWhatItSays) {
  const ScratchDirectory scratch;
  const std::string examples = FOREREACH_SOURCE_DIR "/examples";
  std::filesystem::copy(examples, scratch / "examples", std::filesystem::copy_options::recursive);
  std::ifstream document(FOREREACH_SOURCE_DIR "/docs/data.md");
  std::string command, expected;
  int commands = 0;
  const auto check = [&] {
    if (command.empty()) return;
    ++commands;
    const Output output = Shell("cd '" + scratch.path() + "' && '" FOREREACH_PROGRAM "' " +
                                command.substr(std::string("forereach ").size()));
    EXPECT_EQ(output.text, expected) << command;
    command.clear();
    expected.clear();
  };
  bool inside = false;
  for (std::string line; std::getline(document, line);) {
    if (line.starts_with("```")) {
      check();
      inside = line == "```console";
    } else if (inside && line.starts_with("$ ")) {
      check();
      command = line.substr(2);
    } else if (inside && command.ends_with("\\")) {
      command = command.substr(0, command.size() - 1) + line;
    } else if (inside) {
      expected += line + "\n";
    }
  }
  EXPECT_GE(commands, 1);
}

}  // namespace forereach::import_test
