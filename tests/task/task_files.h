/** Task files to try: a good one, and the same with one thing changed. */
#pragma once

#include "task/config.h"
#include "tests/library_texts.h"

namespace forereach {

inline constexpr const char* kTransitions =
    "px,py,vx,vy,ax,ay,px_next,py_next,vx_next,vy_next\n"
    "0,0,1,0,0.5,0,0.155,0,1.07,0\n"
    "1,2,2,0.5,0,-0.5,1.3,2.07,2,0.42\n";

// Only what certifying requires. Errors are asserted by line, so keep one key a line.
inline constexpr const char* kTask =
    "model: {name: point_mass, dt: 0.15}\n"                     // 1
    "domain:\n"                                                 // 2
    "  state:\n"                                                // 3
    "    lower: [-20, -20, -5.4, -5.4]\n"                       // 4
    "    upper: [20, 20, 5.4, 5.4]\n"                           // 5
    "  input: {lower: [-3, -3], upper: [3, 3]}\n"               // 6
    "declaration:\n"                                            // 7
    "  lipschitz:\n"                                            // 8
    "    vx: {vx: 0.1, vy: 0.05}\n"                             // 9
    "    vy: {vx: 0.05, vy: 0.1}\n"                             // 10
    "  noise_bound: [0, 0, 0.01, 0.01]\n"                       // 11
    "transitions: steps.csv\n"                                  // 12
    "task:\n"                                                   // 13
    "  initial_set:\n"                                          // 14
    "    center: [0, 0, 1, 0]\n"                                // 15
    "    half_width: [0.1, 0.1, 0.1, 0.1]\n"                    // 16
    "  projection: [px, py]\n"                                  // 17
    "  obstacles: [{circle: {center: [3, 2], radius: 0.8}}]\n"  // 18
    "  between: samples\n";                                     // 19

/** A task for the line or lines of a model, with the box [-1, 1] for a domain. */
inline std::string TaskFor(const std::string& model, std::size_t states, std::size_t inputs,
                           const std::string& projection) {
  const auto list = [](std::size_t count, const std::string& entry) {
    std::string text;
    for (std::size_t i = 0; i < count; ++i) text += (i == 0 ? "[" : ", ") + entry;
    return text + "]";
  };
  return model + "domain:\n  state: {lower: " + list(states, "-1") + ", upper: " + list(states, "1") +
         "}\n  input: {lower: " + list(inputs, "-1") + ", upper: " + list(inputs, "1") +
         "}\ndeclaration: {lipschitz: {}, noise_bound: " + list(states, "0") +
         "}\ntransitions: steps.csv\ntask:\n  initial_set: {center: " + list(states, "0") +
         ", half_width: " + list(states, "0") + "}\n  projection: [" + projection +
         "]\n  obstacles: []\n  between: samples\n";
}

/** Writes task and transitions into a scratch directory and loads them. */
class TaskFiles {
 public:
  Config Load(const std::string& task = kTask, const std::string& transitions = kTransitions) const {
    directory_.Write("steps.csv", transitions);
    return LoadConfig(directory_.Write("task.yaml", task));
  }
  /** What LoadConfig says, without "task.yaml:" if it is of that file; empty if it accepts the file. */
  std::string Error(const std::string& task, const std::string& transitions = kTransitions) const {
    std::string error = directory_.Cut(Thrown<ConfigError>([&] { (void)Load(task, transitions); }));
    ExpectNoTextOfALibrary(error);
    EXPECT_THAT(error, Not(ContainsRegex("^[0-9 ]"))) << "it names a file";
    return error.starts_with("task.yaml:") ? error.substr(10) : error;
  }
  /** The error of the good task file with `to` in the place of `from`. */
  std::string ErrorWith(const std::string& from, const std::string& to) const {
    return Error(Replaced(kTask, from, to));
  }
  const ScratchDirectory& directory() const { return directory_; }

 private:
  ScratchDirectory directory_;
};

}  // namespace forereach
