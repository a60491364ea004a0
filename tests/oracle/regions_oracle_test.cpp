// Regions against rationals: residuals that use up what L and the regions allow, on the cheapest ways between many
// points, stay within the bounds.
#include "tests/test.h"

#include "forereach/certify/tube.h"
#include "forereach/residual/regional_enclosure.h"
#include "tests/oracle/admissible.h"
#include "tests/oracle/region_problems.h"
#include "tests/oracle/traced_random.h"

namespace forereach::regions_oracle_test {

using exact::Rational;

constexpr double kReach = 2;  // of the domain, in each variable

struct Nothing final : ResidualEnclosure {
  void Enclose(const QuerySet&, ResidualBounds& bounds) const noexcept override {
    bounds.lower.fill(-kInfinity);
    bounds.upper.fill(kInfinity);
  }
};

struct Scene {
  int variables;
  Declaration declaration;
  Observations observations;
  std::vector<double> lower, upper;  // of the domain
};

double AnyPlace(Random& random) { return random.Coin(0.3) ? random.Integer(-2, 2) : random.Uniform(-kReach, kReach); }

Scene AnyScene(Random& random) {
  Scene scene{random.Integer(1, 3), {}, {}, {}, {}};
  const int d = scene.variables;
  scene.lower.assign(static_cast<std::size_t>(d), -kReach);
  scene.upper.assign(static_cast<std::size_t>(d), kReach);
  Declaration& declaration = scene.declaration;
  declaration.lipschitz = Eigen::MatrixXd::Zero(d, d);
  for (int l = 0; l < d; ++l) declaration.lipschitz(0, l) = random.Coin(0.1) ? 0 : random.Uniform(0, 1);
  declaration.noise_bound = Eigen::VectorXd::Zero(d);
  AddRegions(random, declaration, Eigen::VectorXd::Constant(d, kReach), random.Integer(1, 4));
  return scene;
}

// A residual that is admissible for the regions, from some sources.
RegionalFunction<Rational> AnyTruth(Random& random, const Scene& scene) {
  std::vector<int> all;
  for (int l = 0; l < scene.variables; ++l) all.push_back(l);
  RegionalFunction<Rational> truth(scene.declaration, 0, all, scene.lower, scene.upper, scene.observations.z,
                                   random.Sign());
  for (int s = random.Integer(1, 4); s > 0; --s) truth.SetAnyNode(random, Rational(random.Uniform(-1, 1)));
  truth.Spread();
  return truth;
}

TEST(RegionsOracle, EveryResidualWithinTheRegionsLiesWithinTheBounds) {
  int narrower = 0, touched = 0, sloped = 0;
  for (TracedRandom random(2101); random.Again(400);) {
    SCOPED_TRACE("trial " + std::to_string(random.trial()));
    Scene scene = AnyScene(random);
    const int d = scene.variables, count = random.Integer(1, 3);
    scene.observations = {Eigen::MatrixXd(count, d), Eigen::MatrixXd::Zero(count, d), Eigen::MatrixXd::Zero(count, d)};
    for (int i = 0; i < count; ++i)
      for (int l = 0; l < d; ++l) scene.observations.z(i, l) = AnyPlace(random);
    const RegionalFunction<Rational> truth = AnyTruth(random, scene);
    for (int i = 0; i < count; ++i) {
      const Eigen::VectorXd z = scene.observations.z.row(i);
      const Rational value = truth({z.begin(), z.end()});
      scene.observations.lower(i, 0) = exact::Floor(value);
      scene.observations.upper(i, 0) = exact::Ceiling(value);
    }
    const Nothing nothing;
    const RegionalEnclosure regional(scene.declaration, scene.observations, scene.lower, scene.upper, nothing);
    Declaration plain = scene.declaration;
    plain.regions = {{{{0, {-kReach, kReach}}}, 0.999 * plain.lipschitz}};
    const RegionalEnclosure everywhere(plain, scene.observations, scene.lower, scene.upper, nothing);
    ASSERT_FALSE(regional.violation()) << "rounding makes no contradiction";
    if (regional.grid().rows().empty()) continue;
    for (int query = 0; query < 5; ++query) {
      Eigen::VectorXd center(d), width(d);
      for (int l = 0; l < d; ++l) {
        center[l] = AnyPlace(random);
        width[l] = random.Coin(0.3) ? 0 : random.Uniform(0, 1) * (kReach - std::abs(center[l]));
      }
      const Zonotope slice = Zonotope::FromBox(center, width);
      ResidualBounds bounds, wide;
      regional.Enclose({slice, {}, {width.data(), static_cast<std::size_t>(d)}}, bounds);
      everywhere.Enclose({slice, {}, {width.data(), static_cast<std::size_t>(d)}}, wide);
      ASSERT_LE(bounds.lower[0], bounds.upper[0]);
      sloped += bounds.has_slope;
      narrower += bounds.upper[0] - bounds.lower[0] < 0.9 * (wide.upper[0] - wide.lower[0]);
      for (int sample = 0; sample < 12; ++sample) {
        std::vector<Rational> z;
        for (int l = 0; l < d; ++l)
          z.push_back(Rational(center[l]) +
                      Rational(width[l]) * Rational(random.Coin() ? random.Sign() : random.Uniform(-1, 1)));
        Rational value = truth(z);
        for (std::size_t l = 0; l < z.size() && bounds.has_slope; ++l)
          value -= Rational(bounds.slope[0][l]) * (z[l] - Rational(center[static_cast<Eigen::Index>(l)]));
        ASSERT_TRUE(exact::Inside(value, {bounds.lower[0], bounds.upper[0]})) << "no tolerance";
        touched +=
            Rational(bounds.upper[0] - value).get_d() < 1e-12 || Rational(value - bounds.lower[0]).get_d() < 1e-12;
      }
    }
  }
  EXPECT_GT(narrower, 200);
  EXPECT_GT(sloped, 20);
  EXPECT_GT(touched, 200) << "the residuals use up what is allowed";
}

// The cost by every order of the moves, in rationals: of a point, along each variable with the slopes of the regions in
// which all of the piece lies.
class Costs {
 public:
  Costs(const Scene& scene, std::vector<double> from, std::vector<double> lower, std::vector<double> upper)
      : scene_(scene), from_(std::move(from)), lower_(std::move(lower)), upper_(std::move(upper)) {}

