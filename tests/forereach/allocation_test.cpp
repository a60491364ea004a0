// The certify step uses no heap. This program counts every malloc by putting its own in front of the C library's.
#include "tests/test.h"

#include <atomic>
#include <cstddef>

#include "forereach/certify/batch.h"
#include "forereach/certify/certifier.h"
#include "forereach/certify/pieces.h"
#include "forereach/residual/region_grid.h"
#include "forereach/residual/region_table.h"
#include "forereach/safety/obstacle_index.h"
#include "tests/gap.h"
#include "tests/sanitized.h"
#include "tests/worlds.h"

namespace {
std::atomic<long> allocations{0};
}

#if !FOREREACH_SANITIZED  // the sanitizers own malloc
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* block, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);

void* malloc(std::size_t size) {
  ++allocations;
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
  ++allocations;
  return __libc_calloc(count, size);
}
void* realloc(void* block, std::size_t size) {
  ++allocations;
  return __libc_realloc(block, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  ++allocations;
  return __libc_memalign(alignment, size);
}
}
#endif

namespace forereach::allocation_test {

Problem BicycleProblem() {
  Problem problem = PaperBicycle();
  problem.domain.balls.push_back({{0, 1}, Eigen::Vector2d::Zero(), 39});
  problem.domain.inequalities.push_back({Eigen::VectorXd::Unit(8, 3), 20});
  problem.declaration.lipschitz(2, 3) = 0.02;
  problem.declaration.lipschitz(2, 5) = 0.6;
  problem.transitions.z = Eigen::MatrixXd::Zero(200, 8);
  problem.transitions.z.col(3) = Eigen::VectorXd::LinSpaced(200, 5, 15);
  problem.transitions.x_next = problem.transitions.z.leftCols(6);
  problem.transitions.x_next.col(0) += 0.1 * problem.transitions.z.col(3);
  return problem;
}

struct Allocation : testing::Test {
  void SetUp() override {
    if (FOREREACH_SANITIZED) GTEST_SKIP() << "the sanitizers own malloc";
  }

