#include "bus/process.h"

#include <cstdlib>
#include <iostream>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "bus/authentic_bus.h"
#include "bus/log.h"
#include "bus/reloading.h"
#include "lcmtypes/printable.h"
#include "lcmtypes/why_failed.h"

namespace forereach {
namespace {

constexpr std::int64_t kSaysAgainAfterUs = 10'000'000;

// Runs a node, and warns of what comes from the network that is no message or no authentic one: when it begins, and at
// most every ten seconds while it goes on, since anybody on the network can send as much of it as he likes.
class DatagramWatch final : public Node {
 public:
  DatagramWatch(Node& node, const Bus& bus) : node_(node), bus_(bus) {}

  void Tick(std::int64_t now_us) override {
    node_.Tick(now_us);
    if (const std::int64_t now = SteadyClockUs(); now >= next_us_ && Say()) next_us_ = now + kSaysAgainAfterUs;
  }
  [[nodiscard]] bool busy() const override { return node_.busy(); }
  void Reload() override { node_.Reload(); }
  [[nodiscard]] bool done() const override { return node_.done(); }
  void Stop() override {
    Say();
    node_.Stop();
  }

 private:
  bool Say() {
    const bool says_datagrams = SayDatagrams(), says_refusals = SayRefusals();
    return says_datagrams || says_refusals;
  }
  bool SayRefusals() {
    const Refusals refused = bus_.refusals(), before = std::exchange(said_refused_, refused);
    if (refused.all() == before.all()) return false;
    std::string by_role;
    for (const auto& [role, of_role] : refused.by_role)
      by_role += fmt::format("; {}: {}", RoleName(role), DescribeRefusals(of_role.counts));
    const std::string clocks = DescribeClocks(refused, before);
    logging::Warn("from the network, since the start: messages that are not authentic and count for nothing: {}{}{}{}",
                  DescribeRefusals(refused), by_role,
                  clocks.empty() ? "" : "; set the clocks, or look for replays: ", clocks);
    return true;
  }
  bool SayDatagrams() {
    const DatagramCounts counts = bus_.datagrams();
    const std::int64_t amiss = counts.refused() + counts.lost_by_kernel + counts.receive_errors;
    if (amiss == std::exchange(said_, amiss)) return false;
    logging::Warn(
        "from the network, since the start: {} datagrams refused{}{}; {} lost to a full receive buffer; {} errors",
        counts.refused(), counts.refused() > 0 ? ": " : "", DescribeRefused(counts), counts.lost_by_kernel,
        counts.receive_errors);
    return true;
  }

  Node& node_;
  const Bus& bus_;
  Refusals said_refused_;
  std::int64_t said_ = 0, next_us_ = 0;
};

}  // namespace

int Guarded(const std::string& name, const std::function<int()>& body) {
  try {
    return body();
  } catch (const BadInput& error) {
    std::cerr << name << ": " << PrintableLines(error.what()) << std::endl;
    return kExitBadInput;
  } catch (const std::exception& error) {
    std::cerr << name << ": " << PrintableLines(WhyFailed(error)) << std::endl;
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

void BusArguments::AddTo(std::vector<Option>& options) {
  options.push_back({"--lcm-url", &url, "URL", "The bus; by default the task file's bus.url"});
  options.push_back(
      {"--key", &key, "PATH", "Directory of keys, or this role's key file; by default the task file's bus.key"});
}

void BusArguments::Override(BusOptions& options) const {
  if (!url.empty()) options.url = url;
  if (key.empty()) return;
  options.key = key;
  options.key_is_given = true;
}

int RunProcess(int argc, char** argv, const ProcessDescription& description, const LoadTask& load,
               const MakeNode& make_node, std::vector<Option> options) {
  std::string config_path;
  BusArguments bus_arguments;
  std::vector<Option> common{Required({"--config", &config_path, "FILE", "The task file (YAML)"})};
  bus_arguments.AddTo(common);
  options.insert(options.begin(), common.begin(), common.end());
  const Command program{
      .name = description.name,
      .purpose = description.purpose,
      .footer = fmt::format("Example:\n  {}\n\nThe keys of a task file are explained in config/README.md.",
                            description.example),
      .options = std::move(options)};
  if (const std::optional<int> code = ParseCommandLine(program, argc, argv)) return *code;
  SetUpLog(description.name);
  CatchStopSignals();
  const int code = Guarded(description.name, [&] {
    BusOptions& channels = load(config_path);
    bus_arguments.Override(channels);
    channels.keys = KeysOf(channels, description.role);
    const std::unique_ptr<Bus> bus = OpenBus(channels, description.role);
    const std::unique_ptr<Node> node = make_node(*bus);
    if (!channels.keys) logging::Warn(kUnsignedWarning);
    logging::Info("ready on {} with {}{}", channels.url, config_path,
                  channels.keys
                      ? fmt::format(", signed as the {} of {}", RoleName(description.role), channels.keys->robot())
                      : "");
    DatagramWatch watched(*node, *bus);
    RunNode(watched, *bus);
    return node->failed() ? 1 : 0;
  });
  if (reloads_under_way == 0) return code;
  // A thread that reads from a mount that stalls does not end, and may wake while static objects go.
  std::cout.flush();
  logging::Flush();
  std::_Exit(code);
}

}  // namespace forereach