  Rational Least() const {
    std::vector<int> order;
    for (int l = 0; l < scene_.variables; ++l) order.push_back(l);
    std::optional<Rational> least;
    do {
      // Those without a region move together: any order in which they are next to each other does.
      const Rational cost = Of(order);
      if (!least || cost < *least) least = cost;
    } while (std::ranges::next_permutation(order).found);
    return *least;
  }

 private:
  Rational Of(const std::vector<int>& order) const {
    std::vector<std::pair<double, double>> box;
    for (const double at : from_) box.emplace_back(at, at);
    Rational sum = 0;
    for (const int l : order) {
      const auto at = static_cast<std::size_t>(l);
      Rational farthest = 0;
      for (const double end : {lower_[at], upper_[at]}) farthest = std::max(farthest, Along(box, l, end));
      sum += farthest;
      box[at] = {lower_[at], upper_[at]};
    }
    return sum;
  }
  // From from_[l] to `end`, in pieces between all sides of regions.
  Rational Along(const std::vector<std::pair<double, double>>& box, int l, double end) const {
    std::vector<double> ticks{from_[static_cast<std::size_t>(l)], end};
    for (const double side : Sides(l))
      if (std::min(ticks[0], end) < side && side < std::max(ticks[0], end)) ticks.push_back(side);
    std::ranges::sort(ticks);
    Rational sum = 0;
    for (std::size_t i = 0; i + 1 < ticks.size(); ++i) {
      std::vector<std::pair<double, double>> piece = box;
      piece[static_cast<std::size_t>(l)] = {ticks[i], ticks[i + 1]};
      sum += Rational(Largest(piece, l, 0)) * (Rational(ticks[i + 1]) - Rational(ticks[i]));
    }
    return sum;
  }
  std::vector<double> Sides(int l) const {
    std::vector<double> sides;
    for (const Region& region : scene_.declaration.regions)
      for (const auto& [variable, range] : region.box)
        if (variable == l) sides.insert(sides.end(), {range.lower, range.upper});
    std::ranges::sort(sides);
    return sides;
  }
  // The largest slope over a box: it is halved at sides that lie in it.
  double Largest(std::vector<std::pair<double, double>> box, int l, int m) const {
    if (m == scene_.variables) {
      double slope = scene_.declaration.lipschitz(0, l);
      for (const Region& region : scene_.declaration.regions)
        if (std::ranges::all_of(region.box, [&](const Region::Side& side) {
              const auto& [lower, upper] = box[static_cast<std::size_t>(side.variable)];
              return side.range.lower <= lower && upper <= side.range.upper;
            }))
          slope = std::min(slope, region.lipschitz(0, l));
      return slope;
    }
    const auto [lower, upper] = box[static_cast<std::size_t>(m)];
    for (const double side : Sides(m)) {
      if (!(lower < side && side < upper)) continue;
      std::vector<std::pair<double, double>> below = box, above = box;
      below[static_cast<std::size_t>(m)].second = above[static_cast<std::size_t>(m)].first = side;
      return std::max(Largest(below, l, m), Largest(above, l, m));
    }
    return Largest(box, l, m + 1);
  }

