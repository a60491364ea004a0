// A recorded run is read in one way: verify, replay, report and the timeline itself agree on the grounds of decisions.
#include "records/timeline.h"

#include <malloc.h>

#include "certifier/gate/gate.h"
#include "certifier/gate/obstacle_sender.h"
#include "forereach/safety/occupancy_grid.h"
#include "lcmtypes/names.h"
#include "records/kept_obstacles.h"
#include "records/replay.h"
#include "records/report.h"
#include "task/step_time.h"
#include "tests/messages.h"
#include "tests/records/certificates.h"
#include "tests/records/course.h"
#include "tests/records/logs.h"
#include "tests/records/signed_log.h"
#include "tests/sanitized.h"

namespace forereach::timeline_test {

constexpr std::int64_t kStart = 1'700'000'000'000'000;

struct TimelineTest : testing::Test {
  TimelineTest() : config_(LoadConfig(kCourseTask)), gate_(std::make_unique<Gate>(config_)) {
    candidate_ = FirstCertified(kCourseLog);
    NextFile();
  }

  void NextFile() {
    logs_.push_back(scratch_ / ("events-" + std::to_string(logs_.size()) + ".lcmlog"));
    writer_ = std::make_unique<EventLogWriter>(logs_.back());
    logger_status_t status{};  // files of one run have the logger's heartbeats in order
    status.utime = now_;
    status.sequence = std::ssize(logs_);
    Append(config_.bus.logger_status, status);
  }

  template <class Message>
  void Append(const std::string& channel, const Message& message) {
    writer_->Append(now_, channel, Encode(message));
    ASSERT_TRUE(writer_->Flush());
  }

  void Heartbeat(std::int64_t sequence, std::int64_t version) {
    certifier_status_t status{.utime = ++now_, .sequence = sequence, .version = version};
    SetDigest(status.config_digest, config_.grounds.config);
    Append(config_.bus.status, status);
  }

  // @param is_heard the certifier receives them too.
  void Obstacles(double x, bool is_heard = true) {
    obstacles_t message = Sighted({Obstacle::Circle(Eigen::Vector2d(x, 0), 1)}, ++now_, obstacles_++);
    if (is_heard) EXPECT_EQ(gate_->UpdateObstacles(Encode(message), now_), "");
    Append(config_.bus.obstacles, message);
  }

  // Seventy obstacles, in two parts; of these so many are sent.
  void SetParts(double x) {
    std::vector<Obstacle> all;
    for (int i = 0; i < 70; ++i) all.push_back(Obstacle::Circle(Eigen::Vector2d(x + i % 2, i < 64 ? 90 : x), 1));
    parts_.Set(all);
  }
  void SendParts(int count) {
    for (; count > 0; --count) {
      obstacles_t message = *parts_.Due(now_ += 1000);
      message.sequence = obstacles_++;
      EXPECT_EQ(gate_->UpdateObstacles(Encode(message), now_), "");
      Append(config_.bus.obstacles, message);
    }
  }

  // One of the task's own transitions is seen again.
  transition_t NextTransition() {
    const Transitions& known = config_.problem->transitions;
    const int n = config_.problem->model->num_states(), m = config_.problem->model->num_inputs();
    transition_t message{.utime = ++now_,
                         .sequence = transitions_++,
                         .duration_us = StepUs(config_) + off_us_,
                         .num_states = static_cast<std::int16_t>(n),
                         .num_inputs = static_cast<std::int16_t>(m)};
    for (int k = 0; k < n; ++k) message.state[k] = known.z(0, k), message.next_state[k] = known.x_next(0, k);
    for (int k = 0; k < m; ++k) message.input[k] = known.z(0, n + k);
    return message;
  }
  void Transition() {
    const transition_t message = NextTransition();
    EXPECT_EQ(gate_->Learn(Encode(message)), "");
    Append(config_.bus.transition, message);
  }

  // A candidate, its certified plan and its decision, in the order in which the certifier sends them.
  void Certify() {
    candidate_.utime = ++now_;
    candidate_.start_utime = now_ + 100'000;
    ++candidate_.plan_id;
    ++candidate_.sequence;
    Append(config_.bus.candidate, candidate_);
    const GateAnswer answer = gate_->Decide(Encode(candidate_), ++now_);
    ASSERT_TRUE(answer.certified) << GetText(answer.decision.message);
    Append(config_.bus.certified, *answer.certified);
    if (certified_ == 0) first_certified_ = *answer.certified;
    Append(config_.bus.decision, answer.decision);
    ++certified_;
  }

