// A recorded log through the same gate gives the same decisions, and a changed one does not.

#include "records/replay.h"
#include "certifier/gate/gate.h"
#include "certifier/gate/plan_ledger.h"
#include "forereach/safety/occupancy_grid.h"
#include "lcmtypes/candidate_batch.h"
#include "lcmtypes/seal.h"
#include "records/record_reader.h"
#include "records/result.h"
#include "tests/certifier/gap_task.h"
#include "tests/certifier/small_task.h"
#include "tests/cli/program.h"
#include "tests/records/course.h"
#include "tests/records/logs.h"
#include "tests/records/signed_log.h"

namespace forereach::replay_test {

// A gate and the log of what it hears and says.
struct LoggedGate {
  const Config& config;
  EventLogWriter& log;
  Gate gate{config};

  void Hear(const std::vector<std::uint8_t>& obstacles) {
    log.Append(kNow, config.bus.obstacles, obstacles);
    EXPECT_EQ(gate.UpdateObstacles(obstacles, kNow), "");
  }
  void Say(const certifier_status_t& status) { log.Append(kNow, config.bus.status, Encode(status)); }
  /** Of `expected`, the outcome. */
  void Decide(const candidate_plan_t& candidate, std::int16_t expected) {
    const decision_t decision = gate.Decide(Encode(candidate), kNow).decision;
    EXPECT_EQ(decision.outcome, expected);
    Log(candidate, decision);
  }
  /** The plan_id that is decided on. */
  std::int64_t Decide(const candidate_batch_t& batch) {
    const decision_t decision = gate.Decide(Encode(batch), kNow).decision;
    log.Append(kNow, config.bus.candidate, Encode(batch));
    log.Append(kNow, config.bus.decision, Encode(decision));
    return decision.plan_id;
  }
  void RefuseForNoObstacles(const candidate_plan_t& candidate) {
    Log(candidate, gate.Refuse(Encode(candidate), kNow, decision_t::CAUSE_NO_OBSTACLES, "").decision);
  }
  void Log(const candidate_plan_t& candidate, const decision_t& decision) {
    log.Append(kNow, config.bus.candidate, Encode(candidate));
    log.Append(kNow, config.bus.decision, Encode(decision));
  }
};

// Each decision of the log is made again.
void ExpectAgreed(const std::string& path, const Config& config, int decisions) {
  const ReplayResult result = Replay({path}, {config});
  EXPECT_EQ(result.agreed, decisions);
  EXPECT_THAT(result.differences, IsEmpty());
}

// The result, which three shards find together, too.
ReplayResult ReplayedInShards(const std::string& path, const Config& config) {
  const auto of_shard = [&](int index) { return Replay({path}, config, "", false, {index, 3}); };
  CaseResults<ReplayResult> joined = of_shard(1);
  joined.Join(of_shard(2));
  joined.Join(of_shard(0));
  const ReplayResult sum = nlohmann::json(joined).get<CaseResults<ReplayResult>>().Sum();
  ReplayResult whole = Replay({path}, config);
  EXPECT_EQ(nlohmann::json(sum), nlohmann::json(whole));
  EXPECT_EQ(sum.proposals, whole.proposals);
  return whole;
}

class ReplayTest : public testing::Test {
 protected:
  // The path of a log that is not there yet.
  std::string NewLog() { return scratch_ / std::to_string(logs_++); }

  // A log that `write` writes.
  template <class Write>
  std::string Written(Write write) {
    const std::string path = NewLog();
    EventLogWriter writer(path);
    write(writer);
    EXPECT_TRUE(writer.Flush());
    return path;
  }

  // A copy of the log, as CopyLog changes it.
  template <class Edit>
  std::string Edited(Edit edit) {
    const std::string path = NewLog();
    CopyLog(kCourseLog, path, edit);
    return path;
  }

