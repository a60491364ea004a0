// MCAP files of others, written here by hand: JSON and ROS 2, plain and compressed, whole, cut and damaged.
#include "identify/mcap_table.h"

#include <lz4frame.h>
#include <zstd.h>

#include <bit>
#include <concepts>

#include <fmt/format.h>

#include "identify/ros_type.h"
#include "records/mcap.h"
#include "records/mcap_format.h"
#include "task/config_error.h"
#include "tests/test.h"

namespace forereach::mcap_table_test {

void Put(std::string& out, std::unsigned_integral auto value) {
  for (std::size_t i = 0; i < sizeof value; ++i) out.push_back(static_cast<char>(value >> (8 * i) & 0xff));
}
void Put(std::string& out, const std::string& text) {
  Put(out, static_cast<std::uint32_t>(text.size()));
  out += text;
}
template <class... Field>
std::string BytesOf(const Field&... fields) {
  std::string bytes;
  (Put(bytes, fields), ...);
  return bytes;
}
std::string Record(int opcode, const std::string& content) {
  return static_cast<char>(opcode) + BytesOf(std::uint64_t{content.size()}) + content;
}

std::string Schema(std::uint16_t id, const std::string& name, const std::string& encoding, const std::string& text) {
  return Record(3, BytesOf(id, name, encoding, text));
}
std::string Channel(std::uint16_t id, std::uint16_t schema, const std::string& topic, const std::string& encoding) {
  return Record(4, BytesOf(id, schema, topic, encoding, std::string()));
}
std::string Message(std::uint16_t channel, double time_s, const std::string& data) {
  const auto ns = static_cast<std::uint64_t>(time_s * 1e9);
  return Record(5, BytesOf(channel, std::uint32_t{0}, ns, ns) + data);
}
std::string Packed(const std::string& compression, const std::string& bytes) {
  if (compression.empty()) return bytes;
  std::string packed(2 * bytes.size() + 1000, '\0');
  packed.resize(compression == "zstd"
                    ? ZSTD_compress(packed.data(), packed.size(), bytes.data(), bytes.size(), 3)
                    : LZ4F_compressFrame(packed.data(), packed.size(), bytes.data(), bytes.size(), nullptr));
  return packed;
}
std::string Chunk(const std::string& compression, const std::string& records, int crc_off = 0, int size_off = 0) {
  const std::string packed = Packed(compression, records);
  return Record(6, BytesOf(std::uint64_t{0}, std::uint64_t{0},
                           static_cast<std::uint64_t>(static_cast<std::int64_t>(records.size()) + size_off),
                           mcap::Crc(0, records) + static_cast<std::uint32_t>(crc_off), compression,
                           std::uint64_t{packed.size()}) +
                       packed);
}
std::string File(const std::string& records) {
  return std::string(mcap::kMagic) + Record(1, BytesOf(std::string("ros2"), std::string("by hand"))) + records +
         Record(15, BytesOf(std::uint32_t{0})) + Record(2, std::string(20, '\0')) + std::string(mcap::kMagic);
}

// As ROS 2 writes it.
class Cdr {
 public:
  explicit Cdr(bool is_little = true) : is_little_(is_little) {}

  Cdr& Text(const std::string& text) {
    Int(static_cast<std::uint32_t>(text.size() + 1));
    bytes_ += text + '\0';
    return *this;
  }
  template <std::unsigned_integral Number>
  Cdr& Int(Number value) {
    while (bytes_.size() % sizeof value != 0) bytes_ += '\0';
    std::string little;
    Put(little, value);
    if (!is_little_) std::ranges::reverse(little);
    bytes_ += little;
    return *this;
  }
  Cdr& Doubles(const std::vector<double>& values) {
    for (const double value : values) Int(std::bit_cast<std::uint64_t>(value));
    return *this;
  }
  [[nodiscard]] std::string bytes() const { return std::string{'\0', is_little_ ? '\1' : '\0', '\0', '\0'} + bytes_; }

