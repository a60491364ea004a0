// Every signed channel at a node that listens on it: what its speaker signs here and now has an effect, and nothing
// else has any. The channels are spelled out here, so that none is lost from the list of those that are signed.
#include "tests/test.h"

#include "bus/bus_options.h"
#include "bus/process.h"
#include "certifier/process/certifier_node.h"
#include "logger/logger_node.h"
#include "planner_bridge/planner_node.h"
#include "simulator/sim_node.h"
#include "tests/keys.h"
#include "tests/messages.h"
#include "tests/planner_bridge/tasks.h"
#include "tests/process/process_fixture.h"

namespace forereach::signed_channels_test {

using Message = std::vector<std::uint8_t>;

constexpr std::int64_t kHour = 3'600'000'000;

// A node on a signed bus of its own, a message that has an effect on it, and what the effect is seen in.
struct Listener {
  std::unique_ptr<Bus> bus;
  std::unique_ptr<Node> node;
  std::function<Message(int number)> make;  // the number-th of its sender
  std::function<std::string()> state;
};

struct SignedChannelsTest : testing::TestWithParam<std::string> {
  SignedChannelsTest() {
    config_.bus.url = PrivateBusUrl();
    config_.bus.key = MakeTestKeys(scratch_ / "keys");
    config_.gate.obstacles = ObstaclesSource::kBus;
    config_.gate.obstacles_lost_ms = kNeverLost;
    config_.gate.advises = true;
    config_.logger.directory = scratch_ / "log";
    open_ = OpenBus(config_.bus.url);
    open_->Subscribe("EXECUTION_EVENT", [this](const Received&) { ++events_; });
    keys_ = LoadAllKeys(config_.bus.key);
    signer_.emplace(*keys_, config_.bus.bus_name());
  }

  [[nodiscard]] std::unique_ptr<Bus> BusOf(Role role) const { return OpenBus(config_.bus, role); }

  [[nodiscard]] Listener Certifier(std::function<Message(int)> make) {
    Listener listener{BusOf(Role::kCertifier), nullptr, std::move(make), {}};
    auto node = std::make_unique<CertifierNode>(config_, *listener.bus);
    listener.state = [&node = *node] {
      const certifier_status_t status = node.gate().Status(WallClockUs());
      std::ostringstream text;
      text << status.candidates << ' ' << status.observations << ' ' << status.obstacles_in_force << ' '
           << node.watch().Lacks(Watch::Need::kRobotState) << ' ' << static_cast<int>(node.charge().state());
      return text.str();
    };
    listener.node = std::move(node);
    return listener;
  }
  [[nodiscard]] Listener Robot(std::function<Message(int)> make) {
    Listener listener{BusOf(Role::kRobot), nullptr, std::move(make), {}};
    listener.node = std::make_unique<RobotSimNode>(config_, *listener.bus, out_);
    listener.state = [this] {
      for (int i = 0; i < 3; ++i) open_->Dispatch(10);
      return std::to_string(events_);
    };
    return listener;
  }
  [[nodiscard]] Listener Planner(std::function<Message(int)> make) {
    Listener listener{BusOf(Role::kPlanner), nullptr, std::move(make), {}};
    auto node = std::make_unique<PlannerNode>(config_, *listener.bus, out_);
    listener.state = [&node = *node] { return node.Summary(); };
    listener.node = std::move(node);
    return listener;
  }
  [[nodiscard]] Listener Logger(std::function<Message(int)> make) {
    Listener listener{BusOf(Role::kLogger), nullptr, std::move(make), {}};
    auto node = std::make_unique<LoggerNode>(config_, *listener.bus, out_);
    listener.state = [&node = *node] {
      const Summary summary = node.recorder().summary();
      std::int64_t lost = 0;
      for (const auto& [reason, count] : summary.lost) lost += count;
      return std::to_string(summary.contacts) + " " + std::to_string(lost);
    };
    listener.node = std::move(node);
    return listener;
  }

  [[nodiscard]] Listener ListenerOn(const std::string& channel);

