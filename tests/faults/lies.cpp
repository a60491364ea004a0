// Somebody with a key who lies, sends nonsense, floods, or is there twice.
#include <algorithm>
#include <array>
#include <atomic>
#include <set>
#include <thread>

#include "bus/process.h"
#include "lcmtypes/names.h"
#include "tests/faults/demo_task.h"
#include "tests/faults/kind.h"
#include "torture/hostile_messages.h"

namespace forereach {
namespace {

constexpr milliseconds kTwoAreThere{2000}, kIsHeard{50};
constexpr std::array<int, 3> kTimesTheRate{1, 3, 10};

class Lied final : Kind {
 public:
  using Kind::Kind;

  // Signed: the liar has the key.
  void Lies() {
    Rig rig(DemoTask());
    Row& row = Begin("A robot that lies about its state (signed)");
    std::int64_t sequence = Witness::kFirstLie;
    Tries(row, rig, [&](int) {
      for (int j = 0; j < 20; ++j) {
        robot_state_t state = State(rig);
        state.sequence = sequence++;
        state.executing_plan_id = j % 2 == 0 ? WallClockUs() : -1;
        for (int k = 0; k < state.num_states; ++k) state.state[k] = j % 5 == 4 ? 1e300 : Below(100) - 50;
        rig.bus().Publish(rig.config().bus.robot_state, state);
        rig.Listen(milliseconds(5));
      }
      robot_state_t state = StateOutside(rig);
      state.sequence = sequence++;
      rig.bus().Publish(rig.config().bus.robot_state, state);
      static_cast<void>(rig.ListenUntil([&] { return rig.witness().fault().has_value(); }, kSaysSoon));
      rig.Listen(kHeartbeat);
      DemandLatched(row, rig, fault_t::SLICE_LEFT);
    });
  }

  void Strangers() {
    Rig rig(DemoTask());
    Row& row = Begin("A robot that executes what nobody certified (signed)");
    std::int64_t sequence = Witness::kFirstLie;
    Tries(row, rig, [&](int i) {
      // As long as a plan of the certifier before it may run: 2 s, twice the age of a message, and 128 steps.
      if (i == 0) rig.Listen(std::chrono::seconds(17));
      if (i == 0 && !rig.Heal().empty()) return Demand(row, false, "it is not well after a while");
      rig.witness().ForgetFault();
      robot_state_t state = State(rig);
      state.mode = robot_state_t::EXECUTING;
      state.sequence = sequence++;
      const certified_plan_t& last = *rig.witness().last_certified();
      state.executing_plan_id = i % 2 == 0 ? WallClockUs() : last.plan.plan_id;
      state.executing_step = i % 2 == 0 ? 0 : last.plan.num_steps;
      if (i % 2 != 0) std::copy_n(last.slice_lower[last.plan.num_steps], state.num_states, state.state);
      rig.bus().Publish(rig.config().bus.robot_state, state);
      static_cast<void>(rig.ListenUntil([&] { return rig.witness().fault().has_value(); }, kSaysSoon));
      rig.Listen(kHeartbeat);
      DemandLatched(row, rig, fault_t::UNCERTIFIED_PLAN);
    });
  }

  void Nonsense() {
    Rig rig(DemoTask());
    Row& row = Begin("A planner that sends NaN, wrong sizes, garbage (signed)");
    std::int64_t id = 1;
    std::set<RawMessage> sent;
    Tries(row, rig, [&](int) {
      for (int j = 0; j < 50; ++j) {
        candidate_plan_t candidate = CandidateFor(rig.config(), id++, Eigen::Vector2d(0, 0), 6, milliseconds(100));
        SetText(candidate.source, "nonsense");
        const CandidateFlaw& flaw = CandidateFlaws()[static_cast<std::size_t>(j) % CandidateFlaws().size()];
        const auto messages = flaw.make(candidate, WallClockUs());
        const RawMessage& message = messages[static_cast<std::size_t>(random_()) % messages.size()];
        // The same bytes twice are two candidates with one digest, which the witness cannot tell apart.
        if (sent.insert(message).second) rig.bus().Publish(rig.config().bus.candidate, Bytes(message));
        if (j % 10 == 0) rig.Listen(milliseconds(5));
      }
    });
  }

