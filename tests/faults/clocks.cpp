// Clocks that jump, clocks that are off, stamps that are old, and a certifier that does not run for a while.
#include <cmath>

#include "lcmtypes/names.h"
#include "tests/faults/demo_task.h"
#include "tests/faults/kind.h"
#include "tests/messages.h"

namespace forereach {
namespace {

constexpr std::chrono::seconds kAnewIfBackBy{-5};  // a shorter jump back is waited out

class Clocked final : Kind {
 public:
  using Kind::Kind;

  void Clocks() {
    for (const Rig::Role role : {Rig::kCertifier, Rig::kPlanner, Rig::kRobot, Rig::kLogger}) OneClock(role);
    AllClocks();
  }

  void Times() {
    OffClock("behind", microseconds(-400'000));
    OffClock("ahead", microseconds(400'000));
    StaleWall();
    StoppedCertifier();
  }

 private:
  // 0.3 s to an hour, forward or backward.
  microseconds Jump() {
    const double seconds = 0.3 * std::pow(3600 / 0.3, std::uniform_real_distribution<double>(0, 1)(random_));
    return microseconds(std::llround((Below(2) == 0 ? 1e6 : -1e6) * seconds));
  }

  // For a second one process is at odds with the others.
  void OneClock(Rig::Role role) {
    Rig rig(DemoTask(), {.settable_clocks = true});
    Row& row = Begin(std::string("The clock of the ") + Rig::kNames[role] + " jumps by 0.3 s to an hour, and back");
    Tries(row, rig, [&](int) {
      rig.SetClock(role, Jump());
      rig.Listen(milliseconds(1000));
      rig.SetClock(role, microseconds(0));
      rig.Listen(milliseconds(200));
      if (role == Rig::kCertifier) DemandLatched(row, rig, fault_t::CLOCK_JUMP);
    });
  }

  // As when the machine's clock is set. Whoever begins after it went back signs with times that were used before it
  // did, so all begin anew.
  void AllClocks() {
    Rig rig(DemoTask(), {.settable_clocks = true});
    Row& row = Begin("All clocks jump by 0.3 s to an hour, and stay");
    microseconds offset(0);
    int anew = 0;
    Tries(row, rig, [&](int) {
      const microseconds jump = Jump();
      rig.SetClocks(offset += jump);
      rig.Listen(milliseconds(1000));
      DemandLatched(row, rig, fault_t::CLOCK_JUMP);
      if (jump < kAnewIfBackBy) rig.EndAll(), ++anew;
    });
    Remark(row, std::to_string(anew) + " times back by more than 5 s: all started again");
  }

  // A robot that starts with a clock that is off: its states come, and nothing is certified on them.
  void OffClock(const char* how, microseconds offset) {
    std::vector<Obstacle> seen = WithADriftingOne();
    Rig rig(DemoTaskOnTheBus(200), {.settable_clocks = true, .seen = seen});
    rig.witness().SetWorld({ObstaclesDigest(seen)});
    Row& row = Begin(std::string("The clock of the robot is 0.4 s ") + how + " from its start");
    const auto start_with = [&](microseconds clock) {
      rig.End(Rig::kRobot);
      rig.SetClock(Rig::kRobot, clock);
      rig.Start(Rig::kRobot);
    };
    Tries(row, rig, [&](int) {
      start_with(offset);
      rig.witness().Forget();
      const auto says_so = [&] {
        // One that takes long to start is lost, which a person has to clear.
        if (rig.witness().fault()) rig.witness().ForgetFault(), rig.Command(command_t::RESET);
        return Says(rig, std::string("the robot's clock is ") + how);
      };
      Demand(row, rig.ListenUntil(says_so, kStarts), "the heartbeat does not say that the robot's clock is off");
      const std::int64_t before = rig.witness().certificates();
      for (int j = 0; j < 3; ++j) {
        const auto cause = CauseOfACandidate(rig);
        Demand(row, cause == decision_t::CAUSE_NOT_ARMED || cause == decision_t::CAUSE_FAULT,
               "a candidate was answered " + std::string(cause ? CauseName(*cause) : "nothing"));
      }
      rig.Listen(kHeartbeat);
      Demand(row, rig.witness().certificates() == before, "it certified on states of a clock that is off");
      start_with(microseconds(0));
    });
  }

  // The robot drives. From then on all that comes is a wall across its way, with stamps that are 2 s old.
  void StaleWall() {
    const std::vector<Obstacle> seen = OfTheCourse();
    Rig rig(DemoTaskOnTheBus(), {.seen = seen});
    std::int64_t withdrawn = 0, stops = 0;
    rig.Hear(rig.config().bus.withdrawn, [&](const Received& r) {
      const auto message = Decoded<withdrawal_t>(r.bytes);
      withdrawn += message && message->cause == withdrawal_t::OBSTACLES_LOST;
    });
    rig.Hear(rig.config().bus.event, [&](const Received& r) {
      const auto event = Decoded<execution_event_t>(r.bytes);
      stops += event && event->kind == execution_event_t::EMERGENCY_STOP;
    });
    Row& row = Begin("A wall with stamps 2 s old while a plan is under way (signed)");
    std::int64_t all_stops = 0;
    Tries(row, rig, [&](int) {
      withdrawn = stops = 0;
      // A plan of a robot that has just begun to drive may end before the obstacles are lost.
      for (int walls = 0; walls < 5 && stops == 0; ++walls) {
        if (walls > 0) rig.Listen(milliseconds(1000 + Below(1000)));
        SendStaleWall(row, rig, seen, [&] { return stops > 0; });
      }
      Demand(row, withdrawn > 0 && stops > 0, "no plan was withdrawn, or the robot did not stop");
      all_stops += stops;
    });
    Remark(row, std::to_string(all_stops) + " emergency stops");
  }

  void SendStaleWall(Row& row, Rig& rig, const std::vector<Obstacle>& seen, const std::function<bool()>& stopped) {
    std::vector<Obstacle> with_wall = seen;
    with_wall.push_back(Obstacle::HalfSpace(Eigen::Vector2d(1, 0), 30));
    rig.perception().SetSilent(true);
    rig.perception().See(with_wall);
    std::int64_t before = 0;
    for (int j = 0; j < 20 && !stopped(); ++j) {
      rig.perception().SayNow([](obstacles_t& message) {
        message.utime -= 2'000'000;
        return true;
      });
      rig.Listen(milliseconds(100));
      if (j == 0) before = rig.witness().certificates();  // what was decided before has arrived
    }
    Demand(row, rig.witness().certificates() == before, "it certified after the wall was refused");
    rig.perception().See(seen);
    rig.perception().SetSilent(false);
  }

  // What it has not heard meanwhile, it has not heard because it did not run.
  void StoppedCertifier() {
    const std::vector<Obstacle> seen = OfTheCourse();
    Rig rig(DemoTaskOnTheBus(), {.seen = seen});
    Row& row = Begin("The certifier is stopped for 2 s");
    int faults = 0, explained = 0;
    Tries(row, rig, [&](int) {
      rig.witness().ForgetFault();
      rig.Signal(Rig::kCertifier, SIGSTOP);
      rig.Listen(milliseconds(2000));
      rig.Signal(Rig::kCertifier, SIGCONT);
      rig.Listen(kHeartbeat);
      const auto& fault = rig.witness().fault();
      if (!fault) return;
      ++faults;
      DemandLatched(row, rig, fault_t::ROBOT_STATE_LOST);
      const bool says_so = GetText(fault->message).find("this certifier itself did not run") != std::string::npos;
      Demand(row, says_so, "it blames the robot: " + GetText(fault->message));
      explained += says_so;
    });
    Remark(row, std::to_string(faults) + " faults latched, " + std::to_string(explained) +
                    " of them say that the certifier did not run");
  }

  // What the heartbeat says last.
  static bool Says(const Rig& rig, const std::string& what) {
    const auto& status = rig.witness().status();
    return status && GetText(status->message).find(what) != std::string::npos;
  }
};

}  // namespace

void Clocks(Campaign& campaign) { Clocked(campaign).Clocks(); }
void Times(Campaign& campaign) { Clocked(campaign).Times(); }

}  // namespace forereach
