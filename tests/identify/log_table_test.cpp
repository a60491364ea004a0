// Logs as they come: what is read of them, what is left out, and what is refused.
#include "identify/log_table.h"

#include "tests/test.h"

#include <Eigen/Geometry>

#include "forereach/numerics/text.h"
#include "task/config_error.h"
#include "tests/identify/seed.h"

namespace forereach::log_table_test {

struct LogTableTest : testing::Test {
  LogTable Table(const std::string& text, const LogFormat& format = {}) {
    return ReadLog(files_.Write("log.csv", text), {"t", "pos x"}, format);
  }
  std::string Error(const std::string& text, const LogFormat& format = {}) {
    return files_.Cut(Thrown<ConfigError>([&] { (void)Table(text, format); }));
  }
  ScratchDirectory files_;
};

TEST_F(LogTableTest, ColumnsAreFoundByNameAndTheOthersMayHoldAnything) {
  for (const char* text : {"t,pos x,mode\n1,2,auto\n3,-4,\"a,b\"\n", "mode;\"pos x\";t\nauto;2;1\n\"a;\"\"b\";-4;3",
                           "t\tpos x\n1\t2\n3\t-4\n", " t , pos x \r\n1, 2 \r\n\r\n3 ,-4\r\n",
                           "\xef\xbb\xbf# a comment\n\nt,pos x\n1,2\n  # another\n3,-4\n"}) {
    const LogTable table = Table(text);
    ASSERT_EQ(table.values.rows(), 2) << text;
    EXPECT_EQ(table.values, (Eigen::Matrix2d() << 1, 2, 3, -4).finished()) << text;
    EXPECT_EQ(table.lost.count, 0);
  }
}

TEST_F(LogTableTest, LinesAreCountedAsAnEditorCountsThem) {
  const LogTable table = Table("# made by hand\nt,pos x,note\n\n1,2,\"two\nlines\"\n# here\n\n3,4,one\n");
  EXPECT_THAT(table.lines, ElementsAre(4, 8));
  EXPECT_FIELDS(table, (blank.count, 2), (blank.first_line, 3), (comments.count, 2), (comments.first_line, 1));
}

TEST_F(LogTableTest, AFieldThatIsNoNumberIsNanAndCounted) {
  const LogTable table = Table("t,pos x\n1,2\n2,nan\n3,\n4,inf\n5,1.5m\n6,1e999\n7,0x10\n8,\"7\"\n9,1 2\n");
  ASSERT_EQ(table.values.rows(), 9);
  EXPECT_FIELDS(table, (not_a_number[0].count, 0), (not_a_number[1].count, 7), (not_a_number[1].first_line, 3),
                (not_a_number[1].first, "nan"));
  for (const int row : {1, 2, 3, 4, 5, 6, 8}) EXPECT_TRUE(std::isnan(table.values(row, 1))) << row;
  EXPECT_EQ(table.values(7, 1), 7) << "quotes do not make it less of a number";
}

TEST_F(LogTableTest, AZeroInFrontOrAPlusMakesItNoLessOfANumber) {
  const LogTable table = Table("t,pos x\n007,08.00\n+4.0,-03.5\n00,-00\n000.5,+01e2\n0x8,0-8\n-+01,--01\n");
  EXPECT_EQ(table.values.topRows(4), (Eigen::Matrix<double, 4, 2>() << 7, 8, 4, -3.5, 0, 0, 0.5, 100).finished());
  EXPECT_TRUE(table.values.bottomRows(2).array().isNaN().all());
}

TEST_F(LogTableTest, ARowWithOtherFieldsThanTheHeaderIsLostAndSaid) {
  const LogTable table = Table("t,pos x\n1,2\n2\n3,4\n4,5,6\n5,\"a\"b\n6,7\n7,8");
  EXPECT_THAT(table.lines, ElementsAre(2, 4, 7, 8));
  EXPECT_FIELDS(table.lost, (count, 3), (first_line, 3), (first, "1 fields, the header has 2"));
  EXPECT_THAT(table.after_loss, ElementsAre(false, true, true, false));
  EXPECT_THAT(Table("t,pos x\n1,2,\n").lost.first, EndsWith("the last is empty, as if a separator ended the row; end "
                                                            "the header so, too"));
  EXPECT_EQ(Table("t,pos x,\n1,2,\n").values.rows(), 1);
}

// A row that was cut off and the next one, whose line ends are others, are not one row.
TEST_F(LogTableTest, ACarriageReturnInsideARowEndsIt) {
  const LogTable table = Table("t,pos x\r\n1\r2\n3,4\r\n\r\n5\r,6\r\n\"7\r\",8\n9,10\r");
  EXPECT_THAT(table.lines, ElementsAre(3, 6, 7));
  EXPECT_FIELDS(table.lost, (count, 2), (first_line, 2), (first, "a carriage return inside a row"));
  EXPECT_EQ(Error("t,pos x\r1,2\r3,4\r"),
            "log.csv:1: the names of the columns: a carriage return inside a row; `tr '\\r' '\\n'` makes lines of it");
  EXPECT_EQ(Error("t,\"pos\"x\n1,2\n"), "log.csv:1: the names of the columns: quotes inside a field");
}

TEST_F(LogTableTest, RefusesALogWhoseColumnsAreNotClear) {
  EXPECT_EQ(Error("t,pos y\n1,2\n"), "log.csv:1: no column 'pos x'; did you mean pos y?");
  EXPECT_EQ(Error("\n1,2\n3,4\n"),
            "log.csv:2: this line has numbers only, so no column has a name; give the names with --header");
  EXPECT_EQ(Error("t,t,pos x\n"), "log.csv:1: 2 columns are named 't'");
  EXPECT_EQ(Error("t;pos x,y\n"), "log.csv:1: the fields may be separated by ; or by ,; say which it is");
  EXPECT_EQ(Error("t,pos x\n1,\"2\n3,4\n"), "log.csv:2: a quoted field begins in this row and does not end");
  EXPECT_THAT(Error(""), HasSubstr("no line that names the columns"));
  EXPECT_THAT(Error("# t,pos x\n"), HasSubstr("no line that names the columns"));
  std::string text = "t,pos x\n";
  text.append(2 << 20, '1');
  EXPECT_THAT(Error(text), HasSubstr("log.csv:2: longer than 1048576 bytes"));
}

TEST_F(LogTableTest, WhatIsNoTextIsNamedWithWhatMakesOneOfIt) {
  using namespace std::string_literals;
  for (const auto& [bytes, why] : {std::pair("#ROSBAG V2.0\n\x45\0"s, "is a bag of ROS 1; `rosbags-convert`"),
                                   {"SQLite format 3\0"s, "ros2 bag"},
                                   {"\x89MCAP0\r\n"s, "end in .mcap"},
                                   {"\xed\xa1\xda\x01\0"s, "--lcm-types"},
                                   {"\x1f\x8b\x08"s, "gunzip"},
                                   {"\x28\xb5\x2f\xfd"s, "unzstd"},
                                   {"PK\3\4"s, "zip"},
                                   {"PAR1"s, "Parquet"},
                                   {"\xff\xfet\0,\0x\0\n\0"s, "UTF-16"},
                                   {"\xfe\xff\0t"s, "UTF-16"},
                                   {"t,x\0\n1,2\n"s, "a zero byte"}})
    EXPECT_THAT(Error(bytes), AllOf(StartsWith("log.csv: is "), HasSubstr(why)));
}

TEST_F(LogTableTest, TakesAGivenFormat) {
  EXPECT_EQ(Table("1,2\n3,4\n", {.header = {"t", "pos x"}}).values.rows(), 2);
  EXPECT_EQ(Table("% x\nt;pos x\n1;2\n", {.delimiter = ';', .comment = "%"}).values.rows(), 1);
  EXPECT_EQ(Table("t,pos x\n#,2\n", {.comment = ""}).not_a_number[0].count, 1);
  EXPECT_THAT(Error("t;pos x,y\n1;2\n", {.delimiter = ','}), HasSubstr("log.csv:1: no column 't'"));
}

TEST_F(LogTableTest, ADateIsItsSecondsSince1970) {
  const auto seconds = [&](const std::string& date) { return Table("t,pos x\n\"" + date + "\",0\n").values(0, 0); };
  EXPECT_EQ(seconds("1970-01-01T00:00:00Z"), 0);
  EXPECT_EQ(seconds("2026-01-31T12:34:56.25Z"), 1769862896.25);
  EXPECT_EQ(seconds("2026-01-31 12:34:56,25"), 1769862896.25) << "UTC";
  EXPECT_EQ(seconds("2026-01-31T13:34:56.25+01:00"), 1769862896.25);
  EXPECT_EQ(seconds("2026-01-31T11:04:56.25-0130"), 1769862896.25);
  EXPECT_EQ(seconds("20260131T133456.25+0100"), 1769862896.25);
  EXPECT_EQ(seconds("1969-12-31T23:59:59Z"), -1);
  EXPECT_EQ(seconds("2024-02-29T00:00:00Z") + 86400, seconds("2024-03-01T00:00:00Z"));
  for (const char* none : {"2026-02-29T00:00:00Z", "2026-01-31", "2026-01-31T24:00:00Z", "2026-13-01T00:00:00Z",
                           "2026-01-31T12:00", "2026-01-31T12:00:00.Z", "2026-01-31T12:00:00+1", "26-01-31T12:00:00Z",
                           "2026-01-31T12:00:00 Z", "20260131T12:00:00Z", "2026-01-31T120000Z", "202601-31T120000Z"})
    EXPECT_TRUE(std::isnan(seconds(none))) << none;
  EXPECT_EQ(Table("t,pos x\n2026-01-31T12:34:56Z,0\n").dates.count, 1);
}

TEST_F(LogTableTest, AYawIsMadeOfAQuaternion) {
  const auto yaw = [&](double roll, double pitch, double angle, double scale) {
    const Eigen::Quaterniond q = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()) *
                                 Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) *
                                 Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX());
    const std::string path =
        files_.Write("q.csv", "w,x,y,z\n" + ToText(scale * q.w()) + "," + ToText(scale * q.x()) + "," +
                                  ToText(scale * q.y()) + "," + ToText(scale * q.z()) + "\n");
    return ReadLog(path, {"yaw_of(x, y,z,w)", "yaw_of(z,w)"}, {}).values;
  };
  for (const double angle : {-3.0, -1.0, 0.0, 0.5, 3.1}) {
    EXPECT_NEAR(yaw(0, 0, angle, 1)(0), angle, 1e-12);
    EXPECT_NEAR(yaw(0, 0, angle, -1.004)(1), angle, 1e-12) << "the negative is the same turn";
    EXPECT_NEAR(yaw(0.3, -0.4, angle, 1)(0), angle, 1e-12);
  }
  EXPECT_TRUE(std::isnan(yaw(0, 0, 1, 1.02)(0)));
  EXPECT_TRUE(std::isnan(yaw(0.3, 0, 1, 1)(1))) << "it is no turn about z alone";
  EXPECT_THAT(Thrown<ConfigError>([&] { (void)ReadLog(files_.Write("q.csv", "w,x\n1,2\n"), {"yaw_of(x)"}, {}); }),
              HasSubstr("yaw_of(qz,qw)"));
}

// Any bytes give a table or an error, and a table has as many numbers as it says.
TEST_F(LogTableTest, AnyBytesAreReadOrRefused) {
  const unsigned seed = SeedOf(1);
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  const std::string letters = "t,pos x\n\n\"\"12.;e#\r\t\x01\xff";
  for (int trial = 0; trial < 300; ++trial) {
    std::string text = "t,pos x\n";
    for (auto size = random() % 60; size > 0; --size) text += letters[random() % letters.size()];
    try {
      const LogTable table = Table(text);
      ASSERT_EQ(table.values.rows(), std::ssize(table.lines));
      ASSERT_EQ(table.after_loss.size(), table.lines.size());
      ASSERT_TRUE(std::ranges::is_sorted(table.lines)) << text;
    } catch (const ConfigError&) {
    }
  }
}

}  // namespace forereach::log_table_test
