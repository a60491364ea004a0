#include "planner_bridge/policy.h"

#include <fstream>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forereach/numerics/limits.h"
#include "task/config_error.h"
#include "task/files.h"
#include "task/json_field.h"
#include "task/json_text.h"

namespace forereach {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kFormat = "forereach-policy";
constexpr const char* kActivation = "tanh";
constexpr int kVersion = 1, kLargestLayer = 1024, kMostSizes = 9;

void RequireText(const JsonField& field, const std::string& text) {
  if (field.Text() != text) field.Fail(fmt::format("{} has to be {}", field.Text(), text));
}

std::vector<std::size_t> ReadSizes(const JsonField& field) {
  const std::size_t count = field.Count();
  if (count < 2 || count > kMostSizes)
    field.Fail(fmt::format("has {} entries, has to have 2 to {}", count, kMostSizes));
  std::vector<std::size_t> sizes;
  for (std::size_t i = 0; i < count; ++i) sizes.push_back(static_cast<std::size_t>(field[i].Integer(1, kLargestLayer)));
  return sizes;
}

Policy::Scaling ReadScaling(const JsonField& field, std::size_t count) {
  field.RequireFields({"offset", "scale"});
  return {field["offset"].Numbers(count), field["scale"].Numbers(count, 0)};
}

Policy::Layer ReadLayer(const JsonField& field, std::size_t width, std::size_t height) {
  field.RequireFields({"weight", "bias"});
  const JsonField weight = field["weight"];
  weight.RequireCount(height);
  Policy::Layer layer{Eigen::MatrixXd(height, width), field["bias"].Numbers(height)};
  for (std::size_t i = 0; i < height; ++i)
    layer.weight.row(static_cast<Eigen::Index>(i)) = weight[i].Numbers(width).transpose();
  return layer;
}

Policy Read(const JsonField& file) {
  file.RequireFields(
      {"format", "version", "model", "activation", "inputs", "steps", "sizes", "input", "output", "layers"});
  RequireText(file["format"], kFormat);
  static_cast<void>(file["version"].Integer(kVersion, kVersion));
  RequireText(file["activation"], kActivation);
  Policy policy;
  policy.model = file["model"].Text();
  policy.num_inputs = file["inputs"].Integer(1, kMaxInputs);
  const auto outputs = static_cast<std::size_t>(policy.num_inputs * file["steps"].Integer(1, kMaxSteps));
  const std::vector<std::size_t> sizes = ReadSizes(file["sizes"]);
  if (sizes.back() != outputs)
    file["sizes"].Fail(fmt::format("ends with {}, has to end with inputs times steps, {}", sizes.back(), outputs));
  policy.input = ReadScaling(file["input"], sizes.front());
  policy.output = ReadScaling(file["output"], outputs);
  const JsonField layers = file["layers"];
  layers.RequireCount(sizes.size() - 1);
  for (std::size_t l = 0; l + 1 < sizes.size(); ++l)
    policy.layers.push_back(ReadLayer(layers[l], sizes[l], sizes[l + 1]));
  return policy;
}

Json ToJson(const Eigen::VectorXd& numbers) { return std::vector<double>(numbers.begin(), numbers.end()); }

Json ToJson(const Policy::Scaling& scaling) {
  return {{"offset", ToJson(scaling.offset)}, {"scale", ToJson(scaling.scale)}};
}

// Writes one line for each row of numbers, so that changes of a policy are readable.
std::string Lines(const Policy& policy) {
  Json head{{"format", kFormat},
            {"version", kVersion},
            {"model", policy.model},
            {"activation", kActivation},
            {"inputs", policy.num_inputs},
            {"steps", policy.num_steps()},
            {"sizes", {policy.num_features()}},
            {"input", ToJson(policy.input)},
            {"output", ToJson(policy.output)}};
  for (const Policy::Layer& layer : policy.layers) head["sizes"].push_back(layer.bias.size());
  std::string text = "{\n";
  for (const auto& [name, value] : head.items())
    text += fmt::format("{}: {},\n", JsonText(Json(name)), JsonText(value));
  text += "\"layers\": [\n";
  for (const Policy::Layer& layer : policy.layers) {
    text += "{\"weight\": [\n";
    for (Eigen::Index i = 0; i < layer.weight.rows(); ++i)
      text += JsonText(ToJson(Eigen::VectorXd(layer.weight.row(i)))) + (i + 1 < layer.weight.rows() ? ",\n" : "],\n");
    text +=
        fmt::format("\"bias\": {}{}", JsonText(ToJson(layer.bias)), &layer == &policy.layers.back() ? "}]\n" : "},\n");
  }
  return text + "}\n";
}

}  // namespace

Eigen::MatrixXd Policy::Act(const Eigen::VectorXd& features) const {
  Eigen::VectorXd h = (features - input.offset).cwiseQuotient(input.scale);
  for (const Layer& layer : layers) {
    h = (layer.weight * h + layer.bias).eval();
    // The last layer is linear: its outputs are scaled to controls.
    if (&layer != &layers.back()) h = h.array().tanh();
  }
  h = output.offset + output.scale.cwiseProduct(h);
  return h.reshaped(num_inputs, num_steps());
}

Policy LoadPolicy(const std::string& path) try {
  const auto json = ParseJson<nlohmann::json>(ReadWhole(path, kLargestJsonFile));
  return Read(JsonField(path, json));
} catch (const ConfigError& error) {
  throw PolicyError(error.what());
} catch (const nlohmann::json::exception& error) {
  throw PolicyError(fmt::format("{}: {}", path, DescribeJsonError(error)));
}

void SavePolicy(const std::string& path, const Policy& policy) {
  std::ofstream file(path);
  file << Lines(policy);
  file.close();
  if (!file) throw PolicyError(fmt::format("{}: cannot be written", path));
}

}  // namespace forereach
