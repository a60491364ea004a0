// An extended node is what Certify makes of the controls so far: decision, slice and closest approach, to the bit.
#include "forereach/certify/extender.h"

#include <map>

#include "tests/test.h"

#include "forereach/certify/tube.h"
#include "forereach/safety/obstacle_index.h"
#include "forereach/safety/occupancy_grid.h"
#include "tests/oracle/any_task.h"
#include "tests/worlds.h"

namespace forereach::extender_test {

struct Branch {
  TubeNode node;
  Eigen::MatrixXd controls;  // from X_0
};

Plan PlanOf(const Eigen::MatrixXd& controls, const Schedule& schedule) {
  return {controls.data(), static_cast<int>(controls.rows()), static_cast<int>(controls.cols()),
          static_cast<int>(controls.rows()), schedule};
}

// What a certificate would say of the controls so far.
Decision SoFar(const TubeNode& node) {
  Decision decision = node.closest();
  EXPECT_EQ(decision.outcome, Outcome::kNone) << "a node is not a certificate";
  decision.outcome = Outcome::kCertified;
  return decision;
}

void ExpectSlice(const TubeNode& node, const Tube& tube) {
  ASSERT_EQ(node.depth(), tube.length());
  for (int k = 0; k < node.dim(); ++k) {
    EXPECT_EQ(node.center()[ToSize(k)], tube.slice(node.depth()).center(k));
    EXPECT_EQ(node.hull(k).lower, tube.hull(node.depth(), k).lower);
    EXPECT_EQ(node.hull(k).upper, tube.hull(node.depth(), k).upper);
  }
}

std::vector<Obstacle> ObstaclesNear(Random& random, const Problem& problem, const Tube& tube,
                                    const Schedule& schedule) {
  std::vector<Obstacle> obstacles;
  for (int o = random.Integer(0, 5); o > 0; --o)
    if (const auto approach = AnyApproach(random, problem, tube, schedule))
      obstacles.push_back(approach->At(random.Uniform(0, 30)));
  return obstacles;
}

// Without rest. Some have so many observations that a search for the tightest is cut short; where it began matters
// then.
std::shared_ptr<Problem> AnyTreeTask(Random& random) {
  const bool bicycle = random.Coin(), is_capped = random.Coin(0.3);
  const auto problem = is_capped ? AnyProblem(random, bicycle, 300) : AnyTask(random, bicycle);
  problem->rest.clear();
  if (is_capped) problem->max_leaf_visits = 1;
  const NominalModel& model = *problem->model;
  if (random.Coin())
    problem->limits = {{.name = "of a state", .that = {model.state_names()[0]}, .at_most = random.Uniform(5, 30)},
                       {.name = "of an input",
                        .that = {model.state_names()[1] + "*" + model.input_names()[0]},
                        .at_most = random.Uniform(0.5, 20)}};
  return problem;
}

TEST(Extender, FindsToTheBitWhatCertifyDecides) {
  std::map<std::pair<Outcome, Cause>, int> found;
  int capped = 0, deepest = 0, moving = 0, indexed = 0;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    const auto problem = AnyTreeTask(random);
    const Certifier certifier(problem);
    const Query query = AnyDrive(random, *problem);
    Tube tube, scratch, other_scratch;
    static_cast<void>(certifier.Certify(query.plan(), query.initial_set, {}, tube));
    const std::vector<Obstacle> obstacles = ObstaclesNear(random, *problem, tube, query.schedule);
    const ObstacleIndex index(obstacles);
    const bool has_index = random.Coin();
    const ObstacleView view = has_index ? ObstacleView(obstacles, index) : ObstacleView(obstacles);
    for (const Obstacle& obstacle : obstacles) moving += obstacle.motion().has_value();
    indexed += has_index;

    Extender extender(certifier, view, query.schedule, scratch);
    Extender without_closest(certifier, view, query.schedule, other_scratch, false);
    std::vector<Branch> tree(1);
    tree[0].controls.resize(2, 0);
    if (const Decision decision = extender.Begin(query.initial_set, tree[0].node); decision.outcome != Outcome::kNone) {
      EXPECT_NE(certifier.Certify(query.plan(), query.initial_set, view, tube).outcome, Outcome::kCertified);
      ++found[{decision.outcome, decision.cause}];
      continue;
    }
    for (int i = 0; i < 40; ++i) {
      // Mostly on from the newest, now and then from anywhere: the scratch tube holds another branch then.
      const Branch& from = random.Coin(0.7) ? tree.back() : tree[ToSize(random.Below(static_cast<int>(tree.size())))];
      const Eigen::Index t = from.controls.cols();
      Eigen::MatrixXd controls(2, t + 1);
      controls << from.controls, query.controls.col(t % query.controls.cols()) + random.Matrix(2, 1, 0.3);
      TubeNode next;
      const std::array<double, 2> input{controls(0, t), controls(1, t)};
      const Decision decision = extender.Extend(from.node, input, next);
      TubeNode clear;
      EXPECT_EQ(Fields(without_closest.Extend(from.node, input, clear)), Fields(decision));
      const Decision whole = certifier.Certify(PlanOf(controls, query.schedule), query.initial_set, view, tube);
      ++found[{whole.outcome, whole.cause}];
      capped += whole.capped;
      if (decision.outcome != Outcome::kNone) {
        ASSERT_EQ(Fields(decision), Fields(whole)) << "after " << t << " steps";
        EXPECT_EQ(next.dim(), 0) << "it is unchanged";
        continue;
      }
      ASSERT_EQ(Fields(SoFar(next)), Fields(whole)) << "after " << t << " steps";
      ExpectSlice(next, tube);
      ExpectSlice(clear, tube);
      EXPECT_EQ(Fields(clear.closest()), Fields(Decision{.capped = whole.capped}));
      deepest = std::max(deepest, next.depth());
      tree.push_back({std::move(next), std::move(controls)});
    }
  }
  EXPECT_GT((found[{Outcome::kCertified, Cause::kNone}]), 1000);
  EXPECT_GT((found[{Outcome::kSafety, Cause::kObstacle}]), 100);
  EXPECT_GT((found[{Outcome::kSafety, Cause::kLimit}]), 50);
  EXPECT_GT((found[{Outcome::kDomain, Cause::kDomainExit}]), 100);
  EXPECT_GT((found[{Outcome::kDomain, Cause::kBetween}]), 0);
  EXPECT_GT(capped, 100);
  EXPECT_GT(deepest, 20);
  EXPECT_GT(moving, 20);
  EXPECT_GT(indexed, 50);
}

