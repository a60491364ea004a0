#include "planner_bridge/planner_node.h"
#include "task/process.h"

int main(int argc, char** argv) {
  using namespace forereach;
  return RunProcess(argc, argv,
                    {"forereach-planner",
                     "Proposes plans from the robot's state towards the goal, in a receding horizon, and replans after "
                     "each abstention. Ends when the robot has finished, with one JSON line on standard output.",
                     "forereach-planner --config config/demo.yaml", Role::kPlanner},
                    [](const Config& config, Bus& bus) {
                      RequireForCertifying(config);
                      return std::make_unique<PlannerNode>(config, bus);
                    });
}
