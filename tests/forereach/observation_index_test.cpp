// The search over observations against looking at every one: the same number to the last bit, in a tree and in a row,
// on every instruction set; and what a cap makes of it is wider.
#include "tests/test.h"

#include "forereach/residual/consistency.h"
#include "forereach/residual/lipschitz_envelope.h"
#include "forereach/residual/pairs.h"
#include "tests/oracle/traced_random.h"

namespace forereach::observation_index_test {

constexpr int kStates = 9, kInputs = 5, kVariables = kStates + kInputs;
constexpr int kFlat = 1 << 20;

// One row with `active` columns, at random places.
struct Data {
  Declaration declaration;
  Observations observations;
  std::vector<double> lower, upper;  // the domain
};

Data Make(Random& random, int count, int active, double scale) {
  Data data;
  data.declaration = {Eigen::MatrixXd::Zero(1, kVariables),
                      Eigen::VectorXd::Constant(1, random.Coin() ? 0 : 0.01 * scale)};
  std::vector<int> columns(kVariables);
  for (int l = 0; l < kVariables; ++l) columns[static_cast<std::size_t>(l)] = l;
  for (int a = 0; a < active; ++a) {
    std::swap(columns[static_cast<std::size_t>(a)],
              columns[static_cast<std::size_t>(random.Integer(a, kVariables - 1))]);
    data.declaration.lipschitz(0, columns[static_cast<std::size_t>(a)]) = random.Uniform(0, 1);
  }
  Observations& o = data.observations;
  o.z = random.Matrix(count, kVariables, scale);
  o.lower = random.Matrix(count, 1, 0.1 * scale) + 0.3 * o.z.leftCols(kStates).rowwise().sum();
  for (int i = 0; i < count; ++i)  // duplicates, ties, and points on top of each other
    if (const int j = random.Below(count); random.Coin(0.2)) {
      o.z.row(i) = o.z.row(j);
      if (random.Coin()) o.lower.row(i) = o.lower.row(j);
    }
  o.upper = o.lower.array() + 0.001 * scale * random.Below(2);
  data.lower.assign(kVariables, -2 * scale);
  data.upper.assign(kVariables, 2 * scale);
  return data;
}

LipschitzEnvelope EnvelopeOf(const Data& data, const EnvelopeOptions& options) {
  return LipschitzEnvelope(data.declaration, data.observations, data.lower, data.upper, options);
}

struct Query {
  Zonotope slice;
  Eigen::VectorXd input;
  std::vector<double> half_width;

