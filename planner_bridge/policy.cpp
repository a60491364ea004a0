#include "planner_bridge/policy.h"

#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <set>

#include <nlohmann/json.hpp>

#include "certifier/numerics/limits.h"
#include "certifier/numerics/text.h"
#include "certifier/task/config_error.h"
#include "certifier/task/files.h"
#include "certifier/task/json_file.h"

namespace forereach {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kFormat = "forereach-policy";
constexpr const char* kActivation = "tanh";
constexpr int kVersion = 1, kLargestLayer = 1024, kMostSizes = 9;

/** A value of the file with its place: "file: layers[1].bias". */
class Field final {
 public:
  Field(std::string file, std::string name, const Json& json)
      : file_(std::move(file)), name_(std::move(name)), json_(json) {}

  [[noreturn]] void Fail(const std::string& what) const {
    throw PolicyError(file_ + ": " + (name_.empty() ? "" : name_ + ": ") + what);
  }

  [[nodiscard]] Field operator[](const char* name) const {
    const auto found = json_.find(name);
    if (found == json_.end()) Fail(std::string("has no ") + name);
    return {file_, name_ + (name_.empty() ? "" : ".") + name, *found};
  }

  [[nodiscard]] Field operator[](std::size_t i) const {
    return {file_, name_ + "[" + std::to_string(i) + "]", json_[i]};
  }

  /** It is an object with these fields and no other. */
  void RequireFields(const std::set<std::string>& names) const {
    if (!json_.is_object()) Fail(json_.dump().substr(0, 40) + " is no object");
    for (const auto& [name, value] : json_.items())
      if (!names.contains(name)) Fail("has a field " + name + " that does not belong there");
  }

  /** It is a list of so many. */
  void RequireCount(std::size_t count) const {
    if (!json_.is_array()) Fail(json_.dump().substr(0, 40) + " is no list");
    if (json_.size() != count)
      Fail("has " + std::to_string(json_.size()) + " entries, has to have " + std::to_string(count));
  }

  [[nodiscard]] std::string Text() const {
    if (!json_.is_string()) Fail(json_.dump().substr(0, 40) + " is no text");
    return json_.get<std::string>();
  }

  void RequireText(const std::string& text) const {
    if (Text() != text) Fail(Text() + " has to be " + text);
  }

  [[nodiscard]] int Integer(int lower, int upper) const {
    if (!json_.is_number_integer() || json_ < lower || json_ > upper)
      Fail(json_.dump().substr(0, 40) + " is no integer in [" + std::to_string(lower) + ", " + std::to_string(upper) +
           "]");
    return json_.get<int>();
  }

  [[nodiscard]] double Number(double above) const {
    if (!json_.is_number() || !std::isfinite(json_.get<double>()) || !(json_.get<double>() > above))
      Fail(json_.dump().substr(0, 40) + " is outside (" + ToText(above) + ", inf)");
    return json_.get<double>();
  }

  [[nodiscard]] Eigen::VectorXd Numbers(std::size_t count,
                                        double above = -std::numeric_limits<double>::infinity()) const {
    RequireCount(count);
    Eigen::VectorXd numbers(static_cast<Eigen::Index>(count));
    for (std::size_t i = 0; i < count; ++i) numbers[static_cast<Eigen::Index>(i)] = (*this)[i].Number(above);
    return numbers;
  }

  [[nodiscard]] std::size_t count() const { return json_.size(); }

 private:
  std::string file_, name_;
  const Json& json_;
};

std::vector<std::size_t> ReadSizes(const Field& field) {
  const std::size_t count = field.count();
  field.RequireCount(count);
  if (count < 2 || count > kMostSizes)
    field.Fail("has " + std::to_string(count) + " entries, has to have 2 to " + std::to_string(kMostSizes));
  std::vector<std::size_t> sizes;
  for (std::size_t i = 0; i < count; ++i) sizes.push_back(static_cast<std::size_t>(field[i].Integer(1, kLargestLayer)));
  return sizes;
}

Policy::Scaling ReadScaling(const Field& field, std::size_t count) {
  field.RequireFields({"offset", "scale"});
  return {field["offset"].Numbers(count), field["scale"].Numbers(count, 0)};
}

Policy::Layer ReadLayer(const Field& field, std::size_t width, std::size_t height) {
  field.RequireFields({"weight", "bias"});
  const Field weight = field["weight"];
  weight.RequireCount(height);
  Policy::Layer layer{Eigen::MatrixXd(height, width), field["bias"].Numbers(height)};
  for (std::size_t i = 0; i < height; ++i)
    layer.weight.row(static_cast<Eigen::Index>(i)) = weight[i].Numbers(width).transpose();
  return layer;
}

Policy Read(const Field& file) {
  file.RequireFields(
      {"format", "version", "model", "activation", "inputs", "steps", "sizes", "input", "output", "layers"});
  file["format"].RequireText(kFormat);
  static_cast<void>(file["version"].Integer(kVersion, kVersion));
  file["activation"].RequireText(kActivation);
  Policy policy;
  policy.model = file["model"].Text();
  policy.num_inputs = file["inputs"].Integer(1, kMaxInputs);
  const auto outputs = static_cast<std::size_t>(policy.num_inputs * file["steps"].Integer(1, kMaxSteps));
  const std::vector<std::size_t> sizes = ReadSizes(file["sizes"]);
  if (sizes.back() != outputs)
    file["sizes"].Fail("ends with " + std::to_string(sizes.back()) + ", has to end with inputs times steps, " +
                       std::to_string(outputs));
  policy.input = ReadScaling(file["input"], sizes.front());
  policy.output = ReadScaling(file["output"], outputs);
  const Field layers = file["layers"];
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
  for (const auto& [name, value] : head.items()) text += Json(name).dump() + ": " + value.dump() + ",\n";
  text += "\"layers\": [\n";
  for (const Policy::Layer& layer : policy.layers) {
    text += "{\"weight\": [\n";
    for (Eigen::Index i = 0; i < layer.weight.rows(); ++i)
      text += ToJson(Eigen::VectorXd(layer.weight.row(i))).dump() + (i + 1 < layer.weight.rows() ? ",\n" : "],\n");
    text += "\"bias\": " + ToJson(layer.bias).dump() + (&layer == &policy.layers.back() ? "}]\n" : "},\n");
  }
  return text + "}\n";
}

}  // namespace

Eigen::MatrixXd Policy::Act(const Eigen::VectorXd& features) const {
  Eigen::VectorXd h = (features - input.offset).cwiseQuotient(input.scale);
  for (const Layer& layer : layers) {
    h = (layer.weight * h + layer.bias).eval();
    if (&layer != &layers.back()) h = h.array().tanh();
  }
  h = output.offset + output.scale.cwiseProduct(h);
  return h.reshaped(num_inputs, num_steps());
}

Policy LoadPolicy(const std::string& path) {
  Json json;
  try {
    json = ParseJson<Json>(ReadWhole(path, kLargestJsonFile));
  } catch (const ConfigError& error) {
    throw PolicyError(error.what());
  } catch (const Json::exception& error) {
    throw PolicyError(path + ": " + error.what());
  }
  return Read(Field(path, "", json));
}

void SavePolicy(const std::string& path, const Policy& policy) {
  std::ofstream file(path);
  file << Lines(policy);
  file.close();
  if (!file) throw PolicyError(path + ": cannot be written");
}

}  // namespace forereach
