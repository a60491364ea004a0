// `forereach advise`: the shipped abstentions, a recorded course, and answers that are about time.

#include "advise/gate_advice.h"
#include "certifier/gate/gate.h"
#include "cli/abstention_advice.h"
#include "forereach/certify/tube.h"
#include "forereach/obstacles_t.hpp"
#include "tests/certifier/gap_task.h"
#include "tests/cli/program.h"
#include "tests/records/course.h"
#include "tests/records/logs.h"

namespace forereach::advise_test {

const std::string kCourse = "tests/data/course.lcmlog --config tests/data/course.yaml";

struct AdviseTest : testing::Test {
  Output AdviseOn(const std::string& task, const std::string& plan, const std::string& options = "") {
    const std::string decision = scratch_ / "decision.json";
    Forereach("certify --json --config config/" + task + " --plan config/plans/" + plan + " > " + decision);
    return Forereach("advise " + decision + options + " 2>&1");
  }

  ScratchDirectory scratch_;
};

TEST_F(AdviseTest, NamesTheLeastDistanceToTheObstacle) {
  EXPECT_THAT(AdviseOn("bicycle.yaml", "bicycle_safety.csv"),
              Exits(0, "it would be certified\n    move: if it passed farther away", "obstacle 0 by 1.14 m",
                    "with its first 10 steps alone", "1 have a change that turns them, verified by certifying again"));
}

TEST_F(AdviseTest, SaysWhereNoSoundMethodCouldCertify) {
  const std::string text = AdviseOn("bicycle.yaml", "bicycle_safety.csv", " --inner").text;
  EXPECT_THAT(text, ContainsRegex("the inner bound\n *half-width at step 12: [0-9.]+ m; no sound tube is below"));
  EXPECT_THAT(text, ContainsRegex("no sound method could certify this with these data: of a system that agrees with "
                                  "all of them, at step [0-9]+ it is not so that the slice keeps clear of obstacle 0"));
}

// The tube from X0 just may touch: pieces of X0 are certified, so no motion can.
TEST_F(AdviseTest, SaysNothingOfTheKindWhereOneDoes) {
  GapTask(scratch_);
  const std::string decision = scratch_ / "decision.json";
  Forereach("certify --json --config " + (scratch_ / "gap.yaml") + " --plan config/plans/bicycle_certified.csv > " +
            decision);
  const std::string text = Forereach("advise --inner " + decision + " 2>&1").text;
  EXPECT_THAT(text, HasSubstr("no sound tube is below"));
  EXPECT_THAT(text, Not(HasSubstr("no sound method")));
}

// The corners of the hull of another set may be no states of it.
TEST_F(AdviseTest, TheInnerBoundIsOfABoxOnly) {
  const Config config = LoadConfig(FOREREACH_SOURCE_DIR "/config/bicycle.yaml");
  Case judged{.problem = config.problem,
              .controls = LoadPlan(FOREREACH_SOURCE_DIR "/config/plans/bicycle_safety.csv", *config.problem->model),
              .initial_set = Zonotope::Enclose(config.initial_set),
              .obstacles = config.obstacles};
  const Certifier certifier(config.problem);
  const auto bound = [&] {
    Tube tube;
    static_cast<void>(certifier.Certify(judged.plan(), judged.initial_set, judged.obstacles, tube));
    return BoundFromWithin(judged, certifier, tube);
  };
  EXPECT_TRUE(bound());
  Eigen::MatrixXd generators = judged.initial_set.GeneratorMatrix();
  generators(1, 0) = generators(0, 0);
  judged.initial_set = Zonotope(judged.initial_set.CenterVector(), generators);
  EXPECT_FALSE(bound());
}

TEST_F(AdviseTest, NamesTheBoundOfTheDomain) {
  EXPECT_THAT(AdviseOn("bicycle.yaml", "bicycle_domain.csv").text,
              HasSubstr("if the domain, and with it the declaration, reached farther: a to 4.41"));
}

// Advice on one step of a point mass whose vx begins within 0.2 of `center` and stays there. @param bound YAML of the
// task. @param errors YAML of its declaration.
std::string AdviceOnOneStep(const ScratchDirectory& scratch, const std::string& center, const std::string& bound,
                            const std::string& errors = "") {
  scratch.Write("d.csv", "px,py,vx,vy,ax,ay,px_next,py_next,vx_next,vy_next\n0,0,0,0,0,0,0,0,0,0\n");
  scratch.Write("plan.csv", "ax,ay\n0,0\n");
  scratch.Write("task.yaml",
                "model: {name: point_mass, dt: 0.1}\n"
                "domain: {state: {lower: [-9, -9, -9, -9], upper: [9, 9, 9, 9]}, input: {lower: [-1, -1], upper: "
                "[1, 1]}}\ndeclaration: {lipschitz: {}, noise_bound: [0, 0, 0, 0]" +
                    errors +
                    "}\ntransitions: d.csv\n"
                    "task: {initial_set: {center: [0, 0, " +
                    center + ", 0], half_width: [0.1, 0.1, 0.2, 0]}, projection: [px, py], between: samples, " + bound +
                    (bound.starts_with("obstacles") ? "}\n" : ", obstacles: []}\n"));
  const std::string decision = scratch / "decision.json";
  Forereach("certify --json --config " + (scratch / "task.yaml") + " --plan " + (scratch / "plan.csv") + " > " +
            decision);
  return Forereach("advise " + decision + " 2>&1").text;
}

// vx ends in [-0.25, 0.15], or the mirror image of it, and has to be in [-0.01, 0.01].
TEST_F(AdviseTest, TheBoundOfRestCoversBothSides) {
  for (const char* center : {"-0.05", "0.05"})
    EXPECT_THAT(AdviceOnOneStep(scratch_, center, "rest: {vx: 0.01}"),
                HasSubstr("it would be certified\n    declaration: if standing allowed vx up to 0.25"))
        << center;
}

// As for rest: vx is in [-0.25, 0.15] or [-0.15, 0.25] all the time, and its one limit has two sides.
TEST_F(AdviseTest, AWiderLimitCoversBothSides) {
  for (const auto& [center, least, most] : {std::tuple{"-0.05", "-0.25", "0.15"}, {"0.05", "-0.15", "0.25"}})
    EXPECT_THAT(AdviceOnOneStep(scratch_, center, "limits: [{name: slow, that: vx, at_least: -0.01, at_most: 0.01}]"),
                AllOf(HasSubstr("if its limits were wider: slow at least " + std::string(least)),
                      HasSubstr(" at most " + std::string(most))));
}

// px ends within 0.12 without the disturbance, and has to stay below 0.15.
TEST_F(AdviseTest, ASmallerDisturbanceAloneMayBeEnough) {
  const std::string text = AdviceOnOneStep(scratch_, "0", "obstacles: [{circle: {center: [1.15, 0], radius: 1}}]",
                                           ", disturbance: [0.1, 0, 0, 0]");
  EXPECT_THAT(
      text, AllOf(HasSubstr("  it would be certified\n    move: if it passed farther away"),
                  HasSubstr("\n    declaration: if disturbance were declared 0.1"), HasSubstr("\n  disturbance: 1\n")));
}

TEST_F(AdviseTest, NamesWhatMakesTheDataConsistent) {
  const Output output = AdviseOn("bicycle_falsified.yaml", "bicycle_certified.csv", " --all");
  EXPECT_THAT(output.text, AllOf(HasSubstr("if larger slopes were declared: those of theta times 5.99"),
                                 HasSubstr("without observation 0: then it is \"abstain F"),
                                 HasSubstr("without observation 6: then it is \"abstain F")));
}

TEST_F(AdviseTest, GivesNoAdviceOnACertificate) {
  const Output output = AdviseOn("bicycle.yaml", "bicycle_certified.csv", " --json");
  const auto document = nlohmann::json::parse(output.text);
  EXPECT_EQ(document["certified"], 1);
  EXPECT_EQ(document["abstentions"].size(), 0u);
}

TEST_F(AdviseTest, FindsAChangeThatCertifiesForEachAbstentionOfACourse) {
  const Output output = Forereach("advise --json " + kCourse);
  EXPECT_EQ(output.code, 0);
  const auto document = nlohmann::json::parse(output.text);
  EXPECT_EQ(document["certified"], kCourseCertified);
  EXPECT_EQ(document["abstentions"].size(), std::size_t{kCourseAbstained});
  for (const auto& abstention : document["abstentions"]) {
    int turned = 0;
    for (const auto& advice : abstention["advice"]) turned += advice["turns"].get<bool>();
    EXPECT_GT(turned, 0) << abstention["name"];
  }
  EXPECT_GT(document["places"].size(), 0u);
  EXPECT_GT(document["places"][0]["turned"], 1);
}

// One candidate, answered by a gate at several times.
TEST_F(AdviseTest, NamesTheOptionWithWhichALateOrEarlyCandidateIsAccepted) {
  const Config config = LoadConfig(kCourseTask);
  candidate_plan_t candidate{};
  for (const LogEvent& event : ReadLog(kCourseLog).events)
    if (event.channel == config.bus.candidate) {
      candidate = *Decoded<candidate_plan_t>(event.data);
      break;
    }
  const std::string log = scratch_ / "events-20260101-120000-000000.lcmlog";
  EventLogWriter writer(log);
  const auto answer = [&](std::int64_t now_us) {
    ++candidate.plan_id;
    const auto bytes = Encode(candidate);
    writer.Append(now_us, config.bus.candidate, bytes);
    writer.Append(now_us, config.bus.decision, Encode(Gate(config).Decide(bytes, now_us).decision));
  };
  answer(candidate.utime + 700'000);
  answer(candidate.utime - 60'000);
  answer(candidate.start_utime - 3'000);
  ASSERT_TRUE(writer.Flush());
  const Output output = Forereach("advise " + log + " --config tests/data/course.yaml 2>&1");
  EXPECT_THAT(output.text, AllOf(HasSubstr("with gate.max_age_ms of at least 700\n"),
                                 HasSubstr("with gate.max_ahead_ms of at least 60, if"),
                                 HasSubstr("with gate.decision_budget_ms of at most 3, or sent 2 ms earlier")));
}

TEST_F(AdviseTest, ADatabaseAndADirectoryAreReadAsTheirLogs) {
  const std::string directory = scratch_ / "log";
  ASSERT_EQ(Forereach("run --config tests/data/field.yaml --directory " + directory + " > /dev/null 2>&1").code, 0);
  const std::string logs = "$(ls " + directory + "/*.lcmlog)";
  const auto of = [](const std::string& files) {
    return nlohmann::json::parse(Forereach("advise --json " + files + " 2>/dev/null").text);
  };
  auto by_log = of(logs), by_database = of(directory + "/decisions.sqlite"), by_directory = of(directory);
  EXPECT_GT(by_log["abstentions"].size(), 0u);
  EXPECT_EQ(by_database, by_directory);
  EXPECT_EQ(by_log["places"], by_directory["places"]);
  ASSERT_EQ(by_log["abstentions"].size(), by_directory["abstentions"].size());
  for (std::size_t i = 0; i < by_log["abstentions"].size(); ++i)
    EXPECT_EQ(by_log["abstentions"][i]["advice"], by_directory["abstentions"][i]["advice"]);
  std::filesystem::remove(directory + "/decisions.sqlite");
  EXPECT_EQ(of(directory)["certified"], by_log["certified"]);
  EXPECT_EQ(of(scratch_ / "")["certified"], by_log["certified"]) << "a directory in a directory";
  const std::string empty = scratch_ / "empty";
  std::filesystem::create_directory(empty);
  EXPECT_EQ(Forereach("advise " + empty + " 2>&1").code, 2) << "no logs";
}

TEST_F(AdviseTest, ReadsTheRunsOfADirectory) {
  for (const char* robot : {"a", "b"}) {
    std::filesystem::create_directories(scratch_ / ("night/" + std::string(robot)));
    std::filesystem::copy_file(kCourseLog, scratch_ / ("night/" + std::string(robot) + "/one.lcmlog"));
  }
  const Output output =
      Forereach("advise '" + (scratch_ / "night") + "' --config tests/data/course.yaml --advice-seconds 0 --json 2>&1");
  EXPECT_EQ(nlohmann::json::parse(output.text)["abstentions"].size(), std::size_t{2 * kCourseAbstained});
}

TEST_F(AdviseTest, AfterItsTimeOnlyWhatMissedByLeastIsSearched) {
  const std::string log = kCourseLog;
  const RunTasks tasks(kCourseTask, {}, false);
  std::vector<Abstentions> runs(1);
  runs[0] = ReadAbstentions({"", {log}, "", {}}, tasks, false, 1000);
  std::deque<RecordedAbstention>& all = runs[0].all;
  std::erase_if(all, [](const RecordedAbstention& each) { return each.outcome != decision_t::ABSTAIN_SAFETY; });
  ASSERT_GE(all.size(), 3u);
  all.resize(3);
  const auto shortfall = [](const RecordedAbstention& each) {
    return std::abs(each.decision.threshold - each.decision.margin);
  };
  const std::ptrdiff_t nearest = std::ranges::min_element(all, {}, shortfall) - all.begin();
  const auto advised = AdviseAll(runs, 1, 0);
  for (std::ptrdiff_t i = 0; i < 3; ++i) {
    EXPECT_FIELDS(advised[0][static_cast<std::size_t>(i)], (advices.empty(), i != nearest),
                  (missing, i == nearest ? ""
                                         : "not searched within 0 s: `forereach advise` searches all, or write a "
                                           "longer --advice-seconds"));
  }
}

TEST_F(AdviseTest, NamesTheQueueLengthAndTheTimeoutThatSuffice) {
  Config config = LoadConfig(kCourseTask);
  config.gate.obstacles = ObstaclesSource::kBus;
  config.gate.queue = 4;
  RecordedAbstention abstention;
  abstention.task = &config;
  abstention.decision.utime = 1'700'000'000'000'000;
  abstention.decision.cause = decision_t::CAUSE_QUEUE_FULL;
  abstention.waiting = 4;
  EXPECT_EQ(RemedyFor(abstention)->key, "") << "then it was not the queue";
  abstention.waiting = 9;
  EXPECT_EQ(RemedyFor(abstention)->what, "with gate.queue of at least 9, if the log has every candidate");
  EXPECT_EQ(RemedyFor(abstention)->key, "gate.queue");
  EXPECT_FALSE(RemedyFor(abstention)->turns);

  abstention.decision.cause = decision_t::CAUSE_NO_OBSTACLES;
  EXPECT_FALSE(RemedyFor(abstention)->turns) << "none was ever heard";
  obstacles_t seen{.utime = abstention.decision.utime - 1'250'000};
  abstention.last_obstacles =
      std::make_shared<std::pair<std::vector<std::uint8_t>, std::int64_t>>(Encode(seen), seen.utime);
  const Remedy silence = RemedyFor(abstention).value();
  EXPECT_EQ(silence.what, "with gate.obstacles_timeout_ms of at least 1250");
  EXPECT_FALSE(silence.turns) << "there is no candidate that could be judged";
}

// Anyone may have written a log: its numbers need not fit each other.
TEST_F(AdviseTest, FindsNoAdviceForALogWhoseNumbersContradictEachOther) {
  const Config config = LoadConfig(kCourseTask);
  const std::string log = scratch_ / "events-20260101-120000-000000.lcmlog";
  EventLogWriter writer(log);
  std::int64_t plan_id = 0;
  const auto claim = [&](candidate_plan_t candidate, std::int16_t outcome, std::int16_t cause, std::int64_t utime) {
    candidate.plan_id = ++plan_id;
    decision_t decision = MakeDecision(candidate, plan_id, outcome, cause);
    decision.utime = utime;
    SetGrounds(decision, config.grounds);
    writer.Append(plan_id, config.bus.candidate, Encode(candidate));
    writer.Append(plan_id, config.bus.decision, Encode(decision));
  };
  candidate_plan_t candidate = MakeCandidate(0, 0);
  for (const auto& [states, inputs, steps] : {std::tuple(6, 2, 32767), {6, 32767, 12}, {32767, 2, 12}, {-1, -1, -1}}) {
    candidate.num_states = static_cast<std::int16_t>(states);
    candidate.num_inputs = static_cast<std::int16_t>(inputs);
    candidate.num_steps = static_cast<std::int16_t>(steps);
    claim(candidate, decision_t::ABSTAIN_SAFETY, decision_t::CAUSE_OBSTACLE, 1);
  }
  candidate.num_states = 6, candidate.num_inputs = 2, candidate.num_steps = 12, candidate.step_us = 100'000;
  candidate.initial_half_width[3] = -1;
  claim(candidate, decision_t::ABSTAIN_SAFETY, decision_t::CAUSE_OBSTACLE, 1);
  candidate.utime = candidate.start_utime = INT64_MAX;
  for (const std::int16_t cause : {decision_t::CAUSE_STALE, decision_t::CAUSE_FUTURE, decision_t::CAUSE_DEADLINE})
    claim(candidate, decision_t::REJECTED, cause, INT64_MIN);
  ASSERT_TRUE(writer.Flush());
  EXPECT_THAT(Forereach("advise " + log + " --config tests/data/course.yaml 2>&1"),
              Exits(1, "its candidate is not of this task's sizes",
                    "its initial set: ", "8 abstentions and rejections, 0 have"));
}

TEST_F(AdviseTest, RefusesAFileThatIsNoRecord) {
  scratch_.Write("no.json", "{\"outcome\": \"domain\"}");
  EXPECT_THAT(Forereach("advise " + (scratch_ / "no.json") + " 2>&1"), Exits(2, "inputs"));
  EXPECT_EQ(Forereach("advise README.md 2>&1").code, 2);

  AdviseOn("bicycle.yaml", "bicycle_safety.csv");
  auto document = nlohmann::json::parse(Read(scratch_ / "decision.json"));
  document["inputs"]["initial_set"]["lower"][0] = 9;
  scratch_.Write("turned.json", document.dump());
  EXPECT_THAT(Forereach("advise " + (scratch_ / "turned.json") + " 2>&1"),
              Exits(2, "inputs.initial_set: a lower bound is above its upper one"));
  document["inputs"]["initial_set"]["lower"][0] = -9;
  document["inputs"]["initial_set"]["upper"][0] = -8.9;
  scratch_.Write("moved.json", document.dump());
  EXPECT_THAT(Forereach("advise " + (scratch_ / "moved.json") + " 2>&1").text,
              HasSubstr("judged again by what is recorded: certified"));
}

}  // namespace forereach::advise_test
