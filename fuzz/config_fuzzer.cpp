// Task files: any bytes are a task that the certifier can be made of, or refused with a ConfigError.
#include "fuzz/fuzz.h"
#include "fuzz/text_mutator.h"
#include "task/config.h"

bool forereach::Try(Bytes data) {
  static MemoryFile file;
  const std::string& path = file.Write(data);
  return IsTaken([&] {
    const Config config = LoadConfig(path, TransitionsFile::kIgnore);
    const auto n = static_cast<std::size_t>(config.problem->model->num_states());
    Require(config.grounds.config == DigestOf(data));
    Require(config.initial_set.dim() == static_cast<Eigen::Index>(n) && config.robot.start.size() == n &&
            config.planner.initial_half_width.size() == n);
    for (const Obstacle& obstacle : config.obstacles) Require(obstacle.dim() == config.problem->projection.rows());
  });
}
