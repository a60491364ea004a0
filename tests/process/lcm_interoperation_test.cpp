// On the wire it stays LCM: plain LCM, lcm-logger and lcm-logplayer understand what we send, and we understand them.
// And LCM receives nothing in our processes.
#include <cstdio>

#include <lcm/lcm-cpp.hpp>

#include "tests/test.h"

#include "bus/authentic.h"
#include "records/event_log.h"
#include "tests/messages.h"
#include "tests/process/process_fixture.h"

namespace forereach::lcm_interoperation_test {

using Message = std::pair<std::string, std::vector<std::uint8_t>>;  // channel, bytes

std::size_t LongestOn(const std::string& channel) {
  return kMaxDatagramBytes - kDatagramHeaderBytes - channel.size() - 1;
}

// The sockets of this process that are bound to a port, by /proc.
int SocketsBoundTo(int port) {
  std::set<std::string> inodes;
  std::ifstream table("/proc/self/net/udp");
  std::string line;
  std::getline(table, line);
  char wanted[8];
  std::snprintf(wanted, sizeof wanted, ":%04X", port);
  while (std::getline(table, line)) {
    std::istringstream row(line);
    std::vector<std::string> fields{std::istream_iterator<std::string>(row), {}};
    if (fields.size() > 9 && fields[1].ends_with(wanted)) inodes.insert("socket:[" + fields[9] + "]");
  }
  int ours = 0;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
    std::error_code gone;
    ours += inodes.contains(std::filesystem::read_symlink(entry, gone).string());
  }
  return ours;
}

std::ptrdiff_t Threads() {
  return std::distance(std::filesystem::directory_iterator("/proc/self/task"), std::filesystem::directory_iterator());
}

// A subscriber of LCM's own.
class PlainLcm final {
 public:
  explicit PlainLcm(const std::string& url) : lcm_(url) {}

  [[nodiscard]] bool good() { return lcm_.good(); }
  void SubscribeToAll() { lcm_.subscribe(".*", &PlainLcm::OnMessage, this); }
  bool Publish(const Message& message) {
    return lcm_.publish(message.first, message.second.data(), static_cast<unsigned>(message.second.size())) == 0;
  }
  bool WaitUntilHeard(std::size_t count) {
    const auto deadline = std::chrono::steady_clock::now() + kPatience;
    while (heard.size() < count && std::chrono::steady_clock::now() < deadline) lcm_.handleTimeout(10);
    return heard.size() >= count;
  }

  std::vector<Message> heard;

 private:
  void OnMessage(const lcm::ReceiveBuffer* buffer, const std::string& channel) {
    const auto* data = static_cast<const std::uint8_t*>(buffer->data);
    heard.push_back({channel, {data, data + buffer->data_size}});
  }

  lcm::LCM lcm_;
};

struct LcmInteroperationTest : testing::Test {
  static std::vector<Message> Sample() {
    certified_plan_t certified{};
    certified.sequence = 7;
    return {{"PLAN_CERTIFIED", Encode(certified)},
            {"EMPTY", {}},
            {"A", std::vector<std::uint8_t>(LongestOn("A"), 5)},
            {std::string(kMaxChannelBytes, 'C'), {1, 2, 3}}};
  }
  static std::vector<Message> EventsOf(const std::string& log) {
    std::vector<Message> events;
    if (!std::filesystem::exists(log)) return events;
    EventLogReader reader(log);
    ForEachEvent(reader, [&events](const LogEvent& event) { events.push_back({event.channel, event.data}); });
    return events;
  }
  static void WriteLog(const std::string& path, const std::vector<Message>& messages) {
    EventLogWriter writer(path);
    std::int64_t utime = WallClockUs();
    for (const auto& [channel, bytes] : messages) writer.Append(utime += 1000, channel, Bytes(bytes));
    ASSERT_TRUE(writer.Flush());
  }
  static bool WaitFor(const std::function<bool()>& done) {
    const auto deadline = std::chrono::steady_clock::now() + kPatience;
    while (!done() && std::chrono::steady_clock::now() < deadline)
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    return done();
  }
  void HearAll() {
    bus_->Subscribe(Bus::kEveryChannel, [this](const Received& r) {
      heard_.push_back({r.channel, {r.bytes.begin(), r.bytes.end()}});
    });
  }
  bool WaitUntilHeard(std::size_t count) {
    const auto deadline = std::chrono::steady_clock::now() + kPatience;
    while (heard_.size() < count && std::chrono::steady_clock::now() < deadline) bus_->Dispatch(10);
    return heard_.size() >= count;
  }
  void PublishSample() {
    for (const auto& [channel, bytes] : Sample()) EXPECT_TRUE(bus_->Publish(channel, Bytes(bytes)));
  }

