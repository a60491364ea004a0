// Two certifiers on one bus: one is in charge.
#include "tests/test.h"

#include "tests/process/certifier_node_fixture.h"

namespace forereach::two_certifiers_test {

struct TwoCertifiersTest : ObstaclesNodeTest {
  // Each hears the robot's obstacles, and both are run in turn, unless paused.
  void Start(std::size_t i) {
    nodes_[i] = std::make_unique<CertifierNode>(config_, buses_[i], clocks_, Charge::kListenUs);
    nodes_[i]->Tick(now_us_);
  }
  TwoCertifiersTest() {
    node_.reset();
    for (SharedBus& bus : buses_) bus.others = &buses_, bus.clock = clock_;
    listener_.others = &buses_;
  }
  void StartInTurn() {
    for (const std::size_t i : {0, 1}) Start(i), Pass(1'000'000);
  }

  void Pass(std::int64_t us) {
    for (const std::int64_t end = now_us_ + us; now_us_ < end; now_us_ += 2000) {
      if (now_us_ >= next_seen_us_) {
        next_seen_us_ = now_us_ + 200'000;
        listener_.Publish("OBSTACLES", Seen(says_));
      }
      for (std::size_t i = 0; i < 2; ++i) {
        if (!nodes_[i] || paused_[i]) continue;
        buses_[i].Dispatch(0);
        nodes_[i]->Tick(now_us_);
      }
    }
  }
  // Answers that come to one candidate, by both.
  std::vector<decision_t> Answers() {
    const std::int64_t id = next_plan_id_++;
    listener_.Publish("PLAN_CANDIDATE", Candidate(id, kAccelerationThatCertifies, now_us_));
    Pass(400'000);
    std::vector<decision_t> answers;
    for (SharedBus& bus : buses_)
      for (const auto& [channel, bytes] : bus.sent)
        if (const auto decision = Decoded<decision_t>(bytes); decision && decision->plan_id == id)
          answers.push_back(*decision);
    return answers;
  }
  certifier_status_t Status(std::size_t i) const {
    certifier_status_t status{};
    for (const auto& [channel, bytes] : buses_[i].sent)
      if (const auto decoded = Decoded<certifier_status_t>(bytes)) status = *decoded;
    return status;
  }
  std::array<Charge::State, 2> States() const { return {nodes_[0]->charge().state(), nodes_[1]->charge().state()}; }

  // What one says reaches all, itself too, as multicast does.
  struct SharedBus final : Bus {
    using Bus::Publish;
    void Subscribe(const std::string& channel, Handler handler) override { handlers[channel] = std::move(handler); }
    bool Publish(const std::string& channel, Bytes bytes) override {
      sent.push_back({channel, {bytes.begin(), bytes.end()}});
      for (SharedBus& bus : *others) bus.arrived.push_back(sent.back());
      return true;
    }
    int Dispatch(int) override {
      const auto now = std::exchange(arrived, {});
      for (const auto& [channel, bytes] : now)
        if (handlers.contains(channel)) handlers[channel](Received{channel, bytes, clock(), bytes});
      return static_cast<int>(now.size());
    }
    [[nodiscard]] std::int64_t dropped() const override { return 0; }

    std::array<SharedBus, 2>* others = nullptr;
    std::map<std::string, Handler> handlers;
    std::vector<std::pair<std::string, std::vector<std::uint8_t>>> sent, arrived;
    Clock clock;
  };

  std::array<SharedBus, 2> buses_;
  SharedBus listener_;  // sends only
  std::array<std::unique_ptr<CertifierNode>, 2> nodes_;
  std::array<bool, 2> paused_{};
  std::int64_t next_seen_us_ = 0;
  std::vector<Obstacle> says_;
};

using Charged = std::array<Charge::State, 2>;
constexpr auto kInCharge = Charge::State::kInCharge, kStandingBy = Charge::State::kStandingBy;

TEST_F(TwoCertifiersTest, TheLaterOneRefusesToArmAndAnswersNobody) {
  StartInTurn();
  EXPECT_EQ(States(), (Charged{kInCharge, kStandingBy}));
  for (int i = 0; i < 5; ++i) {
    EXPECT_EQ(Only(Answers()).outcome, decision_t::CERTIFIED);
  }
  for (const auto& [channel, bytes] : buses_[1].sent) EXPECT_EQ(channel, "CERTIFIER_STATUS");
  Pass(600'000);
  const certifier_status_t first = Status(0), second = Status(1);
  EXPECT_FIELDS(first, (level, certifier_status_t::OK), (other_instance, second.instance));
  EXPECT_THAT(GetText(first.message), HasSubstr("another certifier"));
  EXPECT_FIELDS(second, (level, certifier_status_t::STALE), (state, certifier_status_t::STANDBY),
                (other_instance, first.instance), (candidates, 0), (by_cause[decision_t::CAUSE_SECOND_CERTIFIER], 5));
  EXPECT_THAT(GetText(second.message), HasSubstr("is in charge on this bus: this one decides nothing"));
  EXPECT_LT(first.started_utime, second.started_utime);
}

// Whichever begins first: candidates get the answer of the one that certifies, and a shadow is alone in charge at most.
TEST_F(TwoCertifiersTest, AShadowGivesWayToACertifierAndHoldsUpNone) {
  for (SharedBus& bus : buses_) bus.clock = clock_;
  config_.gate.shadow = true;
  Start(0);
  Pass(1'000'000);
  auto answers = Answers();
  EXPECT_EQ(Only(answers).cause, decision_t::CAUSE_SHADOW);
  config_.gate.shadow = false;
  Start(1);
  Pass(Charge::kListenUs + 100'000);
  EXPECT_EQ(States(), (Charged{kStandingBy, kInCharge}));
  for (int i = 0; i < 3; ++i) {
    answers = Answers();
    ASSERT_EQ(answers.size(), 1u) << "one decision on each candidate";
    EXPECT_EQ(answers[0].outcome, decision_t::CERTIFIED);
  }
  for (const auto& [channel, bytes] : buses_[0].sent) EXPECT_NE(channel, "PLAN_CERTIFIED");
  EXPECT_EQ(Status(0).shadow, 1);
  config_.gate.shadow = true;
  Start(0);  // again, and later
  Pass(1'000'000);
  EXPECT_EQ(States(), (Charged{kStandingBy, kInCharge}));
  nodes_[1].reset();
  Pass(Charge::kSilenceUs + 2 * Charge::kListenUs);
  answers = Answers();
  EXPECT_EQ(Only(answers).cause, decision_t::CAUSE_SHADOW);
}

TEST_F(TwoCertifiersTest, OfTwoThatStartTogetherOneTakesChargeAndCandidatesWaitForIt) {
  Start(0);
  Start(1);
  EXPECT_EQ(Only(Answers()).cause, decision_t::CAUSE_NO_OBSTACLES) << "it has not listened to anything before";
  const bool first = Status(0).instance < Status(1).instance;
  EXPECT_EQ(States(), first ? (Charged{kInCharge, kStandingBy}) : (Charged{kStandingBy, kInCharge}));
  EXPECT_EQ(Answers().size(), 1u);
}

TEST_F(TwoCertifiersTest, TheLaterOneTakesOverOnceTheFirstIsSilentAndItsOwnWorldIsKnown) {
  says_ = kOnTheWay;
  StartInTurn();
  EXPECT_EQ(Answers().at(0).cause, decision_t::CAUSE_OBSTACLE);
  nodes_[0].reset();
  Pass(Charge::kSilenceUs - 500'000);
  EXPECT_TRUE(Answers().empty()) << "nobody is in charge";
  Pass(1'000'000);
  EXPECT_EQ(nodes_[1]->charge().state(), kInCharge);
  EXPECT_EQ(Status(1).level, certifier_status_t::OK);
  EXPECT_EQ(Answers().at(0).cause, decision_t::CAUSE_OBSTACLE);
  for (SharedBus& bus : buses_)
    for (const auto& [channel, bytes] : bus.sent) EXPECT_NE(channel, "PLAN_CERTIFIED");
}

TEST_F(TwoCertifiersTest, OneThatTakesOverWithoutObstaclesCertifiesNothing) {
  StartInTurn();
  nodes_[0].reset();
  next_seen_us_ = INT64_MAX;  // who sees them has died too
  Pass(3'000'000);
  EXPECT_EQ(nodes_[1]->charge().state(), kInCharge);
  EXPECT_EQ(Answers().at(0).cause, decision_t::CAUSE_NO_OBSTACLES);
}

TEST_F(TwoCertifiersTest, TheFirstGivesWayAfterAPauseInWhichTheSecondTookOver) {
  StartInTurn();
  paused_[0] = true;
  Pass(4'000'000);
  EXPECT_EQ(nodes_[1]->charge().state(), kInCharge);
  paused_[0] = false;
  for (int i = 0; i < 3; ++i) EXPECT_EQ(Answers().size(), 1u);
  EXPECT_EQ(States(), (Charged{kStandingBy, kInCharge}));
  EXPECT_EQ(Status(0).observations, static_cast<std::int64_t>(config_.problem->transitions.size()));
}

TEST_F(TwoCertifiersTest, APauseThatIsShorterThanTheTakeoverChangesNothing) {
  StartInTurn();
  for (const std::int64_t pause : {1'400'000, 1'600'000}) {
    paused_[0] = true;
    Pass(pause);
    paused_[0] = false;
    Pass(1'500'000);
    EXPECT_EQ(States(), (Charged{kInCharge, kStandingBy})) << pause;
    EXPECT_EQ(Answers().size(), 1u);
  }
}

// Where heartbeats are lost both may be in charge; the later one gives way, and forgets what it was certifying on.
TEST_F(TwoCertifiersTest, BothInChargeTheLaterGivesWay) {
  Start(0);
  Pass(1'000'000);
  std::array<SharedBus, 2> elsewhere;  // a cable is out
  for (SharedBus& bus : elsewhere) bus.others = &elsewhere, bus.clock = clock_;
  Start(1);
  buses_[0].others = &elsewhere;
  for (int i = 0; i < 500; ++i) {
    now_us_ += 2000;
    nodes_[1]->Tick(now_us_);
  }
  ASSERT_EQ(nodes_[1]->charge().state(), kInCharge);
  buses_[0].others = &buses_;
  Pass(700'000);
  EXPECT_EQ(States(), (Charged{kInCharge, kStandingBy}));
  EXPECT_EQ(Answers().size(), 1u);
  EXPECT_EQ(Status(1).candidates, 0);
}

TEST_F(TwoCertifiersTest, AFaultThatTheFirstHadLatchedIsTakenOver) {
  StartInTurn();
  listener_.Publish("TRANSITION", AtRest(now_us_, 1));
  Pass(700'000);
  ASSERT_EQ(Status(0).fault, fault_t::DECLARATION_FALSIFIED);
  EXPECT_EQ(Status(1).fault, 0);
  nodes_[0].reset();
  Pass(3'000'000);
  EXPECT_FIELDS(Status(1), (state, certifier_status_t::FAULT), (fault, fault_t::DECLARATION_FALSIFIED));
  EXPECT_THAT(GetText(Status(1).message), HasSubstr("latched by the certifier that was in charge before"));
  EXPECT_EQ(Answers().at(0).cause, decision_t::CAUSE_FAULT);
}

// After a reset the heartbeat of the first shows no fault any more, and still that the declaration is false.
TEST_F(TwoCertifiersTest, ADeclarationThatTheFirstHasSeenContradictedStaysFalse) {
  StartInTurn();
  listener_.Publish("TRANSITION", AtRest(now_us_, 1));
  Pass(700'000);
  const auto reset = [this] {
    listener_.Publish("COMMAND", ResetAt(now_us_));
    Pass(700'000);
  };
  reset();
  ASSERT_EQ(Status(0).fault, 0);
  nodes_[0].reset();
  Pass(3'000'000);
  EXPECT_EQ(Status(1).fault, fault_t::DECLARATION_FALSIFIED);
  reset();
  EXPECT_EQ(Status(1).fault, 0);
  EXPECT_EQ(Answers().at(0).outcome, decision_t::ABSTAIN_FALSIFIED);
}

TEST_F(TwoCertifiersTest, AFaultThatNoHeartbeatHasShownIsTakenOver) {
  StartInTurn();
  nodes_[0].reset();
  listener_.Publish("FAULT", fault_t{.utime = now_us_, .cause = fault_t::CLOCK_JUMP});
  Pass(3'000'000);
  EXPECT_EQ(Status(1).fault, fault_t::CLOCK_JUMP);
}

TEST_F(TwoCertifiersTest, IgnoresARecordedHeartbeat) {
  Start(0);
  Pass(1'000'000);
  certifier_status_t recorded = Status(0);
  recorded.instance = 7;
  recorded.started_utime -= 3'600'000'000;
  recorded.utime -= 3'600'000'000;
  listener_.Publish("CERTIFIER_STATUS", recorded);  // by somebody who plays a log
  Pass(100'000);
  EXPECT_EQ(nodes_[0]->charge().state(), kInCharge);
  EXPECT_EQ(Answers().size(), 1u);
}

}  // namespace forereach::two_certifiers_test
