#include "tests/faults/rig.h"

#include <algorithm>
#include <csignal>
#include <filesystem>

#include "certifier/task/process.h"
#include "forereach/command_t.hpp"
#include "logger/event_log.h"

namespace forereach {
namespace {

constexpr std::chrono::seconds kRecovers{20};
constexpr std::chrono::seconds kDriveAtMost{9};  // it is near its goal then

const std::array<std::string, Rig::kRoles> kPrograms{FOREREACH_LOGGER, FOREREACH_CERTIFIER, FOREREACH_PLANNER,
                                                     FOREREACH_ROBOT_SIM};

}  // namespace

Rig::Rig(const std::string& task, bool relayed)
    : relayed_(relayed), task_path_(scratch_.Write("task.yaml", task)), key_path_((scratch_.path() / "key").string()),
      directory_((scratch_.path() / "log").string()) {
  static int rigs = 0;
  const int port = 20'000 + (static_cast<int>(::getpid()) * 16 + 2 * rigs++) % 40'000;
  far_url_ = "udpm://239.255.76.67:" + std::to_string(port) + "?ttl=0";
  near_url_ = relayed ? "udpm://239.255.76.67:" + std::to_string(port + 1) + "?ttl=0" : far_url_;
  MakeKeyFile(key_path_);
  config_ = LoadConfig(task_path_);
  config_.bus.url = near_url_;
  config_.bus.key = key_path_;
  heard_ = OpenBus(near_url_);
  signed_ = OpenBus(config_.bus, "campaign");
  witness_ = std::make_unique<Witness>(*heard_, config_.bus, LoadKey(key_path_));
  for (const Role role : {kLogger, kCertifier, kPlanner, kRobot}) Start(role);
}

Rig::~Rig() {
  for (const Role role : {kRobot, kPlanner, kCertifier, kLogger})
    if (processes_[role]) static_cast<void>(processes_[role]->Terminate());
}

void Rig::Start(Role role) {
  std::vector<std::string> command{kPrograms[role], "--config", task_path_, "--lcm-url", url(role), "--key", key_path_};
  if (role == kLogger) command.insert(command.end(), {"--directory", directory_});
  if (role == kRobot) drive_began_ = std::chrono::steady_clock::now();
  processes_[role] = std::make_unique<ChildProcess>(command);
}

void Rig::Signal(Role role, int signal) {
  if (processes_[role]) processes_[role]->Signal(signal);
}

bool Rig::Reap(Role role) {
  if (!processes_[role]) return true;
  if (!processes_[role]->WaitForEnd(std::chrono::seconds(10))) return false;
  processes_[role].reset();
  return true;
}

bool Rig::IsAlive(Role role) const { return processes_[role] && !processes_[role]->WaitForEnd(std::chrono::milliseconds(0)); }

void Rig::Listen(std::chrono::milliseconds time) {
  static_cast<void>(ListenUntil([] { return false; }, time));
}

bool Rig::ListenUntil(const std::function<bool()>& done, std::chrono::milliseconds patience) {
  const auto end = std::chrono::steady_clock::now() + patience;
  while (!done()) {
    if (std::chrono::steady_clock::now() >= end) return false;
    heard_->Dispatch(5);
  }
  return true;
}

void Rig::Command(std::int16_t kind) {
  command_t command{};
  command.utime = WallClockUs();
  command.kind = kind;
  SetText(command.source, "campaign");
  signed_->Publish(config_.bus.command, command);
}

void Rig::DriveAnew() {
  Signal(kRobot, SIGTERM);
  static_cast<void>(Reap(kRobot));
  Signal(kPlanner, SIGTERM);  // it ends with the drive
  static_cast<void>(Reap(kPlanner));
  Start(kPlanner);
  Start(kRobot);
}

std::string Rig::Heal() {
  for (const Role role : {kLogger, kCertifier, kPlanner, kRobot})
    if (!IsAlive(role)) Start(role);
  if (std::chrono::steady_clock::now() - drive_began_ > kDriveAtMost) DriveAnew();
  witness_->Forget();
  const std::int64_t before = witness_->decisions();
  auto next_reset = std::chrono::steady_clock::now();
  const bool healed = ListenUntil(
      [&] {
        const auto& status = witness_->status();
        if (status && status->state == certifier_status_v2_t::FAULT && std::chrono::steady_clock::now() >= next_reset) {
          Command(command_t::RESET);
          next_reset = std::chrono::steady_clock::now() + std::chrono::milliseconds(200);
        }
        if (!IsAlive(kRobot) || !IsAlive(kPlanner)) DriveAnew();
        return status && status->level == certifier_status_v2_t::OK && witness_->decisions() > before &&
               witness_->logger_status() && witness_->logger_status()->state == logger_status_t::OK;
      },
      kRecovers);
  if (healed) return "";
  const auto& status = witness_->status();
  std::string why = status ? "certifier: " + GetText(status->message) : "no certifier is heard";
  why += witness_->logger_status() ? "; logger: " + GetText(witness_->logger_status()->message) : "; no logger is heard";
  for (const Role role : {kLogger, kCertifier, kPlanner, kRobot})
    if (!IsAlive(role)) why += std::string("; ") + kNames[role] + " ended";
  return why + "; decisions " + std::to_string(witness_->decisions() - before);
}

std::int64_t Rig::LostByLogger() const {
  if (!witness_->logger_status()) return 0;
  std::int64_t newest = 0;
  std::filesystem::path last;
  const auto written = [](const std::filesystem::path& path) { return std::filesystem::last_write_time(path); };
  for (const auto& entry : std::filesystem::directory_iterator(directory_))
    if (entry.path().extension() == ".lcmlog" && (last.empty() || written(entry.path()) > written(last)))
      last = entry.path();
  if (last.empty()) return witness_->logger_status()->events_written;
  EventLogReader reader(last.string());
  ForEachEvent(reader, [&](const LogEvent&) { ++newest; });
  return std::max<std::int64_t>(witness_->logger_status()->events_written - newest, 0);
}

}  // namespace forereach
