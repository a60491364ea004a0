#include "certifier/process/certifier_process.h"

#include <memory>
#include <string>
#include <utility>

#include "bus/realtime.h"
#include "certifier/process/certifier_node.h"
#include "certifier/process/latch_file.h"
#include "task/process.h"

namespace forereach {

int CertifierProcess(int argc, char** argv) {
  std::string state;
  return RunProcess(
      argc, argv,
      {"forereach-certifier",
       "Certifies candidate plans on the bus, or abstains with a reason. Each candidate gets exactly one decision, and "
       "only certified plans are passed on. Of several certifiers on one bus one is in charge, and the others stand "
       "by. SIGHUP reads the task file again.",
       "forereach-certifier --config config/demo.yaml", Role::kCertifier},
      [&state](const Config& config, Bus& bus) {
        auto latch = std::make_unique<LatchFile>(state.empty() ? config.gate.state : state);
        auto node = std::make_unique<CertifierNode>(config, bus, Clocks(), Charge::kListenUs, std::move(latch));
        BecomeRealtime(config.realtime);
        return node;
      },
      {{"--state", &state, "DIR", "The directory for a latched fault; by default the task file's gate.state"}});
}

}  // namespace forereach
