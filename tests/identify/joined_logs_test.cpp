// Two logs at two rates, joined by stamp: which command holds when, and what is not known.
#include "identify/joined_logs.h"

#include "tests/test.h"

#include <fmt/format.h>

#include "forereach/numerics/text.h"
#include "identify/import.h"
#include "task/config_error.h"
#include "tests/worlds.h"

namespace forereach::joined_logs_test {

struct JoinedLogsTest : testing::Test {
  LogTable Join(const std::string& states, const std::string& commands) {
    return Joined(ReadLog(files_.Write("states.csv", "t,x\n" + states), {"t", "x"}, {}),
                  ReadLog(files_.Write("commands.csv", "t,u\n" + commands), {"t", "u"}, {}));
  }
  // "t x u" of each row, "-" for what is not known.
  static std::string Rows(const LogTable& table) {
    std::string text;
    for (Eigen::Index row = 0; row < table.values.rows(); ++row) {
      for (const double value : table.values.row(row)) text += (std::isnan(value) ? "-" : ToText(value)) + " ";
      text.back() = table.HasStates(row) ? ';' : '*';
    }
    return text;
  }
  ScratchDirectory files_;
};

TEST_F(JoinedLogsTest, ACommandHoldsUntilTheNextOne) {
  const LogTable table = Join("0,1\n1,2\n2,3\n3,4\n", "-1,7\n0.5,8\n2,9\n2.5,6\n9,5\n");
  EXPECT_EQ(Rows(table), "0 1 7;0.5 - 8*1 2 8;2 3 9;2.5 - 6*3 4 6;");
  EXPECT_EQ(table.num_rows(), 4);
  EXPECT_THAT(table.lines, ElementsAre(2, 3, 3, 4, 5, 5));
}

TEST_F(JoinedLogsTest, WhatHeldIsNotGuessed) {
  EXPECT_EQ(Rows(Join("0,1\n1,2\n", "0.5,7\n9,1\n")), "0 1 -;0.5 - 7*1 2 7;") << "before the first";
  EXPECT_EQ(Rows(Join("0,1\n1,2\n", "-1,7\n0,6\n")), "0 1 -;1 2 -;") << "behind the last";
  EXPECT_EQ(Rows(Join("0,1\n1,2\n", "0,7\n0,6\n9,1\n")), "0 1 -;1 2 -;") << "two commands of one stamp";
  EXPECT_EQ(Rows(Join("0,1\n1,2\n", "0,7\n0,7\n9,1\n")), "0 1 7;1 2 7;");
  EXPECT_EQ(Rows(Join("0,1\n1,2\n2,3\n", "0,7\n0.5\n1.5,6\n9,1\n")), "0 1 -;1 2 -;1.5 - 6*2 3 6;") << "a lost row";
  EXPECT_EQ(Rows(Join("0,1\n1,2\n2,3\n", "0,7\n?,8\n1.5,6\n9,1\n")), "0 1 -;1 2 -;1.5 - 6*2 3 6;") << "no stamp";
  EXPECT_EQ(Rows(Join("0,1\n?,2\n2,3\n", "0,7\n9,1\n")), "0 1 7;- 2 7;2 3 7;");
  EXPECT_EQ(Rows(Join("0,1\n", "")), "0 1 -;");
}

TEST_F(JoinedLogsTest, StampsThatGoBackAreRefused) {
  EXPECT_THAT(files_.Cut(Thrown<ConfigError>([&] { (void)Join("0,1\n", "1,7\n0.5,8\n"); })),
              HasSubstr("commands.csv:3: the stamps go back"));
  EXPECT_THAT(files_.Cut(Thrown<ConfigError>([&] { (void)Join("1,1\n0,1\n", "1,7\n"); })),
              HasSubstr("states.csv:3: the stamps go back"));
}

// A log of commands at 20 Hz and states at 10 Hz is the same run as the one log of all stamps.
TEST_F(JoinedLogsTest, TransitionsKnowWhatHappensBetweenTheirEnds) {
  const Problem problem = WorldOf(MakePointMass(0.1), Within({9, 9, 3, 3}), Within({1, 1}));
  std::string states = "t,px,py,vx,vy\n", commands = "t,ax,ay\n";
  for (int i = 0; i <= 20; ++i) states += fmt::format("{},{},0,1,0\n", 0.1 * i, 0.1 * i);
  for (int i = 0; i <= 50; ++i)
    commands += fmt::format("{},{},0\n", 0.05 * i, i == 7 || i == 8 ? 0.5 : i > 20 ? 0.25 : 0);
  const LogTable table = Joined(ReadLog(files_.Write("s.csv", states), {"t", "px", "py", "vx", "vy"}, {}),
                                ReadLog(files_.Write("c.csv", commands), {"t", "ax", "ay"}, {}));
  ImportOptions options{.period = 0.1, .tolerance = 1e-3};
  options.factors.assign(6, 1);
  options.input_tolerance = Eigen::Vector2d::Zero();
  const ImportedLog log = Import(table, problem, options);
  EXPECT_FIELDS(log, (samples, 21), (rows, 21));
  EXPECT_NEAR(log.typical_spacing, 0.1, 1e-9);
  EXPECT_EQ(log.At(Dropped::kInputChanges).count, 3) << "from 0.3, 0.4 and 1.0 s";
  EXPECT_EQ(log.At(Dropped::kNoState).count, 0);
  EXPECT_EQ(log.transitions.size(), 17);
  options.input_mean = true;
  const ImportedLog mean = Import(table, problem, options);
  ASSERT_EQ(mean.transitions.size(), 20);
  EXPECT_EQ(mean.rows_used, 21);
  EXPECT_NEAR(mean.transitions.z(3, 4), 0.25, 1e-9);
  EXPECT_NEAR(mean.transitions.z(4, 4), 0.25, 1e-9);
  EXPECT_NEAR(mean.transitions.z(10, 4), 0.125, 1e-9);
}

}  // namespace forereach::joined_logs_test
