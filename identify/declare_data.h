/** `forereach declare --from-data`. */
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "task/config.h"

namespace forereach {

struct DataCommand {
  std::string config;
  std::vector<std::string> by;  ///< "v,omega" for every state, or "theta=v,omega" for one.
  double factor = 1.5;
  bool estimate_noise = false, estimate_disturbance = true, json = false;
  int regions = 1;      ///< More: cells with a disturbance of their own, at most so many.
  std::string picture;  ///< Of the slopes against the error; of --hold-out the trade-off.
  // --hold-out
  bool hold_out = false;
  int blocks = 20, steps = 10;
  double confidence = 0.95;
  unsigned jobs = 1;
};

/** Prints a declaration proposed from the task's transitions, what it rests on, and what is not proven.
@return the exit status: 0, or 1 if no slopes are consistent with the transitions. @throws ConfigError, PictureError. */
[[nodiscard]] int DeclareFromData(const DataCommand& command);

/** Prints how often held-out transitions contradict what the others propose, for several factors, against how many of
the held-out commands are certified. @return the exit status, as above. @throws ConfigError, PictureError. */
[[nodiscard]] int DeclareHoldOut(const DataCommand& command);

/** What recorded steps say of a declaration: half of the blocks of time are observations, and recorded commands of the
others are plans, as for --hold-out. */
struct HeldOutSteps {
  int stretches = 0, steps = 0;  ///< Plans, and their length.
  /** Slices that recorded states can be compared with: those that contain all, a part or nothing of the states that
  the record allows (lcmtypes/angle.h, Conformance). */
  int inside = 0, consistent = 0, left = 0;
  /** Of a position after `steps` steps, the median over the stretches; infinite if half of the tubes or more end
  before. */
  double half_width = 0;

  [[nodiscard]] int slices() const { return inside + consistent + left; }
};

/** "of 40 recorded steps, 38 inside their slices, 2 consistent, 0 left". */
[[nodiscard]] std::string TextOf(const HeldOutSteps& found);
[[nodiscard]] nlohmann::json ToJson(const HeldOutSteps& found);

/** The stretches are as long as possible up to 10 steps, and at most 200, evenly chosen. No slices if the declaration
is contradicted or there are fewer than two transitions. Cost: that of so many certificates. */
[[nodiscard]] HeldOutSteps JudgeByHeldOut(const Config& config, const Declaration& declaration, unsigned jobs);

/** The same for the declaration of a task file; no slices if the task or its transitions cannot be read. */
[[nodiscard]] HeldOutSteps JudgeTask(const std::string& config);

/** What is wrong with a declaration of which recorded steps have left their slices; empty if none have. */
[[nodiscard]] std::string WarningOf(const HeldOutSteps& found);

}  // namespace forereach
