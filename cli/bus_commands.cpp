// Commands for a running system: keygen, reset, reload, status.
#include <algorithm>
#include <functional>
#include <iostream>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "bus/authentic.h"
#include "bus/bus_options.h"
#include "bus/keys.h"
#include "bus/process.h"
#include "cli/commands.h"
#include "forereach/certifier_status_t.hpp"
#include "forereach/command_t.hpp"
#include "lcmtypes/names.h"
#include "records/status_json.h"
#include "task/config.h"
#include "task/json_text.h"

namespace forereach {
namespace {

constexpr int kPatienceMs = 3000;

struct CommandArguments {
  std::string config;
  BusArguments bus;
  bool json = false;
};

// The connection to the certifier: sends commands, receives heartbeats. With a key it accepts only heartbeats that the
// certifier has signed.
class CertifierConnection final {
 public:
  explicit CertifierConnection(const CommandArguments& options)
      : CertifierConnection(options, LoadConfig(options.config, TransitionsFile::kIgnore)) {}
  CertifierConnection(const CommandArguments& options, const Config& task)
      : task_(task.grounds.config), channels_(task.bus) {
    options.bus.Override(channels_);
    channels_ = WithKeys(std::move(channels_), Role::kOperator);
    if (!channels_.keys) std::cerr << "forereach: warning: " << kUnsignedWarning << std::endl;
    bus_ = OpenBus(channels_, Role::kOperator);
    bus_->Subscribe(channels_.status, [this](const Received& received) {
      const Bytes message = channels_.keys ? received.bytes : WithoutSignature(received.raw);
      if (!channels_.keys && message.size() < received.raw.size() && !std::exchange(warned_, true))
        std::cerr << "forereach: warning: the heartbeat is signed; --key checks by whom" << std::endl;
      if (const auto status = Decoded<certifier_status_t>(message)) heard_.push_back(*status);
    });
  }

  // The first heartbeat from now on that `passes` accepts, or nothing.
  std::optional<certifier_status_t> Await(const std::function<bool(const certifier_status_t&)>& passes) {
    const std::int64_t end = SteadyClockUs() + kPatienceMs * 1000;
    for (heard_.clear(); SteadyClockUs() < end; bus_->Dispatch(50)) {
      const auto found = std::ranges::find_if(heard_, passes);
      if (found != heard_.end()) return *found;
    }
    return std::nullopt;
  }
  // A heartbeat of the certifier in charge; if none arrives, of any certifier.
  std::optional<certifier_status_t> Await() {
    if (auto status = Await(IsInCharge)) return status;
    return heard_.empty() ? std::nullopt : std::optional(heard_.back());
  }

  void Send(const command_t& command) { bus_->Publish(channels_.command, command); }
  [[nodiscard]] const BusOptions& channels() const { return channels_; }
  /** Of the task file as it is here. */
  [[nodiscard]] const Digest& task() const { return task_; }

