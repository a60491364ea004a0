// Sequence numbers: missing, late and repeated messages, and restarts; rows of executed steps.
#include "records/interpreter.h"

#include "forereach/certifier_status_t.hpp"
#include "forereach/transition_t.hpp"

#include "tests/records/logs.h"

namespace forereach::interpreter_test {

constexpr std::int64_t kNow = 1'700'000'000'000'000, kSecond = 1'000'000;

struct InterpreterTest : testing::Test {
  /** A candidate with this sequence, stamped so long after kNow, and heard then or at another time after kNow. */
  void Hear(std::int64_t sequence, std::int64_t stamp, std::optional<std::int64_t> heard = {}) {
    candidate_plan_t candidate = MakeCandidate(sequence, sequence);
    candidate.utime = kNow + stamp;
    interpreter_.Observe({number_++, kNow + heard.value_or(stamp), "PLAN_CANDIDATE", Encode(candidate)}, rows_);
  }

  void ExpectOneGap(const std::string& reason, std::int64_t expected, std::int64_t got, std::int64_t lost) const {
    EXPECT_FIELDS(Only(rows_.gaps), (reason, reason), (expected, expected), (got, got), (lost, lost));
  }

  Interpreter interpreter_{{}, "log"};
  Rows rows_;
  std::int64_t number_ = 0;
};

TEST_F(InterpreterTest, AnExecutedStepIsARowWhateverItsCounts) {
  transition_t step{.utime = 5, .sequence = 6, .duration_us = 7, .num_states = 2, .num_inputs = 1};
  step.state[1] = 1, step.input[0] = 2, step.next_state[0] = 3;
  for (const std::int16_t states : {2, -1, 32767}) {
    step.num_states = states;
    interpreter_.Observe({number_++, kNow, "TRANSITION", Encode(step)}, rows_);
  }
  ASSERT_EQ(rows_.transitions.size(), 3u);
  EXPECT_FIELDS(rows_.transitions[0], (utime, 5), (sequence, 6), (duration_us, 7), (state, (std::vector<double>{0, 1})),
                (input, std::vector<double>{2}), (next_state, (std::vector<double>{3, 0})), (event.event_number, 0));
  EXPECT_TRUE(rows_.transitions[1].state.empty());
  EXPECT_EQ(rows_.transitions[2].next_state.size(), 16u);
}

TEST_F(InterpreterTest, ADecisionIsInTheModeOfTheLastHeartbeatOfTheOneInCharge) {
  const auto hear = [this](const std::string& channel, const auto& message) {
    interpreter_.Observe({number_++, kNow + number_, channel, Encode(message)}, rows_);
  };
  const auto decide = [&](std::int16_t cause) {
    decision_t decision{.outcome = decision_t::REJECTED, .cause = cause};
    hear("PLAN_DECISION", decision);
    return rows_.decisions.back().shadow;
  };
  const auto beat = [&](std::int16_t state, std::int16_t shadow) {
    hear("CERTIFIER_STATUS", certifier_status_t{.state = state, .shadow = shadow});
  };
  EXPECT_EQ(decide(decision_t::CAUSE_FAULT), -1);
  EXPECT_EQ(decide(decision_t::CAUSE_SHADOW), 1);
  EXPECT_EQ(decide(decision_t::CAUSE_FAULT), -1);
  beat(certifier_status_t::DISARMED, 1);
  interpreter_.Continue("next");
  EXPECT_EQ(decide(decision_t::CAUSE_FAULT), 1) << "also in the run's next file";
  beat(certifier_status_t::ARMED, 0);
  beat(certifier_status_t::STANDBY, 1);
  EXPECT_EQ(decide(decision_t::CAUSE_FAULT), 0);
}

TEST_F(InterpreterTest, AMessageThatComesTwiceIsNoLoss) {
  for (const std::int64_t sequence : {49'999, 50'000, 50'000, 50'001, 49'999, 50'002}) Hear(sequence, sequence);
  EXPECT_TRUE(rows_.gaps.empty());
}

TEST_F(InterpreterTest, AnOvertakenMessageCostsOneGap) {
  for (const std::int64_t sequence : {1, 3, 2, 4}) Hear(sequence, sequence);
  ExpectOneGap("bus", 2, 3, 1);  // what comes late stays counted
}

TEST_F(InterpreterTest, SequenceZeroAfterHigherOnesIsARestartWhateverItsStamp) {
  for (const std::int64_t first : {std::int64_t{0}, 100 * kSecond, 50 * kSecond})
    for (std::int64_t sequence = 0; sequence < 10; ++sequence) Hear(sequence, first + sequence);
  ASSERT_EQ(rows_.gaps.size(), 2u);
  for (const GapRow& gap : rows_.gaps) {
    EXPECT_FIELDS(gap, (reason, "restart"), (expected, 10), (got, 0), (lost, 0));
  }
}

TEST_F(InterpreterTest, ARepeatedMessageIsNoRestartEvenIfItsClockIsAhead) {
  for (const std::int64_t sequence : {0, 7}) {
    Interpreter fresh({}, "log");
    std::swap(interpreter_, fresh);
    for (std::int64_t heard = 0; heard < 5; ++heard) Hear(sequence, 100 * kSecond, heard * kSecond / 2);
    EXPECT_TRUE(rows_.gaps.empty()) << sequence;
  }
}

TEST_F(InterpreterTest, ARepeatedSequenceZeroIsNoRestart) {
  for (const std::int64_t sequence : {0, 0, 1, 2, 0, 3}) Hear(sequence, sequence);
  EXPECT_TRUE(rows_.gaps.empty());
}

TEST_F(InterpreterTest, ALaterStampWithASmallerSequenceIsARestart) {
  for (const std::int64_t sequence : {7, 8, 9}) Hear(sequence, sequence);
  Hear(3, kSecond);
  Hear(2, kSecond - 1);
  Hear(4, kSecond + 1);
  ExpectOneGap("restart", 10, 3, 3);  // lost: the first ones of the new count
}

TEST_F(InterpreterTest, ARestartIsFoundAfterAStampFarAhead) {
  Hear(7, 3600 * kSecond, 0);
  Hear(8, std::numeric_limits<std::int64_t>::max() - kNow, 1);
  Hear(3, 2 * kSecond);
  EXPECT_FIELDS(Only(rows_.gaps), (reason, "restart"), (got, 3));
}

TEST_F(InterpreterTest, CountsGapsAtTheEndsOfTheRangeOfSequences) {
  using Limits = std::numeric_limits<std::int64_t>;
  constexpr std::int64_t kMin = Limits::min(), kMax = Limits::max();
  std::int64_t stamp = 0;
  for (const std::int64_t sequence : {kMin, std::int64_t{-1}, kMax, kMax, kMin, kMax, std::int64_t{0}})
    Hear(sequence, ++stamp, kMax - kNow);
  for (const GapRow& gap : rows_.gaps) EXPECT_GE(gap.lost, 0);
}

TEST(GapsTest, ASumOfLossesEndsAtTheLargestNumber) {
  EXPECT_EQ(SumOfLost(2, 3), 5);
  EXPECT_EQ(SumOfLost(INT64_MAX - 3, 3), INT64_MAX);
  EXPECT_EQ(SumOfLost(INT64_MAX - 2, 3), INT64_MAX);
  EXPECT_EQ(SumOfLost(2, -3), 2) << "a database may hold anything";
}

}  // namespace forereach::interpreter_test
