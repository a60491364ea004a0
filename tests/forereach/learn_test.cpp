// A certifier that learns transitions gives the same answers as one that had them from the start.
#include "tests/test.h"

#include "forereach/certify/certifier.h"
#include "forereach/certify/tube.h"
#include "forereach/dynamics/text_model.h"
#include "tests/text_models.h"
#include "tests/worlds.h"

namespace forereach::learn_test {

constexpr int kBase = 5, kLearned = 400;

// A residual of theta that rises with v, inside what is declared; the domain has a ball besides its box.
struct LearnTest : testing::Test {
  LearnTest() {
    problem_.domain.balls.push_back({{3, 5}, Eigen::Vector2d(10, 0), 9});
    problem_.declaration.lipschitz(2, 3) = 0.02;
    problem_.declaration.lipschitz(2, 5) = 0.3;
    problem_.transitions.z.resize(0, 8);
    problem_.transitions.x_next.resize(0, 6);
  }

  Eigen::VectorXd Draw() {
    const auto in = [&](double a, double b) { return std::uniform_real_distribution<double>(a, b)(random_); };
    return (Eigen::VectorXd(8) << in(-5, 5), in(-5, 5), in(-1, 1), in(6, 14), in(-1, 1), in(-0.3, 0.3), in(-1, 1),
            in(-0.2, 0.2))
        .finished();
  }
  Eigen::VectorXd Next(const Eigen::VectorXd& z, double error = 0) const {
    Eigen::VectorXd next(6);
    problem_.model->Evaluate({z.data(), 8}, {next.data(), 6});
    next[2] += 0.01 * std::sin(z[3]) + error;
    return next;
  }
  static void Add(Problem& problem, const Eigen::VectorXd& z, const Eigen::VectorXd& next) {
    Transitions& data = problem.transitions;
    data.z.conservativeResize(data.z.rows() + 1, Eigen::NoChange);
    data.x_next.conservativeResize(data.x_next.rows() + 1, Eigen::NoChange);
    data.z.bottomRows(1) = z.transpose();
    data.x_next.bottomRows(1) = next.transpose();
  }
  static Certifier::Learned Learn(Certifier& certifier, const Eigen::VectorXd& z, const Eigen::VectorXd& next) {
    return certifier.Learn({z.data(), 8}, {next.data(), 6});
  }
  Decision Certify(const Certifier& certifier, Tube& tube) const {
    const std::vector<double> controls(2 * 12, 0.05);
    const auto initial_set = Zonotope::FromBox((Eigen::VectorXd(6) << 0, 0, 0, 10, 0, 0.05).finished(),
                                               (Eigen::VectorXd(6) << 0.1, 0.1, 0.02, 0.2, 0.02, 0.005).finished());
    return certifier.Certify({controls.data(), 2, 12, 2}, initial_set, {}, tube);
  }

