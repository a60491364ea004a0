// forereach-certifier as a process, fed good and bad messages over a real bus.
#include <csignal>

#include <fmt/format.h>
#include <sched.h>

#include <fmt/format.h>

#include "tests/test.h"

#include "lcmtypes/names.h"
#include "lcmtypes/seal.h"
#include "tests/messages.h"
#include "tests/process/process_fixture.h"

namespace forereach::certifier_process_test {

const Eigen::Vector2d kGentle(0.2, 0), kIntoTheCircle(0, 1.2), kOutsideDomain(0, 3.5);

struct CertifierProcessTest : testing::Test {
  void SetUp() override { ASSERT_TRUE(certifier_.WaitForLog("ready on")) << certifier_.error(); }

  void Send(const std::vector<std::uint8_t>& bytes, int expected_cause) {
    expected_[ToHex(PlanDigest(Bytes(bytes)))] = CauseName(static_cast<std::int16_t>(expected_cause));
    ASSERT_TRUE(probe_.bus().Publish("PLAN_CANDIDATE", Bytes(bytes)));
  }
  void Send(const candidate_plan_t& candidate, int expected_cause) { Send(Encode(candidate), expected_cause); }
  candidate_plan_t New(const Eigen::Vector2d& control, int steps = 12) {
    return CandidateFor(config_, next_plan_id_++, control, steps);
  }

  [[nodiscard]] bool WaitForDecisions(std::size_t count) {
    return probe_.WaitUntil([&] { return probe_.heard("PLAN_DECISION").size() >= count; });
  }

