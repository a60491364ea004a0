#include "identify/cover_file.h"

#include <algorithm>
#include <fstream>
#include <utility>

#include <nlohmann/json.hpp>

#include "task/canonical.h"
#include "task/files.h"
#include "task/json_text.h"

namespace forereach {
namespace {

using Json = nlohmann::json;
using verifier::SlopeClaim;

Json TreeJson(const Cover& cover, int index, const std::vector<std::string>& names) {
  const Cover::Node& node = cover.nodes[static_cast<std::size_t>(index)];
  if (node.outside) return nullptr;
  if (node.argument < 0) return node.number;
  return Json::array({names[static_cast<std::size_t>(node.argument)], node.number, TreeJson(cover, node.below, names),
                      TreeJson(cover, node.above, names)});
}

int IndexOf(const std::vector<std::string>& names, const std::string& name) {
  const auto found = std::ranges::find(names, name);
  if (found == names.end()) throw ConfigError("the task has no {}", name);
  return static_cast<int>(found - names.begin());
}

Cover CoverOf(const Json& tree, const std::vector<std::string>& names) {
  Cover cover;
  cover.nodes.resize(1);
  // A stack of its own: a file may nest as deep as it likes.
  std::vector<std::pair<int, const Json*>> open{{0, &tree}};
  while (!open.empty()) {
    const auto [index, json] = open.back();
    open.pop_back();
    Cover::Node node;
    if (json->is_null()) {
      node.outside = true;
    } else if (json->is_number()) {
      node.number = json->get<double>();
    } else {
      node.argument = IndexOf(names, json->at(0).get<std::string>());
      node.number = json->at(1).get<double>();
      for (std::size_t part : {2, 3}) {
        if (part >= json->size()) continue;
        (part == 2 ? node.below : node.above) = static_cast<int>(cover.nodes.size());
        open.emplace_back(static_cast<int>(cover.nodes.size()), &json->at(part));
        cover.nodes.emplace_back();
      }
    }
    cover.nodes[static_cast<std::size_t>(index)] = node;
  }
  return cover;
}

void Append(CanonicalBytes& bytes, const Cover& cover) {
  std::vector<int> open{0};
  while (!open.empty()) {
    const int index = open.back();
    open.pop_back();
    if (index < 0) {
      // A tree that lacks a part has another digest than any that does not.
      bytes.Text("missing");
      continue;
    }
    const Cover::Node& node = cover.nodes[static_cast<std::size_t>(index)];
    bytes.Count(node.argument);
    bytes.Text(node.outside ? "outside" : "inside");
    bytes.Number(node.number);
    if (node.argument >= 0) open.insert(open.end(), {node.above, node.below});
  }
}

}  // namespace

std::vector<std::string> ArgumentNames(const Config& config) {
  std::vector<std::string> names = config.problem->model->variable_names();
  for (const auto& parameter : config.residual->names.parameters) names.push_back(parameter.name);
  return names;
}

nlohmann::json ResidualJson(const Config& config) {
  const ParametricResidual& residual = *config.residual;
  Json parameters = Json::object(), definitions = Json::object(), values = Json::object();
  for (const auto& [name, lower, upper] : residual.names.parameters) parameters[name] = {lower, upper};
  for (const auto& [name, value] : residual.names.definitions) definitions[name] = value.text;
  for (std::size_t k = 0; k < residual.values.size(); ++k) values[residual.names.states[k]] = residual.values[k].text;
  return {{"name", residual.name}, {"parameters", parameters}, {"let", definitions}, {"add", values}};
}

Digest ResidualDigest(const Config& config) {
  CanonicalBytes bytes("forereach residual");
  // The domain, too: a slope that holds in one says nothing of a larger one.
  bytes.Texts(ArgumentNames(config));
  const Domain& domain = config.problem->domain;
  for (const Box* box : {&domain.state, &domain.input}) {
    bytes.Numbers(box->lower());
    bytes.Numbers(box->upper());
  }
  bytes.Count(static_cast<std::int64_t>(domain.inequalities.size()));
  for (const auto& [coefficients, bound] : domain.inequalities) {
    bytes.Numbers(coefficients);
    bytes.Number(bound);
  }
  bytes.Count(static_cast<std::int64_t>(domain.balls.size()));
  for (const auto& [coordinates, center, radius] : domain.balls) {
    for (const int l : coordinates) bytes.Count(l);
    bytes.Numbers(center);
    bytes.Number(radius);
  }
  for (const auto& [name, lower, upper] : config.residual->names.parameters) {
    bytes.Number(lower);
    bytes.Number(upper);
  }
  bytes.Count(static_cast<std::int64_t>(config.residual->names.definitions.size()));
  for (const auto& [name, value] : config.residual->names.definitions) {
    bytes.Text(name);
    bytes.Text(value.text);
  }
  for (const auto& [text, line, column] : config.residual->values) bytes.Text(text);
  return bytes.digest();
}

Digest CoverDigest(const std::vector<SlopeClaim>& claims) {
  CanonicalBytes bytes("forereach cover");
  bytes.Count(static_cast<std::int64_t>(claims.size()));
  for (const SlopeClaim& claim : claims) {
    bytes.Count(claim.row);
    bytes.Count(claim.column);
    bytes.Number(claim.bound);
    Append(bytes, claim.cover);
  }
  return bytes.digest();
}

void SaveCover(const std::string& path, const Config& config, const std::vector<SlopeClaim>& claims) {
  const std::vector<std::string> names = ArgumentNames(config);
  Json entries = Json::array();
  for (const SlopeClaim& claim : claims)
    entries.push_back({{"row", names[static_cast<std::size_t>(claim.row)]},
                       {"column", names[static_cast<std::size_t>(claim.column)]},
                       {"bound", claim.bound},
                       {"cover", TreeJson(claim.cover, 0, names)}});
  const Json document{
      {"residual", ResidualJson(config)},
      {"entries", entries},
      {"digests", {{"residual", ToHex(ResidualDigest(config))}, {"cover", ToHex(CoverDigest(claims))}}}};
  std::ofstream file(path, std::ios::binary);
  if (!(file << JsonText(document) << "\n") || !file.flush()) throw ConfigError("{}: cannot be written", path);
}

CoverFile LoadCover(const std::string& path, const Config& config) {
  const std::string text = ReadWhole(path, kLargestJsonFile);
  const std::vector<std::string> names = ArgumentNames(config);
  CoverFile file;
  try {
    // A cover is a tree of cuts, which is deep where slopes are steep.
    const Json document = ParseJson(text, std::numeric_limits<int>::max());
    for (const Json& entry : document.at("entries"))
      file.claims.push_back({IndexOf(names, entry.at("row").get<std::string>()),
                             IndexOf(names, entry.at("column").get<std::string>()), entry.at("bound").get<double>(),
                             CoverOf(entry.at("cover"), names)});
    file.residual_digest = document.at("digests").at("residual").get<std::string>();
    file.cover_digest = document.at("digests").at("cover").get<std::string>();
  } catch (const Json::exception& error) {
    throw ConfigError("{}: not a cover of `forereach declare --cover`: it {}", path, DescribeJsonError(error));
  } catch (const ConfigError& error) {
    throw ConfigError("{}: not a cover for this task: {}", path, error.what());
  }
  return file;
}

}  // namespace forereach
