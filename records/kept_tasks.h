/** The tasks of a directory's logs: task files and the files that they name, found by digest.

    tasks/<config digest>/task.yaml                             the task file's bytes
    tasks/<config digest>/transitions-<observations digest>.csv the transitions that it names
    tasks/<config digest>/policy-<digest>                       the policy that it names, if it does

All digests in hexadecimal. A task that was recorded with several versions of its transitions has one file for each.
Names are made of digests alone, so that nothing in a log leads out of the directory, and what is read is held against
its digest. Keys are not kept. */
#pragma once

#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "certifier/task/config.h"

namespace forereach {

/** The bytes of a task's files. */
struct TaskCopy {
  Digest digest{}, observations_digest{};
  std::shared_ptr<const NominalModel> model;
  std::string task, transitions, policy;  ///< `policy` is empty if the task names none.
};

/** Reads the files of a task that was loaded before once more. @throws ConfigError if they cannot be read, or the task
file has changed since. */
[[nodiscard]] TaskCopy CopyTask(const Config& config);

class KeptTasks final {
 public:
  /** @param log_directory where the logs are; it is made when something is kept. */
  explicit KeptTasks(const std::string& log_directory);

  /** Keeps a task, if it is not kept already; each file appears whole or not at all, and is on the disk on return.
  @throws BadInput if it cannot be written, or transitions and digest do not agree. */
  void Keep(const TaskCopy& copy) const;

  /** Where the task of this config digest is, or would be. */
  [[nodiscard]] std::string PathOf(const Digest& digest) const;

  /** The task of this config digest, if it is kept. Of several versions of its transitions it is the one whose digest
  is among `observations`. @throws ConfigError if what is kept is damaged, or cannot be told which version it was. */
  [[nodiscard]] std::optional<Config> Find(const Digest& digest, const std::set<Digest>& observations) const;

  /** What is damaged of the kept task of this config digest, in hexadecimal, one sentence for each version of its
  transitions; nothing if it is whole or is not kept. */
  [[nodiscard]] std::vector<std::string> FindDamage(const std::string& digest) const;

  /** Deletes the task of this config digest, in hexadecimal; anything else is ignored. */
  void Remove(const std::string& digest) const;

 private:
  /** @param digest, version in hexadecimal, of the task file and of its transitions. @throws ConfigError. */
  [[nodiscard]] Config Load(const std::string& digest, const std::string& version) const;

  std::string path_;
};

}  // namespace forereach
