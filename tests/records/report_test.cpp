#include "records/report.h"
#include "records/outlines.h"

#include "tests/messages.h"
#include "tests/records/course.h"
#include "tests/records/point_mass.h"

namespace forereach::report_test {

struct LogPictureTest : testing::Test {
  template <class Message>
  void Append(const std::string& channel, const Message& message) {
    writer_.Append(++now_, channel, Encode(message));
    ASSERT_TRUE(writer_.Flush());
  }

  void Decide(const candidate_plan_t& candidate, std::int16_t outcome, std::int16_t step) {
    Append("PLAN_CANDIDATE", candidate);
    decision_t decision = MakeDecision(candidate, candidate.plan_id, outcome, 0);
    decision.step = step;
    Append("PLAN_DECISION", decision);
  }

  void Step(std::int64_t plan_id, std::int16_t kind, int step) {
    execution_event_t event = MakeEvent(step, kind, plan_id, step);
    event.num_states = 4;
    event.state[1] = 0.45 * step;
    Append("EXECUTION_EVENT", event);
  }

  ScratchDirectory scratch_;
  EventLogWriter writer_{scratch_ / "log"};
  std::int64_t now_ = 0;
};

TEST_F(LogPictureTest, DrawsWhatHappened) {
  // Along x the slice of step 6, at 2.7 m, is the first that may touch the circle, which begins at 2.5 m.
  Decide(Drive(0, true), decision_t::ABSTAIN_SAFETY, 6);
  Decide(Drive(1, false), decision_t::CERTIFIED, -1);
  Step(1, execution_event_t::STARTED, 0);
  for (int step = 1; step <= 3; ++step) Step(1, execution_event_t::STEP_INSIDE, step);
  Step(1, execution_event_t::STEP_CONSISTENT, 4);
  Step(1, execution_event_t::STANDING, 4);
  robot_state_t state{.num_states = 4};
  state.state[1] = 1.8;
  Append("ROBOT_STATE", state);

  const LogPicture drawn = PictureFromLogs({scratch_ / "log"}, {PointMassConfig()});
  EXPECT_FIELDS(drawn, (disagreements, 0), (picture.executed.size(), 5u), (picture.certified.size(), 6u));
  EXPECT_EQ(Only(drawn.picture.abstained).size(), 7u) << "up to the slice that may touch";
  EXPECT_EQ(Only(drawn.picture.path), Eigen::Vector2d(0, 1.8));
  EXPECT_EQ(Only(drawn.picture.stops), Eigen::Vector2d(0, 1.8));
  EXPECT_EQ(Only(drawn.picture.obstacles).radius(), 0.5);
  ASSERT_TRUE(drawn.picture.goal.has_value());
  EXPECT_EQ(drawn.picture.goal->center, Eigen::Vector2d(0, 5));
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& corner : drawn.picture.executed[4])
    middle += corner / static_cast<double>(drawn.picture.executed[4].size());
  EXPECT_NEAR(middle.x(), 0, 1e-9);
  EXPECT_NEAR(middle.y(), 1.8, 1e-9);
}

TEST_F(LogPictureTest, TakesTheObstaclesInForce) {
  Config config = PointMassConfig();
  config.gate.obstacles = ObstaclesSource::kBus;
  auto see = [&, sequence = 0](const std::vector<Obstacle>& obstacles, std::int64_t utime) mutable {
    Append("OBSTACLES", Sighted(obstacles, utime, sequence++));
  };
  const std::vector<Obstacle> on_the_way = std::exchange(config.obstacles, {});
  see(on_the_way, now_);
  Decide(Drive(0, true), decision_t::ABSTAIN_SAFETY, 6);
  see({Obstacle::AxisBox(Eigen::Vector2d(-2, 1), Eigen::Vector2d(2, 2)),
       Obstacle::Polygon({Eigen::Vector2d(5, 5), Eigen::Vector2d(6, 6), Eigen::Vector2d(6, 5), Eigen::Vector2d(5, 6),
                          Eigen::Vector2d(5.5, 5.5)}),
       Obstacle::HalfSpace(Eigen::Vector2d(0, 1), 10)},
      now_);
  see(on_the_way, now_ + 1 + 50'001);  // gate.max_ahead_ms is 50: the gate refused it
  Decide(Drive(1, true), decision_t::CERTIFIED, -1);
  const LogPicture drawn = PictureFromLogs({scratch_ / "log"}, {config});
  EXPECT_EQ(drawn.disagreements, 0);
  using Kind = Obstacle::Kind;
  const std::vector<Kind> kinds{Kind::kBox, Kind::kPolygon, Kind::kHalfSpace};
  ASSERT_TRUE(std::ranges::equal(drawn.picture.obstacles, kinds, {}, &Obstacle::kind));
  EXPECT_THAT(PlaceOf(drawn.picture.obstacles[1], 0).value().points,
              ElementsAre(Eigen::Vector2d(5, 5), Eigen::Vector2d(6, 5), Eigen::Vector2d(6, 6), Eigen::Vector2d(5, 6)));
}

TEST_F(LogPictureTest, LeavesOutWhatItCannotConfirm) {
  Decide(Drive(0, true), decision_t::CERTIFIED, -1);
  Decide(Drive(1, true), decision_t::ABSTAIN_SAFETY, 5);
  candidate_plan_t wrong_size = Drive(2, false);
  wrong_size.num_states = 6;
  Decide(wrong_size, decision_t::CERTIFIED, -1);
  const LogPicture drawn = PictureFromLogs({scratch_ / "log"}, {PointMassConfig()});
  EXPECT_FIELDS(drawn, (disagreements, 3), (picture.certified.empty(), true), (picture.abstained.empty(), true));
}

TEST_F(LogPictureTest, RefusesATaskThatIsNotPlanar) {
  Config config = PointMassConfig();
  auto line = std::make_shared<Problem>(*config.problem);
  line->projection = Eigen::MatrixXd::Identity(1, 4);
  config.problem = line;
  EXPECT_THROW((void)PictureFromLogs({scratch_ / "log"}, {config}), PictureError);
}

TEST_F(LogPictureTest, TheReportSaysWhatIsWrong) {
  Append("PLAN_CANDIDATE", Drive(0, true));
  std::ostringstream out;
  EXPECT_THAT(
      [&] {
        Report({{scratch_ / "log"}, scratch_ / "missing.yaml", ""}, out);
      },
      ThrowsMessage<BadInput>(HasSubstr("missing.yaml")));
  EXPECT_EQ(out.str(), "");
}

TEST_F(LogPictureTest, TheReportRefusesAPictureItCannotWriteBeforeItReadsAnything) {
  std::ostringstream out;
  EXPECT_THAT(
      [&] {
        Report({{"none.lcmlog"}, "none.yaml", scratch_ / "x.gif"}, out);
      },
      ThrowsMessage<BadInput>(HasSubstr("x.gif ends in .gif")));
}

// The name of a channel may be any bytes.
TEST_F(LogPictureTest, TheReportIsJsonWhateverTheLogHolds) {
  Append("PLAN_CANDIDATE", Drive(0, true));
  Append("CH\xff\xfe", MakeEvent(0, 0));
  std::ostringstream out;
  (void)Report({{scratch_ / "log"}, FOREREACH_SOURCE_DIR "/tests/data/course.yaml", "", true}, out);
  EXPECT_EQ(nlohmann::json::parse(out.str())["messages"].size(), 2u);
}

}  // namespace forereach::report_test
