#include <arpa/inet.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <sstream>
#include <vector>

#include <fmt/core.h>
#include <nlohmann/json.hpp>

#include "bus/authentic.h"
#include "bus/bus.h"
#include "bus/bus_options.h"
#include "bus/descriptor.h"
#include "bus/process.h"
#include "bus/udp_receiver.h"
#include "cli/commands.h"
#include "cli/step_times.h"
#include "forereach/obstacles_t.hpp"
#include "forereach/robot_state_t.hpp"
#include "forereach/transition_t.hpp"
#include "lcmtypes/codec.h"
#include "task/config.h"
#include "task/json_text.h"
#include "task/step_time.h"

namespace forereach {
namespace {

constexpr int kRoundTrips = 500;
constexpr std::size_t kRoundTripBytes = 2048;
// Installed beside bin/, or in the tree that this was built in.
std::string ReadyCommand() {
  std::error_code error;
  const std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe", error);
  const std::filesystem::path installed = self.parent_path().parent_path() / "libexec/forereach/ready-bus";
  return std::filesystem::exists(installed, error) ? installed.string() : "scripts/ready-bus";
}

struct Check {
  std::string name;
  bool good;
  std::string found;
  std::string advice;    // what to do if it is not good
  bool warning = false;  // it is not good, and the bus works all the same
};

Check CheckLoopback() {
  const Descriptor socket(::socket(AF_INET, SOCK_DGRAM, 0));
  ifreq request{};
  std::copy_n("lo", 3, request.ifr_name);
  const bool up = ioctl(socket.get(), SIOCGIFFLAGS, &request) == 0 && (request.ifr_flags & IFF_UP);
  return {"loopback interface", up, up ? "up" : "down", fmt::format("{}, or: ip link set lo up", ReadyCommand())};
}

// The interface of the most specific route to `group`, empty if there is none. The kernel's table has addresses and
// masks in hexadecimal, in network order as this machine reads it.
std::string InterfaceOfRoute(const std::string& group) {
  in_addr address{};
  inet_pton(AF_INET, group.c_str(), &address);
  std::ifstream table("/proc/net/route");
  std::string line, interface;
  std::getline(table, line);  // the header
  std::uint32_t longest_mask = 0;
  while (std::getline(table, line)) {
    std::istringstream row(line);
    std::string name, gateway;
    std::uint32_t destination = 0, mask = 0;
    int flags = 0, references = 0, use = 0, metric = 0;
    row >> name >> std::hex >> destination >> gateway >> flags >> std::dec >> references >> use >> metric >> std::hex >>
        mask;
    if (!row || (address.s_addr & mask) != destination || ntohl(mask) < longest_mask) continue;
    interface = name;
    longest_mask = ntohl(mask);
  }
  return interface;
}

Check CheckRoute(const std::string& group) {
  const std::string interface = InterfaceOfRoute(group);
  return {fmt::format("multicast route to {}", group), interface == "lo",
          interface.empty() ? "none" : fmt::format("by {}", interface),
          fmt::format("{}, or: ip route add 224.0.0.0/4 dev lo", ReadyCommand())};
}

Check CheckBuffer() {
  const long bytes = GrantedReceiveBufferBytes();
  return {"receive buffer limit", bytes >= kReceiveBufferBytes, fmt::format("{} bytes", bytes),
          fmt::format("a burst of plans may be lost; as root: sysctl -w net.core.rmem_max={}", kReceiveBufferBytes)};
}

Check CheckRoundTrip(const std::string& url) {
  const std::string channel = "FOREREACH_DOCTOR_" + std::to_string(getpid());
  std::vector<double> times_us;
  try {
    const auto sender = OpenBus(url), receiver = OpenBus(url);
    bool arrived = false;
    receiver->Subscribe(channel, [&](const Received&) { arrived = true; });
    const std::vector<std::uint8_t> bytes(kRoundTripBytes);
    for (int i = 0; i < kRoundTrips; ++i) {
      arrived = false;
      const auto begin = std::chrono::steady_clock::now();
      sender->Publish(channel, Bytes(bytes));
      for (int waits = 0; waits < 20 && !arrived; ++waits) receiver->Dispatch(5);
      if (arrived)
        times_us.push_back(std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - begin).count());
    }
  } catch (const BusError& error) {
    return {fmt::format("round trip on {}", url), false, "no bus", error.what()};
  }
  std::ranges::sort(times_us);
  const auto at = [&](double fraction) {
    return std::to_string(
        std::lround(times_us[static_cast<std::size_t>(fraction * static_cast<double>(times_us.size() - 1))]));
  };
  const std::string count = fmt::format("{} of {} arrived", times_us.size(), kRoundTrips);
  if (times_us.empty())
    return {fmt::format("round trip on {}", url), false, count, "is multicast filtered by a firewall?"};
  return {fmt::format("round trip on {}", url), times_us.size() == kRoundTrips,
          fmt::format("{}, p50 {} us, p99 {} us", count, at(0.5), at(0.99)),
          "messages are lost: raise the receive buffer limit, see above"};
}

// All files of a directory of keys that are there.
std::string RolesIn(const std::string& path) {
  std::string roles;
  for (const Role role : kAllRoles) {
    const std::string file = path + "/" + std::string(RoleName(role)) + ".key";
    if (!std::filesystem::exists(file)) continue;
    // A file that the role's process would refuse is told here.
    static_cast<void>(LoadKeys(file, role));
    roles += (roles.empty() ? "" : ", ") + std::string(RoleName(role));
  }
  return roles.empty() ? "" : fmt::format("; secrets of {}", roles);
}

Check CheckKeys(const BusOptions& bus) {
  if (bus.key.empty())
    return {"keys", false, kUnsignedWarning,
            "forereach keygen --robot NAME DIR, then --key DIR for every process, or bus.key in the task file", true};
  try {
    const KeyRing keys = LoadPublicKeys(bus.key);
    return {"keys", true,
            fmt::format("{} of robot {}, for bus {}{}", bus.key, keys.robot(), bus.bus_name(), RolesIn(bus.key)), ""};
  } catch (const KeyError& error) {
    return {"keys", false, error.what(), "no process starts with it"};
  }
}

// Hears what a robot and perception send, and sends nothing.
StepTimes Listen(const Config& config, BusOptions channels, double seconds) {
  channels.keys = PublicKeysOf(channels);
  const std::unique_ptr<Bus> bus = OpenBus(channels, Role::kOperator);
  StepTimes times(StepUs(config));
  const auto bytes = [&](const Received& received) {
    // Without keys here, the robot may sign all the same: times are only measured, and nothing rests on them.
    return channels.keys ? received.bytes : WithoutSignature(received.raw);
  };
  bus->Subscribe(channels.transition, [&](const Received& received) {
    if (const auto step = Decoded<transition_t>(bytes(received))) times.HearStep(step->utime, step->duration_us);
  });
  bus->Subscribe(channels.robot_state, [&](const Received& received) {
    if (const auto state = Decoded<robot_state_t>(bytes(received))) times.HearStamp(state->utime, received.utime);
  });
  bus->Subscribe(channels.obstacles, [&](const Received& received) {
    if (const auto seen = Decoded<obstacles_t>(bytes(received))) times.HearStamp(seen->utime, received.utime);
  });
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  while (std::chrono::steady_clock::now() < end) bus->Dispatch(50);
  return times;
}

int Measure(const Config& config, const BusOptions& bus, double seconds, bool json) {
  const StepTimes times = Listen(config, bus, seconds);
  const auto step = times.StepErrorMs(), clocks = times.ClockErrorMs(bus.delay_ms);
  if (json)
    std::cout << JsonText({{"seconds", seconds},
                           {"steps", times.steps()},
                           {"step_error_us", times.step_error_us()},
                           {"stamps", times.stamps()},
                           {"least_delay_us", times.least_delay_us()},
                           {"largest_delay_us", times.largest_delay_us()},
                           {"margin", StepTimes::kMargin},
                           {"robot.step_error_ms", step ? nlohmann::json(*step) : nlohmann::json(nullptr)},
                           {"gate.max_clock_error_ms", clocks ? nlohmann::json(*clocks) : nlohmann::json(nullptr)}})
              << std::endl;
  else
    std::cout << times.Text(seconds, bus.delay_ms) << std::flush;
  return step && clocks ? 0 : 1;
}

int Diagnose(const BusOptions& bus, bool json) {
  const std::string& url = bus.url;
  const std::map<std::string, std::string> versions{
      {"forereach", FOREREACH_VERSION},
      {"lcm", BusVersion()},
      {"compiler", __VERSION__},
      {"eigen", fmt::format("{}.{}.{}", EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION)}};
  const std::vector<Check> checks{CheckLoopback(), CheckRoute(ParseMulticastUrl(url).group), CheckBuffer(),
                                  CheckRoundTrip(url), CheckKeys(bus)};
  const bool good = std::ranges::all_of(checks, [](const Check& check) { return check.good || check.warning; });
  if (json) {
    nlohmann::json document{{"good", good}, {"versions", versions}, {"checks", nlohmann::json::array()}};
    for (const Check& check : checks)
      document["checks"].push_back({{"name", check.name},
                                    {"good", check.good},
                                    {"warning", check.warning},
                                    {"found", check.found},
                                    {"advice", check.good ? nlohmann::json(nullptr) : nlohmann::json(check.advice)}});
    std::cout << JsonText(document) << std::endl;
  } else {
    for (const auto& [name, version] : versions) std::cout << "      " << name << " " << version << "\n";
    for (const Check& check : checks) {
      std::cout << (check.good      ? "good  "
                    : check.warning ? "WARN  "
                                    : "BAD   ")
                << check.name << ": " << check.found << "\n";
      if (!check.good) std::cout << "      -> " << check.advice << "\n";
    }
    std::cout << (good ? "The bus is ready." : "The bus is not ready: do what the arrows say.") << std::endl;
  }
  return good ? 0 : 1;
}

}  // namespace

