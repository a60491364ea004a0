// Transitions of logs: which samples make one, which do not and why, and what is said of their errors.
#include "identify/import.h"

#include "tests/test.h"

#include "task/config_error.h"
#include "tests/identify/seed.h"
#include "tests/worlds.h"

namespace forereach::import_test {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// A sample of the point mass: stamp, position, velocity, force; the rest is zero.
struct Row {
  double t, px = 0, ax = 0;
};

struct ImportTest : testing::Test {
  ImportTest() {
    options_.period = 0.1;
    options_.tolerance = 1e-9;
    options_.factors.assign(6, 1);
    options_.input_tolerance = Eigen::Vector2d::Zero();
  }

  ImportedLog From(const std::vector<Row>& rows) {
    table_ = {};
    table_.path = "log.csv";
    table_.values = Eigen::MatrixXd::Zero(std::ssize(rows), 7);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      table_.values(row, 0) = rows[i].t;
      table_.values(row, 1) = rows[i].px;
      table_.values(row, 5) = rows[i].ax;
      table_.lines.push_back(static_cast<int>(i) + 2);
      table_.after_loss.push_back(false);
    }
    return Again();
  }
  ImportedLog Again() { return Import(table_, problem_, options_); }

  Problem problem_ = WorldOf(MakePointMass(0.1), Within({9, 9, 3, 3}), Within({1, 1}));
  ImportOptions options_;
  LogTable table_;
};

// Beside a first stamp of another clock all others would be one moment.
TEST_F(ImportTest, AFirstStampFarAwayDoesNotShiftTheOthers) {
  EXPECT_EQ(From({{1e300}, {0}, {0.05}, {0.09}, {0.3}}).transitions.size(), 0);
  EXPECT_EQ(From({{1e300}, {0}, {0.05}, {0.1}, {0.3}}).transitions.size(), 1);
  EXPECT_LE(Again().largest_offset, options_.tolerance);
}

TEST_F(ImportTest, AStepGoesFromAStampToTheOneThatIsDtLater) {
  const ImportedLog log = From({{0, 1}, {0.05, 2}, {0.1, 3}, {0.15, 4}, {0.2, 5}, {0.25, 6}});
  EXPECT_THAT(log.lines, ElementsAre(2, 4));
  EXPECT_FIELDS(log.transitions, (z(0, 0), 1), (x_next(0, 0), 3), (x_next(1, 0), 5));
  EXPECT_EQ(log.At(Dropped::kEnd).count, 2) << "from 0.2 and 0.25";
  options_.overlapping = true;
  EXPECT_THAT(Again().lines, ElementsAre(2, 3, 4, 5));
}

TEST_F(ImportTest, AStampMayBeOffByTheToleranceAndNotByMore) {
  options_.tolerance = 0.0078125;
  EXPECT_EQ(From({{0}, {0.1 + 0.0078125}}).transitions.size(), 1);
  EXPECT_DOUBLE_EQ(Again().largest_offset, 0.0078125);
  EXPECT_EQ(From({{0}, {0.1 - 0.0078}}).transitions.size(), 1);
  EXPECT_EQ(From({{0}, {0.05}, {0.1 + 0.00782}}).transitions.size(), 0);
  EXPECT_EQ(Again().At(Dropped::kGap).count, 1);
  EXPECT_DOUBLE_EQ(Again().median_gap, 0.00782);
  EXPECT_EQ(From({{0}, {0.05}, {0.1 - 0.00782}, {0.3}}).At(Dropped::kGap).count, 3);
  EXPECT_NEAR(Again().median_gap, 0.05 + 0.00782, 1e-12) << "from 0.05 to the stamp before 0.15";
  EXPECT_NEAR(Again().largest_gap, 0.1 + 0.00782, 1e-12) << "from 0.1 - 0.00782 to 0.3";
}

