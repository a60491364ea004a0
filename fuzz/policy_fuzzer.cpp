// Policy files: any bytes are a network that can be evaluated, or refused with a PolicyError.
#include "fuzz/fuzz.h"
#include "fuzz/json_mutator.h"
#include "planner_bridge/policy.h"

bool forereach::Try(Bytes data) {
  static MemoryFile file;
  const std::string& path = file.Write(data);
  return IsTaken([&] {
    const Policy policy = LoadPolicy(path);
    const Eigen::MatrixXd block = policy.Act(Eigen::VectorXd::Zero(policy.num_features()));
    Require(block.rows() == policy.num_inputs && block.cols() == policy.num_steps() && block.cols() >= 1);
  });
}
