// Policy files: any bytes are a network that can be evaluated, or refused with a PolicyError.
#include "fuzz/fuzz.h"
#include "planner_bridge/policy.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace forereach;
  static MemoryFile file;
  const std::string& path = file.Write(Bytes(data, size));
  IsTaken([&] {
    const Policy policy = LoadPolicy(path);
    const Eigen::MatrixXd block = policy.Act(Eigen::VectorXd::Zero(policy.num_features()));
    Require(block.rows() == policy.num_inputs && block.cols() == policy.num_steps() && block.cols() >= 1);
  });
  return 0;
}
