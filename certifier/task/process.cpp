#include "certifier/task/process.h"

#include <iostream>

#include <CLI/CLI.hpp>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

namespace forereach {

int Guarded(const std::string& name, const std::function<int()>& body) {
  try {
    return body();
  } catch (const BadInput& error) {
    std::cerr << name << ": " << error.what() << std::endl;
    return kExitBadInput;
  } catch (const std::exception& error) {
    std::cerr << name << ": " << error.what() << std::endl;
    return 1;
  }
}

int RunProcess(int argc, char** argv, const ProcessDescription& description, const MakeNode& make_node,
               const std::function<void(CLI::App&)>& add_options) {
  CLI::App app(description.purpose, description.name);
  app.footer("Example:\n  " + description.example + "\n\nThe keys of a task file are explained in config/README.md.");
  std::string config_path, url;
  app.add_option("--config", config_path, "The task file (YAML)")->required()->type_name("FILE");
  app.add_option("--lcm-url", url, "The bus; by default the task file's bus.url")->type_name("URL");
  if (add_options) add_options(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kExitBadInput;
  }
  spdlog::set_default_logger(spdlog::stderr_color_mt(description.name));
  spdlog::set_pattern("%H:%M:%S.%e %n %^%l%$: %v");
  CatchStopSignals();
  return Guarded(description.name, [&] {
    const Config config = LoadConfig(config_path);
    const std::unique_ptr<Bus> bus = OpenBus(url.empty() ? config.bus.url : url);
    const std::unique_ptr<Node> node = make_node(config, *bus);
    spdlog::info("ready on {} with {}", url.empty() ? config.bus.url : url, config_path);
    RunNode(*node, *bus);
    return 0;
  });
}

}  // namespace forereach
