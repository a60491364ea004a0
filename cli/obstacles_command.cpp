#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bus/bus_options.h"
#include "bus/log.h"
#include "bus/process.h"
#include "certifier/gate/obstacle_sender.h"
#include "certifier/gate/stamp.h"
#include "cli/commands.h"
#include "lcmtypes/why_failed.h"
#include "task/config.h"

namespace forereach {
namespace {

constexpr double kMaxPeriodMs = 3.6e6;

struct ObstaclesArguments {
  std::string config;
  BusArguments bus;
  std::optional<double> period_ms;
};

// Replaces perception: it sends the obstacles of a task file. Their motions begin when it starts, and it sees none
// before its first window begins.
class ObstaclesNode final : public Node {
 public:
  ObstaclesNode(const Config& config, Bus& bus, std::int64_t period_us)
      : path_(config.path), channels_(config.bus), bus_(bus), obstacles_(config.obstacles), sender_(period_us) {}

  void Tick(std::int64_t now_us) override {
    if (!begin_us_) begin_us_ = now_us;
    if (obstacles_) sender_.Set(*begin_us_, *std::exchange(obstacles_, std::nullopt));
    if (const auto message = sender_.Due(now_us); message && !bus_.Publish(channels_.obstacles, *message) && !warned_) {
      warned_ = true;
      logging::Warn("the bus refused a message; receivers see a gap");
    }
  }

  void Reload() override try {
    const Config config = LoadConfig(path_, TransitionsFile::kIgnore);
    const std::string why = WhyKeyCannotChange(channels_, config.bus, Role::kPerception);
    if (!why.empty()) throw ConfigError("{}: {}", path_, why);
    RequireSendable(config);
    obstacles_ = config.obstacles;
    logging::Info("the obstacles of {} from now on", path_);
  } catch (const std::exception& error) {
    logging::Error("not reloaded, the obstacles of before are sent: {}", WhyFailed(error));
  }

 private:
  const std::string path_;
  const BusOptions channels_;
  Bus& bus_;
  std::optional<std::vector<Obstacle>> obstacles_;  // of the file, if it was read since the last tick
  ObstaclesOfFile sender_;
  std::optional<std::int64_t> begin_us_;  // of their motions
  bool warned_ = false;
};

int Send(const ObstaclesArguments& options) {
  Config config = LoadConfig(options.config, TransitionsFile::kIgnore);
  RequireSendable(config);
  options.bus.Override(config.bus);
  config.bus = WithKeys(std::move(config.bus), Role::kPerception);
  if (!config.bus.keys) logging::Warn(kUnsignedWarning);
  const std::unique_ptr<Bus> bus = OpenBus(config.bus, Role::kPerception);
  const std::int64_t period_us =
      options.period_ms ? Microseconds(*options.period_ms) : ObstacleSender::PeriodUs(config.gate);
  if (3 * period_us > Microseconds(config.gate.obstacles_timeout_ms))
    logging::Warn(
        "every {} ms is less often than three times in gate.obstacles_timeout_ms: one lost message stops the robot",
        static_cast<double>(period_us) / 1e3);
  ObstaclesNode node(config, *bus, period_us);
  logging::Info("{} obstacles of {} on {} every {} ms", config.obstacles.size(), config.path, config.bus.url,
                static_cast<double>(period_us) / 1e3);
  RunNode(node, *bus);
  return 0;
}

}  // namespace

Command ObstaclesCommand() {
  const auto options = std::make_shared<ObstaclesArguments>();
  Command command{
      .name = "obstacles",
      .purpose =
          "Send a task file's obstacles on the bus repeatedly until SIGTERM, in place of perception. Their motions "
          "begin when it starts, and none is sent before its motion.from. SIGHUP reads the file again",
      .footer =
          "Example:\n  forereach obstacles --config my_robot.yaml --key robot.key\n\nWith gate.obstacles: bus, a "
          "certifier certifies nothing before it receives obstacles, and nothing after they stop.",
      .options = {ConfigOption(options->config, "Task file (YAML) with the obstacles and the bus"),
                  {"--period-ms", &options->period_ms, "MS",
                   "Time from one message to the next; by default a quarter of gate.obstacles_timeout_ms",
                   NumberRange{1, kMaxPeriodMs}}},
      .run = [options] { return Send(*options); }};
  options->bus.AddTo(command.options);
  return command;
}

}  // namespace forereach
