#include "live/watcher.h"

#include "tests/test.h"

#include "bus/authentic.h"
#include "lcmtypes/seal.h"
#include "tests/keys.h"
#include "tests/live/live_fixture.h"
#include "tests/messages.h"
#include "tests/tries.h"

namespace forereach::watcher_test {

using nlohmann::json;

std::vector<LogEvent> Without(std::vector<LogEvent> events, const std::string& channel) {
  std::erase_if(events, [&](const LogEvent& event) { return event.channel == channel; });
  return events;
}

int CountDrawn(const std::vector<json>& decisions, const std::string& outcome) {
  return static_cast<int>(std::ranges::count_if(decisions, [&](const json& decision) {
    return decision.at("outcome") == outcome && decision.at("detail").at("svg") != "" &&
           decision.at("detail").at("missing") == "";
  }));
}

TEST(WatcherTest, SendsEveryDecisionOfTheRecordedCourse) {
  Watcher watcher(CourseTask(), {}, CourseTask);
  Reader reader;
  Play(CourseEvents(), watcher, &reader);
  EXPECT_EQ(reader.decisions.size(), std::size_t{kCourseDecisions});
  EXPECT_EQ(reader.now.at("counts").at("decisions"), kCourseDecisions);
  EXPECT_GT(reader.now.at("counts").at("by_outcome").at("certified"), 5);
  EXPECT_EQ(reader.now.at("counts").at("undecodable"), 0);
  EXPECT_GT(CountDrawn(reader.decisions, "certified"), 5);
  EXPECT_GT(CountDrawn(reader.decisions, "abstain_safety"), 5);
  for (const json& decision : reader.decisions) {
    const json& detail = decision.at("detail");
    if (detail.at("svg") == "") continue;
    EXPECT_EQ(detail.at("missing"), "") << "the page knew what the certifier knew";
    EXPECT_GT(detail.at("units"), 0);
    EXPECT_THAT(detail.at("svg").get<std::string>(), HasSubstr("<circle"));
    if (decision.at("step") >= 0) EXPECT_EQ(detail.at("binding"), decision.at("step"));
  }
  EXPECT_THAT(reader.obstacles.get<std::string>(), HasSubstr("<circle"));
  EXPECT_GT(reader.places.size(), 50u);
  EXPECT_THAT(reader.now.at("robot").at("svg").get<std::string>(), HasSubstr("class=\"dot"));
  EXPECT_FALSE(reader.events.empty());
  EXPECT_FALSE(reader.now.at("signed"));
  EXPECT_EQ(watcher.Beginning().at("planar"), true);
}

TEST(WatcherTest, TellsEachReaderWhatIsNewForIt) {
  Watcher watcher(CourseTask(), {}, CourseTask);
  Reader first, late;
  Play(CourseEvents(), watcher, &first);
  EXPECT_EQ(first.Read(watcher), 0u) << "nothing is new";
  late.Read(watcher);
  EXPECT_EQ(late.decisions.size(), std::size_t{kCourseDecisions}) << "a late reader has the last ones";
  EXPECT_EQ(late.obstacles, first.obstacles);
  watcher.Tick(1);
  EXPECT_GT(first.Read(watcher), 0u);
  EXPECT_EQ(first.decisions.size(), std::size_t{kCourseDecisions}) << "nothing comes twice";
}

TEST(WatcherTest, TellsWhyThereIsNoTube) {
  Watcher watcher(CourseTask(), {}, CourseTask);
  Reader reader;
  Play(Without(CourseEvents(), "PLAN_CANDIDATE"), watcher, &reader);
  EXPECT_EQ(reader.decisions.size(), std::size_t{kCourseDecisions});
  for (const json& decision : reader.decisions)
    EXPECT_NE(decision.at("detail").at("missing"), "") << decision.at("message");
}

TEST(WatcherTest, DrawsTheBoxesOfACertificateWhoseCandidateItLacks) {
  const std::vector<LogEvent> events = CourseEvents();
  Watcher watcher(CourseTask(), {}, CourseTask);
  Reader reader;
  std::map<Digest, candidate_plan_t> candidates;
  for (const LogEvent& event : events) {
    if (event.channel == "PLAN_CANDIDATE")
      if (const auto candidate = Decoded<candidate_plan_t>(event.message()))
        candidates[PlanDigest(event.message())] = *candidate;
    const auto decision = event.channel == "PLAN_DECISION" ? Decoded<decision_t>(event.message()) : std::nullopt;
    if (!decision || decision->outcome != decision_t::CERTIFIED) continue;
    certified_plan_t certified{};
    certified.plan = candidates.at(GetDigest(decision->plan_digest));
    for (int t = 0; t <= certified.plan.num_steps; ++t)
      for (int k = 0; k < certified.plan.num_states; ++k)
        certified.slice_lower[t][k] = t, certified.slice_upper[t][k] = t + 1;
    std::copy(std::begin(decision->plan_digest), std::end(decision->plan_digest), certified.plan_digest);
    const auto bytes = Encode(certified);
    watcher.Take({event.number, event.utime, "PLAN_CERTIFIED", {bytes.begin(), bytes.end()}});
    watcher.Take(event);
    break;
  }
  watcher.Tick(1);
  reader.Read(watcher);
  const json& detail = Only(reader.decisions).at("detail");
  EXPECT_GT(detail.at("units"), 5);
  EXPECT_THAT(detail.at("missing").get<std::string>(), HasSubstr("the boxes of its certificate"));
}

TEST(WatcherTest, ReadsAnotherTaskFileAgainOrSaysThatItDiffers) {
  Config other = CourseTask();
  other.grounds.config = DigestOf("another file");
  int read = 0;
  const auto is_right_now = [&] { return ++read, CourseTask(); };
  Watcher reloaded(other, {}, is_right_now);
  Reader reader;
  Play(CourseEvents(), reloaded, &reader);
  EXPECT_EQ(read, 1);
  EXPECT_GT(CountDrawn(reader.decisions, "certified"), 5);
  EXPECT_EQ(reader.now.at("note"), "");

  const auto cannot = [&]() -> Config { throw ConfigError("it is gone"); };
  Watcher lost(other, {}, cannot);
  Reader told;
  Play(CourseEvents(), lost, &told);
  EXPECT_EQ(CountDrawn(told.decisions, "certified"), 0);
  EXPECT_THAT(told.now.at("note").get<std::string>(), HasSubstr("it is gone"));
}

TEST(WatcherTest, FollowsTheTaskFileThroughSoManyReloads) {
  const std::vector<LogEvent> events = CourseEvents();
  LogEvent event = *std::ranges::find(events, "PLAN_DECISION", &LogEvent::channel);
  decision_t decision = *Decoded<decision_t>(event.message());
  Config task = CourseTask();
  const auto change = [&](std::size_t version) {
    task.grounds.config = DigestOf("version " + std::to_string(version));
  };
  change(0);
  Watcher watcher(task, {}, [&] { return task; });
  Reader reader;
  for (std::size_t version = 1; version <= Watcher::kMostTasks; ++version) {
    change(version);
    SetDigest(decision.config_digest, task.grounds.config);
    const auto bytes = Encode(decision);
    event.data.assign(bytes.begin(), bytes.end());
    event.utime += 3'000'000;
    watcher.Take(event);
    watcher.Tick(event.utime);
    reader.Read(watcher);
    const std::string note = reader.now.at("note");
    EXPECT_EQ(note.empty(), version < Watcher::kMostTasks) << note;
  }
  EXPECT_THAT(reader.now.at("note").get<std::string>(), HasSubstr("start this program again"));
}

// ---- Trust.

TEST(WatcherTest, WithKeysOnlyAuthenticMessagesCount) {
  const KeyRing keys = TestKeys();
  Config task = CourseTask();
  const Speakers speakers = task.bus.speakers();
  Signer signer(keys, task.bus.bus_name()), stranger(TestKeys("other"), task.bus.bus_name());
  const std::vector<LogEvent> events = CourseEvents();
  std::vector<LogEvent> authentic, forged;
  for (LogEvent event : events) {
    const auto role = speakers.find(event.channel);
    if (role == speakers.end()) continue;
    const std::vector<std::uint8_t> message(event.message().begin(), event.message().end());
    event.data = signer.Sign(role->second, event.channel, message, event.utime);
    authentic.push_back(event);
    event.data = stranger.Sign(role->second, event.channel, message, event.utime);
    forged.push_back(event);
  }
  Watcher watcher(task, keys, CourseTask);
  Reader reader;
  Play(events, watcher, &reader);  // without signatures
  Play(forged, watcher, &reader);
  EXPECT_TRUE(reader.decisions.empty());
  EXPECT_EQ(reader.now.at("counts").at("messages"), 0);
  EXPECT_EQ(reader.now.at("refused").at("unsigned"), authentic.size());
  EXPECT_EQ(reader.now.at("refused").at("forged"), forged.size());
  EXPECT_TRUE(reader.now.at("robot").is_null());
  Play(authentic, watcher, &reader);
  EXPECT_EQ(reader.decisions.size(), std::size_t{kCourseDecisions});
  EXPECT_TRUE(reader.now.at("signed"));
  Play(authentic, watcher, &reader);
  EXPECT_EQ(reader.decisions.size(), std::size_t{kCourseDecisions}) << "replayed";
  EXPECT_EQ(reader.now.at("refused").at("replayed"), authentic.size());
}

// ---- Strangers without a key.

template <class Message>
LogEvent EventOf(const std::string& channel, const Message& message, std::int64_t utime = 1) {
  const auto bytes = Encode(message);
  return {0, utime, channel, {bytes.begin(), bytes.end()}};
}

TEST(WatcherTest, SurvivesAnyBytes) {
  std::mt19937_64 random(7);
  Watcher watcher(CourseTask(), {}, CourseTask);
  Reader reader;
  std::vector<LogEvent> events = CourseEvents();
  const int tries = Tries(3000);
  for (int i = 0; i < tries; ++i) {
    LogEvent event = events[random() % events.size()];
    for (int k = static_cast<int>(random() % 40); k >= 0 && !event.data.empty(); --k)
      event.data[8 + random() % std::max<std::size_t>(event.data.size() - 8, 1) % 400] =
          static_cast<std::uint8_t>(random());
    if (random() % 8 == 0) event.data.resize(random() % (event.data.size() + 1));
    event.utime = static_cast<std::int64_t>(random() % 3 == 0 ? random() : 1'700'000'000'000'000);
    watcher.Take(event);
    if (i % 20 == 0) watcher.Tick(static_cast<std::int64_t>(random()));
    if (i % 200 == 0) reader.Read(watcher);  // is JSON
  }
  watcher.Tick(1);
  reader.Read(watcher);
  EXPECT_GT(reader.now.at("counts").at("undecodable"), tries / 20);
}

TEST(WatcherTest, AFloodIsBounded) {
  Watcher watcher(CourseTask(), {}, CourseTask);
  const std::vector<LogEvent> events = CourseEvents();
  const auto decision = std::ranges::find(events, "PLAN_DECISION", &LogEvent::channel);
  decision_t message = *Decoded<decision_t>(decision->message());
  for (int i = 0; i < 20'000; ++i) {
    message.sequence = message.plan_id = 2 * i;
    watcher.Take(EventOf("PLAN_DECISION", message));
    fault_t fault{};
    fault.utime = fault.sequence = i;
    watcher.Take(EventOf("FAULT", fault));
    withdrawal_t withdrawal{};
    withdrawal.plan_id = withdrawal.sequence = i;
    watcher.Take(EventOf("PLAN_WITHDRAWN", withdrawal));
    if (i % 5000 == 0) watcher.Tick(i);
  }
  watcher.Tick(1);
  Reader reader;
  EXPECT_LT(reader.Read(watcher), 4'000'000u);
  EXPECT_FIELDS(reader, (decisions.size(), Watcher::kDecisions), (faults.size(), Watcher::kOthers),
                (withdrawals.size(), Watcher::kOthers), (gaps.size(), Watcher::kOthers));
  EXPECT_EQ(reader.now.at("counts").at("decisions"), 20'000);
  EXPECT_GT(reader.now.at("counts").at("not_shown"), 15'000);
}

TEST(WatcherTest, OfLargeSetsATickKeepsAsManyAsHaveRoom) {
  Watcher watcher(CourseTask(), {}, CourseTask);
  Crowd crowd(watcher, 512);
  const std::size_t each = 512 + CourseTask().obstacles.size(), room = (1 << 16) / each + 1;  // and the last one
  Reader reader;
  for (const std::size_t more : {std::size_t{0}, std::size_t{10}}) {
    for (std::size_t i = 0; i < room + more; ++i) crowd.Decide();
    watcher.Tick(1);
    reader.Read(watcher);
    EXPECT_EQ(reader.now.at("counts").at("not_shown"), more);
  }
}

TEST(WatcherTest, ShowsARepeatedFaultOrWithdrawalOnce) {
  Watcher watcher(CourseTask(), {}, CourseTask);
  for (int i = 0; i < 5; ++i) {
    fault_t fault{};
    fault.utime = 7, fault.sequence = i, fault.cause = fault_t::SLICE_LEFT;
    watcher.Take(EventOf("FAULT", fault));
    withdrawal_t withdrawal{};
    withdrawal.utime = withdrawal.sequence = i, withdrawal.plan_id = 3, withdrawal.valid_steps = 4;
    watcher.Take(EventOf("PLAN_WITHDRAWN", withdrawal));
  }
  watcher.Tick(1);
  Reader reader;
  reader.Read(watcher);
  EXPECT_EQ(reader.faults.size(), 1u);
  EXPECT_EQ(reader.faults[0].at("kind"), "slice_left");
  EXPECT_EQ(reader.withdrawals.size(), 1u);
}

}  // namespace forereach::watcher_test
