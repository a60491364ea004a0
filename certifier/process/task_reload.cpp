#include "certifier/process/task_reload.h"

#include <initializer_list>
#include <utility>

#include <fmt/core.h>

#include "bus/bus_options.h"
#include "bus/log.h"
#include "lcmtypes/why_failed.h"

namespace forereach {
namespace {

TaskReload::Loaded Load(const std::string& path, const BusOptions& in_force) try {
  logging::Info("reloading {}", path);
  TaskReload::Loaded loaded{LoadConfig(path), nullptr, ""};
  RequireForCertifyingOnBus(loaded.config);
  loaded.error = WhyKeyCannotChange(in_force, loaded.config.bus, Role::kCertifier);
  if (!loaded.error.empty()) loaded.error = fmt::format("{}: {}", path, loaded.error);
  loaded.gate = std::make_unique<Gate>(loaded.config);
  return loaded;
} catch (const std::exception& error) {
  return {{}, nullptr, WhyFailed(error)};
}

}  // namespace

TaskReload::TaskReload(const std::string& path, const BusOptions& channels)
    : channels_(channels), reload_([path, channels] { return Load(path, channels); }) {}

bool TaskReload::Ask() {
  const bool is_asked = reload_.Ask();
  if (!is_asked) Fail("the reloads before it have not ended; the task file is read again once one has");
  return is_asked;
}

std::optional<TaskReload::Loaded> TaskReload::Take(const Config& in_force, const Contradictions& contradictions) {
  std::optional<Loaded> loaded = reload_.Take();
  std::optional<Loaded> stalled;
  if (reload_.TakeStall()) stalled = Fail("it has not ended yet: a file that it reads does not answer");
  if (!loaded) return stalled;
  const std::string why = loaded->error.empty() ? WhyNotTaken(loaded->config, in_force, contradictions) : loaded->error;
  if (!why.empty()) return Fail(why);
  error_.clear();
  logging::Info("version {} of {} is in force", ++version_, loaded->config.path);
  return loaded;
}

std::string TaskReload::WhyNotTaken(const Config& config, const Config& in_force,
                                    const Contradictions& contradictions) const {
  const Problem &before = *in_force.problem, &after = *config.problem;
  BusOptions bus = config.bus;
  bus.url = channels_.url;  // a command line may have given another
  bus.key = channels_.key, bus.keys = channels_.keys, bus.key_is_given = channels_.key_is_given;  // Load compares keys
  // Sockets, threads, the latch and messages under way were made with these at the start.
  for (const auto& [changes, what] : std::initializer_list<std::pair<bool, const char*>>{
           {bus.name != channels_.name, "bus.name"},
           {bus.delay_ms != channels_.delay_ms, "bus.delay_ms"},
           {bus != channels_, "bus.channels"},
           {config.realtime != in_force.realtime, "realtime"},
           {config.gate.obstacles != in_force.gate.obstacles, "gate.obstacles"},
           {config.gate.max_clock_error_ms != in_force.gate.max_clock_error_ms, "gate.max_clock_error_ms"},
           {config.gate.state != in_force.gate.state, "gate.state"},
           {after.model->num_states() != before.model->num_states(), "the number of states"},
           {after.model->num_inputs() != before.model->num_inputs(), "the number of inputs"},
           {after.projection.rows() != before.projection.rows(), "the number of safety coordinates"}})
    if (changes) return fmt::format("{}: {} cannot change while the certifier runs", config.path, what);
  // Reading a file does not undo what the robot has shown.
  if (contradictions.Contradict(config))
    return fmt::format("{}: a transition that was executed contradicts its declaration; another has to be declared",
                       config.path);
  return "";
}

TaskReload::Loaded TaskReload::Fail(const std::string& why) {
  error_ = why;
  ++failed_;
  logging::Error("not reloaded, version {} stays in force: {}", version_, why);
  return {{}, nullptr, why};
}

}  // namespace forereach
