#include "tests/faults/rig.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <iterator>
#include <limits>
#include <stdexcept>
#include <utility>

#include "bus/authentic_bus.h"
#include "bus/process.h"
#include "forereach/command_t.hpp"
#include "records/check.h"
#include "records/event_log.h"
#include "tests/keys.h"

namespace forereach {
namespace {

constexpr std::chrono::seconds kRecovers{20};
constexpr std::chrono::milliseconds kLastWords{50};  // what a process sent before it ended has been heard then
constexpr std::chrono::seconds kDriveAtMost{6};      // at the next Heal; it takes ten, and a try and a Heal two each
constexpr std::chrono::seconds kSilent{5};           // a robot whose clock went back waits until it is where it was
constexpr std::size_t kTailBytes = 1000;
constexpr std::int64_t kEndOfTime = std::numeric_limits<std::int64_t>::max();

const std::array<std::string, Rig::kRoles> kPrograms{FOREREACH_LOGGER, FOREREACH_CERTIFIER, FOREREACH_PLANNER,
                                                     FOREREACH_ROBOT_SIM};

// A receiver's clock for which nothing is old or ahead: it starts at 0, and then it is the end of time.
struct AnyTime {
  std::int64_t operator()() { return std::exchange(is_start, false) ? 0 : kEndOfTime; }
  bool is_start = true;
};

std::string LastLine(std::string text) {
  while (!text.empty() && text.back() == '\n') text.pop_back();
  return text.substr(text.rfind('\n') + 1);
}

std::set<std::string> LogsIn(const std::string& directory) {
  std::set<std::string> logs;
  std::error_code none_yet;
  for (const auto& entry : std::filesystem::directory_iterator(directory, none_yet))
    if (entry.path().extension() == ".lcmlog") logs.insert(entry.path().string());
  return logs;
}

std::int64_t EventsIn(const std::set<std::string>& logs) {
  std::int64_t events = 0;
  std::vector<std::string> there;
  std::ranges::copy_if(logs, std::back_inserter(there),
                       [](const std::string& log) { return std::filesystem::exists(log); });
  ForEachEvent(there, [&events](const LogEvent&, const std::string&) { ++events; });
  return events;
}

std::string Tail(const std::string& text) {
  return text.size() <= kTailBytes ? text : text.substr(text.size() - kTailBytes);
}

}  // namespace

Rig::Rig(const std::string& task, const Options& options)
    : options_(options),
      task_(task + "bus: {name: campaign}\n"),
      task_path_(scratch_.Write("task.yaml", task_)),
      key_path_(MakeTestKeys(scratch_ / "keys", "campaign")),
      next_directory_(scratch_ / "log"),
      state_(scratch_ / "state") {
  static int rigs = 0;
  // Below the ports that the kernel hands out by itself, above those of PrivateBusUrl.
  const int port = 20'000 + (static_cast<int>(::getpid()) * 16 + 2 * rigs++) % 12'000;
  far_url_ = "udpm://239.255.76.67:" + std::to_string(port) + "?ttl=0";
  near_url_ = options_.relayed ? "udpm://239.255.76.67:" + std::to_string(port + 1) + "?ttl=0" : far_url_;
  config_ = LoadConfig(task_path_);
  config_.bus.url = near_url_;
  config_.bus.key = key_path_;
  OpenBuses();
  for (const Role role : {kLogger, kCertifier, kPlanner, kRobot}) Start(role);
}

void Rig::OpenBuses() {
  open_ = OpenBus(near_url_);
  signed_ = OpenBusOfAllRoles(config_.bus, [this] { return NowUs(); });
  // Where clocks go back and ahead it hears whatever is authentic, from whatever time.
  heard_ = OpenSignedBus(near_url_, LoadPublicKeys(key_path_), config_.bus.bus_name(), config_.bus.speakers(),
                         options_.settable_clocks ? Clock(AnyTime{}) : Clock(WallClockUs));
  witness_ = std::make_unique<Witness>(*heard_, config_.bus, options_.relayed);
  if (config_.gate.obstacles == ObstaclesSource::kBus)
    perception_ = std::make_unique<Perception>(OpenBusOfAllRoles(config_.bus, [this] { return NowUs(); }),
                                               config_.bus.obstacles, config_.gate, options_.seen);
}

void Rig::MakeKeyAgain(forereach::Role role) {
  EndAll();
  ReplaceKey("campaign", key_path_, role);
  has_one_key_ring_ = false;
  OpenBuses();
}

void Rig::StartSecondCertifier() {
  second_ = std::make_unique<ChildProcess>(std::vector<std::string>{FOREREACH_CERTIFIER, "--config", task_path_,
                                                                    "--lcm-url", url(kCertifier), "--key", key_path_,
                                                                    "--state", state_ + " of the second"});
}

void Rig::EndSecondCertifier() {
  if (!second_) return;
  if (!SecondCertifierIsAlive())
    bad_endings_.push_back("the second certifier ended by itself: " + Tail(second_->error()));
  second_.reset();
}

void Rig::Start(Role role) {
  LookAtEnd(role);
  std::vector<std::string> command;
  if (options_.settable_clocks) command = UnderClock(role);
  command.insert(command.end(), {kPrograms[role], "--config", task_path_, "--lcm-url", url(role), "--key", key_path_});
  if (role == kLogger) {
    if (!records_.empty()) {
      LookAtLogs();
      records_.back().due = std::max(records_.back().due, EventsIn(records_.back().logs));
    }
    directory_ = next_directory_;
    directories_.insert(directory_);
    earlier_logs_ = LogsIn(directory_);
    records_.emplace_back();
    command.insert(command.end(), {"--directory", directory_});
  }
  if (role == kCertifier) command.insert(command.end(), {"--state", state_});
  if (role == kRobot) drive_began_ = std::chrono::steady_clock::now();
  ended_by_[role] = 0;
  is_judged_[role] = false;
  processes_[role] = std::make_unique<ChildProcess>(command);
}

std::vector<std::string> Rig::UnderClock(Role role) {
  const std::string path = scratch_ / (std::string("clock of the ") + kNames[role]);
  if (!clocks_[role]) clocks_[role].reset(MapClockFile(path.c_str()));
  if (!clocks_[role]) throw std::runtime_error(path + " cannot be mapped");
  return {"/usr/bin/env", "LD_PRELOAD=" FOREREACH_SETTABLE_CLOCK, "FOREREACH_CLOCK_FILE=" + path,
          SanitizerAfterPreload()};
}

void Rig::SetClock(Role role, std::chrono::microseconds offset) {
  ClockFile& clock = *clocks_[role];
  clock.offset_us = offset.count();
  const std::int64_t before = clock.reads;
  if (!ListenUntil([&] { return clock.reads > before || !IsAlive(role); }, std::chrono::seconds(5)))
    throw std::runtime_error(std::string(kNames[role]) + " does not look at its clock");
}

void Rig::SetClocks(std::chrono::microseconds offset) {
  clock_offset_us_ = offset.count();
  for (const auto& clock : clocks_) clock->offset_us = offset.count();
}

void Rig::Signal(Role role, int signal) {
  if (processes_[role]) processes_[role]->Signal(signal);
}

void Rig::End(Role role, int signal) {
  if (!processes_[role]) return;
  if (signal == SIGTERM) static_cast<void>(processes_[role]->WaitForLog("ready on"));  // it listens to SIGTERM by then
  LookAtEnd(role);
  ended_by_[role] = signal;
  processes_[role]->Signal(signal);
  if (processes_[role]->WaitForEnd(kEndsWithin))
    LookAtEnd(role);
  else
    BadEnding(role, "did not end");
  processes_[role].reset();
}

void Rig::EndAll() {
  EndSecondCertifier();
  for (const Role role : {kRobot, kPlanner, kCertifier, kLogger}) End(role);
}

void Rig::LookAtEnd(Role role) {
  if (!processes_[role] || is_judged_[role] || IsAlive(role)) return;
  is_judged_[role] = true;
  const std::optional<int> status = processes_[role]->WaitForExit(std::chrono::milliseconds(0));
  const bool may_end_well = ended_by_[role] == SIGTERM || role == kPlanner || role == kRobot;
  if (status == 1 && role == kLogger && options_.takes_logs_away && ended_by_[role] == SIGTERM) return;
  if (status ? *status == 0 && may_end_well : ended_by_[role] == SIGKILL) return;
  BadEnding(role, status ? "ended with exit status " + std::to_string(*status) : "ended by a signal");
}

void Rig::BadEnding(Role role, const std::string& how) {
  bad_endings_.push_back(std::string("the ") + kNames[role] + " " + how + ": " + Tail(processes_[role]->error()));
}

std::vector<std::string> Rig::TakeBadEndings() {
  for (const Role role : {kLogger, kCertifier, kPlanner, kRobot}) LookAtEnd(role);
  return std::exchange(bad_endings_, {});
}

bool Rig::IsAlive(Role role) const {
  return processes_[role] && !processes_[role]->WaitForEnd(std::chrono::milliseconds(0));
}

void Rig::Listen(std::chrono::milliseconds time) {
  static_cast<void>(ListenUntil([] { return false; }, time));
}

bool Rig::ListenUntil(const std::function<bool()>& done, std::chrono::milliseconds patience) {
  const auto end = std::chrono::steady_clock::now() + patience;
  while (!done()) {
    if (std::chrono::steady_clock::now() >= end) return false;
    heard_->Dispatch(5);
    open_->Dispatch(0);
  }
  return true;
}

void Rig::Command(std::int16_t kind) {
  command_t command{.utime = NowUs(), .kind = kind};
  SetText(command.source, "campaign");
  signed_->Publish(config_.bus.command, command);
}

void Rig::DriveAnew() {
  End(kRobot);
  End(kPlanner);  // it ends with the drive
  Start(kPlanner);
  Start(kRobot);
}

std::string Rig::Heal() {
  Listen(kLastWords);
  for (const Role role : {kLogger, kCertifier, kPlanner, kRobot})
    if (!IsAlive(role)) Start(role);
  if (std::chrono::steady_clock::now() - drive_began_ > kDriveAtMost) DriveAnew();
  witness_->Forget();
  const std::int64_t before = witness_->decisions(), certificates_before = witness_->certificates();
  auto next_reset = std::chrono::steady_clock::now();
  const bool healed = ListenUntil(
      [&] {
        const auto& status = witness_->status();
        if (status && status->state == certifier_status_t::FAULT && std::chrono::steady_clock::now() >= next_reset) {
          Command(command_t::RESET);
          next_reset = std::chrono::steady_clock::now() + std::chrono::milliseconds(200);
        }
        const bool silent =
            std::chrono::steady_clock::now() - std::max(witness_->robot_heard(), drive_began_) > kSilent;
        if (silent || !IsAlive(kRobot) || !IsAlive(kPlanner)) DriveAnew();
        return status && status->level == certifier_status_t::OK && witness_->executed() > certificates_before &&
               witness_->logger_status() && witness_->logger_status()->state == logger_status_t::OK;
      },
      kRecovers);
  if (healed) {
    witness_->ForgetFault();  // it was said again until the reset
    return "";
  }
  const auto& status = witness_->status();
  std::string why = status ? "certifier: " + GetText(status->message) : "no certifier is heard";
  why +=
      witness_->logger_status() ? "; logger: " + GetText(witness_->logger_status()->message) : "; no logger is heard";
  for (const Role role : {kLogger, kCertifier, kPlanner, kRobot})
    why += std::string("; ") + kNames[role] + (IsAlive(role) ? ": " + LastLine(processes_[role]->error()) : " ended");
  return why + "; decisions " + std::to_string(witness_->decisions() - before) + ", certificates " +
         std::to_string(witness_->certificates() - certificates_before) +
         (witness_->executed() > certificates_before ? "" : ", none of them executed");
}

// Of the present logger.
void Rig::LookAtLogs() {
  Record& record = records_.back();
  for (const std::string& log : LogsIn(directory_))
    if (!earlier_logs_.contains(log)) record.logs.insert(log);
  if (witness_->logger_status()) record.due = witness_->logger_status()->events_written;
}

std::int64_t Rig::TakeLost() {
  LookAtLogs();
  std::int64_t newly_lost = 0;
  for (Record& record : records_) {
    const std::int64_t lost = std::max(record.lost, record.due - EventsIn(record.logs));
    newly_lost += lost - std::exchange(record.lost, lost);
  }
  records_.erase(records_.begin(), records_.end() - 1);
  return newly_lost;
}

std::vector<std::string> Rig::CheckRecords() const {
  std::vector<std::string> amiss;
  for (const std::string& directory : directories_) try {
      std::vector<LogCheck> checks = CheckLogs(directory, "", {.file = key_path_});
      std::erase_if(checks, [this](LogCheck& check) {
        if (!has_one_key_ring_) check.rows.clear();  // no ring tells all authentic messages
        return (check.whole_log() && check.ended) || (options_.takes_logs_away && check.log == LogCheck::Log::kMissing);
      });
      if (!checks.empty()) amiss.push_back(directory + ": " + ToText(checks));
    } catch (const BadInput& error) {
      amiss.push_back(error.what());
    }
  return amiss;
}

}  // namespace forereach
