// Affine rows of the residual: bounds, hulls and contradictions against rationals, and rollouts of residuals that the
// data admit, in 256 bits, against tubes.
#include "tests/test.h"

#include <numeric>

#include "forereach/certify/tube.h"
#include "forereach/residual/affine_rows_enclosure.h"
#include "tests/oracle/admissible.h"
#include "tests/oracle/affine_problems.h"
#include "tests/oracle/traced_random.h"

namespace forereach::affine_oracle_test {

using exact::Rational;

// N observations of q unknowns: lower_i <= phi_i . theta <= upper_i.
struct Data {
  std::vector<std::vector<double>> phi;
  std::vector<double> lower, upper;

  AffineSet Set() const {
    const std::size_t columns = phi[0].size() - 1;
    std::vector<int> all;
    for (std::size_t l = 0; l < columns; ++l) all.push_back(static_cast<int>(l));
    const std::vector<double> least(columns, -2), most(columns, 2);
    AffineSet set(all, least, most);
    for (std::size_t i = 0; i < phi.size(); ++i) set.Add(static_cast<int>(i), phi[i], lower[i], upper[i]);
    set.Derive();
    return set;
  }
};

Data AnyData(Random& random, int columns, int count, double width, double off) {
  Data data;
  std::vector<double> theta;
  for (int l = 0; l <= columns; ++l) theta.push_back(random.Uniform(-1, 1));
  const double spread = random.Coin(0.2) ? 1e-3 : 1;
  for (int i = 0; i < count; ++i) {
    std::vector<double>& phi = data.phi.emplace_back();
    double value = theta.back();
    for (int l = 0; l < columns; ++l) {
      phi.push_back(random.Coin(0.2) ? random.Integer(-2, 2) : 1 + spread * random.Uniform(-1, 1));
      value += theta[static_cast<std::size_t>(l)] * phi.back();
    }
    phi.push_back(1);
    value += off * random.Uniform(-1, 1);
    data.lower.push_back(value - width * random.Uniform(0.5, 1));
    data.upper.push_back(value + width * random.Uniform(0.5, 1));
  }
  return data;
}

// x with A x = b, by elimination; nothing if A is singular.
std::optional<std::vector<Rational>> Solved(std::vector<std::vector<Rational>> a, std::vector<Rational> b) {
  const std::size_t n = b.size();
  for (std::size_t c = 0; c < n; ++c) {
    std::size_t p = c;
    while (p < n && a[p][c] == 0) ++p;
    if (p == n) return std::nullopt;
    std::swap(a[c], a[p]);
    std::swap(b[c], b[p]);
    for (std::size_t i = 0; i < n; ++i) {
      if (i == c || a[i][c] == 0) continue;
      const Rational factor = a[i][c] / a[c][c];
      for (std::size_t j = c; j < n; ++j) a[i][j] -= factor * a[c][j];
      b[i] -= factor * b[c];
    }
  }
  for (std::size_t c = 0; c < n; ++c) b[c] /= a[c][c];
  return b;
}

// Every vertex of the set: q of the observations at one of their ends, and the others within theirs.
std::vector<std::vector<Rational>> Vertices(const Data& data) {
  const std::size_t q = data.phi[0].size(), count = data.phi.size();
  std::vector<std::vector<Rational>> vertices;
  std::vector<int> chosen(count);
  std::fill_n(chosen.rbegin(), q, 1);
  do {
    std::vector<std::size_t> rows;
    for (std::size_t i = 0; i < count; ++i)
      if (chosen[i]) rows.push_back(i);
    for (unsigned ends = 0; ends < 1U << q; ++ends) {
      std::vector<std::vector<Rational>> a;
      std::vector<Rational> b;
      for (std::size_t j = 0; j < q; ++j) {
        a.emplace_back(data.phi[rows[j]].begin(), data.phi[rows[j]].end());
        b.emplace_back(ends >> j & 1 ? data.upper[rows[j]] : data.lower[rows[j]]);
      }
      const auto theta = Solved(a, b);
      if (!theta) break;
      bool is_in = true;
      for (std::size_t i = 0; i < count && is_in; ++i) {
        Rational value = 0;
        for (std::size_t l = 0; l < q; ++l) value += Rational(data.phi[i][l]) * (*theta)[l];
        is_in = Rational(data.lower[i]) <= value && value <= Rational(data.upper[i]);
      }
      if (is_in) vertices.push_back(*theta);
    }
  } while (std::ranges::next_permutation(chosen).found);
  return vertices;
}

TEST(AffineSetOracle, BoundsEveryParameterThatTheDataAdmitAndLittleMore) {
  int bounded = 0;
  for (TracedRandom random(861); random.Again(150);) {
    const int columns = random.Integer(1, 2), count = random.Integer(columns + 1, 7);
    const Data data = AnyData(random, columns, count, std::ldexp(1, -random.Integer(0, 30)), 0);
    const AffineSet set = data.Set();
    const auto vertices = Vertices(data);
    ASSERT_FALSE(set.contradiction());
    if (!set.IsBounded()) continue;
    ASSERT_FALSE(vertices.empty());
    ++bounded;
    for (int query = 0; query < 6; ++query) {
      std::vector<double> phi = random.Coin() ? data.phi[static_cast<std::size_t>(random.Below(count))]
                                              : std::vector<double>(static_cast<std::size_t>(columns) + 1, 1.0);
      for (int l = 0; l < columns && random.Coin(0.7); ++l) phi[static_cast<std::size_t>(l)] = random.Uniform(-2, 2);
      std::optional<Rational> least, most;
      for (const auto& theta : vertices) {
        Rational value = 0;
        for (std::size_t l = 0; l < phi.size(); ++l) value += Rational(phi[l]) * theta[l];
        if (!least || value < *least) least = value;
        if (!most || value > *most) most = value;
      }
      const Interval bounds = set.Enclose(phi);
      ASSERT_TRUE(exact::AtMost(*most, bounds.upper)) << "no tolerance";
      ASSERT_TRUE(exact::AtLeast(*least, bounds.lower)) << "no tolerance";
      EXPECT_LE(bounds.upper - bounds.lower, Rational(*most - *least).get_d() * (1 + 1e-5) + 1e-9) << "tight";
    }
    for (std::size_t l = 0; l < vertices[0].size(); ++l)
      for (const auto& theta : vertices) {
        ASSERT_TRUE(exact::Inside(theta[l], set.hull(l)));
        const Rational away = theta[l] - Rational(set.slope(l));
        ASSERT_TRUE(exact::AtMost(away, set.reach(l)) && exact::AtMost(-away, set.reach(l)));
      }
  }
  EXPECT_GT(bounded, 80);
}

// One or two columns, and a variable that is none. Numbers of few bits, so that ends are exact in doubles.
struct DataWithRest {
  std::vector<double> rest, theta, knee, weight;
  Data data;
  std::vector<std::vector<double>> places;

