// A network that loses and alters messages, datagrams that are none of ours, and no network.
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <mutex>
#include <thread>
#include <utility>

#include <fcntl.h>
#include <sched.h>
#include <unistd.h>

#include "tests/faults/demo_task.h"
#include "tests/faults/kind.h"
#include "tests/faults/relay.h"
#include "tests/process/raw_datagrams.h"

namespace forereach {
namespace {

using Heard = std::vector<std::pair<std::string, std::vector<std::uint8_t>>>;  // channel, bytes
constexpr std::size_t kMostHeard = 2000;  // messages that are kept to be sent again
constexpr double kMayGrowBy = 48 << 20;   // a queue full of honest messages is in it

// A network of its own for this thread and what it starts from now on: the machine's routes stay as they are.
class OwnNetwork final {
 public:
  static constexpr const char* kNeeds = "a network of its own needs root and the command ip";

  OwnNetwork() : machines_(::open("/proc/thread-self/ns/net", O_RDONLY | O_CLOEXEC)) {
    entered_ = machines_ >= 0 && ::unshare(CLONE_NEWNET) == 0;
    works_ = entered_ && Ip({"link", "set", "lo", "up"}) && SetRoute(true);
  }
  ~OwnNetwork() {
    if (entered_) static_cast<void>(::setns(machines_, CLONE_NEWNET));
    if (machines_ >= 0) ::close(machines_);
  }
  OwnNetwork(const OwnNetwork&) = delete;
  OwnNetwork& operator=(const OwnNetwork&) = delete;

  [[nodiscard]] bool works() const { return works_; }
  /** The only one to multicast. */
  [[nodiscard]] bool SetRoute(bool there) const {
    return Ip({"route", there ? "add" : "del", "224.0.0.0/4", "dev", "lo"});
  }

 private:
  static bool Ip(const std::vector<std::string>& arguments) {
    std::vector<std::string> command{"/usr/bin/env", "ip"};
    command.insert(command.end(), arguments.begin(), arguments.end());
    return ChildProcess(command).WaitForExit(std::chrono::seconds(10)) == 0;
  }

  const int machines_;
  bool entered_ = false, works_ = false;
};

class Networked final : Kind {
 public:
  using Kind::Kind;

  void BadNetwork() {
    const std::vector<std::pair<std::string, Weather>> weathers{{"one message in five dropped", {.drop = 0.2}},
                                                                {"one in five sent twice", {.repeat = 0.2}},
                                                                {"one in five delayed by 60 ms", {.delay = 0.2}},
                                                                {"one in five overtaken", {.swap = 0.2}},
                                                                {"one in five with a bit flipped", {.corrupt = 0.2}},
                                                                {"all of these", {0.1, 0.1, 0.1, 0.1, 0.1, 60}},
                                                                {"none arrives for a second", {.drop = 1}}};
    for (const auto& [name, weather] : weathers) {
      Rig rig(DemoTask(), {.relayed = true});
      const BusOptions& channels = rig.config().bus;
      Relay relay(rig.url(Rig::kPlanner), rig.url(Rig::kCertifier),
                  {channels.candidate, channels.robot_state, channels.transition, channels.event, channels.command,
                   channels.obstacles},
                  options_.seed);
      std::atomic<bool> stop = false;
      std::mutex mutex;
      std::thread passing([&] {
        while (!stop) {
          const std::lock_guard lock(mutex);
          relay.Pass();
          std::this_thread::sleep_for(microseconds(200));
        }
      });
      const auto set = [&](const Weather& now) {
        const std::lock_guard lock(mutex);
        relay.SetWeather(now);
      };
      Row& row = Begin("Datagrams: " + name);
      row.bus_loses = true;
      Tries(row, rig, [&, now = weather](int) {
        set(now);
        rig.Listen(milliseconds(1000));
        set({});
        rig.Listen(milliseconds(100));  // no altered message is still on its way when the heartbeats are believed again
      });
      stop = true;
      passing.join();
      Remark(row, std::to_string(relay.spoiled()) + " messages spoiled");
    }
  }

  // Each of the first three ended LCM's own receiver, or took it memory by the gigabyte.
  void Datagrams() {
    const std::vector<std::string> channels{"ROBOT_STATE", "PLAN_CERTIFIED",
                                            "PLAN_CANDIDATE"};  // each process hears one
    const auto on_each = [&](auto make) {
      return [&channels, make](Rig&, const RawSender& sender, const Heard&) {
        for (const std::string& channel : channels) sender.Send(make(channel));
      };
    };
    Throw("a fragment that wraps around 2^32", on_each(WrappingFragment));
    Throw("fragments that claim 256 MB", on_each(HugeClaims));
    Throw("channels without an end", [](Rig&, const RawSender& sender, const Heard&) { sender.Send(EndlessNames()); });
    Throw("10000 fragments and 10000 of random bytes", [&](Rig& rig, const RawSender& sender, const Heard&) {
      for (std::size_t i = 0; i < 10'000; ++i) {
        sender.Send(Bytes(RandomFragment(random_, channels[i % channels.size()])));
        sender.Send(Bytes(RandomBytes(random_, 1500)));
        if (i % 16 == 0) rig.open_bus().Dispatch(0);
      }
    });
    Throw("what was heard, mutated, 50 times each", [&](Rig& rig, const RawSender& sender, const Heard& heard) {
      for (const auto& [channel, bytes] : heard) {
        for (int i = 0; i < 50; ++i) sender.Send(Bytes(Mutated(random_, ShortMessage(channel, bytes))));
        rig.open_bus().Dispatch(0);
      }
    });
  }