  void Step() {
    listener_.bus->Dispatch(5);
    listener_.node->Tick(WallClockUs());
  }
  // All that was sent is refused, or nothing more comes.
  void AwaitRefusals(std::int64_t count) {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(3);
    while (listener_.bus->refusals().all() < count && std::chrono::steady_clock::now() < deadline) Step();
    Step();
  }
  [[nodiscard]] bool AwaitAnotherState(const std::string& before) {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(3);
    while (listener_.state() == before && std::chrono::steady_clock::now() < deadline) Step();
    return listener_.state() != before;
  }
  void Send(const std::string& channel, const Message& bytes) { ASSERT_TRUE(open_->Publish(channel, Bytes(bytes))); }
  [[nodiscard]] Message Signed(const std::string& channel, Role role, int number, std::int64_t now_us = WallClockUs()) {
    return signer_->Sign(role, channel, listener_.make(number), now_us);
  }

  const ScratchDirectory scratch_;
  Config config_ = PointMass();
  std::ostringstream out_;
  std::unique_ptr<Bus> open_;
  std::optional<KeyRing> keys_;
  std::optional<Signer> signer_;
  int events_ = 0;
  Listener listener_;
};

const Speakers kSpeakers{
    {"PLAN_CANDIDATE", Role::kPlanner},   {"PLAN_DECISION", Role::kCertifier}, {"PLAN_CERTIFIED", Role::kCertifier},
    {"PLAN_WITHDRAWN", Role::kCertifier}, {"PLAN_ADVICE", Role::kCertifier},   {"ROBOT_STATE", Role::kRobot},
    {"OBSTACLES", Role::kPerception},     {"TRANSITION", Role::kRobot},        {"CERTIFIER_STATUS", Role::kCertifier},
    {"EXECUTION_EVENT", Role::kRobot},    {"LOGGER_STATUS", Role::kLogger},    {"FAULT", Role::kCertifier},
    {"COMMAND", Role::kOperator}};

Listener SignedChannelsTest::ListenerOn(const std::string& channel) {
  if (channel == "PLAN_CANDIDATE")
    return Certifier([](int number) {
      candidate_plan_t candidate{};
      candidate.plan_id = candidate.sequence = number;
      return Encode(candidate);
    });
  if (channel == "ROBOT_STATE")
    return Certifier([](int number) {
      robot_state_t state{.utime = WallClockUs(), .sequence = number, .mode = robot_state_t::STANDING, .num_states = 4};
      state.executing_plan_id = state.executing_step = -1;
      return Encode(state);
    });
  if (channel == "OBSTACLES")
    return Certifier([](int number) {
      return Encode(Sighted({Obstacle::Circle(Vec({9.0 + number, 9}), 0.5)}, WallClockUs(), number));
    });
  if (channel == "TRANSITION")
    return Certifier([](int number) {
      return Encode(transition_t{
          .utime = WallClockUs(), .sequence = number, .duration_us = 150'000, .num_states = 4, .num_inputs = 2});
    });
  if (channel == "CERTIFIER_STATUS")
    return Certifier([](int) {
      certifier_status_t status{
          .utime = WallClockUs(), .instance = 1, .started_utime = 1, .state = certifier_status_t::ARMED};
      return Encode(status);
    });
  if (channel == "PLAN_DECISION") return Planner([](int number) { return Encode(decision_t{.sequence = number}); });
  if (channel == "PLAN_ADVICE") return Planner([](int number) { return Encode(advice_t{.sequence = number}); });
  if (channel == "PLAN_CERTIFIED")
    return Robot([](int number) {
      certified_plan_t certified{};
      certified.plan.plan_id = certified.sequence = number;
      return Encode(certified);
    });
  if (channel == "PLAN_WITHDRAWN")
    return Robot([](int number) {
      withdrawal_t withdrawal{};
      withdrawal.plan_id = withdrawal.sequence = number;
      return Encode(withdrawal);
    });
  if (channel == "FAULT" || channel == "COMMAND")
    return Robot([channel](int number) {
      fault_t fault{.utime = WallClockUs(), .sequence = number, .cause = fault_t::SLICE_LEFT};
      return channel == "FAULT" ? Encode(fault) : Encode(command_t{.utime = WallClockUs(), .kind = command_t::RESET});
    });
  if (channel == "EXECUTION_EVENT")
    return Logger([](int number) {
      execution_event_t event{.utime = WallClockUs(), .sequence = number, .kind = execution_event_t::CONTACT};
      return Encode(event);
    });
  return Logger([](int number) {  // of which every second one is lost
    return Encode(logger_status_t{.utime = WallClockUs(), .sequence = 1000 + 2 * number});
  });
}

TEST(SignedChannels, AreTheseAndTheirSpeakers) {
  EXPECT_EQ(BusOptions{}.speakers(), kSpeakers);
  const std::set<std::string> minute{"CERTIFIER_STATUS", "FAULT", "PLAN_WITHDRAWN"};
  for (const auto& [channel, speaker] : BusOptions{}.speakers())
    EXPECT_EQ(speaker.max_ahead_us, minute.contains(channel) ? 60'000'000 : 1'000'000) << channel;
}

TEST_P(SignedChannelsTest, OnlyWhatItsSpeakerSignsNowHasAnEffect) {
  const std::string& channel = GetParam();
  const Role speaker = kSpeakers.at(channel).role;
  const auto earlier = WallClockUs();
  listener_ = ListenerOn(channel);
  for (int i = 0; i < 4; ++i) Step();
  if (channel == "COMMAND") {  // there is a fault to reset
    fault_t fault{.utime = WallClockUs(), .cause = fault_t::SLICE_LEFT};
    const std::string before = listener_.state();
    Send("FAULT", signer_->Sign(Role::kCertifier, "FAULT", Encode(fault), WallClockUs()));
    ASSERT_TRUE(AwaitAnotherState(before));
  }
  const std::string before = listener_.state();

  int number = 0, refused = 0;
  const auto send_refused = [&](const Message& bytes) { Send(channel, bytes), ++refused; };
  send_refused(listener_.make(++number));  // unsigned
  for (const Role role : kAllRoles)
    if (role != speaker) send_refused(Signed(channel, role, ++number));
  send_refused(Signer(TestKeys("another"), config_.bus.bus_name())
                   .Sign(speaker, channel, listener_.make(++number), WallClockUs()));
  send_refused(Signer(*keys_, "another bus").Sign(speaker, channel, listener_.make(++number), WallClockUs()));
  Message altered = Signed(channel, speaker, ++number);
  altered[8] ^= 1;
  send_refused(altered);
  // Of an earlier session: genuine, and signed before this one began.
  for (const std::int64_t ago : {std::int64_t{1'000'000}, kHour})
    send_refused(
        Signer(*keys_, config_.bus.bus_name()).Sign(speaker, channel, listener_.make(++number), earlier - ago));
  // Signed while a clock was ahead, by more than the minute that some channels allow.
  for (const std::int64_t ahead : {kHour / 30, kHour})
    send_refused(
        Signer(*keys_, config_.bus.bus_name()).Sign(speaker, channel, listener_.make(++number), WallClockUs() + ahead));
  AwaitRefusals(refused);
  EXPECT_FIELDS(listener_, (state(), before), (bus->refusals().old, 2), (bus->refusals().ahead, 2));

  Message genuine;
  for (int tries = 0; tries < 3 && listener_.state() == before; ++tries) {
    genuine = Signed(channel, speaker, ++number);
    Send(channel, genuine);
    for (int i = 0; i < 40 && listener_.state() == before; ++i) Step();
  }
  ASSERT_TRUE(AwaitAnotherState(before)) << "what its speaker signs has no effect";
  for (int i = 0; i < 4; ++i) Step();
  const std::string after = listener_.state();
  send_refused(genuine);  // a second time
  AwaitRefusals(refused);
  EXPECT_FIELDS(listener_, (state(), after), (bus->refusals().all(), refused));
}

INSTANTIATE_TEST_SUITE_P(All, SignedChannelsTest, testing::ValuesIn([] {
                           std::vector<std::string> names;
                           for (const auto& [channel, role] : kSpeakers) names.push_back(channel);
                           return names;
                         }()),
                         [](const auto& instance) { return instance.param; });

}  // namespace forereach::signed_channels_test