  DataWithRest(Random& random, int columns, int count, double width, double off) {
    const auto any = [&](double most, double unit) { return unit * std::round(random.Uniform(-most, most) / unit); };
    for (int l = 0; l <= columns; ++l) {
      theta.push_back(any(1, 0x1p-10));
      knee.push_back(any(1, 0x1p-10));
      weight.push_back(random.Sign());
      rest.push_back(random.Coin(0.3) ? 0 : std::abs(any(0.5, 0x1p-10)));
    }
    for (int i = 0; i < count; ++i) {
      std::vector<double>& z = places.emplace_back();
      std::vector<double>& phi = data.phi.emplace_back();
      for (int l = 0; l <= columns; ++l) z.push_back(random.Coin(0.2) ? random.Integer(-2, 2) : any(2, 0x1p-10));
      phi.assign(z.begin(), z.end() - 1);
      phi.push_back(1);
      const double value = Truth(z) + any(off, 0x1p-30);
      data.lower.push_back(value - width + any(width / 2, 0x1p-30));
      data.upper.push_back(value + width + any(width / 2, 0x1p-30));
    }
  }

  double Truth(const std::vector<double>& z) const {
    double value = theta.back();
    for (std::size_t l = 0; l < z.size(); ++l) {
      value += weight[l] * rest[l] * std::abs(z[l] - knee[l]);
      if (l + 1 < z.size()) value += theta[l] * z[l];
    }
    return value;
  }

