#include "certifier/task/process.h"

#include <iostream>

#include <CLI/CLI.hpp>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include "certifier/task/key.h"
#include "lcmtypes/authentic_bus.h"

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

namespace {

std::unique_ptr<Bus> Open(const BusOptions& options, const std::optional<KeyRing>& keys, Clock clock) {
  if (!keys) return OpenBus(options.url, std::move(clock));
  return OpenSignedBus(options.url, *keys, options.bus_name(), options.speakers(), std::move(clock));
}

}  // namespace

std::unique_ptr<Bus> OpenBus(const BusOptions& options, Role role, Clock clock) {
  return Open(options, KeysOf(options, role), std::move(clock));
}

std::unique_ptr<Bus> OpenBusOfAllRoles(const BusOptions& options, Clock clock) {
  return Open(options, AllKeysOf(options), std::move(clock));
}

void BusArguments::AddTo(CLI::App& app) {
  app.add_option("--lcm-url", url, "The bus; by default the task file's bus.url")->type_name("URL");
  app.add_option("--key", key, "Directory of keys, or this role's key file; by default the task file's bus.key")
      ->type_name("PATH");
}

void BusArguments::Override(BusOptions& options) const {
  if (!url.empty()) options.url = url;
  if (key.empty()) return;
  options.key = key;
  options.key_is_given = true;
}

int RunProcess(int argc, char** argv, const ProcessDescription& description, const MakeNode& make_node,
               const std::function<void(CLI::App&)>& add_options) {
  CLI::App app(description.purpose, description.name);
  app.footer("Example:\n  " + description.example + "\n\nThe keys of a task file are explained in config/README.md.");
  std::string config_path;
  BusArguments bus_arguments;
  app.add_option("--config", config_path, "The task file (YAML)")->required()->type_name("FILE");
  bus_arguments.AddTo(app);
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
    Config config = LoadConfig(config_path);
    bus_arguments.Override(config.bus);
    config.bus = WithKeys(std::move(config.bus), description.role);
    const std::unique_ptr<Bus> bus = OpenBus(config.bus, description.role);
    const std::unique_ptr<Node> node = make_node(config, *bus);
    if (!config.bus.keys) spdlog::warn(kUnsignedWarning);
    spdlog::info("ready on {} with {}{}", config.bus.url, config_path,
                 config.bus.keys ? ", signed as the " + std::string(RoleName(description.role)) + " of " + config.bus.keys->robot()
                                 : "");
    RunNode(*node, *bus);
    return 0;
  });
}

}  // namespace forereach