  const ScratchDirectory scratch_;
  const std::string path_ = scratch_.Write("task.yaml", PatientTask());
  const Config config_ = LoadConfig(path_);
  BusProbe probe_{PrivateBusUrl(), {"PLAN_DECISION", "PLAN_CERTIFIED", "CERTIFIER_STATUS"}};
  ChildProcess certifier_{{FOREREACH_CERTIFIER, "--config", path_, "--lcm-url", PrivateBusUrl()}};
  std::int64_t next_plan_id_ = 1;
  std::map<std::string, std::string_view> expected_;  // cause by plan digest
};

TEST(CertifierRealtimeTest, AllItsThreadsAreUnderFifoAndWhatTheyStartIsNot) {
  const ScratchDirectory scratch;
  const std::string path = scratch.Write("task.yaml", PatientTask() + "realtime: {fifo_priority: 5}\n");
  ChildProcess certifier({FOREREACH_CERTIFIER, "--config", path, "--lcm-url", PrivateBusUrl()});
  if (!certifier.WaitForLog("ready on")) {
    EXPECT_THAT(certifier.error(), HasSubstr("realtime.fifo_priority: "));
    EXPECT_EQ(certifier.WaitForExit(), 2);
    GTEST_SKIP() << "this user may not ask for real time";
  }
  const std::filesystem::path tasks = "/proc/" + std::to_string(certifier.pid()) + "/task";
  int threads = 0;
  for (const auto& thread : std::filesystem::directory_iterator(tasks)) {
    EXPECT_EQ(::sched_getscheduler(std::stoi(thread.path().filename())), SCHED_FIFO | SCHED_RESET_ON_FORK)
        << "the flag: threads that it starts are ordinary";
    ++threads;
  }
  EXPECT_GE(threads, 2) << "one that decides, one that receives";
  certifier.Signal(SIGHUP);
  EXPECT_TRUE(certifier.WaitForLog("is in force"));
  EXPECT_EQ(certifier.Terminate(), 0) << certifier.error();
}

TEST_F(CertifierProcessTest, AnswersGoodAndBadExactlyOnceAndPassesOnOnlyWhatItCertified) {
  Send(New(kGentle), decision_t::CAUSE_NONE);
  const candidate_plan_t good = New(kGentle);
  Send(good, decision_t::CAUSE_NONE);
  Send(New(kIntoTheCircle), decision_t::CAUSE_OBSTACLE);
  Send(New(kOutsideDomain), decision_t::CAUSE_DOMAIN_EXIT);

  ASSERT_TRUE(WaitForDecisions(4));  // of what waits together the newest is decided on first
  candidate_plan_t bad = New(kGentle);
  bad.plan_id = 1;
  Send(bad, decision_t::CAUSE_DUPLICATE);
  bad = New(kGentle);
  bad.utime -= 60'000'000;
  Send(bad, decision_t::CAUSE_STALE);
  bad = New(kGentle);
  bad.utime += 60'000'000;
  Send(bad, decision_t::CAUSE_FUTURE);
  bad = New(kGentle);
  bad.start_utime = bad.utime - 1'000'000;
  Send(bad, decision_t::CAUSE_TOO_LATE);
  bad = New(kGentle);
  bad.num_states = 6;
  Send(bad, decision_t::CAUSE_WRONG_DIMENSION);
  bad = New(kGentle);
  bad.control[11][1] = std::numeric_limits<double>::quiet_NaN();
  Send(bad, decision_t::CAUSE_NON_FINITE);

  std::vector<std::uint8_t> bytes = Encode(New(kGentle));
  bytes.pop_back();
  Send(bytes, decision_t::CAUSE_WRONG_LENGTH);
  bytes.resize(bytes.size() + 2);
  Send(bytes, decision_t::CAUSE_TRAILING_BYTES);
  Send(Encode(transition_t{}), decision_t::CAUSE_UNKNOWN_FINGERPRINT);
  Send(std::vector<std::uint8_t>{}, decision_t::CAUSE_WRONG_LENGTH);
  Send(New(kGentle), decision_t::CAUSE_NONE);  // good again

  ASSERT_TRUE(WaitForDecisions(expected_.size()));
  probe_.ListenFor(std::chrono::milliseconds(700));  // a second answer would come, and a heartbeat does
  const auto decisions = probe_.Heard<decision_t>("PLAN_DECISION");
  std::map<std::string, std::string_view> causes;
  for (std::size_t i = 0; i < decisions.size(); ++i) {
    EXPECT_EQ(decisions[i].sequence, static_cast<std::int64_t>(i));
    causes[ToHex(GetDigest(decisions[i].plan_digest))] = CauseName(decisions[i].cause);
  }
  EXPECT_EQ(decisions.size(), expected_.size());
  EXPECT_EQ(causes, expected_);

  const auto certified = probe_.Heard<certified_plan_t>("PLAN_CERTIFIED");
  ASSERT_EQ(certified.size(), 3u);
  for (const certified_plan_t& plan : certified) {
    EXPECT_EQ(expected_.at(ToHex(PlanDigest(plan.plan))), "none");
    EXPECT_TRUE(FindSealFaults(plan).empty());
    EXPECT_EQ(GetDigest(plan.config_digest), config_.grounds.config);
  }
  EXPECT_TRUE(std::ranges::any_of(certified, [&](const auto& plan) { return Encode(plan.plan) == Encode(good); }));

  const auto status = probe_.Heard<certifier_status_t>("CERTIFIER_STATUS");
  ASSERT_FALSE(status.empty());
  EXPECT_FIELDS(status.back(), (candidates, 15), (by_outcome[decision_t::CERTIFIED], 3),
                (by_outcome[decision_t::ABSTAIN_SAFETY], 1), (by_outcome[decision_t::ABSTAIN_DOMAIN], 1),
                (by_outcome[decision_t::REJECTED], 10));

  EXPECT_EQ(certifier_.Terminate(), 0) << certifier_.error();
  EXPECT_THAT(nlohmann::json::parse(certifier_.output()), Holds({{"candidates", 15}, {"certified", 3}}));
}

// ---- Obstacles from the bus.

struct CertifierObstaclesTest : testing::Test {
  // The file has no obstacles: all are on the bus.
  CertifierObstaclesTest() {
    world_ = scratch_.Write("world.yaml", PatientTask());
    const std::string none =
        Replaced(PatientTask(), "obstacles:\n    - circle: {center: [0, 2], radius: 0.8}\n", "obstacles: []\n");
    path_ =
        scratch_.Write("task.yaml", Replaced(none, "obstacles: task,", "obstacles: bus, obstacles_lost_ms: never,"));
    config_ = LoadConfig(path_);
  }
  std::unique_ptr<ChildProcess> StartCertifier(const std::string& state = "state") const {
    auto certifier = std::make_unique<ChildProcess>(std::vector<std::string>{
        FOREREACH_CERTIFIER, "--config", path_, "--lcm-url", PrivateBusUrl(), "--state", scratch_ / state});
    EXPECT_TRUE(certifier->WaitForLog("ready on")) << certifier->error();
    return certifier;
  }
  std::unique_ptr<ChildProcess> StartPerception() const {
    return std::make_unique<ChildProcess>(
        std::vector<std::string>{FOREREACH_PROGRAM, "obstacles", "--config", world_, "--lcm-url", PrivateBusUrl()});
  }
  // The answer to a candidate that drives into the circle.
  decision_t Ask() {
    const std::size_t before = probe_.heard("PLAN_DECISION").size();
    probe_.bus().Publish("PLAN_CANDIDATE", CandidateFor(config_, next_plan_id_++, kIntoTheCircle, 12));
    if (!probe_.WaitUntil([&] { return probe_.heard("PLAN_DECISION").size() > before; })) {
      ADD_FAILURE() << "no answer";
      return {};
    }
    return probe_.Heard<decision_t>("PLAN_DECISION").back();
  }
  // Asks until the cause is another.
  std::int16_t AskUntilNot(std::int16_t cause) {
    std::int16_t now = cause;
    for (int i = 0; i < 200 && now == cause; ++i) {
      now = Ask().cause;
      probe_.ListenFor(std::chrono::milliseconds(20));
    }
    return now;
  }
  [[nodiscard]] certifier_status_t StatusOf(std::int64_t other_than) {
    certifier_status_t found{};
    EXPECT_TRUE(probe_.WaitUntil([&] {
      const auto all = probe_.Heard<certifier_status_t>("CERTIFIER_STATUS");
      if (all.empty() || all.back().instance == other_than) return false;
      found = all.back();
      return true;
    }));
    return found;
  }

