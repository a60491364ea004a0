// LCM logs of others: this project's own types, read from their .lcm files, judge fingerprints and numbers.
#include "identify/lcm_table.h"

#include "tests/test.h"

#include <fmt/format.h>

#include "records/event_log.h"
#include "task/config_error.h"
#include "tests/messages.h"
#include "tests/paths.h"

namespace forereach::lcm_table_test {

struct LcmTableTest : testing::Test {
  LcmTableTest() {
    for (const auto& entry : std::filesystem::directory_iterator(FOREREACH_SOURCE_DIR "/lcmtypes"))
      if (entry.path().extension() == ".lcm") types_.Add(entry.path().string());
  }
  static obstacles_t Obstacles(std::int64_t utime, double value) {
    obstacles_t message{.utime = utime, .num_obstacles = -3};
    message.obstacle[1].shape.point[2][1] = value;
    return message;
  }
  std::string WhyNoType(const std::string& text) {
    return Thrown<ConfigError>([&] { LcmTypes().AddText("a.lcm", text); });
  }
  LcmTypes types_;
  ScratchDirectory files_;
};

TEST_F(LcmTableTest, FingerprintsAreThoseOfTheGeneratedTypes) {
  EXPECT_EQ(types_.TypeOf(Encode(obstacles_t{})), "forereach.obstacles_t") << "it has other types in it";
  EXPECT_EQ(types_.TypeOf(Encode(robot_state_t{})), "forereach.robot_state_t");
  EXPECT_EQ(types_.TypeOf({}), std::nullopt);
}

TEST_F(LcmTableTest, RowsAreTheMessagesOfAChannel) {
  const std::string path = files_ / "run.lcmlog";
  {
    EventLogWriter log(path);
    log.Append(1'000'000, "SEEN", Encode(Obstacles(5, 0.25)));
    log.Append(1'500'000, "OTHER", Encode(robot_state_t{}));
    std::vector<std::uint8_t> cut = Encode(Obstacles(6, 1));
    cut.pop_back();
    log.Append(1'600'000, "SEEN", cut);
    log.Append(2'250'000, "SEEN", Encode(Obstacles(7, -1e300)));
    ASSERT_TRUE(log.Flush());
  }
  const LogTable table =
      ReadLcmLog(path, {"recorded", "SEEN.utime", "SEEN.num_obstacles", "SEEN.obstacle[1].shape.point[2][1]"}, types_);
  ASSERT_EQ(table.values.rows(), 2);
  EXPECT_EQ(table.values, (Eigen::MatrixXd(2, 4) << 1, 5, -3, 0.25, 2.25, 7, -3, -1e300).finished());
  EXPECT_THAT(table.lines, ElementsAre(1, 3));
  EXPECT_EQ(table.lost.count, 1);
  EXPECT_THAT(table.after_loss, ElementsAre(false, true));
  const auto why = [&](const std::vector<std::string>& wanted, const LcmTypes& types) {
    return Thrown<ConfigError>([&] { (void)ReadLcmLog(path, wanted, types); });
  };
  EXPECT_THAT(why({"SEEN.speed"}, types_), HasSubstr("type forereach.obstacles_t has no number speed"));
  EXPECT_THAT(why({"SEEN.obstacle"}, types_), HasSubstr("has no number obstacle"));
  EXPECT_THAT(why({"SEEN.utime", "OTHER.utime"}, types_), HasSubstr("columns of two channels, SEEN and OTHER"));
  EXPECT_THAT(why({"HEARD.utime"}, types_), HasSubstr("has no message on HEARD; its channels are OTHER, SEEN"));
  EXPECT_THAT(why({"SEEN.utime"}, {}), HasSubstr("give --lcm-types"));
  EXPECT_THAT(why({"utime"}, types_), HasSubstr("has to be CHANNEL.field"));
}

TEST_F(LcmTableTest, LengthsInMessagesAreBounded) {
  LcmTypes types;
  types.AddText(
      "a.lcm",
      "/* of\n others */ package p;\nstruct nothing {}\nstruct a { const int32_t N = 2, M = 3; int32_t n; string s;\n"
      "  float v[n], w[N]; nothing e[n]; byte b; } // end");
  const auto read = [&](const std::vector<std::uint8_t>& content) {
    std::vector<std::uint8_t> message(8);
    message.insert(message.end(), content.begin(), content.end());
    return types.Read("p.a", {"v[0]", "w[1]", "b"}, message);
  };
  const auto values = read({0, 0, 0, 1, 0, 0, 0, 2, 'x', 0, 0x3f, 0x80, 0, 0, 0, 0, 0, 0, 0xc0, 0, 0, 0, 200}).value();
  EXPECT_THAT(values, ElementsAre(1, -2, 200));
  EXPECT_FALSE(read({0xff, 0xff, 0xff, 0xff, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0})) << "a negative size";
  EXPECT_FALSE(read({0, 0, 0, 0, 0xff, 0xff, 0xff, 0xff, 0})) << "a string longer than the message";
  EXPECT_FALSE(read({0, 0, 0, 0})) << "cut off";
  EXPECT_FALSE(types.Read("p.a", {}, {}));
}

// Two of the next type in each: 2^24 in all. And each in the next.
TEST_F(LcmTableTest, TypesThatNestTooMuchAreRefused) {
  const auto why = [](int count, int copies) {
    std::string text;
    for (int i = 0; i < count; ++i) {
      text += fmt::format("struct t{} {{", i);
      for (int copy = 0; copy < copies; ++copy) text += fmt::format(" t{} m{};", i + 1, copy);
      text += " }\n";
    }
    LcmTypes types;
    types.AddText("a.lcm", text + fmt::format("struct t{} {{ int8_t x; }}\n", count));
    return Thrown<ConfigError>([&] { static_cast<void>(types.TypeOf(Encode(robot_state_t{}))); });
  };
  EXPECT_THAT(why(24, 2), HasSubstr("type t0 nests too much"));
  EXPECT_THAT(why(20'000, 1), HasSubstr("type t0 nests too much"));
  EXPECT_EQ(why(31, 1), "");
}

TEST_F(LcmTableTest, WhatIsNoTypeIsRefusedWithItsLine) {
  EXPECT_THAT(WhyNoType("struct a {\n int8_t x[y];\n}"), HasSubstr("a.lcm:2: 'y' is no size, and no member before it"));
  EXPECT_THAT(WhyNoType("struct a {\n int8_t x"), HasSubstr("'' stands where ; has to be"));
  EXPECT_THAT(WhyNoType("enum a {}"), HasSubstr("'enum' is neither package nor struct"));
  EXPECT_THAT(WhyNoType("struct a {} struct a {}"), HasSubstr("a is defined twice"));
  EXPECT_THAT(WhyNoType("struct a { int8_t 7; }"), HasSubstr("'7' is no name"));
  EXPECT_THAT(WhyNoType("/*"), IsEmpty());
  LcmTypes types;
  types.AddText("a.lcm", "struct a { b x; }");
  EXPECT_THAT(Thrown<ConfigError>([&] { (void)types.TypeOf(Bytes()); }), HasSubstr("uses b, which no given .lcm file"));
}

}  // namespace forereach::lcm_table_test