struct ExtenderTest : testing::Test {
  const std::shared_ptr<Problem> problem_ = std::make_shared<Problem>(PointMassInHalves(100));
  const Zonotope start_ = Zonotope::FromBox(Vec({0, 0, 2, 0}), Eigen::VectorXd::Constant(4, 0.01));
  Tube tube_;
  const std::array<double, 2> coast_{0, 0};
};

TEST_F(ExtenderTest, KeepsANodeThatIsExtendedInPlace) {
  const Certifier certifier(problem_);
  const std::vector<Obstacle> obstacles{Obstacle::Circle(Eigen::Vector2d(3, 4), 1)};
  Extender extender(certifier, obstacles, {}, tube_);
  TubeNode node;
  ASSERT_EQ(extender.Begin(start_, node).outcome, Outcome::kNone);
  for (int t = 0; t < 5; ++t) ASSERT_EQ(extender.Extend(node, coast_, node).outcome, Outcome::kNone);
  Tube whole;
  const Eigen::MatrixXd controls = Eigen::MatrixXd::Zero(2, 5);
  EXPECT_EQ(Fields(SoFar(node)), Fields(certifier.Certify(PlanOf(controls, {}), start_, obstacles, whole)));
  ExpectSlice(node, whole);
}

// A grid counts as its blocks: those that come after it have other numbers.
TEST_F(ExtenderTest, KeepsTheClosestBesideGrids) {
  const auto grid = [](double y, bool is_empty) {
    GridMap map{.origin = {4, y}, .width = 5, .height = 3, .occupied = std::vector<bool>(15), .outside_is_free = true};
    for (std::size_t cell = 0; cell < 15 && !is_empty; cell += 2) map.occupied[cell] = true;  // eight blocks
    return Obstacle::Grid(std::make_shared<const OccupancyGrid>(std::move(map)));
  };
  const Certifier certifier(problem_);
  const Obstacle near = Obstacle::Circle(Vec({3, 4}), 1), far = Obstacle::Circle(Vec({3, 50}), 1);
  for (const std::vector<Obstacle>& obstacles : {std::vector{grid(8, false), near},
                                                 {grid(8, true), near},
                                                 {grid(8, false), grid(8, true), near, far},
                                                 {grid(8, true), grid(6, false), far},
                                                 {far, grid(-9, false), grid(9, true), grid(6, false)}}) {
    const ObstacleIndex index(obstacles);
    for (const ObstacleView& view : {ObstacleView(obstacles), ObstacleView(obstacles, index)}) {
      Extender extender(certifier, view, {}, tube_);
      TubeNode node;
      ASSERT_EQ(extender.Begin(start_, node).outcome, Outcome::kNone);
      for (int t = 1; t <= 10; ++t) {
        ASSERT_EQ(extender.Extend(node, coast_, node).outcome, Outcome::kNone);
        Tube whole;
        const Eigen::MatrixXd controls = Eigen::MatrixXd::Zero(2, t);
        const Decision expected = certifier.Certify(PlanOf(controls, {}), start_, view, whole);
        EXPECT_EQ(Fields(SoFar(node)), Fields(expected)) << t;
        EXPECT_EQ(node.closest().block, expected.block) << t;
      }
    }
  }
}

