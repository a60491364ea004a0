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
};

// A log in the recorder's format: motion capture at 100 Hz, commands that change every half second, held between.
std::string MakeLog(const MadeUpCar& car, double seconds, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::string text = kHeader;
  double x = 0, y = 0, yaw = 3, v = 0, r = 0, steer = 0, throttle = car.throttle;
  constexpr int kFine = 10;  // steps of 1 ms in a row
  for (int i = 0; i < seconds * 100; ++i) {
    if (i % 50 == 0) steer = 0.6 * uniform(random), throttle = car.throttle + 0.02 * uniform(random);
    const double c = std::cos(yaw), s = std::sin(yaw);
    const double body_x = x + 0.115 * c + 0.01 * s, body_y = y + 0.115 * s - 0.01 * c, body_yaw = yaw - 0.007686;
    char line[256];
    std::snprintf(line, sizeof line, "%.2f,0,0,0,0,0,0,%d,%.6f,%.6f,%.6f,%.9f,%.9f,%.9f\n", 0.1 * (i / 10),
                  car.cut ? 0 : 1, throttle, steer, 1726473661.25 + 0.01 * i + 0.0001 * (1 + uniform(random)),
                  body_x + car.place_noise * normal(random), body_y + car.place_noise * normal(random),
                  std::remainder(body_yaw + car.yaw_noise * normal(random), 2 * std::numbers::pi));
    text += line;
    for (int j = 0; j < kFine; ++j) {
      constexpr double kDt = 0.001;
      x += kDt * v * std::cos(yaw), y += kDt * v * std::sin(yaw), yaw += kDt * r;
      v += kDt * (7 * (throttle - 0.1) - 0.8 * v);
      r += kDt * (v * car.gain * steer - r) / car.lag;
    }
  }
  return text;
}