TEST_F(ImportTest, TheRoundingOfStampsIsNoDistanceUnlessItIsLarge) {
  options_.tolerance = 0;
  EXPECT_EQ(From({{0.2}, {0.1 + 0.2}, {0.4}, {0.5}}).transitions.size(), 3) << "0.1 + 0.2 is not 0.3";
  EXPECT_EQ(Again().largest_offset, 0);
  EXPECT_EQ(From({{0.2}, {0.3 + 1e-15}}).transitions.size(), 0);
  EXPECT_EQ(From({{1e9}, {1e9 + 0.1}}).transitions.size(), 1);
  EXPECT_EQ(From({{1e12}, {1e12 + 0.1}}).transitions.size(), 0) << "0.0001 s are between two doubles";
}

TEST_F(ImportTest, CountsTheRowsThatLieInATransition) {
  (void)From({{0}, {0.05}, {0.1}, {0.15}, {0.2}, {0.25}, {kNan}});
  EXPECT_EQ(Again().rows, 7);
  EXPECT_EQ(Again().rows_used, 5) << "0 to 0.2";
  options_.overlapping = true;
  EXPECT_EQ(Again().rows_used, 6) << "0 to 0.25, each row once";
  options_.until = 0.1;
  EXPECT_EQ(Again().rows, 4) << "0 to 0.1, and one without a stamp";
}

TEST_F(ImportTest, OfTwoStampsTheNearerOneCounts) {
  options_.tolerance = 0.01;
  EXPECT_EQ(From({{0}, {0.098, 1}, {0.103, 2}}).transitions.x_next(0, 0), 1);
  EXPECT_EQ(From({{0}, {0.097, 1}, {0.102, 2}}).transitions.x_next(0, 0), 2);
}

TEST_F(ImportTest, RealStampsAreLargeAndLoseNothing) {
  options_.tolerance = 1e-6;
  const double unix_time = 1726473661.9480767;
  EXPECT_EQ(From({{unix_time}, {unix_time + 0.1}, {unix_time + 0.2}}).transitions.size(), 2);
  options_.time_unit = 1e-3L;
  EXPECT_EQ(From({{1e12}, {1e12 + 100}, {1e12 + 200}}).transitions.size(), 2);
}

TEST_F(ImportTest, TheInputHoldsFromItsStampToTheNextAndMayNotChangeBefore) {
  EXPECT_EQ(From({{0, 0, 0.5}, {0.05, 0, 0.5}, {0.1, 0, 0.7}}).transitions.z(0, 4), 0.5)
      << "the input that begins with the end of the step is not of the step";
  EXPECT_EQ(From({{0, 0, 0.5}, {0.05, 0, 0.6}, {0.1, 0, 0.5}}).transitions.size(), 0);
  EXPECT_EQ(Again().At(Dropped::kInputChanges).first, "ax");
  options_.input_tolerance[0] = 0.6 - 0.5;
  EXPECT_EQ(Again().transitions.size(), 1);
  EXPECT_DOUBLE_EQ(Again().input_deviation[0], 0.1);
  options_.input_tolerance[0] = std::nextafter(0.6 - 0.5, 0);
  EXPECT_EQ(Again().transitions.size(), 0);
  options_.input_mean = true;
  EXPECT_DOUBLE_EQ(Again().transitions.z(0, 4), 0.55);
  EXPECT_NEAR(Again().input_deviation[0], 0.05, 1e-15);
}

TEST_F(ImportTest, AMeanIsOverTimeAndNotOverRows) {
  options_.input_mean = true;
  const ImportedLog log = From({{0, 0, 1}, {0.075, 0, 0}, {0.08, 0, 0}, {0.1, 0, 0}});
  ASSERT_EQ(log.transitions.size(), 1);
  EXPECT_DOUBLE_EQ(log.transitions.z(0, 4), 0.75);
}

TEST_F(ImportTest, TriesTheNextSampleWhenAStepCannotStartAtThisOne) {
  // Inputs change at 0.05, 0.15, 0.25: only steps that start there have one input.
  const ImportedLog log =
      From({{0, 0, 1}, {0.05, 1, 0}, {0.1, 2, 0}, {0.15, 3, 1}, {0.2, 4, 1}, {0.25, 5, 0}, {0.3, 6, 0}});
  EXPECT_THAT(log.lines, ElementsAre(3, 5));
  EXPECT_EQ(log.At(Dropped::kInputChanges).count, 1);
}

