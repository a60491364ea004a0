/** A learned policy: its file of weights and its evaluation. This code does not depend on the training.

A fully connected network with hidden layers of tanh maps features to a block of controls for steps t = 0..T-1, stored
step by step: h_0 = (features - input.offset) / input.scale,   h_l = tanh(W_l h_{l-1} + b_l), block = output.offset +
output.scale * (W_L h_{L-1} + b_L). reference.h defines the features of the bicycle. A policy's blocks have no
guarantee; they are only candidates. */
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "lcmtypes/bad_input.h"

namespace forereach {

/** A policy file cannot be used. The text names file, field, value and bound. */
class PolicyError : public BadInput {
 public:
  using BadInput::BadInput;
};

struct Policy {
  /** An affine map for each entry. Scales are positive. */
  struct Scaling {
    Eigen::VectorXd offset, scale;
  };
  struct Layer {
    Eigen::MatrixXd weight;
    Eigen::VectorXd bias;
  };

  std::string model;   ///< NominalModel::description() of the model that it was trained with
  int num_inputs = 0;  ///< m
  Scaling input, output;
  std::vector<Layer> layers;  ///< At least one. The columns of each are the rows of the one before.

  [[nodiscard]] int num_features() const { return static_cast<int>(input.offset.size()); }
  [[nodiscard]] int num_steps() const { return static_cast<int>(output.offset.size()) / num_inputs; }

  /** The block of controls, m-by-T, one column for each step. @param features num_features() entries. Cost: one
  multiplication for each weight. */
  [[nodiscard]] Eigen::MatrixXd Act(const Eigen::VectorXd& features) const;
};

/** Reads a policy file: JSON with exactly these fields,
    format      "forereach-policy"
    version     1
    model       text
    activation  "tanh"
    inputs      m, 1 to 8
    steps       T, 1 to 128
    sizes       numbers of features, of each hidden layer, and m T; 2 to 9 of them, each 1 to 1024
    input       {offset, scale}: as many numbers as features
    output      {offset, scale}: m T numbers
    layers      one less than sizes, each {weight: rows of numbers, bias: numbers}
Numbers are finite, scales positive. @throws PolicyError. */
[[nodiscard]] Policy LoadPolicy(const std::string& path);

/** Writes a policy file. LoadPolicy reads back the same bits. @throws PolicyError if the file cannot be written. */
void SavePolicy(const std::string& path, const Policy& policy);

}  // namespace forereach