  void Restart() {
    gate_ = std::make_unique<Gate>(config_);
    Heartbeat(0, 1);
  }

  void Reload(std::int64_t sequence, std::int64_t version) {
    auto after = std::make_unique<Gate>(config_);
    after->Inherit(*gate_);
    gate_ = std::move(after);
    Heartbeat(sequence, version);
  }

  // From now on senders are told apart, as on a signed bus.
  template <class Message>
  void AppendSigned(const std::string& channel, const Message& message, std::uint64_t sender) {
    Signer signer(TestKeys(), "the bus", sender);
    writer_->Append(now_, channel, signer.Sign(BusOptions{}.speakers().at(channel), channel, Encode(message), now_));
    ASSERT_TRUE(writer_->Flush());
  }
  // @param is_taken by the certifier.
  void ObstaclesBy(std::uint64_t sender, double x, bool is_taken) {
    obstacles_t message = Sighted({Obstacle::Circle(Eigen::Vector2d(x, 0), 1)}, ++now_, obstacles_++);
    EXPECT_EQ(gate_->UpdateObstacles(Encode(message), now_, sender).empty(), is_taken);
    AppendSigned(config_.bus.obstacles, message, sender);
  }
  // @param is_learned by the certifier.
  void TransitionBy(std::uint64_t sender, bool is_learned) {
    const transition_t message = NextTransition();
    if (is_learned) EXPECT_EQ(gate_->Learn(Encode(message)), "");
    AppendSigned(config_.bus.transition, message, sender);
  }

  // Each user of the timeline finds the grounds that each decision names.
  void ExpectAllAgree() {
    struct Comparer final : TimelineUser {
      void OnDecision(const RecordedDecision& recorded) override {
        ++decisions;
        EXPECT_EQ(recorded.basis.grounds, GroundsOf(recorded.decision)) << recorded.event;
      }
      void OnCertified(const RecordedPlan& recorded) override {
        ++plans;
        EXPECT_TRUE(recorded.has_candidate);
        EXPECT_EQ(recorded.basis.grounds, GroundsOf(recorded.certified)) << recorded.event;
      }
      int decisions = 0, plans = 0;
    } comparer;
    Timeline timeline(config_, {&comparer});
    timeline.Read(logs_, true);
    EXPECT_FIELDS(comparer, (decisions, certified_), (plans, certified_));

    const ReplayResult replayed = Replay(logs_, {config_});
    EXPECT_THAT(replayed.differences, IsEmpty());
    EXPECT_EQ(replayed.agreed, certified_);

    const CertificateFile file = ReadLogs(logs_, kCourseTask);
    ASSERT_EQ(std::ssize(file.certificates), certified_);
    const verifier::Verifier verifier(file.config.problem, verifier::MethodOf(*file.config.problem));
    for (const RecordedCertificate& certificate : file.certificates) {
      EXPECT_THAT(certificate.mismatches, IsEmpty()) << certificate.name << ": " << certificate.mismatches[0].what;
      EXPECT_EQ(certificate.missing, "");
      EXPECT_EQ(verifier.Verify(certificate.certificate).status, verifier::Status::kConfirmed) << certificate.name;
    }
    EXPECT_EQ(PictureFromLogs(logs_, {config_}).disagreements, 0);
  }