TEST_F(ImportTest, NoTransitionSpansALostRowOrAStampThatDoesNotIncrease) {
  (void)From({{0, 1}, {0.05, 2}, {0.1, 3}});
  table_.after_loss[1] = true;
  table_.lost.Add(3);
  EXPECT_EQ(Again().transitions.size(), 0);
  EXPECT_EQ(Again().At(Dropped::kRowLost).count, 1);
  EXPECT_EQ(From({{0, 1}, {0.05, 2}, {0.05, 2}, {0.1, 3}}).transitions.size(), 1) << "a row that repeats another";
  EXPECT_EQ(Again().At(Dropped::kRepeatedRow).count, 1);
  EXPECT_EQ(From({{0, 1}, {0.05, 2}, {0.05, 2.5}, {0.1, 3}}).transitions.size(), 0) << "which one is true?";
  EXPECT_EQ(Again().At(Dropped::kRepeatedStamp).count, 2);
  EXPECT_EQ(From({{0, 1}, {kNan, 2}, {0.1, 3}}).transitions.size(), 0);
  EXPECT_EQ(Again().At(Dropped::kNoStamp).count, 1);
  const ImportedLog log = From({{5, 1}, {5.1, 2}, {0, 3}, {0.1, 4}, {5.2, 5}});
  EXPECT_THAT(log.lines, ElementsAre(2, 4)) << "a second log behind the first";
  EXPECT_EQ(log.At(Dropped::kBackwards).count, 1);
}

TEST_F(ImportTest, OnlyFiniteStatesInTheDomainCount) {
  EXPECT_EQ(From({{0, kNan}, {0.1, 1}}).At(Dropped::kNoState).first, "px");
  EXPECT_EQ(From({{0, 1}, {0.1, kNan}, {0.2, 1}}).At(Dropped::kNoState).count, 2);
  EXPECT_EQ(From({{0, 1}, {0.05, kNan}, {0.1, 1}}).transitions.size(), 1) << "a state within the step is not needed";
  EXPECT_EQ(From({{0, 1}, {0.05, 1, kNan}, {0.1, 1}}).At(Dropped::kNoInput).count, 1);
  EXPECT_EQ(From({{0, 9}, {0.1, 10}, {0.2, 9}}).transitions.size(), 1) << "the successor may lie outside";
  EXPECT_EQ(Again().At(Dropped::kOutsideDomain).first, "px 10");
  EXPECT_EQ(From({{0, 0, 1.001}, {0.1, 0}}).At(Dropped::kOutsideDomain).first, "ax 1.001");
}

TEST_F(ImportTest, AStartThatItsErrorsMayTakeOutOfTheDomainIsDropped) {
  problem_.declaration.state_error = Vec({0.5, 0, 0, 0});
  EXPECT_EQ(From({{0, 8.5}, {0.1, 9}}).transitions.size(), 1) << "exactly at the edge";
  EXPECT_EQ(From({{0, std::nextafter(8.5, 9)}, {0.1, 9}}).transitions.size(), 0);
  EXPECT_EQ(Again().At(Dropped::kNearTheEdge).count, 1);
}

TEST_F(ImportTest, UnwrapsAnglesTheShortWayAround) {
  const double pi = std::numbers::pi;
  options_.unwrapped = {0};
  const ImportedLog log = From({{0, pi - 0.1}, {0.1, -pi + 0.1}, {0.2, pi - 0.2}});
  ASSERT_EQ(log.transitions.size(), 2);
  EXPECT_NEAR(log.transitions.x_next(0, 0), pi + 0.1, 1e-15);
  EXPECT_NEAR(log.transitions.x_next(1, 0), -pi - 0.2, 1e-15);
  EXPECT_NEAR(log.transitions.z(1, 0), -pi + 0.1, 1e-15) << "the state stays what it was";
}

