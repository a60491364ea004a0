/** A task in which a plan is certified in pieces of X_0 alone: config/bicycle.yaml with a circle that the tube from all
of X_0 just may touch. */
#pragma once

#include "certifier/gate/candidate_message.h"
#include "forereach/numerics/text.h"
#include "forereach/sets/zonotope.h"
#include "task/config.h"
#include "tests/gap.h"
#include "tests/paths.h"
#include "tests/scratch.h"

namespace forereach {

/** The task, from a file in the directory: `name`.yaml. @param gate the keys of `gate` beside obstacles. */
inline Config GapTask(const ScratchDirectory& directory, const std::string& gate = ", max_pieces: 16",
                      const std::string& name = "gap") {
  const std::string folder = FOREREACH_SOURCE_DIR "/config/";
  const std::string text =
      Replaced(Read(folder + "bicycle.yaml"), "transitions: data", "transitions: " + folder + "data");
  const Config config = LoadConfig(folder + "bicycle.yaml");
  const Eigen::MatrixXd controls = Eigen::Vector2d(0.2, 0.02).replicate(1, 12);
  const Obstacle circle =
      JustTouched(Certifier(config.problem), {controls.data(), 2, 12, 2}, Zonotope::Enclose(config.initial_set));
  const Eigen::VectorXd at = circle.points()[0];
  return LoadConfig(directory.Write(
      name + ".yaml", Replaced(Replaced(text, "gate: {obstacles: task", "gate: {obstacles: task" + gate), "[11.4, 7.4]",
                               "[" + ToText(at[0]) + ", " + ToText(at[1]) + "]")));
}

/** A plan from the task's X_0, sent now, to start in half a second. */
inline candidate_plan_t GapCandidate(const Config& task, std::int64_t plan_id, std::int64_t now_us) {
  candidate_plan_t candidate{.utime = now_us, .plan_id = plan_id, .start_utime = now_us + 500'000, .step_us = 100'000};
  SetText(candidate.source, "test");
  const Eigen::VectorXd &lower = task.initial_set.lower(), &upper = task.initial_set.upper();
  SetPlan(candidate, (lower + upper) / 2, (upper - lower) / 2, Eigen::Vector2d(0.2, 0.02).replicate(1, 12));
  return candidate;
}

}  // namespace forereach
