// `forereach log`: listing, cutting and merging logs, damaged ones too.

#include "records/log_edit.h"
#include "tests/cli/program.h"
#include "tests/records/course.h"
#include "tests/records/logs.h"

namespace forereach::log_test {

struct LogTest : testing::Test {
  Output Log(const std::string& what) const { return Forereach("log " + what + " 2>&1"); }
  // Three events a second apart, numbered from 0.
  std::string Small(const std::string& name, std::int64_t begin, const std::string& channel) const {
    EventLogWriter writer(scratch_ / name);
    for (int i = 0; i < 3; ++i)
      writer.Append(begin + i * 1'000'000, channel, std::vector<std::uint8_t>{std::uint8_t(i)});
    EXPECT_TRUE(writer.Flush());
    return scratch_ / name;
  }

  const ScratchDirectory scratch_;
};

TEST_F(LogTest, ListsEveryEvent) {
  const Output output = Log("list '" + kCourseLog + "'");
  EXPECT_EQ(output.code, 0);
  const auto events = ReadLog(kCourseLog).events;
  EXPECT_EQ(std::ranges::count(output.text, '\n'), std::ssize(events) + 2);
  const std::string count = std::to_string(events.size());
  EXPECT_THAT(output.text, HasSubstr("log: " + count + " of " + count + " events"));
  EXPECT_THAT(output.text, HasSubstr("PLAN_DECISION     decision_t"));
}

TEST_F(LogTest, SaysWhichChannelsThereAreIfNoEventHasTheChosenOne) {
  const std::string small = Small("a.lcmlog", 1'000'000, "POSES"), out = scratch_ / "out.lcmlog";
  for (const std::string action : {"list " + small, "cut " + small + " -o " + out})
    EXPECT_THAT(Log(action + " --channel POSE"), Exits(2, "POSE: no event has this channel; the channels are POSES"));
  EXPECT_FALSE(std::filesystem::exists(out));
}

TEST_F(LogTest, ListsAsJson) {
  const Output output = Forereach("log list '" + kCourseLog + "' --json --outcome certified 2>/dev/null");
  std::istringstream lines(output.text);
  int decisions = 0, others = 0;
  for (std::string text; std::getline(lines, text);) {
    const auto line = nlohmann::json::parse(text);
    decisions += line["type"] == "decision_t";
    if (line["type"] == "decision_t") EXPECT_EQ(line["what"], "certified");
    others += line["type"] != "decision_t" && line["type"] != "candidate_plan_t" && line["type"] != "certified_plan_t";
  }
  EXPECT_EQ(decisions, kCourseCertified);
  EXPECT_EQ(others, 0);
}

TEST_F(LogTest, ACutKeepsNumbersStampsAndBytes) {
  const std::string out = scratch_ / "out.lcmlog";
  const auto events = ReadLog(kCourseLog).events;
  EXPECT_THAT(Log("cut '" + kCourseLog + "' --channel PLAN_DECISION --from " + std::to_string(events[20].utime) +
                  " --to " + std::to_string(events[200].utime) + " -o '" + out + "'"),
              Exits(0));
  std::vector<LogEvent> expected;
  for (const LogEvent& event : events)
    if (event.channel == "PLAN_DECISION" && event.utime >= events[20].utime && event.utime < events[200].utime)
      expected.push_back(event);
  const LogContents cut = ReadLog(out);
  ASSERT_EQ(cut.events.size(), expected.size());
  ASSERT_GT(expected.size(), 3u);
  for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_EQ(DigestOf(cut.events[i]), DigestOf(expected[i]));
  EXPECT_EQ(cut.damage.places, 0);
}

// What is left is still a log that the other commands read.
TEST_F(LogTest, ACutByOutcomeKeepsTheRest) {
  const std::string out = scratch_ / "out.lcmlog";
  EXPECT_EQ(Log("cut '" + kCourseLog + "' --outcome certified -o '" + out + "'").code, 0);
  const Output replay = Forereach("replay '" + out + "' --config tests/data/course.yaml 2>&1");
  EXPECT_THAT(replay.text, HasSubstr(std::to_string(kCourseCertified) + " candidates"));
  const auto is_other = [](const LogEvent& event) {
    const auto summary = Summarize(event.message());
    return !summary || !summary->is_of_plan;
  };
  EXPECT_EQ(std::ranges::count_if(ReadLog(out).events, is_other),
            std::ranges::count_if(ReadLog(kCourseLog).events, is_other));
}

// A plan's messages are chosen by its decision, wherever that is, and stay in their order.
TEST_F(LogTest, AnOutcomeIsThatOfADecisionBeforeOrBehind) {
  const auto kept = [&](const auto& order) {
    std::vector<LogEvent> events = ReadLog(kCourseLog).events;
    std::ranges::stable_sort(events, {},
                             [&](const LogEvent& event) { return order(event.channel == "PLAN_DECISION"); });
    const std::string log = scratch_ / "reordered.lcmlog", out = scratch_ / "out.lcmlog";
    std::filesystem::remove(log);
    EventLogWriter writer(log);
    for (const LogEvent& event : events) writer.Append(event.utime, event.channel, event.data);
    EXPECT_TRUE(writer.Flush());
    EXPECT_EQ(Log("filter '" + log + "' --outcome abstain_safety -o '" + out + "'").code, 0);
    std::multiset<std::vector<std::uint8_t>> messages;
    std::int64_t number = -1;
    for (const LogEvent& event : ReadLog(out).events) {
      EXPECT_LT(std::exchange(number, event.number), event.number);
      messages.insert(event.data);
    }
    std::filesystem::remove(out);
    return messages;
  };
  const auto as_recorded = kept([](bool) { return 0; });
  EXPECT_GT(as_recorded.size(), 20u);
  EXPECT_EQ(kept([](bool is_decision) { return is_decision ? 1 : 0; }), as_recorded) << "decisions last";
  EXPECT_EQ(kept([](bool is_decision) { return is_decision ? 0 : 1; }), as_recorded) << "decisions first";
}

// Without a decision a candidate has no outcome, and with two that of the first behind it or of any before it.
TEST_F(LogTest, AnOutcomeOfACandidateThatComesTwice) {
  const std::vector<LogEvent> course = ReadLog(kCourseLog).events;
  const auto certified = std::ranges::find_if(course, [](const LogEvent& event) {
    const auto decision = Decoded<decision_t>(event.data);
    return decision && decision->outcome == decision_t::CERTIFIED;
  });
  decision_t decision = *Decoded<decision_t>(certified->data);
  const auto candidate = std::ranges::find_if(course, [&](const LogEvent& event) {
    return event.channel == "PLAN_CANDIDATE" && PlanDigest(Bytes(event.data)) == GetDigest(decision.plan_digest);
  });
  const std::string log = scratch_ / "twice.lcmlog";
  EventLogWriter writer(log);
  const auto append = [&](const LogEvent& event, const std::vector<std::uint8_t>& data) {
    writer.Append(event.utime, event.channel, data);
  };
  append(*candidate, candidate->data);  // 0
  append(*certified, certified->data);
  append(*candidate, candidate->data);  // 2
  decision.outcome = decision_t::REJECTED;
  append(*certified, Encode(decision));
  append(*candidate, candidate->data);  // 4, without a decision
  EXPECT_TRUE(writer.Flush());
  const auto numbers = [&](const std::string& outcome) {
    std::istringstream lines(Forereach("log list '" + log + "' --json --outcome " + outcome + " 2>/dev/null").text);
    std::vector<int> found;
    for (std::string line; std::getline(lines, line);)
      found.push_back(nlohmann::json::parse(line)["event_number"].get<int>());
    return found;
  };
  EXPECT_THAT(numbers("certified"), ElementsAre(0, 1, 2, 4));
  EXPECT_THAT(numbers("rejected"), ElementsAre(2, 3, 4));
  EXPECT_THAT(numbers("abstain_domain"), IsEmpty());
}

TEST_F(LogTest, AFilterKeepsTheChosenAlone) {
  const std::string out = scratch_ / "out.lcmlog";
  EXPECT_EQ(Log("filter '" + kCourseLog + "' --outcome certified -o '" + out + "'").code, 0);
  int decisions = 0;
  for (const LogEvent& event : ReadLog(out).events) {
    const auto summary = Summarize(event.message());
    ASSERT_TRUE(summary && summary->is_of_plan);
    decisions += summary->type == "decision_t";
  }
  EXPECT_EQ(decisions, kCourseCertified);
}

TEST_F(LogTest, MergesByTime) {
  const std::string a = Small("a", 1'000'000, "A"), b = Small("b", 1'500'000, "B"), out = scratch_ / "out";
  EXPECT_EQ(Log("merge '" + b + "' '" + a + "' -o '" + out + "'").code, 0);
  std::string channels;
  std::int64_t number = 0;
  for (const LogEvent& event : ReadLog(out).events) {
    channels += event.channel;
    EXPECT_EQ(event.number, number++);
  }
  EXPECT_EQ(channels, "ABABAB");
  EXPECT_EQ(Log("cut '" + b + "' '" + a + "' -o '" + (scratch_ / "behind") + "'").code, 0);
  EXPECT_EQ(ReadLog(scratch_ / "behind").events[3].channel, "A");
}

TEST_F(LogTest, TimesMayBeOfSeveralKinds) {
  EXPECT_EQ(ParseLogTime("1767268800000000", 5), 1767268800000000);
  EXPECT_EQ(ParseLogTime("+1.5", 5), 1500005);
  EXPECT_EQ(ParseLogTime("2026-01-01T12:00:00", 0), 1767268800000000);
  EXPECT_EQ(ParseLogTime("2026-01-01T12:00:00.25Z", 0), 1767268800250000);
  EXPECT_EQ(ParseLogTime("9999-12-31 23:59:59,999999+00:30", 0), 253402298999999999);
  EXPECT_EQ(ParseLogTime("+1000000000", INT64_MAX - 1), INT64_MAX);
  for (const char* text :
       {"", "+", "-1", "+-1", "+nan", "+inf", "1e3x", "2026-02-30T12:00:00", "2026-01-01", "noon",
        "1969-12-31T23:59:59Z", "2026-01-01T24:00:00", "2026-01-01T12:00:00.5.5", "99999999999999999999"})
    EXPECT_THROW(static_cast<void>(ParseLogTime(text, 0)), LogError) << text;
  EXPECT_THAT(Log("list '" + Small("a", 1'000'000, "A") + "' --from +1 --to +2").text, HasSubstr("log: 1 of 3 events"));
}

TEST_F(LogTest, DamageIsSaidWithItsPlace) {
  auto bytes = ReadBytes(kCourseLog);
  std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(RecordFrom(bytes, 50'000)), 100, std::uint8_t{0});
  bytes.resize(bytes.size() - 10);
  WriteBytes(scratch_ / "damaged", bytes);
  const std::string out = scratch_ / "out";
  const Output output = Log("cut '" + (scratch_ / "damaged") + "' -o '" + out + "'");
  EXPECT_EQ(output.code, 1);
  const LogContents damaged = ReadLog(scratch_ / "damaged");
  EXPECT_THAT(output.text,
              AllOf(HasSubstr("damaged: " + std::to_string(damaged.damage.bytes) + " bytes are no record, from byte "),
                    HasSubstr("ends within a record: the last ")));
  const LogContents cut = ReadLog(out);
  EXPECT_FIELDS(cut, (end, LogStatus::kEnd), (damage.places, 0));
  ASSERT_EQ(cut.events.size(), damaged.events.size());
  for (std::size_t i = 0; i < cut.events.size(); ++i) EXPECT_EQ(DigestOf(cut.events[i]), DigestOf(damaged.events[i]));
}

TEST_F(LogTest, NamesOfAHostileLogDoNotReachTheTerminal) {
  {
    EventLogWriter writer(scratch_ / "hostile");
    writer.Append(INT64_MAX, "\x1b[2J", std::vector<std::uint8_t>{1});
    ASSERT_TRUE(writer.Flush());
  }
  EXPECT_THAT(Log("list '" + (scratch_ / "hostile") + "'"), Exits(0, Not(HasSubstr("\x1b")), "\\x1b[2J"));
}

TEST_F(LogTest, RefusesWhatItCannotDoAndSaysWhy) {
  const std::string a = Small("a", 0, "A");
  const auto before = ReadBytes(a);
  EXPECT_THAT(Log("cut '" + a + "' -o '" + a + "'").text, HasSubstr("the file exists, and is not changed"));
  EXPECT_EQ(ReadBytes(a), before);
  for (const std::string& wrong :
       {"cut '" + a + "'", "list '" + a + "' -o x", "merge '" + a + "' '" + a + "' -o '" + (scratch_ / "x") + "'",
        "cut README.md -o '" + (scratch_ / "x") + "'", "list '" + a + "' --from noon",
        "list '" + a + "' --outcome good", "melt '" + a + "'", "cut '" + a + "' --json -o '" + (scratch_ / "x") + "'"})
    EXPECT_EQ(Log(wrong).code, 2) << wrong;
  EXPECT_FALSE(std::filesystem::exists(scratch_ / "x"));
}

}  // namespace forereach::log_test
