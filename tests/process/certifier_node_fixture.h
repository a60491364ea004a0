/** The certifier's node on an in-memory bus with a simulated clock. */
#pragma once

#include "certifier/process/certifier_node.h"
#include "tests/certifier/small_task.h"
#include "tests/test.h"

namespace forereach {

struct CertifierNodeTest : testing::Test {
  CertifierNodeTest() {
    config_.gate.queue = 4;
    config_.bus.decision = "MY_DECISION";  // a config may rename channels
    Restart();
  }

  // A new bus too: who subscribed to the old one has to again.
  void Restart() {
    node_.reset();
    bus_ = OpenBus("memq://", clock_);
    node_ = std::make_unique<CertifierNode>(config_, *bus_, clocks_);
    bus_->Subscribe("MY_DECISION", [this](const Received& r) {
      decisions_.push_back(Decoded<decision_t>(r.bytes).value());
      order_ += 'd';
    });
    bus_->Subscribe("PLAN_CERTIFIED", [this](const Received& r) {
      certified_.push_back(Decoded<certified_plan_t>(r.bytes).value());
      order_ += 'c';
    });
    Hear(*bus_, "CERTIFIER_STATUS", status_);
    Hear(*bus_, "FAULT", faults_);
  }

  void Run() {
    bus_->Dispatch(0);  // candidates to the node
    node_->Tick(now_us_);
    bus_->Dispatch(0);  // its answers to us
  }
  std::vector<int> Causes() const {
    std::vector<int> causes;
    for (const decision_t& decision : decisions_) causes.push_back(decision.cause);
    return causes;
  }
  decision_t Ask(double acceleration = kAccelerationThatCertifies) {
    bus_->Publish("PLAN_CANDIDATE", Candidate(next_plan_id_++, acceleration, now_us_));
    Run();
    return decisions_.back();
  }
  // Each look at a clock takes so long, from the next start on.
  void SlowDown(std::int64_t us) {
    const Clock slow = [this, us] { return now_us_ += us; };
    clocks_ = {slow, slow};
  }

  std::int64_t now_us_ = kNow;
  Config config_ = SmallTask();
  const Clock clock_ = [this] { return now_us_; };
  Clocks clocks_{clock_, clock_};
  std::unique_ptr<Bus> bus_;
  std::unique_ptr<CertifierNode> node_;
  std::vector<decision_t> decisions_;
  std::vector<certified_plan_t> certified_;
  std::vector<certifier_status_t> status_;
  std::vector<fault_t> faults_;
  std::string order_;
  std::int64_t next_plan_id_ = 1;
};

struct ObstaclesNodeTest : CertifierNodeTest {
  ObstaclesNodeTest() {
    config_.gate.obstacles = ObstaclesSource::kBus;
    config_.gate.obstacles_lost_ms = kNeverLost;
    Restart();
  }

  obstacles_t Seen(const std::vector<Obstacle>& obstacles) { return Sighted(obstacles, now_us_, next_sequence_++); }
  void Say(const std::vector<Obstacle>& obstacles) { bus_->Publish("OBSTACLES", Seen(obstacles)); }
  // The decision and the heartbeat say so.
  void ExpectUnknown(const std::string& why) {
    const decision_t decision = Ask();
    EXPECT_FIELDS(decision, (outcome, decision_t::ABSTAIN_OBSTACLES), (cause, decision_t::CAUSE_NO_OBSTACLES));
    EXPECT_THAT(GetText(decision.message), HasSubstr("abstained: waits for OBSTACLES: " + why));
    now_us_ += CertifierNode::kHeartbeatUs;
    Run();
    EXPECT_FIELDS(status_.back(), (level, certifier_status_t::STALE), (state, certifier_status_t::DISARMED),
                  (obstacles_known, 0));
    EXPECT_THAT(GetText(status_.back().message), HasSubstr("waits for OBSTACLES: " + why));
  }

  const std::vector<Obstacle> kOnTheWay{Obstacle::Circle(Eigen::Vector2d(1, 0), 0.3)};
  std::int64_t next_sequence_ = 0;
};

struct ArmedNodeTest : CertifierNodeTest {
  ArmedNodeTest() {
    config_.gate.needs_robot_state = true;
    Restart();
  }

  void Pass(std::int64_t us) { now_us_ += us; }

  // The robot stands at the origin of the small task, or executes a plan.
  robot_state_t State(std::int64_t plan_id = -1, int step = -1) {
    robot_state_t state = StateOf(now_us_, sequence_++, plan_id, step);
    state.state[2] = 1, state.state[3] = 0.1;
    return state;
  }
  void SayState(const robot_state_t& state) {
    bus_->Publish("ROBOT_STATE", state);
    Run();
  }
  void Reset(std::int64_t utime) {
    bus_->Publish("COMMAND", ResetAt(utime));
    Run();
  }
  void Reset() {
    Pass(1);
    Reset(now_us_);
  }
  // A state beyond the upper bound of a slice of the plan by `outside`, which is judged by what it says itself.
  robot_state_t AtUpperBound(const certified_plan_t& plan, int step) {
    ++sequence_;  // a lost message between
    robot_state_t state = State(plan.plan.plan_id, step);
    std::copy_n(plan.slice_upper[std::clamp(step, 0, 10)], 4, state.state);
    return state;
  }

  std::int64_t sequence_ = 0;
};

}  // namespace forereach