  FreshRandom random_;
  Problem problem_ = WorldOf(MakeKinematicBicycle(0.1, 2.5),
                             Box(Vec({-40, -40, -3, 0, -3, -0.4}), Vec({40, 40, 3, 20, 3, 0.4})), Within({20, 2}));
};

// Two steps from the same place that differ by twice the bound, and by little more.
TEST_F(LearnTest, ALearnedStepMayHaveBeenDisturbedAsAnyOther) {
  problem_.declaration.disturbance = Eigen::VectorXd::Zero(6);
  problem_.declaration.disturbance[2] = 0.125;
  const Eigen::VectorXd z = Draw();
  Add(problem_, z, Next(z, -0.125));
  for (const double beyond : {-1e-9, 1e-9}) {
    Certifier certifier(std::make_shared<Problem>(problem_));
    EXPECT_EQ(Learn(certifier, z, Next(z, 0.125 + beyond)), Certifier::Learned::kAdded);
    EXPECT_EQ(certifier.violation().has_value(), beyond > 0);
  }
}

// The same, where the bound is what the expression has at their place.
TEST_F(LearnTest, ALearnedStepMayHaveBeenDisturbedByWhatItsPlaceAllows) {
  problem_.declaration.growing = Growing(*problem_.model, {"0", "0", "0.015625*abs(v*(delta - 1))", "0", "0", "0"});
  const Eigen::VectorXd z = Draw();
  const double bound = 0.015625 * z[3] * (1 - z[5]);
  Add(problem_, z, Next(z, -bound));
  for (const double beyond : {-1e-9, 1e-9}) {
    Certifier certifier(std::make_shared<Problem>(problem_));
    EXPECT_EQ(Learn(certifier, z, Next(z, bound + beyond)), Certifier::Learned::kAdded);
    EXPECT_EQ(certifier.violation().has_value(), beyond > 0);
  }
}

TEST_F(LearnTest, AnswersAsACertifierThatHadAllDataFromTheStart) {
  Problem all = problem_;
  std::vector<Eigen::VectorXd> points;
  for (int i = 0; i < kBase + kLearned; ++i) {
    points.push_back(Draw());
    Add(all, points.back(), Next(points.back()));
    if (i < kBase) Add(problem_, points.back(), Next(points.back()));
  }
  Certifier learning(std::make_shared<Problem>(problem_));
  Tube tube, tube_of_all, tube_before;
  const Decision before = Certify(learning, tube_before);
  for (int i = kBase; i < kBase + kLearned; ++i) {
    const auto& z = points[static_cast<std::size_t>(i)];
    ASSERT_EQ(Learn(learning, z, Next(z)), Certifier::Learned::kAdded);
    if (i == 100 || i == 300) learning.Compact();
  }
  EXPECT_EQ(learning.num_observations(), static_cast<std::size_t>(kBase + kLearned));
  const Certifier knowing(std::make_shared<Problem>(all));
  EXPECT_EQ(Certify(learning, tube).outcome, Certify(knowing, tube_of_all).outcome);
  ASSERT_EQ(tube.length(), tube_of_all.length());
  for (int k = 0; k < 6; ++k) {
    const double learned = tube.slice(tube.length()).HalfWidthUpper(k);
    EXPECT_NEAR(learned, tube_of_all.slice(tube.length()).HalfWidthUpper(k), 1e-9);
    if (before.outcome == Outcome::kCertified)
      EXPECT_LE(learned, tube_before.slice(tube.length()).HalfWidthUpper(k) + 1e-12) << "data only narrow";
  }
}

// One bound for a learned step and for a given one. Software sets all states, so that a duration hides nothing.
TEST_F(LearnTest, AStepThatIsOffByHalfOfDtSaysNothing) {
  problem_.timing.set_at_steps = {0, 1, 2, 3, 4, 5};
  const Eigen::VectorXd z = Draw(), next = Next(z);
  Add(problem_, z, next);
  Certifier certifier(std::make_shared<Problem>(problem_));
  EXPECT_EQ(certifier.Learn({z.data(), 8}, {next.data(), 6}, std::nextafter(0.05, 0)), Learned::kAdded);
  EXPECT_EQ(certifier.Learn({z.data(), 8}, {next.data(), 6}, 0.05), Learned::kNoNominalSlope);
  problem_.transitions.longer = Vec({std::nextafter(0.05, 0)});
  EXPECT_NO_THROW(ValidateDurations(problem_));
  problem_.transitions.longer = Vec({0.05});
  EXPECT_THAT([&] { ValidateDurations(problem_); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("a duration is off by 0.05 s, outside [0, 0.05)")));
}

TEST_F(LearnTest, DurationsAreKnownWhereEquationsOrRatesSayHowStatesMove) {
  EXPECT_TRUE(KnowsDurations(problem_));
  const auto with = [&](const std::string& next) {
    problem_.model = MakeTextModel(TextModel({{"x", next}}, {"u"}, {{"dt", 0.1, 0.1}}));
    return KnowsDurations(problem_);
  };
  EXPECT_TRUE(with("x + dt*u"));
  EXPECT_FALSE(with("x + 0.1*u"));
  problem_.timing.rate_bound = Vec({5});
  EXPECT_TRUE(with("x + 0.1*u"));
}

TEST_F(LearnTest, RefusesATransitionInsideTheBoxAndOutsideTheDomain) {
  Add(problem_, Draw(), Next(Draw()));
  problem_.transitions.x_next.row(0) = Next(problem_.transitions.z.row(0).transpose()).transpose();
  Certifier certifier(std::make_shared<Problem>(problem_));
  Eigen::VectorXd z = Draw();
  z[3] = 19;
  z[5] = 0;
  EXPECT_EQ(Learn(certifier, z, Next(z)), Certifier::Learned::kAdded) << "on the ball's edge";
  z[3] = std::nextafter(19.0, 20.0);
  EXPECT_EQ(Learn(certifier, z, Next(z)), Certifier::Learned::kOutsideDomain) << "inside the box, outside the ball";
  z = Draw();
  z[0] = std::nan("");
  EXPECT_EQ(Learn(certifier, z, Next(Draw())), Certifier::Learned::kNotFinite);
  z = Draw();
  EXPECT_EQ(Learn(certifier, z, Eigen::VectorXd::Constant(6, INFINITY)), Certifier::Learned::kNotFinite);
  EXPECT_EQ(certifier.num_observations(), 2u);
}

// In the ball {v, delta} of radius 9 about (10, 0), and by the bounds of the other states.
TEST_F(LearnTest, RefusesATransitionThatItsErrorsMayTakeOutOfTheDomain) {
  problem_.declaration.state_error = Vec({0, 0.5, 0, 0.25, 0, 0});
  problem_.declaration.input_error = Vec({0, 0.5});
  Eigen::VectorXd z = Draw();
  z[5] = 0;
  Add(problem_, z, Next(z));
  Certifier certifier(std::make_shared<Problem>(problem_));
  const auto learn_at = [&](int l, double value) {
    Eigen::VectorXd there = z;
    there[l] = value;
    return Learn(certifier, there, Next(there));
  };
  using Edge = std::tuple<int, double, double>;
  for (const auto& [l, edge, outside] : {Edge{3, 18.75, 19}, Edge{1, 39.5, 40}, Edge{1, -39.5, -40}, Edge{7, 1.5, 2}}) {
    EXPECT_EQ(learn_at(l, edge), Learned::kAdded) << l << ", exactly at the edge";
    EXPECT_EQ(learn_at(l, std::nextafter(edge, 0)), Learned::kAdded) << l;
    EXPECT_EQ(learn_at(l, std::nextafter(edge, 2 * edge)), Learned::kNearTheEdge) << l;
    EXPECT_EQ(learn_at(l, outside), Learned::kNearTheEdge) << l;
    EXPECT_EQ(learn_at(l, std::nextafter(outside, 2 * outside)), Learned::kOutsideDomain) << l;
  }
  EXPECT_EQ(learn_at(0, 40), Learned::kAdded) << "x is exact";
  EXPECT_FALSE(certifier.violation());
}

// A robot that records its speed with errors contradicts what it recorded before, unless it says so.
TEST_F(LearnTest, AnInexactRecordContradictsUnlessItsErrorIsDeclared) {
  const Eigen::VectorXd z = Draw();
  Add(problem_, z, Next(z));
  Eigen::VectorXd next = Next(z);
  next[3] += 0.125;  // v: an error of 1/32 in each of four numbers
  for (const double error : {0.0, 0x1p-5 * (1 - 1e-9), 0x1p-5 * (1 + 1e-9)}) {
    problem_.declaration.state_error = Vec({0, 0, 0, error, 0, 0});
    Certifier certifier(std::make_shared<Problem>(problem_));
    EXPECT_EQ(Learn(certifier, z, next), Learned::kAdded);
    EXPECT_EQ(certifier.violation().has_value(), error < 0x1p-5) << error;
  }
}

TEST_F(LearnTest, LearnsNothingWhereTheErrorsReachAnUnboundedSlope) {
  const ModelText text = TextModel({{"x", "sqrt(x + 1)"}}, {"u"}, {{"dt", 1, 1}});
  Problem problem = WorldOf(MakeTextModel(text), Within({1}), Within({1}));
  problem.declaration.state_error = Vec({0.25});
  Certifier certifier(std::make_shared<Problem>(problem));
  const auto learn = [&](double x) {
    const std::vector<double> z{x, 0}, next{std::sqrt(x + 1)};
    return certifier.Learn(z, next);
  };
  EXPECT_EQ(learn(-0.5), Learned::kAdded);
  EXPECT_EQ(learn(-0.75), Learned::kNoNominalSlope) << "to the end of the root's domain";
  EXPECT_EQ(learn(-0.8), Learned::kNearTheEdge);
}

TEST_F(LearnTest, LearnsNothingWhereTheNominalModelHasNoFiniteValue) {
  constexpr double kHuge = 1.5e308;
  const Problem problem = WorldOf(MakePointMass(10), Within({kHuge, kHuge, kHuge, kHuge}), Within({1, 1}));
  Certifier certifier(std::make_shared<Problem>(problem));
  Eigen::VectorXd z = Eigen::VectorXd::Zero(6);
  z[2] = kHuge;
  EXPECT_EQ(certifier.Learn({z.data(), 6}, {z.data(), 4}), Certifier::Learned::kNoNominalValue);
  EXPECT_EQ(certifier.num_observations(), 1u);
}

TEST_F(LearnTest, AnAngleIsLearnedWithAnyTurnsThatCanBeTold) {
  Problem problem = WorldOf(MakeKinematicBicycle(0.1, 2, {2}), Within({9, 9, 9, 9, 9, 9}), Within({1, 1}));
  problem.declaration.noise_bound.setConstant(0.1);
  Certifier certifier(std::make_shared<Problem>(problem));
  const std::vector<double> z(8, 0);
  const auto learn = [&](double theta) { return certifier.Learn(z, std::array{0.0, 0.0, theta, 0.0, 0.0, 0.0}); };
  EXPECT_EQ(learn(6.2), Certifier::Learned::kAdded);
  EXPECT_EQ(learn(-12.5), Certifier::Learned::kAdded);
  EXPECT_FALSE(certifier.violation());
  EXPECT_EQ(learn(2), Certifier::Learned::kAmbiguousAngle);
  EXPECT_EQ(certifier.num_observations(), 3u);
  EXPECT_EQ(learn(6.6), Certifier::Learned::kAdded);
  EXPECT_TRUE(certifier.violation()) << "0.32 rad after a turn contradict -0.08 rad and sigma";
}

TEST_F(LearnTest, AContradictionIsTheTransitionsAsTheyWereRecordedHoweverFewAreKept) {
  problem_.max_observations = 20;
  for (int i = 0; i < kBase; ++i) {
    const Eigen::VectorXd z = Draw();
    Add(problem_, z, Next(z));
  }
  Certifier certifier(std::make_shared<Problem>(problem_));
  for (int i = 0; i < kLearned; ++i) {
    const Eigen::VectorXd z = Draw();
    ASSERT_EQ(Learn(certifier, z, Next(z)), Learned::kAdded);
    if (i % 50 == 0) certifier.Compact();
  }
  const Eigen::VectorXd z = Draw(), first = Next(z), second = Next(z, 0.01);
  certifier.Learn({z.data(), 8}, {first.data(), 6}, 0, 0.25);
  EXPECT_FALSE(certifier.violation());
  certifier.Learn({z.data(), 8}, {second.data(), 6});
  ASSERT_TRUE(certifier.violation());
  const Transitions rows = certifier.Contradiction();
  ASSERT_EQ(rows.size(), 2);
  EXPECT_FIELDS(rows, (x_next.row(1).transpose(), second), (longer[1], 0));
  if (rows.z.row(0).transpose() == z) {  // or another one that is near
    EXPECT_FIELDS(rows, (x_next.row(0).transpose(), first), (longer[0], 0.25));
  }
  problem_.transitions = rows;
  problem_.transitions.longer.setZero();
  EXPECT_TRUE(Certifier(std::make_shared<Problem>(problem_)).violation());
}

TEST_F(LearnTest, AContradictionNamesThePairAndFalsifies) {
  for (int i = 0; i < kBase; ++i) {
    const Eigen::VectorXd z = Draw();
    Add(problem_, z, Next(z));
  }
  Certifier certifier(std::make_shared<Problem>(problem_));
  EXPECT_FALSE(certifier.violation());
  const Eigen::VectorXd z = problem_.transitions.z.row(3).transpose();
  EXPECT_EQ(Learn(certifier, z, Next(z, 1e-3)), Certifier::Learned::kAdded);
  ASSERT_TRUE(certifier.violation());
  EXPECT_FIELDS(*certifier.violation(), (second, kBase), (coordinate, 2));
  Tube tube;
  EXPECT_EQ(Certify(certifier, tube).outcome, Outcome::kFalsified);
}

}  // namespace forereach::learn_test