  void Routes() { NoNetwork(), LostRoute(); }

 private:
  // A stranger's, whatever their content: they do no more than any noise.
  void Throw(const std::string& what, const std::function<void(Rig&, const RawSender&, const Heard&)>& send) {
    Rig rig(DemoTask());
    Row& row = Begin("Raw datagrams: " + what);
    const BusOptions& channels = rig.config().bus;
    const RawSender sender(rig.url(Rig::kCertifier));
    Heard heard;
    rig.open_bus().SubscribeUnchecked(Bus::kEveryChannel, [&](const Received& r) {
      if (channels.speakers().contains(r.channel) && heard.size() < kMostHeard)
        heard.push_back({r.channel, {r.raw.begin(), r.raw.end()}});
    });
    double most_grown = 0;
    row.bus_loses = true;
    Tries(row, rig, [&](int) {
      heard.clear();
      rig.Listen(milliseconds(300));
      std::array<double, Rig::kRoles> before{};
      for (int role = 0; role < Rig::kRoles; ++role)
        before[static_cast<std::size_t>(role)] = rig.Resident(Rig::Role(role));
      send(rig, sender, Heard(heard));
      rig.Listen(kHeartbeat);
      for (int role = 0; role < Rig::kRoles; ++role) {
        const double grown = rig.Resident(Rig::Role(role)) - before[static_cast<std::size_t>(role)];
        most_grown = std::max(most_grown, grown);
        Demand(row, grown < kMayGrowBy,
               std::string("the ") + Rig::kNames[static_cast<std::size_t>(role)] + " grew by " +
                   std::to_string(std::lround(grown / (1 << 20))) + " MB");
      }
    });
    if (const auto megabytes = std::lround(std::ceil(most_grown / (1 << 20))); megabytes > 1)
      Remark(row, "a process grew by " + std::to_string(megabytes) + " MB in a try");
  }

  // A process that starts without a network says what to do, and ends.
  void NoNetwork() {
    const std::string fault = "No multicast route at the start";
    const OwnNetwork network;
    if (!network.works()) return NotTried(fault, OwnNetwork::kNeeds);
    const ScratchDirectory scratch;
    const std::string task = scratch.Write("task.yaml", DemoTask()), url = PrivateBusUrl();
    Row& row = Begin(fault, Rig::kRoles);
    Demand(row, network.SetRoute(false), "the route stays");
    for (const char* program : {FOREREACH_CERTIFIER, FOREREACH_PLANNER, FOREREACH_LOGGER, FOREREACH_ROBOT_SIM}) {
      ++row.tries;
      std::vector<std::string> command{program, "--config", task, "--lcm-url", url};
      if (program == std::string(FOREREACH_LOGGER)) command.insert(command.end(), {"--directory", scratch / "log"});
      ChildProcess process(command);
      const auto code = process.WaitForExit(std::chrono::seconds(10));
      const std::string error = process.error();
      const auto says = [&error](const std::string& what) { return error.find(what) != std::string::npos; };
      if (code == 2 && says(url) && says("ip route add 224.0.0.0/4 dev lo") && !says("ready on")) ++row.said_why;
      progress_->Advance();
    }
    Remark(row, "exit 2 and advice");
  }

  void LostRoute() {
    const std::string fault = "The multicast route goes for a second, and comes back";
    const OwnNetwork network;
    if (!network.works()) return NotTried(fault, OwnNetwork::kNeeds);
    Rig rig(DemoTask());
    Row& row = Begin(fault);
    const auto not_sent = [&] { return rig.witness().status() ? rig.witness().status()->messages_not_sent : 0; };
    row.bus_loses = true;
    Tries(row, rig, [&](int) {
      const std::int64_t before = not_sent();
      Demand(row, network.SetRoute(false), "the route stays");
      rig.Listen(milliseconds(1000));
      Demand(row, network.SetRoute(true), "the route does not come back");
      const bool counted = rig.ListenUntil([&] { return not_sent() > before; }, kSaysSoon);
      Demand(row, counted, "the certifier counts no message that the bus refused");
    });
  }
};

}  // namespace

void Networks(Campaign& campaign) { Networked(campaign).BadNetwork(); }
void Datagrams(Campaign& campaign) { Networked(campaign).Datagrams(); }
void Routes(Campaign& campaign) { Networked(campaign).Routes(); }

}  // namespace forereach