  // Certifies from (0, 0, 0, v, 0, delta) and returns what that allocated.
  long Count(double v, double delta, const ObstacleView& obstacles, Outcome expected) {
    const Eigen::VectorXd center = (Eigen::VectorXd(6) << 0, 0, 0, v, 0, delta).finished();
    const Zonotope start = Zonotope::FromBox(center, Eigen::VectorXd::Constant(6, 0.01));
    const long before = allocations;
    const Decision decision =
        certifier_->Certify({controls_.data(), 2, 12, 2, {0, 100'000, 0}}, start, obstacles, tube_);
    const long counted = allocations - before;
    EXPECT_EQ(decision.outcome, expected);
    return counted;
  }

  std::optional<Certifier> certifier_{std::make_shared<Problem>(BicycleProblem())};
  Eigen::MatrixXd controls_ = Eigen::MatrixXd::Zero(2, 12);
  Tube tube_;
};

TEST_F(Allocation, CertifyingInPiecesAllocatesNothing) {
  const Plan plan{controls_.data(), 2, 12, 2};
  const Zonotope start = Zonotope::FromBox(Vec({0, 0, 0, 10, 0, 0.1}), Vec({0.1, 0.1, 0.02, 0.4, 0.02, 0.02}));
  const Obstacle obstacle = JustTouched(*certifier_, plan, start);
  const ObstacleView view(std::span(&obstacle, 1));
  const Decision whole = certifier_->Certify(plan, start, view, tube_);
  Pieces pieces;
  const std::function<bool()> goes_on = [] { return true; };
  const long before = allocations;
  const Decision decision = pieces.Certify(*certifier_, plan, start, view, whole, Pieces::kMost, goes_on, tube_);
  EXPECT_EQ(allocations - before, 0);
  EXPECT_EQ(decision.outcome, Outcome::kCertified);
}

TEST_F(Allocation, TheCounterSeesAllocations) {
  const long before = allocations;
  std::vector<double> block(100);
  Eigen::VectorXd vector(static_cast<Eigen::Index>(block.size()));
  vector.setZero();
  volatile double sink = vector.sum() + block[7];
  (void)sink;
  EXPECT_GE(allocations - before, 2) << "a counter that counts nothing proves nothing";
}

TEST_F(Allocation, CertifyAllocatesNothing) {
  std::vector<Obstacle> obstacles{
      Obstacle::Circle(Eigen::Vector2d(10, 8), 1), Obstacle::AxisBox(Eigen::Vector2d(5, 6), Eigen::Vector2d(7, 9)),
      Obstacle::HalfSpace(Eigen::Vector2d(0, 1), 9),
      Obstacle::Polygon({Eigen::Vector2d(5, -9), Eigen::Vector2d(7, -9), Eigen::Vector2d(6, -7)})};
  EXPECT_EQ(Count(10, 0, obstacles, Outcome::kCertified), 0);
  EXPECT_EQ(Count(30, 0, obstacles, Outcome::kDomain), 0);
  obstacles.push_back(Obstacle::Circle(Eigen::Vector2d(6, 0), 1));
  EXPECT_EQ(Count(10, 0.1, obstacles, Outcome::kSafety), 0);
}

TEST_F(Allocation, CertifyAllocatesNothingAmongThousands) {
  std::vector<Obstacle> cells;
  for (int i = 0; i < 2000; ++i) {
    const Eigen::Vector2d corner(i % 50 - 20, 5 + i / 50.0);
    cells.push_back(Obstacle::AxisBox(corner, corner + Eigen::Vector2d(0.5, 0.5)));
    if (i % 2 == 1) cells.back() = cells.back().Moving({.velocity = {0.1, 0, 0}});
  }
  const ObstacleIndex index(cells);
  EXPECT_EQ(Count(10, 0, {cells, index}, Outcome::kCertified), 0);
}

TEST_F(Allocation, CertifyAllocatesNothingForAffineRows) {
  Problem problem = BicycleProblem();
  problem.declaration.lipschitz.setZero();
  problem.declaration.affine = {{2, 3}, {3}};
  certifier_.emplace(std::make_shared<Problem>(problem));
  EXPECT_EQ(Count(10, 0, {}, Outcome::kCertified), 0);
  problem.declaration.affine.rest.setZero(6, 8);
  problem.declaration.affine.rest(3, 5) = 1e-4;
  certifier_.emplace(std::make_shared<Problem>(problem));
  EXPECT_EQ(Count(10, 0, {}, Outcome::kCertified), 0);
}

TEST_F(Allocation, CertifyAllocatesNothingForExpressions) {
  Problem problem = BicycleProblem();
  problem.declaration.growing = Growing(*problem.model, {"0", "0", "0", "1e-4*abs(v*(a - delta))", "0", "0"});
  problem.limits = {{.name = "lateral acceleration", .that = {"v^2*tan(delta)/wheelbase", 1, 1}, .at_most = 4}};
  problem.body.parts = {{{}, 0.5, {{{"x + cos(theta)", 1, 1}, {"y + sin(theta)", 1, 1}}}}};
  certifier_.emplace(std::make_shared<Problem>(problem));
  const std::vector<Obstacle> obstacles{Obstacle::Circle(Eigen::Vector2d(10, 8), 1)};
  EXPECT_EQ(Count(10, 0, obstacles, Outcome::kCertified), 0);
  EXPECT_EQ(Count(10, 0.1, obstacles, Outcome::kSafety), 0);
}

TEST_F(Allocation, CertifyAllocatesNothingForRegions) {
  Problem problem = BicycleProblem();
  Declaration& declaration = problem.declaration;
  declaration.disturbance = Eigen::VectorXd::Constant(6, 1e-4);
  const Eigen::VectorXd less = 0.5 * declaration.disturbance;
  declaration.regions = {{{{4, {-4, 0}}, {5, {-1, 0}}}, 0.5 * declaration.lipschitz, less, {}, less}};
  for (const bool has_table : {false, true}) {
    if (has_table) {
      problem.domain.inequalities.clear();  // no region may be bounded by what one names
      declaration.regions[0].box.insert(declaration.regions[0].box.begin(), {3, {-1, 30}});
    }
    const RegionGrid grid(declaration);
    ASSERT_FALSE(grid.rows().empty());
    for (std::size_t row = 0; row < grid.rows().size(); ++row) EXPECT_EQ(RegionTable::Fits(grid, row), has_table);
    certifier_.emplace(std::make_shared<Problem>(problem));
    EXPECT_EQ(Count(10, 0, {}, Outcome::kCertified), 0);
  }
}

TEST_F(Allocation, ABatchAllocatesNothingForAStep) {
  const Eigen::VectorXd center = (Eigen::VectorXd(6) << 0, 0, 0, 10, 0, 0).finished();
  const Zonotope start = Zonotope::FromBox(center, Eigen::VectorXd::Constant(6, 0.01));
  const auto count = [&](int steps) {
    const std::vector<Plan> plans(20, Plan{controls_.data(), 2, steps, 2});
    const long before = allocations;
    const auto decisions = CertifyAll(*certifier_, plans, std::span(&start, 1), {});
    const long counted = allocations - before;
    EXPECT_EQ(std::ranges::count(decisions, Outcome::kCertified, &Decision::outcome), 20);
    return counted;
  };
  EXPECT_EQ(count(3), count(12));
}

}  // namespace forereach::allocation_test
