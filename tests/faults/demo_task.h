/** The task of tests/data/field.yaml for processes of a test. */
#pragma once

#include <fstream>
#include <sstream>
#include <string>

#include "tests/paths.h"

namespace forereach {

/** Its files named absolutely. @param more YAML that is added. */
inline std::string DemoTask(const std::string& more = "") {
  std::ostringstream text;
  text << std::ifstream(FOREREACH_SOURCE_DIR "/tests/data/field.yaml").rdbuf();
  std::string task = text.str();
  const std::string relative = "transitions: ../../config/data/";
  task.replace(task.find(relative), relative.size(), "transitions: " FOREREACH_SOURCE_DIR "/config/data/");
  return task + "\n" + more;
}

/** The same with this gate instead. @param gate YAML of the value of `gate`. */
inline std::string DemoTaskWithGate(const std::string& gate) {
  std::string task = DemoTask();
  const std::string demos = "{obstacles: task}";
  return task.replace(task.find(demos), demos.size(), gate);
}

/** The same with its obstacles taken out: they are on the bus only. @param clocks if not 0, obstacles may move: the
clocks differ by up to this, ms, and steps take the time of the model. */
inline std::string DemoTaskOnTheBus(int clocks = 0) {
  const std::string apart = clocks > 0 ? ", max_clock_error_ms: " + std::to_string(clocks) : "";
  std::string task = DemoTaskWithGate("{obstacles: bus, obstacles_lost_ms: 1500" + apart + "}");
  if (const std::string period = "step_period_ms: 50", error = "step_error_ms: any"; clocks > 0) {
    task.replace(task.find(period), period.size(), "step_period_ms: 100");
    task.replace(task.find(error), error.size(), "step_error_ms: 10");
  }
  const std::size_t begin = task.find("  obstacles:\n"), end = task.find("\n\n", begin);
  return task.replace(begin, end - begin, "  obstacles: []");
}

}  // namespace forereach