  ScratchDirectory scratch_;
  const Config config_;
  std::unique_ptr<Gate> gate_;
  ObstacleSender parts_{1000};
  std::vector<std::string> logs_;
  std::unique_ptr<EventLogWriter> writer_;
  candidate_plan_t candidate_{};
  certified_plan_t first_certified_{};
  std::int64_t now_ = kStart, obstacles_ = 0, transitions_ = 0, off_us_ = 0;
  int certified_ = 0;
};

TEST_F(TimelineTest, ObstaclesThatCameBeforeARestartAreForgottenAlsoWhereNothingWasDecidedBefore) {
  Heartbeat(7, 1);
  Obstacles(80);
  Restart();
  Certify();
  ExpectAllAgree();
}

TEST_F(TimelineTest, FindsAStartOfTheCertifierFromADecisionAlone) {
  Heartbeat(7, 1);
  Certify();
  Certify();
  Obstacles(80);
  Certify();
  gate_ = std::make_unique<Gate>(config_);  // its first heartbeats are lost
  Certify();
  Obstacles(60);
  Certify();
  Heartbeat(3, 1);
  Certify();
  ExpectAllAgree();
}

TEST_F(TimelineTest, ReconstructsGroundsAcrossFilesRestartsAndReloads) {
  Restart();
  Obstacles(80);
  Transition();
  Certify();
  Reload(1, 2);
  Certify();
  Transition();
  NextFile();
  Certify();
  Obstacles(60);
  Certify();
  Restart();
  Certify();
  Transition();
  Transition();
  Obstacles(70);
  NextFile();
  Certify();
  Reload(1, 2);
  Certify();
  ExpectAllAgree();
}

struct Keeper final : TimelineUser {
  [[nodiscard]] std::size_t MostLearned() const override { return 7; }
  void OnEvent(const LogEvent& event) override { candidates += Decoded<candidate_plan_t>(event.message()) ? 1 : 0; }
  void OnObstacles(Bytes, std::int64_t, SenderId) override { sets_ahead += candidates == 0 ? 1 : 0; }
  void OnTransition(const ExecutedTransition&, Bytes) override { learned_ahead += candidates == 0 ? 1 : 0; }
  void OnDecision(const RecordedDecision& recorded) override {
    EXPECT_EQ(recorded.basis.grounds, GroundsOf(recorded.decision)) << recorded.event;
    sets.push_back(recorded.basis.obstacles);
    num_learned = recorded.basis.num_learned;
  }
  void OnCertified(const RecordedPlan& recorded) override {
    has_grounds.push_back(recorded.basis.grounds == GroundsOf(recorded.certified));
  }
  void OnUndecided(const RecordedCandidate&) override { ++undecided; }

  // Reads the fixture's logs.
  void Read(const Config& task, const std::vector<std::string>& logs, const TimelineBounds& bounds) {
    Timeline timeline(
        task, [&](const Digest&) { return &task; }, {}, {this}, bounds);
    timeline.Read(logs, true);
    alive = std::ranges::count_if(sets, [](const auto& set) { return !set.expired(); });
  }