 private:
  const ScratchDirectory scratch_;
  int logs_ = 0;
};

TEST_F(ReplayTest, WhatThereWasTimeForIsDecidedAgain) {
  const ScratchDirectory scratch;
  const Config config = GapTask(scratch);
  const std::string path = NewLog();
  EventLogWriter log(path);
  LoggedGate logged{config, log};
  logged.Decide(GapCandidate(config, 1, kNow), decision_t::CERTIFIED);
  std::int64_t now = kNow - 700;  // time for two trials
  const candidate_plan_t late = GapCandidate(config, 2, kNow);
  const decision_t decision = logged.gate.Decide(Encode(late), [&] { return now += 700; }).decision;
  EXPECT_EQ(decision.cause, decision_t::CAUSE_OBSTACLE);
  logged.Log(late, decision);
  ASSERT_TRUE(log.Flush());
  ExpectAgreed(path, config, 2);
}

TEST_F(ReplayTest, TheDecisionOnABatchIsThatOnItsCandidateAlone) {
  const std::string path = NewLog();
  const Config config = SmallTask();
  EventLogWriter log(path);
  LoggedGate logged{config, log};
  const auto batch = [](std::int64_t plan_id, std::initializer_list<double> accelerations) {
    candidate_batch_t batch{};
    for (const double acceleration : accelerations)
      EXPECT_TRUE(Append(batch, Candidate(plan_id + batch.num_candidates, acceleration)));
    return batch;
  };
  constexpr double kGood = kAccelerationThatCertifies, kBad = kAccelerationIntoTheCircle;
  EXPECT_EQ(logged.Decide(batch(1, {kBad, kGood, kGood})), 2);
  EXPECT_EQ(logged.Decide(batch(1, {kBad, kGood, kGood})), 2) << "it is a repetition";
  EXPECT_EQ(logged.Decide(batch(4, {kBad, kBad})), 4);
  EXPECT_EQ(logged.Decide(batch(6, {})), 0) << "it is no batch";
  logged.Decide(Candidate(9), decision_t::CERTIFIED);
  ASSERT_TRUE(log.Flush());
  const ReplayResult result = ReplayedInShards(path, config);
  EXPECT_THAT(result.differences, IsEmpty());
  EXPECT_EQ(result.agreed, 5);
  EXPECT_EQ(result.candidates, 5) << "a batch counts once";

  struct Reader final : RecordUser {
    void OnDecision(const DecisionRow&, const candidate_plan_t* candidate) override {
      plan_ids.push_back(candidate ? candidate->plan_id : -1);
    }
    void OnGap(const GapRow& gap) override { ADD_FAILURE() << gap.lost; }
    std::vector<std::int64_t> plan_ids;
  } user;
  RecordReader(config.bus, user).Read({path});
  EXPECT_EQ(user.plan_ids, (std::vector<std::int64_t>{2, 2, 4, -1, 9}));
}

TEST_F(ReplayTest, RecordedLogAgreesOnEveryDecision) {
  const Config config = LoadConfig(kCourseTask);
  const ReplayResult result = Replay({kCourseLog}, {config});
  EXPECT_TRUE(result.differences.empty()) << result.differences.front();
  EXPECT_EQ(result.agreed, result.candidates);
  EXPECT_GE(result.candidates, 10);
  EXPECT_EQ(result.corruptions, 0);
}

// A log of a plan that is certified, then withdrawn because of a wall, then because of a nearer one; `alter` changes
// each withdrawal before it is logged.
struct WithdrawnReplayTest : ReplayTest {
  template <class Alter>
  ReplayResult Replayed(Alter alter) {
    const std::string path = NewLog();
    EventLogWriter log(path);
    const Config config = SmallTaskOnTheBus();
    Gate gate(config);
    PlanLedger plans(config.gate, kNow);
    std::int64_t sequence = 0;
    const auto see = [&](const std::vector<Obstacle>& obstacles) {
      obstacles_t message = Sighted(obstacles, kNow, sequence++);
      EXPECT_EQ(gate.UpdateObstacles(Encode(message), kNow), "");
      log.Append(kNow, config.bus.obstacles, Encode(message));
      plans.Judge(gate, kNow);
    };
    const auto send_due = [&](std::int64_t now_us) {
      while (auto due = plans.TakeDue(now_us, now_us)) {
        alter(due->message);
        log.Append(now_us, config.bus.withdrawn, Encode(due->message));
        ++sent_;
      }
    };
    see({});
    const auto candidate = Encode(Candidate(1));
    log.Append(kNow, config.bus.candidate, candidate);
    const GateAnswer answer = gate.Decide(candidate, kNow);
    log.Append(kNow, config.bus.certified, Encode(answer.certified.value()));
    log.Append(kNow, config.bus.decision, Encode(answer.decision));
    plans.Add(*answer.certified, kNow);
    see({Obstacle::HalfSpace(Eigen::Vector2d(1, 0), 1.2)});
    send_due(kNow);
    send_due(kNow + PlanLedger::kRepeatUs);
    see({Obstacle::HalfSpace(Eigen::Vector2d(1, 0), 0.8)});
    send_due(kNow + PlanLedger::kRepeatUs);
    EXPECT_TRUE(log.Flush());
    return ReplayedInShards(path, config);
  }

