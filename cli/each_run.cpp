#include "cli/each_run.h"

#include "bus/bus_options.h"
#include "bus/keys.h"
#include "lcmtypes/codec.h"
#include "lcmtypes/grounds.h"

namespace forereach {

std::string JobOf(std::string command, const std::string& config, const LogKey& key) {
  BusOptions bus;
  if (!config.empty()) {
    const Config task = LoadConfig(config);
    for (const auto& [name, digest] : kGrounds) command += " " + ToHex(task.grounds.*digest);
    bus = task.bus;
  }
  key.Override(bus);
  command += key.none ? "\nno key" : "\nkey";
  if (const std::optional<KeyRing> keys = PublicKeysOf(bus)) {
    command += " " + keys->robot();
    for (const Role role : kAllRoles) command += " " + ToHex(DigestOf(Bytes(keys->public_key(role))));
  }
  return command;
}

std::unique_ptr<FinishedRuns> ResultsOf(const EachRunOptions& options, std::string command, const std::string& config,
                                        const LogKey& key) {
  if (options.resume.empty()) return nullptr;
  return std::make_unique<FinishedRuns>(options.resume, JobOf(std::move(command), config, key));
}

}  // namespace forereach