  const Scene& scene_;
  std::vector<double> from_, lower_, upper_;
};

TEST(RegionsOracle, TheCostIsThatOfTheCheapestOrderRoundedUp) {
  int compared = 0;
  for (TracedRandom random(2102); random.Again(1500);) {
    SCOPED_TRACE("trial " + std::to_string(random.trial()));
    const Scene scene = AnyScene(random);
    const RegionGrid grid(scene.declaration, scene.lower, scene.upper);
    // All variables have regions, so that each of them is a move of its own.
    if (grid.rows().empty() || static_cast<int>(grid.variables().size()) != scene.variables) continue;
    RegionGrid::Box from, to;
    std::vector<double> at, lower, upper;
    for (std::size_t l = 0; l < static_cast<std::size_t>(scene.variables); ++l) {
      at.push_back(AnyPlace(random));
      lower.push_back(AnyPlace(random));
      upper.push_back(random.Coin(0.3) ? lower[l] : random.Uniform(lower[l], kReach));
      from.lower[l] = from.upper[l] = at[l];
      to.lower[l] = lower[l], to.upper[l] = upper[l];
    }
    const bool on_a_side = std::ranges::any_of(scene.declaration.regions, [&](const Region& region) {
      return std::ranges::any_of(region.box, [&](const Region::Side& side) {
        const auto l = static_cast<std::size_t>(side.variable);
        const auto is_side = [&](double x) { return side.range.lower == x || side.range.upper == x; };
        return is_side(at[l]) || (lower[l] == upper[l] && is_side(lower[l]));
      });
    });
    grid.Find(from);
    grid.Find(to);
    const double cost = grid.CostUpper(0, from, to);
    const Rational least = Costs(scene, at, lower, upper).Least();
    ASSERT_TRUE(exact::AtMost(least, cost)) << "no tolerance";
    if (on_a_side) continue;  // there the grid takes the slopes of one of the strips
    ++compared;
    EXPECT_LE(cost, least.get_d() * (1 + 1e-14) + 1e-300);
  }
  EXPECT_GT(compared, 500);
}

// A table of the first row, in a domain of that reach.
struct Tabled {
  Tabled(const Declaration& declaration, double reach)
      : lower(static_cast<std::size_t>(declaration.lipschitz.cols()), -reach),
        upper(lower.size(), reach),
        grid(declaration, lower, upper),
        table(grid, 0, lower, upper) {}