  int sent_ = 0;
};

TEST_F(WithdrawnReplayTest, EachWithdrawalIsJudgedAgainOnce) {
  const ReplayResult result = Replayed([](withdrawal_t&) {});
  EXPECT_EQ(sent_, 3) << "one is a repetition";
  EXPECT_FIELDS(result, (withdrawals, 2), (agreed, 1));
  EXPECT_THAT(result.differences, IsEmpty());
}

TEST_F(WithdrawnReplayTest, ListsAWithdrawalWithOtherStepsAnotherObstacleOrOtherGrounds) {
  const auto differences = [this](auto alter) { return Replayed(alter).differences; };
  EXPECT_THAT(differences([](withdrawal_t& message) { ++message.valid_steps; }),
              Each(HasSubstr("steps that stand, cause obstacle; replayed")));
  EXPECT_EQ(differences([](withdrawal_t& message) { ++message.obstacle; }).size(), 2u);
  EXPECT_THAT(differences([](withdrawal_t& message) { SetDigest(message.obstacles_digest, DigestOf("another")); }),
              Each(HasSubstr("withdrawn under other obstacles")));
  EXPECT_THAT(differences([](withdrawal_t& message) { SetDigest(message.certificate_digest, DigestOf("another")); }),
              Each(HasSubstr("its certified plan is not in the log")));
}

TEST_F(WithdrawnReplayTest, ListsNoDifferenceForAWithdrawalWithoutAJudgement) {
  for (const std::int16_t cause : {withdrawal_t::NOT_JUDGED, withdrawal_t::OBSTACLES_LOST}) {
    const ReplayResult result = Replayed([cause](withdrawal_t& message) { message.cause = cause; });
    EXPECT_EQ(result.circumstances, 2) << cause;
    EXPECT_THAT(result.differences, IsEmpty()) << cause;
  }
}

// The candidate that was refused, what was proposed in its place, as `alter` changes it, and that as a candidate.
struct RepairedReplayTest : ReplayTest {
  template <class Alter>
  ReplayResult Replayed(Alter alter) {
    const std::string path = NewLog();
    EventLogWriter log(path);
    const Config config = SmallTask();
    LoggedGate gate{config, log};
    candidate_plan_t candidate = Candidate(1, kAccelerationIntoTheCircle);
    candidate.repair = 1;
    const decision_t decision = gate.gate.Decide(Encode(candidate), kNow).decision;
    gate.Log(candidate, decision);
    advice_t advice = gate.gate.Repair(candidate, decision, [] { return true; }).value();
    EXPECT_NE(advice.changed, 0);
    candidate_plan_t sent = advice.proposal;
    alter(advice);
    log.Append(kNow, config.bus.advice, Encode(advice));
    sent.utime = kNow;
    sent.plan_id = 2;
    gate.Decide(sent, decision_t::CERTIFIED);
    EXPECT_TRUE(log.Flush());
    return ReplayedInShards(path, config);
  }
};

TEST_F(RepairedReplayTest, AProposalIsCertifiedAgainAndWhatIsSentIsACandidateLikeAll) {
  const ReplayResult result = Replayed([](advice_t&) {});
  EXPECT_EQ(std::tuple(result.proposals, result.agreed, result.candidates), std::tuple(1, 2, 2));
  EXPECT_THAT(result.differences, IsEmpty());
}

TEST_F(RepairedReplayTest, ListsAProposalThatIsNotCertified) {
  for (const double acceleration : {kAccelerationIntoTheCircle, kAccelerationOutsideDomain, std::nan("")}) {
    const ReplayResult result = Replayed([=](advice_t& advice) {
      for (auto& control : advice.proposal.control) control[0] = acceleration, control[1] = 0;
    });
    EXPECT_EQ(result.proposals, 0) << acceleration;
    EXPECT_THAT(result.differences, ElementsAre(HasSubstr("proposed in its place is not certified")));
  }
  EXPECT_EQ(Replayed([](advice_t& advice) { advice.proposal.num_steps = 129; }).differences.size(), 1u);
  EXPECT_EQ(Replayed([](advice_t& advice) { advice.proposal.num_states = -1; }).differences.size(), 1u);
}

TEST_F(RepairedReplayTest, ComparesNoProposalUnderGroundsThatTheLogDoesNotGive) {
  const ReplayResult result = Replayed([](advice_t& advice) { advice.observations_digest[0] ^= 1; });
  EXPECT_EQ(std::tuple(result.proposals, result.circumstances), std::tuple(0, 1));
  EXPECT_THAT(result.differences, IsEmpty());
}

TEST_F(ReplayTest, RecordedLogHasCertificatesAndBothAbstentions) {
  int certified = 0, domain = 0, safety = 0;
  EventLogReader reader(kCourseLog);
  LogEvent event;
  while (reader.Next(event) == LogStatus::kEvent) {
    const auto decision = Decoded<decision_t>(event.data);
    if (!decision) continue;
    certified += decision->outcome == decision_t::CERTIFIED;
    domain += decision->outcome == decision_t::ABSTAIN_DOMAIN;
    safety += decision->outcome == decision_t::ABSTAIN_SAFETY;
  }
  EXPECT_GT(certified, 0);
  EXPECT_GT(domain, 0);
  EXPECT_GT(safety, 0);
}

TEST_F(ReplayTest, ChangedOutcomeIsListed) {
  const std::string path = Edited(OfFirst<decision_t>([](decision_t& decision) {
    const bool certified = decision.outcome == decision_t::CERTIFIED;
    decision.outcome = certified ? decision_t::ABSTAIN_SAFETY : decision_t::CERTIFIED;
  }));
  EXPECT_EQ(Replay({path}, {LoadConfig(kCourseTask)}).differences.size(), 1u);
}

TEST_F(ReplayTest, MissingDecisionAndMissingCandidateAreListed) {
  const auto dropped = [](auto&) { return false; };
  for (const std::string& path : {Edited(OfFirst<decision_t>(dropped)), Edited(OfFirst<candidate_plan_t>(dropped))})
    EXPECT_EQ(Replay({path}, {LoadConfig(kCourseTask)}).differences.size(), 1u) << path;
}

TEST_F(ReplayTest, ACertifiedPlanThatWasAlteredIsListed) {
  const auto difference = [this](auto alter) {
    const ReplayResult result = Replay({Edited(OfFirst<certified_plan_t>(alter))}, {LoadConfig(kCourseTask)});
    EXPECT_EQ(result.differences.size(), 1u);
    return result.differences.empty() ? std::string() : result.differences.front();
  };
  EXPECT_THAT(difference([](auto& c) { c.slice_upper[3][0] = std::nextafter(c.slice_upper[3][0], 0); }),
              HasSubstr("seal does not hold: certificate_digest"));
  EXPECT_THAT(difference([](auto& c) { c.slice_upper[100][0] = 0.5; }),
              HasSubstr("slice_upper[100][0] is 0.5, it has to be 0"));
  EXPECT_THAT(difference([](auto& c) { c.plan.control[0][0] += 1; }), HasSubstr("plan_digest"));
  EXPECT_THAT(difference([](auto& c) { c.expires_utime += 1; }), HasSubstr("certificate_digest"));
  const auto resealed = [&](auto alter) {
    return difference([&](auto& c) { alter(c), SetDigest(c.certificate_digest, CertificateDigest(c)); });
  };
  EXPECT_THAT(resealed([](auto& c) { c.step_error_us = 5000; }),
              HasSubstr("step_error_us is 5000, it is -1 in the task"));
  EXPECT_THAT(resealed([](auto& c) { c.state_error[5] = 0.25; }),
              HasSubstr("state_error[5] is 0.25, it is 0 in the task"));
}

// The seam lies between a candidate and its decision.
TEST_F(ReplayTest, ARunInTwoFilesIsTheSameInTheirOrderOnly) {
  std::vector<std::string> logs;
  for (const bool second : {false, true}) {
    bool behind = false;
    logs.push_back(Edited([&](LogEvent& event) {
      const bool here = behind == second;
      if (event.number >= 200 && Decoded<candidate_plan_t>(event.data)) behind = true;
      return here;
    }));
  }
  const Config config = LoadConfig(kCourseTask);
  const ReplayResult whole = Replay({kCourseLog}, {config}), parts = Replay(logs, {config});
  EXPECT_TRUE(parts.differences.empty()) << parts.differences.front();
  EXPECT_FIELDS(parts, (candidates, whole.candidates), (agreed, whole.agreed));
  EXPECT_THAT(Replay({logs[1]}, {config}).differences,
              Contains(HasSubstr("transitions that had been learned are not in the log")));
}

// A log of a release that learned steps of any duration without a clock; now those off by half of dt are refused.
TEST_F(ReplayTest, SaysWhichTransitionsAreNotLearnedAnyMore) {
  const std::string log = Edited([](LogEvent& event) {
    if (auto transition = Decoded<transition_t>(event.data)) {
      transition->duration_us += 60'000;
      event.data = Encode(*transition);
    }
    return true;
  });
  EXPECT_THAT(Replay({log}, {LoadConfig(kCourseTask)}).differences,
              Contains(AllOf(HasSubstr("it rests on transitions that this release does not learn"),
                             HasSubstr(": the step lasted 160000 us, further from model.dt, 0.1 s"),
                             HasSubstr("the release that recorded the log can replay it"))));
}

// A log may begin while the certifier runs: obstacles before its first heartbeat there are in force. They are not if
// the certifier itself began after them.
TEST_F(ReplayTest, ObstaclesBeforeTheFirstHeartbeatCountUnlessTheCertifierBeganWithIt) {
  const Config config = SmallTaskOnTheBus();
  const GridMap map{0.5, {1, 0}, 0, 2, 1, {true, false}, true};
  for (const Obstacle& there :
       {Obstacle::Circle(Eigen::Vector2d(1, 0), 0.3), Obstacle::Grid(std::make_shared<const OccupancyGrid>(map))})
    for (const std::int64_t heartbeat : {0, 7}) {
      const obstacles_t on_the_way = ToMessage({there}, kNow);
      certifier_status_t status{};
      status.sequence = heartbeat;
      const std::string path = Written([&](EventLogWriter& writer) {
        LoggedGate gate{config, writer};
        if (heartbeat > 0)
          gate.Hear(Encode(on_the_way));
        else  // before this certifier's start
          writer.Append(kNow, config.bus.obstacles, Encode(on_the_way));
        gate.Say(status);
        gate.Decide(Candidate(1), heartbeat > 0 ? decision_t::ABSTAIN_SAFETY : decision_t::CERTIFIED);
      });
      ExpectAgreed(path, config, 1);
    }
}

// What was heard before a reload counts after it, beside the task's own.
TEST_F(ReplayTest, AReloadKeepsTheObstaclesThatWereHeard) {
  const Config config = SmallTaskOnTheBus();
  const obstacles_t on_the_way = ToMessage({Obstacle::Circle(Eigen::Vector2d(1, 0), 0.3)}, kNow);
  certifier_status_t first{}, second{};
  second.sequence = 1;
  first.version = 1, second.version = 2;
  const std::string path = Written([&](EventLogWriter& writer) {
    LoggedGate before{config, writer}, after{config, writer};
    before.Say(first);
    before.Decide(Candidate(1), decision_t::CERTIFIED);
    before.Hear(Encode(on_the_way));
    after.gate.Inherit(before.gate);
    after.Say(second);
    after.Decide(Candidate(2), decision_t::ABSTAIN_SAFETY);
  });
  ExpectAgreed(path, config, 2);
}

// The whole set comes again and again; a second certifier's heartbeats are none of the one that decides; where the
// obstacles were not known nothing is compared.
TEST_F(ReplayTest, ObstaclesThatAreRepeatedAndASecondCertifierReplay) {
  const Config config = SmallTaskOnTheBus();
  int decided = 0;
  const std::string path = Written([&](EventLogWriter& writer) {
    certifier_status_t mine{}, others{};
    mine.state = certifier_status_t::ARMED, mine.instance = 1;
    others.state = certifier_status_t::STANDBY, others.instance = 2;
    std::int64_t id = 1;
    for (int start = 0; start < 2; ++start) {  // it is killed, and starts again
      LoggedGate gate{config, writer};
      mine.sequence = 0;
      gate.Say(mine);
      gate.RefuseForNoObstacles(Candidate(id++));
      for (int i = 0; i < 12; ++i) {
        gate.Hear(Encode(Sighted(i / 4 == 1 ? std::vector{Obstacle::Circle(Eigen::Vector2d(1, 0), 0.3)}
                                            : std::vector{Obstacle::Circle(Eigen::Vector2d(0, 15), 1)},
                                 kNow + 100 * start + i, 20 * start + i)));
        others.sequence = 3 + i % 5;
        gate.Say(others);
        gate.Decide(Candidate(id++), i / 4 == 1 ? decision_t::ABSTAIN_SAFETY : decision_t::CERTIFIED);
        ++decided;
        ++mine.sequence;
        gate.Say(mine);
      }
    }
  });
  const ReplayResult result = Replay({path}, {config});
  EXPECT_TRUE(result.differences.empty()) << result.differences.front();
  EXPECT_FIELDS(result, (agreed, decided), (circumstances, 2));
}

// They are in force though they are not known, by the times of the log as by those of the certifier.
TEST_F(ReplayTest, ObstaclesOfAClockThatIsOffReplay) {
  Config config = SmallTaskOnTheBus();
  config.gate.max_clock_error_ms = 20;
  const std::string path = Written([&](EventLogWriter& writer) {
    LoggedGate gate{config, writer};
    gate.Say({.state = certifier_status_t::ARMED});
    for (int i = 0; i < 6; ++i) {
      const bool is_late = i % 2 == 0;
      gate.Hear(
          Encode(Sighted({Obstacle::Circle(Eigen::Vector2d(0.1 * i, 15), 1)}, kNow - (is_late ? 30'001 : 30'000), i)));
      EXPECT_EQ(gate.gate.WhyObstaclesUnknown(kNow).empty(), !is_late);
      if (is_late)
        gate.RefuseForNoObstacles(Candidate(i + 1));
      else
        gate.Decide(Candidate(i + 1), decision_t::CERTIFIED);
    }
  });
  const ReplayResult result = Replay({path}, {config});
  EXPECT_TRUE(result.differences.empty()) << result.differences.front();
  EXPECT_FIELDS(result, (agreed, 3), (circumstances, 3));
}

// Each message has other stamps; in some of them nothing moves.
TEST_F(ReplayTest, AgreesOnARunWithMovingObstacles) {
  Config config = SmallTaskOnTheBus();
  config.gate.max_clock_error_ms = 20;
  const std::string path = Written([&](EventLogWriter& writer) {
    LoggedGate gate{config, writer};
    gate.Say({.state = certifier_status_t::ARMED});
    for (int i = 0; i < 12; ++i) {
      ObstacleMotion motion;
      motion.stamp_us = kNow - 12 + i;
      motion.velocity.y() = -1;
      const bool is_met = i % 3 == 1, stands = i % 3 == 2;
      const Obstacle seen = Obstacle::Circle(Eigen::Vector2d(0.75, is_met ? 1.25 : 5), 0.2);
      gate.Hear(Encode(Sighted({stands ? seen : seen.Moving(motion)}, kNow + i, i)));
      gate.Decide(Candidate(i + 1), is_met ? decision_t::ABSTAIN_SAFETY : decision_t::CERTIFIED);
    }
  });
  ExpectAgreed(path, config, 12);
}

TEST_F(ReplayTest, WithTheKeyWhatIsNotAuthenticIsPassedOver) {
  const ScratchDirectory scratch;
  const auto [key, log] = SignedLog(scratch, kCourseLog);
  Config config = LoadConfig(kCourseTask);
  const ReplayResult before = Replay({kCourseLog}, {config}), believed = Replay({log}, {config});
  EXPECT_EQ(believed.differences.size(), 4u) << "three undecided candidates, an altered certificate";
  EXPECT_EQ(DescribePassedOver(believed.passed_over), "");
  config.bus.key = key;
  const ReplayResult result = Replay({log}, {config});
  EXPECT_THAT(result.differences, IsEmpty());
  EXPECT_FIELDS(result, (agreed, before.agreed), (candidates, before.candidates),
                (passed_over.not_authentic.unsigned_ones, kUnsigned), (passed_over.not_authentic.forged, kForged),
                (passed_over.not_authentic.replayed, kRepeated));
  EXPECT_EQ(DescribePassedOver(result.passed_over),
            "; not authentic and passed over: 5 (unsigned 2, forged 1, replayed 2)");
  config.bus.key = scratch / "none";
  EXPECT_THROW((void)Replay({log}, {config}), KeyError);
}

TEST_F(ReplayTest, ThroughTheCommandWithAKeyAndWithout) {
  const ScratchDirectory scratch;
  const auto [key, log] = SignedLog(scratch, kCourseLog);
  const std::string replay = "replay " + log + " --config " + kCourseTask;
  const Output judged = Forereach(replay + " --key " + key), believed = Forereach(replay + " --no-key");
  EXPECT_THAT(judged, Exits(0, "passed over: 5 (unsigned 2, forged 1, replayed 2)"));
  EXPECT_EQ(believed.code, 1) << believed.text;
}

TEST_F(ReplayTest, WhatIsNoCertifiedPlanIsPassedOver) {
  bool done = false;
  const std::string path = Edited([&](LogEvent& event) {
    if (event.channel != "PLAN_CERTIFIED" || done) return true;
    done = true;
    event.data = {1, 2, 3};
    return true;
  });
  const ReplayResult result = Replay({path}, {LoadConfig(kCourseTask)});
  EXPECT_THAT(result.differences, IsEmpty());
  EXPECT_EQ(DescribePassedOver(result.passed_over), "; no certified plan and passed over: 1");
}

TEST_F(ReplayTest, AnotherTaskIsNoticed) {
  Config config = LoadConfig(kCourseTask);
  config.grounds.declaration[0] ^= 1;
  const ReplayResult result = Replay({kCourseLog}, {config});
  EXPECT_EQ(result.differences.size(), static_cast<std::size_t>(result.candidates));
}

}  // namespace forereach::replay_test
