// Planner, certifier and simulated robot on one bus and a simulated clock: a wall appears across the whole way.
#include "tests/test.h"

#include "certifier/process/certifier_node.h"
#include "planner_bridge/planner_node.h"
#include "simulator/sim_node.h"
#include "tests/messages.h"
#include "tests/planner_bridge/tasks.h"

namespace forereach::withdrawal_run_test {

Config Task() {
  Config config = Bicycle();
  config.gate.obstacles = ObstaclesSource::kBus;
  config.gate.obstacles_lost_ms = kNeverLost;
  config.grounds = GroundsOf(DigestOf(std::string_view("withdrawal run")), *config.problem, config.obstacles);
  config.robot.step_period_ms = 100;  // model.dt: other steps are not learned
  config.robot.time_limit_s = 60;
  return config;
}

struct WithdrawalRunTest : testing::Test {
  WithdrawalRunTest() {
    bus_->Subscribe(config_.bus.event, [this](const Received& received) {
      ++events_[Decoded<execution_event_t>(received.bytes).value().kind];
    });
    bus_->Subscribe(config_.bus.withdrawn, [this](const Received& received) {
      withdrawn_.push_back(Decoded<withdrawal_t>(received.bytes).value());
    });
  }

  void RunFor(std::int64_t us) {
    for (const std::int64_t end = now_ + us; now_ < end; now_ += 1000) {
      if (now_ % 100'000 == 0) SendObstacles();
      for (Node* node : std::initializer_list<Node*>{&robot_, &planner_, &certifier_}) {
        node->Tick(now_);
        while (bus_->Dispatch(0) > 0) {
        }
      }
    }
  }
  void SendObstacles() { bus_->Publish(config_.bus.obstacles, Sighted(obstacles_, now_, sequence_++)); }
  // Everything from so many metres ahead of the robot on is unsafe.
  double SeeWall(double ahead) {
    const double offset = robot_.state()[0] + ahead;
    obstacles_ = {Obstacle::HalfSpace(Vec({1, 0}), offset)};
    SendObstacles();
    return offset;
  }
  double Speed() const { return robot_.state()[3]; }
  nlohmann::json Planner() const { return nlohmann::json::parse(planner_.Summary()); }

  const Config config_ = Task();
  std::int64_t now_ = 1'700'000'000'000'000, sequence_ = 0;
  const Clock clock_ = [this] { return now_; };
  std::vector<Obstacle> obstacles_;
  std::unique_ptr<Bus> bus_ = OpenBus("memq://", clock_);
  std::ostringstream out_;
  CertifierNode certifier_{config_, *bus_, {clock_, clock_}};
  PlannerNode planner_{config_, *bus_, out_};
  RobotSimNode robot_{config_, *bus_, out_};
  std::map<int, int> events_;
  std::vector<withdrawal_t> withdrawn_;
};

TEST_F(WithdrawalRunTest, ACertifiedStopTakesOverBeforeAWallThatAppears) {
  RunFor(3'750'000);
  for (const int started = events_[execution_event_t::STARTED]; events_[execution_event_t::STARTED] == started;)
    RunFor(1'000);
  ASSERT_GT(Speed(), 3.5) << "it drives";
  const double braking = 0.95 * 3;
  const double wall = SeeWall(Speed() * Speed() / (2 * braking) + 4);
  RunFor(4'500'000);
  ASSERT_FALSE(withdrawn_.empty());
  EXPECT_GE(Planner()["stopping_rounds"], 1);
  EXPECT_EQ(events_[execution_event_t::EMERGENCY_STOP], 0);
  EXPECT_EQ(events_[execution_event_t::CONTACT], 0);
  EXPECT_LT(robot_.state()[0], wall);
  EXPECT_LT(std::abs(Speed()), 1) << "it creeps at most";
}

TEST_F(WithdrawalRunTest, AWallTooNearToStopBeforeItIsAnEmergency) {
  RunFor(3'750'000);
  ASSERT_GT(Speed(), 3.5);
  const double wall = SeeWall(1.5);
  RunFor(4'500'000);
  ASSERT_FALSE(withdrawn_.empty());
  EXPECT_EQ(events_[execution_event_t::EMERGENCY_STOP], 1);
  EXPECT_LT(robot_.state()[0], wall) << "the simulated robot's emergency stop takes no way";
}

}  // namespace forereach::withdrawal_run_test
