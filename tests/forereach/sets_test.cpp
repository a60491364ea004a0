// Boxes, zonotopes and zonogons at their boundaries: refused arguments, degenerate cases, small cases worked by hand.
#include "tests/test.h"

#include <type_traits>

#include "forereach/sets/box.h"
#include "forereach/sets/linear_map.h"
#include "forereach/sets/zonogon.h"
#include "tests/oracle/reduce_order.h"
#include "tests/oracle/traced_random.h"
#include "tests/worlds.h"

namespace forereach::sets_test {

const double kNan = std::numeric_limits<double>::quiet_NaN();

TEST(Box, IsClosed) {
  const Box box(Vec({-1, 2}), Vec({1, 2}));
  EXPECT_TRUE(box.Contains(Vec({-1, 2})));
  EXPECT_TRUE(box.Contains(Vec({1, 2})));
  EXPECT_FALSE(box.Contains(Vec({NextUp(1), 2})));
  EXPECT_FALSE(box.Contains(Vec({NextDown(-1), 2})));
  EXPECT_FALSE(box.Contains(Vec({0, NextUp(2)})));
  EXPECT_FALSE(box.Contains(Vec({0, kNan})));
  EXPECT_FALSE(box.Contains(Vec({0})));
  EXPECT_TRUE(Box().Contains(Vec({})));
}

TEST(Box, RefusesWhatIsNoBox) {
  EXPECT_THAT([] { Box(Vec({0}), Vec({1, 2})); }, ThrowsMessage<std::invalid_argument>(HasSubstr("lower has 1")));
  EXPECT_THAT(
      [] {
        Box(Vec({0, 2}), Vec({1, 1}));
      },
      ThrowsMessage<std::invalid_argument>(HasSubstr("entry 1: [2, 1]")));
  EXPECT_THROW(Box(Vec({kNan}), Vec({1})), std::invalid_argument);
  EXPECT_THROW(Box(Vec({0}), Vec({kInfinity})), std::invalid_argument);
  EXPECT_THROW(Box(Vec({-kInfinity}), Vec({0})), std::invalid_argument);
  EXPECT_THROW(Box::FromCenter(Vec({0}), Vec({-1})), std::invalid_argument);
  EXPECT_THROW(Box::FromCenter(Vec({0}), Vec({1, 1})), std::invalid_argument);
  EXPECT_THROW(Box::FromCenter(Vec({kMaxDouble}), Vec({kMaxDouble})), std::invalid_argument);
}

TEST(Zonotope, RefusesWhatIsNoZonotope) {
  EXPECT_THROW(Zonotope(Vec({0, 0}), Eigen::MatrixXd::Zero(3, 1)), std::invalid_argument);
  EXPECT_THROW(Zonotope(Vec({kNan}), Eigen::MatrixXd::Zero(1, 1)), std::invalid_argument);
  EXPECT_THROW(Zonotope(Vec({0}), Eigen::MatrixXd::Constant(1, 1, kInfinity)), std::invalid_argument);
  EXPECT_THROW(Zonotope(Eigen::VectorXd::Zero(kMaxStates + 1), Eigen::MatrixXd(kMaxStates + 1, 0)),
               std::invalid_argument);
  EXPECT_THROW(Zonotope(Vec({0}), Eigen::MatrixXd::Zero(1, kMaxGenerators + 1)), std::invalid_argument);
  EXPECT_NO_THROW(Zonotope(Eigen::VectorXd::Zero(kMaxStates), Eigen::MatrixXd::Zero(kMaxStates, kMaxGenerators)));
  EXPECT_THROW((void)Zonotope::FromBox(Vec({0}), Vec({-1e-300})), std::invalid_argument);
  EXPECT_THROW((void)Zonotope::FromBox(Vec({0}), Vec({kNan})), std::invalid_argument);
  EXPECT_THROW((void)Zonotope::FromBox(Vec({0}), Vec({kInfinity})), std::invalid_argument);
  EXPECT_THROW((void)Zonotope::FromBox(Vec({0}), Vec({1, 1})), std::invalid_argument);
}

TEST(Zonotope, IsAValueThatNeedsNoHeap) {
  static_assert(std::is_trivially_copyable_v<Zonotope>);
  static_assert(noexcept(std::declval<const Zonotope&>().SupportUpper({})));
  static_assert(noexcept(std::declval<const Zonotope&>().Hull(0)));
  static_assert(noexcept(ReduceOrder(std::declval<Zonotope&>(), 1)));
  EXPECT_EQ(Zonotope().dim(), 0);
  EXPECT_EQ(Zonotope().SupportUpper({}), 0);
}

TEST(Zonotope, FromBoxDropsZeroHalfWidths) {
  const Zonotope set = Zonotope::FromBox(Vec({1, 2, 3}), Vec({0.5, 0, 0.25}));
  EXPECT_EQ(set.CenterVector(), Vec({1, 2, 3}));
  Eigen::MatrixXd expected(3, 2);
  expected << 0.5, 0, 0, 0, 0, 0.25;
  EXPECT_EQ(set.GeneratorMatrix(), expected);
  EXPECT_NEAR(set.Hull(0).lower, 0.5, 1e-15);
  EXPECT_NEAR(set.Hull(0).upper, 1.5, 1e-15);
  EXPECT_EQ(set.Hull(1), Interval(2));
}

TEST(Zonotope, EnclosesBoxesWhoseMiddleIsNoDouble) {
  for (TracedRandom random(311); random.Again(2000);) {
    const Interval side = random.AnyInterval();
    if (!std::isfinite(side.upper - side.lower)) continue;
    const Zonotope set = Zonotope::Enclose(Box(Vec({side.lower}), Vec({side.upper})));
    ASSERT_LE(set.Hull(0).lower, side.lower);
    ASSERT_GE(set.Hull(0).upper, side.upper);
  }
}

Eigen::MatrixXd WithoutZeroColumns(const Eigen::MatrixXd& generators) {
  Eigen::MatrixXd nonzero(generators.rows(), 0);
  for (const auto column : generators.colwise()) {
    if (column.isZero(0)) continue;
    nonzero.conservativeResize(Eigen::NoChange, nonzero.cols() + 1);
    nonzero.rightCols(1) = column;
  }
  return nonzero;
}

// The columns that reduction keeps and boxes, by their definition; small integers, so nothing rounds.
Eigen::MatrixXd Reduced(const Eigen::MatrixXd& all, int order) {
  if (all.cols() <= order * all.rows()) return all;
  const Eigen::MatrixXd generators = WithoutZeroColumns(all);
  const Eigen::Index n = generators.rows(), m = generators.cols(), kept = (order - 1) * n;
  if (m <= order * n) return generators;
  std::vector<Eigen::Index> columns(static_cast<std::size_t>(m));
  for (Eigen::Index j = 0; j < m; ++j) columns[static_cast<std::size_t>(j)] = j;
  const auto score = [&](Eigen::Index j) {
    return generators.col(j).lpNorm<1>() - generators.col(j).lpNorm<Eigen::Infinity>();
  };
  std::stable_sort(columns.begin(), columns.end(), [&](auto a, auto b) { return score(a) > score(b); });
  std::sort(columns.begin(), columns.begin() + kept);
  Eigen::MatrixXd reduced(n, kept);
  for (Eigen::Index j = 0; j < kept; ++j) reduced.col(j) = generators.col(columns[static_cast<std::size_t>(j)]);
  Eigen::VectorXd boxed = Eigen::VectorXd::Zero(n);
  for (auto column = columns.begin() + kept; column != columns.end(); ++column)
    boxed += generators.col(*column).cwiseAbs();
  for (Eigen::Index k = 0; k < n; ++k) {
    if (boxed[k] == 0) continue;
    reduced.conservativeResize(n, reduced.cols() + 1);
    reduced.rightCols(1) = boxed[k] * Eigen::VectorXd::Unit(n, k);
  }
  return reduced;
}

bool HasColumn(const Eigen::MatrixXd& generators, const Eigen::VectorXd& wanted) {
  for (const auto column : generators.colwise())
    if (column == wanted) return true;
  return false;
}

TEST(ReduceOrder, KeepsTheBestColumnsAndTheEarlierOfEquals) {
  for (TracedRandom random(312); random.Again(3000);) {
    const int n = random.Integer(1, 6), order = random.Integer(1, 5);
    const int m = random.Integer(0, std::min(kMaxGenerators, (order + 3) * n));
    const Eigen::MatrixXd generators = Eigen::MatrixXd::NullaryExpr(n, m, [&] { return random.Integer(-2, 2); });
    Zonotope set(Eigen::VectorXd::Zero(n), generators);
    ReduceOrder(set, order);
    const Eigen::MatrixXd expected = Reduced(generators, order), result = set.GeneratorMatrix();
    ASSERT_EQ(result.cols(), expected.cols());
    ASSERT_LE(result.cols(), std::max(order * n, 0));
    ASSERT_TRUE((result - expected).isZero(1e-11)) << result << "\n\n" << expected;
    for (const auto column :
         expected.leftCols(std::min(expected.cols(), static_cast<Eigen::Index>((order - 1) * n))).colwise())
      ASSERT_TRUE(HasColumn(result, column)) << "a kept column is kept to the last bit";
  }
}

TEST(ReduceOrder, ChangesNothingUpToOrderTimesDimension) {
  TracedRandom random(313);
  for (int order = 1; order <= 5; ++order) {
    const Eigen::MatrixXd generators = random.Matrix(4, order * 4 + 1);
    Zonotope full(Eigen::VectorXd::Zero(4), generators.leftCols(order * 4)), over(Eigen::VectorXd::Zero(4), generators);
    ReduceOrder(full, order);
    EXPECT_EQ(full.GeneratorMatrix(), generators.leftCols(order * 4));
    ReduceOrder(over, order);
    EXPECT_EQ(over.num_generators(), order * 4);
    EXPECT_NE(over.GeneratorMatrix(), generators.leftCols(order * 4));
  }
}

// Steps whose map J has J e_k = e_k for some k: the slack holds the columns along these, and all sets are those of
// columns that are kept apart.
TEST(ReduceOrder, AxesInTheSlackAreTheSameSetAsColumns) {
  TracedRandom random(315);
  int held = 0, dropped = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const int n = random.Integer(2, 6), order = random.Integer(2, 5);
    unsigned lasting = 0;
    for (int k = 0; k < n; ++k) lasting |= random.Coin() ? 1u << k : 0;
    const bool has_rests = random.Coin();  // some steps have nothing to add along an axis
    Eigen::MatrixXd columns = random.Matrix(n, random.Integer(1, n));
    Zonotope set(Eigen::VectorXd::Zero(n), columns);
    for (int step = 0; step < 15; ++step) {
      std::array<std::array<double, kMaxStates>, 2> lengths{};
      for (int which = 0; which < 2; ++which)
        for (int k = 0; k < n; ++k) {
          if (has_rests && random.Coin(0.3)) continue;
          const double length = random.Uniform(0.01, 1);
          lengths[ToSize(which)][ToSize(k)] = length;
          columns.conservativeResize(n, columns.cols() + 1);
          columns.rightCols(1) = length * Eigen::VectorXd::Unit(n, k);
        }
      const Eigen::Index before = columns.cols();
      columns = Reduced(columns, order);
      dropped += static_cast<int>(before - columns.cols());
      AppendAndReduce(set, lengths[0].data(), lengths[1].data(), order, lasting);
      ASSERT_EQ(set.num_generators() + set.axes_in_slack().count, columns.cols()) << "step " << step;
      held += set.axes_in_slack().count;
      for (int probe = 0; probe < 5; ++probe) {
        const Eigen::VectorXd d = random.Matrix(n, 1);
        const double support = (d.transpose() * columns).cwiseAbs().sum();
        ASSERT_NEAR(set.SupportUpper({d.data(), ToSize(n)}), support, 1e-12 * support) << "step " << step;
      }
      Eigen::MatrixXd map = random.Matrix(n, n);
      for (int k = 0; k < n; ++k)
        if (lasting >> k & 1) map.col(k) = Eigen::VectorXd::Unit(n, k);
      columns = (map * columns).eval();
      const ZonotopeArrays slice = ArraysOf(set);
      set = Zonotope(set.CenterVector(), map * set.GeneratorMatrix().leftCols(set.num_generators()));
      ArraysOf(set).mutable_axes_in_slack() = slice.axes_in_slack();
      for (int k = 0; k < n; ++k) ArraysOf(set).mutable_slack(k) = slice.slacks()[k];
    }
  }
  EXPECT_GT(held, 1000);
  EXPECT_GT(dropped, 1000);
}

