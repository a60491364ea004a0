#include "research/chunks/training.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numeric>
#include <vector>

#include <dlib/dnn.h>

namespace forereach::research {
namespace {

constexpr int kHidden = 64;
constexpr std::size_t kBatch = 64;
constexpr double kFirstRate = 2e-3, kLastRate = 1e-5;
enum : std::uint64_t { kForWeights = 0x77656967, kForOrder = 0x6f726465 };

using Sample = dlib::matrix<float>;
template <class Below>
using Hidden = dlib::htan<dlib::fc<kHidden, Below>>;
using Network = dlib::loss_mean_squared_multioutput<dlib::fc<2 * kBlockSteps, Hidden<Hidden<dlib::input<Sample>>>>>;

// The shortest decimal that is this float: a file of them has half the digits of one of doubles.
double Written(float number) {
  char text[32];
  const char* const end = std::to_chars(text, text + sizeof text, number).ptr;
  double read = 0;
  std::from_chars(text, end, read);
  return read;
}

// Means, and the deviations of row k, k + period, ... together. An input's steps share one, so that what is small in
// each step is not learned at the cost of what is large.
Policy::Scaling ScalingOf(const Eigen::MatrixXd& columns, Eigen::Index period) {
  const Eigen::VectorXd mean = columns.rowwise().mean();
  const Eigen::VectorXd variance = (columns.colwise() - mean).cwiseAbs2().rowwise().mean();
  const Eigen::VectorXd shared = variance.reshaped(period, variance.size() / period).rowwise().mean().cwiseSqrt();
  const auto written = [](double number) { return Written(static_cast<float>(number)); };
  return {mean.unaryExpr(written), shared.replicate(variance.size() / period, 1).unaryExpr(written)};
}

std::vector<Sample> Scaled(const Eigen::MatrixXd& columns, const Policy::Scaling& scaling) {
  std::vector<Sample> samples(static_cast<std::size_t>(columns.cols()), Sample(columns.rows(), 1));
  for (Eigen::Index i = 0; i < columns.cols(); ++i)
    for (Eigen::Index k = 0; k < columns.rows(); ++k)
      samples[static_cast<std::size_t>(i)](k) =
          static_cast<float>((columns(k, i) - scaling.offset[k]) / scaling.scale[k]);
  return samples;
}

// Parameters of a fully connected layer: a row of weights for each of its inputs, then the biases.
template <class Layer>
Policy::Layer LayerOf(const Layer& layer, Eigen::Index width, Eigen::Index height) {
  using RowMajor = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const float* numbers = layer.layer_details().get_layer_params().host();
  return {Eigen::Map<const RowMajor>(numbers, width, height).transpose().unaryExpr(&Written),
          Eigen::Map<const Eigen::VectorXf>(numbers + width * height, height).unaryExpr(&Written)};
}

// The library draws initial weights from std::rand, which differs between systems. Draws them again, by Glorot and
// Bengio, with biases of zero.
void DrawWeights(Network& network, const Sample& sample, std::uint64_t seed) {
  static_cast<void>(network(sample));  // allocates
  dlib::visit_layer_parameters(network, [&](std::size_t index, dlib::tensor& parameters) {
    if (parameters.size() == 0) return;  // tanh
    const std::size_t height = index == 0 ? 2 * kBlockSteps : kHidden;
    const std::size_t width = parameters.size() / height - 1;
    const double most = std::sqrt(6.0 / static_cast<double>(width + height));
    Random random{kForWeights, seed, index};
    std::fill_n(parameters.host(), parameters.size(), 0.0f);
    std::generate_n(parameters.host(), width * height, [&] { return static_cast<float>(random.Uniform(-most, most)); });
  });
}

void Fit(Network& network, const std::vector<Sample>& inputs, const std::vector<Sample>& outputs,
         const TrainingOptions& options) {
  dlib::dnn_trainer<Network, dlib::adam> trainer(network, dlib::adam(0, 0.9f, 0.999f));
  trainer.set_min_learning_rate(kLastRate / 2);
  trainer.set_iterations_without_progress_threshold(1'000'000'000);  // the schedule is ours
  std::vector<std::size_t> order(inputs.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::vector<Sample> batch_inputs, batch_outputs;
  Random random{kForOrder, options.seed};
  for (int epoch = 0; epoch < options.epochs; ++epoch) {
    trainer.set_learning_rate(kFirstRate * std::pow(kLastRate / kFirstRate, double(epoch) / options.epochs));
    for (std::size_t i = order.size(); i > 1; --i)
      std::swap(order[i - 1], order[static_cast<std::size_t>(random.Integer(0, static_cast<int>(i) - 1))]);
    for (std::size_t i = 0; i + kBatch <= order.size(); i += kBatch) {
      batch_inputs.clear(), batch_outputs.clear();
      for (std::size_t j = i; j < i + kBatch; ++j) {
        batch_inputs.push_back(inputs[order[j]]);
        batch_outputs.push_back(outputs[order[j]]);
      }
      trainer.train_one_step(batch_inputs, batch_outputs);
    }
  }
  static_cast<void>(trainer.get_net());  // waits for the last step
}

}  // namespace

Policy TrainPolicy(const TrainingOptions& options) {
  const Demonstrations all = MakeDemonstrations(options.demonstrations, options.seed, options.threads);
  Policy policy;
  policy.model = BicycleSystem().model->description();
  policy.num_inputs = BicycleSystem().num_inputs();
  policy.input = ScalingOf(all.features, all.features.rows());
  policy.output = ScalingOf(all.blocks, policy.num_inputs);
  const std::vector<Sample> inputs = Scaled(all.features, policy.input), outputs = Scaled(all.blocks, policy.output);
  Network network;
  DrawWeights(network, inputs.front(), options.seed);
  Fit(network, inputs, outputs, options);
  policy.layers = {LayerOf(dlib::layer<5>(network), all.features.rows(), kHidden),
                   LayerOf(dlib::layer<3>(network), kHidden, kHidden),
                   LayerOf(dlib::layer<1>(network), kHidden, all.blocks.rows())};
  return policy;
}

double CloningError(const Policy& policy, const Demonstrations& demonstrations) {
  double squares = 0;
  for (Eigen::Index i = 0; i < demonstrations.features.cols(); ++i) {
    const Eigen::VectorXd block = policy.Act(demonstrations.features.col(i)).reshaped();
    squares += (block - demonstrations.blocks.col(i)).cwiseQuotient(policy.output.scale).squaredNorm();
  }
  return std::sqrt(squares / static_cast<double>(demonstrations.blocks.size()));
}

}  // namespace forereach::research
