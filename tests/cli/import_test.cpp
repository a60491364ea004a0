// `forereach import`: a log in another's format becomes the transitions of a task; the commands of docs/data.md.

#include <fmt/format.h>

#include "records/mcap.h"
#include "tests/cli/program.h"
#include "tests/task/task_files.h"

namespace forereach::import_test {

using Json = nlohmann::json;

struct ImportCommandTest : testing::Test {
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
  EXPECT_THAT(Import(columns_ + log_), Exits(0, "import: 2 transitions of 0.15 s in " + out_));
  const Transitions transitions = LoadConfig(scratch_ / "task.yaml").problem->transitions;
  ASSERT_EQ(transitions.size(), 2);
  EXPECT_DOUBLE_EQ(transitions.z(0, 0), 1);
  EXPECT_DOUBLE_EQ(transitions.x_next(0, 0), 1.155);
  EXPECT_FIELDS(transitions, (z(0, 4), 0.5), (x_next(1, 2), 1));
}

TEST_F(ImportCommandTest, AColumnOfTimeNeedsNoOption) {
  scratch_.Write("log.csv", "px,py,vx,vy,ax,ay,time\n0,0,1,0,0,0,0\n0.15,0,1,0,0,0,0.15\n");
  EXPECT_THAT(Import(log_), Exits(0));
  EXPECT_THAT(Import("--rate 5 " + log_).text, HasSubstr("a step of the task is")) << "--rate takes no stamps";
  scratch_.Write("log.csv", "0,0,1,0,0,0,0\n0.15,0,1,0,0,0,0.15\n");
  EXPECT_EQ(Import("--header px,py,vx,vy,ax,ay,time " + log_).code, 0);
}

TEST_F(ImportCommandTest, OfAnMcapFileChannelsAreJoinedByTheirStamps) {
  const std::string path = scratch_ / "run.mcap";
  McapWriter writer{OutputFile(path)};
  const auto schema = writer.AddSchema("any", "{}");
  const auto state = writer.AddChannel(schema, "STATE"), command = writer.AddChannel(schema, "CMD");
  for (int i = 0; i < 4; ++i) {
    writer.Write(command, 0, 150'000 * i, 0, R"({"a": [0.5, 0]})");
    writer.Write(state, 0, 150'000 * i + 10, 0, fmt::format(R"({{"x": {}, "v": [1, 0]}})", 100 + 15 * i));
  }
  writer.Finish();
  const std::string columns =
      "--state px=STATE.x --unit px=cm --state py=STATE.v[1] --state 'vx=STATE.v[0]' --state 'vy=STATE.v[1]' "
      "--input 'ax=CMD.a[0]' --input 'ay=CMD.a[1]' ";
  EXPECT_THAT(Import(columns + path), Exits(0, "import: 2 transitions of 0.15 s"));
  const Transitions transitions = LoadConfig(scratch_ / "task.yaml").problem->transitions;
  EXPECT_FIELDS(transitions, (size(), 2), (z(0, 4), 0.5));
  EXPECT_DOUBLE_EQ(transitions.z(1, 0), 1.15);
  EXPECT_THAT(Import(columns + "--rate 5 " + path), Exits(2, "recorded messages have stamps"));
  EXPECT_THAT(Import(columns + "--lcm-types a.lcm " + path), Exits(2, "is for LCM logs"));
}

TEST_F(ImportCommandTest, SaysHowFarTheNearestStampsAre) {
  std::string rows = "time,px,py,vx,vy,ax,ay\n";
  for (const char* stamp : {"0", "0.079", "0.146", "0.225", "0.3"}) rows += std::string(stamp) + ",0,0,0,0,0,0\n";
  scratch_.Write("log.csv", rows);
  EXPECT_THAT(Import(log_), Exits(1,
                                  "3  starts without a stamp near t + dt; first in line 2\n             the nearest "
                                  "is 4",
                                  "at most; --tolerance-ms is 0.001\n"));
  const Json gap = Json::parse(Import("--json " + log_).text)["logs"][0]["dropped"]["gap"];
  EXPECT_NEAR(gap["median_distance_s"], 0.004, 1e-9);
  EXPECT_NEAR(gap["largest_distance_s"], 0.004, 1e-9);
  EXPECT_EQ(Import("--tolerance-ms 4.01 " + log_).code, 0);
}

TEST_F(ImportCommandTest, JsonHasEveryCause) {
  scratch_.Write("log.csv", Read(log_) + "450;1\n\n# end\n600;1;0;nan;0;0;0\n750;1;0;0;0;0;0\n900;1;0;0;0;0;9\n");
  const Json document = Json::parse(Import(columns_ + "--json " + log_).text);
  EXPECT_THAT(document, Holds({{"transitions", 3}, {"out", out_}}));
  const Json& log = document["logs"][0];
  EXPECT_EQ(log["dropped"]["row_lost"]["first_line"], 5);
  EXPECT_EQ(log["dropped"]["no_state"]["first"], "vx");
  EXPECT_EQ(log["not_a_number"]["vx"]["count"], 1);
  EXPECT_THAT(log, Holds({{"blank_lines", 1}, {"comments", 1}, {"spacing_s", 0.15}}));
}

TEST_F(ImportCommandTest, NoTransitionIsExitOneAndNoFile) {
  scratch_.Write("log.csv", "stamp;x pos;py;vx;vy;cmd;ay\n0;100;0;1;0;5;0\n150;115.5;0;1.07;0;0.5;0\n");
  EXPECT_THAT(Import(columns_ + log_),
              Exits(1, "1  starts outside the task's domain; first in line 2 (ax 5)", out_ + " is not written"));
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
      {columns_ + "--delimiter comma " + log_, "log.csv:1: the fields seem to be separated by semicolons"},
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

// ---- what logs of other recorders have in common: a double integrator whose speed goes from 8 m/s up.

struct ForeignLogTest : testing::Test {
  ForeignLogTest() {
    scratch_.Write("task.yaml", Replaced(Replaced(TaskFor("model: {states: {p: m, v: m/s}, inputs: {a: m/s^2}, "
                                                          "parameters: {dt: 0.1}, next: {p: p + dt*v, v: v + dt*a}}\n",
                                                          2, 1, "p"),
                                                  "lower: [-1, -1]", "lower: [-100, -50]"),
                                         "upper: [1, 1]", "upper: [100, 50]"));
  }
  // A row at 0.1 i seconds.
  static std::string Row(int i, const char* format = "{:.1f},{:.4f},{:05.2f},1.00\n") {
    const double t = 0.1 * i, p = 8 * t + t * t / 2, v = 8 + t;
    return fmt::format(fmt::runtime(format), t, p, v);
  }
  static std::string Rows(int from, int until, const char* format = "{:.1f},{:.4f},{:05.2f},1.00\n") {
    std::string text;
    for (int i = from; i < until; ++i) text += Row(i, format);
    return text;
  }
  Output Import(const std::string& log, const std::string& options = "") {
    scratch_.Write("log.csv", log);
    return Forereach("import --config " + scratch_ / "task.yaml" + " --out " + scratch_ / "steps.csv" + " " + options +
                     " " + scratch_ / "log.csv" + " 2>&1");
  }
  const std::string header_ = "time,p,v,a\n";
  ScratchDirectory scratch_;
};

TEST_F(ForeignLogTest, ZeroPaddedNumbersAreNumbers) {
  EXPECT_THAT(Import(header_ + Rows(0, 60)),
              Exits(0, "59 transitions from 60 rows, typically 0.1 s apart\n", Not(HasSubstr("no number"))));
}

TEST_F(ForeignLogTest, ASecondHeaderInAnotherOrderIsRefusedWithItsLine) {
  EXPECT_THAT(Import(header_ + Rows(0, 20) + "time,v,p,a\n" + Rows(20, 40, "{0:.1f},{2:.2f},{1:.4f},1\n")),
              Exits(2, "log.csv:22: a second header that differs from the first: time, v, p, a"));
  EXPECT_THAT(Import(header_ + Rows(0, 20) + "time,p,v,a,mode\n" + Rows(20, 40, "{:.1f},{:.4f},{:.2f},1,b\n")),
              Exits(2));
}

TEST_F(ForeignLogTest, ARepeatedHeaderIsSkippedAndSaid) {
  EXPECT_THAT(Import(header_ + Rows(0, 20) + header_ + Rows(20, 40)),
              Exits(0, "38 transitions from 40 rows", "1  lines that repeat the header; first in line 22",
                    Not(HasSubstr("no number"))));
}

TEST_F(ForeignLogTest, ALineOfUnitsIsNoSecondHeader) {
  EXPECT_EQ(Import(header_ + "s,m,m/s,m/s^2\n" + Rows(0, 40)).code, 0);
}

TEST_F(ForeignLogTest, AHeaderMayBeAComment) {
  for (const char* options : {"", "--time time"})
    for (const char* comments : {"# made by hand\n# time,p,v,a\n", "#time,p,v,a\n# s,m,m/s,m/s^2\n"})
      EXPECT_THAT(Import(comments + Rows(0, 20), options), Exits(0, "19 transitions from 20 rows")) << options;
  EXPECT_THAT(Import("# monday, in the hall, two laps, dry\n" + header_ + Rows(0, 20)), Exits(0, "from 20 rows"));
  EXPECT_THAT(Import("# 1,2,3,4\n# hall,wet\n" + Rows(0, 20)), Exits(2, "this line has numbers only"));
}

TEST_F(ForeignLogTest, DecimalCommasAreNamedAndReadIfAskedFor) {
  std::string rows = Rows(0, 20, "{:.1f};{:.4f};{:.2f};1\n");
  std::ranges::replace(rows, '.', ',');
  EXPECT_THAT(Import("time;p;v;a\n" + rows),
              Exits(1, "60  numbers with a decimal comma: give --decimal comma; first in line 2 ('0,0')"));
  EXPECT_THAT(Import("time;p;v;a\n" + rows, "--decimal comma"), Exits(0, "19 transitions from 20 rows"));
  EXPECT_EQ(LoadTransitions(scratch_ / "steps.csv", *LoadConfig(scratch_ / "task.yaml").problem->model).z(1, 0), 0.805);
  EXPECT_THAT(Import("time,p,v,a\n" + Rows(0, 20), "--decimal comma --delimiter comma"),
              Exits(2, "commas separate the fields"));
}

TEST_F(ForeignLogTest, BlanksMaySeparateFields) {
  for (const char* options : {"", "--time time", "--delimiter blank"})
    for (const char* header : {"time p v a\n", "#  time   p v  a \n", "\"time\" p v a\n"})
      EXPECT_THAT(Import(header + Rows(0, 20, "  {:.1f}   {:.4f} {:.2f} 1 \n"), options),
                  Exits(0, "19 transitions from 20 rows"));
  const Output semicolons = Import("time;p;v;a\n" + Rows(0, 20, "{:.1f};{:.4f};{:.2f};1\n"), "--delimiter comma");
  EXPECT_EQ(semicolons.code, 2);
  EXPECT_THAT(semicolons.text, HasSubstr("log.csv:1: the fields seem to be separated by semicolons"));
}

TEST_F(ForeignLogTest, InputsMayBeInALogOfTheirOwn) {
  std::string states = "time,p,v\n", commands = "when,a\n";
  for (int i = 0; i < 40; ++i) states += Row(i, "{:.1f},{:.4f},{:.4f}\n");
  for (int i = 0; i < 9; ++i) commands += fmt::format("{:.2f},1\n", 0.5 * i - 0.05);
  const std::string from = "--inputs-from " + scratch_.Write("commands.csv", commands);
  EXPECT_THAT(Import(states, from + " --inputs-time when"), Exits(0, "39 transitions from 40 rows"));
  EXPECT_THAT(Import(states, from), Exits(2, "commands.csv:1: no column 'time'"));
  EXPECT_THAT(Import(states, from + " --inputs-time when --command-delay 1"), Exits(2, "--inputs-from: has no rows"));
  EXPECT_THAT(Import(states, "--inputs-time when"), Exits(2, "--inputs-time: needs --inputs-from"));
  EXPECT_THAT(Import(states, from + " --rate 10"), Exits(2, "--inputs-from: needs stamps"));
  const std::string commas = " --inputs-from " + scratch_.Write("commas.csv", "time;a\n0,0;1,5\n9,0;1,5\n");
  EXPECT_THAT(Import(states, commas), Exits(1, "4  numbers with a decimal comma: give --decimal comma"));
}

TEST_F(ForeignLogTest, StampsMayBeDatesOrSecondsAndNanoseconds) {
  std::string dates = header_, parts = "sec,nsec,p,v,a\n";
  for (int i = 0; i < 20; ++i) {
    const double t = 0.1 * i, p = 8 * t + t * t / 2, v = 8 + t;
    dates += fmt::format("2026-01-31T23:59:{:04.1f}+01:00,{:.4f},{:.2f},1\n", 58 + t, p, v);
    parts += fmt::format("{},{},{:.4f},{:.2f},1\n", 1'700'000'000 + i / 10, 100'000'000 * (i % 10), p, v);
  }
  EXPECT_THAT(Import(dates), Exits(0, "19 transitions from 20 rows", Not(HasSubstr("off t + dt"))));
  EXPECT_THAT(Import(dates, "--time time --time-unit ms"), Exits(2, "--time-unit: the stamps are dates"));
  EXPECT_THAT(Import(parts, "--time 'seconds_of(sec, nsec)'"),
              Exits(0, "19 transitions from 20 rows", Not(HasSubstr("off t + dt"))));
  EXPECT_THAT(Import(parts, "--time 'seconds_of(sec)'"), Exits(2, "seconds_of(SECONDS,NANOSECONDS)"));
  EXPECT_THAT(Import(parts, "--time 'seconds_of(sec,nano)'"), Exits(2, "no column 'nano'"));
}

TEST_F(ForeignLogTest, StampsThatGoBackAreNamed) {
  std::string rows;
  for (int i = 0; i < 40; ++i) rows += Row(i * 7 % 40);
  EXPECT_THAT(Import(header_ + rows),
              Exits(2, "stamps go back, 6 times, first in line 8", Not(HasSubstr("record faster"))));
}

TEST_F(ForeignLogTest, RowsInReverseHaveToBeSorted) {
  std::string rows;
  for (int i = 20; i > 0; --i) rows += Row(i);
  EXPECT_THAT(Import(header_ + rows), Exits(1, "the most frequent reason: stamps that go backwards", "sort the rows"));
}

TEST_F(ForeignLogTest, FewerThanHalfOfTheRowsAreKeptOnlyIfAskedFor) {
  const auto log = [&](int lost) { return header_ + Rows(0, 20) + Rows(20, 20 + lost, "{:.1f},{:.4f},-,1\n"); };
  const Output half = Import(log(20)), fewer = Import(log(21));
  EXPECT_THAT(half, Exits(0, "20 of 40 rows (50 %) are in no transition"));
  EXPECT_THAT(fewer, Exits(1, "21 of 41 rows (51.2 %) are in no transition", "--keep-few",
                           "write these fields as decimal numbers"));
  std::filesystem::remove(scratch_ / "steps.csv");
  EXPECT_EQ(Import(log(21)).code, 1);
  EXPECT_FALSE(std::filesystem::exists(scratch_ / "steps.csv"));
  EXPECT_EQ(Import(log(21), "--keep-few").code, 0);
  EXPECT_TRUE(std::filesystem::exists(scratch_ / "steps.csv"));
}

TEST_F(ForeignLogTest, RowsThatNobodyWantsDoNotCountAsDropped) {
  EXPECT_EQ(Import(header_ + Rows(0, 60), "--until 1").code, 0);
  EXPECT_EQ(Import(header_ + Row(0) + Row(0) + Row(0) + Row(0) + Row(1)).code, 0);
}

TEST_F(ForeignLogTest, TheShareThatIsDroppedIsSaidInJsonToo) {
  const Output few = Import(header_ + Rows(0, 20) + Rows(20, 60, "{:.1f},{:.4f},-,1\n"), "--json");
  EXPECT_EQ(few.code, 1);
  const Json document = Json::parse(few.text.substr(0, few.text.rfind('}') + 1));
  EXPECT_TRUE(document["out"].is_null());
  EXPECT_THAT(document, Holds({{"rows", 60}, {"rows_used", 20}}));
}

// 0.1 * 3 is not 0.3: stamps and dt are doubles, and their rounding is no distance.
TEST_F(ForeignLogTest, RoundingOfStampsIsNoDistance) {
  EXPECT_THAT(Import(header_ + Rows(0, 60), "--tolerance-ms 0"),
              Exits(0, "59 transitions", Not(HasSubstr("ms off t + dt"))));
  const Output off = Import(header_ + Row(0) + Replaced(Row(1), "0.1,", "0.1000001,") + Row(2));
  EXPECT_THAT(off.text, HasSubstr("Stamps are up to 0.0001 ms off t + dt"));
  EXPECT_EQ(Import(header_ + Row(0) + Replaced(Row(1), "0.1,", "0.1000001,") + Row(2), "--tolerance-ms 0").code, 1);
}

TEST_F(ForeignLogTest, StampsThatJitterAreSaidWithTheToleranceThatTakesThem) {
  std::string rows;
  for (int i = 0; i < 60; ++i) rows += fmt::format("{:.4f},{:.1f},8,1\n", 0.1 * i + (i % 2 == 0 ? 0 : 0.002), 0.8 * i);
  EXPECT_THAT(Import(header_ + rows),
              Exits(1, "60 of 60 rows (100 %) are in no transition", "--tolerance-ms 2 takes half of these starts"));
  const Output taken = Import(header_ + rows, "--tolerance-ms 2");
  EXPECT_THAT(taken, Exits(0, "Stamps are up to 2", "Column dt_error says it of each step"));
  const Transitions steps = LoadTransitions(
      scratch_ / "steps.csv", *LoadConfig(scratch_ / "task.yaml", TransitionsFile::kIgnore).problem->model);
  ASSERT_EQ(steps.longer.size(), steps.size());
  for (const double longer : steps.longer) {
    EXPECT_GT(longer, 0.002 - 1e-12);
    EXPECT_LT(longer, 0.002 + 1e-12);
  }
}

// Of equations that do not say how a state moves with time, the duration of a step says nothing.
TEST_F(ForeignLogTest, WithoutARateTheErrorOfTheStampsIsTheReadersBusiness) {
  const std::string task = Read(scratch_ / "task.yaml");
  scratch_.Write("task.yaml", Replaced(Replaced(task, "dt*v", "0.1*v"), "dt*a", "0.1*a"));
  std::string rows;
  for (int i = 0; i < 20; ++i) rows += fmt::format("{:.4f},{:.1f},8,1\n", 0.1 * i + (i % 2 == 0 ? 0 : 0.002), 0.8 * i);
  EXPECT_THAT(Import(header_ + rows, "--tolerance-ms 2"), Exits(0, "declaration.noise_bound has to include it"));
  EXPECT_THAT(Read(scratch_ / "steps.csv"), Not(HasSubstr("dt_error")));
}

TEST_F(ForeignLogTest, ARowOfDecimalCommasBetweenCommasIsNamed) {
  EXPECT_THAT(Import(header_ + Rows(0, 3) + "0,3,2,4,8,3,1,0\n" + Rows(4, 8)).text,
              HasSubstr("8 fields, the header has 4: twice as many, as if each number had a decimal comma"));
  EXPECT_THAT(Import(header_ + Rows(0, 3) + "0.3,2.4,8.3,1,0\n" + Rows(4, 8)).text, Not(HasSubstr("decimal comma")));
}

// ---- How late commands act: v' = u in steps of 0.15 s, and each command acts one row later.

struct LateRowsTest : ImportCommandTest {
  void Record(bool varies) {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> any(-1, 1);
    std::string log = "time,px,py,vx,vy,ax,ay\n";
    double px = 0, vx = 0, acts = 0.25;
    for (int i = 0; i < 80; ++i) {
      const double ax = varies ? any(random) : 0.25;
      log += fmt::format("{},{},0,{},0,{},0\n", 0.15 * i, px, vx, ax);
      px += 0.15 * vx + 0.15 * 0.15 / 2 * acts;
      vx += 0.15 * acts;
      acts = ax;
    }
    scratch_.Write("log.csv", log);
  }
};

TEST_F(LateRowsTest, IsSaidWithTheErrorByDelayAndMayBeShifted) {
  Record(true);
  const Output said = Import(log_);
  EXPECT_THAT(said, Exits(0, "Commands: by the model's error, commands act 1 row late.\n    0 rows late: px 0.00",
                          "Shift them with --command-delay 1", "`held: u`"));
  EXPECT_THAT(Import("--command-delay auto " + log_), Exits(0, "Each command counts 1 row later."));
  const Problem problem = *LoadConfig(scratch_ / "task.yaml").problem;
  EXPECT_EQ(problem.transitions.size(), 78) << "nothing is known of the first row's command";
  for (Eigen::Index i = 0; i < problem.transitions.size(); ++i)
    EXPECT_NEAR(problem.transitions.x_next(i, 2) - problem.transitions.z(i, 2), 0.15 * problem.transitions.z(i, 4),
                1e-9);
  const Json json = Json::parse(
      Forereach("import --json --command-delay 1 --config " + scratch_ / "task.yaml" + " --out " + out_ + " " + log_)
          .text);
  EXPECT_EQ(json["shifted_by"], 1);
  EXPECT_TRUE(json["command_delay"].is_null()) << "it was said";
}

// With what the robot obeys as a state, its model is exact, and no delay is left.
TEST_F(LateRowsTest, IsModelledByAStateThatHoldsTheLastCommand) {
  scratch_.Write("task.yaml",
                 TaskFor("model: {states: {vx: m/s, held: m/s^2}, inputs: {ax: m/s^2}, parameters: {dt: 0.15}, next: "
                         "{vx: vx + dt*held, held: ax}, set_at_steps: [held]}\n",
                         2, 1, "vx"));
  scratch_.Write("task.yaml", Replaced(Replaced(Read(scratch_ / "task.yaml"), "lower: [-1, -1]", "lower: [-9, -9]"),
                                       "upper: [1, 1]", "upper: [9, 9]"));
  Record(true);
  EXPECT_THAT(Import("--held held=ax " + log_), Exits(0, "import: 78 transitions", "commands act at once"));
  const Transitions steps =
      LoadTransitions(out_, *LoadConfig(scratch_ / "task.yaml", TransitionsFile::kIgnore).problem->model);
  for (Eigen::Index i = 0; i < steps.size(); ++i) {
    EXPECT_NEAR(steps.x_next(i, 0), steps.z(i, 0) + 0.15 * steps.z(i, 1), 1e-9) << i;
    EXPECT_EQ(steps.x_next(i, 1), steps.z(i, 2)) << i;
    if (i > 0) EXPECT_EQ(steps.z(i, 1), steps.z(i - 1, 2)) << i;
  }
  EXPECT_THAT(Import("--held held=bx " + log_), Exits(2, "--held: the model has no input 'bx'"));
  EXPECT_THAT(Import("--held bx=ax " + log_), Exits(2, "--held: the model has no 'bx'"));
  EXPECT_THAT(Import("--held held=ax --inputs-from " + log_ + " " + log_), Exits(2, "has to be one table"));
  EXPECT_THAT(Import(log_), Exits(2, "no column 'held'"));
}

// Rows of half a step, a lost one, and one too early: what was sent one step before is that of its time.
TEST_F(LateRowsTest, AHeldCommandIsThatOfOneStepBefore) {
  scratch_.Write("task.yaml",
                 TaskFor("model: {states: {p: m, held: m/s}, inputs: {u: m/s}, parameters: {dt: 0.2}, next: "
                         "{p: p + dt*held, held: u}, set_at_steps: [held]}\n",
                         2, 1, "p"));
  scratch_.Write("log.csv",
                 "time,p,u\n0,0,0.1\n0.1,0,0.1\n0.2,0,0.2\n0.3,0,0.2\n0.4,0,0.3\n0.5,0,0.3\n0.6,0,-\n0.7,0,0.5\n"
                 "0.8,0,0.5\n0.9,0,0.6\n1.0,0,0.6\n1.1,0,0.6\n");
  EXPECT_EQ(Import("--held held=u --keep-few " + log_).code, 0);
  EXPECT_EQ(Read(out_), "p,held,u,p_next,held_next\n0,0.1,0.2,0,0.2\n0,0.2,0.3,0,0.3\n0,0.5,0.6,0,0.6\n");
}

TEST_F(LateRowsTest, CannotBeToldWhereTheInputDoesNotVary) {
  Record(false);
  EXPECT_THAT(Import(log_).text, HasSubstr("how late commands act cannot be told: the inputs vary too little"));
  EXPECT_THAT(Import("--command-delay auto " + log_),
              Exits(2, "--command-delay: auto: how late commands act cannot be told"));
  EXPECT_THAT(Import("--command-delay 1.5 " + log_).text, HasSubstr("'1.5' is no whole number of rows, nor auto"));
}

}  // namespace forereach::import_test