  const ScratchDirectory scratch_;
  std::string path_, world_;
  Config config_;
  BusProbe probe_{PrivateBusUrl(), {"PLAN_DECISION", "PLAN_CERTIFIED", "CERTIFIER_STATUS"}};
  std::int64_t next_plan_id_ = 1;
};

// Before: S; SIGKILL; restart: "certified: no obstacles".
TEST_F(CertifierObstaclesTest, ARestartedCertifierCertifiesNothingBeforeItHearsObstacles) {
  auto perception = StartPerception();
  auto certifier = StartCertifier();
  EXPECT_EQ(AskUntilNot(decision_t::CAUSE_NO_OBSTACLES), decision_t::CAUSE_OBSTACLE);
  certifier->Signal(SIGKILL);
  ASSERT_TRUE(certifier->WaitForEnd(kPatience));
  EXPECT_EQ(perception->Terminate(), 0) << perception->error();
  certifier = StartCertifier();
  for (int i = 0; i < 3; ++i) EXPECT_EQ(CauseName(Ask().cause), "no_obstacles");
  perception = StartPerception();
  EXPECT_EQ(AskUntilNot(decision_t::CAUSE_NO_OBSTACLES), decision_t::CAUSE_OBSTACLE);
  EXPECT_EQ(perception->Terminate(), 0) << perception->error();
  EXPECT_EQ(AskUntilNot(decision_t::CAUSE_OBSTACLE), decision_t::CAUSE_NO_OBSTACLES) << "silence";
  EXPECT_TRUE(probe_.heard("PLAN_CERTIFIED").empty());
  EXPECT_EQ(certifier->Terminate(), 0) << certifier->error();
}

// 4,096 in 64 messages, by the programs: the certifier knows them all, names the one that it may touch, and one that
// starts late gets them, too.
TEST_F(CertifierObstaclesTest, AsManyObstaclesAsATaskTakesAreHeardAndStayKnown) {
  std::string world = Read(world_), cells;
  for (int i = 0; i < 4095; ++i)
    cells += fmt::format("    - {{name: cell_{0}, box: {{lower: [{1}, 90], upper: [{1}.5, 90.5]}}}}\n", i, i % 64);
  const std::string circle = "    - circle: {center: [0, 2], radius: 0.8}\n";
  world.replace(world.find(circle), circle.size(), cells + circle + "      name: the_last\n");
  scratch_.Write("world.yaml", world);
  const auto perception = StartPerception();
  std::unique_ptr<ChildProcess> certifier;
  std::int64_t instance = 0;
  for (int start = 0; start < 2; ++start) {
    if (certifier) {
      certifier->Signal(SIGKILL);
      ASSERT_TRUE(certifier->WaitForEnd(kPatience));
    }
    certifier = StartCertifier();
    certifier_status_t last{};
    ASSERT_TRUE(probe_.WaitUntil([&] {
      const auto all = probe_.Heard<certifier_status_t>("CERTIFIER_STATUS");
      if (!all.empty()) last = all.back();
      return last.instance != instance && last.obstacles_known == 1;
    }));
    EXPECT_EQ(last.obstacles_in_force, 4096);
    instance = last.instance;
    const decision_t decision = Ask();
    EXPECT_EQ(decision.obstacle, 4095);
    EXPECT_THAT(GetText(decision.message), testing::HasSubstr(" may touch the_last (by "));
  }
  EXPECT_TRUE(probe_.heard("PLAN_CERTIFIED").empty());
  EXPECT_EQ(perception->Terminate(), 0) << perception->error();
  EXPECT_EQ(AskUntilNot(decision_t::CAUSE_OBSTACLE), decision_t::CAUSE_NO_OBSTACLES) << "silence";
  EXPECT_EQ(certifier->Terminate(), 0) << certifier->error();
}

// 10^5 cells in 45 pieces of one message, by the programs.
TEST_F(CertifierObstaclesTest, AGridIsHeardAndItsCellsAreNamed) {
  std::string grid =
      "    - name: hall\n      grid:\n        resolution: 0.01\n        origin: [-0.5, 1.5]\n        unknown: free\n"
      "        size: [400, 250]\n        rows: |\n";
  for (int row = 0; row < 250; ++row) grid += "          " + std::string(400, row < 100 ? '.' : '#') + "\n";
  scratch_.Write("world.yaml", Replaced(Read(world_), "    - circle: {center: [0, 2], radius: 0.8}\n", grid));
  const auto perception = StartPerception();
  auto certifier = StartCertifier();
  certifier_status_t last{};
  ASSERT_TRUE(probe_.WaitUntil([&] {
    const auto all = probe_.Heard<certifier_status_t>("CERTIFIER_STATUS");
    if (!all.empty()) last = all.back();
    return last.obstacles_known == 1;
  }));
  EXPECT_EQ(last.obstacles_in_force, 1);
  EXPECT_THAT(GetText(Ask().message), testing::HasSubstr(" may touch cells (0, 0) to (399, 149) of hall (by "));
  EXPECT_EQ(perception->Terminate(), 0) << perception->error();
  EXPECT_EQ(certifier->Terminate(), 0) << certifier->error();
}

TEST_F(CertifierObstaclesTest, ASecondCertifierStandsByAndTakesOver) {
  const auto perception = StartPerception();
  auto first = StartCertifier();
  EXPECT_EQ(AskUntilNot(decision_t::CAUSE_NO_OBSTACLES), decision_t::CAUSE_OBSTACLE);
  const std::int64_t instance = StatusOf(0).instance;
  auto second = StartCertifier("another state");
  EXPECT_NE(StatusOf(instance).instance, instance);
  ASSERT_TRUE(second->WaitForLog("is in charge on this bus: this one decides nothing")) << second->error();
  const std::size_t before = probe_.heard("PLAN_DECISION").size();
  for (int i = 0; i < 5; ++i) EXPECT_EQ(Ask().cause, decision_t::CAUSE_OBSTACLE);
  probe_.ListenFor(std::chrono::milliseconds(300));
  EXPECT_EQ(probe_.heard("PLAN_DECISION").size(), before + 5) << "one answer each";
  first->Signal(SIGKILL);
  ASSERT_TRUE(second->WaitForLog("in charge, as instance")) << second->error();
  EXPECT_EQ(AskUntilNot(decision_t::CAUSE_NO_OBSTACLES), decision_t::CAUSE_OBSTACLE);
  EXPECT_EQ(second->Terminate(), 0) << second->error();
}

TEST_F(CertifierObstaclesTest, RefusesATaskThatDoesNotSayWhereObstaclesComeFrom) {
  const std::string path = scratch_.Write("unsaid.yaml", Replaced(PatientTask(), "obstacles: task, ", ""));
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{FOREREACH_CERTIFIER, "--config", path, "--lcm-url", PrivateBusUrl()},
        {FOREREACH_PROGRAM, "run", "--config", path, "--directory", scratch_ / "log"}}) {
    ChildProcess process(command);
    EXPECT_EQ(process.WaitForExit(), 2);
    EXPECT_THAT(process.error(), HasSubstr(path + ": gate.obstacles: missing. `bus`: "));
  }
}

