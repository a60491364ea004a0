// The experiment on a real car, with drives of a car that is made up here and whose equations and noise are known.
#include "research/real/real.h"

#include <cstdio>

#include "tests/test.h"

#include "forereach/certify/certifier.h"
#include "research/real/recording.h"
#include "research/real/study.h"
#include "task/config.h"
#include "task/config_error.h"
#include "tests/paths.h"
#include "tests/shell.h"

namespace forereach::research::real_test {

namespace fs = std::filesystem;

constexpr const char* kHeader =
    "elapsed time sensors,current,voltage,acc x (IMU),acc y (IMU),W (IMU),vel encoder,safety_value,throttle,steering,"
    "vicon time,vicon x,vicon y,vicon yaw\n";

struct MadeUpCar {
  double gain = 2.5, lag = 0.07;                // curvature by steering, 1/m; time constant of the yaw rate, s
  double place_noise = 5e-5, yaw_noise = 5e-4;  // standard deviations, m and rad
  double throttle = 0.3;                        // it drives at about 8.6 times (this - 0.1), in m/s
  bool cut = false;                             // the safety switch, for good
  bool asked_late = false;                      // the log asks for commands every 0.1 s, whenever they were given
  double delay = 0;                             // s from a command to the servo
};

// A log in the recorder's format: motion capture at 100 Hz, commands that change every half second, held between.
std::string MakeLog(const MadeUpCar& car, double seconds, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::string text = kHeader;
  std::uniform_int_distribution<int> early(0, 9);
  double x = 0, y = 0, yaw = 3, v = 0, r = 0, steer = 0, throttle = car.throttle, logged = 0;
  std::vector<double> given;  // commands by row
  constexpr int kFine = 10;   // steps of 1 ms in a row
  int next = 0;               // row of the next command
  for (int i = 0; i < seconds * 100; ++i) {
    if (i >= next) {
      steer = 0.6 * uniform(random), throttle = car.throttle + 0.02 * uniform(random);
      next = 50 * (i / 50 + 1) + (car.asked_late ? early(random) : 0);
    }
    given.push_back(steer);
    if (!car.asked_late || i % 10 == 0) logged = steer;
    const double c = std::cos(yaw), s = std::sin(yaw);
    const double body_x = x + 0.115 * c + 0.01 * s, body_y = y + 0.115 * s - 0.01 * c, body_yaw = yaw - 0.007686;
    char line[256];
    std::snprintf(line, sizeof line, "%.2f,0,0,0,0,0,0,%d,%.6f,%.6f,%.6f,%.9f,%.9f,%.9f\n", 0.1 * (i / 10),
                  car.cut ? 0 : 1, throttle, logged, 1726473661.25 + 0.01 * i + 0.0001 * (1 + uniform(random)),
                  body_x + car.place_noise * normal(random), body_y + car.place_noise * normal(random),
                  std::remainder(body_yaw + car.yaw_noise * normal(random), 2 * std::numbers::pi));
    text += line;
    for (int j = 0; j < kFine; ++j) {
      constexpr double kDt = 0.001;
      x += kDt * v * std::cos(yaw), y += kDt * v * std::sin(yaw), yaw += kDt * r;
      v += kDt * (7 * (throttle - 0.1) - 0.8 * v);
      const double felt = given[static_cast<std::size_t>(std::max(0, i - static_cast<int>(100 * car.delay)))];
      r += kDt * (v * car.gain * felt - r) / car.lag;
    }
  }
  return text;
}

struct RealTest : testing::Test {
  [[nodiscard]] Drive DriveOf(const MadeUpCar& car, double seconds, unsigned seed) const {
    const std::string path = scratch_.Write("drive" + std::to_string(seed) + ".csv", MakeLog(car, seconds, seed));
    return TransitionsOf(ReadRecording(path, car.asked_late ? kMeanAge : 0), driving_);
  }
  void ExpectRefusal(const std::string& text, const std::string& message) const {
    const std::string path = scratch_.Write("bad.csv", text);
    EXPECT_THAT([&] { (void)ReadRecording(path); }, ThrowsMessage<ConfigError>(HasSubstr(path + message)));
  }