  void Add(std::span<const double> z, double floor, double ceiling) {
    table.Add(0, z, floor, ceiling);
    table.Spread();
  }
  Interval Over(const std::vector<double>& from, const std::vector<double>& to) const {
    RegionGrid::Box box;
    std::ranges::copy(from, box.lower.begin());
    std::ranges::copy(to, box.upper.begin());
    return table.Enclose(box).plain;
  }

  const std::vector<double> lower, upper;
  const RegionGrid grid;
  RegionTable table;
};

TEST(RegionsOracle, TheTableHoldsRelativeToEverySlope) {
  int touched = 0;
  for (TracedRandom random(2106); random.Again(300);) {
    SCOPED_TRACE("trial " + std::to_string(random.trial()));
    Scene scene = AnyScene(random);
    const auto d = static_cast<std::size_t>(scene.variables);
    scene.observations.z = Eigen::MatrixXd(2, scene.variables);
    for (double& at : scene.observations.z.reshaped()) at = AnyPlace(random);
    const RegionGrid grid(scene.declaration, scene.lower, scene.upper);
    if (grid.rows().empty() || !RegionTable::Fits(grid, 0)) continue;
    const RegionalFunction<Rational> truth = AnyTruth(random, scene);
    Tabled tabled(scene.declaration, kReach);
    for (const auto z : scene.observations.z.rowwise()) {
      const Eigen::VectorXd at = z;
      const Rational value = truth({at.begin(), at.end()});
      tabled.Add({at.data(), d}, exact::Floor(value), exact::Ceiling(value));
    }
    for (int query = 0; query < 10; ++query) {
      RegionGrid::Box box;
      RegionTable::Tilt tilt{};
      for (std::size_t l = 0; l < d; ++l) {
        box.lower[l] = AnyPlace(random);
        box.upper[l] = random.Coin(0.3) ? box.lower[l] : std::max(box.lower[l], AnyPlace(random));
      }
      for (std::size_t a = 0; a < grid.variables().size(); ++a) {
        const int l = grid.variables()[a];
        const auto at = static_cast<std::size_t>(l);
        tilt.slope[a] = random.Coin(0.3) ? random.Sign() * scene.declaration.lipschitz(0, l) : random.Uniform(-2, 2);
        tilt.center[a] = random.Uniform(box.lower[at], box.upper[at]);
      }
      const auto [plain, bounds, same] = tabled.table.Enclose(box, tilt);
      for (int sample = 0; sample < 12; ++sample) {
        std::vector<Rational> z;
        for (std::size_t l = 0; l < d; ++l) {
          const double share = random.Coin() ? random.Below(2) : random.Uniform(0, 1);
          z.push_back(Rational(box.lower[l]) + (Rational(box.upper[l]) - Rational(box.lower[l])) * Rational(share));
        }
        Rational value = truth(z);
        for (std::size_t a = 0; a < grid.variables().size(); ++a)
          value -=
              Rational(tilt.slope[a]) * (z[static_cast<std::size_t>(grid.variables()[a])] - Rational(tilt.center[a]));
        ASSERT_TRUE(exact::Inside(value, bounds)) << "no tolerance";
        touched += Rational(bounds.upper - value).get_d() < 1e-12 || Rational(value - bounds.lower).get_d() < 1e-12;
      }
    }
  }
  EXPECT_GT(touched, 200);
}

TEST(RegionTable, TakesTheSlopeThatDataShow) {
  Declaration declaration{Eigen::MatrixXd{{1}}, Eigen::VectorXd::Zero(1)};
  declaration.regions = {{{{0, {-2, 0}}}, Eigen::MatrixXd::Zero(1, 1)}};
  Tabled tabled(declaration, 2);
  for (const double at : {0.0, 1.5}) tabled.Add(std::vector<double>{at}, at, at);
  RegionGrid::Box box;
  const auto slope_over = [&](double lower, double upper) {
    box.lower[0] = lower, box.upper[0] = upper;
    const std::vector<double> center{(lower + upper) / 2};
    return tabled.table.EncloseTilted(box, center);
  };
  EXPECT_EQ(slope_over(-1.5, -1).tilt.slope[0], 0);
  const auto [plain, band, tilt] = slope_over(0.5, 1);
  EXPECT_EQ(tilt.slope[0], 1);
  EXPECT_EQ(plain, tabled.table.Enclose(box).plain);
  EXPECT_EQ(band, tabled.table.Enclose(box, tilt).tilted);
  EXPECT_LE(band.lower, 0.75);
  EXPECT_GE(band.upper, 0.75);
  EXPECT_LT(band.upper - band.lower, 1e-12) << "as steep as may be, from one to the other";
  EXPECT_EQ(slope_over(0.75, 0.7505).tilt.slope[0], 0) << "too narrow";
  EXPECT_EQ(slope_over(1.6, 2).tilt.slope[0], 0) << "as far above as below";
}

// By L it is far along x, and near along y to where x costs nothing.
Declaration SteepAboveCalm(double scale) {
  Declaration declaration{Eigen::Matrix2d{{1, 0.25}, {0, 0}} / scale, Eigen::Vector2d::Zero()};
  declaration.regions = {{{{0, {-2 * scale, 2 * scale}}, {1, {-2 * scale, -scale}}}, Eigen::Matrix2d::Zero()}};
  return declaration;
}

TEST(RegionTable, KnowsWaysAroundCorners) {
  Tabled tabled(SteepAboveCalm(1), 2);
  ASSERT_TRUE(RegionTable::Fits(tabled.grid, 0));
  EXPECT_EQ(tabled.Over({1, 1}, {1, 1}).upper, kInfinity) << "nothing is known";
  tabled.Add(std::vector<double>{-1, 1}, 0.5, 0.5);
  const Interval across = tabled.Over({1, 1}, {1, 1}), calm = tabled.Over({-2, -2}, {2, -1});
  EXPECT_GE(across.upper, 1.5) << "down, across and up";
  EXPECT_LT(across.upper, 1.55) << "2.5 by moves along the axes";
  EXPECT_NEAR(across.upper + across.lower, 1, 1e-13) << "as far below as above";
  EXPECT_GE(calm.upper, 1) << "down to the side of the calm region";
  EXPECT_LT(calm.upper, 1.03);
  EXPECT_LT(tabled.Over({1, -1}, {1, -1}).upper, 1.03) << "on the side";
  EXPECT_LE(tabled.Over({1, 1}, {1, 1}).upper, tabled.Over({0.5, 0.5}, {1, 1.5}).upper) << "a larger box";
  tabled.Add(std::vector<double>{1, 1.5}, 0.75, 0.75);
  EXPECT_NEAR(tabled.Over({1, 1}, {1, 1}).upper, 0.875, 0.03) << "another one is nearer";
}

// By L it is far along x and y, and near along z to where these cost nothing.
TEST(RegionTable, KnowsWaysAroundCornersInThreeVariables) {
  Declaration declaration{Eigen::Matrix3d{{1, 1, 0.25}, {0, 0, 0}, {0, 0, 0}}, Eigen::Vector3d::Zero()};
  declaration.regions = {{{{0, {-2, 2}}, {1, {-2, 2}}, {2, {-2, -1}}}, Eigen::Matrix3d::Zero()}};
  Tabled tabled(declaration, 2);
  ASSERT_TRUE(RegionTable::Fits(tabled.grid, 0));
  const auto sources = [&](std::vector<double> z) {
    const auto found = tabled.table.Sources(z);
    return std::vector<int>(found.begin(), std::ranges::find(found, -1));
  };
  EXPECT_TRUE(sources({1, 1, 1}).empty()) << "nothing is known";
  tabled.table.Add(7, std::vector<double>{-1, -1, 1}, 0.5, 0.5);
  EXPECT_EQ(tabled.Over({1, 1, 1}, {1, 1, 1}).upper, kInfinity) << "not before it has spread";
  tabled.table.Spread();
  const Interval across = tabled.Over({1, 1, 1}, {1, 1, 1});
  EXPECT_GE(across.upper, 1.5) << "down, across and up";
  EXPECT_LT(across.upper, 1.65) << "4.5 by moves along the axes";
  EXPECT_NEAR(across.upper + across.lower, 1, 1e-13) << "as far below as above";
  EXPECT_NEAR(tabled.Over({-2, -2, -2}, {2, 2, -1}).upper, 1, 1e-13) << "down to the side of the calm region";
  EXPECT_EQ(sources({1, 1, 1}), std::vector{7});
  tabled.table.Add(9, std::vector<double>{1, 1, 1}, 0.25, 0.25);
  tabled.table.Spread();
  EXPECT_EQ(sources({1, 1, 1}), std::vector{9});
  EXPECT_EQ(sources({-1, -1, 1}), std::vector{7}) << "at most 0.5 and at least 0.5";
  EXPECT_TRUE(sources({1, 1, NextUp(2)}).empty());
  EXPECT_TRUE(sources({1, std::nan(""), 1}).empty());
  EXPECT_NEAR(tabled.Over({-2, -2, -2}, {2, 2, -1}).upper, 0.75, 1e-13) << "from the other one it is as near";
}

// However wide the strips are.
TEST(RegionsOracle, InThreeVariablesAnObservationSaysAsMuchAsByItself) {
  int less = 0, same = 0;
  for (TracedRandom random(2107); random.Again(200);) {
    SCOPED_TRACE("trial " + std::to_string(random.trial()));
    Scene scene = AnyScene(random);
    const RegionGrid grid(scene.declaration, scene.lower, scene.upper);
    if (grid.rows().empty() || grid.variables().size() < 3) continue;
    scene.observations = {Eigen::MatrixXd(1, 3), Eigen::MatrixXd::Zero(1, 3), Eigen::MatrixXd::Zero(1, 3)};
    RegionGrid::Box from, to;
    for (int l = 0; l < 3; ++l)
      from.lower[ToSize(l)] = from.upper[ToSize(l)] = scene.observations.z(0, l) = AnyPlace(random);
    grid.Find(from);
    const Nothing nothing;
    const RegionalEnclosure regional(scene.declaration, scene.observations, scene.lower, scene.upper, nothing);
    for (int query = 0; query < 5; ++query) {
      Eigen::Vector3d center, width;
      for (int l = 0; l < 3; ++l) {
        center[l] = AnyPlace(random);
        width[l] = random.Coin(0.3) ? 0 : random.Uniform(0, 0.2) * (kReach - std::abs(center[l]));
        to.lower[ToSize(l)] = SubDown(center[l], width[l]);
        to.upper[ToSize(l)] = AddUp(center[l], width[l]);
      }
      grid.Find(to);
      ResidualBounds bounds;
      regional.Enclose({Zonotope::FromBox(center, width), {}, {width.data(), 3}}, bounds);
      const double cost = grid.CostUpper(0, from, to);
      ASSERT_LE(bounds.upper[0], cost);
      ASSERT_GE(bounds.lower[0], -cost);
      less += bounds.upper[0] < 0.9 * cost;
      same += bounds.upper[0] == cost;
    }
  }
  EXPECT_GT(less, 10) << "by ways around corners";
  EXPECT_GT(same, 50);
}

TEST(RegionTable, HasNoBoundOutsideTheDomain) {
  Tabled tabled(SteepAboveCalm(1), 2);
  tabled.Add(std::vector<double>{0, NextUp(2)}, 0, 0);
  tabled.Add(std::vector<double>{std::nan(""), 0}, 0, 0);
  EXPECT_EQ(tabled.Over({0, 0}, {0, 0}).lower, -kInfinity) << "an observation outside says nothing";
  tabled.Add(std::vector<double>{-2, 2}, 0, 0);
  EXPECT_TRUE(tabled.Over({-2, -2}, {2, 2}).IsFinite());
  EXPECT_LT(tabled.Over({-2, 2}, {-2, 2}).upper, 1e-14) << "in a corner";
  EXPECT_TRUE(tabled.Over({-3, -3}, {3, 3}).IsFinite()) << "the part of it in the domain";
  EXPECT_EQ(tabled.Over({0, NextUp(2)}, {0, 3}).upper, kInfinity);
  EXPECT_EQ(tabled.Over({std::nan(""), 0}, {0, 0}).upper, kInfinity);
  EXPECT_EQ(tabled.Over({0, 0}, {0, std::nan("")}).lower, -kInfinity);
}

TEST(RegionTable, IsTheSameInEveryOrderOfObservations) {
  for (TracedRandom random(2105); random.Again(20);) {
    const Scene scene = AnyScene(random);
    const RegionGrid grid(scene.declaration, scene.lower, scene.upper);
    if (grid.rows().empty() || !RegionTable::Fits(grid, 0)) continue;
    std::vector<std::pair<std::vector<double>, double>> seen(5);
    for (auto& [z, value] : seen) {
      for (int l = 0; l < scene.variables; ++l) z.push_back(AnyPlace(random));
      value = random.Uniform(-1, 1);
    }
    Tabled forward(scene.declaration, kReach), backward(scene.declaration, kReach);
    for (const auto& [z, value] : seen) forward.Add(z, value, value + 0.5);
    for (auto at = seen.rbegin(); at != seen.rend(); ++at) backward.Add(at->first, at->second, at->second + 0.5);
    for (int query = 0; query < 10; ++query) {
      std::vector<double> from, to;
      for (int l = 0; l < scene.variables; ++l) {
        from.push_back(AnyPlace(random));
        to.push_back(random.Coin(0.3) ? from.back() : random.Uniform(from.back(), kReach));
      }
      const Interval one = forward.Over(from, to), other = backward.Over(from, to);
      EXPECT_NEAR(one.lower, other.lower, 1e-14);
      EXPECT_NEAR(one.upper, other.upper, 1e-14);
    }
  }
}

// A bound, or none: never one that numbers out of range have made.
TEST(RegionTable, HoldsInDomainsOfEveryScale) {
  for (const double scale : {0x1p-1000, 0x1p-500, 0x1p500, 0x1p1020}) {
    Tabled tabled(SteepAboveCalm(scale), 2 * scale);
    tabled.Add(std::vector<double>{-scale, scale}, 0.5, 0.5);
    const Interval bounds = tabled.Over({scale, scale}, {scale, scale});
    EXPECT_GE(bounds.upper, 1.5) << scale;
    EXPECT_LE(bounds.lower, -0.5) << scale;
  }
}

// Against the definition at points: one in each cell that the box meets or touches, and on all sides between them.
TEST(RegionsOracle, TheLargestBoundIsThatOfTheCellsThatABoxTouches) {
  int less = 0;
  for (TracedRandom random(2103); random.Again(500);) {
    SCOPED_TRACE("trial " + std::to_string(random.trial()));
    Scene scene = AnyScene(random);
    Declaration& declaration = scene.declaration;
    declaration.disturbance = Eigen::VectorXd::Ones(scene.variables);
    BoundInRegions(random, declaration, &Region::disturbance, declaration.disturbance);
    BoundInRegions(random, declaration, &Region::bound, declaration.disturbance);
    const RegionGrid grid(declaration, scene.lower, scene.upper);
    RegionGrid::Box box;
    std::vector<std::vector<double>> places{{}};  // of each axis so far
    for (std::size_t l = 0; l < static_cast<std::size_t>(scene.variables); ++l) {
      box.lower[l] = AnyPlace(random);
      box.upper[l] = random.Coin(0.3) ? box.lower[l] : std::max(box.lower[l], AnyPlace(random));
      std::vector<double> along{box.lower[l], box.upper[l], NextDown(box.lower[l]), NextUp(box.upper[l])};
      for (const Region& region : declaration.regions)
        for (const auto& [variable, range] : region.box)
          if (static_cast<std::size_t>(variable) == l)
            for (const double side : {range.lower, range.upper})
              if (box.lower[l] <= side && side <= box.upper[l])
                along.insert(along.end(), {NextDown(side), NextUp(side)});
      std::erase_if(along, [](double at) { return std::abs(at) > kReach; });
      std::vector<std::vector<double>> next;
      for (const std::vector<double>& place : places)
        for (const double at : along) next.push_back(place), next.back().push_back(at);
      places = std::move(next);
    }
    for (const auto& [of, which, everywhere] : {std::tuple(&Region::disturbance, RegionBound::kDisturbance, 1.0),
                                                std::tuple(&Region::bound, RegionBound::kResidual, kInfinity)})
      for (int k = 0; k < scene.variables; ++k) {
        double largest = 0;
        for (const std::vector<double>& place : places)
          largest = std::max(largest, BoundAt(declaration, of, {place.begin(), place.end()}, k, everywhere));
        ASSERT_EQ(grid.LargestBound(which, static_cast<std::size_t>(k), box), largest);
        less += largest < everywhere;
      }
  }
  EXPECT_GT(less, 300);
}

// Residuals on the edge of what data, L and regions admit, in 256 bits: the model, and whether steps are disturbed.
class RegionalContainment : public testing::TestWithParam<std::tuple<bool, bool>> {};

TEST_P(RegionalContainment, NoAdmissibleRolloutLeavesTheTube) {
  const auto [bicycle, disturbed] = GetParam();
  int certified = 0, slices = 0, learned = 0, narrower = 0, sloped = 0;
  for (TracedRandom random(2111 + bicycle); random.Again(40);) {
    SCOPED_TRACE("trial " + std::to_string(random.trial()));
    const auto problem = AnyRegionalProblem(random, bicycle, random.Integer(2, 7), disturbed);
    const auto plain = std::make_shared<Problem>(*problem);
    plain->declaration.regions = {};
    const Certifier without(plain);
    const int all = problem->transitions.size(), first = random.Coin() ? all : 1;
    learned += all - first;
    const auto certifier = HasLearned(*problem, first);
    ASSERT_FALSE(certifier->violation()) << "the data come from a residual within the regions";
    Tube tube, wider;
    for (int q = 0; q < 2; ++q) {
      const Query query = AnyQuery(random, *problem);
      const Decision decision = certifier->Certify(query.plan(), query.initial_set, query.obstacles, tube);
      ASSERT_NE(decision.outcome, Outcome::kFalsified);
      certified += decision.outcome == Outcome::kCertified;
      for (int t = 0; t < tube.length(); ++t) sloped += tube.step(t).envelope.has_slope;
      static_cast<void>(without.Certify(query.plan(), query.initial_set, query.obstacles, wider));
      const int last = std::min(tube.length(), wider.length());
      for (int k = 0; k < problem->model->num_states(); ++k)
        narrower += tube.half_width(last)[static_cast<std::size_t>(k)] <
                    0.9 * wider.half_width(last)[static_cast<std::size_t>(k)];
      for (int rollout = 0; rollout < 3; ++rollout) {
        const std::vector<RegionalFunction<Real>> residual = AnyAdmissible(random, *problem);
        const auto of_row = [&](const std::vector<Real>& z, int k) { return residual[static_cast<std::size_t>(k)](z); };
        const auto holds = [&](int t, const std::vector<Real>& x) {
          slices += t > 0;
          return t == 0 || IsNotOutside(random, tube.slice(t), x);
        };
        ASSERT_EQ(FirstFailure(random, random, random, *problem, query, tube.length(), of_row, holds), -1)
            << "outside that slice";
      }
    }
  }
  EXPECT_GT(certified, 10);
  EXPECT_GT(slices, 500);
  EXPECT_GT(learned, 30);
  EXPECT_GT(narrower, 20);
  EXPECT_GT(sloped, 20);
}

INSTANTIATE_TEST_SUITE_P(Models, RegionalContainment, testing::Combine(testing::Bool(), testing::Bool()));

}  // namespace forereach::regions_oracle_test
