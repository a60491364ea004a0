// Datagrams that a stranger without a key sends to the bus of four signed processes: all four live on, still do their
// work, and take no memory for what they were told.
#include "tests/test.h"

#include "bus/authentic.h"
#include "tests/keys.h"
#include "tests/messages.h"
#include "tests/process/process_fixture.h"
#include "tests/process/raw_datagrams.h"

namespace forereach::hostile_datagrams_test {

constexpr double kMegabyte = 1 << 20;
constexpr double kMayGrowBy =
    24 * kMegabyte;  // what the processes take by themselves while they start to drive is in it
constexpr std::size_t kRandomOnes = 100'000, kFewRandomOnes = 2'000, kChannels = 20'000;

constexpr std::array<const char*, 3> kHeard{"ROBOT_STATE", "PLAN_CERTIFIED",
                                            "PLAN_CANDIDATE"};  // each process hears one

struct Attack {
  const char* name;
  std::function<void(const RawSender&)> send;
  bool refused = true;  // by their header

  friend std::ostream& operator<<(std::ostream& out, const Attack& attack) { return out << attack.name; }
};

template <class Make>
auto OnEachChannel(Make make) {
  return [make](const RawSender& sender) {
    for (const char* channel : kHeard) ASSERT_TRUE(sender.Send(make(channel)));
  };
}

void SendRandomFragments(const RawSender& sender) {
  std::mt19937 random(1);
  for (std::size_t i = 0; i < kRandomOnes; ++i)
    ASSERT_TRUE(sender.Send(Bytes(RandomFragment(random, kHeard[i % kHeard.size()]))));
}

void SendRandomBytes(const RawSender& sender) {
  std::mt19937 random(2);
  for (std::size_t i = 0; i < kFewRandomOnes; ++i) ASSERT_TRUE(sender.Send(Bytes(RandomBytes(random, 60'000))));
}

// Well formed, on channels that nobody subscribes to but the logger.
void SendOnManyChannels(const RawSender& sender) {
  const RawDatagram message(100, 1);
  for (std::size_t i = 0; i < kChannels; ++i)
    ASSERT_TRUE(sender.Send(Bytes(ShortMessage("A_CHANNEL_THAT_NOBODY_KNOWS_" + std::to_string(i), message))));
}

const std::vector<Attack>& Attacks() {
  static const std::vector<Attack> attacks{
      {"AFragmentThatWraps", OnEachChannel(WrappingFragment)},
      {"NamesWithoutAnEnd", [](const RawSender& sender) { ASSERT_TRUE(sender.Send(EndlessNames())); }},
      {"ClaimsOf256Megabytes", OnEachChannel(HugeClaims)},
      {"RandomFragments", SendRandomFragments},
      {"NothingAtAll", [](const RawSender& sender) { ASSERT_TRUE(sender.Send(Bytes())); }},
      {"NotOfLcm", SendRandomBytes},
      {"ManyChannels", SendOnManyChannels, false}};
  return attacks;
}

struct HostileDatagramsTest : testing::TestWithParam<Attack> {
  struct Process {
    const char* channel;  // on which it speaks
    ChildProcess child;
    double resident_before = 0;
  };

  std::vector<std::string> Command(const char* program) const {
    return {program, "--config", path_, "--lcm-url", url_, "--key", key_};
  }
  std::vector<std::string> LoggerCommand() const {
    auto command = Command(FOREREACH_LOGGER);
    command.insert(command.end(), {"--directory", scratch_ / "log"});
    return command;
  }
  std::string WriteKey() const { return MakeTestKeys(scratch_ / "keys"); }
  static std::string FarTask() {  // the drive has no end while the attacks last, however slow the machine is
    return Replaced(PatientTask(600), "goal: [6, 0]\n  goal_radius: 0.5", "goal: [18, 0]\n  goal_radius: 1e-9");
  }
  bool AllSpeak() {
    std::array<std::size_t, 4> before{};
    for (std::size_t i = 0; i < processes_.size(); ++i) before[i] = probe_.heard(processes_[i].channel).size();
    return probe_.WaitUntil([&] {
      if (std::ranges::any_of(processes_, [](Process& process) { return HasEnded(process); }))
        return true;  // say so at once
      for (std::size_t i = 0; i < processes_.size(); ++i)
        if (probe_.heard(processes_[i].channel).size() < before[i] + 2) return false;
      return true;
    });
  }
  static bool HasEnded(Process& process) { return process.child.WaitForEnd(std::chrono::milliseconds(0)); }

  const ScratchDirectory scratch_;
  const std::string path_ = scratch_.Write("task.yaml", FarTask()), key_ = WriteKey(), url_ = PrivateBusUrl();
  BusProbe probe_{url_, {"CERTIFIER_STATUS", "LOGGER_STATUS", "PLAN_DECISION", "PLAN_CANDIDATE", "ROBOT_STATE"}};
  std::array<Process, 4> processes_{Process{"LOGGER_STATUS", ChildProcess(LoggerCommand())},
                                    Process{"PLAN_DECISION", ChildProcess(Command(FOREREACH_CERTIFIER))},
                                    Process{"PLAN_CANDIDATE", ChildProcess(Command(FOREREACH_PLANNER))},
                                    Process{"ROBOT_STATE", ChildProcess(Command(FOREREACH_ROBOT_SIM))}};
};
INSTANTIATE_TEST_SUITE_P(Attacks, HostileDatagramsTest, testing::ValuesIn(Attacks()),
                         [](const auto& instance) { return std::string(instance.param.name); });

TEST_P(HostileDatagramsTest, EveryProcessLivesOnAndWorks) {
  ASSERT_TRUE(AllSpeak()) << "before the attack";
  const std::int64_t events_before = probe_.Heard<logger_status_t>("LOGGER_STATUS").back().events_written;
  for (Process& process : processes_) process.resident_before = ResidentBytes(process.child.pid());
  const RawSender sender(url_);
  GetParam().send(sender);
  EXPECT_TRUE(AllSpeak()) << "not all of them are heard after the attack";
  for (Process& process : processes_) {
    EXPECT_FALSE(HasEnded(process)) << "what speaks on " << process.channel << " ended: " << process.child.error();
    const double grown = ResidentBytes(process.child.pid()) - process.resident_before;
    if (GetParam().refused) EXPECT_TRUE(process.child.WaitForLog("datagrams refused: ")) << "it says so";
    EXPECT_LT(grown / kMegabyte, kMayGrowBy / kMegabyte) << process.channel << " grew by so many MB";
  }
  EXPECT_GT(probe_.Heard<logger_status_t>("LOGGER_STATUS").back().events_written, events_before);
  if (GetParam().refused) {
    const auto counted = [this] {
      return probe_.Heard<certifier_status_t>("CERTIFIER_STATUS").back().datagrams_refused > 0;
    };
    EXPECT_TRUE(probe_.WaitUntil(counted)) << "the certifier's heartbeat counts them";
  }
}

}  // namespace forereach::hostile_datagrams_test
