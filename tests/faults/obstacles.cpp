// Obstacles that are silent, late, garbage, or suddenly there; and two certifiers.
#include <limits>
#include <map>

#include "tests/faults/demo_task.h"
#include "tests/faults/kind.h"
#include "tests/messages.h"

namespace forereach {
namespace {

class Obstructed final : Kind {
 public:
  using Kind::Kind;

  void Obstacles() {
    ObstacleTries("The certifier is killed and starts while nobody sends OBSTACLES", [&](Row& row, Rig& rig, int) {
      rig.End(Rig::kCertifier, SIGKILL);
      rig.perception().SetSilent(true);
      rig.Start(Rig::kCertifier);
      rig.witness().Forget();
      static_cast<void>(rig.ListenUntil([&] { return rig.witness().status().has_value(); }, std::chrono::seconds(10)));
      const std::int64_t before = rig.witness().certificates();
      rig.Listen(milliseconds(Below(500)));
      DemandUnknown(row, rig, "before the obstacles were heard");
      Demand(row, rig.witness().certificates() == before, "it certified before it had heard the obstacles");
      rig.perception().SetSilent(false);
    });
    ObstacleTries("OBSTACLES fall silent", [&](Row& row, Rig& rig, int) { FallSilent(row, rig); });
    ObstacleTries("OBSTACLES with gaps, NaN, wrong counts, from the future (signed)", [&](Row& row, Rig& rig, int i) {
      rig.perception().SetSilent(true);
      rig.perception().SayNow([](obstacles_t&) { return true; });
      rig.perception().SayNow([&](obstacles_t& message) {
        switch (i % 5) {
          case 0: return false;  // lost: the next one is a gap
          case 1: message.obstacle[0].shape.point[0][1] = std::numeric_limits<double>::quiet_NaN(); break;
          case 2: message.num_obstacles = 65; break;
          case 3: message.utime += 60'000'000; break;
          default: message.obstacle[message.num_obstacles - 1].shape.kind = 99; break;
        }
        return true;
      });
      if (i % 5 == 0) rig.perception().SayNow([](obstacles_t&) { return true; });
      rig.Listen(milliseconds(50));
      DemandUnknown(row, rig, "after a message that was lost or refused");
      rig.perception().SetSilent(false);
    });
    ObstacleTries("Two certifiers; one of them is killed or stopped for 3 s", [&](Row&, Rig& rig, int i) {
      if (!rig.SecondCertifierIsAlive()) rig.StartSecondCertifier();
      rig.Listen(milliseconds(1000 + Below(500)));
      switch (i % 3) {
        case 0: rig.End(Rig::kCertifier, SIGKILL); break;
        case 1: rig.EndSecondCertifier(); break;
        default:
          rig.Signal(Rig::kCertifier, SIGSTOP);
          rig.Listen(milliseconds(3000));
          rig.Signal(Rig::kCertifier, SIGCONT);
      }
      rig.Listen(milliseconds(Below(500)));
    });
  }

  void Moving() {
    MovingTries("Moving OBSTACLES fall silent", [&](Row& row, Rig& rig, int, auto&) { FallSilent(row, rig); });
    MovingTries("Moving OBSTACLES come too late (signed)", [&](Row& row, Rig& rig, int, auto&) {
      rig.perception().SetSilent(true);
      rig.perception().SayNow([](obstacles_t& message) {
        message.utime -= 600'000;  // gate.max_age_ms is 500
        return true;
      });
      rig.Listen(milliseconds(50));
      DemandUnknown(row, rig, "after a message that was too late");
      rig.perception().SetSilent(false);
    });
    MovingTries("Moving OBSTACLES with garbage in windows, motion and stamps, or of another type (signed)",
                [&](Row& row, Rig& rig, int i, auto&) {
                  rig.perception().SetSilent(true);
                  if (i % 9 == 8)
                    rig.bus().Publish(rig.config().bus.obstacles, transition_t{});
                  else
                    rig.perception().SayNow([&](obstacles_t& message) {
                      Garble(message, i % 9);
                      return true;
                    });
                  rig.Listen(milliseconds(50));
                  DemandUnknown(row, rig, "after a message that was garbage");
                  rig.perception().SetSilent(false);
                });
    MovingTries("A moving obstacle jumps in front of the robot, and away again", [&](Row&, Rig& rig, int, auto& seen) {
      const certified_plan_t* plan = rig.witness().last_certified();
      const double ahead = plan ? plan->plan.initial_center[0] + 8 + Below(12) : 20;
      const auto jump = [&](const Obstacle& to) {
        const Digest before = ObstaclesDigest(seen);
        seen.back() = to;
        rig.witness().SetWorld({before, ObstaclesDigest(seen)});
        rig.perception().See(seen);
        rig.Listen(milliseconds(500));  // what was decided before it was heard has arrived
        rig.witness().SetWorld({ObstaclesDigest(seen)});
        rig.Listen(milliseconds(500 + Below(500)));
      };
      jump(Drifting(ahead, Below(9) - 4.0));
      jump(Drifting(60, 14));
    });
    Walls();
  }

