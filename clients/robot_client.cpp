#include "clients/robot_client.h"

#include <stdexcept>
#include <utility>

#include "bus/log.h"
#include "certifier/gate/stamp.h"
#include "clients/opened_bus.h"
#include "clients/supervised.h"

namespace forereach {

struct RobotClient::Core {
  Core(OpenedBus open, Robot& its_robot)
      : opened(std::move(open)), robot(its_robot), supervisor(SupervisorOptionsOf(opened.config()), its_robot) {
    robot.bus_ = &opened;
    const BusOptions& channels = opened.config().bus;
    Bus& bus = opened.bus();
    bus.Subscribe(channels.certified, [this](const Received& r) { supervisor.OnCertified(r.raw, r.utime); });
    bus.Subscribe(channels.withdrawn, [this](const Received& r) { supervisor.OnWithdrawn(r.raw, r.utime); });
    bus.Subscribe(channels.fault, [this](const Received& r) { supervisor.OnFault(r.raw, r.utime); });
    bus.Subscribe(channels.command, [this](const Received& r) {
      if (const std::string why = supervisor.OnCommand(r.raw, r.utime); !why.empty())
        logging::Warn("{}: refused: {}", r.channel, why);
    });
  }

  const OpenedBus opened;
  Robot& robot;
  Supervisor supervisor;
};

void RobotClient::Robot::Send(const std::string& channel, Bytes message) {
  if (!bus_) throw std::logic_error("a RobotClient::Robot without its RobotClient");
  bus_->Send(channel, message);
}

RobotClient::RobotClient(const ClientOptions& options, Robot& robot)
    : core_(std::make_unique<Core>(OpenedBus(options, Role::kRobot), robot)) {}

RobotClient::RobotClient(const Config& task, const ClientOptions& instead, Robot& robot,
                         const std::function<void(const std::function<void()>&)>& around)
    : core_(std::make_unique<Core>(OpenedBus(task, Role::kRobot, instead, around), robot)) {}

// The robot may outlive its client, and then has no bus to send over.
RobotClient::~RobotClient() { core_->robot.bus_ = nullptr; }

const Problem& RobotClient::problem() const { return *core_->opened.config().problem; }
std::int64_t RobotClient::step_us() const { return Microseconds(core_->opened.config().robot.step_period_ms); }
bool RobotClient::is_signed() const { return core_->opened.config().bus.keys.has_value(); }

void RobotClient::Listen(std::int64_t until_utime, const std::function<bool()>& done) {
  core_->opened.Listen(until_utime, done);
}

std::span<const double> RobotClient::Boundary(std::int64_t utime, bool ends) {
  return supervisor().Boundary(utime, WallClockUs(), ends);
}

void RobotClient::ReloadTask() { Expect(LoadConfig(core_->opened.config().path)); }

void RobotClient::Expect(const Config& task) { ExpectTask(task, supervisor()); }

Supervisor& RobotClient::supervisor() {
  static_cast<void>(core_->opened.bus());  // of this thread
  return core_->supervisor;
}

}  // namespace forereach
