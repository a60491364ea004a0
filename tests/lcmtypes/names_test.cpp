#include "lcmtypes/names.h"

#include <cctype>
#include <regex>

#include "tests/test.h"

#include "tests/paths.h"

namespace forereach::names_test {

using Constants = std::map<std::string, int>;

// NAME = NUMBER of every `const` line of an .lcm file.
Constants ConstantsOf(const std::string& type) {
  Constants constants;
  static const std::regex statement("const\\s+int16_t\\s+([^;]*);"), assignment("(\\w+)\\s*=\\s*(-?\\d+)");
  const std::string all =
      std::regex_replace(Read(FOREREACH_SOURCE_DIR "/lcmtypes/" + type + ".lcm"), std::regex("//[^\n]*"), "");
  for (std::sregex_iterator s(all.begin(), all.end(), statement), end; s != end; ++s) {
    const std::string list = (*s)[1];
    for (std::sregex_iterator a(list.begin(), list.end(), assignment); a != end; ++a)
      constants[(*a)[1]] = std::stoi((*a)[2]);
  }
  return constants;
}

std::string LowerCase(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

std::pair<Constants, Constants> OutcomesAndCauses() {
  std::pair<Constants, Constants> parts;
  for (const auto& [name, number] : ConstantsOf("decision_t")) {
    if (name.starts_with("CAUSE_"))
      parts.second[name.substr(6)] = number;
    else
      parts.first[name] = number;
  }
  return parts;
}

// Each constant is named as in the .lcm file, no two share a number, and no other number has a name.
void ExpectNamed(const Constants& constants, std::string_view (*name_of)(std::int16_t)) {
  std::set<int> numbers;
  for (const auto& [name, number] : constants) {
    EXPECT_EQ(name_of(static_cast<std::int16_t>(number)), LowerCase(name));
    EXPECT_TRUE(numbers.insert(number).second) << name << ": " << number << " is taken";
  }
  for (int number = std::numeric_limits<std::int16_t>::min(); number <= std::numeric_limits<std::int16_t>::max();
       ++number)
    if (!numbers.contains(number)) ASSERT_EQ(name_of(static_cast<std::int16_t>(number)), "unknown") << number;
}

TEST(NamesTest, EveryOutcomeHasItsName) { ExpectNamed(OutcomesAndCauses().first, OutcomeName); }

TEST(NamesTest, EveryCauseHasItsName) { ExpectNamed(OutcomesAndCauses().second, CauseName); }

TEST(NamesTest, EveryFaultHasItsName) { ExpectNamed(ConstantsOf("fault_t"), FaultName); }

TEST(NamesTest, EveryWithdrawalHasItsName) { ExpectNamed(ConstantsOf("withdrawal_t"), WithdrawalName); }

TEST(NamesTest, EveryKindOfAdviceHasItsName) { ExpectNamed(ConstantsOf("advice_change_t"), AdviceName); }

TEST(NamesTest, EveryFaultHasAnAdvice) {
  for (const auto& [name, number] : ConstantsOf("fault_t")) {
    const std::string advice(FaultAdvice(static_cast<std::int16_t>(number)));
    EXPECT_THAT(advice, HasSubstr("`forereach reset`")) << name;
  }
  for (const int stays : {3, 4})  // what made it is still there after a reset
    EXPECT_THAT(std::string(FaultAdvice(static_cast<std::int16_t>(stays))), HasSubstr("reset alone"));
}

TEST(NamesTest, TheAdviceIsThatOfTheDocument) {
  const std::string page = Read(FOREREACH_SOURCE_DIR "/docs/reliability.md");
  for (std::int16_t cause = 1; cause <= 5; ++cause) {
    const std::size_t row = page.find("fault `" + std::string(FaultName(cause)) + "` |");
    ASSERT_NE(row, std::string::npos) << cause;
    EXPECT_THAT(page.substr(row, page.find('\n', row) - row), EndsWith("| " + std::string(FaultAdvice(cause)) + " |"));
  }
}

TEST(NamesTest, EveryEventHasItsName) { ExpectNamed(ConstantsOf("execution_event_t"), EventName); }

TEST(NamesTest, EveryLevelAndStateOfTheHeartbeatHasItsName) {
  Constants states = ConstantsOf("certifier_status_t");
  for (const std::string level : {"OK", "STALE", "ERROR"}) {
    ASSERT_TRUE(states.contains(level));
    EXPECT_EQ(LevelName(static_cast<std::int16_t>(states[level])), level);
    states.erase(level);
  }
  const auto take = [&states](const std::string& name, const std::string& key) {
    Constants taken;
    for (const auto& [constant, number] : Constants(states))
      if (constant.find(key) != std::string::npos) {
        states.erase(constant);
        taken[constant.substr(key.size() + 1)] = number;
      }
    EXPECT_FALSE(taken.empty()) << name;
    return taken;
  };
  ExpectNamed(take("the latch", "LATCH"), LatchName);
  ExpectNamed(take("the source of obstacles", "OBSTACLES"), ObstaclesSourceName);
  ExpectNamed(states, StateName);
  for (const std::int16_t other : {std::int16_t{0}, std::int16_t{4}, std::int16_t{-1}})
    EXPECT_EQ(LevelName(other), "unknown");
}

// Of "NAME number, NAME number".
Constants Listed(const std::string& text) {
  Constants constants;
  std::istringstream words(text);
  for (std::string name; words >> name; words.ignore()) words >> constants[name];
  return constants;
}

// Recorded logs carry the numbers, and the fingerprint does not cover them: a new constant gets a new line, no line
// ever changes.
TEST(NamesTest, EveryConstantHasItsRecordedNumber) {
  const auto [outcomes, causes] = OutcomesAndCauses();
  EXPECT_EQ(
      outcomes,
      Listed("CERTIFIED 1, ABSTAIN_FALSIFIED 2, ABSTAIN_DOMAIN 3, ABSTAIN_SAFETY 4, REJECTED 5, ABSTAIN_DEADLINE 6, "
             "ABSTAIN_OBSTACLES 7"));
  EXPECT_EQ(
      causes,
      Listed("NONE 0, PAIRWISE 1, DOMAIN_EXIT 2, NO_FINITE_ENCLOSURE 3, OBSTACLE 4, NO_STOP 5, LIMIT 8, STALE 10, "
             "FUTURE 11, DUPLICATE 12, WRONG_LENGTH 13, TRAILING_BYTES 14, UNKNOWN_FINGERPRINT 15, "
             "WRONG_DIMENSION 16, NON_FINITE 17, TOO_MANY_SOURCES 18, TOO_LATE 19, QUEUE_FULL 20, INTERNAL_ERROR 21, "
             "DEADLINE 22, OVERRUN 23, NOT_ARMED 24, FAULT 25, SHADOW 26, NO_OBSTACLES 27, SECOND_CERTIFIER 28, "
             "LATCH_UNWRITABLE 29, BETWEEN 30, BOUND 31"));
  EXPECT_EQ(ConstantsOf("execution_event_t"),
            Listed("ACCEPTED 1, REFUSED 2, STARTED 3, STEP_INSIDE 4, STEP_OUTSIDE 5, TAIL_BEGUN 6, STANDING 7, "
                   "GOAL_REACHED 8, CONTACT 9, HALTED 10, RESET 11, WITHDRAWN 12, EMERGENCY_STOP 13, OFF_SCHEDULE 14, "
                   "LIMIT_EXCEEDED 15, ERROR_STOP 16, STEP_CONSISTENT 17"));
  EXPECT_EQ(
      ConstantsOf("withdrawal_t"),
      Listed("FALSIFIED 1, DOMAIN_EXIT 2, NO_FINITE_ENCLOSURE 3, OBSTACLE 4, NO_STOP 5, NOT_JUDGED 6, UNKNOWN_PLAN 7, "
             "LIMIT 8, OBSTACLES_LOST 9, BETWEEN 30, BOUND 31"));
  EXPECT_EQ(ConstantsOf("fault_t"),
            Listed("ROBOT_STATE_LOST 1, CLOCK_JUMP 2, SLICE_LEFT 3, DECLARATION_FALSIFIED 4, UNCERTIFIED_PLAN 5"));
  EXPECT_EQ(ConstantsOf("certifier_status_t"),
            Listed("OK 1, STALE 2, ERROR 3, DISARMED 1, ARMED 2, FAULT 3, LISTENING 4, STANDBY 5, LATCH_NONE 0, "
                   "LATCH_WRITTEN 1, LATCH_UNWRITABLE 2, OBSTACLES_TASK 1, OBSTACLES_BUS 2"));
  EXPECT_EQ(ConstantsOf("command_t"), Listed("RESET 1, RELOAD 2"));
  EXPECT_EQ(ConstantsOf("robot_state_t"), Listed("STANDING 1, EXECUTING 2, FINISHED 3"));
  EXPECT_EQ(ConstantsOf("obstacle_shape_t"), Listed("CIRCLE 1, BOX 2, POLYGON 3, HALF_SPACE 4, GRID 5, CELLS 6"));
}

}  // namespace forereach::names_test
