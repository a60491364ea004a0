// CSV files, plans and transitions.
#include "task/csv.h"

#include <bit>

#include "forereach/dynamics/models/named_models.h"
#include "tests/task/task_files.h"

namespace forereach::csv_test {

struct CsvTest : testing::Test {
  std::string Error(const std::string& text) {
    return files_.Cut(Thrown<ConfigError>([&] { (void)ReadCsv(files_.Write("t.csv", text), {"a", "b"}); }));
  }

  ScratchDirectory files_;
};

TEST_F(CsvTest, ColumnsMayStandInAnyOrderAndWhiteSpaceDoesNotCount) {
  Eigen::MatrixXd expected(2, 2);
  expected << 1, 2, 3, -4;
  for (const char* text : {"a,b\n1,2\n3,-4\n", "b,a\n2,1\n-4,3", " b ,\ta\r\n2 , 1\r\n-4,  3\r\n",
                           "\xef\xbb\xbf"
                           "a,b\n1,2\n3,-4\n"})
    EXPECT_EQ(ReadCsv(files_.Write("t.csv", text), {"a", "b"}), expected) << text;
}

TEST_F(CsvTest, ErrorsNameLineColumnAndValue) {
  EXPECT_EQ(Error("a,b\n1,2\n3,x\n"), "t.csv:3: b: 'x' is not a number");
  EXPECT_EQ(Error("a,b\nnan,2\n"), "t.csv:2: a: 'nan' is not a finite number");
  EXPECT_EQ(Error("b,a\n1,-inf\n"), "t.csv:2: a: '-inf' is not a finite number");
  EXPECT_EQ(Error("a,b\n1,\n"), "t.csv:2: b: '' is not a number");
  EXPECT_EQ(Error("a,b\n1,0x2\n"), "t.csv:2: b: '0x2' is not a number");
  EXPECT_EQ(Error("a,b\n1\n"), "t.csv:2: 1 fields, the header has 2");
  EXPECT_EQ(Error("a,b\n1,2,3\n"), "t.csv:2: 3 fields, the header has 2; numbers have a decimal point, not a comma");
  EXPECT_EQ(Error("a,b\n\n1,2\n"), "t.csv:2: a blank line; only the end of the file may have some");
  EXPECT_EQ(Error("a,b\n1,2\n \n\n1,2\n"), "t.csv:3: a blank line; only the end of the file may have some");
}

TEST_F(CsvTest, BlankLinesMayEndTheFile) {
  for (const char* text : {"a,b\n1,2\n\n", "a,b\n1,2\n\n\n", "a,b\r\n1,2\r\n\r\n", "a,b\n1,2\n \t"})
    EXPECT_EQ(ReadCsv(files_.Write("t.csv", text), {"a", "b"}), (Eigen::MatrixXd(1, 2) << 1, 2).finished()) << text;
  EXPECT_EQ(ReadCsv(files_.Write("t.csv", "a\n1\n\n"), {"a"}).rows(), 1);
  EXPECT_EQ(ReadCsv(files_.Write("t.csv", "a,b\n\n"), {"a", "b"}).rows(), 0);
}

TEST_F(CsvTest, RefusesAWrongHeader) {
  EXPECT_EQ(Error("a,c\n"), "t.csv:1: unknown column 'c'; the columns are a, b");
  EXPECT_EQ(Error("a,b,a\n"), "t.csv:1: a: duplicate column");
  EXPECT_EQ(Error("b\n"), "t.csv:1: a: the column is missing");
  EXPECT_EQ(Error(""), "t.csv:1: the file is empty; it has to begin with the header a, b");
  EXPECT_EQ(Error("1,2\n"), "t.csv:1: unknown column '1'; the columns are a, b");
  EXPECT_EQ(
      Error("a;b\n1;2\n"),
      "t.csv:1: the columns are separated by semicolons; put commas in their place, and decimal points in numbers");
  EXPECT_THAT(Error("a b\n"), HasSubstr("separated by blanks"));
  EXPECT_THAT(Error("a\tb\n"), HasSubstr("separated by tabs"));
  EXPECT_THAT([&] { (void)CsvColumns(files_.Write("t.csv", "a;b\n")); },
              ThrowsMessage<ConfigError>(HasSubstr("separated by semicolons")));
}

TEST_F(CsvTest, OtherColumnsOfTransitionsNameTheImport) {
  EXPECT_THAT([&] { (void)LoadTransitions(files_.Write("t.csv", "t,px\n"), *MakePointMass(0.1)); },
              ThrowsMessage<ConfigError>(
                  HasSubstr("vy_next; `forereach import` makes transitions of a log with other columns")));
  EXPECT_THAT([&] { (void)LoadTransitions(files_.Write("t.csv", "px;py\n"), *MakePointMass(0.1)); },
              ThrowsMessage<ConfigError>(HasSubstr("in numbers; `forereach import` makes transitions")));
}

TEST_F(CsvTest, RefusesMissingFilesAndDirectories) {
  EXPECT_THAT([&] { (void)ReadCsv(files_ / "none.csv", {"a"}); },
              ThrowsMessage<ConfigError>(HasSubstr("none.csv: cannot be read: No such file or directory")));
  EXPECT_THAT([&] { (void)ReadCsv(files_ / "", {"a"}); }, ThrowsMessage<ConfigError>(HasSubstr("is a directory")));
  EXPECT_THAT([&] { WriteCsv(files_ / "no/such/place.csv", {"a"}, Eigen::MatrixXd::Zero(1, 1)); },
              ThrowsMessage<ConfigError>(HasSubstr("place.csv: cannot be written: No such file or directory")));
}

// Any finite double, by its bits: every exponent, subnormals and both zeros.
double AnyDouble(std::mt19937_64& random) {
  for (;;) {
    const double value = std::bit_cast<double>(random());
    if (std::isfinite(value)) return value;
  }
}

Eigen::MatrixXd AnyMatrix(std::mt19937_64& random, int rows, int columns) {
  Eigen::MatrixXd matrix(rows, columns);
  for (double& entry : matrix.reshaped()) entry = AnyDouble(random);
  matrix(0, 0) = -0.0;
  matrix(rows - 1, 0) = std::numeric_limits<double>::denorm_min();
  return matrix;
}

bool SameBits(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  return a.rows() == b.rows() && a.cols() == b.cols() &&
         std::memcmp(a.data(), b.data(), static_cast<std::size_t>(a.size()) * sizeof(double)) == 0;
}

TEST_F(CsvTest, PlansAndTransitionsComeBackToTheLastBit) {
  constexpr std::uint64_t kSeed = 20240611;
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  std::mt19937_64 random(kSeed);
  const auto model = MakeKinematicBicycle(0.1, 2.5);

  const Eigen::MatrixXd controls = AnyMatrix(random, 2, kMaxSteps);
  SavePlan(files_ / "plan.csv", *model, controls);
  EXPECT_TRUE(SameBits(LoadPlan(files_ / "plan.csv", *model), controls));

  const Transitions transitions{AnyMatrix(random, 500, 8), AnyMatrix(random, 500, 6)};
  SaveTransitions(files_ / "steps.csv", *model, transitions);
  const Transitions loaded = LoadTransitions(files_ / "steps.csv", *model);
  EXPECT_TRUE(SameBits(loaded.z, transitions.z));
  EXPECT_TRUE(SameBits(loaded.x_next, transitions.x_next));
  EXPECT_EQ(loaded.longer.size(), 0);
  Transitions timed = transitions;
  timed.longer = 0.049 * Eigen::VectorXd::Random(500).cwiseAbs();
  SaveTransitions(files_ / "steps.csv", *model, timed);
  EXPECT_TRUE(SameBits(LoadTransitions(files_ / "steps.csv", *model).longer, timed.longer));
}

TEST_F(CsvTest, AStepLastsLessThanHalfAStepLongerOrShorter) {
  const auto model = MakePointMass(0.1);
  const auto longer = [&](const std::string& number) {
    return LoadTransitions(files_.Write("t.csv", "dt_error,px,py,vx,vy,ax,ay,px_next,py_next,vx_next,vy_next\n" +
                                                     number + ",0,0,0,0,0,0,0,0,0,0\n"),
                           *model)
        .longer[0];
  };
  for (const char* number : {"0", "1e-320", "0.049999"}) EXPECT_EQ(longer(number), std::strtod(number, nullptr));
  for (const char* number : {"-0.001", "0.05", "1"})
    EXPECT_THAT(
        [&] { longer(number); },
        ThrowsMessage<ConfigError>(HasSubstr("t.csv:2: dt_error: " + std::string(number) + " is outside [0, 0.05)")));
}

// The model's own variable of the name is that column, and a duration has no place.
TEST_F(CsvTest, AVariableOfTheColumnsNameIsNoDuration) {
  const Config config = LoadConfig(
      files_.Write(
          "task.yaml",
          "model: {states: {dt_error: m}, inputs: {u: m}, parameters: {dt: 0.1}, next: {dt_error: dt_error + dt*u}}\n"
          "domain: {state: {lower: [-1], upper: [1]}, input: {lower: [-1], upper: [1]}}\n"
          "declaration: {lipschitz: {}, noise_bound: [0]}\ntransitions: t.csv\n"
          "task: {initial_set: {center: [0], half_width: [0]}, projection: [dt_error], between: samples, obstacles: "
          "[]}\n"),
      TransitionsFile::kIgnore);
  const NominalModel& model = *config.problem->model;
  Transitions steps = LoadTransitions(files_.Write("t.csv", "dt_error,u,dt_error_next\n0.5,0,0.5\n"), model);
  EXPECT_EQ(steps.z(0, 0), 0.5);
  EXPECT_EQ(steps.longer.size(), 0);
  steps.longer = Eigen::VectorXd::Constant(1, 0.01);
  EXPECT_THROW(SaveTransitions(files_ / "t.csv", model, steps), ConfigError);
}

TEST_F(CsvTest, PlansHaveOneColumnAStepInTheModelsOrder) {
  const auto model = MakeKinematicBicycle(0.1, 2.5);
  Eigen::MatrixXd expected(2, 3);
  expected << 1, 3, 5, 2, 4, 6;
  EXPECT_EQ(LoadPlan(files_.Write("p.csv", "steer_rate,jerk\n2,1\n4,3\n6,5\n"), *model), expected);
}

TEST_F(CsvTest, PlansHaveOneToTheLargestNumberOfSteps) {
  const auto model = MakePointMass(0.1);
  const auto plan = [&](int steps) {
    std::string text = "ax,ay\n";
    for (int t = 0; t < steps; ++t) text += "0,0\n";
    return LoadPlan(files_.Write("p.csv", text), *model).cols();
  };
  EXPECT_EQ(plan(1), 1);
  EXPECT_EQ(plan(kMaxSteps), kMaxSteps);
  EXPECT_THAT([&] { (void)plan(0); }, ThrowsMessage<ConfigError>(HasSubstr("p.csv:2: 0 steps are outside [1, 128]")));
  EXPECT_THAT([&] { (void)plan(kMaxSteps + 1); },
              ThrowsMessage<ConfigError>(HasSubstr("p.csv:130: 129 steps are outside [1, 128]")));
}

}  // namespace forereach::csv_test