class RealTest : public testing::Test {
 protected:
  [[nodiscard]] Drive DriveOf(const MadeUpCar& car, double seconds, unsigned seed) const {
    const std::string path = scratch_.Write("drive" + std::to_string(seed) + ".csv", MakeLog(car, seconds, seed));
    return TransitionsOf(ReadRecording(path), driving_);
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
  const Recording recording = ReadRecording(scratch_.Write("circle.csv", log));
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
  const Recording recording =
      ReadRecording(scratch_.Write("lag.csv", MakeLog({.lag = 0.07, .yaw_noise = 1e-5}, 40, 1)));
  const std::vector<double> delays = SteeringDelays(recording);
  ASSERT_GT(delays.size(), 5u);
  for (const double delay : delays) EXPECT_NEAR(delay, 0.07 * std::log(2), 0.015);
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

TEST_F(RealTest, TheDomainMayLeaveOutHastySteering) {
  const Drive drive = DriveOf({}, 30, 1);
  const Learned any = Learn(FitTo(driving_, Whole(drive)), {}),
                gentle = Learn(FitTo(DrivingProblem(0.2), Whole(drive)), {.quantile = 1});
  const auto largest = [](const Transitions& transitions) {
    return (transitions.z.col(6) - transitions.z.col(5)).cwiseAbs().maxCoeff();
  };
  EXPECT_GT(largest(any.problem->transitions), 0.5);
  EXPECT_LE(largest(gentle.problem->transitions), 0.2 + 1e-6);
  EXPECT_EQ(Judge(any, Whole(drive), 5).outside_domain, 0);
  const Judgement judged = Judge(gentle, Whole(drive), 5);
  EXPECT_GT(judged.outside_domain, 5);
  EXPECT_EQ(judged.outside_domain + judged.transitions, drive.transitions.size());
  EXPECT_EQ(judged.beyond, 0);
}

TEST_F(RealTest, BlocksTakeEachTransitionOnceAndNoneAcrossAnEnd) {
  const Drive drive = DriveOf({}, 45, 1);
  std::vector<int> taken(static_cast<std::size_t>(drive.transitions.size()), 0);
  for (const bool odd : {false, true})
    for (const Stretch& block : Blocks(drive, odd))
      for (int i = block.begin; i < block.end; ++i) {
        ++taken[static_cast<std::size_t>(i)];
        const double time = drive.times[static_cast<std::size_t>(i)];
        const int number = static_cast<int>(time / 10 + 1e-9);
        EXPECT_EQ(number % 2 == 1, odd) << time;
        EXPECT_LE(time + 0.1, 10 * (number + 1) + 1e-6);
      }
  int across = 0;
  for (const int count : taken) {
    EXPECT_LE(count, 1);
    across += count == 0;
  }
  EXPECT_LE(across, 4);
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
  EXPECT_GT(wrong.beyond, 2 * well.beyond);
  EXPECT_GE(wrong.contradicting, well.contradicting);

  const Judgement narrow = judge({.quantile = 0.5}, same), wide = judge({.quantile = 1}, same);
  EXPECT_LT(*narrow.HalfWidth(), *wide.HalfWidth());
  EXPECT_LT(share(narrow), share(wide));
  EXPECT_GT(narrow.contradicting, wide.contradicting);
  EXPECT_LE(narrow.certified(0), narrow.certified(3));
  EXPECT_GT(narrow.certified(3), 0);

  Learned careless = Learn(fitted, {.quantile = 0.5});
  auto problem = std::make_shared<Problem>(*careless.problem);
  problem->declaration.disturbance.head(2).setConstant(0.05);
  careless.problem = problem;
  const Judgement careful = Judge(careless, Whole(learn), 5);
  EXPECT_EQ(careful.certified(2), 0);  // the last slice is half a meter wide, the corridor 0.4 m
  EXPECT_GT(*careful.HalfWidth(), 0.25);
}

TEST_F(RealTest, LearningLeavesOutOrExplainsTheLargeErrors) {
  const Drive drive = DriveOf({}, 30, 1);
  const int count = drive.transitions.size();
  const Fitted fitted = FitTo(driving_, Whole(drive));
  const Learned all = Learn(fitted, {.quantile = 1});
  EXPECT_EQ(all.left_out, 0);
  EXPECT_EQ(all.problem->transitions.size(), count);
  const Learned some = Learn(fitted, {.quantile = 0.9});
  EXPECT_GT(some.left_out, count / 20);
  EXPECT_EQ(some.problem->transitions.size(), count - some.left_out);
  EXPECT_EQ(some.problem->declaration.lipschitz.maxCoeff(), 0);
  const Learned slopes = Learn(fitted, {.quantile = 0.97, .slopes = true});
  ASSERT_TRUE(slopes.explained);
  EXPECT_EQ(slopes.problem->transitions.size(), count);
  const double largest = slopes.problem->declaration.lipschitz.maxCoeff();
  EXPECT_GT(largest, 0);
  EXPECT_EQ(WithSlopesTimes(slopes, 2).problem->declaration.lipschitz.maxCoeff(), 2 * largest);
  EXPECT_EQ(FitTo(driving_, Whole(drive), 80).transitions.size(), 80);
  EXPECT_THROW((void)FitTo(driving_, {}), std::invalid_argument);
}

// research/real-car.md's first figures. The folder of its drives is FOREREACH_REAL_CAR in the environment.
TEST_F(RealTest, TheRealCarIsInsideAsTheDocumentSays) {
  const char* folder = std::getenv("FOREREACH_REAL_CAR");
  if (!folder) GTEST_SKIP() << "FOREREACH_REAL_CAR names no folder";
  std::vector<Drive> drives;
  for (const std::string& file : FindRecordings(folder)) drives.push_back(TransitionsOf(ReadRecording(file), driving_));
  Judgement both;
  both.steps = 5;
  for (const bool odd : {false, true}) {
    std::vector<Stretch> learn, judge;
    for (const Drive& drive : drives) {
      for (const Stretch& block : Blocks(drive, odd)) learn.push_back(block);
      for (const Stretch& block : Blocks(drive, !odd)) judge.push_back(block);
    }
    both.Add(Judge(Learn(FitTo(driving_, learn), {.quantile = 0.985}), judge, both.steps));
  }
  EXPECT_GT(both.windows.size(), 200u);
  EXPECT_GE(both.inside(), 0.99 * both.slices());
  EXPECT_LE(*both.HalfWidth(), 0.15);
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

std::map<std::string, std::string> RowOf(const std::string& csv, const std::string& table, const std::string& quantile,
                                         const std::string& steps) {
  std::istringstream lines(csv);
  std::vector<std::string> names;
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
    if (row["table"] == table && row["quantile"] == quantile && row["steps"] == steps) return row;
  }
  ADD_FAILURE() << "no row " << table << " " << quantile << " " << steps;
  return {};
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
  EXPECT_THAT(run.text, HasSubstr("| run_a and run_b | run_c |"));
  EXPECT_EQ(run.text.find("transitions:"), std::string::npos);

  const std::string csv = Read(out / "real.csv");
  const auto low = RowOf(csv, "quantile", "0.9", "5"), high = RowOf(csv, "quantile", "1", "5"),
             longer = RowOf(csv, "quantile", "0.9", "10");
  EXPECT_GT(std::stod(high.at("inside, %")), 99);
  EXPECT_LT(std::stod(low.at("half-width, m")), std::stod(high.at("half-width, m")));
  EXPECT_LT(std::stod(low.at("half-width, m")), std::stod(longer.at("half-width, m")));
  EXPECT_GT(std::stod(low.at("contradictions, per thousand")), std::stod(high.at("contradictions, per thousand")));
  EXPECT_THAT(Read(out / "real.md"), HasSubstr("## Against N"));

  const Config config = LoadConfig((out / "real-task.yaml").string());
  EXPECT_GT(config.problem->transitions.size(), 100);
  EXPECT_TRUE(config.problem->declaration.IsDisturbed());
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
  const Output standing = Command("--data " + data.string());
  EXPECT_EQ(standing.code, 2);
  EXPECT_THAT(standing.text, HasSubstr("run_a: the car drives at 1 m/s or more, under power, in 0 steps"));
}

}  // namespace forereach::research::real_test
