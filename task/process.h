/** A process whose node is made of a task file. */
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "bus/process.h"
#include "task/config.h"

namespace forereach {

using MakeTaskNode = std::function<std::unique_ptr<Node>(const Config& config, Bus& bus)>;

/** RunProcess (bus/process.h) with LoadConfig. In the node's config, `bus` has the command line's URL and key, and the
keys that were read. */
inline int RunProcess(int argc, char** argv, const ProcessDescription& description, const MakeTaskNode& make_node,
                      std::vector<Option> options = {}) {
  Config config;
  const auto load = [&config](const std::string& path) -> BusOptions& {
    config = LoadConfig(path);
    return config.bus;
  };
  return RunProcess(
      argc, argv, description, load, [&](Bus& bus) { return make_node(config, bus); }, std::move(options));
}

}  // namespace forereach