// As fast as it can, with no more under way than the kernel's smallest buffer holds: UDP may drop what a buffer cannot
// take, and this test is about the certifier.
TEST_F(CertifierProcessTest, FiveHundredCandidatesInABurstAreAnsweredExactlyOnce) {
  constexpr std::size_t kCandidates = 500, kUnderWay = 8;
  std::map<std::int64_t, int> answers;
  for (std::size_t sent = 0; sent < kCandidates; ++sent) {
    ASSERT_TRUE(WaitForDecisions(sent < kUnderWay ? 0 : sent - kUnderWay + 1)) << sent;
    Send(New(sent % 2 == 0 ? kGentle : kIntoTheCircle), 0);
  }
  ASSERT_TRUE(WaitForDecisions(kCandidates));
  probe_.ListenFor(std::chrono::milliseconds(600));
  std::map<std::int16_t, std::size_t> causes;
  for (const decision_t& decision : probe_.Heard<decision_t>("PLAN_DECISION")) {
    ++answers[decision.plan_id];
    ++causes[decision.cause];
  }
  EXPECT_EQ(answers.size(), kCandidates);
  for (const auto& [plan_id, count] : answers) EXPECT_EQ(count, 1) << plan_id;
  const std::size_t certified = causes[decision_t::CAUSE_NONE], overrun = causes[decision_t::CAUSE_OVERRUN];
  EXPECT_EQ(probe_.heard("PLAN_CERTIFIED").size(), certified);
#ifdef __SANITIZE_THREAD__  // a few take longer there than they may
  EXPECT_EQ(certified + overrun, kCandidates / 2);
#else
  EXPECT_EQ(overrun, 0u);
  EXPECT_EQ(certified, kCandidates / 2);
#endif
  EXPECT_EQ(probe_.Heard<certifier_status_t>("CERTIFIER_STATUS").back().candidates, kCandidates);
}

TEST_F(CertifierProcessTest, StopsInTheMiddleOfAFlood) {
  for (int i = 0; i < 200; ++i) Send(New(kGentle), 0);
  EXPECT_EQ(certifier_.Terminate(), 0) << certifier_.error();
  EXPECT_TRUE(nlohmann::json::accept(certifier_.output())) << certifier_.output();
}

}  // namespace forereach::certifier_process_test