  const ScratchDirectory scratch_;
  const std::string url_ = PrivateBusUrl();
  const std::unique_ptr<Bus> bus_ = OpenBus(url_);
  std::vector<Message> heard_;
};

TEST_F(LcmInteroperationTest, LcmOpensNoReceivingSideInOurProcess) {
  const int port = ParseMulticastUrl(url_).port;
  HearAll();
  PublishSample();
  ASSERT_TRUE(WaitUntilHeard(Sample().size()));
  EXPECT_EQ(SocketsBoundTo(port), 1) << "the receiver's own";
  const std::ptrdiff_t threads = Threads();
  {
    const auto another = OpenBus(url_);
    EXPECT_EQ(SocketsBoundTo(port), 2);
    EXPECT_EQ(Threads(), threads + 1) << "the receiver's own";
  }
  PlainLcm plain(url_);
  EXPECT_EQ(SocketsBoundTo(port), 1) << "it has none until somebody subscribes";
  plain.SubscribeToAll();
  EXPECT_EQ(SocketsBoundTo(port), 2) << "this is how one would be seen";
}

TEST_F(LcmInteroperationTest, PlainLcmReceivesWhatWeSend) {
  PlainLcm plain(url_);
  ASSERT_TRUE(plain.good());
  plain.SubscribeToAll();
  PublishSample();
  ASSERT_TRUE(plain.WaitUntilHeard(Sample().size()));
  EXPECT_EQ(plain.heard, Sample());
}

TEST_F(LcmInteroperationTest, WeReceiveWhatPlainLcmSends) {
  HearAll();
  PlainLcm plain(url_);
  for (const Message& message : Sample()) ASSERT_TRUE(plain.Publish(message));
  ASSERT_TRUE(WaitUntilHeard(Sample().size()));
  EXPECT_EQ(heard_, Sample());
  EXPECT_EQ(bus_->datagrams().refused(), 0);
}

// Where LCM itself begins to fragment, and what becomes of that.
TEST_F(LcmInteroperationTest, WhatPlainLcmFragmentsIsRefusedAndCounted) {
  HearAll();
  PlainLcm plain(url_);
  for (const std::string& channel : {std::string("A"), std::string(kMaxChannelBytes, 'C')}) {
    heard_.clear();
    const std::int64_t fragments = bus_->datagrams().fragments;
    const Message fits{channel, std::vector<std::uint8_t>(LongestOn(channel), 1)};
    Message does_not = fits;
    does_not.second.push_back(1);
    ASSERT_TRUE(FitsOneDatagram(channel.size(), fits.second.size()));
    ASSERT_FALSE(FitsOneDatagram(channel.size(), does_not.second.size()));
    ASSERT_TRUE(plain.Publish(fits));
    ASSERT_TRUE(plain.Publish(does_not));
    ASSERT_TRUE(plain.Publish({"END", {}}));
    ASSERT_TRUE(WaitUntilHeard(2));
    EXPECT_EQ(heard_, (std::vector<Message>{fits, {"END", {}}}));
    EXPECT_EQ(bus_->datagrams().fragments, fragments + 2);
  }
}

