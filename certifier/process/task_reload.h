/** Reads the task file again while the certifier runs, and says whether what was read can take the place of the task in
force.

A task is taken whole or not at all. It is refused if the file cannot be read, if it changes what cannot change while
the certifier runs (keys, bus, channels, realtime options, source of obstacles, latch directory, sizes of the model), or
if its declaration is known to be contradicted. The file is read in a thread of its own (bus/reloading.h). */
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "bus/reloading.h"
#include "certifier/gate/gate.h"
#include "certifier/process/contradictions.h"
#include "task/config.h"

namespace forereach {

class TaskReload final {
 public:
  /** A reload that has ended. */
  struct Loaded {
    Config config;
    std::unique_ptr<Gate> gate;
    std::string error;  ///< Why it is not taken; if empty, `config` and its gate are there.
  };

  /** @param channels the bus's options in force, with the keys in them. */
  TaskReload(const std::string& path, const BusOptions& channels);

  /** Reads the file, or reads it once more after the reload under way. False, and counted as failed, if earlier reloads
  are stalled; the file is read once one of them has ended. */
  bool Ask();

  /** The reload that has ended since the last call, once; nothing if none has. Logs whether it is taken. One that is
  stalled counts as failed once, and may end later. Does not wait.
  @param in_force the task whose place it takes. */
  [[nodiscard]] std::optional<Loaded> Take(const Config& in_force, const Contradictions& contradictions);

  /** 1, and one more for each task that was taken. */
  [[nodiscard]] std::int64_t version() const { return version_; }
  [[nodiscard]] std::int64_t failed() const { return failed_; }
  /** Why the last reload failed; empty if none has since a task was taken. */
  [[nodiscard]] const std::string& error() const { return error_; }

 private:
  [[nodiscard]] std::string WhyNotTaken(const Config& config, const Config& in_force,
                                        const Contradictions& contradictions) const;
  Loaded Fail(const std::string& why);

  const BusOptions channels_;
  Reloading<Loaded> reload_;
  std::int64_t version_ = 1, failed_ = 0;
  std::string error_;
};

}  // namespace forereach