 private:
  // The obstacles that are sent are not known to the certifier: every candidate is refused for that.
  void FallSilent(Row& row, Rig& rig) {
    rig.perception().SetSilent(true);
    rig.Listen(milliseconds(1100));  // gate.obstacles_timeout_ms is 1000
    const std::int64_t before = rig.witness().certificates();
    for (int j = 0; j < 3; ++j) DemandUnknown(row, rig, "after the timeout");
    Demand(row, rig.witness().certificates() == before, "it certified after the timeout");
    rig.perception().SetSilent(false);
  }

  // The same where one of the obstacles moves. `hurt` is told all of them.
  void MovingTries(const std::string& fault, const std::function<void(Row&, Rig&, int, std::vector<Obstacle>&)>& hurt) {
    std::vector<Obstacle> seen = WithADriftingOne();
    Rig rig(DemoTaskOnTheBus(400), {.seen = seen});
    rig.witness().SetWorld({ObstaclesDigest(seen)});
    Row& row = Begin(fault);
    told_unknown_ = 0;
    Tries(row, rig, [&](int i) { hurt(row, rig, i, seen); });
    if (told_unknown_ > 0) Remark(row, std::to_string(told_unknown_) + " candidates answered no_obstacles");
  }

  // Of a piece of a prediction: each is refused as a whole message.
  static void Garble(obstacles_t& message, int way) {
    constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max();
    obstacle_t& piece = message.obstacle[message.num_obstacles - 1];  // the one that moves
    switch (way) {
      case 0: piece.from_utime = message.utime + 1; return;  // it appears from nowhere
      case 1: piece.from_utime = kMost, piece.until_utime = -kMost; return;
      case 2: piece.growth = -1; return;
      case 3: piece.velocity[0] = std::numeric_limits<double>::quiet_NaN(); return;
      case 4: piece.utime = kMost; return;
      case 5: piece.uncertainty = std::numeric_limits<double>::infinity(); return;
      case 6: piece.gone = 2; return;
      default:  // a gap between two pieces
        obstacle_t& next = message.obstacle[message.num_obstacles++];
        next = piece;
        piece.until_utime = message.utime + 1'000'000;
        next.from_utime = message.utime + 1'000'001;
    }
  }

  // The plan that the robot drives is withdrawn, and what of it stands is used up.
  void Walls() {
    std::vector<Obstacle> seen = OfTheCourse();
    Rig rig(DemoTaskOnTheBus(), {.seen = seen});
    rig.witness().SetWorld({ObstaclesDigest(seen)});
    std::int64_t last_withdrawn = 0, withdrawn = 0, stops = 0, short_stops = 0;
    std::map<std::int64_t, int> standing;  // by plan
    rig.Hear(rig.config().bus.withdrawn, [&](const Received& r) {
      const auto message = Decoded<withdrawal_t>(r.bytes);
      if (message && std::exchange(last_withdrawn, message->plan_id) != message->plan_id) ++withdrawn;
    });
    rig.Hear(rig.config().bus.event, [&](const Received& r) {
      const auto event = Decoded<execution_event_t>(r.bytes);
      if (event && event->kind == execution_event_t::WITHDRAWN) standing[event->plan_id] = event->step;
      if (!event || event->kind != execution_event_t::EMERGENCY_STOP) return;
      ++stops;
      short_stops += event->value < 0 || event->step + event->value > standing[event->plan_id];
    });
    Row& row = Begin("A wall appears across the way of the robot, and goes");
    Tries(row, rig, [&](int) {
      // A robot that has just begun to drive may end its plan before the wall.
      const std::int64_t before = withdrawn;
      for (int walls = 0; walls < 5 && withdrawn == before; ++walls) {
        rig.Listen(milliseconds(1500));
        const certified_plan_t* plan = rig.witness().last_certified();
        std::vector<Obstacle> walled = seen;
        const double ahead = (plan ? plan->plan.initial_center[0] : 0) + 2 + Below(6);
        walled.push_back(Obstacle::HalfSpace(Eigen::Vector2d(1, 0), ahead));
        rig.witness().SetWorld({ObstaclesDigest(seen), ObstaclesDigest(walled)});
        rig.perception().See(walled);
        rig.Listen(milliseconds(1000));
        rig.witness().SetWorld({ObstaclesDigest(walled)});
        rig.Listen(milliseconds(500));
        rig.witness().SetWorld({ObstaclesDigest(seen), ObstaclesDigest(walled)});
        rig.perception().See(seen);
        rig.Listen(milliseconds(500));
        rig.witness().SetWorld({ObstaclesDigest(seen)});
      }
    });
    Demand(row, withdrawn > 0, "no plan was withdrawn");
    Remark(row, std::to_string(withdrawn) + " plans withdrawn, " + std::to_string(stops) + " emergency stops, " +
                    std::to_string(short_stops) + " of them by a wall nearer than the brakes can stop");
  }
};

}  // namespace

void Obstacles(Campaign& campaign) { Obstructed(campaign).Obstacles(); }
void Moving(Campaign& campaign) { Obstructed(campaign).Moving(); }

}  // namespace forereach