TEST(LinearMap, RowsThatCopyACoordinateAreExact) {
  TracedRandom random(314);
  const Zonotope set = random.AnyZonotope(4, 9);
  const MatrixEntry entries[] = {{0, 2, Interval(1)}, {1, 0, Interval(-1)}};
  Zonotope image;
  EncloseLinearImage(entries, set, HalfWidths(set), 2, image);
  ASSERT_EQ(image.num_generators(), 9) << "no error, so no generator for it";
  EXPECT_FIELDS(image, (center(0), set.center(2)), (center(1), -set.center(0)),
                (GeneratorMatrix().row(0), set.GeneratorMatrix().row(2)),
                (GeneratorMatrix().row(1), -set.GeneratorMatrix().row(0)));
}

TEST(LinearMap, MapsAPointToAPoint) {
  const Zonotope point(Vec({2, 3}), Eigen::MatrixXd(2, 0));
  const MatrixEntry entries[] = {{0, 0, Interval(0.5)}, {0, 1, Interval(2)}};
  Zonotope image;
  EncloseLinearImage(entries, point, HalfWidths(point), 1, image);
  EXPECT_FIELDS(image, (center(0), 7), (num_generators(), 0));
}

TEST(Outline, HasTheCornersOfAPointASegmentAndASquare) {
  EXPECT_EQ(Outline(Zonotope(Vec({1, 2}), Eigen::MatrixXd(2, 0))).size(), 1u);
  Eigen::MatrixXd segment(2, 2);
  segment << 1, 0, 1, 0;
  EXPECT_THAT(Outline(Zonotope(Vec({0, 0}), segment)),
              UnorderedElementsAre(Eigen::Vector2d(1, 1), Eigen::Vector2d(-1, -1)));
  EXPECT_THAT(Outline(Zonotope(Vec({0, 0}), Eigen::MatrixXd::Identity(2, 2))),
              UnorderedElementsAre(Eigen::Vector2d(1, 1), Eigen::Vector2d(-1, 1), Eigen::Vector2d(-1, -1),
                                   Eigen::Vector2d(1, -1)));
}

double Cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

// Integers, so the brute force over all sign vectors is exact.
TEST(Outline, IsTheHullOfAllSignVectors) {
  for (TracedRandom random(315); random.Again(500);) {
    const int m = random.Integer(1, 7);
    const Eigen::MatrixXd generators = Eigen::MatrixXd::NullaryExpr(2, m, [&] { return random.Integer(-4, 4); });
    const Eigen::Vector2d center(random.Integer(-9, 9), random.Integer(-9, 9));
    const auto outline = Outline(Zonotope(center, generators));
    if (generators.isZero(0)) {
      ASSERT_EQ(outline.size(), 1u);
      continue;
    }
    ASSERT_GE(outline.size(), 2u);
    double area = 0;
    for (std::size_t i = 0; i < outline.size(); ++i) {
      const Eigen::Vector2d &a = outline[i], &b = outline[(i + 1) % outline.size()];
      area += Cross(a, b) / 2;
      for (int signs = 0; signs < 1 << m; ++signs) {
        Eigen::Vector2d point = center;
        for (int j = 0; j < m; ++j) point += (signs >> j & 1 ? 1 : -1) * generators.col(j);
        ASSERT_GE(Cross(b - a, point - a), -1e-9) << "a point outside, or corners clockwise";
      }
    }
    // The area of a zonogon: 4 sum |g_i x g_j|. No smaller polygon contains all points and no larger one has this area.
    double expected = 0;
    for (int i = 0; i < m; ++i)
      for (int j = 0; j < i; ++j) expected += 4 * std::abs(Cross(generators.col(i), generators.col(j)));
    ASSERT_NEAR(area, expected, 1e-9);
  }
}

}  // namespace forereach::sets_test
