#include "cli/each_run.h"

#include "bus/keys.h"
#include "certifier/task/config.h"
#include "lcmtypes/grounds.h"

namespace forereach {

std::string DescribeInputs(const std::string& config, const LogKey& key) {
  std::string text = "config";
  if (!config.empty()) {
    const Config task = LoadConfig(config);
    for (const auto& [name, digest] : kGrounds) text += " " + ToHex(task.grounds.*digest);
    text += " " + task.bus.key;
  }
  text += key.none ? "\nno key" : "\nkey";
  if (!key.file.empty()) {
    const KeyRing keys = LoadPublicKeys(key.file);
    text += " " + keys.robot();
    for (const Role role : kAllRoles) text += " " + ToHex(DigestOf(Bytes(keys.public_key(role))));
  }
  return text;
}

std::unique_ptr<FinishedRuns> ResultsOf(const EachRunOptions& options, const std::string& command,
                                        const std::string& config, const LogKey& key) {
  if (options.resume.empty()) return nullptr;
  return std::make_unique<FinishedRuns>(options.resume, command + "\n" + DescribeInputs(config, key));
}

}  // namespace forereach