  Query(Random& random, double scale, int generators)
      : slice(random.Vector(kStates, scale),
              random.Matrix(kStates, generators, scale / (generators + 1) * random.Uniform(0, 0.9))),
        input(random.Vector(kInputs, scale)) {
    for (int k = 0; k < kStates; ++k) {
      ArraysOf(slice).mutable_slack(k) = random.Coin() ? 0 : 1e-3 * scale * random.Uniform(0, 1);
      half_width.push_back(slice.HalfWidthUpper(k));
    }
  }
  [[nodiscard]] QuerySet set() const { return {slice, View(input), half_width}; }
};

ResidualBounds Ask(const LipschitzEnvelope& envelope, const Query& query) {
  ResidualBounds bounds;
  envelope.Enclose(query.set(), bounds);
  return bounds;
}

std::vector<InstructionSet> InstructionSets() {
  std::vector<InstructionSet> sets{InstructionSet::kBaseline, InstructionSet::kAvx2, InstructionSet::kAvx512};
  std::erase_if(sets, [](InstructionSet instructions) { return !IsSupported(instructions); });
  return sets;
}

class Search : public testing::TestWithParam<int> {};  // active columns

TEST_P(Search, TreeAndRowAgreeToTheLastBitOnEveryInstructionSet) {
  TracedRandom random(700 + static_cast<std::uint64_t>(GetParam()));
  for (const int count : {1, 2, 7, 8, 9, 31, 32, 33, 64, 65, 255, 256, 257, 300, 2000, 20000}) {
    const double scale = std::ldexp(1, count == 300 ? -1060 : count == 257 ? 500 : random.Integer(-3, 3));
    const Data data = Make(random, count, GetParam(), scale);
    std::vector<LipschitzEnvelope> envelopes;
    for (const InstructionSet instructions : InstructionSets())
      for (const int flat : {kFlat, 0})
        envelopes.push_back(
            EnvelopeOf(data, {.max_leaf_visits = 1 << 20, .max_flat_blocks = flat, .instructions = instructions}));
    for (int trial = 0; trial < (count > 1000 ? 5 : 20); ++trial) {
      const Query query(random, scale, random.Integer(0, 20));
      const ResidualBounds expected = Ask(envelopes.front(), query);
      ASSERT_TRUE(std::isfinite(expected.lower[0]) && std::isfinite(expected.upper[0]));
      ASSERT_FALSE(expected.capped);
      for (const LipschitzEnvelope& envelope : envelopes) {
        const ResidualBounds bounds = Ask(envelope, query);
        ASSERT_EQ(bounds.lower[0], expected.lower[0]) << count << " observations";
        ASSERT_EQ(bounds.upper[0], expected.upper[0]) << count << " observations";
        ASSERT_FALSE(bounds.capped);
      }
    }
  }
}

// Where the last query found its bounds, or anywhere else.
TEST_P(Search, GivesTheSameBitsWhereverItBegins) {
  TracedRandom random(710 + static_cast<std::uint64_t>(GetParam()));
  for (const int count : {33, 300, 3000}) {
    const LipschitzEnvelope envelope =
        EnvelopeOf(Make(random, count, GetParam(), 1), {.max_leaf_visits = 1 << 20, .max_flat_blocks = 0});
    ResidualBounds after_last, anywhere;
    for (int trial = 0; trial < 20; ++trial) {
      const Query query(random, 1, random.Integer(0, 20));
      const ResidualBounds expected = Ask(envelope, query);
      const auto leaf = [&] { return static_cast<std::uint32_t>(random.Integer(0, 2 * count / 32)); };
      anywhere.found[0] = {leaf(), leaf()};
      for (ResidualBounds* bounds : {&after_last, &anywhere}) {
        envelope.Enclose(query.set(), *bounds);
        ASSERT_EQ(bounds->lower[0], expected.lower[0]);
        ASSERT_EQ(bounds->upper[0], expected.upper[0]);
      }
    }
  }
}

// Each observation by itself is an envelope of one: the best of them all is the envelope.
TEST_P(Search, FindsTheTightestBoundOfAllObservations) {
  TracedRandom random(720 + static_cast<std::uint64_t>(GetParam()));
  for (const int count : {1, 3, 40, 200}) {
    const Data data = Make(random, count, GetParam(), 1);
    const LipschitzEnvelope envelope = EnvelopeOf(data, {.max_flat_blocks = 0});
    for (int trial = 0; trial < 3; ++trial) {
      const Query query(random, 1, random.Integer(0, 20));
      double highest = -kInfinity, lowest = kInfinity;
      for (int i = 0; i < count; ++i) {
        Data one = data;
        one.observations = {data.observations.z.row(i), data.observations.lower.row(i), data.observations.upper.row(i)};
        const ResidualBounds bounds = Ask(EnvelopeOf(one, {}), query);
        highest = std::max(highest, bounds.lower[0]);
        lowest = std::min(lowest, bounds.upper[0]);
      }
      const ResidualBounds bounds = Ask(envelope, query);
      ASSERT_NEAR(bounds.lower[0], highest, 1e-12);
      ASSERT_NEAR(bounds.upper[0], lowest, 1e-12);
    }
  }
}

TEST_P(Search, WithACapIsWiderAndSaysSo) {
  TracedRandom random(740 + static_cast<std::uint64_t>(GetParam()));
  int capped = 0, wider = 0;
  for (const auto& [cap, count] :
       {std::pair(1, 3000), {1, 300}, {1, 3000}, {1, 300}, {2, 3000}, {3, 3000}, {4, 3000}}) {
    const Data data = Make(random, count, GetParam(), 1);
    const LipschitzEnvelope all = EnvelopeOf(data, {.max_leaf_visits = 1 << 20, .max_flat_blocks = kFlat});
    const LipschitzEnvelope some = EnvelopeOf(data, {.max_leaf_visits = cap, .max_flat_blocks = 0});
    for (int trial = 0; trial < 25; ++trial) {
      const Query query(random, 1, random.Integer(0, 20));
      const ResidualBounds expected = Ask(all, query), bounds = Ask(some, query);
      ASSERT_TRUE(std::isfinite(bounds.lower[0]) && std::isfinite(bounds.upper[0]));
      ASSERT_LE(bounds.lower[0], expected.lower[0]);
      ASSERT_GE(bounds.upper[0], expected.upper[0]);
      const bool differs = bounds.lower[0] != expected.lower[0] || bounds.upper[0] != expected.upper[0];
      ASSERT_TRUE(bounds.capped || !differs) << "wider, and does not say so";
      capped += bounds.capped;
      wider += differs;
    }
  }
  if (GetParam() > 0) EXPECT_GT(capped, 0);
  if (GetParam() > 3) EXPECT_GT(wider, 0);
}

INSTANTIATE_TEST_SUITE_P(ActiveColumns, Search, testing::Range(0, 15));

TEST(ObservationIndex, HoldsEveryObservationOnce) {
  TracedRandom random(760);
  for (const int count : {1, 8, 31, 33, 257, 5000})
    for (const int active : {1, 2, 3, 5}) {
      const Data data = Make(random, count, active, 1);
      const LipschitzRow row(data.declaration, 0);
      const ObservationIndex::Entries entries = EntriesOf(row, data.declaration, data.observations, 0);
      const ObservationIndex index(entries);
      const std::size_t k = index.num_coordinates();
      std::set<std::uint32_t> seen;
      for (std::size_t b = 0; b < index.num_leaves() * ObservationIndex::kLeafBlocks; ++b)
        for (std::size_t lane = 0; lane < kPackSize; ++lane) {
          const std::uint32_t id = index.ids(b)[lane];
          if (id == ObservationIndex::kNone) {
            ASSERT_EQ(index.block(b)[k].at(lane), -kInfinity);
            ASSERT_EQ(index.block(b)[k + 1].at(lane), -kInfinity);
            continue;
          }
          ASSERT_TRUE(seen.insert(id).second);
          ASSERT_EQ(index.block(b)[k].at(lane), entries.floors[id]);
          ASSERT_EQ(index.block(b)[k + 1].at(lane), -entries.ceilings[id]);
          for (std::size_t c = 0; c < k; ++c) ASSERT_EQ(index.block(b)[c].at(lane), entries.coordinates[id * k + c]);
        }
      ASSERT_EQ(seen.size(), static_cast<std::size_t>(count));
    }
}

// The first pair in the order i < j, as by trying them all.
std::optional<Violation> TryAll(const Data& data) {
  for (int i = 0; i < data.observations.size(); ++i)
    for (int j = i + 1; j < data.observations.size(); ++j)
      if (const auto violation = TestPair(data.declaration, data.observations, i, j, 0)) return violation;
  return std::nullopt;
}

TEST(FindViolation, AgreesWithTryingAllPairs) {
  int found = 0, tried = 0;
  for (TracedRandom random(770); random.Again(400);) {
    const int count = random.trial() < 360 ? random.Integer(1, 150) : random.Integer(300, 1200);
    Data data = Make(random, count, random.Integer(1, 14), std::ldexp(1, random.Integer(-300, 300)));
    // Residuals that keep to the declaration, often to its very edge, and here and there one that does not.
    Observations& o = data.observations;
    const double share = random.Coin() ? 1 : 0.7;
    for (int i = 0; i < count; ++i) o.lower(i, 0) = share * data.declaration.lipschitz.row(0).dot(o.z.row(i));
    o.upper = o.lower;
    if (random.Coin())
      for (int i = random.Integer(0, 2); i > 0; --i) o.upper(random.Below(count), 0) *= random.Uniform(0.5, 1.5);
    o.lower = o.lower.cwiseMin(o.upper);
    o.upper = o.lower;
    const auto expected = TryAll(data), violation = FindViolation(data.declaration, o);
    ASSERT_EQ(violation.has_value(), expected.has_value());
    ++tried;
    if (!expected) continue;
    ++found;
    ASSERT_EQ(violation->first, expected->first);
    ASSERT_EQ(violation->second, expected->second);
    ASSERT_EQ(violation->difference, expected->difference);
    ASSERT_EQ(violation->bound, expected->bound);
  }
  EXPECT_GT(found, 50);
  EXPECT_LT(found, tried - 50);
}

// Few locations and few residuals, many of them on the very edge of the declaration. Other columns differ.
Data MakeOfFewPlaces(Random& random) {
  const int count = random.Integer(1, 300), places = random.Integer(1, 6), active = random.Integer(1, 5);
  Data data = Make(random, count, active, 1);
  Observations& o = data.observations;
  data.declaration.noise_bound[0] = random.Coin() ? 0 : 0.125;
  const double unit = random.Coin() ? 0.125 : 0.1, edge = random.Sign();
  for (int i = 0; i < count; ++i) {
    for (int l = 0; l < kVariables; ++l)
      if (data.declaration.lipschitz(0, l) > 0) o.z(i, l) = unit * random.Below(places);
    o.lower(i, 0) = edge * data.declaration.lipschitz.row(0).dot(o.z.row(i));
    o.lower(i, 0) += data.declaration.noise_bound[0] * random.Integer(-1, 1);
    if (random.Coin(0.5 / count)) o.lower(i, 0) += std::ldexp(random.Sign(), -random.Integer(1, 54));
    o.upper(i, 0) = o.lower(i, 0) + (random.Coin(0.2) ? unit : 0);
  }
  return data;
}

TEST(FindViolation, FindsTheFirstPairOfManyRowsAtFewLocations) {
  Random random(774);
  SCOPED_TRACE(random.trace());
  int found = 0, late = 0;
  constexpr int kTrials = 600;
  for (int trial = 0; trial < kTrials; ++trial) {
    const Data data = MakeOfFewPlaces(random);
    const LipschitzEnvelope envelope = EnvelopeOf(data, {});
    const auto expected = TryAll(data);
    for (const LipschitzEnvelope* known : {static_cast<const LipschitzEnvelope*>(nullptr), &envelope}) {
      const auto violation = FindViolation(data.declaration, data.observations, known);
      ASSERT_EQ(violation.has_value(), expected.has_value()) << trial;
      if (!expected) continue;
      ASSERT_EQ(violation->first, expected->first) << trial;
      ASSERT_EQ(violation->second, expected->second) << trial;
      ASSERT_EQ(violation->difference, expected->difference) << trial;
      ASSERT_EQ(violation->bound, expected->bound) << trial;
    }
    if (!expected) continue;
    ++found;
    late += expected->first > 20;
  }
  EXPECT_GT(found, kTrials / 10);
  EXPECT_LT(found, kTrials - kTrials / 10);
  EXPECT_GT(late, 10);
}

// A robot that stands, with no noise declared: in the time that all pairs take, this test would not end.
TEST(FindViolation, TakesManyRowsAtOneLocation) {
  constexpr int kRows = 200'000;
  const Declaration declaration{Eigen::MatrixXd::Constant(1, 2, 0.3), Eigen::VectorXd::Zero(1)};
  Observations o{Eigen::MatrixXd::Constant(kRows, 2, 1.25), Eigen::MatrixXd::Constant(kRows, 1, 0.5), {}};
  o.upper = o.lower;
  EXPECT_FALSE(FindViolation(declaration, o));
  o.z.bottomRows(2).setConstant(-50);
  o.lower(kRows - 1, 0) = o.upper(kRows - 1, 0) = 0.25;
  EXPECT_FIELDS(FindViolation(declaration, o).value(), (first, kRows - 2), (second, kRows - 1));
}

TEST(FindViolation, TakesManyObservationsThatAllContradictEachOther) {
  Random random(771);
  Data data = Make(random, 30000, 2, 1);
  data.observations.lower = random.Matrix(30000, 1, 100);
  data.observations.upper = data.observations.lower;
  EXPECT_EQ(FindViolation(data.declaration, data.observations).value().first, 0);
}

TEST(PairSearch, FindsTheBestOtherEntryAmongTiesAndWithoutAFiniteMargin) {
  for (TracedRandom random(773); random.Again(200);) {
    const int count = random.Integer(1, random.trial() % 20 ? 70 : 600), active = random.Integer(1, 6);
    Data data = Make(random, count, active, 1);
    if (random.Coin()) {  // of few kinds, or of one
      const int kinds = random.Integer(1, 3);
      for (int i = kinds; i < count; ++i) {
        data.observations.z.row(i) = data.observations.z.row(i % kinds);
        data.observations.lower.row(i) = data.observations.lower.row(i % kinds);
        data.observations.upper.row(i) = data.observations.upper.row(i % kinds);
      }
    }
    const LipschitzRow row(data.declaration, 0);
    const auto entries = EntriesOf(row, data.declaration, data.observations, 0);
    const ObservationIndex index(entries);
    const auto value = [&](const PairSearch::Point& point, std::size_t side, int j) {
      const PairSearch::Point other = PointOf(entries, j);
      double distance = 0;
      for (std::size_t c = 0; c < point.coordinates.size(); ++c) {
        const double along = std::abs(point.coordinates[c] - other.coordinates[c]);
        distance = row.has_patterns() ? std::max(distance, along) : distance + along;
      }
      return (side == 0 ? other.floor : other.negated_ceiling) - distance;
    };
    for (const double margin : {MarginUpper(row, entries, data.observations), kInfinity}) {
      const PairSearch search(index, margin);
      for (int i = 0; i < count; i += 1 + count / 40)
        for (std::size_t side = 0; side < 2; ++side) {
          const PairSearch::Point point = PointOf(entries, i);
          const double own = side == 0 ? point.floor : point.negated_ceiling;
          double best = -kInfinity;
          for (int j = 0; j < count; ++j) {
            const PairSearch::Point other = PointOf(entries, j);
            const bool same = value(point, side, j) == own && (side == 0 ? other.floor : other.negated_ceiling) == own;
            if (j != i && !(same && j > i)) best = std::max(best, value(point, side, j));
          }
          const auto found = search.BestOther(point, side, static_cast<std::uint32_t>(i));
          ASSERT_EQ(found.value, best) << count << " entries, " << active << " columns";
          ASSERT_EQ(found.id == ObservationIndex::kNone, best == -kInfinity);
          if (found.id != ObservationIndex::kNone) {
            ASSERT_LT(found.id, ToSize(count));
            ASSERT_EQ(value(point, side, static_cast<int>(found.id)), best);
          }
        }
    }
  }
}

TEST(PairSearch, SaysTheSameOnEveryInstructionSet) {
  TracedRandom random(772);
  for (const int active : {1, 2, 3, 7}) {
    const Data data = Make(random, 700, active, 1);
    const LipschitzRow row(data.declaration, 0);
    const ObservationIndex index(EntriesOf(row, data.declaration, data.observations, 0));
    std::vector<std::vector<std::pair<std::uint32_t, std::uint32_t>>> pairs;
    for (const InstructionSet instructions : InstructionSets()) {
      pairs.emplace_back();
      EXPECT_FALSE(PairSearch(index, 1e-9, instructions).AnyPair([&](std::uint32_t i, std::uint32_t j) {
        pairs.back().emplace_back(i, j);
        return false;
      }));
    }
    EXPECT_FIELDS(pairs, (front().empty(), false), (front(), pairs.back()));
  }
}

}  // namespace forereach::observation_index_test
