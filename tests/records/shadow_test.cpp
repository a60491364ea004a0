#include "records/shadow.h"

#include "tests/records/point_mass.h"

namespace forereach::shadow_test {

Config ShadowTask() {
  Config config = PointMassConfig();
  config.gate.shadow = true;
  return config;
}

class ShadowTest : public testing::Test {
 protected:
  template <class Message>
  void Append(const std::string& channel, const Message& message) {
    writer_.Append(++now_, channel, Encode(message));
  }

  void Decide(std::int64_t plan_id, bool along_x, std::int16_t outcome, std::int16_t cause) {
    const candidate_plan_t candidate = Drive(plan_id, along_x);
    Append("PLAN_CANDIDATE", candidate);
    Append("PLAN_DECISION", MakeDecision(candidate, decisions_++, outcome, cause));
  }

  // The robot executes a plan along y, or stands.
  void Say(std::int64_t plan_id, int step, double aside = 0) {
    robot_state_t state{.num_states = 4};
    state.sequence = state.utime = states_++;
    state.mode = plan_id < 0 ? robot_state_t::STANDING : robot_state_t::EXECUTING;
    state.executing_plan_id = plan_id;
    state.executing_step = static_cast<std::int16_t>(step);
    state.state[0] = aside;
    state.state[1] = 0.45 * step;
    state.state[3] = 3;
    Append("ROBOT_STATE", state);
  }
  void Touch() { Append("EXECUTION_EVENT", MakeEvent(contacts_++, execution_event_t::CONTACT)); }

  ShadowSummary Read(const Config& task = ShadowTask()) {
    EXPECT_TRUE(writer_.Flush());
    ShadowTally tally(2);
    Timeline timeline(task, {&tally});
    timeline.Read({scratch_ / "log"}, false);
    return tally.Finish();
  }

  ScratchDirectory scratch_;
  EventLogWriter writer_{scratch_ / "log"};
  std::int64_t now_ = 0, decisions_ = 0, states_ = 0, contacts_ = 0;
};

TEST_F(ShadowTest, CountsWhatWouldHaveBeenRefusedAndWhatHappenedThen) {
  Touch();  // before any plan
  Decide(1, true, decision_t::ABSTAIN_SAFETY, decision_t::CAUSE_OBSTACLE);
  Decide(2, false, decision_t::REJECTED, decision_t::CAUSE_SHADOW);
  Decide(3, false, decision_t::REJECTED, decision_t::CAUSE_SHADOW);
  Decide(4, false, decision_t::REJECTED, decision_t::CAUSE_STALE);
  for (int step = 0; step < 4; ++step) Say(1, step);
  Touch();
  Touch();
  for (int step = 0; step < 4; ++step) Say(2, step);
  for (int step = 0; step < 4; ++step) Say(3, step, step < 2 ? 0.1 : 0.11);  // the slices are 0.1 wide to each side
  Touch();
  Say(77, 0);  // it was never decided on
  Touch();
  Say(-1, -1);
  const ShadowSummary summary = Read();
  EXPECT_EQ(summary.certified, 2);
  EXPECT_EQ(summary.refused, (std::map<std::string, std::int64_t>{{"obstacle", 1}}));
  EXPECT_EQ(summary.not_judged, 1);
  EXPECT_EQ(summary.driven_refused, (ShadowSummary::Driven{1, 2}));
  EXPECT_EQ(summary.driven_certified, (ShadowSummary::Driven{2, 1}));
  EXPECT_EQ(summary.other_contacts, 2);
  EXPECT_EQ(std::tuple(summary.plans_left, summary.states_left, summary.states), std::tuple(1, 2, 8));
  EXPECT_EQ(summary.not_compared, 0);
  EXPECT_THAT(ToText(summary), testing::HasSubstr("would be refused        1 (obstacle 1); driven 1: 2 contacts"));
  EXPECT_EQ(ToJson(summary)["driven_certified"]["left"], 1);
  EXPECT_THAT(ToSentence(summary), testing::StartsWith("Shadow mode: the gate certified nothing"));
}

TEST_F(ShadowTest, HasNoSlicesOfWhatThisTaskDecidesOtherwise) {
  Decide(1, true, decision_t::REJECTED, decision_t::CAUSE_SHADOW);  // it touches the circle
  for (int step = 0; step < 4; ++step) Say(1, step, 9);
  const ShadowSummary summary = Read();
  EXPECT_EQ(std::tuple(summary.driven_certified.plans, summary.not_compared, summary.states), std::tuple(1, 1, 0));
}

TEST_F(ShadowTest, SaysNothingOfAGateThatCertifies) {
  Config task = ShadowTask();
  task.gate.shadow = false;
  Decide(1, true, decision_t::ABSTAIN_SAFETY, decision_t::CAUSE_OBSTACLE);
  Decide(2, false, decision_t::CERTIFIED, 0);
  Say(2, 0);
  Touch();
  const ShadowSummary summary = Read(task);
  EXPECT_FALSE(summary.any());
  EXPECT_EQ(ToText(summary) + ToSentence(summary), "");
  EXPECT_TRUE(ToJson(summary).is_null());
}

TEST_F(ShadowTest, OfFarMorePlansThanItRemembersTheLastCount) {
  const int most = static_cast<int>(ShadowTally::kMostPlans);
  for (int id = 0; id < most + 5; ++id) Decide(id, false, decision_t::REJECTED, decision_t::CAUSE_SHADOW);
  Say(1, 0);
  Say(most + 4, 0);
  const ShadowSummary summary = Read();
  EXPECT_EQ(summary.certified, most + 5);
  EXPECT_EQ(summary.driven_certified.plans, 1);
}

// It takes no place of another plan, and what is driven is what was decided last.
TEST_F(ShadowTest, APlanThatIsDecidedAgainTakesItsOwnPlace) {
  const int most = static_cast<int>(ShadowTally::kMostPlans);
  Decide(0, false, decision_t::REJECTED, decision_t::CAUSE_SHADOW);
  for (int again = 0; again < most + 5; ++again) Decide(1, false, decision_t::REJECTED, decision_t::CAUSE_SHADOW);
  Say(0, 0);
  Say(1, 0);
  Decide(1, false, decision_t::ABSTAIN_SAFETY, decision_t::CAUSE_OBSTACLE);
  Say(1, 1);
  Say(1, 2);
  const ShadowSummary summary = Read();
  EXPECT_FIELDS(summary, (certified, most + 6), (refusals(), 1), (states, 2),
                (driven_certified, (ShadowSummary::Driven{2, 0})), (driven_refused, (ShadowSummary::Driven{1, 0})));
}

}  // namespace forereach::shadow_test
