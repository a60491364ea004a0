/** The task of tests/data/field.yaml for processes of a test, with a robot whose sensors err by a thirtieth of X0. */
#pragma once

#include <string>

#include "tests/paths.h"
#include "tests/scratch.h"

namespace forereach {

/** Its files named absolutely. @param more YAML that is added. */
inline std::string DemoTask(const std::string& more = "") {
  std::string task = Replaced(Read(FOREREACH_SOURCE_DIR "/tests/data/field.yaml"), "../../config/data/",
                              FOREREACH_SOURCE_DIR "/config/data/");
  task = Replaced(task, "state_error: {}  # measured exactly",
                  "state_error: {x: 0.0015, y: 0.0015, theta: 0.0003, v: 0.0009}\n  transitions_are: exact");
  task = Replaced(task, "initial_half_width: [0.05, 0.05, 0.01, 0.03, 0.01, 0.002]",
                  "initial_half_width: [0.055, 0.055, 0.011, 0.033, 0.01, 0.002]");
  return Replaced(task, "step_error_ms: any", "step_error_ms: any\n  sensor_error: adversarial") + "\n" + more;
}

/** The same with this gate instead. @param gate YAML of the value of `gate`. */
inline std::string DemoTaskWithGate(const std::string& gate) { return Replaced(DemoTask(), "{obstacles: task}", gate); }

/** The same with its obstacles taken out: they are on the bus only. @param clocks if not 0, obstacles may move: the
clocks differ by up to this, ms, and steps take the time of the model, give or take 5 ms beside what the computer takes.
*/
inline std::string DemoTaskOnTheBus(int clocks = 0) {
  const std::string apart = clocks > 0 ? ", max_clock_error_ms: " + std::to_string(clocks) : "";
  std::string task = DemoTaskWithGate("{obstacles: bus, obstacles_lost_ms: 1500" + apart + "}");
  if (clocks > 0)
    task = Replaced(Replaced(task, "step_period_ms: 50", "step_period_ms: 100"), "step_error_ms: any",
                    "step_error_ms: 10\n  step_jitter: random");
  const std::size_t begin = task.find("  obstacles:\n"), end = task.find("\n\n", begin);
  return task.replace(begin, end - begin, "  obstacles: []");
}

}  // namespace forereach