 private:
  const Digest task_;
  BusOptions channels_;
  std::unique_ptr<Bus> bus_;
  std::vector<certifier_status_t> heard_;
  bool warned_ = false;
};

// Since the certifier's start.
std::string DescribeRefused(const certifier_status_t& status) {
  std::string text;
  for (const auto& [count, what] : {std::pair{status.refused_unsigned, "unsigned"},
                                    {status.refused_forged, "forged"},
                                    {status.refused_replayed, "replayed or signed by another clock"},
                                    {status.refused_foreign, "of another bus"},
                                    {status.messages_refused, "of no use; its log says why"}})
    if (count > 0) text += fmt::format("{}{} {}", text.empty() ? "messages refused: " : ", ", count, what);
  return text;
}

void Print(const certifier_status_t& status, bool json, bool is_signed) {
  if (json) {
    std::cout << JsonText(ToJson(status, is_signed)) << std::endl;
    return;
  }
  std::cout << LevelName(status.level) << ", " << StateName(status.state) << (status.shadow ? ", shadow mode" : "");
  if (const std::string message = GetText(status.message); !message.empty()) std::cout << ": " << message;
  if (status.fault != 0) std::cout << "\nwhat to do: " << FaultAdvice(status.fault);
  if (status.latch == certifier_status_t::LATCH_WRITTEN)
    std::cout << "\nthe fault is on disk: a restart does not clear it";
  if (status.latch == certifier_status_t::LATCH_UNWRITABLE)
    std::cout << "\ngate.state cannot be used: a fault is not on disk";
  std::cout << "\nversion " << status.version << ", " << status.observations << " observations, of these "
            << status.learned << " learned; " << status.candidates << " candidates:";
  for (std::int16_t i = 0; i < 16; ++i)
    if (status.by_outcome[i] > 0) std::cout << " " << status.by_outcome[i] << " " << OutcomeName(i);
  std::cout << "\n"
            << status.obstacles_in_force << " obstacles in force, from the "
            << (status.obstacles_source == certifier_status_t::OBSTACLES_BUS ? "task file and the bus" : "task file");
  if (status.obstacles_age_us >= 0)
    std::cout << "; the last message is " << status.obstacles_age_us / 1000 << " ms old";
  if (!status.obstacles_known) std::cout << "; not all are known";
  if (const std::string refused = DescribeRefused(status); !refused.empty()) std::cout << "\n" << refused;
  std::cout << std::endl;
}

int NoCertifierAnswers(const BusOptions& bus) {
  std::cerr << "forereach: no certifier answered on " << bus.url << " (" << bus.status << ") within "
            << kPatienceMs / 1000 << " s; `forereach doctor` checks the bus" << std::endl;
  return 1;
}

int ShowStatus(const CommandArguments& options) {
  CertifierConnection certifier(options);
  const auto status = certifier.Await();
  if (!status) return NoCertifierAnswers(certifier.channels());
  Print(*status, options.json, certifier.channels().keys.has_value());
  return status->level == certifier_status_t::OK ? 0 : 1;
}

// Why a command is not done, by the last heartbeat after it.
std::string WhyNotDone(bool resets, const certifier_status_t& before, const certifier_status_t& last) {
  if (!resets && last.version > before.version)
    return "a task file was read again since, and it is not --config as it is here: another one, or from before a "
           "change";
  if (!resets && last.failed_reloads > before.failed_reloads)
    return "a reload has failed since, for the reason above; a heartbeat does not say whose";
  return fmt::format(
      "the certifier has not done the {} within {} s: it refuses a command without the operator's key (--key){}; its "
      "log says which it refused",
      resets ? "reset" : "reload", kPatienceMs / 1000, resets ? ", and one that was sent before the fault" : "");
}

// Sends a command, and shows the heartbeat that answers it. Others may send commands meanwhile, and a heartbeat names
// none: what answers is the effect. A reload is done when the certifier has read this very file after the command.
int Send(const CommandArguments& options, std::int16_t kind) {
  CertifierConnection certifier(options);
  const auto before = certifier.Await();
  if (!before) return NoCertifierAnswers(certifier.channels());
  command_t command{};
  command.utime = WallClockUs();
  command.kind = kind;
  SetText(command.source, "forereach");
  certifier.Send(command);
  const bool resets = kind == command_t::RESET;
  const auto is_done = [&](const certifier_status_t& status) {
    return resets ? status.state != certifier_status_t::FAULT
                  : status.version > before->version && GetDigest(status.config_digest) == certifier.task();
  };
  std::optional<certifier_status_t> last;
  const auto answered = certifier.Await([&](const certifier_status_t& status) {
    if (status.instance != before->instance || status.utime < command.utime) return false;
    last = status;
    return is_done(status);
  });
  if (!last) return NoCertifierAnswers(certifier.channels());
  Print(*last, options.json, certifier.channels().keys.has_value());
  if (!answered) std::cerr << "forereach: " << WhyNotDone(resets, *before, *last) << std::endl;
  return answered ? 0 : 1;
}

Command BusCommand(const std::string& name, const std::string& purpose,
                   const std::function<int(const CommandArguments&)>& run) {
  const auto options = std::make_shared<CommandArguments>();
  Command command{.name = name,
                  .purpose = purpose,
                  .footer = fmt::format("Example:\n  forereach {} --config config/demo.yaml", name),
                  .options = {ConfigOption(options->config, "The task file of the certifier"), JsonFlag(options->json)},
                  .run = [options, run] { return run(*options); }};
  options->bus.AddTo(command.options);
  return command;
}

}  // namespace

Command StatusCommand() {
  return BusCommand("status", "Show the certifier's heartbeat: exit 0 if it would certify now, otherwise 1",
                    ShowStatus);
}

Command ResetCommand() {
  return BusCommand("reset", "Clear the latched fault of the certifier and the robot",
                    [](const CommandArguments& options) { return Send(options, command_t::RESET); });
}

Command ReloadCommand() {
  return BusCommand("reload", "Make the certifier read its task file again, completely or not at all",
                    [](const CommandArguments& options) { return Send(options, command_t::RELOAD); });
}

namespace {

std::vector<std::string> RoleNames() {
  std::vector<std::string> names;
  for (const Role role : kAllRoles) names.emplace_back(RoleName(role));
  return names;
}

// The other roles' files first, because with them the machines refuse the lost key: those that others obey before those
// that listen.
void PrintWhoNeedsWhat(const std::string& directory, Role replaced) {
  std::cout << directory << ": the " << RoleName(replaced)
            << " has a new key. The old one counts until the machines below have their new files.\n"
               "Copy them in this order, and restart the programs that use them:\n";
  for (const Role role :
       {Role::kCertifier, Role::kRobot, Role::kPlanner, Role::kPerception, Role::kOperator, Role::kLogger})
    if (role != replaced)
      std::cout << "  " << RoleName(role) << ".key to the machine that speaks as " << RoleName(role) << '\n';
  std::cout << "  " << RoleName(replaced) << ".key to the new machine of the " << RoleName(replaced)
            << ", and to no other\n"
            << "  verify.pub to those who read logs; logs from before need the verify.pub from before" << std::endl;
}

}  // namespace

Command KeygenCommand() {
  struct KeygenArguments {
    std::string robot, directory, again;
  };
  const auto options = std::make_shared<KeygenArguments>();
  return {
      .name = "keygen",
      .purpose = "Make the keys of one robot: a directory with one key file for each role",
      .footer =
          "Examples:\n  forereach keygen --robot alpha keys\n  forereach keygen --robot alpha keys --again planner\n"
          "Then give --key keys to every process, or set bus.key in the task file. On another machine a process needs "
          "only its own role's file, as in\n"
          "  forereach-planner --config my_robot.yaml --key planner.key\nkeys/verify.pub contains no secret; report, "
          "replay and verify check logs with it.\n\nIf the machine of a role is lost, --again gives that role a new "
          "key and keeps the others'. It prints which machine needs which file; a machine without its new file still "
          "believes the lost key, and refuses the new one. Keep a copy of verify.pub if there are logs from before.",
      .options = {Required({"--robot", &options->robot, "NAME",
                            "The robot's name: letters, digits, '.', '_', '-'; it is part of every signature"}),
                  Required({"directory", &options->directory, "DIR",
                            "The new directory; with --again, the one that was made"}),
                  OneOf(RoleNames(), {"--again", &options->again, "ROLE",
                                      "Replace the key of this role in DIR, and no other: its machine is lost"})},
      .run = [options] {
        const auto again = std::ranges::find(kAllRoles, options->again, RoleName);
        if (again == kAllRoles.end()) {
          MakeKeys(options->robot, options->directory);
          std::cout << options->directory << std::endl;
        } else {
          ReplaceKey(options->robot, options->directory, *again);
          PrintWhoNeedsWhat(options->directory, *again);
        }
        return 0;
      }};
}

}  // namespace forereach