Command DoctorCommand() {
  struct DoctorArguments {
    std::string config;
    BusArguments bus;
    double listen = 0;
    bool json = false;
  };
  const auto options = std::make_shared<DoctorArguments>();
  Command command{.name = "doctor",
                  .purpose = "Check the bus (route, buffers, a round trip), and print what to do",
                  .options = {{"--config", &options->config, "FILE", "A task file, to check its bus and its keys"},
                              {"--listen", &options->listen, "SECONDS",
                               "Instead measure for so long how far a driving robot's steps are from their times and "
                               "stamps from their arrival, and propose robot.step_error_ms and gate.max_clock_error_ms",
                               NumberRange{0, 1e6}},
                              JsonFlag(options->json)},
                  .run = [options] {
                    if (options->listen > 0 && options->config.empty())
                      throw ConfigError("--listen needs the task of the robot: give --config");
                    const Config config =
                        options->config.empty() ? Config() : LoadConfig(options->config, TransitionsFile::kIgnore);
                    BusOptions bus = config.bus;
                    options->bus.Override(bus);
                    return options->listen > 0 ? Measure(config, bus, options->listen, options->json)
                                               : Diagnose(bus, options->json);
                  }};
  options->bus.AddTo(command.options);
  return command;
}

}  // namespace forereach
