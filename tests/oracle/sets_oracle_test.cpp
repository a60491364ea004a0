// Zonotope bounds against exact rationals.
#include "tests/test.h"

#include "forereach/sets/linear_map.h"
#include "forereach/sets/zonogon.h"
#include "tests/oracle/exact.h"
#include "tests/oracle/reduce_order.h"
#include "tests/oracle/traced_random.h"

namespace forereach::sets_oracle_test {

// Random generators, some tiny, huge, parallel, axis-aligned or zero.
Zonotope Adversarial(Random& random, int dim, int num_generators) {
  Eigen::MatrixXd generators = random.Matrix(dim, num_generators);
  for (int j = 0; j < num_generators; ++j) {
    switch (random.Below(8)) {
      case 0: generators.col(j) *= 1e-300; break;
      case 1: generators.col(j) *= 1e-17; break;
      case 2: generators.col(j) *= 1e6; break;
      case 3: generators.col(j) = random.Uniform(-1, 1) * Eigen::VectorXd::Unit(dim, random.Below(dim)); break;
      case 4:
        if (j > 0) generators.col(j) = -generators.col(j - 1) * random.Uniform(0.5, 2);
        break;
      case 5: generators.col(j).setZero(); break;
      default: break;
    }
  }
  return Zonotope(random.Vector(dim, std::ldexp(1, random.Integer(-10, 10))), generators);
}

// Random directions, the axes, and normals of pairs of generators, where supports tie.
std::vector<Eigen::VectorXd> Directions(Random& random, const Zonotope& set) {
  const int n = set.dim();
  std::vector<Eigen::VectorXd> directions;
  for (int k = 0; k < n; ++k) directions.push_back(random.Sign() * Eigen::VectorXd::Unit(n, k));
  for (int i = 0; i < 6; ++i) directions.push_back(random.Vector(n));
  for (int i = 0; i < 4 && n > 1 && set.num_generators() > 0; ++i) {
    const int j = random.Below(set.num_generators()), k = random.Below(n - 1);
    Eigen::VectorXd normal = Eigen::VectorXd::Zero(n);
    normal[k] = -set.generator(k + 1, j);
    normal[k + 1] = set.generator(k, j);
    directions.push_back(normal);
  }
  return directions;
}

TEST(ZonotopeOracle, SupportAndHalfWidthsAreNeverBelowTheExactOnes) {
  int plain_below = 0, trials = 0;
  for (TracedRandom random(401); random.Again(3000);) {
    const Zonotope set = Adversarial(random, random.Integer(1, 6), random.Integer(0, 30));
    for (int k = 0; k < set.dim(); ++k) {
      const Rational half = exact::HalfWidth(set, k);
      ASSERT_LE(half, Rational(set.HalfWidthUpper(k)));
      ASSERT_LE(Rational(set.HalfWidthUpper(k)), half * Rational(1 + 1e-13) + Rational(0x1p-1070));
    }
    for (const Eigen::VectorXd& d : Directions(random, set)) {
      const Rational support = exact::Support(set, View(d));
      ASSERT_LE(support, Rational(set.SupportUpper(View(d))));
      const double plain = d.dot(set.CenterVector()) + (d.transpose() * set.GeneratorMatrix()).lpNorm<1>();
      plain_below += Rational(plain) < support;
      ++trials;
    }
  }
  EXPECT_GT(plain_below, trials / 10) << "these inputs have to be such that plain arithmetic fails";
}

TEST(ZonotopeOracle, SupportIsTight) {
  for (TracedRandom random(402); random.Again(1000);) {
    const Zonotope set = random.AnyZonotope(random.Integer(1, 6), random.Integer(0, 30));
    const Eigen::VectorXd d = random.Vector(set.dim());
    ASSERT_NEAR(set.SupportUpper(View(d)), exact::Support(set, View(d)).get_d(), 1e-12);
  }
}

TEST(ZonotopeOracle, SupportHoldsAtTheEndsOfTheDoubles) {
  for (TracedRandom random(403); random.Again(3000);) {
    const int n = random.Integer(1, 4), m = random.Integer(0, 6);
    const auto any = [&] { return random.Double(); };
    const Zonotope set(Eigen::VectorXd::NullaryExpr(n, any), Eigen::MatrixXd::NullaryExpr(n, m, any));
    const Eigen::VectorXd d = Eigen::VectorXd::NullaryExpr(n, any);
    const double upper = set.SupportUpper(View(d));
    // NaN is no bound, and no comparison takes it for one.
    ASSERT_TRUE(std::isnan(upper) || AtMost(exact::Support(set, View(d)), upper)) << upper;
    for (int k = 0; k < n; ++k) ASSERT_TRUE(AtMost(exact::HalfWidth(set, k), set.HalfWidthUpper(k)));
  }
}

TEST(ZonotopeOracle, ReducedSetsContainTheOriginal) {
  for (TracedRandom random(404); random.Again(1500);) {
    const int n = random.Integer(1, 6), order = random.Integer(1, 4);
    const Zonotope set = Adversarial(random, n, random.Integer(order * n, (order + 2) * n + 1));
    Zonotope reduced = set;
    ReduceOrder(reduced, order);
    ASSERT_EQ(reduced.CenterVector(), set.CenterVector());
    for (const Eigen::VectorXd& d : Directions(random, set))
      ASSERT_GE(exact::Support(reduced, View(d)), exact::Support(set, View(d)));
    for (int k = 0; k < n; ++k)  // Along the axes a box loses nothing but rounding.
      ASSERT_LE(exact::HalfWidth(reduced, k), exact::HalfWidth(set, k) * Rational(1 + 1e-13) + Rational(0x1p-1070));
  }
}

// The size of such a column is infinite, that of the set is not.
TEST(ZonotopeOracle, ReducesColumnsWhoseSizesOverflow) {
  for (TracedRandom random(405); random.Again(200);) {
    Eigen::MatrixXd generators = random.Matrix(6, 13);
    for (int huge = 0; huge < 4; ++huge)
      generators.col(3 * huge + random.Below(3)) =
          0.4e308 * Eigen::VectorXd::NullaryExpr(6, [&] { return random.Sign(); });
    const Zonotope set(Eigen::VectorXd::Zero(6), generators);
    for (int order = 1; order <= 2; ++order) {
      Zonotope reduced = set;
      ReduceOrder(reduced, order);
      ASSERT_LE(reduced.num_generators(), order * 6);
      for (const Eigen::VectorXd& d : Directions(random, set))
        ASSERT_GE(exact::Support(reduced, View(d)), exact::Support(set, View(d)));
    }
  }
}

struct IntervalMatrix {
  std::vector<MatrixEntry> entries;
  int rows, columns;
};

IntervalMatrix AnyMatrix(Random& random, int rows, int columns) {
  IntervalMatrix matrix{{}, rows, columns};
  for (int k = 0; k < rows; ++k)
    for (int l = 0; l < columns; ++l) {
      if (random.Coin(0.4)) continue;
      const double lower = random.Coin(0.3) ? random.Sign() : random.Uniform(-2, 2) * (random.Coin(0.1) ? 1e-310 : 1);
      const double width = random.Coin() ? 0 : std::ldexp(1, -random.Integer(1, 60));
      matrix.entries.push_back({k, l, {lower, lower + width}});
    }
  return matrix;
}

// A matrix inside, at a corner more often than not.
std::vector<Rational> Sample(Random& random, const IntervalMatrix& matrix) {
  std::vector<Rational> sample(static_cast<std::size_t>(matrix.rows * matrix.columns), Rational(0));
  for (const auto& [row, column, value] : matrix.entries) {
    const double t = random.Coin(0.8) ? random.Below(2) : random.Uniform(0, 1);
    sample[static_cast<std::size_t>(row * matrix.columns + column)] =
        Rational(value.lower) + Rational(t) * (Rational(value.upper) - Rational(value.lower));
  }
  return sample;
}

// Everything the exact image reaches beyond the part of the computed one that belongs to the set's generators has to
// lie within the axes appended for errors.
TEST(LinearMapOracle, ErrorAxesCoverEveryMatrixInside) {
  for (TracedRandom random(405); random.Again(2000);) {
    const int n = random.Integer(1, 6), rows = random.Integer(1, 4), m = random.Integer(0, 20);
    const Zonotope set = Adversarial(random, n, m);
    const IntervalMatrix matrix = AnyMatrix(random, rows, n);
    Zonotope image;
    EncloseLinearImage(matrix.entries, set, HalfWidths(set), rows, image);
    for (int sampled = 0; sampled < 3; ++sampled) {
      const std::vector<Rational> exact_matrix = Sample(random, matrix);
      for (int k = 0; k < rows; ++k) {
        const auto map = [&](auto entry) {
          Rational sum = 0;
          for (int l = 0; l < n; ++l) sum += exact_matrix[static_cast<std::size_t>(k * n + l)] * Rational(entry(l));
          return sum;
        };
        Rational beyond = abs(map([&](int l) { return set.center(l); }) - Rational(image.center(k)));
        for (int j = 0; j < m; ++j)
          beyond += abs(map([&](int l) { return set.generator(l, j); }) - Rational(image.generator(k, j)));
        ASSERT_LE(beyond, Rational(image.slack(k))) << "row " << k;
      }
    }
  }
}

TEST(LinearMapOracle, PointMatricesAddOnlyRounding) {
  for (TracedRandom random(406); random.Again(300);) {
    const Zonotope set = random.AnyZonotope(5, 12);
    std::vector<MatrixEntry> entries;
    for (int k = 0; k < 3; ++k)
      for (int l = 0; l < 5; ++l) entries.push_back({k, l, Interval(random.Uniform(-2, 2))});
    Zonotope image;
    EncloseLinearImage(entries, set, HalfWidths(set), 3, image);
    for (int k = 0; k < 3; ++k) ASSERT_LE(image.slack(k), 1e-12);
  }
}

TEST(ZonogonOracle, RadiusIsTheFarthestCorner) {
  for (TracedRandom random(407); random.Again(600);) {
    const int dim = random.Integer(1, 3), m = random.Integer(0, 9);
    const Zonotope set = random.Coin() ? random.AnyZonotope(dim, m) : Adversarial(random, dim, m);
    Rational farthest = 0;  // squared
    for (int signs = 0; signs < 1 << m; ++signs) {
      Rational square = 0;
      for (int k = 0; k < dim; ++k) {
        Rational offset = 0;
        for (int j = 0; j < m; ++j) offset += (signs >> j & 1 ? 1 : -1) * Rational(set.generator(k, j));
        square += offset * offset;
      }
      farthest = std::max(farthest, square);
    }
    const Rational radius(RadiusUpper(set));
    ASSERT_LE(farthest, radius * radius);
    if (dim <= 2 && farthest > Rational(1e-200)) ASSERT_LE(radius * radius, farthest * Rational(1 + 2e-11));
  }
}

TEST(ZonogonOracle, RadiusOfManyNearlyParallelGeneratorsIsTheFarthestCorner) {
  for (TracedRandom random(408); random.Again(100);) {
    const int m = 10;
    const double angle = random.Uniform(0, 3.2);
    Eigen::MatrixXd generators(2, m);
    for (int j = 0; j < m; ++j) {
      const double turned = angle + std::ldexp(random.Uniform(-1, 1), -random.Integer(40, 56));
      generators.col(j) = random.Sign() * random.Uniform(0, 2) * Eigen::Vector2d(std::cos(turned), std::sin(turned));
    }
    const Zonotope set(Eigen::Vector2d::Zero(), generators);
    Rational farthest = 0;
    for (int signs = 0; signs < 1 << m; ++signs) {
      Rational x = 0, y = 0;
      for (int j = 0; j < m; ++j) {
        const int sign = signs >> j & 1 ? 1 : -1;
        x += sign * Rational(set.generator(0, j));
        y += sign * Rational(set.generator(1, j));
      }
      farthest = std::max(farthest, Rational(x * x + y * y));
    }
    const Rational radius(RadiusUpper(set));
    ASSERT_LE(farthest, radius * radius);
    ASSERT_LE(radius * radius, farthest * Rational(1 + 2e-11));
  }
}

}  // namespace forereach::sets_oracle_test
