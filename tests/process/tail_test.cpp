// `forereach tail` on a real bus.

#include "tests/test.h"

#include "bus/process.h"
#include "forereach/decision_t.hpp"
#include "lcmtypes/codec.h"
#include "tests/keys.h"
#include "tests/process/process_fixture.h"

namespace forereach::tail_test {

decision_t Decided(std::int64_t sequence, std::int16_t outcome, const std::string& message) {
  decision_t decision{.sequence = sequence, .plan_id = 10 + sequence, .outcome = outcome};
  SetText(decision.source, "planner\x1b[2J");
  SetText(decision.message, message);
  return decision;
}

struct TailTest : testing::Test {
  std::unique_ptr<ChildProcess> Start(const std::vector<std::string>& options) const {
    std::vector<std::string> command{FOREREACH_PROGRAM, "tail", "--lcm-url", url_};
    command.insert(command.end(), options.begin(), options.end());
    auto tail = std::make_unique<ChildProcess>(command);
    EXPECT_TRUE(tail->WaitForLog("listening on")) << tail->error();
    return tail;
  }

  const std::string url_ = PrivateBusUrl();
};

TEST_F(TailTest, PrintsEachDecisionWithCounts) {
  const auto tail = Start({"--count", "3"});
  const auto bus = OpenBus(url_);
  bus->Publish("PLAN_DECISION", Decided(0, decision_t::CERTIFIED, "certified: all is clear"));
  bus->Publish("PLAN_DECISION", Decided(1, decision_t::ABSTAIN_SAFETY, "abstain S: a wall"));
  const std::vector<std::uint8_t> no_decision{1, 2, 3};
  bus->Publish("PLAN_DECISION", Bytes(no_decision));
  bus->Publish("PLAN_DECISION", Decided(5, decision_t::CERTIFIED, "certified: again"));
  EXPECT_EQ(tail->WaitForExit(), 0) << tail->error();
  EXPECT_THAT(tail->output(),
              AllOf(HasSubstr("certified          1 of 1  plan 10 of planner?[2J  certified: all is clear\n"),
                    HasSubstr("abstain_safety     1 of 2  plan 11 of planner?[2J  abstain S: a wall\n"),
                    HasSubstr("certified          2 of 3  plan 15"),
                    HasSubstr("tail: 3 decisions: 1 abstain_safety, 2 certified; 3 missed; 1 messages on the channel"),
                    Not(HasSubstr("\x1b"))));
  EXPECT_THAT(tail->error(), HasSubstr("UNSIGNED"));
}

TEST_F(TailTest, EndsWithASummaryAtASignal) {
  const auto tail = Start({});
  EXPECT_EQ(tail->Terminate(), 0);
  EXPECT_THAT(tail->output(), HasSubstr("tail: 0 decisions\n"));
}

TEST_F(TailTest, OnlyListens) {
  std::int64_t heard = 0;
  const auto bus = OpenBus(url_);
  bus->Subscribe(Bus::kEveryChannel, [&heard](const Received&) { ++heard; });
  const auto tail = Start({});
  bus->Publish("PLAN_DECISION", Decided(0, decision_t::CERTIFIED, ""));
  for (int i = 0; i < 20; ++i) bus->Dispatch(20);
  EXPECT_EQ(heard, 1) << "its own message alone";
  EXPECT_EQ(tail->Terminate(), 0);
}

TEST_F(TailTest, WithAKeyOnlyAuthenticDecisionsAreShown) {
  const ScratchDirectory scratch;
  const std::string key = MakeTestKeys(scratch / "keys");
  const auto tail = Start({"--count", "1", "--key", key + "/verify.pub"});
  BusOptions options{.url = url_, .key = key};
  const auto open = OpenBus(url_);
  const auto certifier = OpenBusOfAllRoles(options);
  open->Publish("PLAN_DECISION", Decided(0, decision_t::CERTIFIED, "a stranger's"));
  certifier->Publish("PLAN_DECISION", Decided(0, decision_t::CERTIFIED, "the certifier's"));
  EXPECT_EQ(tail->WaitForExit(), 0);
  EXPECT_THAT(tail->output(), AllOf(HasSubstr("the certifier's"), Not(HasSubstr("a stranger's"))));
  EXPECT_THAT(tail->error(), Not(HasSubstr("UNSIGNED")));
}

// `script` gives it a terminal.
TEST_F(TailTest, ColoursOnATerminalUnlessNoColorIsSet) {
  for (const bool no_color : {false, true}) {
    const std::string command = std::string(FOREREACH_PROGRAM) + " tail --count 1 --lcm-url '" + url_ + "'";
    ChildProcess terminal({"/usr/bin/env", no_color ? "NO_COLOR=1" : "SOMETHING=1", "TERM=xterm", "/usr/bin/script",
                           "-qefc", command, "/dev/null"});
    const auto bus = OpenBus(url_);
    for (int i = 0; i < 200 && !terminal.WaitForEnd(std::chrono::milliseconds(50)); ++i)
      bus->Publish("PLAN_DECISION", Decided(i, decision_t::CERTIFIED, "green"));
    EXPECT_EQ(terminal.WaitForExit(), 0);
    EXPECT_EQ(terminal.output().find("\x1b[32mcertified") != std::string::npos, !no_color) << terminal.output();
  }
}

}  // namespace forereach::tail_test