TEST_F(ExtenderTest, DoesNotKnowWhetherThePlanEndsAtRest) {
  problem_->rest = {{2, 0.5}};
  const Certifier certifier(problem_);
  Extender extender(certifier, {}, {}, tube_);
  TubeNode node;
  ASSERT_EQ(extender.Begin(start_, node).outcome, Outcome::kNone);
  EXPECT_EQ(extender.Extend(node, coast_, node).outcome, Outcome::kNone);
  EXPECT_EQ(certifier.Certify({coast_.data(), 2, 1, 2}, start_, {}, tube_).cause, Cause::kNoStop);
}

TEST_F(ExtenderTest, BeginsNoTreeUnderADeclarationThatDataContradict) {
  problem_->transitions.z = Eigen::MatrixXd::Zero(2, 6);
  problem_->transitions.x_next = Eigen::MatrixXd::Zero(2, 4);
  problem_->transitions.x_next(1, 0) = 1;
  const Certifier certifier(problem_);
  Extender extender(certifier, {}, {}, tube_);
  TubeNode root;
  const Decision decision = extender.Begin(start_, root);
  EXPECT_EQ(decision.outcome, Outcome::kFalsified);
  EXPECT_EQ(Fields(decision), Fields(certifier.Certify({coast_.data(), 2, 1, 2}, start_, {}, tube_)));
}

TEST_F(ExtenderTest, BeginsNoTreeOnAnObstacle) {
  const Certifier certifier(problem_);
  const std::vector<Obstacle> obstacles{Obstacle::Circle(Eigen::Vector2d(0, 0), 1)};
  TubeNode root;
  EXPECT_EQ(Extender(certifier, obstacles, {}, tube_).Begin(start_, root).outcome, Outcome::kSafety);
}

TEST_F(ExtenderTest, RefusesWhatIsNoStep) {
  const Certifier certifier(problem_);
  Extender extender(certifier, {}, {}, tube_);
  TubeNode node, next;
  const auto extend = [&](std::span<const double> input) { static_cast<void>(extender.Extend(node, input, next)); };
  EXPECT_THROW(extend(coast_), std::invalid_argument) << "it has not begun";
  const Zonotope still = Zonotope::FromBox(Eigen::VectorXd::Zero(4), Eigen::VectorXd::Zero(4));
  ASSERT_EQ(extender.Begin(still, node).outcome, Outcome::kNone);
  EXPECT_THROW(extend(std::array<double, 3>{}), std::invalid_argument);
  EXPECT_THROW(extend(std::array{0.0, std::numeric_limits<double>::quiet_NaN()}), std::invalid_argument);
  EXPECT_THROW(extend(std::array{kInfinity, 0.0}), std::invalid_argument);
}

TEST(TubeNode, OfSixStatesHasTwoKilobytes) {
  Problem problem = PaperBicycle();
  problem.transitions.z = Eigen::MatrixXd::Zero(1, 8);
  problem.transitions.z(0, 3) = 10;
  problem.transitions.x_next = problem.transitions.z.leftCols(6);
  problem.transitions.x_next(0, 0) = 1;
  const Certifier certifier(std::make_shared<Problem>(problem));
  Tube tube;
  Extender extender(certifier, {}, {}, tube);
  TubeNode node, next;
  const Zonotope start = Zonotope::FromBox(Vec({0, 0, 0, 10, 0, 0}), Eigen::VectorXd::Constant(6, 0.01));
  ASSERT_EQ(extender.Begin(start, node).outcome, Outcome::kNone);
  for (int t = 0; t < 10; ++t) {
    TubeNode longer;
    ASSERT_EQ(extender.Extend(node, std::array{0.1, 0.01}, longer).outcome, Outcome::kNone);
    EXPECT_LE(longer.bytes(), 2048u);
    node = longer;
  }
}

}  // namespace forereach::extender_test