TEST_F(LcmInteroperationTest, LcmLoggerRecordsWhatWeSend) {
  const std::string log = scratch_ / "theirs.lcmlog";
  ChildProcess logger({"/usr/bin/env", "lcm-logger", "--lcm-url=" + url_, "--flush-interval=20", log});
  // It listens once it has recorded something.
  ASSERT_TRUE(WaitFor([&] {
    static_cast<void>(bus_->Publish("ARE_YOU_THERE", Bytes()));
    return !EventsOf(log).empty();
  })) << logger.error();
  PublishSample();
  const auto sample = Sample();
  const auto recorded = [&] {
    std::vector<Message> events = EventsOf(log);
    std::erase_if(
        events, [](const Message& event) { return event.first == "ARE_YOU_THERE" || event.first == "LCM_SELF_TEST"; });
    return events;
  };
  EXPECT_TRUE(WaitFor([&] {
    static_cast<void>(bus_->Publish("ARE_YOU_THERE", Bytes()));  // it flushes when something comes
    return recorded().size() >= sample.size();
  }));
  EXPECT_EQ(recorded(), sample);
  static_cast<void>(logger.Terminate());
}

TEST_F(LcmInteroperationTest, WeHearWhatLcmLogplayerPlays) {
  HearAll();
  WriteLog(scratch_ / "log", Sample());
  ChildProcess player({"/usr/bin/env", "lcm-logplayer", "--lcm-url=" + url_, "--speed=10", scratch_ / "log"});
  ASSERT_TRUE(WaitUntilHeard(Sample().size())) << player.error();
  EXPECT_EQ(heard_, Sample());
  EXPECT_TRUE(player.WaitForEnd(kPatience));
}

TEST_F(LcmInteroperationTest, WhatLcmLogplayerFragmentsIsRefusedAndCounted) {
  HearAll();
  auto messages = Sample();
  messages.insert(messages.begin(), {"A", std::vector<std::uint8_t>(200'000, 1)});
  WriteLog(scratch_ / "log", messages);
  ChildProcess player({"/usr/bin/env", "lcm-logplayer", "--lcm-url=" + url_, "--speed=10", scratch_ / "log"});
  ASSERT_TRUE(WaitUntilHeard(Sample().size())) << player.error();
  EXPECT_EQ(heard_, Sample());
  EXPECT_EQ(bus_->datagrams().fragments, 4);
}

// A recorded log, played to two processes of ours: each candidate is answered, everything is recorded.
TEST_F(LcmInteroperationTest, OurProcessesTakeWhatLcmLogplayerPlays) {
  const std::string path = scratch_.Write("task.yaml", PatientTask()), directory = scratch_ / "recorded";
  const Config config = LoadConfig(path);
  std::vector<Message> messages;
  constexpr int kCandidates = 5;
  for (int i = 0; i < kCandidates; ++i)
    messages.push_back({"PLAN_CANDIDATE", Encode(CandidateFor(config, i + 1, Eigen::Vector2d(0, 0)))});
  WriteLog(scratch_ / "log", messages);
  BusProbe probe(url_, {"PLAN_DECISION"});
  ChildProcess certifier({FOREREACH_CERTIFIER, "--config", path, "--lcm-url", url_});
  ChildProcess logger({FOREREACH_LOGGER, "--config", path, "--lcm-url", url_, "--directory", directory});
  for (ChildProcess* process : {&certifier, &logger}) ASSERT_TRUE(process->WaitForLog("ready on")) << process->error();
  ChildProcess player({"/usr/bin/env", "lcm-logplayer", "--lcm-url=" + url_, scratch_ / "log"});
  EXPECT_TRUE(probe.WaitUntil([&] { return probe.heard("PLAN_DECISION").size() == kCandidates; })) << player.error();
  EXPECT_EQ(certifier.Terminate(), 0);
  EXPECT_EQ(logger.Terminate(), 0);
  int recorded = 0;
  for (const auto& file : std::filesystem::directory_iterator(directory))
    if (file.path().extension() == ".lcmlog")
      for (const Message& event : EventsOf(file.path())) recorded += event.first == "PLAN_CANDIDATE";
  EXPECT_EQ(recorded, kCandidates);
}

TEST_F(LcmInteroperationTest, OurLargestMessageFitsOneDatagramWithItsSignature) {
  EXPECT_GT(EncodedSize<certified_plan_t>(), EncodedSize<candidate_plan_t>());
  EXPECT_TRUE(FitsOneDatagram(kMaxChannelBytes, EncodedSize<certified_plan_t>() + kTrailerBytes));
}

}  // namespace forereach::lcm_interoperation_test
