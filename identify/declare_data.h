/** `forereach declare --from-data`. */
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "task/config.h"

namespace forereach {

struct DataCommand {
  std::string config;
  std::vector<std::string> by;  ///< "v,omega" for every state, or "theta=v,omega" for one.
  double factor = 1.5;
  bool estimate_noise = false, estimate_disturbance = true, json = false;
  int regions = 1;  ///< More: cells with a disturbance of their own, at most so many.
  // --hold-out
  bool hold_out = false;
  int blocks = 20, steps = 10;
  double confidence = 0.95;
  std::string picture;
  unsigned jobs = 1;
};

/** Prints a declaration proposed from the task's transitions, what it rests on, and what is not proven.
@return the exit status: 0, or 1 if no slopes are consistent with the transitions. @throws ConfigError. */
[[nodiscard]] int DeclareFromData(const DataCommand& command);

/** Prints how often held-out transitions contradict what the others propose, for several factors, against how many of
the held-out commands are certified. @return the exit status, as above. @throws ConfigError, PictureError. */
[[nodiscard]] int DeclareHoldOut(const DataCommand& command);

/** What recorded steps say of a declaration: half of the blocks of time are observations, and recorded commands of the
others are plans, as for --hold-out. */
struct HeldOutSteps {
  int stretches = 0, steps = 0;  ///< Plans, and their length.
  int slices = 0,
      outside = 0;  ///< Slices that recorded states can be compared with, and those that do not hold theirs.
};

/** The stretches are as long as possible up to 10 steps, and at most 200, evenly chosen. No slices if the declaration
is contradicted or there are fewer than two transitions. Cost: that of so many certificates. */
[[nodiscard]] HeldOutSteps JudgeByHeldOut(const Config& config, const Declaration& declaration, unsigned jobs);

/** What is wrong with a declaration of which recorded steps lie outside their slices; empty if none do. */
[[nodiscard]] std::string WarningOf(const HeldOutSteps& found);

/** The same for the declaration of a task file; also empty if the task or its transitions cannot be read. */
[[nodiscard]] std::string WarningOfTask(const std::string& config);

}  // namespace forereach