  const ScratchDirectory scratch_;
  const Problem driving_ = DrivingProblem();
};

TEST_F(RealTest, StatesAreThoseOfTheRearAxle) {
  // A circle of radius 0.8 m at 1.6 m/s, steered by a constant, without noise: r is 2 rad/s everywhere.
  std::string log = kHeader;
  for (int i = 0; i < 400; ++i) {
    const double t = 0.01 * i, yaw = 2 * t, c = std::cos(yaw), s = std::sin(yaw);
    char line[256];
    std::snprintf(line, sizeof line, "0,0,0,0,0,0,0,1,0.3,%.3f,%.6f,%.12f,%.12f,%.12f\n", i < 200 ? 0.25 : 0.5, 100 + t,
                  0.8 * s + 0.115 * c + 0.01 * s, -0.8 * c + 0.115 * s - 0.01 * c,
                  std::remainder(yaw - 0.007686, 2 * std::numbers::pi));
    log += line;
  }
  const std::string path = scratch_.Write("circle.csv", log);
  const Recording recording = ReadRecording(path, 0);
  const auto& values = recording.table.values;
  ASSERT_GT(values.rows(), 390);
  for (Eigen::Index i = 10; i < 390; ++i) {
    const double yaw = 0.02 * static_cast<double>(i);
    EXPECT_NEAR(values(i, 1), 0.8 * std::sin(yaw), 1e-5) << i;
    EXPECT_NEAR(values(i, 2), -0.8 * std::cos(yaw), 1e-5) << i;
    EXPECT_NEAR(values(i, 3), yaw, 1e-6) << i;  // without jumps at pi
    EXPECT_NEAR(values(i, 4), 1.6, 2e-3) << i;
    EXPECT_NEAR(values(i, 5), 2, 1e-4) << i;
  }
  EXPECT_EQ(values(190, 6), 0.25);
  EXPECT_NEAR(values(205, 6), 0.375, 0.026);  // half of the step before, give or take a row
  EXPECT_EQ(values(215, 6), 0.5);
  EXPECT_TRUE(std::isnan(values(5, 6)));

  const auto& aged = ReadRecording(path, 0.05).table.values;
  EXPECT_EQ(values(197, 7), 0.25);
  EXPECT_EQ(values(203, 7), 0.5);
  EXPECT_EQ(aged(192, 7), 0.25);
  EXPECT_EQ(aged(198, 7), 0.5) << "given 50 ms before the log has it";
  EXPECT_EQ(aged(198, 5), values(198, 5));
}

TEST_F(RealTest, KnowsTheErrorOfItsStates) {
  const MadeUpCar car{.place_noise = 1e-3, .yaw_noise = 5e-3};
  const Recording recording = ReadRecording(scratch_.Write("noisy.csv", MakeLog(car, 30, 1)));
  // Quadratics through 7 samples 10 ms apart: the value's variance is 1/3 of the noise's, the slope's 1/28 of it per
  // spacing squared.
  EXPECT_NEAR(recording.deviation[0] * std::sqrt(3) / 1e-3, 1, 0.1);
  EXPECT_NEAR(recording.deviation[2] * std::sqrt(3) / 5e-3, 1, 0.1);
  EXPECT_NEAR(recording.deviation[3] * std::sqrt(28) * 0.01 / 1e-3, 1, 0.1);
  EXPECT_NEAR(recording.deviation[4] * std::sqrt(28) * 0.01 / 5e-3, 1, 0.1);
  EXPECT_EQ(recording.deviation[5], 0);
}

TEST_F(RealTest, MeasuresHowLateSteeringIsFelt) {
  // The made-up car answers to half after lag * log 2, and the fit of 35 ms to either side adds nothing to that.
  const std::string path = scratch_.Write("lag.csv", MakeLog({.lag = 0.07, .yaw_noise = 1e-5}, 40, 1));
  for (const double age : {0.0, 0.05}) {  // counted from where the log has the command
    const std::vector<double> delays = SteeringDelays(ReadRecording(path, age));
    ASSERT_GT(delays.size(), 5u);
    for (const double delay : delays) EXPECT_NEAR(delay, 0.07 * std::log(2), 0.015);
  }
}

TEST_F(RealTest, OnlyStepsInWhichTheCarDrivesCount) {
  const Drive drive = DriveOf({}, 20, 1);
  ASSERT_GT(drive.transitions.size(), 100);
  EXPECT_GT(drive.samples_outside, 10);
  EXPECT_GE(drive.transitions.z.col(3).minCoeff(), 1);
  EXPECT_GE(drive.transitions.z.col(7).minCoeff(), 0.2);
  // The state `before` is the command of the step, whose means the two sides round differently.
  EXPECT_LT((drive.transitions.x_next.col(5) - drive.transitions.z.col(6)).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_EQ(DriveOf({.cut = true}, 20, 2).transitions.size(), 0);
}

TEST_F(RealTest, OnlyWhatTheOthersCoverIsJudged) {
  const Drive slow = DriveOf({.throttle = 0.3}, 30, 1), fast = DriveOf({.throttle = 0.33}, 30, 2);
  for (const bool growing : {false, true}) {
    const Judgement judged = Judge(Learn(FitTo(driving_, Whole(slow)), {.growing = growing}), Whole(fast), 5);
    EXPECT_GT(judged.outside_domain, 50);
    EXPECT_GT(judged.transitions, 5);
    EXPECT_EQ(judged.outside_domain + judged.transitions, fast.transitions.size());
    EXPECT_LE(5 * std::ssize(judged.windows), judged.transitions);
  }
}

TEST_F(RealTest, EachDriveLiesWithinWhatGrowsAndNotOnlyMostOfAll) {
  const Drive quiet = DriveOf({}, 30, 1), noisy = DriveOf({.lag = 0.12, .yaw_noise = 3e-3}, 15, 2);
  std::vector<Stretch> both = Whole(quiet);
  both.push_back(Whole(noisy).front());
  const Fitted fitted = FitTo(driving_, both);
  ASSERT_EQ(fitted.ends, (std::vector<int>{quiet.transitions.size(), fitted.transitions.size()}));
  for (const double quantile : {0.9, 1.0}) {
    const Learned learned = Learn(fitted, {.quantile = quantile, .growing = true});
    const Eigen::VectorXd& base = learned.problem->declaration.disturbance;
    EXPECT_EQ(base[0], base[1]);
    EXPECT_EQ(learned.growth[0], learned.growth[1]);
    int begin = 0;
    for (const int end : fitted.ends) {
      Eigen::ArrayXi beyond = Eigen::ArrayXi::Zero(6);
      for (int i = begin; i < end; ++i) {
        const Eigen::RowVectorXd z = fitted.transitions.z.row(i);
        const Eigen::ArrayXd w = base + z[3] * std::abs(z[6] - z[5]) * learned.growth;
        beyond +=
            (fitted.fit.after.row(i).transpose().array().abs() > fitted.state_error.array() + w * (1 + 1e-12) + 1e-12)
                .cast<int>();
      }
      EXPECT_LE(beyond.maxCoeff(), (1 - quantile) * (end - begin)) << quantile;
      begin = end;
    }
    EXPECT_EQ(learned.left_out, fitted.transitions.size() - learned.problem->transitions.size());
  }
}

TEST_F(RealTest, AGrowingDisturbanceIsNarrowerWhereCommandsComeAtUnknownTimes) {
  const MadeUpCar car{.asked_late = true};
  const Drive first = DriveOf(car, 30, 1), second = DriveOf(car, 30, 2), left_out = DriveOf(car, 30, 3);
  std::vector<Stretch> learn = Whole(first);
  learn.push_back(Whole(second).front());
  const Fitted fitted = FitTo(driving_, learn);
  const Learned growing = Learn(fitted, {.quantile = 1, .growing = true});
  EXPECT_GT(growing.growth[4], 0);
  const Judgement one = Judge(Learn(fitted, {.quantile = 1}), Whole(left_out), 5),
                  grown = Judge(growing, Whole(left_out), 5);
  EXPECT_GE(grown.inside(), 0.99 * grown.slices());
  EXPECT_LT(*grown.HalfWidth(), *one.HalfWidth());
}

TEST_F(RealTest, AffineRowsLeaveMoreThanConstantOnes) {
  const MadeUpCar car{.lag = 0.12, .throttle = 0.33};
  const Drive drive = DriveOf(car, 30, 1), left_out = DriveOf(car, 30, 2);
  const Fitted fitted = FitTo(driving_, Whole(drive));
  const auto learn = [&](double quantile, bool affine) {
    return Learn(fitted, {.quantile = quantile, .growing = true, .affine = affine});
  };
  const Learned affine = learn(0.9, true);
  const Judgement rows = Judge(affine, Whole(left_out), 5), constant = Judge(learn(0.9, false), Whole(left_out), 5);
  EXPECT_GT(*rows.HalfWidth(), *constant.HalfWidth());
  EXPECT_LT(rows.contradicting, constant.contradicting);
  // The yaw rate lags behind the command as no plane does; what w covers whole refutes none.
  const auto plain = RefuteAffine(fitted, affine, 4, false), disturbed = RefuteAffine(fitted, affine, 4, true);
  ASSERT_TRUE(plain && disturbed);
  EXPECT_LE(plain->after, disturbed->after);
  EXPECT_FALSE(RefuteAffine(fitted, learn(1, true), 4, true));
}

TEST_F(RealTest, AHiddenStateThatMattersIsSeen) {
  const auto shares = [&](const MadeUpCar& car, unsigned seed) {
    const Drive drive = DriveOf(car, 20, seed);
    std::map<std::string, double> left;  // of the yaw rate
    for (const HiddenState& state : HiddenStates(FitTo(driving_, Whole(drive)), drive))
      left[state.name] = state.left[4];
    return left;
  };
  auto plain = shares({}, 1), delayed = shares({.delay = 0.2}, 2);
  EXPECT_LT(delayed.at("steering command two steps before"), 0.8);
  EXPECT_GT(plain.at("throttle a step before"), 0.9);
  EXPECT_LE(plain.at("all of them"), plain.at("throttle a step before") + 1e-9);
}

TEST_F(RealTest, TubesHoldForTheSameCarAndNotForAnother) {
  const Drive learn = DriveOf({}, 45, 1), same = DriveOf({}, 45, 2), other = DriveOf({.gain = 3.2}, 45, 3);
  const Fitted fitted = FitTo(driving_, Whole(learn));
  const auto judge = [&](const LearnOptions& options, const Drive& by) {
    LearnOptions in_both = options;
    in_both.domain_of = {Whole(learn).front(), Whole(by).front()};
    return Judge(Learn(fitted, in_both), Whole(by), 5);
  };
  const auto share = [](const Judgement& judged) {
    return static_cast<double>(judged.inside()) / std::max(1, judged.slices());
  };
  const Judgement well = judge({.quantile = 0.99}, same), wrong = judge({.quantile = 0.99}, other);
  ASSERT_GT(well.windows.size(), 40u);
  EXPECT_GT(share(well), 0.9);
  EXPECT_LT(*well.HalfWidth(), 0.15);
  EXPECT_LT(share(wrong), share(well) - 0.05);
  EXPECT_GT(wrong.contradicting, well.contradicting);

  const Judgement narrow = judge({.quantile = 0.5}, same), wide = judge({.quantile = 1}, same);
  EXPECT_LT(*narrow.HalfWidth(), *wide.HalfWidth());
  EXPECT_LT(share(narrow), share(wide));
  EXPECT_GT(narrow.contradicting, wide.contradicting);
}

TEST_F(RealTest, LearningLeavesOutOrExplainsTheLargeErrors) {
  const Drive drive = DriveOf({}, 30, 1);
  const int count = drive.transitions.size();
  const Fitted fitted = FitTo(driving_, Whole(drive));
  EXPECT_FIELDS(Learn(fitted, {.quantile = 1}), (left_out, 0), (problem->transitions.size(), count));
  const Learned some = Learn(fitted, {.quantile = 0.9});
  EXPECT_GT(some.left_out, count / 20);
  EXPECT_FIELDS(*some.problem, (transitions.size(), count - some.left_out), (declaration.lipschitz.maxCoeff(), 0));
  const Learned slopes = Learn(fitted, {.quantile = 0.97, .slopes = true});
  ASSERT_TRUE(slopes.explained);
  EXPECT_EQ(slopes.problem->transitions.size(), count);
  const double largest = slopes.problem->declaration.lipschitz.maxCoeff();
  EXPECT_GT(largest, 0);
  EXPECT_EQ(WithSlopesTimes(slopes, 2).problem->declaration.lipschitz.maxCoeff(), 2 * largest);
  EXPECT_THROW((void)FitTo(driving_, {}), std::invalid_argument);
}

// research/real-car.md's first figures. The folder of its drives is FOREREACH_REAL_CAR in the environment.
TEST_F(RealTest, EachDriveThatIsLeftOutIsInsideAsTheDocumentSays) {
  const char* folder = std::getenv("FOREREACH_REAL_CAR");
  if (!folder) GTEST_SKIP() << "FOREREACH_REAL_CAR names no folder";
  std::vector<Drive> drives;
  for (const std::string& file : FindRecordings(folder)) drives.push_back(TransitionsOf(ReadRecording(file), driving_));
  ASSERT_EQ(drives.size(), 3u);
  for (const Drive& out : drives) {
    std::vector<Stretch> learn;
    for (const Drive& drive : drives)
      if (&drive != &out) learn.push_back(Whole(drive).front());
    const Judgement judged = Judge(Learn(FitTo(driving_, learn), {.quantile = 0.985, .growing = true}), Whole(out), 5);
    EXPECT_GE(judged.inside(), 0.99 * judged.slices()) << out.name;
    EXPECT_LE(*judged.HalfWidth(), 0.25) << out.name;
    EXPECT_LT(1000 * judged.contradicting, 10 * judged.transitions) << out.name;
  }
}

TEST_F(RealTest, RefusesWhatIsNoDrive) {
  const std::string log = MakeLog({}, 1, 1);
  ExpectRefusal("time,x\n1,2\n", "");
  ExpectRefusal(kHeader, ": has 0 rows");
  std::string broken = log;
  broken.replace(broken.find("1726473661.3"), 12, "1726473660.3");
  ExpectRefusal(broken, ":7: vicon time does not increase");
  broken = log;
  broken.replace(broken.find("1726473661.3"), 12, "nan.........");
  ExpectRefusal(broken, ":7: vicon time is no number");
}

// The CSV's rows of a table, by the columns' names.
std::vector<std::map<std::string, std::string>> RowsOf(const std::string& csv, const std::string& table) {
  std::istringstream lines(csv);
  std::vector<std::string> names;
  std::vector<std::map<std::string, std::string>> rows;
  for (std::string line; std::getline(lines, line);) {
    std::vector<std::string> fields;
    for (std::size_t at = 0; (at = line.find('"', at)) != std::string::npos;) {
      const std::size_t end = line.find('"', at + 1);
      fields.push_back(line.substr(at + 1, end - at - 1));
      at = end + 1;
    }
    if (names.empty()) {
      names = fields;
      continue;
    }
    std::map<std::string, std::string> row;
    for (std::size_t i = 0; i < names.size(); ++i) row[names[i]] = fields.at(i);
    if (row["table"] == table) rows.push_back(row);
  }
  return rows;
}

Output Command(const std::string& arguments) {
  return Shell(FOREREACH_BINARY_DIR "/research/forereach-research real " + arguments + " 2>&1");
}

TEST_F(RealTest, TheCommandWritesTablesAndATaskThatOthersRead) {
  const fs::path data = scratch_ / "data", out = scratch_ / "out";
  fs::create_directories(data);
  std::ofstream(data / "run_a.csv") << MakeLog({}, 26, 1);
  std::ofstream(data / "run_b.csv") << MakeLog({.throttle = 0.33}, 26, 2);
  std::ofstream(data / "transitions.csv") << "something,else\n1,2\n";
  const std::string other = scratch_.Write("run_c.csv", MakeLog({}, 15, 3));
  const Output run = Command("--quick --data " + data.string() + " --other " + other + " --out " + out.string());
  ASSERT_EQ(run.code, 0) << run.text;
  EXPECT_THAT(run.text, HasSubstr("an assumption"));
  EXPECT_EQ(run.text.find("transitions:"), std::string::npos);
  EXPECT_THAT(Read(out / "real.md"), AllOf(HasSubstr("## Hidden states"), HasSubstr("| run_a | ")));

  const std::string csv = Read(out / "real.csv");
  const auto left_out = RowsOf(csv, "leave one out"), others = RowsOf(csv, "others"),
             quantiles = RowsOf(csv, "quantile");
  ASSERT_EQ(left_out.size(), 20u) << "ten for each drive";
  int judged = 0, by_itself = 0;
  for (const auto& row : left_out) {
    by_itself += row.at("learned from") == row.at("judged by");
    EXPECT_THAT(row.at("judged by"), AnyOf("run_a", "run_b"));
    EXPECT_EQ(row.at("learned from").find(" and "), std::string::npos) << "one of two is left";
    if (row.at("declared") == "w that grows" && row.at("learned from") != row.at("judged by"))
      judged += std::stoi(row.at("covered steps"));
  }
  EXPECT_EQ(by_itself, 4);
  const auto itself = RowsOf(csv, "itself");
  ASSERT_EQ(itself.size(), 2 * quantiles.size());
  for (const auto& row : itself) EXPECT_EQ(row.at("learned from"), row.at("judged by"));
  ASSERT_EQ(others.size(), 3u);
  EXPECT_EQ(others.front().at("learned from"), "run_a and run_b");
  EXPECT_EQ(others.back().at("learned from"), "run_c");
  ASSERT_EQ(quantiles.size(), 3u);
  for (const auto& row : quantiles) EXPECT_EQ(std::stoi(row.at("covered steps")), judged);
  EXPECT_GE(std::stod(quantiles.front().at("contradictions, per thousand")),
            std::stod(quantiles.back().at("contradictions, per thousand")));

  const Config config = LoadConfig((out / "real-task.yaml").string());
  EXPECT_GT(config.problem->transitions.size(), 100);
  EXPECT_TRUE(config.problem->declaration.Grows(4));
  EXPECT_FALSE(Certifier(config.problem).violation().has_value());
}

TEST_F(RealTest, WithoutDataItSaysWhereTheyCanBeHad) {
  for (const std::string& folder : {scratch_ / "nowhere", scratch_.path()}) {
    const Output run = Command("--data " + folder);
    EXPECT_EQ(run.code, 2) << run.text;
    EXPECT_THAT(run.text, HasSubstr("Lorenzo-Lyons/DART"));
    EXPECT_THAT(run.text, HasSubstr("System_identification/Data/91_free_driving_16_sept_2024"));
  }
  EXPECT_EQ(Command("").code, 2);
  EXPECT_THAT(Command("").text, HasSubstr("Lorenzo-Lyons/DART"));
  const fs::path data = scratch_ / "standing";
  fs::create_directories(data);
  std::ofstream(data / "run_a.csv") << MakeLog({.cut = true}, 5, 1);
  std::ofstream(data / "run_a.csv") << MakeLog({}, 26, 1);
  const Output alone = Command("--data " + data.string());
  EXPECT_EQ(alone.code, 2);
  EXPECT_THAT(alone.text, HasSubstr("has one drive; to leave one out there have to be two"));
  std::ofstream(data / "run_a.csv") << MakeLog({.cut = true}, 5, 1);
  const Output standing = Command("--data " + data.string());
  EXPECT_EQ(standing.code, 2);
  EXPECT_THAT(standing.text, HasSubstr("run_a: the car drives at 1 m/s or more, under power, in 0 steps"));
}

}  // namespace forereach::research::real_test
