/** `forereach declare --from-data`. */
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace forereach {

struct DataCommand {
  std::string config;
  std::vector<std::string> by;  ///< "v,omega" for every state, or "theta=v,omega" for one.
  double factor = 1.5;
  bool estimate_noise = false, json = false;
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

}  // namespace forereach