  void Floods() {
    Rig rig(DemoTask());
    Row& row = Begin("A flood of " + std::to_string(options_.floods) + " candidates (signed)", 1);
    std::int64_t candidates = 0;
    row.bus_loses = true;
    Tries(row, rig, [&](int) {
      candidate_plan_t candidate = CandidateFor(rig.config(), 1, Eigen::Vector2d(0, 0), 12, milliseconds(500));
      SetText(candidate.source, "flood");
      const std::int64_t before = rig.witness().decisions();
      for (int i = 0; i < options_.floods; ++i) {
        candidate.plan_id = i + 1;
        candidate.sequence = i;
        candidate.utime = WallClockUs();
        candidate.start_utime = candidate.utime + 500'000;
        rig.bus().Publish(rig.config().bus.candidate, candidate);
        if (i % 16 == 0) rig.Listen(milliseconds(0)), rig.open_bus().Dispatch(0);
      }
      rig.Listen(milliseconds(1500));
      candidates = rig.witness().decisions() - before;
    });
    if (rig.witness().status())
      Remark(row, std::to_string(candidates) + " decisions heard; the certifier counts " +
                      std::to_string(rig.witness().status()->candidates) + " decided on and " +
                      std::to_string(rig.witness().status()->candidates_lost) + " that the bus lost");
    if (rig.witness().unjudged() > 0)
      Remark(row, std::to_string(rig.witness().unjudged()) +
                      " executed plans not judged: the campaign lost messages itself");
  }

  void Senders() {
    TwoPerceptions();
    TwoRobots();
  }

 private:
  // The second one was left running, and sees nothing.
  void TwoPerceptions() {
    std::int64_t told = 0;
    ObstacleTries(
        "Two senders of OBSTACLES with one key, the second sees nothing, at 1, 3 and 10 times the rate (signed)",
        [&](Row& row, Rig& rig, int i) {
          GateOptions faster = rig.config().gate;
          faster.obstacles_timeout_ms /= kTimesTheRate[static_cast<std::size_t>(i) % kTimesTheRate.size()];
          const Perception second(OpenBusOfAllRoles(rig.config().bus), rig.config().bus.obstacles, faster, {});
          if (i % 2 == 1) rig.End(Rig::kCertifier, SIGKILL), rig.Start(Rig::kCertifier);
          rig.Listen(i % 2 == 1 ? milliseconds(800) : kIsHeard);
          DemandNoneFor(row, rig, kTwoAreThere, decision_t::CAUSE_NO_OBSTACLES, told);
        });
    Remark(rows_.back(), std::to_string(told) + " candidates answered no_obstacles while two were heard");
  }

  // The second one stands, at up to ten times the rate.
  void TwoRobots() {
    Rig rig(DemoTask());
    Row& row = Begin("A second robot under the same name, at 1, 3 and 10 times the rate (signed)");
    std::int64_t told = 0, sequence = Witness::kFirstLie;
    Tries(row, rig, [&](int i) {
      const milliseconds period(150 / kTimesTheRate[static_cast<std::size_t>(i) % kTimesTheRate.size()]);
      std::atomic<bool> ends = false;
      std::thread second([&] {
        const auto bus = OpenBusOfAllRoles(rig.config().bus);
        for (; !ends; std::this_thread::sleep_for(period)) {
          robot_state_t state = State(rig);
          state.sequence = sequence++;
          bus->Publish(rig.config().bus.robot_state, state);
        }
      });
      rig.Listen(kIsHeard);
      DemandNoneFor(row, rig, kTwoAreThere, decision_t::CAUSE_NOT_ARMED, told);
      rig.Listen(kHeartbeat);
      const auto& status = rig.witness().status();
      Demand(row, status && (status->fault != 0 || GetText(status->message).find("two senders") != std::string::npos),
             "the heartbeat does not name two senders");
      ends = true;
      second.join();
    });
    Remark(row, std::to_string(told) + " candidates answered not_armed while two were heard");
  }

  // While two senders are heard, and for the stream's timeout afterwards, every candidate is refused for that.
  void DemandNoneFor(Row& row, Rig& rig, milliseconds time, std::int16_t cause, std::int64_t& told) {
    const std::int64_t before = rig.witness().certificates();
    const auto end = std::chrono::steady_clock::now() + time;
    while (std::chrono::steady_clock::now() < end) {
      const auto answer = CauseOfACandidate(rig);
      Demand(row, answer == cause || answer == decision_t::CAUSE_FAULT || answer == decision_t::CAUSE_NOT_ARMED,
             "a candidate was answered " + std::string(answer ? CauseName(*answer) : "nothing") + " with two senders");
      told += answer == cause;
      rig.Listen(milliseconds(20));
    }
    Demand(row, rig.witness().certificates() == before, "it certified while two senders were heard");
  }
};

}  // namespace

void Lies(Campaign& campaign) { Lied(campaign).Lies(); }
void Strangers(Campaign& campaign) { Lied(campaign).Strangers(); }
void Nonsense(Campaign& campaign) { Lied(campaign).Nonsense(); }
void Floods(Campaign& campaign) { Lied(campaign).Floods(); }
void Senders(Campaign& campaign) { Lied(campaign).Senders(); }

}  // namespace forereach
