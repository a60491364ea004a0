// What a good task file means.
#include "task/config.h"

#include <regex>

#include <fmt/format.h>

#include <fmt/format.h>

#include "forereach/dynamics/models/named_residuals.h"
#include "forereach/dynamics/models/residuals.h"
#include "forereach/safety/occupancy_grid.h"
#include "task/schema.h"
#include "tests/paths.h"
#include "tests/task/task_files.h"

namespace forereach::config_test {

Eigen::VectorXd Numbers(std::initializer_list<double> entries) {
  Eigen::VectorXd vector(static_cast<Eigen::Index>(entries.size()));
  std::copy(entries.begin(), entries.end(), vector.begin());
  return vector;
}

struct LoadConfig : testing::Test {
  const TaskFiles files_{};
};

TEST_F(LoadConfig, ReadsWhatIsRequired) {
  const Config config = files_.Load();
  const Problem& problem = *config.problem;
  EXPECT_EQ(config.path, files_.directory() / "task.yaml");
  EXPECT_FIELDS(problem, (model->description(), "point_mass dt=0.15"),
                (domain.state.lower(), Numbers({-20, -20, -5.4, -5.4})), (domain.input.upper(), Numbers({3, 3})),
                (domain.balls.empty(), true), (domain.inequalities.empty(), true));
  Eigen::MatrixXd lipschitz = Eigen::MatrixXd::Zero(4, 6);
  lipschitz.block(2, 2, 2, 2) << 0.1, 0.05, 0.05, 0.1;
  EXPECT_FIELDS(problem.declaration, (lipschitz, lipschitz), (noise_bound, Numbers({0, 0, 0.01, 0.01})));
  ASSERT_EQ(problem.transitions.size(), 2);
  EXPECT_EQ(Eigen::VectorXd(problem.transitions.z.row(1)), Numbers({1, 2, 2, 0.5, 0, -0.5}));
  EXPECT_EQ(Eigen::VectorXd(problem.transitions.x_next.row(1)), Numbers({1.3, 2.07, 2, 0.42}));
  EXPECT_EQ(problem.projection, Eigen::MatrixXd::Identity(2, 4));
  EXPECT_FIELDS(Only(config.obstacles), (kind(), Obstacle::Kind::kCircle), (radius(), 0.8));
  EXPECT_LE(config.initial_set.lower()[2], 0.9);
  EXPECT_GE(config.initial_set.upper()[2], 1.1);
  EXPECT_NEAR(config.initial_set.upper()[2], 1.1, 1e-15);
}

TEST_F(LoadConfig, TellsAnErrorThatIsNotDeclaredFromZero) {
  const auto with = [&](const std::string& errors) {
    const std::string line = "  noise_bound: [0, 0, 0.01, 0.01]\n";
    return files_.Load(Replaced(kTask, line, line + errors)).problem->declaration;
  };
  EXPECT_FALSE(with("").DeclaresStateError());
  EXPECT_FALSE(with("  input_error: {ax: 0.1}\n").DeclaresStateError());
  EXPECT_EQ(with("  input_error: {ay: 0.1}\n").input_error, Eigen::Vector2d(0, 0.1));
  for (const std::string zero : {"{}", "{vx: 0}", "[0, 0, 0, 0]"}) {
    const Declaration exact = with("  state_error: " + zero + "\n");
    EXPECT_TRUE(exact.DeclaresStateError()) << zero;
    EXPECT_FALSE(exact.HasErrorInZ()) << zero;
    EXPECT_EQ(exact.state_error, Eigen::Vector4d::Zero()) << zero;
  }
  const Declaration both = with("  state_error: {vx: 0.01}\n  input_error: [0.1, 0.2]\n");
  EXPECT_TRUE(both.HasErrorInZ());
  std::vector<double> errors(6);
  for (int l = 0; l < 6; ++l) errors[static_cast<std::size_t>(l)] = both.VariableError(l);
  EXPECT_THAT(errors, ElementsAre(0, 0, 0.01, 0, 0.1, 0.2));
}

TEST_F(LoadConfig, ReadsWhichRowsAreAffine) {
  const std::string line = "  noise_bound: [0, 0, 0.01, 0.01]\n";
  const auto with = [&](const std::string& affine, const std::string& task = kTask) {
    return files_.Load(Replaced(task, line, line + "  affine: " + affine + "\n"));
  };
  const std::string only_vy = Replaced(kTask, "    vx: {vx: 0.1, vy: 0.05}\n", "");
  const Config config = with("{rows: [vx], columns: [ay, vx]}", only_vy);
  EXPECT_THAT(config.problem->declaration.affine.rows, ElementsAre(2));
  EXPECT_THAT(config.problem->declaration.affine.columns, ElementsAre(2, 5));
  EXPECT_NE(config.grounds.declaration, files_.Load(only_vy).grounds.declaration);
  EXPECT_NE(config.grounds.declaration, with("{rows: [vx], columns: [ay]}", only_vy).grounds.declaration);
  const auto error = [&](const std::string& affine, const std::string& task) {
    return Thrown<ConfigError>([&] { static_cast<void>(with(affine, task)); });
  };
  EXPECT_THAT(error("{rows: [vx], columns: [vx]}", kTask),
              HasSubstr("leaves vy out, by which declaration.lipschitz says that the affine vx changes"));
  EXPECT_EQ(with("{rows: [vx], columns: [vx, vy]}", kTask).problem->declaration.lipschitz(2, 3), 0.05);
  EXPECT_THAT(error("{rows: [vx], columns: [speed]}", only_vy), HasSubstr("speed"));
  EXPECT_THAT(error("{rows: [vx], columns: []}", only_vy), HasSubstr("declaration.affine.columns"));
  EXPECT_EQ(error("{rows: [vx], columns: [vx]}\n  state_error: {px: 0.1}", only_vy), "");
  EXPECT_THAT(error("{rows: [vx], columns: [vx]}\n  state_error: {vx: 0.1}", only_vy),
              HasSubstr("declare a bound on that slope as declaration.lipschitz.vx.vx"));
  const std::string rest = "{rows: [vx], columns: [vx], rest: {vx: {vy: 0.25, ax: 0.5}}}";
  const Config with_rest = with(rest, only_vy);
  EXPECT_FIELDS(with_rest.problem->declaration.affine, (Rest(2, 3), 0.25), (Rest(2, 4), 0.5), (rest.sum(), 0.75));
  EXPECT_NE(with_rest.grounds.declaration, with("{rows: [vx], columns: [vx]}", only_vy).grounds.declaration);
  EXPECT_NE(with_rest.grounds.declaration, with(Replaced(rest, "0.5", "0.75"), only_vy).grounds.declaration);
  EXPECT_EQ(with(Replaced(rest, "0.25, ax: 0.5", "0"), only_vy).grounds.declaration,
            with("{rows: [vx], columns: [vx]}", only_vy).grounds.declaration);
  EXPECT_THAT(error(Replaced(rest, "rest: {vx", "rest: {vy"), only_vy),
              HasSubstr("declaration.affine.rest.vy: is none of declaration.affine.rows"));
  EXPECT_THAT(error(rest + "\n  state_error: {vy: 0.1}", only_vy),
              HasSubstr("declare a bound on that slope as declaration.lipschitz.vx.vy"));
}

TEST_F(LoadConfig, ReadsRegionsAndRefusesWhatIsNone) {
  const std::string line = "  noise_bound: [0, 0, 0.01, 0.01]\n";
  const auto text = [&](const std::string& regions) { return Replaced(kTask, line, line + "  regions:\n" + regions); };
  const std::string good = "    - {in: {vy: [-1, 1], vx: [0, 0.5]}, lipschitz: {vx: {vy: 0.01}}}\n";
  const Config config = files_.Load(text(good));
  const std::vector<Region>& regions = config.problem->declaration.regions;
  ASSERT_EQ(regions.size(), 1);
  ASSERT_EQ(regions[0].box.size(), 2);
  EXPECT_FIELDS(regions[0], (box[0].variable, 2), (box[0].range, Interval(0, 0.5)), (box[1].variable, 3));
  Eigen::MatrixXd slopes = config.problem->declaration.lipschitz;
  EXPECT_EQ(slopes(2, 2), 0.1);
  slopes.row(2).setZero();
  slopes(2, 3) = 0.01;
  EXPECT_EQ(regions[0].lipschitz, slopes) << "the rows that are not named are those of the whole domain";
  const auto digest = [&](const std::string& changed) { return files_.Load(text(changed)).grounds.declaration; };
  EXPECT_NE(config.grounds.declaration, files_.Load(kTask).grounds.declaration);
  EXPECT_NE(config.grounds.declaration, digest(Replaced(good, "0.5]", "0.25]")));
  EXPECT_NE(config.grounds.declaration, digest(Replaced(good, "vy: 0.01", "vy: 0.02")));
  EXPECT_NE(config.grounds.declaration, digest(Replaced(good, "vx: [0", "px: [0")));
  EXPECT_EQ(files_.Load(text(Replaced(good, "{vy: 0.01}", "{}"))).problem->declaration.regions[0].lipschitz(2, 3), 0);

  const auto error = [&](const std::string& from, const std::string& to) {
    return files_.Error(text(Replaced(good, from, to)));
  };
  EXPECT_THAT(
      error("vy: 0.01", "vy: 0.06"),
      HasSubstr("declaration.regions[0].lipschitz.vx.vy: 0.06 is above declaration.lipschitz, 0.05, which holds"));
  EXPECT_THAT(error("[0, 0.5]", "[0.5, 0]"), HasSubstr("regions[0].in.vx: [0.5, 0] is no range"));
  EXPECT_THAT(error("[0, 0.5]", "[0, 0.5, 1]"), HasSubstr("declaration.regions[0].in.vx: "));
  EXPECT_THAT(error("vy: [-1, 1]", "speed: [-1, 1]"), HasSubstr("declaration.regions[0].in.speed: unknown key"));
  EXPECT_THAT(error("{vy: [-1, 1], vx: [0, 0.5]}", "{}"), HasSubstr("declaration.regions[0].in: names no state"));
  EXPECT_THAT(error(", lipschitz: {vx: {vy: 0.01}}", ""), HasSubstr("declaration.regions[0]: says nothing"));
  EXPECT_THAT(files_.Error(text(Replaced(good, "vx: [0, 0.5]", "px: [0, 1], py: [0, 1], vx: [0, 0.5]"))),
              HasSubstr("declaration.regions: cut 4 variables and 3 x 3 x 3 x 3 = 81 cells, has to be at most 3"));
  std::string fine;
  for (int i = 1; i <= 33; ++i)
    fine += fmt::format("    - {{in: {{vx: [0, {}], vy: [0, {}]}}, lipschitz: {{vx: {{}}}}}}\n", 0.01 * i, 0.02 * i);
  EXPECT_THAT(files_.Error(text(fine)),
              HasSubstr("35 x 35 = 1225 cells, has to be at most 3 variables and 1024 cells"));
}

TEST_F(LoadConfig, ReadsWhatRegionsBoundBesideSlopes) {
  const std::string line = "  noise_bound: [0, 0, 0.01, 0.01]\n",
                    good = "{in: {vx: [0, 0.5]}, disturbance: {vx: 0.001}, noise_bound: {vy: 0}, bound: {vx: 0.25}}";
  const auto text = [&](const std::string& region) {
    return Replaced(kTask, line, line + "  disturbance: {vx: 0.002, vy: \"vx\"}\n  regions:\n    - " + region + "\n");
  };
  const Config config = files_.Load(text(good));
  const Declaration& declaration = config.problem->declaration;
  const Region& region = declaration.regions.at(0);
  EXPECT_EQ(region.lipschitz, declaration.lipschitz) << "no slopes are those of the whole domain";
  EXPECT_EQ(region.disturbance, Numbers({kInfinity, kInfinity, 0.001, kInfinity}));
  EXPECT_EQ(region.noise_bound, Numbers({kInfinity, kInfinity, kInfinity, 0}));
  EXPECT_EQ(region.bound, Numbers({kInfinity, kInfinity, 0.25, kInfinity}));
  EXPECT_EQ(declaration.ObservationError(2), AddUp(0.01, 0.001)) << "the least anywhere";
  EXPECT_EQ(declaration.ObservationError(3), 0);
  EXPECT_EQ(declaration.DisturbanceBound(2), 0.002);
  for (const auto& [from, to] : {std::pair("0.001", "0.0015"), std::pair("{vy: 0}", "{vx: 0}"),
                                 std::pair("0.25", "0.26"), std::pair(", bound: {vx: 0.25}", "")})
    EXPECT_NE(files_.Load(text(Replaced(good, from, to))).grounds.declaration, config.grounds.declaration) << to;

  const auto error = [&](const std::string& from, const std::string& to) {
    return files_.Error(text(Replaced(good, from, to)));
  };
  EXPECT_THAT(error("0.001", "0.003"), HasSubstr("declaration.regions[0].disturbance.vx: 0.003 is above "
                                                 "declaration.disturbance, 0.002, which holds in the whole domain"));
  EXPECT_THAT(error("disturbance: {vx: 0.001}", "disturbance: {vy: 0.001}"), HasSubstr("0.001 is above"))
      << "an expression is not replaced";
  EXPECT_THAT(error("{vy: 0}", "{vy: 0.02}"), HasSubstr("regions[0].noise_bound.vy: 0.02 is above"));
  EXPECT_THAT(error("0.25", "-0.25"), HasSubstr("declaration.regions[0].bound.vx: -0.25"));
  EXPECT_THAT(error("0.25", ".nan"), HasSubstr("declaration.regions[0].bound.vx: "));
  EXPECT_THAT(error("0.25", ".inf"), HasSubstr("declaration.regions[0].bound.vx: "));
  EXPECT_THAT(error("bound: {vx", "bound: {speed"), HasSubstr("declaration.regions[0].bound.speed: unknown key"));
  EXPECT_THAT(files_.Error(Replaced(text(good), "  disturbance: {vx: 0.002, vy: \"vx\"}\n", "")),
              HasSubstr("0.001 is above declaration.disturbance, 0, which"));
}

TEST_F(LoadConfig, LeavesOutTransitionsThatTheirErrorsMayTakeOutOfTheDomain) {
  const std::string line = "  noise_bound: [0, 0, 0.01, 0.01]\n", rows = kTransitions;
  const auto with = [&](const std::string& error) {
    return Replaced(kTask, line, line + "  state_error: {px: " + error + "}\n");
  };
  const std::string edge = "19.5,0,1,0,0,0,19.65,0,1,0\n", last = "3,0,1,0,0,0,3.15,0,1,0\n";
  const Config exact = files_.Load(kTask, rows + edge + last), at = files_.Load(with("0.5"), rows + edge + last),
               beyond = files_.Load(with("0.5000000000000001"), rows + edge + last);
  EXPECT_EQ(at.left_out, 0);
  EXPECT_THAT(at.rows, ElementsAre(0, 1, 2, 3));
  EXPECT_EQ(beyond.left_out, 1);
  EXPECT_THAT(beyond.rows, ElementsAre(0, 1, 3));
  EXPECT_FIELDS(beyond.problem->transitions, (z(2, 0), 3), (x_next(2, 0), 3.15));
  EXPECT_EQ(beyond.grounds.observations, exact.grounds.observations) << "they are those of the file";
  EXPECT_EQ(files_.Error(with("25"), rows),
            "steps.csv: no transition is inside the domain with all of declaration.state_error and "
            "declaration.input_error; at least one is needed");
}

TEST_F(LoadConfig, DefaultsAreThoseOfTheStructures) {
  const Config config = files_.Load();
  EXPECT_FIELDS(config, (problem->zonotope_order, 5), (gate.max_age_ms, 500), (gate.max_ahead_ms, 50),
                (gate.certificate_lifetime_ms, 2000), (gate.queue, 64), (gate.state, "state"),
                (bus.url, "udpm://239.255.76.67:7667?ttl=0"), (bus.candidate, "PLAN_CANDIDATE"),
                (bus.event, "EXECUTION_EVENT"), (planner.source, "ompl"),
                (planner.algorithm, PlannerOptions{}.algorithm), (planner.goal.empty(), true),
                (planner.initial_half_width, (std::vector<double>{0.1, 0.1, 0.1, 0.1})),
                (robot.start, (std::vector<double>{0, 0, 1, 0})));
  EXPECT_EQ(config.robot.step_period_ms, 150) << "model.dt";
  EXPECT_FALSE(config.robot_residual);
  EXPECT_FIELDS(config, (logger.directory, "log"), (logger.queue, LoggerOptions{}.queue),
                (logger.quota_mb, std::nullopt), (bus.logger_status, "LOGGER_STATUS"));
}

TEST_F(LoadConfig, ReadsEveryOption) {
  const Config config = files_.Load(
      std::string(kTask) +
      "certifier: {method: paper, zonotope_order: 7}\n"
      "gate: {max_age_ms: 1, max_ahead_ms: 0, certificate_lifetime_ms: 3, queue: 4, obstacles: bus,\n"
      "  obstacles_timeout_ms: 5, state: kept, advice: send}\n"
      "bus:\n"
      "  url: memq://\n"
      "  channels: {candidate: A, decision: B, certified: C, robot_state: D, obstacles: E, transition: F, status: G, "
      "event: H, logger_status: I, fault: J, command: K, withdrawn: L, "
      "advice: M}\n"
      "planner: {source: policy, policy: p/own.json, algorithm: rrt, goal: [1, 2], goal_radius: 3, clearance: 4,\n"
      "  clearance_step: 5, progress_steps: 6,\n"
      "  tail_steps: 7, lead_steps: 8, candidates: 9, repair: true, cruise_speed: 10, braking: 11, time_limit_ms: 12, "
      "seed: 13,\n"
      "  initial_half_width: [1, 2, 3, 4]}\n"
      "robot: {start: [4, 3, 2, 1], step_period_ms: 14, time_limit_s: 15, residual: {name: velocity_knee, knee: 2}}\n"
      "logger: {directory: here, queue: 16, flush_ms: 17, rotate_mb: 18, rotate_minutes: 19, quota_mb: 20, "
      "min_free_mb: 21}\n");
  EXPECT_EQ(config.problem->zonotope_order, 7);
  const GateOptions& gate = config.gate;
  EXPECT_EQ(std::tie(gate.max_age_ms, gate.max_ahead_ms, gate.certificate_lifetime_ms, gate.queue),
            std::make_tuple(1.0, 0.0, 3.0, 4));
  EXPECT_EQ(gate.obstacles, ObstaclesSource::kBus);
  EXPECT_TRUE(gate.advises);
  EXPECT_FIELDS(gate, (obstacles_timeout_ms, 5), (state, files_.directory() / "kept"));
  const BusOptions& bus = config.bus;
  EXPECT_EQ(bus.url, "memq://");
  EXPECT_EQ(bus.candidate + bus.decision + bus.certified + bus.robot_state + bus.obstacles + bus.transition +
                bus.status + bus.event + bus.logger_status + bus.fault + bus.command + bus.withdrawn + bus.advice,
            "ABCDEFGHIJKLM");
  const PlannerOptions& planner = config.planner;
  EXPECT_FIELDS(planner, (source, "policy"), (policy, files_.directory() / "p/own.json"), (algorithm, "rrt"),
                (goal, (std::vector<double>{1, 2})));
  EXPECT_EQ(std::tie(planner.goal_radius, planner.clearance, planner.clearance_step, planner.progress_steps,
                     planner.tail_steps, planner.lead_steps, planner.candidates),
            std::make_tuple(3.0, 4.0, 5.0, 6, 7, 8, 9));
  EXPECT_TRUE(planner.repairs);
  EXPECT_EQ(std::tie(planner.cruise_speed, planner.braking, planner.time_limit_ms, planner.seed),
            std::make_tuple(10.0, 11.0, 12.0, 13));
  EXPECT_EQ(planner.initial_half_width, (std::vector<double>{1, 2, 3, 4}));
  EXPECT_EQ(config.robot.start, (std::vector<double>{4, 3, 2, 1}));
  EXPECT_EQ(std::tie(config.robot.step_period_ms, config.robot.time_limit_s), std::make_tuple(14.0, 15.0));
  EXPECT_FIELDS(config, (robot_residual->name, "velocity_knee"), (logger.directory, files_.directory() / "here"));
  const LoggerOptions& logger = config.logger;
  EXPECT_EQ(std::tie(logger.queue, logger.flush_ms, logger.rotate_mb, logger.rotate_minutes, logger.min_free_mb),
            std::make_tuple(16, 17.0, 18.0, 19.0, 21.0));
  EXPECT_EQ(logger.quota_mb, 20);
}

// What the check says of the task; empty if it takes it.
std::string Refusal(void (*require)(const Config&), const Config& config) {
  return Thrown<ConfigError>([&] { require(config); });
}

std::string RefusalOnBus(const Config& config) { return Refusal(RequireForCertifyingOnBus, config); }

const std::string kMeasuredTask =
    Replaced(kTask, "  noise_bound", "  state_error: {}\n  noise_bound") + std::string("robot: {step_error_ms: any}\n");

TEST_F(LoadConfig, WhoseRobotArmsTheGateHasToSayHowFarItsStateMayBeOff) {
  const Config unsaid = files_.Load(std::string(kTask) + "gate: {obstacles: task}\n");
  EXPECT_THAT(RefusalOnBus(unsaid), AllOf(StartsWith(unsaid.path + ": declaration.state_error: missing"),
                                          HasSubstr("`state_error: {}` if you mean 0 for all")));
  EXPECT_NO_THROW(RequireForCertifying(unsaid)) << "`forereach certify` measures nothing";
  EXPECT_EQ(RefusalOnBus(files_.Load(std::string(kTask) + "gate: {obstacles: task, arming: none}\n")), "");
  for (const char* declared : {"{}", "{vx: 0.1}", "[0, 0, 0, 0]"})
    EXPECT_EQ(RefusalOnBus(files_.Load(
                  Replaced(kTask, "  noise_bound", std::string("  state_error: ") + declared + "\n  noise_bound") +
                  "robot: {step_error_ms: any}\ngate: {obstacles: task}\n")),
              "");
}

TEST_F(LoadConfig, WhoseRobotArmsTheGateHasToSayHowFarItsStepsMayBeOff) {
  const auto with = [&](const std::string& robot, const std::string& gate = "obstacles: task") {
    return files_.Load(Replaced(kTask, "  noise_bound", "  state_error: {}\n  noise_bound") + "gate: {" + gate + "}\n" +
                       robot);
  };
  const Config unsaid = with("");
  EXPECT_THAT(RefusalOnBus(unsaid), AllOf(StartsWith(unsaid.path + ": robot.step_error_ms: missing"),
                                          HasSubstr("forereach doctor"), HasSubstr("`step_error_ms: any`")));
  EXPECT_NO_THROW(RequireForCertifying(unsaid)) << "`forereach certify` executes nothing";
  EXPECT_EQ(RefusalOnBus(with("", "obstacles: task, arming: none")), "");
  for (const char* said : {"0", "2.5", "any"})
    EXPECT_EQ(RefusalOnBus(with(std::string("robot: {step_error_ms: ") + said + "}\n")), "");
  EXPECT_EQ(with("robot: {step_error_ms: any}\n").problem->timing.error, 0);
  EXPECT_EQ(with("robot: {step_error_ms: 0}\n").problem->timing.error, 0);
  EXPECT_THAT(RefusalOnBus(with("", "obstacles: task, max_clock_error_ms: 20")),
              HasSubstr("robot.step_error_ms: missing"))
      << "it is not taken from that of the clocks";
  EXPECT_THAT(
      [&] { static_cast<void>(with("robot: {step_error_ms: any}\n", "obstacles: task, max_clock_error_ms: 20")); },
      ThrowsMessage<ConfigError>(HasSubstr("robot.step_error_ms: any, and with gate.max_clock_error_ms")));
}

// A guard counts whole microseconds, here half of one more in each step than the model.
TEST_F(LoadConfig, StepsOfNoWholeMicrosecondsAreOffTheirTimes) {
  const Config config =
      files_.Load(Replaced(Replaced(kTask, "0.15", "0.1500005"), "samples", "{acceleration: [9, 9]}") +
                  "robot: {step_error_ms: 0}\ngate: {obstacles: task}\n");
  EXPECT_GE(config.problem->timing.error, 128 * 0.4999e-6);
  EXPECT_LE(config.problem->timing.error, 128 * 0.5001e-6);
  EXPECT_GE(config.problem->between->period, 0.15);
  EXPECT_EQ(config.problem->between->period, std::max(0.1500005, static_cast<double>(config.gate.step_us) / 1e6));
}

TEST_F(LoadConfig, WhoCertifiesOnABusHasToSayWhereObstaclesComeFrom) {
  const Config unsaid = files_.Load(kTask);
  EXPECT_EQ(unsaid.gate.obstacles, ObstaclesSource::kUnsaid) << "`forereach certify` needs none";
  EXPECT_NO_THROW(RequireForCertifying(unsaid));
  EXPECT_THAT(RefusalOnBus(unsaid),
              AllOf(StartsWith(unsaid.path + ": gate.obstacles: missing"), HasSubstr("`bus`"), HasSubstr("`task`")));
  for (const auto& [word, source] : std::initializer_list<std::pair<std::string, ObstaclesSource>>{
           {"bus", ObstaclesSource::kBus}, {"task", ObstaclesSource::kTask}}) {
    const Config config = files_.Load(kMeasuredTask + "gate: {obstacles: " + word + ", obstacles_lost_ms: 1500}\n");
    EXPECT_EQ(config.gate.obstacles, source);
    EXPECT_EQ(RefusalOnBus(config), "");
  }
}

TEST_F(LoadConfig, WhoseObstaclesComeFromTheBusHasToSayWhenTheyAreLost) {
  const auto load = [&](const std::string& more) {
    return files_.Load(kMeasuredTask + "gate: {obstacles: bus, obstacles_timeout_ms: 400" + more + "}\n");
  };
  const Config unsaid = load("");
  EXPECT_FALSE(unsaid.gate.obstacles_lost_ms);
  EXPECT_THAT(RefusalOnBus(unsaid),
              AllOf(StartsWith(unsaid.path + ": gate.obstacles_lost_ms: missing"), HasSubstr("`never`")));
  EXPECT_EQ(RefusalOnBus(load(", obstacles_lost_ms: 600")), "");
  EXPECT_EQ(load(", obstacles_lost_ms: 600").gate.obstacles_lost_ms, 600);
  EXPECT_EQ(RefusalOnBus(load(", obstacles_lost_ms: never")), "");
  EXPECT_EQ(load(", obstacles_lost_ms: never").gate.obstacles_lost_ms, kNeverLost);
  EXPECT_THAT([&] { static_cast<void>(load(", obstacles_lost_ms: 599")); },
              ThrowsMessage<ConfigError>(
                  HasSubstr("gate.obstacles_lost_ms: 599 is less than 1.5 times gate.obstacles_timeout_ms, 400")));
}

TEST_F(LoadConfig, TheDelayOfTheBusHasADefaultAndMayBeDeclared) {
  EXPECT_EQ(files_.Load(kTask).bus.delay_ms, 10);
  EXPECT_EQ(files_.Load(std::string(kTask) + "bus: {delay_ms: 0}\n").bus.delay_ms, 0);
}

TEST_F(LoadConfig, WhoCertifiesHasToSayWhenItHoldsUnlessTheMethodIsThePapers) {
  const std::string task = kMeasuredTask + "gate: {obstacles: task}\n", line = "  between: samples\n";
  const Config unsaid = files_.Load(Replaced(task, line, ""));
  EXPECT_FALSE(unsaid.says_between);
  EXPECT_FALSE(unsaid.problem->between);
  const auto says = AllOf(StartsWith(unsaid.path + ": task.between: missing. Write "), HasSubstr("`between: samples`"));
  EXPECT_THAT(Refusal(RequireForCertifying, unsaid), says);
  EXPECT_THAT(RefusalOnBus(unsaid), says);
  EXPECT_EQ(RefusalOnBus(files_.Load(Replaced(task, line, "") + "certifier: {method: paper}\n")), "");

  const Config samples = files_.Load(task);
  EXPECT_TRUE(samples.says_between);
  EXPECT_FALSE(samples.problem->between);
  EXPECT_EQ(RefusalOnBus(samples), "");
  const Config bounds = files_.Load(Replaced(task, "samples", "{acceleration: [3.5, 0]}"));
  EXPECT_EQ(RefusalOnBus(bounds), "");
  ASSERT_TRUE(bounds.problem->between);
  EXPECT_FIELDS(*bounds.problem->between, (acceleration, Numbers({3.5, 0})), (period, 0.15));
  for (const auto& [error_ms, period] : {std::pair{"0.001", 0.150001}, {"10", 0.16}}) {
    const double longer = files_.Load(Replaced(Replaced(task, "samples", "{acceleration: [3.5, 0]}"), "any", error_ms))
                              .problem->between->period;
    EXPECT_GE(longer, period);
    EXPECT_LE(longer, period * (1 + 0x1p-51));
  }
  EXPECT_FIELDS(*bounds.problem->between, (turn_rate, 0), (turn_acceleration, 0));
}

// The bicycle of tests/data/field.yaml with this for its projection.
std::string BicycleWith(const std::string& body) {
  const std::string task = std::regex_replace(Read(FOREREACH_SOURCE_DIR "/tests/data/field.yaml"),
                                              std::regex("  (between|step_period_ms): .*\n"), "");
  return Replaced(Replaced(task, "  projection: [x, y]\n", body),
                  "\ntransitions: ../../config/data/demo_transitions.csv",
                  "\ntransitions: " FOREREACH_SOURCE_DIR "/config/data/demo_transitions.csv");
}

TEST_F(LoadConfig, ReadsABodyThatTurns) {
  const Problem problem = *files_
                               .Load(BicycleWith("  body:\n"
                                                 "    pose: [x, y, theta]\n"
                                                 "    parts:\n"
                                                 "      - disc: {at: [1.4, 0], radius: 0.9}\n"
                                                 "      - hull: {points: [[-1, 0.5], [-1, -0.5], [4, 0]]}\n"
                                                 "      - hull: {points: [[2, 0]], radius: 0.25}\n"
                                                 "  between: {acceleration: [1, 2], turn_rate: 3, "
                                                 "turn_acceleration: 4}\n"))
                               .problem;
  EXPECT_EQ(problem.body.heading, 2);
  ASSERT_EQ(problem.body.parts.size(), 3u);
  EXPECT_FIELDS(problem, (body.parts[0], (BodyPart{{{1.4, 0, 0}}, 0.9})),
                (body.parts[1], (BodyPart{{{-1, 0.5, 0}, {-1, -0.5, 0}, {4, 0, 0}}, 0})),
                (body.parts[2], (BodyPart{{{2, 0, 0}}, 0.25})),
                (projection, (Eigen::MatrixXd{{1, 0, 0, 0, 0, 0}, {0, 1, 0, 0, 0, 0}})));
  ASSERT_TRUE(problem.between);
  EXPECT_FIELDS(*problem.between, (acceleration, Numbers({1, 2})), (turn_rate, 3), (turn_acceleration, 4),
                (period, 0.1));
}

TEST_F(LoadConfig, ReadsABodyThatDoesNotTurn) {
  const auto with = [&](const std::string& body) {
    return *files_.Load(Replaced(kTask, "  projection: [px, py]\n", "  body: " + body + "\n")).problem;
  };
  const Problem flat = with("{pose: [py, px], parts: [{disc: {at: [1, 2], radius: 0}}]}");
  EXPECT_EQ(flat.body, (Body{-1, {{{{1, 2, 0}}, 0}}}));
  EXPECT_EQ(flat.projection, (Eigen::MatrixXd{{0, 1, 0, 0}, {1, 0, 0, 0}}));
  EXPECT_EQ(files_.Load(kTask).problem->body, Body{}) << "a projection is the short form for a point";

  // In space, a fourth name would be the heading.
  for (const auto& [pose, heading] : {std::pair{"[px, py, vx]", -1}, {"[px, py, vx, vy]", 3}}) {
    const Problem space = *files_
                               .Load(Replaced(Replaced(kTask, "  projection: [px, py]\n",
                                                       "  body: {pose: " + std::string(pose) +
                                                           ", parts: [{hull: {points: [[1, 2, 3], [4, 5, 6]]}}]}\n"),
                                              "[{circle: {center: [3, 2], radius: 0.8}}]", "[]"))
                               .problem;
    EXPECT_FIELDS(space, (body, (Body{heading, {{{{1, 2, 3}, {4, 5, 6}}, 0}}})), (projection.rows(), 3));
  }
}

TEST_F(LoadConfig, ReadsObstaclesThatMove) {
  const Config config = files_.Load(Replaced(
      kTask, "[{circle: {center: [3, 2], radius: 0.8}}]",
      "\n    - {motion: {velocity: [1, -2]}, circle: {center: [3, 2], radius: 0.8}}\n"
      "    - box: {lower: [1, 1], upper: [2, 2]}\n"
      "    - half_plane: {normal: [1, 0], offset: 9}\n"
      "      motion: {velocity: [0, 0], uncertainty: 0.5, growth: 0.25, growth_rate: 0.125, from: -1.5, until: "
      "0.0000019}\n"));
  ASSERT_EQ(config.obstacles.size(), 3u);
  EXPECT_EQ(config.obstacles[0].motion(), (ObstacleMotion{.velocity = {1, -2, 0}}));
  EXPECT_EQ(config.obstacles[1].motion(), std::nullopt);
  EXPECT_EQ(
      config.obstacles[2].motion(),
      (ObstacleMotion{.uncertainty = 0.5, .growth = 0.25, .growth_rate = 0.125, .from_us = -1'500'000, .until_us = 2}))
      << "a window is rounded outward";
  EXPECT_NO_THROW(RequireForCertifying(config));
}

TEST_F(LoadConfig, OnABusNoObstacleOfTheFileMoves) {
  const std::string moves =
      Replaced(kMeasuredTask, "radius: 0.8}}",
               "radius: 0.8}}, {circle: {center: [3, 2], radius: 0.8}, motion: {velocity: [0, 0]}}");
  for (const char* source : {"bus", "task"}) {
    const Config config = files_.Load(moves + "gate: {obstacles: " + source + ", obstacles_lost_ms: never}\n");
    EXPECT_THAT(RefusalOnBus(config),
                AllOf(StartsWith(config.path + ": task.obstacles[1].motion: "), HasSubstr("`forereach obstacles`")));
  }
}

TEST_F(LoadConfig, APlanHasToStopWhereTheTaskSaysWhatStandingIs) {
  const std::string says = Replaced(kTask, "  projection:", "  rest: {vy: 0.25, vx: 0.5}\n  projection:");
  EXPECT_TRUE(files_.Load().problem->rest.empty());
  for (const char* gate : {"", "gate: {require_stop: true}\n"}) {
    const std::vector<RestBound> rest = files_.Load(says + gate).problem->rest;
    ASSERT_EQ(rest.size(), 2u) << gate;
    EXPECT_FIELDS(rest[0], (coordinate, 2), (tolerance, 0.5));
    EXPECT_FIELDS(rest[1], (coordinate, 3), (tolerance, 0.25));
  }
  EXPECT_TRUE(files_.Load(says + "gate: {require_stop: false}\n").problem->rest.empty());
}

TEST_F(LoadConfig, AStepPeriodThatNobodyWroteIsNoLongerThanTheModels) {
  EXPECT_EQ(files_.Load().robot.step_period_ms, 150);
  const std::string fast =
      Replaced(Replaced(kTask, "dt: 0.15", "dt: 0.02"), "between: samples", "between: {acceleration: [1, 1]}");
  EXPECT_EQ(files_.Load(fast).robot.step_period_ms, 20);
  EXPECT_EQ(files_.Load(fast + "robot: {time_limit_s: 3}\n").robot.step_period_ms, 20);
  EXPECT_EQ(files_.Load(fast + "robot: {step_period_ms: 20}\n").robot.step_period_ms, 20);
  EXPECT_THAT(files_.Error(fast + "robot: {step_period_ms: 10}\n"), HasSubstr("is 10, and has to be model.dt, 20 ms"));
  EXPECT_THAT(files_.Error(fast + "robot: {step_period_ms: 20.5}\n"),
              HasSubstr("robot.step_period_ms: is 20.5, and has to be model.dt"));
}

TEST_F(LoadConfig, TheLongestStepIsTheModelsOrTheRobots) {
  EXPECT_EQ(files_.Load().gate.longest_step_ms, 150);
  EXPECT_EQ(files_.Load(std::string(kTask) + "robot: {step_period_ms: 200}\n").gate.longest_step_ms, 200);
}

using Parameters = std::vector<ModelText::Parameter>;

TEST_F(LoadConfig, NamedResidualsHaveTheModelsParametersAndThePapersValues) {
  const auto given = files_.Load(std::string(kTask) + "robot: {residual: {name: velocity_knee, knee: 2}}\n");
  const VelocityKnee knee{.dt = 0.15};
  Parameters expected;
  for (std::size_t i = 0; i < knee.parameters().size(); ++i)
    expected.push_back({VelocityKnee::kParameterNames[i], knee.parameters()[i], knee.parameters()[i]});
  expected[3].lower = expected[3].upper = 2;
  EXPECT_EQ(given.robot_residual->names.parameters, expected);
  EXPECT_FALSE(files_.Load(std::string(kTask) + "robot: {residual: none}\n").robot_residual);
  EXPECT_FALSE(files_.Load(std::string(kTask) + "robot: {residual: {name: none}}\n").robot_residual);

  const HeadingSaturation saturation{.dt = 0.1, .wheelbase = 2.5};
  Parameters heading;
  for (std::size_t i = 0; i < saturation.parameters().size(); ++i)
    heading.push_back({HeadingSaturation::kParameterNames[i], saturation.parameters()[i], saturation.parameters()[i]});
  EXPECT_EQ(forereach::LoadConfig(FOREREACH_SOURCE_DIR "/config/bicycle.yaml").robot_residual->names.parameters,
            heading);
}

// Each parameter of the library's residuals has a row, as a number and, for a proof, as an interval.
TEST_F(LoadConfig, EachParameterOfANamedResidualMayBeSet) {
  for (const ResidualText& text : NamedResiduals()) {
    if (text.name != "velocity_knee") continue;  // that of the task's model
    for (const ModelText::Parameter& parameter : text.parameters) {
      const std::string& name = parameter.name;
      const std::string begin = "residual: {name: " + text.name + ", " + name + ": ";
      const auto find = [&](const ParametricResidual& residual) {
        return *std::ranges::find(residual.names.parameters, name, &ModelText::Parameter::name);
      };
      EXPECT_EQ(find(*files_.Load(std::string(kTask) + begin + "[0.25, 0.5]}\n").residual),
                (ModelText::Parameter{name, 0.25, 0.5}));
      EXPECT_EQ(find(*files_.Load(std::string(kTask) + "robot: {" + begin + "0.5}}\n").robot_residual),
                (ModelText::Parameter{name, 0.5, 0.5}));
    }
  }
}

TEST_F(LoadConfig, ReadsResidualsAsText) {
  const Config config = files_.Load(std::string(kTask) +
                                    "residual:\n"
                                    "  parameters: {c: [0.1, 0.2], k: 3}\n"
                                    "  let: {size: 'hypot(vx, vy)'}\n"
                                    "  add: {vy: -dt*c*vy*size, px: k*ax}\n"
                                    "robot: {residual: {parameters: {c: 0.15}, add: {vx: -c*abs(vx)}}}\n");
  const ParametricResidual& residual = *config.residual;
  EXPECT_EQ(residual.names.parameters, (Parameters{{"dt", 0.15, 0.15}, {"c", 0.1, 0.2}, {"k", 3, 3}}));
  EXPECT_EQ(residual.names.states, config.problem->model->state_names());
  EXPECT_EQ(residual.names.inputs, config.problem->model->input_names());
  EXPECT_EQ(Only(residual.names.definitions).value.text, "hypot(vx, vy)");
  std::vector<std::string> values;
  for (const ExpressionText& value : residual.values) values.push_back(value.text);
  EXPECT_EQ(values, (std::vector<std::string>{"k*ax", "0", "0", "-dt*c*vy*size"}));
  EXPECT_EQ(config.robot_residual->names.parameters, (Parameters{{"dt", 0.15, 0.15}, {"c", 0.15, 0.15}}));
  EXPECT_EQ(config.robot_residual->values[2].text, "-c*abs(vx)");
}

TEST_F(LoadConfig, ReadsBallsAndInequalities) {
  const Config config = files_.Load(Replaced(kTask, "  input: {lower",
                                             "  balls: [{coordinates: [vy, ax], center: [0.5, 0], radius: 2}]\n"
                                             "  inequalities:\n"
                                             "    - {coefficients: {ay: 2, vx: 1}, bound: 3}\n"
                                             "  input: {lower"));
  const Domain& domain = config.problem->domain;
  EXPECT_FIELDS(Only(domain.balls), (coordinates, (std::vector<int>{3, 4})), (center, Numbers({0.5, 0})), (radius, 2));
  EXPECT_FIELDS(Only(domain.inequalities), (coefficients, Numbers({0, 0, 1, 0, 0, 2})), (bound, 3));
}

TEST_F(LoadConfig, ReadsEveryObstacle) {
  const Config config = files_.Load(Replaced(kTask, "[{circle: {center: [3, 2], radius: 0.8}}]",
                                             "\n    - box: {lower: [1, 2], upper: [1, 4]}\n"
                                             "    - polygon: {vertices: [[0, 0], [1, 0], [0, 1]]}\n"
                                             "    - half_plane: {normal: [0, 1], offset: 5}"));
  ASSERT_EQ(config.obstacles.size(), 3u);
  EXPECT_FIELDS(config, (obstacles[0].kind(), Obstacle::Kind::kBox), (obstacles[0].points()[1], Numbers({1, 4})),
                (obstacles[1].points().size(), 3u), (obstacles[2].kind(), Obstacle::Kind::kHalfSpace),
                (obstacles[2].offset(), 5));
}

TEST_F(LoadConfig, ReadsAMapFromItsTopRowDown) {
  const auto load = [&](const std::string& more, const std::string& rows) {
    return files_.Load(Replaced(kTask, "[{circle: {center: [3, 2], radius: 0.8}}]",
                                "\n    - name: map\n      grid:\n        resolution: 0.5\n        size: [3, 2]\n"
                                "        origin: [1, 2, 0.25]\n" +
                                    more + "        rows: |\n          " + rows + "\n          ...\n"));
  };
  const Config config = load("", "#.?");
  const OccupancyGrid::Map& map = Only(config.obstacles).grid()->map();
  EXPECT_FIELDS(map, (resolution, 0.5), (origin, (std::array{1.0, 2.0})), (yaw, 0.25), (width, 3), (height, 2),
                (outside_is_free, false), (occupied, (std::vector{false, false, false, true, false, true})));
  EXPECT_EQ(NameOf(config.obstacles, 0, 1), "cell (2, 1) of map");
  const Config free = load("        unknown: free\n", "#.?"), other = load("        unknown: free\n", "#..");
  EXPECT_EQ(free.obstacles[0].grid()->map().occupied, (std::vector{false, false, false, true, false, false}));
  EXPECT_TRUE(free.obstacles[0].grid()->map().outside_is_free);
  EXPECT_NE(config.grounds.obstacles, free.grounds.obstacles);
  EXPECT_EQ(free.grounds.obstacles, other.grounds.obstacles) << "the same cells";
  EXPECT_NE(free.grounds.config, other.grounds.config);
  EXPECT_NE(free.grounds.obstacles, load("        unknown: free\n", "##.").grounds.obstacles);
}

TEST_F(LoadConfig, ProjectionsHaveOneToThreeRows) {
  const auto projection = [&](const std::string& rows, const std::string& obstacles) {
    return files_
        .Load(Replaced(Replaced(kTask, "[px, py]", rows), "[{circle: {center: [3, 2], radius: 0.8}}]", obstacles))
        .problem->projection;
  };
  EXPECT_EQ(projection("[py]", "[{half_plane: {normal: [1], offset: 3}}]"), Numbers({0, 1, 0, 0}).transpose());
  EXPECT_EQ(projection("[[1, 0, 0.5, 0]]", "[{box: {lower: [1], upper: [2]}}]"), Numbers({1, 0, 0.5, 0}).transpose());
  EXPECT_EQ(projection("[vx, px, py]", "[{box: {lower: [1, 1, 1], upper: [2, 2, 2]}}]").rows(), 3);
}

TEST_F(LoadConfig, TransitionsNeedNotExistWhereTheyAreStillToBeMade) {
  const ScratchDirectory directory;
  const Config config = forereach::LoadConfig(directory.Write("task.yaml", kTask), TransitionsFile::kIgnore);
  EXPECT_FIELDS(*config.problem, (transitions.size(), 0), (domain.state.dim(), 4));
}

TEST(Schema, DefaultsStandInsideTheirRanges) {
  for (const Key& key : Schema()) {
    if (key.fallback.empty() || (key.type != Key::Type::kNumber && key.type != Key::Type::kInteger)) continue;
    if (key.fallback.find_first_of("0123456789") == std::string::npos) continue;  // in words
    EXPECT_TRUE(key.range.Contains(std::stod(key.fallback))) << key.path;
  }
}

TEST(Schema, EveryKeyStandsInAMapOrList) {
  for (const Key& key : Schema()) {
    if (key.path.empty()) continue;
    const std::size_t end = key.path.ends_with("[]") ? key.path.size() - 2 : key.path.rfind('.');
    const std::string outer = key.path.substr(0, end == std::string::npos ? 0 : end);
    const auto holds = [&](const Key& row) {
      return row.path == outer && (row.type == Key::Type::kMap || row.type == Key::Type::kList);
    };
    EXPECT_TRUE(std::any_of(Schema().begin(), Schema().end(), holds)) << key.path;
    EXPECT_FALSE(key.meaning.empty()) << key.path;
  }
}

}  // namespace forereach::config_test
