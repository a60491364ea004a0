#include "certifier/process/certifier_node.h"
#include "certifier/process/realtime.h"
#include "certifier/task/process.h"

int main(int argc, char** argv) {
  using namespace forereach;
  return RunProcess(argc, argv,
                    {"forereach-certifier",
                     "Certifies candidate plans on the bus, or abstains and says why. Each candidate gets exactly one "
                     "decision; only certified plans are passed on. SIGHUP reads the task file again.",
                     "forereach-certifier --config config/demo.yaml",
                     Role::kCertifier},
                    [](const Config& config, Bus& bus) {
                      auto node = std::make_unique<CertifierNode>(config, bus);
                      BecomeRealtime(config.realtime);
                      return node;
                    });
}
