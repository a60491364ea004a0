// Observations that grow: whatever way they came in, the store answers as an envelope of all of them does.
#include "tests/test.h"

#include <atomic>
#include <new>

#include "forereach/residual/observation_store.h"
#include "forereach/residual/retention.h"
#include "tests/oracle/traced_random.h"

namespace {

// Called once, at the next allocation of the thread that set it: what comes between two steps of one call.
thread_local std::function<void()>* at_next_allocation = nullptr;
thread_local std::size_t allocated = 0;  // bytes

}  // namespace

[[gnu::noinline]] void* operator new(std::size_t size) {
  if (at_next_allocation) (*std::exchange(at_next_allocation, nullptr))();
  allocated += size;
  if (void* memory = std::malloc(size > 0 ? size : 1)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  return std::malloc(size > 0 ? size : 1);
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace forereach::observation_store_test {

constexpr int kStates = 3, kVariables = 5;
const std::vector<double> kLower(kVariables, -1), kUpper(kVariables, 1);

// Row 0 is constant, row 1 has two columns, row 2 all five.
Declaration MakeDeclaration() {
  Declaration declaration{Eigen::MatrixXd::Zero(kStates, kVariables), Eigen::VectorXd::Constant(kStates, 1e-3)};
  declaration.lipschitz(1, 0) = 0.5;
  declaration.lipschitz(1, 3) = 1;
  declaration.lipschitz.row(2).setConstant(0.25);
  return declaration;
}

// An admissible residual, and what is seen of it.
double Truth(const Eigen::VectorXd& z, int k) {
  if (k == 0) return 0.5;
  if (k == 1) return 0.4 * std::sin(z[0]) - 0.8 * std::abs(z[3]);
  return 0.2 * (std::abs(z[1]) + std::cos(z[2]) - std::abs(z[4] - 0.3));
}

struct Sample {
  Eigen::VectorXd z, lower, upper;
};

Sample Observe(Random& random) {
  Sample sample{random.Vector(kVariables), Eigen::VectorXd(kStates), Eigen::VectorXd(kStates)};
  for (int k = 0; k < kStates; ++k) sample.lower[k] = Truth(sample.z, k) + random.Uniform(-1e-3, 1e-3);
  sample.upper = sample.lower;
  return sample;
}

Observations Join(const std::vector<Sample>& samples) {
  const auto count = static_cast<Eigen::Index>(samples.size());
  Observations all{Eigen::MatrixXd(count, kVariables), Eigen::MatrixXd(count, kStates),
                   Eigen::MatrixXd(count, kStates)};
  for (Eigen::Index i = 0; i < count; ++i) {
    const Sample& sample = samples[static_cast<std::size_t>(i)];
    all.z.row(i) = sample.z;
    all.lower.row(i) = sample.lower;
    all.upper.row(i) = sample.upper;
  }
  return all;
}

std::vector<Sample> Observe(Random& random, int count) {
  std::vector<Sample> samples;
  for (int i = 0; i < count; ++i) samples.push_back(Observe(random));
  return samples;
}

ObservationStore::Insertion Insert(ObservationStore& store, const Sample& sample) {
  return store.Insert(View(sample.z), View(sample.lower), View(sample.upper));
}

struct Query {
  Eigen::VectorXd center;
  Zonotope slice;
  Eigen::VectorXd input;
  std::vector<double> half_width;

  explicit Query(Random& random)
      : center(random.Vector(kVariables, 0.9)),
        slice(center.head(kStates), random.Matrix(kStates, 4, 0.01)),
        input(center.tail(2)),
        half_width(HalfWidths(slice)) {}
  [[nodiscard]] QuerySet set() const { return {slice, View(input), half_width}; }
};

ResidualBounds Ask(const ResidualEnclosure& enclosure, const Query& query) {
  ResidualBounds bounds;
  enclosure.Enclose(query.set(), bounds);
  return bounds;
}

// Bit for bit: what is known decides, and not when an index of it was built.
void ExpectSame(const ResidualEnclosure& a, const ResidualEnclosure& b, Random& random) {
  for (int trial = 0; trial < 10; ++trial) {
    const Query query(random);
    const ResidualBounds left = Ask(a, query), right = Ask(b, query);
    for (std::size_t k = 0; k < kStates; ++k) {
      ASSERT_EQ(left.lower[k], right.lower[k]) << "coordinate " << k;
      ASSERT_EQ(left.upper[k], right.upper[k]) << "coordinate " << k;
    }
  }
}

LipschitzEnvelope EnvelopeOf(const std::vector<Sample>& samples) {
  return LipschitzEnvelope(MakeDeclaration(), Join(samples), kLower, kUpper);
}

StoreOptions Options(int tail_capacity, std::size_t max_observations = 1'000'000) {
  return {.tail_capacity = tail_capacity, .max_observations = max_observations};
}

ObservationStore StoreOf(const std::vector<Sample>& samples, const StoreOptions& options = {}) {
  return ObservationStore(MakeDeclaration(), Join(samples), kLower, kUpper, options);
}

// Both observations of the contradiction.
void ExpectKept(const ObservationStore::Snapshot& snapshot) {
  const std::vector<int> ids = snapshot.ids();
  EXPECT_TRUE(std::ranges::is_sorted(ids));
  for (const int id : {snapshot.violation()->first, snapshot.violation()->second})
    EXPECT_EQ(std::ranges::count(ids, id), 1) << id;
}

TEST(ObservationStore, AnswersAsAnEnvelopeOfAllItHolds) {
  TracedRandom random(800);
  for (const int capacity : {1, 7, 8, 64}) {
    std::vector<Sample> samples = Observe(random, 30);
    ObservationStore store = StoreOf(samples, Options(capacity));
    for (int i = 0; i < 150; ++i) {
      samples.push_back(Observe(random));
      const auto insertion = Insert(store, samples.back());
      ASSERT_EQ(insertion.id, 30 + i);
      ASSERT_FALSE(insertion.violation);
      ASSERT_EQ(store.snapshot().size(), samples.size());
      ASSERT_LE(store.tail_size(), capacity);
      if (i % 13 == 0) ExpectSame(store.snapshot(), EnvelopeOf(samples), random);
      if (HasFatalFailure()) return;
    }
  }
}

// Indexes of all for every full tail would take sixteen times as much.
TEST(ObservationStore, IndexesFourTimesAsManyInLittleMoreThanFourTimesTheWork) {
  TracedRandom random(816);
  const auto work = [&](int count) {
    ObservationStore store = StoreOf(Observe(random, 30), Options(16));
    const std::vector<Sample> samples = Observe(random, count);
    const std::size_t before = allocated;
    for (const Sample& sample : samples) Insert(store, sample);
    return static_cast<double>(allocated - before);
  };
  const double few = work(1000);
  EXPECT_LT(work(4000), 7 * few);
}

TEST(ObservationStore, ALargeValueCostsNoIndex) {
  TracedRandom random(817);
  ObservationStore store = StoreOf(Observe(random, 4000));
  Sample large = Observe(random);
  large.lower[1] = large.upper[1] = 1000;
  const std::size_t before = allocated;
  Insert(store, large);
  EXPECT_LT(allocated - before, 200'000u) << "an index of 4,000 has half a megabyte";
  EXPECT_EQ(store.tail_size(), 1);
}

// Each is larger than all before, and the rounding of none is bounded: the row has no finite bound any more.
TEST(ObservationStore, TakesValuesBeyondWhichNothingIsBounded) {
  TracedRandom random(818);
  ObservationStore store = StoreOf(Observe(random, 20));
  for (const double value : {0x1.8p959, 0x1.8p960, 0x1p1000, 0x1p1023}) {
    Sample large = Observe(random);
    large.lower[1] = large.upper[1] = value;
    Insert(store, large);
  }
  EXPECT_EQ(store.snapshot().size(), 24u);
  const ResidualBounds bounds = Ask(store.snapshot(), Query(random));
  EXPECT_EQ(bounds.lower[1], -std::numeric_limits<double>::infinity());
  EXPECT_EQ(bounds.upper[1], std::numeric_limits<double>::infinity());
  EXPECT_LT(bounds.upper[0], 1e300);
}

TEST(ObservationStore, ASnapshotStaysAsItWas) {
  TracedRandom random(801);
  const std::vector<Sample> samples = Observe(random, 20);
  ObservationStore store = StoreOf(samples, Options(16));
  const auto before = store.snapshot();
  for (int i = 0; i < 100; ++i) Insert(store, Observe(random));
  EXPECT_EQ(before.size(), 20u);
  ExpectSame(before, EnvelopeOf(samples), random);
}

TEST(ObservationStore, FindsTheContradictionWhereverItIs) {
  for (TracedRandom random(802); random.Again(120);) {
    const int coordinate = random.trial() % kStates;
    std::vector<Sample> samples = Observe(random, 40);
    ObservationStore store = StoreOf(samples, Options(random.trial() % 2 ? 64 : 8));
    for (int i = 0; i < random.Integer(0, 20); ++i) {
      samples.push_back(Observe(random));
      Insert(store, samples.back());
    }
    Sample liar = Observe(random);
    liar.lower[coordinate] += random.Sign() * random.Uniform(0, 1.5);
    liar.upper = liar.lower;
    samples.push_back(liar);
    const auto insertion = Insert(store, liar);
    const auto expected = FindViolation(MakeDeclaration(), Join(samples));
    for (const std::size_t most : {samples.size(), samples.size() / 2}) {  // all are kept, or some if there is none
      StoreOptions options;
      options.max_observations = most;
      const auto at_load = StoreOf(samples, options).snapshot().violation();
      ASSERT_EQ(at_load.has_value(), expected.has_value());
      if (!expected) continue;
      ASSERT_EQ(at_load->first, expected->first);
      ASSERT_EQ(at_load->second, expected->second);
      ASSERT_EQ(at_load->coordinate, expected->coordinate);
    }
    ASSERT_EQ(insertion.violation.has_value(), expected.has_value());
    ASSERT_EQ(store.snapshot().violation().has_value(), expected.has_value());
    if (!expected) continue;
    ASSERT_EQ(insertion.violation->coordinate, coordinate);
    ASSERT_EQ(insertion.violation->second, insertion.id);
    ASSERT_TRUE(TestPair(MakeDeclaration(), Join(samples), insertion.violation->first, insertion.id, coordinate));
    ExpectKept(store.snapshot());
    store.Compact();
    ASSERT_TRUE(store.snapshot().violation()) << "forgotten";
    ExpectKept(store.snapshot());
  }
}

// As a robot that often stands records them, on the very edge of the noise bound, and here and there beyond it.
TEST(ObservationStore, FindsWhatAllPairsOfRowsAtFewLocationsShow) {
  Random random(815);
  SCOPED_TRACE(random.trace());
  int contradictions = 0;
  for (int trial = 0; trial < 60; ++trial) {
    const std::vector<Sample> places = Observe(random, random.Integer(1, 4));
    std::vector<Sample> samples{places[0]};
    ObservationStore store = StoreOf(samples, Options(random.Integer(1, 40)));
    for (int i = 0; i < 60; ++i) {
      Sample next = places[static_cast<std::size_t>(random.Below(static_cast<int>(places.size())))];
      for (int k = 0; k < kStates; ++k) {
        next.lower[k] = Truth(next.z, k) + 1e-3 * random.Integer(-1, 1);
        if (random.Coin(0.003)) next.lower[k] += 1e-4 * random.Sign();
      }
      next.upper = next.lower;
      if (random.Coin(0.3)) next.upper[random.Below(kStates)] += 1e-3;
      samples.push_back(next);
      const Observations all = Join(samples);
      bool expected = false;
      for (int j = 0; j <= i; ++j)
        for (int k = 0; k < kStates; ++k) expected |= TestPair(MakeDeclaration(), all, j, i + 1, k).has_value();
      ASSERT_EQ(Insert(store, next).violation.has_value(), expected) << "row " << i << " of trial " << trial;
      contradictions += expected;
    }
  }
  EXPECT_GT(contradictions, 20);
}

TEST(ObservationStore, TakesValuesFarAboveThoseItBeganWith) {
  Random random(804);
  std::vector<Sample> samples = Observe(random, 3);
  for (Sample& sample : samples) sample.lower[1] *= 1e-6, sample.upper[1] = sample.lower[1];
  ObservationStore store = StoreOf(samples);
  for (int i = 0; i < 30; ++i) {
    samples.push_back(Observe(random));
    samples.back().lower[1] *= std::ldexp(1, i - 20);
    samples.back().upper[1] = samples.back().lower[1];
    Insert(store, samples.back());
    ASSERT_EQ(store.snapshot().size(), samples.size());
    ExpectSame(store.snapshot(), EnvelopeOf(samples), random);
  }
}

TEST(ObservationStore, RefusesWhatIsNoObservationOfThisDomain) {
  Random random(805);
  ObservationStore store = StoreOf(Observe(random, 3));
  for (const double bad : {1.0000000000000002, -2.0, kInfinity, std::nan("")}) {
    Sample sample = Observe(random);
    sample.z[2] = bad;
    EXPECT_EQ(Insert(store, sample).id, -1);
    sample = Observe(random);
    sample.upper[1] = std::isnan(bad) || bad == kInfinity ? bad : sample.lower[1] - 1e-9;
    EXPECT_EQ(Insert(store, sample).id, -1);
  }
  Sample corner = Observe(random);
  corner.z.setOnes();
  for (int k = 0; k < kStates; ++k) corner.lower[k] = corner.upper[k] = Truth(corner.z, k);
  EXPECT_EQ(Insert(store, corner).id, 3);
  EXPECT_EQ(store.snapshot().size(), 4u);
}

TEST(ObservationStore, RefusesOptionsOutsideTheirRange) {
  Random random(806);
  const std::vector<Sample> samples = Observe(random, 2);
  EXPECT_THROW(StoreOf(samples, Options(0)), std::invalid_argument);
  EXPECT_THROW(StoreOf(samples, Options(EnvelopeTail::kMaxCapacity + 1)), std::invalid_argument);
  EXPECT_THROW(StoreOf(samples, Options(8, 0)), std::invalid_argument);
  EXPECT_THROW(StoreOf({}), std::invalid_argument);
}

// Readers ask while one thread inserts and another compacts: what they get is sound, and each snapshot is one thing.
TEST(ObservationStore, IsReadWhileItGrows) {
  TracedRandom random(807);
  ObservationStore store = StoreOf(Observe(random, 50), Options(32));
  std::atomic<bool> done = false;
  std::atomic<int> wrong = 0, asked = 0;
  const auto read = [&](std::uint64_t seed) {
    Random own(seed);
    std::size_t last = 0;
    while (!done) {
      const auto snapshot = store.snapshot();
      if (snapshot.size() < last || snapshot.violation()) ++wrong;
      last = snapshot.size();
      const Query query(own);
      const ResidualBounds first = Ask(snapshot, query), second = Ask(snapshot, query);
      for (std::size_t k = 0; k < kStates; ++k) {
        const double truth = Truth(query.center, static_cast<int>(k));
        if (!(first.lower[k] <= truth && truth <= first.upper[k])) ++wrong;
        if (first.lower[k] != second.lower[k] || first.upper[k] != second.upper[k]) ++wrong;
      }
      ++asked;
    }
  };
  std::vector<std::thread> threads;
  threads.emplace_back(read, 1);
  threads.emplace_back(read, 2);
  threads.emplace_back([&] {
    while (!done) {
      if (store.tail_size() > 20) store.Compact();
      std::this_thread::yield();
    }
  });
  for (int i = 0; i < 1500; ++i) {
    ASSERT_EQ(Insert(store, Observe(random)).id, 50 + i);
    if (i % 50 == 0) std::this_thread::yield();
  }
  while (asked < 200) std::this_thread::yield();
  done = true;
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(wrong, 0);
  EXPECT_EQ(store.snapshot().size(), 1550u);
}

// Compact merges the tail, then builds the index: what is inserted between both has to be in the new tail.
TEST(ObservationStore, CompactKeepsWhatArrivesWhileItBuilds) {
  TracedRandom random(811);
  for (const int arrivals : {1, 2, 9}) {
    std::vector<Sample> samples = Observe(random, 40);
    ObservationStore store = StoreOf(samples, Options(32));
    for (int i = 0; i < 5; ++i) samples.push_back(Observe(random)), Insert(store, samples.back());
    std::vector<int> ids;
    std::function<void()> arrive = [&] {
      for (int i = 0; i < arrivals; ++i) {
        samples.push_back(Observe(random));
        ids.push_back(Insert(store, samples.back()).id);
      }
    };
    at_next_allocation = &arrive;
    store.Compact();
    ASSERT_EQ(at_next_allocation, nullptr) << "Compact allocated nothing";
    ASSERT_EQ(std::ssize(ids), arrivals);
    EXPECT_EQ(ids.front(), 45);
    EXPECT_FIELDS(store, (snapshot().size(), samples.size()), (tail_size(), arrivals));
    ExpectSame(store.snapshot(), EnvelopeOf(samples), random);
    store.Compact();
    EXPECT_FIELDS(store, (tail_size(), 0), (snapshot().size(), samples.size()));
    ExpectSame(store.snapshot(), EnvelopeOf(samples), random);
  }
}

TEST(ObservationStore, CompactKeepsAContradictionThatArrivesWhileItBuilds) {
  TracedRandom random(812);
  std::vector<Sample> samples = Observe(random, 40);
  ObservationStore store = StoreOf(samples, Options(32, 200));
  Sample liar = samples[7];
  liar.lower[1] += 0.5, liar.upper = liar.lower;
  std::function<void()> arrive = [&] { Insert(store, liar); };
  at_next_allocation = &arrive;
  store.Compact();
  for (int round = 0; round < 3; ++round, store.Compact()) {
    ASSERT_TRUE(store.snapshot().violation());
    ExpectKept(store.snapshot());
  }
}

TEST(GrowingRows, ASnapshotStaysAndSharesWhatIsFull) {
  GrowingRows rows(2);
  const auto append = [](GrowingRows& to, double value) { std::ranges::fill(to.Append(), value); };
  for (int i = 0; i < 600; ++i) append(rows, i);
  for (const std::size_t count : {0, 1, 255, 256, 257, 512, 600}) {
    GrowingRows first = rows.First(count);
    append(first, -1);
    append(rows, -2);
    EXPECT_FIELDS(first, (size(), count + 1), (operator[](count)[1], -1));
    for (std::size_t i = 0; i < 600; ++i) ASSERT_EQ(rows[i][0], i) << count;
    for (std::size_t i = 0; i < count; ++i)
      ASSERT_EQ(&first[i][0] == &rows[i][0], i < count / 256 * 256) << i << " of " << count;
    EXPECT_EQ(rows[rows.size() - 1][0], -2);
  }
  GrowingRows reserved(2);
  reserved.Reserve(257);
  append(reserved, 0);
  const double* const begin = &reserved[0][0];
  for (int i = 1; i < 1000; ++i) append(reserved, i);
  EXPECT_EQ(&reserved[0][0], begin) << "rows do not move";
}

// With a contradiction among them nothing is dropped for want of room, however often the index is built anew.
TEST(ObservationStore, AContradictionOutlivesAnyNumberOfCompactions) {
  for (TracedRandom random(813); random.Again(20);) {
    ObservationStore store = StoreOf(Observe(random, 30), Options(16, 40));
    const Sample honest = Observe(random);
    Sample liar = honest;
    const int coordinate = random.trial() % kStates;
    liar.lower[coordinate] += random.Sign() * 0.02, liar.upper = liar.lower;
    Insert(store, honest);
    ASSERT_FALSE(store.snapshot().violation());
    const auto insertion = Insert(store, liar);
    ASSERT_TRUE(insertion.violation);
    for (int round = 0; round < 4; ++round) {
      for (int i = 0; i < 20; ++i) Insert(store, Observe(random));
      store.Compact();
      const auto snapshot = store.snapshot();
      ASSERT_TRUE(snapshot.violation()) << "round " << round;
      ASSERT_EQ(snapshot.violation()->second, insertion.id);
      ExpectKept(snapshot);
    }
  }
}

TEST(EnvelopeTail, BoundsAreRoundedOutwardAndValuesBeyondTheLimitAreNotCovered) {
  for (TracedRandom random(814); random.Again(500);) {
    Declaration declaration = MakeDeclaration();
    for (double& sigma : declaration.noise_bound) sigma = std::ldexp(random.Uniform(0.5, 1), -random.Integer(0, 8));
    const std::vector<Sample> samples = Observe(random, 4);
    const LipschitzEnvelope envelope(declaration, Join(samples), kLower, kUpper);
    EnvelopeTail tail(declaration, envelope, 4);
    const Sample sample = Observe(random);
    tail.Append(View(sample.z), View(sample.lower), View(sample.upper));
    for (int k = 0; k < kStates; ++k) {
      const long double sigma = declaration.noise_bound[k];  // both sums are exact in 64 bits
      const double floor = tail.HighestFloor(k, 1), ceiling = -tail.HighestNegatedCeiling(k, 1);
      EXPECT_LE(floor, sample.lower[k] - sigma);
      EXPECT_GE(ceiling, sample.upper[k] + sigma);
      EXPECT_GT(NextUp(floor), sample.lower[k] - sigma);
      EXPECT_LT(NextDown(ceiling), sample.upper[k] + sigma);
      if (envelope.row(k).is_constant()) continue;
      const double limit = SubDown(envelope.value_limit(k), declaration.noise_bound[k]);
      for (const double sign : {1.0, -1.0}) {
        Sample large{sample.z, Eigen::VectorXd::Zero(kStates), Eigen::VectorXd::Zero(kStates)};
        large.lower[k] = large.upper[k] = sign * limit;
        EXPECT_TRUE(tail.Covers(View(large.lower), View(large.upper)));
        (sign > 0 ? large.upper : large.lower)[k] = sign * NextUp(limit);
        EXPECT_FALSE(tail.Covers(View(large.lower), View(large.upper)));
      }
    }
  }
}

TEST(ObservationStore, HoldsAtMostItsLargestNumberOfObservations) {
  TracedRandom random(808);
  std::vector<Sample> samples = Observe(random, 30);
  ObservationStore store = StoreOf(samples, Options(32, 100));
  for (int i = 0; i < 1000; ++i) {
    Insert(store, Observe(random));
    ASSERT_LE(store.snapshot().size(), 132u);
  }
  store.Compact();
  EXPECT_LE(store.snapshot().size(), 100u);
  EXPECT_GE(store.snapshot().size(), 50u);
}

TEST(MostUseful, KeepsEveryBoundWhileAllThatAttainTheEnvelopeHaveRoom) {
  Declaration declaration = MakeDeclaration();
  declaration.lipschitz.row(2).setZero();  // so that some never attain it
  for (TracedRandom random(810); random.Again(20);) {
    std::vector<Sample> samples = Observe(random, 60);
    for (Sample& sample : samples) {
      sample.lower[2] = sample.upper[2] = 0.1 + random.Uniform(-1e-3, 1e-3);
      sample.upper[1] += random.Uniform(0, 0.8);  // seen badly
      sample.lower[1] -= random.Uniform(0, 0.8);
    }
    for (int i = 0; i < 30; ++i)
      samples.push_back(samples[static_cast<std::size_t>(random.Below(60))]);  // twice the same
    const Observations all = Join(samples);
    const std::vector<int> kept = MostUseful(declaration, all, 89);
    ASSERT_LT(kept.size(), 61u) << "a duplicate stayed";
    ASSERT_TRUE(std::ranges::is_sorted(kept));
    const LipschitzEnvelope before(declaration, all, kLower, kUpper),
        after(declaration, Select(all, kept), kLower, kUpper);
    for (int query = 0; query < 20; ++query) {
      const Query ask(random);
      const ResidualBounds expected = Ask(before, ask), bounds = Ask(after, ask);
      for (std::size_t k = 0; k < kStates; ++k) {
        ASSERT_NEAR(bounds.lower[k], expected.lower[k], 1e-14);
        ASSERT_NEAR(bounds.upper[k], expected.upper[k], 1e-14);
      }
    }
    // None of them can go without a change at its own place.
    for (const int i : kept) {
      std::vector<int> others = kept;
      std::erase(others, i);
      const LipschitzEnvelope without(declaration, Select(all, others), kLower, kUpper);
      const Eigen::VectorXd z = all.z.row(i);
      const Zonotope point(z.head(kStates), Eigen::MatrixXd(kStates, 0));
      const std::vector<double> half_width(kStates, 0);
      const Eigen::VectorXd input = z.tail(2);
      ResidualBounds with_it, without_it;
      after.Enclose({point, View(input), half_width}, with_it);
      without.Enclose({point, View(input), half_width}, without_it);
      bool changes = false;
      for (std::size_t k = 0; k < kStates; ++k)
        changes |= without_it.lower[k] < with_it.lower[k] || without_it.upper[k] > with_it.upper[k];
      ASSERT_TRUE(changes) << "observation " << i;
    }
  }
}

// As a robot that stands still records it.
Observations SameRows(int count, int columns) {
  return {Eigen::MatrixXd::Constant(count, columns, 0.1), Eigen::MatrixXd::Constant(count, 1, 0.001),
          Eigen::MatrixXd::Constant(count, 1, 0.001)};
}

TEST(MostUseful, KeepsOnlyTheFirstOfEqualRows) {
  EXPECT_TRUE(MostUseful({Eigen::MatrixXd::Ones(1, 2), Eigen::VectorXd::Zero(1)}, SameRows(0, 2), 1).empty());
  for (const int columns : {1, 2, 3, 4, 14})  // in the metrics of one to three columns, and of more
    for (const int count : {1, 2, 3, 7, 8, 9, 31, 32, 33, 255, 256, 257, 1000}) {
      const Declaration declaration{Eigen::MatrixXd::Constant(1, columns, 0.1), Eigen::VectorXd::Zero(1)};
      for (const std::size_t most : {std::size_t{1}, ToSize(std::max(1, count - 1))})
        EXPECT_EQ(MostUseful(declaration, SameRows(count, columns), most), std::vector<int>{0})
            << count << " rows, at most " << most << ", " << columns << " columns";
    }
}

TEST(MostUseful, KeepsOnlyTheFirstOfRowsThatDifferWhereLHasNoColumn) {
  TracedRandom random(811);
  Declaration declaration{Eigen::MatrixXd::Zero(1, 3), Eigen::VectorXd::Zero(1)};
  declaration.lipschitz(0, 1) = 0.1;
  Observations o = SameRows(500, 3);
  o.z.col(0) = random.Vector(500);
  o.z.col(2) = random.Vector(500);
  EXPECT_EQ(MostUseful(declaration, o, 10), std::vector<int>{0});
}

TEST(MostUseful, KeepsTheFirstOfEachKindOfRow) {
  const Declaration declaration{Eigen::MatrixXd::Constant(1, 2, 1), Eigen::VectorXd::Zero(1)};
  for (TracedRandom random(812); random.Again(50);) {
    const int kinds = random.Integer(1, 40);
    Observations o = SameRows(random.Integer(kinds + 1, 400), 2);
    std::vector<int> first(ToSize(kinds), -1), expected;
    for (int i = 0; i < o.size(); ++i) {
      const int kind = i < kinds ? i : random.Below(kinds);
      o.z(i, 0) = kind;  // far enough apart that each attains the envelope
      if (first[ToSize(kind)] < 0) expected.push_back(first[ToSize(kind)] = i);
    }
    EXPECT_EQ(MostUseful(declaration, o, ToSize(kinds)), expected);
  }
}

TEST(MostUseful, KeepsSomethingOfValuesNearOverflow) {
  const Declaration declaration{Eigen::MatrixXd::Constant(1, 2, 1), Eigen::VectorXd::Zero(1)};
  TracedRandom random(813);
  Observations o = SameRows(100, 2);
  o.lower = random.Matrix(100, 1, 1e308);
  o.upper = o.lower;
  EXPECT_EQ(MostUseful(declaration, o, 7).size(), 1u);  // no bound is finite, so none is lost
}

TEST(ObservationStore, BoundsAsOneRowDoesWhenTheSameRowIsRepeated) {
  TracedRandom random(814);
  const Sample row = Observe(random);
  for (const int count : {1, 2, 9, 10, 11, 100}) {  // below, at and above the budget
    const std::vector<Sample> rows(ToSize(count), row);
    const ObservationStore one = StoreOf(rows, Options(32, 10)), other = StoreOf(rows, Options(32, 10));
    EXPECT_EQ(one.snapshot().size(), count <= 10 ? ToSize(count) : 1u);
    EXPECT_FALSE(one.snapshot().violation());
    ExpectSame(one.snapshot(), other.snapshot(), random);
    ExpectSame(one.snapshot(), StoreOf({row}, Options(32, 10)).snapshot(), random);
  }
}

TEST(MostUseful, DropsTheObservationThatNarrowsLeast) {
  // Far apart on a line, all but two that stand close together: either may go, not both.
  Declaration declaration{Eigen::MatrixXd::Constant(1, 1, 1), Eigen::VectorXd::Zero(1)};
  Observations o{Eigen::MatrixXd(5, 1), Eigen::MatrixXd::Zero(5, 1), Eigen::MatrixXd::Zero(5, 1)};
  o.z << -10, -5, 0, 0.001, 10;
  const std::vector<int> four = MostUseful(declaration, o, 4);
  EXPECT_EQ(std::ranges::count_if(four, [](int i) { return i == 2 || i == 3; }), 1);
  EXPECT_EQ(four.size(), 4u);
  const std::vector<int> three = MostUseful(declaration, o, 3);
  EXPECT_EQ(three.size(), 3u);
  EXPECT_EQ(std::ranges::count_if(three, [](int i) { return i == 2 || i == 3; }), 1);
  EXPECT_EQ(MostUseful(declaration, o, 1).size(), 1u);
}

}  // namespace forereach::observation_store_test