  int candidates = 0, sets_ahead = 0, learned_ahead = 0, undecided = 0;
  std::int64_t alive = 0;
  std::size_t num_learned = 0;
  std::vector<std::weak_ptr<const std::vector<Obstacle>>> sets;  // of each decision
  std::vector<bool> has_grounds;                                 // each certified plan
};

TEST_F(TimelineTest, TheSetsOfTheLastDecisionsAreKeptAsFarAsThereIsRoom) {
  Restart();
  for (int i = 0; i < 12; ++i) {
    Obstacles(60 + i);
    Certify();
  }
  Append(config_.bus.certified, first_certified_);
  const std::size_t each = config_.obstacles.size() + 1;
  for (const auto& [room, kept] : {std::pair{5 * each, 6}, {5 * each - 1, 5}, {100 * each, 12}, {std::size_t{0}, 1}}) {
    Keeper keeper;
    keeper.Read(config_, logs_, {.obstacles = room});
    EXPECT_EQ(keeper.alive, kept) << room;
    ASSERT_EQ(std::ssize(keeper.has_grounds), 13);
    // The first one comes again. Where its set is forgotten, it does not get another one's digest.
    EXPECT_EQ(std::ranges::count(keeper.has_grounds, true), kept == 12 ? 13 : 12) << room;
    EXPECT_EQ(keeper.has_grounds.back(), kept == 12) << room;
  }
}

TEST_F(TimelineTest, APlanKeepsItsGroundsOverOneRestart) {
  Restart();
  Transition();
  Certify();
  for (int i = 0; i < 2; ++i) {
    Restart();
    Append(config_.bus.certified, first_certified_);
  }
  Keeper keeper;
  keeper.Read(config_, logs_, {});
  EXPECT_THAT(keeper.has_grounds, ElementsAre(true, true, false));
}

TEST_F(TimelineTest, WhatTooManyMessagesFollowCountsAsReceived) {
  Restart();
  for (int i = 0; i < 12; ++i) Obstacles(60 + i), Transition();
  Certify();
  const std::size_t each = config_.obstacles.size() + 1;
  for (const auto& [bounds, sets, learned] : {std::tuple{TimelineBounds{}, 0, 0},
                                              {TimelineBounds{.ahead = 12}, 0, 0},
                                              {TimelineBounds{.ahead = 11}, 1, 1},
                                              {TimelineBounds{.ahead = 0}, 12, 12},
                                              {TimelineBounds{.obstacles = 5 * each}, 6, 0},
                                              {TimelineBounds{.obstacles = 0}, 11, 0}}) {
    Keeper keeper;
    keeper.Read(config_, logs_, bounds);
    EXPECT_FIELDS(keeper, (sets_ahead, sets), (learned_ahead, learned), (num_learned, 7u), (undecided, 0));
    EXPECT_THAT(keeper.has_grounds, ElementsAre(true));
  }
}

TEST_F(TimelineTest, OfTooManyCandidatesTheOldestAreUndecided) {
  Restart();
  for (int i = 0; i < 3; ++i, ++candidate_.plan_id) Append(config_.bus.candidate, candidate_);
  Certify();
  for (const auto& [most, undecided] : {std::pair{4, 0}, {3, 1}, {1, 3}}) {
    Keeper keeper;
    keeper.Read(config_, logs_, {.undecided = static_cast<std::size_t>(most)});
    EXPECT_EQ(keeper.undecided, undecided);
    EXPECT_THAT(keeper.has_grounds, ElementsAre(true));
  }
}

TEST(KeptObstaclesTest, CountsASetAndAGridOnce) {
  const GridMap map{1, {0, 0}, 0, 3, 1, {true, false, true}, true};
  const Obstacle grid = Obstacle::Grid(std::make_shared<const OccupancyGrid>(map));
  const Obstacle circle = Obstacle::Circle(Eigen::Vector2d(0, 0), 1);
  const std::vector<Obstacle> one{grid, circle}, other{circle, circle, grid}, none;
  KeptObstacles kept(1);
  kept.Add(none);
  kept.Add(one);
  kept.Add(one);
  EXPECT_EQ(kept.size(), 4u);
  EXPECT_FALSE(kept.AreTooMany());
  kept.Add(other);
  EXPECT_EQ(kept.size(), 7u);
  EXPECT_TRUE(kept.AreTooMany()) << "two beside what the newest has";
  kept.Remove(one);
  EXPECT_EQ(kept.size(), 7u) << "it is still kept elsewhere";
  kept.Remove(one);
  EXPECT_EQ(kept.size(), 5u) << "the other has the grid, too";
  kept.Remove(other);
  kept.Remove(none);
  EXPECT_EQ(kept.size(), 0u);

  // A task's grid is in every set.
  const std::vector<Obstacle> next{grid, circle};
  KeptObstacles two_more(2), none_more(0);
  for (KeptObstacles* some : {&two_more, &none_more})
    for (const auto* set : {&one, &next}) some->Add(*set);
  EXPECT_FALSE(two_more.AreTooMany());
  EXPECT_TRUE(none_more.AreTooMany());
  none_more.Remove(one);
  EXPECT_FALSE(none_more.AreTooMany());
}

// By the parts of a set, too: where it changes, where it is complete, and where it never is.
TEST_F(TimelineTest, ReconstructsSetsOfObstaclesInParts) {
  Restart();
  SetParts(80);
  SendParts(1);
  Certify();
  SendParts(1);
  Certify();
  SetParts(60);
  SendParts(1);
  Certify();
  NextFile();
  SendParts(1);
  Certify();
  SetParts(70);
  SendParts(1);
  Reload(1, 2);
  Certify();
  SendParts(4);
  Certify();
  Obstacles(80);
  SendParts(1);
  Certify();
  ExpectAllAgree();
}

// The log has a message before the decision; the certifier receives it only afterwards.
TEST_F(TimelineTest, ReconstructsADecisionMadeBeforeTheLatestObstaclesArrived) {
  Restart();
  Obstacles(80);
  Certify();
  Obstacles(60, false);
  Certify();
  Obstacles(70);
  Certify();
  ExpectAllAgree();
}

// On a signed bus the certifier goes by the sender, and so does who reads its log.
TEST_F(TimelineTest, OfTwoObstacleSendersTheSecondIsNotTakenUntilTheFirstIsSilent) {
  Restart();
  ObstaclesBy(1, 80, true);
  Certify();
  ObstaclesBy(2, 60, false);
  Certify();
  now_ += 900'000;
  ObstaclesBy(1, 70, true);
  Certify();
  now_ += 999'997;
  ObstaclesBy(2, 60, false);
  Certify();
  ObstaclesBy(2, 60, true);
  Certify();
  Reload(1, 2);
  ObstaclesBy(1, 90, false);
  Certify();
  Restart();
  ObstaclesBy(1, 90, true);
  Certify();
  ExpectAllAgree();
}

// The task looks at no clock: a step counts with its duration, and one of half a step more not at all.
TEST_F(TimelineTest, StepsOfOtherDurationsAreLearnedWithThese) {
  Restart();
  for (const std::int64_t off_us : {0, 2'000, -3'000, 50'000}) {
    off_us_ = off_us;
    Transition();
    Certify();
  }
  ExpectAllAgree();
  const Transitions known = ReadLogs(logs_, kCourseTask).config.problem->transitions;
  ASSERT_EQ(known.num_learned, 3);
  EXPECT_EQ(known.longer.tail(3)[0], 0);
  EXPECT_NEAR(known.longer.tail(3)[1], 0.002001, 1e-9);
  EXPECT_NEAR(known.longer.tail(3)[2], 0.003001, 1e-9);
}

TEST_F(TimelineTest, TransitionsOfTwoSendersAreNotLearned) {
  Restart();
  TransitionBy(1, true);
  Certify();
  TransitionBy(2, false);
  Certify();
  now_ += 999'000;
  TransitionBy(1, false);
  Certify();
  now_ += 1'000;
  TransitionBy(1, true);
  Certify();
  Restart();
  TransitionBy(2, true);
  Certify();
  ExpectAllAgree();
}

TEST(ReportWithAKey, ForgedDecisionsArePassedOver) {
  const ScratchDirectory scratch;
  const auto [key, honest] = SignedLog(scratch, kCourseLog);
  const std::string log = scratch / "forged.lcmlog";
  {
    EventLogReader reader(honest);
    EventLogWriter writer(log);
    bool is_forged = false;
    for (LogEvent event; reader.Next(event) == LogStatus::kEvent;) {
      writer.Append(event.utime, event.channel, event.data);
      auto decision = Decoded<decision_t>(event.message());
      if (!decision || is_forged) continue;
      is_forged = true;
      decision->outcome = decision_t::CERTIFIED;
      writer.Append(event.utime, event.channel, Encode(*decision));
    }
    ASSERT_TRUE(writer.Flush());
  }
  const auto report = [&](const std::string& of, const LogKey& by) {
    std::ostringstream out;
    ReportOptions options;
    options.logs = {of};
    options.config = kCourseTask;
    options.json = true;
    options.key = by;
    EXPECT_TRUE(Report(options, out));
    return nlohmann::json::parse(out.str());
  };
  const nlohmann::json recorded = report(kCourseLog, {}), judged = report(log, {key}),
                       believed = report(log, {"", true});
  EXPECT_THAT(judged, Holds({{"plans", recorded["plans"]}, {"messages", recorded["messages"]}}));
  EXPECT_THAT(judged["passed_over"]["not_authentic"], Holds({{"unsigned", kUnsigned + 1}, {"forged", kForged}}));
  EXPECT_EQ(believed["plans"]["decided"], recorded["plans"]["decided"].get<int>() + 1);
  EXPECT_EQ(believed["passed_over"]["not_authentic"]["unsigned"], 0);
}

// The most that is allocated while the certificates of a log are handed on, and how many there are.
struct PeakOfMemory final : CertificateUser {
  void OnCertificate(RecordedCertificate&&, const Basis*) override {
    const struct mallinfo2 now = mallinfo2();
    peak = std::max(peak, static_cast<std::int64_t>(now.uordblks + now.hblkhd));
    ++certificates;
  }

  std::int64_t peak = 0;
  int certificates = 0;
};

TEST_F(TimelineTest, ALogOfFourTimesTheCertificatesNeedsNotFourTimesTheMemory) {
  if (FOREREACH_SANITIZED) GTEST_SKIP() << "a sanitizer allocates by itself";
  const auto peak_with = [&](int certificates) {
    while (certified_ < certificates) Certify();
    PeakOfMemory user;
    ReadCertificates(logs_[0], kCourseTask, {}, user);
    EXPECT_EQ(user.certificates, certificates);
    return user.peak;
  };
  constexpr int kFew = static_cast<int>(kPlansTogether) + 44;
  const std::int64_t few = peak_with(kFew), bytes = static_cast<std::int64_t>(std::filesystem::file_size(logs_[0]));
  const std::int64_t many = peak_with(4 * kFew);
  EXPECT_GT(few, 0);
  EXPECT_LT(many - few, 3 * bytes / 4) << "a quarter of what the log grew by: of each plan the controls are kept";
}

}  // namespace forereach::timeline_test