TEST_F(ImportTest, UnitsAreConvertedInOneRounding) {
  options_.factors[0] = std::numbers::pi_v<long double> / 180;
  const ImportedLog log = From({{0, 90}, {0.1, -33}});
  EXPECT_EQ(log.transitions.z(0, 0), std::numbers::pi / 2);
  EXPECT_EQ(log.transitions.x_next(0, 0), static_cast<double>(-33 * std::numbers::pi_v<long double> / 180));
}

TEST_F(ImportTest, WithoutStampsTheRowsHaveARate) {
  (void)From({{0}, {0}, {0}, {0}, {0}});
  table_.values = table_.values.rightCols(6).eval();
  options_.time_unit = 0;
  options_.row_spacing = 1.0 / 20;
  EXPECT_EQ(Again().transitions.size(), 2);
}

TEST_F(ImportTest, TakesOnlyStepsInsideTheWindowOfTime) {
  options_.from = 0.1;
  options_.until = 0.3;
  EXPECT_THAT(From({{7}, {7.1}, {7.2}, {7.3}, {7.4}}).lines, ElementsAre(4)) << "7.1 and 7.3 lie just outside";
  options_.from = 0.0999;
  options_.until = 0.3001;
  EXPECT_THAT(Again().lines, ElementsAre(3, 4));
}

TEST_F(ImportTest, ALogThatIsTooCoarseIsRefused) {
  EXPECT_THAT(
      [&] {
        (void)From({{0}, {0.2}, {0.4}, {0.6}});
      },
      ThrowsMessage<ConfigError>(HasSubstr("typically 0.2 s apart, and a step of the task is 0.1 s")));
}

// Every transition is of two rows of the log, with stamps and input as promised; every start is counted once.
TEST_F(ImportTest, KeepsItsPromisesOnRandomLogs) {
  const unsigned seed = SeedOf(1);
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  const auto chance = [&](int percent) { return static_cast<int>(random() % 100) < percent; };
  std::uniform_real_distribution<double> jitter(-0.003, 0.003);
  for (int trial = 0; trial < 300; ++trial) {
    std::vector<Row> rows;
    double t = 0;
    for (int i = 0; i < 60; ++i) {
      t += chance(5) ? 0.08 : 0.02;
      if (chance(2)) t -= 0.3;
      rows.push_back({chance(2) ? kNan : t + jitter(random), chance(3) ? kNan : t, chance(20) ? 0.5 : 0.25});
      if (chance(3)) rows.push_back(rows.back());
    }
    options_.tolerance = 0.005;
    options_.input_mean = chance(50);
    options_.overlapping = chance(50);
    const ImportedLog log = From(rows);
    ASSERT_EQ(log.transitions.size(), std::ssize(log.lines));
    std::int64_t starts = log.transitions.size();
    for (const Dropped cause : {Dropped::kEnd, Dropped::kGap, Dropped::kNoState, Dropped::kNoInput,
                                Dropped::kInputChanges, Dropped::kOutsideDomain, Dropped::kNoNominalValue})
      starts += log.At(cause).count;
    if (options_.overlapping) EXPECT_EQ(starts, log.samples);
    EXPECT_LE(starts, log.samples);
    for (std::size_t i = 0; i < log.lines.size(); ++i) {
      const auto begin = static_cast<std::size_t>(log.lines[i] - 2);
      const auto row = static_cast<Eigen::Index>(i);
      EXPECT_EQ(log.transitions.z(row, 0), rows[begin].px);
      std::size_t end = begin;
      while (end < rows.size() && rows[end].px != log.transitions.x_next(row, 0)) ++end;
      ASSERT_LT(end, rows.size()) << "the successor is a row of the log";
      EXPECT_LE(std::abs(rows[end].t - rows[begin].t - 0.1), 0.005 + 1e-12);
      for (std::size_t between = begin; between < end; ++between) {
        EXPECT_LE(rows[between].t, rows[between + 1].t);
        EXPECT_LE(std::abs(log.transitions.z(row, 4) - (options_.input_mean ? 0.375 : rows[between].ax)),
                  options_.input_mean ? 0.125 + 1e-12 : 0);
      }
    }
  }
}

}  // namespace forereach::import_test
