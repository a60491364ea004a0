// Records tests/data/course.lcmlog: tests/data/course.yaml driven in simulated time, from the same time on each time.
#include <filesystem>
#include <iostream>

#include "logger/logger_node.h"
#include "simulator/lockstep.h"
#include "tests/records/course.h"
#include "tests/scratch.h"

int main() {
  using namespace forereach;
  constexpr std::int64_t kBegins = 1'800'000'000'000'000;
  const ScratchDirectory scratch;
  Config config = LoadConfig(kCourseTask);
  config.logger.directory = scratch / "log";
  Config world = config;  // what the file does not know comes by the bus
  world.obstacles = {Obstacle::Circle(Eigen::Vector2d(100, 1), 2.5)};
  Lockstep lockstep(config, world, kBegins);
  LoggerNode logger(lockstep.config(), lockstep.bus(), std::cout);
  lockstep.Run(&logger);
  const std::string log = logger.recorder().log_path();
  lockstep.Stop();
  logger.Stop();
  std::filesystem::copy_file(log, kCourseLog, std::filesystem::copy_options::overwrite_existing);
}
