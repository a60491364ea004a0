// What is wrong with a task file: one error that names file, line, key, value and bound. TaskFiles::Error sees to the
// file.

#include "tests/task/task_files.h"

namespace forereach::error_test {

struct ErrorTest : testing::Test {
  // The error of the good task file with `to` in the place of `from`, and with a line added.
  std::string With(const std::string& from, const std::string& to) const { return files_.ErrorWith(from, to); }
  std::string After(const std::string& line) const { return files_.Error(kTask + line); }

  TaskFiles files_;
};

TEST_F(ErrorTest, TheTaskThatTheseTestsChangeHasNoError) { EXPECT_EQ(files_.Error(kTask), ""); }

TEST_F(ErrorTest, AnUnknownKeyIsAnErrorThatSuggestsTheNearest) {
  EXPECT_EQ(With("  noise_bound:", "  noise_bounds:"),
            "11: declaration.noise_bounds: unknown key; did you mean noise_bound?");
  EXPECT_EQ(After("planer: {}\n"), "20: planer: unknown key; did you mean planner?");
  EXPECT_EQ(After("gate: {colour: 3}\n"),
            "20: gate.colour: unknown key; known here: max_age_ms, max_ahead_ms, certificate_lifetime_ms, "
            "decision_budget_ms, max_pieces, queue, mode, advice, arming, robot_timeout_ms, max_clock_jump_ms, "
            "max_clock_error_ms, obstacles, obstacles_timeout_ms, obstacles_lost_ms, learn, require_stop, state");
  EXPECT_EQ(With("    vx: {vx: 0.1,", "    theta: {vx: 0.1,"),
            "9: declaration.lipschitz.theta: unknown key; known here: px, py, vx, vy");
  EXPECT_EQ(With("{vx: 0.1, vy", "{vx: 0.1, v_y"), "9: declaration.lipschitz.vx.v_y: unknown key; did you mean vy?");
  EXPECT_EQ(With("radius: 0.8", "radius: 0.8, color: red"),
            "18: task.obstacles[0].circle.color: unknown key; known here: center, radius");
  EXPECT_THAT(After("<<: {gate: {}}\n"), StartsWith("20: <<: unknown key"));
}

TEST_F(ErrorTest, ErrorsComeInTheSchemasOrder) {
  EXPECT_THAT(files_.Error("model: {name: hovercraft}\n"), HasSubstr("model.name: hovercraft is not known"));
  const std::string task = kTask, without_model = task.substr(task.find('\n') + 1);
  EXPECT_THAT(files_.Error(without_model), HasSubstr("model: missing"));
}

TEST_F(ErrorTest, MessagesAreOneLineWhateverTheFileHolds) {
  EXPECT_EQ(With("dt: 0.15", "dt: 0.15, \"a\\nb\\e[2J\": 1"),
            "1: model.a?b?[2J: unknown key; known here: name, dt, wheelbase, set_at_steps, rate_bound, file, states, "
            "inputs, parameters, let, next, rate, integrator, angles");
  EXPECT_EQ(With("name: point_mass", "name: \"point\\nmass\""),
            "1: model.name: point?mass is not known; did you mean point_mass?");
}

TEST_F(ErrorTest, AnEmergencyStopThatDoesNotFitIsAnError) {
  EXPECT_EQ(After("robot: {emergency_stop: {vx: 3, vy: 1e-3}}\n"), "");
  EXPECT_EQ(After("robot: {emergency_stop: {vx: 3}, hold: [vx]}\n"), "");
  EXPECT_EQ(After("robot: {emergency_stop: {vx: 3, vy: 3}, hold: [vx]}\n"),
            "20: robot.emergency_stop.vy: is not zero while the robot stands: robot.hold does not name it");
  EXPECT_EQ(After("robot: {emergency_stop: {px: 3}}\n"),
            "20: robot.emergency_stop.px: is not zero while the robot stands: robot.hold does not name it");
  EXPECT_EQ(After("robot: {emergency_stop: {}}\n"),
            "20: robot.emergency_stop: names no state, so nothing would be braked");
  EXPECT_EQ(After("robot: {emergency_stop: {vx: 0}}\n"), "20: robot.emergency_stop.vx: 0 is outside (0, inf)");
  EXPECT_EQ(After("robot: {emergency_stop: {speed: 1}}\n"),
            "20: robot.emergency_stop.speed: unknown key; known here: px, py, vx, vy");
}

TEST_F(ErrorTest, BoundsOfRestThatDoNotFitAreAnError) {
  const auto error = [&](const std::string& rest) {
    return With("  projection:", "  rest: " + rest + "\n  projection:");
  };
  EXPECT_EQ(error("{vx: 0.1, vy: 0}"), "");
  EXPECT_EQ(error("{}"), "17: task.rest: names no state, so everything would be standing");
  EXPECT_EQ(error("{vx: -0.1}"), "17: task.rest.vx: -0.1 is outside [0, inf)");
  EXPECT_EQ(error("{vx: .nan}"), "17: task.rest.vx: .nan is not a finite number; write a number in [0, inf)");
  EXPECT_EQ(error("{ax: 0.1}"), "17: task.rest.ax: unknown key; did you mean px?");
  EXPECT_EQ(After("gate: {require_stop: true}\n"),
            "20: gate.require_stop: true, but task.rest does not say what standing is");
  EXPECT_EQ(After("gate: {require_stop: false}\n"), "");
  EXPECT_THAT(After("gate: {require_stop: yes}\n"), HasSubstr("gate.require_stop: yes is not known"));
}

TEST_F(ErrorTest, ABodyThatDoesNotFitIsAnError) {
  const auto error = [&](const std::string& body) { return With("  projection: [px, py]", "  body: " + body); };
  const auto parts = [&](const std::string& list) { return error("{pose: [px, py], parts: " + list + "}"); };
  const std::string good = "[{disc: {at: [1, 0], radius: 0}}]";
  EXPECT_EQ(parts(good), "");
  EXPECT_EQ(With("  projection: [px, py]\n", ""),
            "14: task.projection: missing: the task needs this key, or task.body");
  EXPECT_EQ(With("  projection: [px, py]\n", "  projection: [px, py]\n  body: {pose: [px, py], parts: " + good + "}\n"),
            "18: task.body: the task has task.projection too; delete one of them");
  EXPECT_THAT(error("{parts: " + good + "}"), StartsWith("17: task.body.pose: missing: "));
  EXPECT_THAT(error("{pose: [px, py]}"), StartsWith("17: task.body.parts: missing: "));
  EXPECT_EQ(parts("[]"), "17: task.body.parts: has 0 entries, which is outside [1, 16]");
  EXPECT_EQ(parts("[{}]"), "17: task.body.parts[0]: has 0 keys, has to have one of disc, hull");
  EXPECT_EQ(parts("[{disc: {at: [1, 0], radius: 0}, hull: {points: [[1, 0]]}}]"),
            "17: task.body.parts[0]: has 2 keys, has to have one of disc, hull");
  EXPECT_EQ(parts("[{ball: {}}]"), "17: task.body.parts[0].ball: unknown key; did you mean hull?");
  EXPECT_THAT(parts("[{disc: {at: [1, 0]}}]"), StartsWith("17: task.body.parts[0].disc.radius: missing: "));
  EXPECT_EQ(parts("[{disc: {at: [1, 0], radius: -1e-300}}]"),
            "17: task.body.parts[0].disc.radius: -1e-300 is outside [0, inf)");
  EXPECT_EQ(parts("[{disc: {at: [1e153, 0], radius: 1e307}}]"), "");
  EXPECT_EQ(parts("[{disc: {at: [1e308, 1e308], radius: 1e308}}]"), "14: task: body: its size is not finite");
  EXPECT_EQ(
      parts("[{disc: {at: [1, .inf], radius: 0}}]"),
      "17: task.body.parts[0].disc.at[1]: .inf is not a finite number; write a number in (-inf, inf), its unit is m");
  EXPECT_EQ(parts("[{disc: {at: [1], radius: 0}}]"),
            "17: task.body.parts[0].disc.at: has 1 entries, has to have 2 or 3");
  EXPECT_EQ(parts("[{hull: {points: [[1, 0], [1, 0, 0, 0]]}}]"),
            "17: task.body.parts[0].hull.points[1]: has 4 entries, has to have 2 or 3");
  EXPECT_EQ(
      parts("[{disc: {at: [1, 0], radius: 0}}, {hull: {points: [[1, 0], [1, 0, 0]]}}]"),
      "17: task.body.parts[1].hull.points[1]: has 3 entries, has to have 2, as many as the first point of the body");
  EXPECT_THAT(error("{pose: [px], parts: " + good + "}"), HasSubstr("task.body.pose: has 1 entries, which is outside"));
  EXPECT_EQ(error("{pose: [px, px], parts: " + good + "}"), "17: task.body.pose[1]: duplicate name px");
  EXPECT_EQ(error("{pose: [px, ax], parts: " + good + "}"),
            "17: task.body.pose[1]: ax is not a coordinate; did you mean px?");
  for (const auto& [pose, points] : {std::pair{"[px, py]", "[[1, 0, 0]]"}, {"[px, py, vx, vy]", "[[1, 0]]"}})
    EXPECT_THAT(error("{pose: " + std::string(pose) + ", parts: [{hull: {points: " + points + "}}]}"),
                AllOf(StartsWith("17: task.body.pose: has "),
                      HasSubstr(", as many as the points of the body, or one more, the heading")));
}

TEST_F(ErrorTest, ABodyAtExpressionsThatDoesNotFitIsAnError) {
  const auto error = [&](const std::string& body) { return With("  projection: [px, py]", "  body: " + body); };
  EXPECT_EQ(error("{parts: [{disc: {place: [px, vx*py], radius: 0.1}}]}"), "");
  EXPECT_EQ(
      error("{pose: [px, py], parts: [{disc: {at: [1, 0], radius: 0}}, {hull: {places: [[px, py], [px + 1, py]]}}]}"),
      "");
  EXPECT_EQ(error("{parts: [{hull: {places: [[px, py], [px]]}}]}"),
            "17: task.body.parts[0].hull.places[1]: has 1 entries, which is outside [2, 3]");
  EXPECT_EQ(
      error("{parts: [{hull: {places: [[px, py], [px, py, vx]]}}]}"),
      "17: task.body.parts[0].hull.places[1]: has 3 entries, has to have 2, as many as the first point of the body");
  EXPECT_EQ(error("{parts: [{disc: {place: [px, v_x], radius: 0}}]}"),
            "17:38: v_x is not a name that is known here; did you mean vx?");
  EXPECT_EQ(error("{parts: [{disc: {place: [px, ax], radius: 0}}]}"), "17:38: body: the place ax uses an input");
  EXPECT_EQ(error("{parts: [{disc: {radius: 0}}]}"), "17: task.body.parts[0].disc: missing: at or place");
  EXPECT_EQ(error("{parts: [{hull: {points: [[1, 0]], places: [[px, py]]}}]}"),
            "17: task.body.parts[0].hull: has points in the robot's frame and at expressions; delete one of them");
  EXPECT_EQ(error("{parts: [{hull: {points: [[1, 0]]}}, {disc: {place: [px, py], radius: 0}}]}"),
            "17: task.body.pose: missing: the states that are the position of the robot's frame");
}

TEST_F(ErrorTest, ALimitThatDoesNotFitIsAnError) {
  const auto error = [&](const std::string& limits) {
    return With("  projection:", "  limits: " + limits + "\n  projection:");
  };
  EXPECT_EQ(error("[]"), "");
  EXPECT_EQ(
      error("[{name: force, that: \"2*hypot(ax, ay)\", at_most: 6}, {name: lane, that: py, at_least: -1, at_most: 2}]"),
      "");
  EXPECT_EQ(error("[{name: force, that: ax, at_most: 6, at_last: 1}]"),
            "17: task.limits[0].at_last: unknown key; did you mean at_least?");
  EXPECT_THAT(error("[{name: force, at_most: 6}]"), StartsWith("17: task.limits[0].that: missing: "));
  EXPECT_THAT(error("[{that: ax, at_most: 6}]"), StartsWith("17: task.limits[0].name: missing: "));
  EXPECT_EQ(error("[{name: force, that: ax}]"),
            "17: task.limits[0]: bounds nothing, has to have at_most, at_least or both");
  EXPECT_EQ(error("[{name: force, that: ax, at_most: 1, at_least: 2}]"),
            "17: task.limits[0].at_most: 1 is outside [2, inf), below task.limits[0].at_least");
  EXPECT_THAT(error("[{name: force, that: ax, at_most: .inf}]"),
              StartsWith("17: task.limits[0].at_most: .inf is not a finite number"));
  EXPECT_EQ(error("[{name: a, that: ax, at_most: 1}, {name: a, that: ay, at_most: 1}]"),
            "17: task.limits[1].name: a is the name of task.limits[0], too");
  EXPECT_EQ(error("[{name: a, that: ax + v_x, at_most: 1}]"),
            "17:33: v_x is not a name that is known here; did you mean vx?");
  EXPECT_EQ(error("[{name: a, that: \"softplus(ax, 1)\", at_most: 1}]"),
            "17:29: softplus and smooth_gate are for residuals and the planner's laws: the model, limits and places "
            "need derivatives");
  EXPECT_THAT(error("[{name: " + std::string(49, 'a') + ", that: ax, at_most: 1}]"),
              StartsWith("14: task: limits: limit 0: its name has 49 bytes, must be 1 to 48"));
}

TEST_F(ErrorTest, ABodyHasAtMostSixteenPointsInAll) {
  const auto error = [&](int hull, int discs) {
    std::string parts = "[{hull: {points: [[0, 0]";
    for (int i = 1; i < hull; ++i) parts += ", [0, " + std::to_string(i) + "]";
    parts += "]}}";
    for (int i = 0; i < discs; ++i) parts += ", {disc: {at: [0, 0], radius: 1}}";
    return With("  projection: [px, py]", "  body: {pose: [px, py], parts: " + parts + "]}");
  };
  EXPECT_EQ(error(16, 0), "");
  EXPECT_EQ(error(1, 15), "");
  EXPECT_EQ(error(9, 7), "");
  EXPECT_EQ(error(17, 0), "17: task.body.parts[0].hull.points: has 17 entries, which is outside [1, 16]");
  EXPECT_EQ(error(1, 16), "17: task.body.parts: has 17 entries, which is outside [1, 16]");
  EXPECT_EQ(error(9, 8), "17: task.body.parts: have 17 points, which is outside [1, 16]");
}

TEST_F(ErrorTest, BoundsBetweenSamplesThatDoNotFitAreAnError) {
  const auto error = [&](const std::string& between) { return With("between: samples", "between: " + between); };
  EXPECT_EQ(error("{acceleration: [0, 1]}"), "");
  EXPECT_EQ(error("sample"), "19: task.between: sample is not known; did you mean samples?");
  EXPECT_EQ(error("[1, 1]"), "19: task.between: a list is not a word or a map");
  EXPECT_THAT(error("{}"), StartsWith("19: task.between.acceleration: missing: "));
  EXPECT_EQ(error("{acceleration: [-1e-300, 1]}"), "19: task.between.acceleration[0]: -1e-300 is outside [0, inf)");
  EXPECT_EQ(error("{acceleration: [1]}"),
            "19: task.between.acceleration: has 1 entries, has to have 2, one a safety coordinate (task.projection or "
            "task.body)");
  EXPECT_EQ(error("{acceleration: [1, 1], turn_rate: 0}"),
            "19: task.between.turn_rate: is for a body with a heading, the last name of task.body.pose");
  EXPECT_EQ(error("{acceleration: [1, 1], turn_acceleration: 0}"),
            "19: task.between.turn_acceleration: is for a body with a heading, the last name of task.body.pose");

  EXPECT_THAT(files_.Error(Replaced(kTask, "between: samples", "between: {acceleration: [1, 1]}") +
                           "robot: {step_period_ms: 150.001}\n"),
              HasSubstr(": robot.step_period_ms: is 150.001, and has to be model.dt, 150 ms: task.between"));
  const auto turning = [&](const std::string& between) {
    const std::string body = "  body: {pose: [px, py, vx], parts: [{disc: {at: [1, 0], radius: 1}}]}";
    return files_.Error(Replaced(Replaced(kTask, "  projection: [px, py]", body), "between: samples",
                                 "between: {acceleration: [1, 1]" + between + "}"));
  };
  EXPECT_EQ(turning(", turn_rate: 0, turn_acceleration: 0"), "");
  EXPECT_EQ(turning(", turn_rate: 1e100, turn_acceleration: 0"), "");
  EXPECT_EQ(turning(", turn_rate: 1e200, turn_acceleration: 0"), "14: task: body: its size is not finite");
  EXPECT_EQ(turning(", turn_rate: 0"),
            "19: task.between.turn_acceleration: missing: task.body has a heading, so the bound is needed");
  EXPECT_EQ(turning(""), "19: task.between.turn_rate: missing: task.body has a heading, so the bound is needed");
  EXPECT_EQ(turning(", turn_rate: -1, turn_acceleration: 0"), "19: task.between.turn_rate: -1 is outside [0, inf)");
}

TEST_F(ErrorTest, AMotionOfAnObstacleThatDoesNotFitIsAnError) {
  const auto error = [&](const std::string& motion) {
    return With("radius: 0.8}}", "radius: 0.8}, motion: " + motion + "}");
  };
  const auto with = [&](const std::string& rest) { return error("{velocity: [1, 1], " + rest + "}"); };
  EXPECT_EQ(error("{velocity: [1, 1]}"), "");
  EXPECT_THAT(error("{}"), StartsWith("18: task.obstacles[0].motion.velocity: missing: "));
  EXPECT_EQ(error("{velocity: [1, 1, 0]}"),
            "18: task.obstacles[0].motion.velocity: has 3 entries, has to have 2, one a safety coordinate "
            "(task.projection or task.body)");
  for (const std::string name : {"uncertainty", "growth", "growth_rate"}) {
    EXPECT_EQ(with(name + ": 0"), "");
    EXPECT_EQ(with(name + ": -1"), "18: task.obstacles[0].motion." + name + ": -1 is outside [0, inf)");
  }
  for (const std::string name : {"from", "until"}) {
    for (const char* end : {"-1e9", "1e9"}) EXPECT_EQ(with(name + ": " + end), "");
    EXPECT_EQ(with(name + ": 1000000001"),
              "18: task.obstacles[0].motion." + name + ": 1000000001 is outside [-1e+09, 1e+09]");
  }
  EXPECT_EQ(with("from: 1, until: 1"), "");
  EXPECT_EQ(with("from: 1, until: 0.5"),
            "18: task.obstacles[0].motion.until: 0.5 is outside [1, inf), below task.obstacles[0].motion.from");
  EXPECT_EQ(With("{circle: {center: [3, 2], radius: 0.8}}", "{motion: {velocity: [1, 1]}}"),
            "18: task.obstacles[0]: has 0 keys of a shape, has to have one of circle, box, polygon, half_plane, grid");
}

TEST_F(ErrorTest, AKeyOfAnotherModelIsAnError) {
  EXPECT_EQ(With("dt: 0.15}", "dt: 0.15, wheelbase: 2.5}"),
            "1: model.wheelbase: is for kinematic_bicycle, not for point_mass");
  EXPECT_EQ(With("point_mass", "kinematic_bicycle"), "1: model.wheelbase: missing: Distance between the axles.");
  EXPECT_EQ(After("robot: {residual: {name: velocity_knee, friction: 1}}\n"),
            "20: robot.residual.friction: is for heading_saturation, not for velocity_knee");
  EXPECT_EQ(After("robot: {residual: {name: heading_saturation}}\n"),
            "20: robot.residual.name: the residual heading_saturation is for a model with the state theta, which "
            "point_mass does not have");
}

TEST_F(ErrorTest, AResidualAsTextThatDoesNotFitIsAnError) {
  const auto with = [&](const std::string& value) { return After("residual: {" + value + "}\n"); };
  EXPECT_EQ(with(""), "20: residual: has neither add, what the next states have beyond the model's, nor name");
  EXPECT_EQ(with("name: velocity_knee, add: {vx: vx}"), "20: residual: has both name and add; delete one of them");
  EXPECT_EQ(with("name: velocity_knee, parameters: {c: 1}"),
            "20: residual.parameters: is for a residual as text, this one has a name");
  EXPECT_EQ(with("add: {vz: 1}"), "20: residual.add.vz: unknown key; did you mean vx?");
  EXPECT_EQ(with("add: {vx: vx*drug}, parameters: {drag: 1}"),
            "20:25: drug is not a name that is known here; did you mean drag?");
  EXPECT_EQ(with("add: {vx: c}, parameters: {c: [2, 1]}"),
            "20: residual.parameters.c[1]: 1 is outside [2, inf), below residual.parameters.c[0]");
  EXPECT_EQ(with("add: {vx: dt}, parameters: {dt: 1}"), "20: residual: the name dt is used twice");
  EXPECT_EQ(with("add: {vx: sin}, parameters: {sin: 1}"), "20: residual: the name sin belongs to the language");
  EXPECT_EQ(with("add: {vx: vx}, let: {vy: vx}"), "20:37: the name vy is used twice");
  EXPECT_EQ(with("add: {vx: \"softplus(vx, 0.1)\"}"), "");
  EXPECT_EQ(with("add: {vx: b}, let: {a: b, b: vx}"),
            "20:35: b is not a name that is known here; known here: px, py, vx, vy, ax, ay, dt, pi");
  EXPECT_EQ(After("robot: {residual: {add: {vx: c}, parameters: {c: [1, 2]}}}\n"),
            "20: robot.residual.parameters.c: a list is not a number; write a number in (-inf, inf)");
}

TEST_F(ErrorTest, DefinitionsOfThePlannerHaveNamesOfTheirOwn) {
  EXPECT_EQ(After("planner: {let: {speed: vx}, stop: {ax: -speed, ay: -vy}}\n"), "");
  EXPECT_EQ(After("planner: {let: {vx: 1}, stop: {ax: -vx, ay: -vy}}\n"), "20:21: the name vx is used twice");
}

TEST_F(ErrorTest, ADisturbanceThatDoesNotFitIsAnError) {
  const auto with = [&](const std::string& value) {
    const std::string line = "  noise_bound: [0, 0, 0.01, 0.01]\n";
    return With(line, line + "  disturbance: " + value + "\n");
  };
  EXPECT_EQ(with("[0, 0, -1e-9, 0]"), "12: declaration.disturbance[2]: -1e-9 is outside [0, inf)");
  EXPECT_EQ(with("[0, 0, .inf, 0]"),
            "12: declaration.disturbance[2]: .inf is not a finite number; write a number in [0, inf)");
  EXPECT_EQ(with("[0, 0, 1]"), "12: declaration.disturbance: has 3 entries, has to have 4: px, py, vx, vy");
  EXPECT_EQ(with("0.1"), "12: declaration.disturbance: 0.1 is not a map or a list of numbers");
  EXPECT_EQ(with("{vx: -1e-9}"), "12: declaration.disturbance.vx: -1e-9 is outside [0, inf)");
  EXPECT_EQ(with("{ax: 1}"), "12: declaration.disturbance.ax: unknown key; did you mean px?");
  EXPECT_EQ(with("{vx: 0.1, vy: 0.02 + 0.3*abs(vx*(ax - vy)), px: -vx}"), "") << "the sign does not count";
  EXPECT_EQ(with("{vx: 0.02 + 0.3*wind}"),
            "12:32: wind is not a name that is known here; known here: px, py, vx, vy, ax, ay, dt, pi");
  EXPECT_EQ(with("{vx: .inf}"), "12:21: . is not a number; write digits behind the point");
  EXPECT_EQ(with("{vx: 1e999}"), "12:21: 1e999 is too large or too small to represent");
  EXPECT_EQ(with("{vx: \"max(vx\"}"), "12:22: ( has no )");
  EXPECT_EQ(with("{vx: [1]}"), "12: declaration.disturbance.vx: a list is not an expression");
  EXPECT_THAT(with("{vx: \"" + std::string(1 << 16, '(') + "\"}"), StartsWith("12:"));
}

// Where a bound on the disturbance is undefined or infinite, the key, the state and the place are named.
TEST_F(ErrorTest, ADisturbanceWithoutABoundInTheDomainIsAnError) {
  const auto with = [&](const std::string& vx) {
    const std::string line = "  noise_bound: [0, 0, 0.01, 0.01]\n";
    return With(line, line + "  disturbance: {vx: \"" + vx + "\"}\n");
  };
  EXPECT_EQ(with("1/(vx + 6)"), "");
  EXPECT_EQ(with("sqrt(6 - abs(vy))*exp(ax)"), "");
  const std::string nowhere =
      "12: declaration.disturbance.vx: has to have a finite value everywhere in the domain's box, and nothing bounds "
      "it";
  EXPECT_EQ(with("1/(vx - 2)"), nowhere + " near vx 2");
  EXPECT_EQ(with("1/((ax - 2)*vy)"), nowhere + " near ax 2");
  EXPECT_EQ(with("sqrt(vy)"), nowhere + " near vy -5.4");
  EXPECT_EQ(with("exp(1000*px)"), nowhere + " near px 0.7098");
  EXPECT_EQ(with("0/0"), nowhere);
}

TEST_F(ErrorTest, AnErrorOfRecordsThatDoesNotFitIsAnError) {
  const auto with = [&](const std::string& value) {
    const std::string line = "  noise_bound: [0, 0, 0.01, 0.01]\n";
    return With(line, line + "  " + value + "\n");
  };
  EXPECT_EQ(with("state_error: {vx: 0.1, py: 0}"), "");
  EXPECT_EQ(with("state_error: {vx: -1e-9}"), "12: declaration.state_error.vx: -1e-9 is outside [0, inf)");
  EXPECT_EQ(with("state_error: [0, 0, .nan, 0]"),
            "12: declaration.state_error[2]: .nan is not a finite number; write a number in [0, inf)");
  EXPECT_THAT(with("state_error: {ax: 0.1}"), StartsWith("12: declaration.state_error.ax: "));
  EXPECT_EQ(with("input_error: [0, 0, 1]"), "12: declaration.input_error: has 3 entries, has to have 2: ax, ay");
  EXPECT_THAT(with("input_error: {vx: 0.1}"), StartsWith("12: declaration.input_error.vx: "));
}

TEST_F(ErrorTest, AMissingKeyIsAnError) {
  EXPECT_THAT(With("transitions: steps.csv\n", ""), StartsWith("1: transitions: missing: "));
  EXPECT_THAT(With(", dt: 0.15", ""), StartsWith("1: model.dt: missing: "));
  EXPECT_THAT(With("  noise_bound: [0, 0, 0.01, 0.01]\n", ""), StartsWith("8: declaration.noise_bound: missing: "));
  EXPECT_EQ(After("robot: {disturbance: random}\n"),
            "20: robot.disturbance: random, and declaration.disturbance allows for none");
  EXPECT_EQ(After("robot: {sensor_error: adversarial}\n"),
            "20: robot.sensor_error: adversarial, and declaration.state_error allows for none");
  EXPECT_EQ(After("robot: {input_error: random}\n"),
            "20: robot.input_error: random, and declaration.input_error allows for none");
  EXPECT_THAT(With(", radius: 0.8", ""), StartsWith("18: task.obstacles[0].circle.radius: missing: "));
  EXPECT_EQ(After("planner: {source: policy}\n"),
            "20: planner.policy: missing: a policy's file, for planner.source: policy");
  EXPECT_THAT(After("robot: {residual: {}}\n"), StartsWith("20: robot.residual: has neither add"));
}

TEST_F(ErrorTest, ADuplicateKeyIsAnErrorThatNamesTheFirst) {
  EXPECT_EQ(With("vy: 0.05}", "vx: 0.05}"),
            "9: declaration.lipschitz.vx.vx: duplicate key, first in line 9; delete one of them");
  EXPECT_EQ(After("transitions: other.csv\n"), "20: transitions: duplicate key, first in line 12; delete one of them");
}

TEST_F(ErrorTest, AListOfAWrongSizeIsAnError) {
  EXPECT_EQ(With("lower: [-20, -20, -5.4, -5.4]", "lower: [-20, -20, -5.4]"),
            "4: domain.state.lower: has 3 entries, has to have 4: px, py, vx, vy");
  EXPECT_EQ(With("{lower: [-3, -3]", "{lower: [-3]"), "6: domain.input.lower: has 1 entries, has to have 2: ax, ay");
  EXPECT_EQ(With("center: [3, 2]", "center: [3, 2, 1]"),
            "18: task.obstacles[0].circle.center: has 3 entries, has to have 2, one a safety coordinate "
            "(task.projection or task.body)");
  EXPECT_EQ(With("[px, py]", "[[1, 0, 0]]"), "17: task.projection[0]: has 3 entries, has to have 4: px, py, vx, vy");
  EXPECT_EQ(With("[px, py]", "[px, py, vx, vy]"), "17: task.projection: has 4 entries, which is outside [1, 3]");
  EXPECT_EQ(With("  input: {", "  balls: [{coordinates: [vx, vy], center: [0], radius: 1}]\n  input: {"),
            "6: domain.balls[0].center: has 1 entries, has to have 2, as many as coordinates");
  EXPECT_EQ(After("planner: {goal: [1, 2, 3]}\n"),
            "20: planner.goal: has 3 entries, has to have 2, one a safety coordinate (task.projection or task.body)");
}

TEST_F(ErrorTest, AMatrixOfAWrongSizeIsAnError) {
  const std::string names = "\n    vx: {vx: 0.1, vy: 0.05}\n    vy: {vx: 0.05, vy: 0.1}\n";
  EXPECT_EQ(With(names, " [[0, 0, 0, 0, 0, 0]]\n"), "8: declaration.lipschitz: has 1 rows, has to have 4, one a state");
  EXPECT_EQ(With(names, "\n    - [0, 0, 0, 0, 0, 0]\n    - [0, 0, 0, 0, 0]\n"),
            "10: declaration.lipschitz[1]: has 5 entries, has to have 6: px, py, vx, vy, ax, ay");
  EXPECT_EQ(With(names, "\n    - [0, 0, 0, 0, 0, 0]\n    - [0, 0, -1, 0, 0, 0]\n"),
            "10: declaration.lipschitz[1][2]: -1 is outside [0, inf)");
  EXPECT_EQ(With(names, " 3\n"), "8: declaration.lipschitz: 3 is not a map or a list of lists of numbers");
}

TEST_F(ErrorTest, ANumberThatIsNotFiniteIsAnError) {
  EXPECT_THAT(With("upper: [20, 20, 5.4, 5.4]", "upper: [20, .inf, 5.4, 5.4]"),
              StartsWith("5: domain.state.upper[1]: .inf is not a finite number; write a number in "));
  EXPECT_THAT(With("{vx: 0.1, vy", "{vx: NaN, vy"),
              StartsWith("9: declaration.lipschitz.vx.vx: NaN is not a finite number; write a number in [0, inf)"));
}

TEST_F(ErrorTest, ANumberOutsideItsRangeIsAnError) {
  EXPECT_EQ(With("{vx: 0.1, vy", "{vx: -0.1, vy"), "9: declaration.lipschitz.vx.vx: -0.1 is outside [0, inf)");
  EXPECT_EQ(With("dt: 0.15", "dt: 0"), "1: model.dt: 0 is outside (0, 60]");
  EXPECT_EQ(With("upper: [20, 20, 5.4, 5.4]", "upper: [20, -21, 5.4, 5.4]"),
            "5: domain.state.upper[1]: -21 is outside [-20, inf), below domain.state.lower[1]");
  EXPECT_EQ(With("half_width: [0.1, 0.1, 0.1, 0.1]", "half_width: [0.1, 0.1, 0.1, -0.1]"),
            "16: task.initial_set.half_width[3]: -0.1 is outside [0, inf)");
  EXPECT_EQ(With("radius: 0.8", "radius: -0.8"), "18: task.obstacles[0].circle.radius: -0.8 is outside [0, inf)");
  EXPECT_EQ(After("gate: {max_age_ms: 0}\n"), "20: gate.max_age_ms: 0 is outside (0, 3600000]");
  EXPECT_EQ(After("bus: {delay_ms: -1}\n"), "20: bus.delay_ms: -1 is outside [0, 3600000]");
  EXPECT_EQ(After("gate: {queue: 0}\n"), "20: gate.queue: 0 is outside [1, 65536]");
  EXPECT_EQ(After("certifier: {zonotope_order: 0}\n"), "20: certifier.zonotope_order: 0 is outside [1, 120]");
  EXPECT_EQ(After("certifier: {zonotope_order: 28}\n"),
            "20: certifier.zonotope_order: 28 is outside [1, 27] for 4 states");
  EXPECT_EQ(After("planner: {progress_steps: 100, tail_steps: 29}\n"),
            "20: planner.tail_steps: 29 is outside [0, 28]: with progress_steps 129 steps, a plan has at most 128");
}

TEST_F(ErrorTest, TheLargestOrderIsAccepted) { EXPECT_EQ(After("certifier: {zonotope_order: 26}\n"), ""); }

// Each says what was found and what to write.
TEST_F(ErrorTest, ANumberInAnotherNotationIsAnErrorThatSaysWhatToWrite) {
  const struct {
    const char *written, *error;
  } of_dt[] = {{"'0.15'", "\"0.15\" is quoted text, not a number; write 0.15 without quotes"},
               {"\"0.1\"", "\"0.1\" is quoted text, not a number; write 0.1 without quotes"},
               {"!!str 0.1", "\"0.1\" is tagged tag:yaml.org,2002:str, not a number; write 0.1 alone"},
               {"'fast'", "\"fast\" is quoted text, not a number; write a number in (0, 60], its unit is s"},
               {"fast", "fast is not a number; write a number in (0, 60], its unit is s"},
               {"yes", "yes is not a number; write a number in (0, 60], its unit is s"},
               {"true", "true is not a number; write a number in (0, 60], its unit is s"},
               {"", "has no value; write a number in (0, 60], its unit is s"},
               {"~", "has no value; write a number in (0, 60], its unit is s"},
               {"[0.15]", "a list is not a number; write a number in (0, 60], its unit is s"},
               {"{a: 1}", "a map is not a number; write a number in (0, 60], its unit is s"},
               {"0x10", "0x10 is not a number; write it in decimal"},
               {"0o17", "0o17 is not a number; write it in decimal"},
               {"0b11", "0b11 is not a number; write it in decimal"},
               {"010", "010 has a leading zero; write 10, or its decimal value if octal was meant"},
               {"00.5", "00.5 has a leading zero; write 0.5, or its decimal value if octal was meant"},
               {"0.15s", "0.15s is not a number; write 0.15 alone, its unit is s"},
               {"150 ms", "150 ms is not a number; write 150 alone, its unit is s"},
               {"1_000", "1_000 is not a number; write 1000"},
               {".nan", ".nan is not a finite number; write a number in (0, 60], its unit is s"},
               {"inf", "inf is not a finite number; write a number in (0, 60], its unit is s"},
               {"-.inf", "-.inf is not a finite number; write a number in (0, 60], its unit is s"},
               {"1e999", "1e999 is too large or too small to represent; write a number in (0, 60], its unit is s"},
               {"--1", "--1 is not a number; write a number in (0, 60], its unit is s"},
               {"1e5", "1e5 is outside (0, 60]"},
               {"-0.1", "-0.1 is outside (0, 60]"}};
  for (const auto& [written, error] : of_dt)
    EXPECT_EQ(With("dt: 0.15", std::string("dt: ") + written), std::string("1: model.dt: ") + error);
  for (const char* written : {".15", "+0.15", "15e-2", "1.", "5e-1", "0"})
    EXPECT_EQ(With("dt: 0.15", std::string("dt: ") + written).empty(), std::string(written) != "0") << written;
  const struct {
    const char *written, *error;
  } of_queue[] = {{"1.5", "1.5 is not an integer; write an integer in [1, 65536]"},
                  {"1e3", "1e3 is not an integer; write 1000"},
                  {"64.0", "64.0 is not an integer; write 64"},
                  {"yes", "yes is not an integer; write an integer in [1, 65536]"},
                  {"'64'", "\"64\" is quoted text, not an integer; write 64 without quotes"},
                  {"64k", "64k is not an integer; write 64 alone"},
                  {"0064", "0064 has a leading zero; write 64, or its decimal value if octal was meant"},
                  {"{a: 1}", "a map is not an integer; write an integer in [1, 65536]"},
                  {"99999999999999999999",
                   "99999999999999999999 is too large or too small to represent; write an "
                   "integer in [1, 65536]"}};
  for (const auto& [written, error] : of_queue)
    EXPECT_EQ(After(std::string("gate: {queue: ") + written + "}\n"), std::string("20: gate.queue: ") + error);
  EXPECT_EQ(With("    upper: [20, 20, 5.4, 5.4]", "    upper: [20, '20', 5.4, 5.4]"),
            "5: domain.state.upper[1]: \"20\" is quoted text, not a number; write 20 without quotes");
}

TEST_F(ErrorTest, YamlThatIsReadOtherwiseThanItLooksIsAnError) {
  EXPECT_EQ(With("dt: 0.15", "dt:0.15"), "1: model.dt:0.15: unknown key; write a space after the colon: dt: 0.15");
  EXPECT_THAT(With("  lipschitz:", "\tlipschitz:"), EndsWith("; line 8 is indented with a tab, write spaces"));
  EXPECT_EQ(After("robot:\n  time_limit_s: 0,5\n"),
            "21: robot.time_limit_s: 0,5 is not a number; write 0.5, with a point");
}

TEST_F(ErrorTest, AValueOfAnotherTypeIsAnError) {
  EXPECT_EQ(After("gate: 3\n"), "20: gate: 3 is not a map");
  EXPECT_EQ(With("center: [0, 0, 1, 0]", "center: [0, 0, fast, 0]"),
            "15: task.initial_set.center[2]: fast is not a number; write a number in (-inf, inf)");
  EXPECT_EQ(With("center: [0, 0, 1, 0]", "center: 1"), "15: task.initial_set.center: 1 is not a list of numbers");
}

TEST_F(ErrorTest, AnUnknownWordIsAnErrorThatSuggestsTheNearest) {
  EXPECT_EQ(With("point_mass", "pointmass"), "1: model.name: pointmass is not known; did you mean point_mass?");
  EXPECT_EQ(After("certifier: {method: magic}\n"),
            "20: certifier.method: magic is not known; known here: centred, paper");
  EXPECT_EQ(With("[px, py]", "[px, pz]"), "17: task.projection[1]: pz is not a coordinate; did you mean px?");
  EXPECT_EQ(With("[px, py]", "[px, ax]"), "17: task.projection[1]: ax is not a coordinate; did you mean px?");
  EXPECT_EQ(With("[px, py]", "[px, px]"), "17: task.projection[1]: duplicate name px");
  EXPECT_EQ(After("bus: {channels: {status: 'A.*'}}\n"),
            "20: bus.channels.status: A.* is not 1 to 63 letters, digits and underscores");
  EXPECT_EQ(After("bus: {channels: {status: PLAN_DECISION}}\n"),
            "20: bus.channels.status: PLAN_DECISION is the name of another channel too");
  EXPECT_EQ(After("logger: {rotate_mb: 20, quota_mb: 10}\n"),
            "20: logger.quota_mb: 10 is less than logger.rotate_mb, 20");
}

TEST_F(ErrorTest, AnImpossibleObstacleIsAnError) {
  const auto with = [&](const std::string& obstacle) {
    return With("{circle: {center: [3, 2], radius: 0.8}}", obstacle);
  };
  EXPECT_EQ(with("{}"),
            "18: task.obstacles[0]: has 0 keys of a shape, has to have one of circle, box, polygon, half_plane, grid");
  EXPECT_THAT(with("{half_plane: {normal: [0, 0], offset: 1}}"), StartsWith("18: task.obstacles[0].half_plane: "));
  EXPECT_EQ(with("{box: {lower: [1, 2], upper: [2, 1]}}"),
            "18: task.obstacles[0].box.upper[1]: 1 is outside [2, inf), below task.obstacles[0].box.lower[1]");
  EXPECT_EQ(with("{polygon: {vertices: [[0, 0], [1, 0]]}}"),
            "18: task.obstacles[0].polygon.vertices: has 2 entries, which is outside [3, 16]");
  std::string many = "{circle: {center: [3, 2], radius: 0.8}}";
  for (int i = 1; i < 4096; ++i) many += ", {circle: {center: [3, 2], radius: 0.8}}";
  EXPECT_EQ(with(many), "");
  many += ", {circle: {center: [3, 2], radius: 0.8}}";
  for (const std::string name : {"3rd", "oak 2", "\"a<b>\"", "oooooooooooooooooooooooooooooooo"})
    EXPECT_THAT(with("{name: " + name + ", circle: {center: [1, 1], radius: 1}}"),
                StartsWith("18: task.obstacles[0].name: "));
  EXPECT_EQ(with("{name: oak}"),
            "18: task.obstacles[0]: has 0 keys of a shape, has to have one of circle, box, polygon, half_plane, grid");
  EXPECT_EQ(with(many), "18: task.obstacles: has 4097 entries, which is outside [0, 4096]");
}

TEST_F(ErrorTest, AMapThatIsNoneIsAnError) {
  const auto with = [&](const std::string& rest, const std::string& rows = "#.\\n.?") {
    return With("{circle: {center: [3, 2], radius: 0.8}}",
                "{grid: {size: [2, 2], " + rest + ", rows: \"" + rows + "\"}}");
  };
  const std::string fine = "resolution: 0.5, origin: [0, 0]", at = "18: task.obstacles[0].grid";
  EXPECT_EQ(with(fine), "");
  EXPECT_EQ(with("resolution: 0, origin: [0, 0]"), at + ".resolution: 0 is outside (0, 1e+06]");
  EXPECT_EQ(with("resolution: .nan, origin: [0, 0]"),
            at + ".resolution: .nan is not a finite number; write a number in (0, 1e+06], its unit is m");
  EXPECT_THAT(with("resolution: 1, origin: [0, .inf]"), StartsWith(at + ".origin[1]: .inf is not"));
  EXPECT_EQ(with("resolution: 1, origin: [0]"), at + ".origin: has 1 entries, which is outside [2, 3]");
  EXPECT_EQ(with("resolution: 1, origin: [0, 0, 8]"), at + ": grid: yaw 8 is outside [-7, 7]");
  EXPECT_THAT(with(fine + ", unknown: maybe"), StartsWith(at + ".unknown: maybe is not known"));
  EXPECT_EQ(with(fine, "#.\\n#"), at + ".rows: line 2 of the rows has 1 cells, the first one has 2");
  EXPECT_THAT(with(fine, "#.\\n x"),
              StartsWith(at + ".rows: line 2 of the rows has byte 32 as cell 1, a cell is one of"));
  EXPECT_EQ(with(fine, ""), at + ".rows: is empty or not text");
  EXPECT_EQ(with(fine, "\\n"), at + ".rows: has 0 by 1 cells, size says 2 by 2; indent all rows as the first one");
  std::string many = "{grid: {size: [1, 1], " + fine + ", rows: x}}";
  many.replace(many.find(": x"), 3, ": \"#\"");
  std::string all = many;
  for (int i = 1; i < 9; ++i) all += ", " + many;
  EXPECT_EQ(With("{circle: {center: [3, 2], radius: 0.8}}", all),
            "18: task.obstacles[8]: is the 9th grid, at most 8 are taken");
}

// For YAML it is a comment: without its size, the map would be one without its lowest wall.
TEST_F(ErrorTest, AWallThatStandsTooFarLeftIsAnError) {
  const auto with = [&](const std::string& size, const std::string& last) {
    return With("[{circle: {center: [3, 2], radius: 0.8}}]", "\n    - grid:\n        resolution: 0.5\n" + size +
                                                                 "        origin: [0, 0]\n        unknown: free\n"
                                                                 "        rows: |\n          #..#\n" +
                                                                 last + "####\n");
  };
  const std::string size = "        size: [4, 2]\n";
  EXPECT_EQ(with(size, "          "), "");
  for (const std::string left : {"", "      ", "        "})
    EXPECT_THAT(with(size, left), HasSubstr("rows: has 4 by 1 cells, size says 4 by 2; indent")) << left.size();
  EXPECT_THAT(with("        size: [4, 1.5]\n", "          "), HasSubstr("has 4 by 2 cells, size says 4 by 1.5"));
  EXPECT_THAT(with("        size: [4]\n", "          "), HasSubstr("grid.size: has 1 entries"));
  EXPECT_THAT(with("", "          "), HasSubstr("grid.size: missing"));
}

TEST_F(ErrorTest, ATransitionOutsideTheDomainIsAnError) {
  const std::string good(kTransitions);
  EXPECT_EQ(files_.Error(kTask, good + "0,0,5.5,0,0,0,0,0,0,0\n"),
            "steps.csv:4: vx: 5.5 is outside [-5.4, 5.4] of domain.state");
  EXPECT_EQ(files_.Error(kTask, good + "0,0,5.4,0,0,-3.5,0,0,0,0\n"),
            "steps.csv:4: ay: -3.5 is outside [-3, 3] of domain.input");
  EXPECT_EQ(files_.Error(kTask, good + "0,0,5.4,0,0,-3,0,0,0,0\n"), "");
  const std::string ball =
      Replaced(kTask, "  input: {", "  balls: [{coordinates: [vx, vy], center: [0, 0], radius: 5}]\n  input: {");
  EXPECT_EQ(files_.Error(ball, good + "0,0,3,4,0,0,0,0,0,0\n"), "");
  EXPECT_EQ(files_.Error(ball, good + "0,0,6e-1,-5.1,0,0,0,0,0,0\n").substr(0, 31), "steps.csv:4: vx, vy: distance 5");
  EXPECT_THAT(files_.Error(ball, good + "0,0,3,5,0,0,0,0,0,0\n"), EndsWith(" is outside (-inf, 5] of domain.balls[0]"));
  const std::string inequality =
      Replaced(kTask, "  input: {", "  inequalities: [{coefficients: {vx: 1, ax: 2}, bound: 3}]\n  input: {");
  EXPECT_EQ(files_.Error(inequality, good + "0,0,2,0,1,0,0,0,0,0\n"),
            "steps.csv:4: vx, ax: sum 4 is outside (-inf, 3] of domain.inequalities[0]");
}

TEST_F(ErrorTest, TransitionsThatCannotBeReadAreAnError) {
  EXPECT_EQ(With("steps.csv", "none.csv"), "12: transitions: none.csv: cannot be read: No such file or directory");
  EXPECT_EQ(files_.Error(kTask, "px,py,vx,vy,ax,ay,px_next,py_next,vx_next,vy_next\n"),
            "steps.csv:2: no transitions; at least one is needed");
  EXPECT_EQ(
      files_.Error(kTask, "px,py,vx,vy,ax,ay,px_next,py_next,vx_next\n"),
      "steps.csv:1: vy_next: the column is missing; `forereach import` makes transitions of a log with other columns");
  EXPECT_EQ(files_.Error(kTask, std::string(kTransitions) + "0,0,0,0,0,0,0,0,nan,0\n"),
            "steps.csv:4: vx_next: 'nan' is not a finite number");
}

TEST_F(ErrorTest, AFileThatIsNoTaskIsAnError) {
  EXPECT_THAT(files_.Error("model: [\n"), StartsWith("2: not valid YAML; look at "));
  EXPECT_THAT(files_.Error("a: &x 1\nb: *y\n"), StartsWith("2: not valid YAML; look at "));
  EXPECT_EQ(files_.Error(""), "1: has no YAML document, has to have one");
  EXPECT_EQ(files_.Error(std::string(kTask) + "---\nmore: 1\n"), "1: has several YAML documents, has to have one");
  EXPECT_EQ(files_.Error("   ,"), "1: has several YAML documents, has to have one");
  EXPECT_EQ(files_.Error("just words\n"), "1: just words is not a map");
  EXPECT_EQ(files_.Error("? [a, b]\n: 1\n"), "1: a list is not a key");
  EXPECT_THAT(files_.Error(std::string(100000, '[')), HasSubstr("1: not valid YAML; look at "));
  EXPECT_THAT(files_.Error(std::string((1 << 24) + 1, ' ')), HasSubstr(" is larger than 16 MiB"));
}

TEST_F(ErrorTest, AMissingFileOrADirectoryIsAnError) {
  EXPECT_THAT([&] { (void)LoadConfig(files_.directory() / "none.yaml"); },
              ThrowsMessage<ConfigError>(files_.directory() / "none.yaml: cannot be read: No such file or directory"));
  EXPECT_THAT([&] { (void)LoadConfig(files_.directory() / ""); },
              ThrowsMessage<ConfigError>(HasSubstr("is a directory, not a file")));
}

}  // namespace forereach::error_test