  // Of the first observations.
  AffineSet Set(std::size_t count) const {
    const std::vector<double> least(rest.size(), -2), most(rest.size(), 2);
    std::vector<int> columns;
    for (int l = 0; l + 1 < std::ssize(rest); ++l) columns.push_back(l);
    AffineSet set(columns, least, most, rest);
    for (std::size_t i = 0; i < count; ++i) set.Add(static_cast<int>(i), places[i], data.lower[i], data.upper[i]);
    set.Derive();
    return set;
  }
  AffineSet Set() const { return Set(places.size()); }

  double Apart(const std::vector<double>& a, const std::vector<double>& b) const {
    double sum = 0;
    for (std::size_t l = 0; l < rest.size(); ++l) sum += rest[l] * std::abs(a[l] - b[l]);
    return sum;
  }

  // What the observations are without a rest, as seen from z.
  Data From(const std::vector<double>& z) const {
    Data seen = data;
    for (std::size_t i = 0; i < places.size(); ++i)
      seen.lower[i] -= Apart(places[i], z), seen.upper[i] += Apart(places[i], z);
    return seen;
  }
};

TEST(AffineSetOracle, WithARestBoundsTheRowWhereverItIsSeenFrom) {
  int bounded = 0;
  for (TracedRandom random(863); random.Again(100);) {
    const int columns = random.Integer(1, 2), count = random.Integer(columns + 1, 6);
    const DataWithRest with(random, columns, count, std::ldexp(1, -random.Integer(0, 20)), 0);
    const AffineSet set = with.Set();
    ASSERT_FALSE(set.contradiction());
    if (!set.IsBounded()) continue;
    ++bounded;
    for (int query = 0; query < 6; ++query) {
      std::vector<double> z = random.Coin() ? with.places[static_cast<std::size_t>(random.Below(count))]
                                            : std::vector<double>(static_cast<std::size_t>(columns) + 1);
      for (double& entry : z)
        if (random.Coin(0.7)) entry = 0x1p-10 * random.Integer(-2048, 2048);
      std::optional<Rational> least, most;
      for (const auto& theta : Vertices(with.From(z))) {
        Rational value = theta.back();
        for (std::size_t l = 0; l + 1 < theta.size(); ++l) value += Rational(z[l]) * theta[l];
        if (!least || value < *least) least = value;
        if (!most || value > *most) most = value;
      }
      ASSERT_TRUE(least);
      const Interval bounds = set.Enclose(z);
      ASSERT_TRUE(exact::AtMost(*most, bounds.upper)) << "no tolerance";
      ASSERT_TRUE(exact::AtLeast(*least, bounds.lower)) << "no tolerance";
      EXPECT_LE(bounds.upper - bounds.lower, Rational(*most - *least).get_d() * (1 + 1e-5) + 1e-9) << "tight";
    }
    for (const auto& theta : Vertices(with.From(std::vector<double>(with.rest.size()))))
      for (std::size_t l = 0; l + 1 < theta.size(); ++l) {
        ASSERT_TRUE(exact::Inside(theta[l], set.hull(l)));
        const Rational away = theta[l] - Rational(set.slope(l));
        ASSERT_TRUE(exact::AtMost(away, set.reach(l)) && exact::AtMost(-away, set.reach(l)));
      }
  }
  EXPECT_GT(bounded, 60);
}

// A query of many looks at few first; of too many, the latest and those that decide are kept.
TEST(AffineSetOracle, WithARestManyObservationsBoundMore) {
  TracedRandom random(865);
  const DataWithRest with(random, 2, 2200, 0.0625, 0);
  const AffineSet few = with.Set(100), many = with.Set(1000);
  AffineSet learned = with.Set(1900);
  for (std::size_t i = 1900; i < 2200; ++i)
    learned.Learn(static_cast<int>(i), with.places[i], with.data.lower[i], with.data.upper[i]);
  EXPECT_LE(learned.num_kept(), AffineSet::kMostKept);
  double sum_of_few = 0, sum_of_many = 0;
  for (int query = 0; query < 100; ++query) {
    std::vector<double> z(3);
    for (double& entry : z) entry = 0x1p-10 * random.Integer(-2048, 2048);
    for (const AffineSet* set : std::initializer_list<const AffineSet*>{&few, &many, &learned}) {
      ASSERT_TRUE(set->IsBounded() && !set->contradiction());
      EXPECT_TRUE(set->Enclose(z).Contains(with.Truth(z)));
    }
    const Interval of_few = few.Enclose(z), of_many = many.Enclose(z);
    EXPECT_LE(of_many.upper, of_few.upper + 1e-9);
    EXPECT_GE(of_many.lower, of_few.lower - 1e-9);
    sum_of_few += of_few.upper - of_few.lower;
    sum_of_many += of_many.upper - of_many.lower;
  }
  EXPECT_LT(sum_of_many, 0.9 * sum_of_few);
  learned.Learn(2200, with.places[0], with.data.upper[0] + 0.5, with.data.upper[0] + 0.75);
  ASSERT_TRUE(learned.contradiction());
  EXPECT_EQ(std::ranges::max(learned.contradiction()->rows), 2200);
}

// With one column: some M is left if, for each two observations, lower_i - upper_j - M (z_i - z_j) <= d(z_i, z_j).
bool LeavesNoSlope(const DataWithRest& with, const std::vector<int>& rows) {
  std::optional<Rational> least, most;
  for (const int first : rows)
    for (const int second : rows) {
      const auto i = static_cast<std::size_t>(first), j = static_cast<std::size_t>(second);
      const Rational apart = Rational(with.places[i][0]) - Rational(with.places[j][0]);
      const Rational over = Rational(with.data.lower[i]) - Rational(with.data.upper[j]) -
                            Rational(with.Apart(with.places[i], with.places[j]));
      if (apart == 0 && over > 0) return true;
      if (apart > 0 && (!least || over / apart > *least)) least = over / apart;
      if (apart < 0 && (!most || over / apart < *most)) most = over / apart;
    }
  return least && most && *least > *most;
}

TEST(AffineSetOracle, AContradictionBesideARestIsAProofAndMostAreFound) {
  int found = 0, missed = 0, agreed = 0;
  for (TracedRandom random(864); random.Again(300);) {
    const int count = random.Integer(3, 7);
    const double width = std::ldexp(1, -random.Integer(2, 20));
    const DataWithRest with(random, 1, count, width, random.Coin(0.7) ? 4 * width : 0);
    const AffineSet set = with.Set();
    std::vector<int> all(static_cast<std::size_t>(count));
    std::iota(all.begin(), all.end(), 0);
    const bool is_empty = LeavesNoSlope(with, all);
    if (set.contradiction()) {
      ++found;
      ASSERT_LE(set.contradiction()->rows.size(), 4);
      ASSERT_TRUE(LeavesNoSlope(with, set.contradiction()->rows)) << "those that it names are enough";
    } else {
      agreed += !is_empty;
      missed += is_empty && set.IsBounded();
    }
  }
  RecordProperty("missed", missed);
  EXPECT_GT(found, 30);
  EXPECT_LT(missed, found / 2);
  EXPECT_GT(agreed, 50);
}

// 20,000 observations one by one: what is kept is bounded, encloses what all of them admit, and is hardly wider.
TEST(AffineSetOracle, OfMuchThatIsLearnedKeepsWhatDecides) {
  Random random(7);
  const Data data = AnyData(random, 3, 20'000, 0.5, 0.1);
  AffineSet learned({0, 1, 2}, std::vector<double>(3, -2), std::vector<double>(3, 2));
  std::size_t most = 0;
  for (std::size_t i = 0; i < data.phi.size(); ++i) {
    learned.Learn(static_cast<int>(i), data.phi[i], data.lower[i], data.upper[i]);
    most = std::max(most, learned.num_kept());
  }
  EXPECT_EQ(most, AffineSet::kMostKept);
  ASSERT_TRUE(learned.IsBounded());
  const AffineSet all = data.Set();
  EXPECT_LT(all.num_kept(), 200);
  for (int query = 0; query < 100; ++query) {
    std::vector<double> phi{random.Uniform(-2, 2), random.Uniform(-2, 2), random.Uniform(-2, 2), 1};
    const Interval by_all = all.Enclose(phi), by_kept = learned.Enclose(phi);
    const double slack = 0.02 * (by_all.upper - by_all.lower);
    EXPECT_NEAR(by_kept.lower, by_all.lower, slack);
    EXPECT_NEAR(by_kept.upper, by_all.upper, slack);
  }
  learned.Learn(20'000, data.phi[0], data.upper[0] + 1, data.upper[0] + 2);
  ASSERT_TRUE(learned.contradiction());
  EXPECT_EQ(learned.contradiction()->rows[0], 20'000);
}

TEST(AffineSetOracle, OfMuchThatExcitesTooLittleKeepsWhatSpansIt) {
  Random random(11);
  const Data data = AnyData(random, 3, 5000, 0.5, 0.1);
  AffineSet learned({0, 1, 2}, std::vector<double>(3, -2), std::vector<double>(3, 2));
  std::size_t most = 0;
  for (std::size_t i = 0; i < data.phi.size(); ++i) {
    std::vector<double> phi = data.phi[i];
    if (i >= 10) phi[1] = 0.25;                   // after ten observations of any x_1 ...
    if (i < 10 || i + 10 < 5000) phi[2] = -0.75;  // ... and before ten of any x_2
    if (i + 10 == 5000) EXPECT_EQ(learned.unexcited(), std::vector<double>({0, 0, 1}));
    learned.Learn(static_cast<int>(i), phi, -10, 10);
    most = std::max(most, learned.num_kept());
    if (i + 10 < 5000) ASSERT_FALSE(learned.IsBounded());
  }
  EXPECT_EQ(most, AffineSet::kMostKept);
  EXPECT_TRUE(learned.IsBounded());
}

// A contradiction that is reported holds in rationals, and one that is not tiny is reported.
TEST(AffineSetOracle, AContradictionIsAProofAndNoneIsMissed) {
  int found = 0, agreed = 0;
  for (TracedRandom random(862); random.Again(150);) {
    const int columns = random.Integer(1, 2), count = random.Integer(columns + 2, 7);
    const double width = std::ldexp(1, -random.Integer(2, 20));
    const Data data = AnyData(random, columns, count, width, random.Coin() ? 2 * width : 0);
    const AffineSet set = data.Set();
    const bool is_empty = Vertices(data).empty();
    if (!set.contradiction()) {
      agreed += !is_empty;
      EXPECT_FALSE(is_empty && set.IsBounded());
      continue;
    }
    ++found;
    ASSERT_TRUE(is_empty);
    // Those that it names are enough.
    Data few;
    for (const int i : set.contradiction()->rows) {
      few.phi.push_back(data.phi[static_cast<std::size_t>(i)]);
      few.lower.push_back(data.lower[static_cast<std::size_t>(i)]);
      few.upper.push_back(data.upper[static_cast<std::size_t>(i)]);
    }
    EXPECT_EQ(few.phi.size(), few.phi[0].size() + 1);
    EXPECT_TRUE(Vertices(few).empty());
    // The first is `gap` away from what the others admit, and not more.
    const double gap = set.contradiction()->gap;
    for (const double share : {1 + 1e-3, 1 - 1e-3}) {
      Data moved = few;
      moved.lower[0] -= share * gap;
      moved.upper[0] += share * gap;
      EXPECT_EQ(Vertices(moved).empty(), share < 1);
    }
  }
  EXPECT_GT(found, 20);
  EXPECT_GT(agreed, 20);
}

// The model, whether steps are disturbed, of some by less in some places, and whether they may be off their times.
class AffineContainment : public testing::TestWithParam<std::tuple<bool, bool, bool>> {};

TEST_P(AffineContainment, NoAdmissibleRolloutLeavesTheTube) {
  const auto [bicycle, disturbed, shifted] = GetParam();
  TracedRandom random(871 + bicycle), records(881 + bicycle), rests(891 + bicycle);
  int certified = 0, slices = 0, learned = 0, with_rest = 0;
  for (int trial = 0; trial < 60; ++trial) {
    SCOPED_TRACE("trial " + std::to_string(trial));
    const auto problem = AnyProblem(random, bicycle, random.Integer(6, 24));
    if (disturbed && records.Coin()) {  // by less in boxes of a coordinate that no ball of the domain names
      const int l = random.Coin() ? 0 : problem->model->num_states();
      const double side = problem->domain.Ranges()[static_cast<std::size_t>(l)].upper * random.Uniform(-0.5, 0.5);
      problem->declaration.regions = {{{{l, {-1e3, side}}}, problem->declaration.lipschitz}};
      if (random.Coin()) problem->declaration.regions.push_back({{{l, {side, 1e3}}}, problem->declaration.lipschitz});
    }
    if (disturbed) Disturb(random, *problem);
    const AffineTruth truth = MakeAffine(random, *problem, rests.Coin() ? &rests : nullptr);
    if (shifted) Shift(random, *problem);
    // Of some the slopes are declared, and the transitions are recorded with errors.
    if (records.Coin()) DeclareSlopes(*problem);
    const auto told = records.Coin() ? RecordedAffine(records, *problem) : problem;
    // All transitions at once, or the last ones learned.
    const int all = told->transitions.size(), first = random.Coin() ? all : (all + 1) / 2;
    learned += all - first;
    const auto certifier = HasLearned(*told, first);
    ASSERT_FALSE(certifier->violation()) << "the data come from a residual that satisfies the declaration";
    Tube tube;
    for (int q = 0; q < 2; ++q) {
      const Query query = AnyQuery(random, *problem);
      const Decision decision = certifier->Certify(query.plan(), query.initial_set, query.obstacles, tube);
      ASSERT_NE(decision.outcome, Outcome::kFalsified);
      certified += decision.outcome == Outcome::kCertified;
      with_rest += problem->declaration.affine.rest.size() > 0 && tube.length() > 0;
      for (int rollout = 0; rollout < 4; ++rollout) {
        const AdmissibleResidual others(random, *problem);
        const AffineRows& affine = problem->declaration.affine;
        std::vector<AdmissibleRow> rows;
        for (std::size_t i = 0; i < affine.rows.size(); ++i)
          rows.emplace_back(random, rests, *told, *problem, i, truth);
        const auto residual = [&](const std::vector<Real>& z, int k) {
          const auto row = std::ranges::find(affine.rows, k) - affine.rows.begin();
          return row < std::ssize(affine.rows) ? rows[static_cast<std::size_t>(row)](z) : others(z, k);
        };
        const auto holds = [&](int t, const std::vector<Real>& x) {
          slices += t > 0;
          return t == 0 || IsNotOutside(random, tube.slice(t), x);
        };
        ASSERT_EQ(FirstFailure(random, random, records, *told, query, tube.length(), residual, holds), -1)
            << "outside that slice";
      }
    }
  }
  EXPECT_GT(certified, shifted ? 8 : 20);
  EXPECT_GT(slices, 500);
  EXPECT_GT(learned, 50);
  EXPECT_GT(with_rest, 20);
}

INSTANTIATE_TEST_SUITE_P(Models, AffineContainment,
                         testing::Combine(testing::Bool(), testing::Bool(), testing::Bool()));

}  // namespace forereach::affine_oracle_test