 private:
  std::string bytes_;
  bool is_little_;
};

const std::string kLine = "================================================================================\n";
const std::string kVector3 = kLine + "MSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n";
const std::string kHeader = kLine +
                            "MSG: std_msgs/Header\n# who and when\nbuiltin_interfaces/Time stamp\nstring frame_id\n" +
                            kLine + "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";
const std::string kTwistText = "# in free space\nVector3  linear\nVector3  angular\n";
const std::string kTwist = kTwistText + kVector3;
const std::string kTwistStamped =
    "std_msgs/Header header\nTwist twist\n" + kHeader + kLine + "MSG: geometry_msgs/Twist\n" + kTwist;
const std::string kOdometry =
    "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/PoseWithCovariance pose\n"
    "geometry_msgs/TwistWithCovariance twist\n" +
    kHeader + kLine + "MSG: geometry_msgs/PoseWithCovariance\nPose pose\nfloat64[36] covariance\n" + kLine +
    "MSG: geometry_msgs/Pose\nPoint position\nQuaternion orientation\n" + kLine +
    "MSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z\n" + kLine +
    "MSG: geometry_msgs/Quaternion\nfloat64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n" + kLine +
    "MSG: geometry_msgs/TwistWithCovariance\nTwist twist\nfloat64[36] covariance\n" + kLine +
    "MSG: geometry_msgs/Twist\n" + kTwist;

std::string OdometryAt(std::uint32_t sec, double x, double yaw, double speed, bool is_little = true) {
  Cdr cdr(is_little);
  cdr.Int(sec).Int(std::uint32_t{500'000'000}).Text("odom").Text("base_link");
  cdr.Doubles({x, -x, 0, 0, 0, std::sin(yaw / 2), std::cos(yaw / 2)}).Doubles(std::vector<double>(36, 7));
  return cdr.Doubles({speed, 0, 0, 0, 0, 0.25}).Doubles(std::vector<double>(36)).bytes();
}

struct McapTableTest : testing::Test {
  LogTable Table(const std::string& file, const std::vector<std::string>& wanted) const {
    return ReadMcapLog(scratch_.Write("run.mcap", file), wanted);
  }
  std::string WhyNot(const std::string& file, const std::vector<std::string>& wanted) const {
    return Thrown<ConfigError>([&] { static_cast<void>(Table(file, wanted)); });
  }
  static std::string Described() {
    return Schema(1, "nav_msgs/msg/Odometry", "ros2msg", kOdometry) + Channel(1, 1, "/odom", "cdr") +
           Schema(2, "geometry_msgs/msg/Twist", "ros2msg", kTwist) + Channel(2, 2, "/cmd_vel", "cdr") +
           Schema(3, "geometry_msgs/msg/TwistStamped", "ros2msg", kTwistStamped) + Channel(3, 3, "/stamped", "cdr");
  }
  const std::vector<std::string> odometry_{"seconds_of(/odom.header.stamp.sec,/odom.header.stamp.nanosec)",
                                           "/odom.pose.pose.position.y",
                                           "yaw_of(/odom.pose.pose.orientation.z,/odom.pose.pose.orientation.w)",
                                           "/odom.twist.twist.linear.x",
                                           "/odom.twist.twist.angular.z",
                                           "/odom.pose.covariance[35]",
                                           "recorded"};
  ScratchDirectory scratch_;
};

TEST_F(McapTableTest, OdometryAndTwistsOfRos2AreRead) {
  const std::string messages = Message(1, 10, OdometryAt(3, 1.5, 0.5, 2)) +
                               Message(2, 10.25, Cdr().Doubles({1, 2, 3, 4, 5, 6}).bytes()) +
                               Message(3, 10.5, Cdr().Int(9u).Int(8u).Text("x").Doubles({6, 5, 4, 3, 2, 1}).bytes()) +
                               Message(1, 11, OdometryAt(4, -0.5, -3, -1, false));
  for (const char* compression : {"", "lz4", "zstd"}) {
    SCOPED_TRACE(compression);
    const std::string file = File(Chunk(compression, Described()) + Chunk(compression, messages));
    const LogTable table = Table(file, odometry_);
    ASSERT_EQ(table.values.rows(), 2);
    EXPECT_TRUE(table.values.isApprox(
        (Eigen::MatrixXd(2, 7) << 3.5, -1.5, 0.5, 2, 0.25, 7, 10, 4.5, 0.5, -3, -1, 0.25, 7, 11).finished(), 1e-12))
        << table.values;
    EXPECT_EQ(table.lost.count, 0);
    EXPECT_EQ(Table(file, {"/cmd_vel.angular.z", "/cmd_vel.linear.y"}).values, Eigen::RowVector2d(6, 2));
    EXPECT_EQ(Table(file, {"/stamped.header.stamp.nanosec", "/stamped.twist.angular.x"}).values,
              Eigen::RowVector2d(8, 3));
  }
  EXPECT_EQ(Table(File(Described() + messages), odometry_).values.rows(), 2) << "without chunks";
  EXPECT_THAT(WhyNot(File(Described() + messages), {"/odom.pose.x"}),
              AllOf(HasSubstr("run.mcap: /odom: nav_msgs/Odometry has no pose.x; there are pose, covariance")));
  EXPECT_THAT(WhyNot(File(Described() + messages), {"/odom.pose"}), HasSubstr("no number but geometry_msgs/PoseWith"));
  EXPECT_THAT(WhyNot(File(Described() + messages), {"/odom.pose.covariance"}), HasSubstr("is no number but float64[]"));
  EXPECT_THAT(WhyNot(File(Described() + messages), {"/odom.child_frame_id"}), HasSubstr("is no number but string"));
  EXPECT_THAT(WhyNot(File(Described() + messages), {"/odom.pose..x"}), HasSubstr("'pose..x' is no place"));
  EXPECT_THAT(WhyNot(File(Described() + messages), {"/scan.x"}),
              HasSubstr("no message on /scan; its channels are /cmd_vel, /odom, /stamped"));
}

// Our own export writes such files.
TEST_F(McapTableTest, JsonIsRead) {
  const std::string path = scratch_ / "own.mcap";
  McapWriter writer{OutputFile(path)};
  const auto channel = writer.AddChannel(writer.AddSchema("a.b", "{}"), "STATE");
  writer.Write(channel, 0, 1'500'000, 1, R"({"x": [1, {"y": 2.5}], "on": true})");
  writer.Write(channel, 1, 2'000'000, 2, R"({"x": [3], "on": null})");
  writer.Write(channel, 2, 2'500'000, 3, R"({"x": [3)");
  writer.Write(channel, 3, 3'000'000, 4, R"([])");
  writer.Write(channel, 4, 3'500'000, 5, R"({"x": [-4, {"y": 1e-3}], "on": false})");
  writer.Finish();
  const LogTable table = ReadMcapLog(path, {"recorded", "STATE.x[0]", "STATE.x[1].y", "STATE.on"});
  ASSERT_EQ(table.values.rows(), 4);
  EXPECT_EQ(table.values.row(0), Eigen::RowVector4d(1.5, 1, 2.5, 1));
  EXPECT_EQ(table.values.row(3), Eigen::RowVector4d(3.5, -4, 1e-3, 0));
  EXPECT_EQ(table.values(1, 1), 3);
  EXPECT_TRUE(std::isnan(table.values(1, 2)) && std::isnan(table.values(1, 3)));
  EXPECT_THAT(table.lines, ElementsAre(1, 2, 4, 5));
  EXPECT_THAT(table.after_loss, ElementsAre(false, false, true, false));
  EXPECT_EQ(table.lost.first, "a message of another type or length");
  EXPECT_THAT(Thrown<ConfigError>([&] { static_cast<void>(ReadMcapLog(path, {"STATE.z"})); }),
              HasSubstr("STATE: no message has a number z"));
}

// In memory it would be many times larger than in the file.
TEST_F(McapTableTest, JsonOfManyMegabytesIsLost) {
  const auto rows = [&](std::size_t size) {
    std::string text = R"({"x": 1})";
    text.insert(1, size - text.size(), ' ');
    const LogTable table =
        Table(File(Channel(1, 0, "/a", "json") + Message(1, 1, R"({"x": 2})") + Message(1, 2, text)), {"/a.x"});
    return fmt::format("{} rows, {} lost", table.values.rows(), table.lost.count);
  };
  EXPECT_EQ(rows(16 << 20), "2 rows, 0 lost");
  EXPECT_EQ(rows((16 << 20) + 1), "1 rows, 1 lost");
}

// The room of a larger chunk is kept.
TEST_F(McapTableTest, AChunkIsNoLongerThanItSays) {
  const std::string one = Message(1, 1, OdometryAt(1, 1, 0, 1)), two = Message(1, 2, OdometryAt(2, 2, 0, 1));
  for (const std::string packing : {"lz4", "zstd"}) {
    const LogTable table = Table(File(Described() + Chunk(packing, one + two) + Chunk(packing, one)), odometry_);
    EXPECT_EQ(table.values.rows(), 3) << packing;
    EXPECT_EQ(table.lost.count, 0) << packing;
  }
}

TEST_F(McapTableTest, DamageIsLostAndSaid) {
  const std::string one = Message(1, 1, OdometryAt(1, 1, 0, 1)), two = Message(1, 2, OdometryAt(2, 2, 0, 1));
  const auto lost = [&](const std::string& file) {
    const LogTable table = Table(file, odometry_);
    return fmt::format("{} rows, {} lost: {}", table.values.rows(), table.lost.count, table.lost.first);
  };
  EXPECT_EQ(lost(File(Described() + Chunk("lz4", one, 1) + two)), "1 rows, 1 lost: a chunk with another checksum");
  EXPECT_EQ(lost(File(Described() + Chunk("zstd", one, 0, 1) + two)),
            "1 rows, 1 lost: a chunk of another size than it says");
  EXPECT_EQ(lost(File(Described() + Chunk("lz4", one, 0, -1) + two)), "1 rows, 1 lost: a chunk that lz4 cannot unpack");
  EXPECT_THAT(lost(File(Described() + Chunk("zstd", one, 0, 1 << 30) + two)),
              HasSubstr("1 rows, 1 lost: a chunk of 1"));
  EXPECT_EQ(lost(File(Described() + Record(6, Chunk("", one).substr(9, 60)) + two)),
            "1 rows, 1 lost: a record that ends inside a field");
  EXPECT_EQ(lost(File(Described() + one + Message(9, 1, "x") + two)),
            "2 rows, 1 lost: a message of a channel that the file does not describe");
  EXPECT_EQ(lost(File(Described() + Message(1, 1, OdometryAt(1, 1, 0, 1) + "1234") + two)),
            "1 rows, 1 lost: a message of another type or length");
  EXPECT_EQ(lost(File(Described() + Message(1, 1, OdometryAt(1, 1, 0, 1).substr(0, 700)) + two)),
            "1 rows, 1 lost: a message of another type or length");
  EXPECT_EQ(lost(File(Described() + one + Record(0, "") + two)),
            "1 rows, 1 lost: all from bytes on that are no record");
  EXPECT_EQ(lost(File(Described() + one + Record(0x80, "private") + Record(9, std::string(3'000'000, 'x')) + two)),
            "2 rows, 0 lost: ");
  const std::string whole = std::string(mcap::kMagic) + Described() + one + two;
  EXPECT_EQ(lost(whole.substr(0, whole.size() - 5)), "1 rows, 1 lost: the end of the file, which is cut off");
  EXPECT_EQ(lost(whole), "2 rows, 1 lost: the end of the file, which is cut off");
  EXPECT_EQ(lost(whole + "\6" + std::string(8, '\x7f')), "2 rows, 1 lost: the end of the file, which is cut off");
  EXPECT_THAT(WhyNot("\x89MCAP1\r\n", odometry_), HasSubstr("does not begin as an MCAP file does"));
  for (std::size_t cut = 8; cut < whole.size(); cut += 37) static_cast<void>(WhyNot(whole.substr(0, cut), odometry_));
}

TEST_F(McapTableTest, WhatIsNotReadIsSaid) {
  const auto why = [&](const std::string& described) {
    return WhyNot(File(described + Message(1, 1, "xxxx")), {"/a.x"});
  };
  EXPECT_THAT(why(Channel(1, 0, "/a", "protobuf")), HasSubstr("/a: its messages are encoded as 'protobuf'"));
  EXPECT_THAT(why(Channel(1, 5, "/a", "cdr")), HasSubstr("/a: its messages have no schema, ros2msg is read"));
  EXPECT_THAT(why(Schema(1, "a/msg/B", "ros2idl", "") + Channel(1, 1, "/a", "cdr")),
              HasSubstr("a schema in 'ros2idl'"));
  EXPECT_THAT(why(Schema(1, "a/msg/B", "ros2msg", "C x") + Channel(1, 1, "/a", "cdr")),
              HasSubstr("the schema of a/B lacks the type a/C of a/B.x"));
  EXPECT_THAT(why(Schema(1, "a/msg/B", "ros2msg", "int8 y\nint8") + Channel(1, 1, "/a", "cdr")),
              HasSubstr("the schema of a/B, line 2: a type without the name"));
  EXPECT_THAT(why(Schema(1, "a/msg/B", "ros2msg", "int8[0] x") + Channel(1, 1, "/a", "cdr")), HasSubstr("from 1 up"));
}

TEST(RosType, ReadsConstantsArraysAndTexts) {
  const RosType type(
      "a/msg/B",
      "uint8 ONE=1 # a constant\nint16 TWO = 2\nstring<=5 s \"a\"\nint16[] v\nC[<=3] c\nbool on\nfloat32 f\n"
      "Empty e\nuint64 u\n" +
          kLine + "MSG: a/C\nint8[2] k\n" + kLine + "MSG: a/Empty\n\n");
  Cdr cdr;
  cdr.Text("abc").Int(2u).Int(std::uint16_t{0xffff}).Int(std::uint16_t{7}).Int(1u);
  cdr.Int(std::uint8_t{0x80}).Int(std::uint8_t{5}).Int(std::uint8_t{1});
  cdr.Int(std::bit_cast<std::uint32_t>(1.5f)).Int(std::uint8_t{0}).Int(std::uint64_t{1} << 40);
  std::vector<std::vector<PlaceStep>> places;
  for (const char* place : {"v[0]", "v[1]", "v[2]", "c[0].k[0]", "c[1].k[0]", "on", "f", "u"})
    type.RequireNumber(places.emplace_back(StepsOf(place)));
  const auto values = type.Read(places, cdr.bytes()).value();
  EXPECT_THAT(values, ElementsAre(-1, 7, testing::IsNan(), -128, testing::IsNan(), 1, 1.5, 0x1p40));
  for (std::size_t cut = 0; cut < cdr.bytes().size(); ++cut)
    EXPECT_FALSE(type.Read(places, cdr.bytes().substr(0, cut))) << cut;
  EXPECT_TRUE(type.Read(places, cdr.bytes() + std::string(3, '\0'))) << "padding";
  EXPECT_FALSE(type.Read(places, cdr.bytes() + std::string(4, '\0')));
}

TEST(RosType, WithoutANameIsRefused) {
  EXPECT_THROW(RosType("", "float64 x"), ConfigError);
  EXPECT_THROW(RosType("", ""), ConfigError);
}

// A type in itself, and lengths that lie.
TEST(RosType, WhatNestsWithoutEndIsLost) {
  const RosType endless("a/B", "B[] b");
  EXPECT_FALSE(endless.Read({}, std::string("\0\1\0\0", 4) + std::string(1000, '\1')));
  std::string deep("\0\1\0\0", 4);
  for (int i = 0; i < 100; ++i) deep += std::string("\1\0\0\0", 4);
  EXPECT_FALSE(endless.Read({}, deep));
  EXPECT_FALSE(RosType("a/B", "B b").Read({}, deep));
  EXPECT_FALSE(RosType("a/B", "int8[] b").Read({}, std::string("\0\1\0\0\xff\xff\xff\xff\0", 9)));
  EXPECT_FALSE(RosType("a/B", "wstring b").Read({}, std::string("\0\1\0\0\xff\xff\xff\xff\0", 9)));
}

}  // namespace forereach::mcap_table_test
