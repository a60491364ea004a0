#include "records/summary.h"

#include "tests/messages.h"
#include "tests/records/logs.h"

namespace forereach::summary_test {

Config GoalConfig() {
  Config config;
  auto problem = std::make_shared<Problem>();
  problem->projection = Eigen::MatrixXd::Identity(2, 4);
  config.problem = problem;
  config.planner.goal = {3, 4};
  return config;
}

/** A hundred candidates, decided after 1 .. 100 microseconds, and some driving. */
void WriteRun(const std::string& path) {
  EventLogWriter writer(path);
  std::int64_t now = 1'000'000;
  for (int i = 0; i < 100; ++i) {
    const candidate_plan_t candidate = MakeCandidate(i, i);
    writer.Append(now, "PLAN_CANDIDATE", Encode(candidate));
    now += i + 1;
    decision_t decision = MakeDecision(candidate, i, decision_t::CERTIFIED, decision_t::CAUSE_NONE);
    if (i < 30) decision = MakeDecision(candidate, i, decision_t::ABSTAIN_SAFETY, decision_t::CAUSE_OBSTACLE);
    if (i < 10) decision = MakeDecision(candidate, i, decision_t::ABSTAIN_DOMAIN, decision_t::CAUSE_DOMAIN_EXIT);
    if (i < 2) decision = MakeDecision(candidate, i, decision_t::REJECTED, decision_t::CAUSE_STALE);
    decision.elapsed_us = i;
    writer.Append(now, "PLAN_DECISION", Encode(decision));
  }
  int sequence = 0;
  using E = execution_event_t;
  for (const std::int16_t kind : {E::ACCEPTED, E::REFUSED, E::STARTED, E::STEP_INSIDE, E::STEP_INSIDE, E::STEP_INSIDE,
                                  E::TAIL_BEGUN, E::STANDING, E::STEP_OUTSIDE, E::STEP_CONSISTENT, E::STEP_CONSISTENT,
                                  E::STANDING, E::CONTACT, E::LIMIT_EXCEEDED, E::GOAL_REACHED})
    writer.Append(now, "EXECUTION_EVENT", Encode(MakeEvent(sequence++, kind)));
  writer.Append(now, "EXECUTION_EVENT", Encode(MakeEvent(sequence + 4, E::STANDING)));
  robot_state_t state{.num_states = 4};
  state.state[0] = 3;
  state.state[1] = 3.5;
  writer.Append(3'000'000, "ROBOT_STATE", Encode(state));
  ASSERT_TRUE(writer.Flush());
}

Summary SummarizeLogs(const std::vector<std::string>& logs, const Config& config) {
  Summarizer summarizer(config);
  Timeline timeline(config, {&summarizer});
  timeline.Read(logs, false);
  return summarizer.Finish(timeline, config);
}

TEST(Summary, CountsAHandMadeLog) {
  const ScratchDirectory scratch;
  WriteRun(scratch / "log");
  const Summary summary = SummarizeLogs({scratch / "log"}, GoalConfig());
  EXPECT_FIELDS(summary, (proposed, 100), (decided, 100), (certified, 70),
                (abstained, (std::map<std::string, std::int64_t>{{"domain_exit", 8}, {"obstacle", 20}})),
                (rejected, (std::map<std::string, std::int64_t>{{"stale", 2}})), (latency_us.p50, 50),
                (latency_us.p99, 99));
  EXPECT_EQ(summary.certify_us.p50, 50) << "rejected ones, 0 and 1, are not certify steps";
  EXPECT_EQ(summary.distance_to_goal_m, 0.5);
  EXPECT_TRUE(summary.goal_reached);
  EXPECT_FIELDS(summary, (contacts, 1), (limits_exceeded, 1), (steps_inside, 3), (steps_outside, 1),
                (steps_consistent, 2));
  EXPECT_THAT(ToText(summary), ContainsRegex("certified +70 .*if the declaration is true"));
  EXPECT_THAT(ToText(summary),
              ContainsRegex("steps in certified slice +3 of 6, 2 consistent .within the state error.\n"));
  EXPECT_FIELDS(summary, (tails, 1), (stops, 3), (refused, 1),
                (lost, (std::map<std::string, std::int64_t>{{"bus", 4}})), (restarts, 0));
  EXPECT_DOUBLE_EQ(summary.duration_s, 2.0);
  EXPECT_EQ(summary.messages.at("PLAN_CANDIDATE"), 100);
}

TEST(Summary, CountsAWithdrawalOnceHoweverOftenItIsAnswered) {
  const ScratchDirectory scratch;
  EventLogWriter writer(scratch / "log");
  int sequence = 0;
  const auto answer = [&](std::int64_t plan_id, std::int16_t kind, std::int16_t step) {
    writer.Append(1'000'000, "EXECUTION_EVENT", Encode(MakeEvent(sequence++, kind, plan_id, step)));
  };
  for (const std::int16_t step : std::vector<std::int16_t>{5, 5, 3, 3}) answer(7, execution_event_t::WITHDRAWN, step);
  answer(7, execution_event_t::EMERGENCY_STOP, 3);
  for (const std::int64_t plan : {8, 7, 8, 7}) answer(plan, execution_event_t::WITHDRAWN, 3);  // repeated in turn
  ASSERT_TRUE(writer.Flush());
  const Summary summary = SummarizeLogs({scratch / "log"}, GoalConfig());
  EXPECT_FIELDS(summary, (withdrawals, 3), (emergency_stops, 1), (stops, 1));
  EXPECT_THAT(ToText(summary), HasSubstr("withdrawals               3 (1 emergency stops, not certified)"));
}

TEST(Summary, NoTimePassesWhereTheClockWasSetBack) {
  SummaryBuilder builder(GoalConfig());
  for (const std::int64_t utime : {5'000'000, 7'000'000, 1'000'000, 2'500'000})
    builder.Add(LogEvent{.utime = utime, .channel = "A", .data = {}});
  EXPECT_DOUBLE_EQ(builder.Finish().duration_s, 3.5);
}

TEST(Summary, NamesTheFaultThatHaltedTheDrive) {
  SummaryBuilder builder(GoalConfig());
  EXPECT_THAT(ToText(builder.Finish()), Not(HasSubstr("faults")));
  fault_t fault{.utime = 3, .cause = fault_t::SLICE_LEFT};
  for (int i = 0; i < 3; ++i) {  // it is repeated until a reset
    fault.sequence = i;
    builder.Add(LogEvent{.utime = i, .channel = "FAULT", .data = Encode(fault)});
  }
  EXPECT_THAT(ToText(builder.Finish()), HasSubstr("faults latched            1 (slice_left 1)\n"));
  EXPECT_EQ(ToJson(builder.Finish())["faults"], (nlohmann::json{{"slice_left", 1}}));
}

TEST(Summary, OfTheDatabaseAgreesWithThatOfTheLog) {
  const ScratchDirectory scratch;
  WriteRun(scratch / "log");
  Database database(scratch / "d.sqlite");
  ASSERT_TRUE(database.Write(RowsOf(scratch / "log", "log"), "log", std::ssize(ReadLog(scratch / "log").events)));
  nlohmann::json of_log = ToJson(SummarizeLogs({scratch / "log"}, GoalConfig()));
  SummaryBuilder of_rows(GoalConfig());
  of_rows.Add(database.Read("log"));
  nlohmann::json of_database = ToJson(of_rows.Finish());
  for (const char* log_only : {"messages", "duration_s", "distance_to_goal_m"}) {
    of_log.erase(log_only);
    of_database.erase(log_only);
  }
  EXPECT_EQ(of_log, of_database);
}

TEST(Summary, DistanceToTheGoalOfAnEmptyLogIsUnknownNotZero) {
  const ScratchDirectory scratch;
  WriteBytes(scratch / "log", {});
  const Summary summary = SummarizeLogs({scratch / "log"}, GoalConfig());
  EXPECT_FIELDS(summary, (proposed, 0), (distance_to_goal_m, std::nullopt));
  const nlohmann::json json = ToJson(summary);
  EXPECT_TRUE(json["decision_latency_us"]["p50"].is_null());
  EXPECT_TRUE(json["distance_to_goal_m"].is_null());
  EXPECT_THAT(ToText(summary), HasSubstr("not measured"));
}

// A robot that has been at the goal may have driven on.
TEST(Summary, SaysHowFarTheGoalIsAndWhetherItWasReached) {
  Summary summary;
  summary.goal_radius_m = 3;
  const auto line = [&](double distance, bool reached) {
    summary.distance_to_goal_m = distance;
    summary.goal_reached = reached;
    const std::string text = ToText(summary);
    const std::size_t at = text.find("distance to goal") + 26;
    return text.substr(at, text.find('\n', at) - at);
  };
  EXPECT_EQ(line(0.78, true), "0.78 m (goal reached)");
  EXPECT_EQ(line(3, true), "3.00 m (goal reached)");
  EXPECT_EQ(line(5.49, true), "5.49 m at the end (the goal was reached before, within 3 m)");
  EXPECT_EQ(line(5.49, false), "5.49 m (goal not reached)");
}

// The simulated clock of `forereach run` stands still while something is computed.
TEST(Summary, TimesOfASimulatedClockAreNotMeasurements) {
  Summary summary;
  summary.latency_us = summary.certify_us = {0, 0};
  const std::string text = ToText(summary);
  EXPECT_THAT(text, HasSubstr("decision latency          not measured\n"));
  EXPECT_THAT(text, HasSubstr("certify step              not measured\n"));
  EXPECT_TRUE(ToJson(summary)["decision_latency_us"]["p50"].is_null());
  summary.latency_us = {0, 3};
  EXPECT_THAT(ToText(summary), HasSubstr("p50 0.0 us, p99 3.0 us"));
}

TEST(Summary, LeavesOutWhatLiesAcrossAStepOfTheClock) {
  const ScratchDirectory scratch;
  constexpr std::int64_t kFar = std::int64_t{4'000'000'000'000'000'000};
  {
    EventLogWriter writer(scratch / "log");
    std::int64_t sequence = 0;
    for (const auto& [sent, decided] :
         {std::pair{10'000'000, std::int64_t{10'000'400}}, {11'000'000, 5'000'000}, {6'000'000, kFar}}) {
      const candidate_plan_t candidate = MakeCandidate(sequence, sequence);
      writer.Append(sent, "PLAN_CANDIDATE", Encode(candidate));
      writer.Append(decided, "PLAN_DECISION",
                    Encode(MakeDecision(candidate, sequence++, decision_t::CERTIFIED, decision_t::CAUSE_NONE)));
    }
    ASSERT_TRUE(writer.Flush());
  }
  const Summary summary = SummarizeLogs({scratch / "log"}, GoalConfig());
  EXPECT_EQ(summary.latency_us.p99, 400);
  EXPECT_EQ(summary.duration_s, 2);
  EXPECT_EQ(summary.clock_steps, 2);
  EXPECT_THAT(
      ToText(summary),
      testing::HasSubstr("2 times, first 1970-01-01 00:00:11 at event 3 by -6.000 s; times across it are left out"));
  EXPECT_EQ(ToJson(summary)["clock_steps"]["first_us"], -6'000'000);
  EXPECT_EQ(ToJson(summary)["clock_steps"]["first_utime"], 11'000'000);
}

TEST(Summary, InventedChannelsAreCountedTogether) {
  SummaryBuilder builder(GoalConfig());
  for (int i = 0; i < 1000; ++i) builder.Add(LogEvent{i, i, "invented " + std::to_string(i), {}});
  for (int i = 0; i < 3; ++i) builder.Add(LogEvent{1000 + i, i, "PLAN_CANDIDATE", {}});
  const Summary summary = builder.Finish();
  EXPECT_EQ(summary.messages.size(), Summary::kMaxChannels + 1);
  EXPECT_EQ(summary.messages.at("*"), 1003 - static_cast<std::int64_t>(Summary::kMaxChannels));
  EXPECT_EQ(summary.proposed, 3);
}

TEST(Summary, PassesDamageAndCountsIt) {
  const ScratchDirectory scratch;
  WriteRun(scratch / "log");
  std::vector<std::uint8_t> bytes = ReadBytes(scratch / "log");
  bytes[0] = 0;
  WriteBytes(scratch / "log", bytes);
  const Summary summary = SummarizeLogs({scratch / "log"}, GoalConfig());
  EXPECT_FIELDS(summary, (proposed, 99), (damage.places, 1));
  EXPECT_GT(summary.damage.bytes, 0);
}

}  // namespace forereach::summary_test
