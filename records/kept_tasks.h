/** The tasks of a directory's logs: copies of task files and of the files that they name, stored by digest.

    tasks/<config digest>/task.yaml                             the task file's bytes
    tasks/<config digest>/model.yaml                            those of the model file that it includes, if it does
    tasks/<config digest>/transitions-<observations digest>.csv the transitions that it names
    tasks/<config digest>/policy-<digest>                       the policy that it names, if it does

All digests are in hexadecimal. A task with several versions of its transitions has one file for each. Names consist of
digests only, so no log can name a file outside the directory. What is read is compared with its digest. Keys are not
kept. */
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "task/config.h"

namespace forereach {

/** The bytes of a task's files. */
struct TaskCopy {
  Digest digest{}, observations_digest{};
  std::shared_ptr<const NominalModel> model;
  std::string task, transitions, policy, model_file;  ///< The last two are empty if the task names none.
};

/** Reads the files of a loaded task again. @throws ConfigError if they cannot be read, or the task file has changed. */
[[nodiscard]] TaskCopy CopyTask(const Config& config);

class KeptTasks final {
 public:
  /** @param log_directory the directory of the logs. Keep creates it if necessary. */
  explicit KeptTasks(const std::string& log_directory);
  /** Those of a log's directory. */
  [[nodiscard]] static KeptTasks Beside(const std::string& log);

  /** Keeps a task unless it is kept already. Each file appears whole or not at all, and is on the disk on return.
  @throws BadInput if it cannot be written, or transitions and digest do not agree. */
  void Keep(const TaskCopy& copy) const;

  /** The path of the task with this config digest, kept or not. */
  [[nodiscard]] std::string PathOf(const Digest& digest) const;

  /** The task with this config digest, if it is kept. Of several versions of its transitions it takes the one whose
  digest is among `observations()`, which is called only then.
  @throws ConfigError if a file is damaged, or the version is ambiguous. */
  [[nodiscard]] std::optional<Config> Find(const Digest& digest,
                                           const std::function<std::set<Digest>()>& observations) const;

  /** Whether a directory of tasks is there. */
  [[nodiscard]] bool HasAny() const;

  /** The damage of the kept task with this config digest (in hexadecimal), a sentence for each version of its
  transitions. Empty if the task is intact or not kept. */
  [[nodiscard]] std::vector<std::string> FindDamage(const std::string& digest) const;

  /** Deletes the task with this config digest (in hexadecimal). Ignores any other text. */
  void Remove(const std::string& digest) const;

 private:
  /** @param digest, version in hexadecimal, of the task file and of its transitions. @throws ConfigError. */
  [[nodiscard]] Config Load(const std::string& digest, const std::string& version) const;

  std::string path_;
};

}  // namespace forereach
