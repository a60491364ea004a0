// By how many rows a robot follows its commands late: logs of a model whose commands act 0, 1 or 2 rows later.
#include "identify/command_delay.h"

#include "tests/test.h"

#include "forereach/dynamics/text_model.h"
#include "tests/identify/seed.h"
#include "tests/text_models.h"
#include "tests/worlds.h"

namespace forereach::command_delay_test {

struct CommandDelayTest : testing::Test {
  CommandDelayTest() {
    options_.period = 0.1;
    options_.tolerance = 1e-6;
    options_.factors.assign(3, 1);
    options_.input_tolerance = Vec({0});
  }

  // p' = v, v' = u, in rows of 0.1 s / rows_in_step. Each command holds for `hold` rows and acts `late` rows later.
  LogTable Log(int late, double noise, int hold = 1, int rows_in_step = 1, bool varies = true, int rows = 300) {
    const double h = 0.1 / rows_in_step;
    std::normal_distribution<double> normal(0, 1);
    std::uniform_real_distribution<double> command(-1, 1);
    std::vector<double> u(static_cast<std::size_t>(rows));
    for (std::size_t i = 0; i < u.size(); ++i)
      u[i] = !varies ? 0.3 : i % static_cast<std::size_t>(hold) == 0 ? command(random_) : u[i - 1];
    LogTable table;
    table.path = "log.csv";
    table.values.resize(rows, 4);
    double p = 0, v = 0;
    for (int i = 0; i < rows; ++i) {
      table.values.row(i) << i * h, p + noise * normal(random_), v + noise * normal(random_), u[ToSize(i)];
      table.lines.push_back(i + 2);
      table.after_loss.push_back(false);
      const double acting = i < late ? u[0] : u[ToSize(i - late)];
      p += h * v + h * h / 2 * acting;
      v += h * acting;
    }
    return table;
  }
  CommandDelay Estimate(const LogTable& table, int most = 4) const {
    const LogTable* const tables[] = {&table};
    return EstimateDelay(tables, problem_, options_, most);
  }

  std::mt19937 random_{20261};
  Problem problem_ =
      WorldOf(MakeTextModel(TextModel({{"p", "p + dt*v + dt*dt/2*u"}, {"v", "v + dt*u"}}, {"u"}, {{"dt", 0.1, 0.1}})),
              Within({99, 9}), Within({1}));
  ImportOptions options_;
};

TEST_F(CommandDelayTest, IsFoundWithAndWithoutNoise) {
  for (const int late : {0, 1, 2})
    for (const double noise : {0.0, 0.003, 0.03}) {
      const CommandDelay delay = Estimate(Log(late, noise));
      EXPECT_TRUE(delay.IsKnown()) << late << " " << noise << ": " << delay.least << " to " << delay.largest;
      EXPECT_EQ(delay.best, late) << noise;
      ASSERT_EQ(delay.error.size(), 5u);
      EXPECT_LT(delay.error[ToSize(late)][1], delay.error[3][1]);
    }
}

TEST_F(CommandDelayTest, IsFoundInRowsThatAreFinerThanAStep) {
  for (const int late : {0, 3, 7}) {
    const CommandDelay delay = Estimate(Log(late, 0.001, 5, 5, true, 3000), 10);
    EXPECT_TRUE(delay.IsKnown()) << delay.least << " to " << delay.largest;
    EXPECT_EQ(delay.best, late);
  }
}

TEST_F(CommandDelayTest, CannotBeToldWhereTheInputDoesNotVaryOrTheNoiseHidesIt) {
  for (const LogTable& table : {Log(1, 0.001, 1, 1, false), Log(1, 0, 1, 1, false), Log(1, 5)}) {
    const CommandDelay delay = Estimate(table);
    EXPECT_FALSE(delay.IsKnown()) << delay.best;
    EXPECT_FIELDS(delay, (least, 0), (largest, 4));
  }
  EXPECT_FALSE(Estimate(Log(1, 0, 1, 1, true, 3)).IsKnown()) << "too short";
}

TEST_F(CommandDelayTest, ShiftedCommandsAreThoseThatAct) {
  options_.command_delay = 2;
  const LogTable table = Log(2, 0, 1, 1, true, 8);
  const ImportedLog log = Import(table, problem_, options_);
  EXPECT_THAT(log.lines, ElementsAre(4, 5, 6, 7, 8)) << "no command is known of the first two rows";
  EXPECT_EQ(log.At(Dropped::kNoInput).count, 2);
  for (Eigen::Index i = 0; i < log.transitions.size(); ++i)
    EXPECT_NEAR(log.transitions.x_next(i, 1), log.transitions.z(i, 1) + 0.1 * log.transitions.z(i, 2), 1e-12);
}

TEST_F(CommandDelayTest, DoesNotReachOverALostRow) {
  options_.command_delay = 1;
  LogTable table = Log(1, 0, 1, 1, true, 6);
  table.after_loss[3] = true;
  EXPECT_THAT(Import(table, problem_, options_).lines, ElementsAre(3, 6));
}

}  // namespace forereach::command_delay_test
