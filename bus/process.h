/** What every ForeReach process does around its node: arguments, task, bus, clean end. */
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "bus/bus_options.h"
#include "bus/node.h"
#include "command_line/command_line.h"

namespace forereach {

struct ProcessDescription {
  std::string name;     ///< "forereach-certifier"
  std::string purpose;  ///< What it does, in a sentence or two.
  std::string example;  ///< A command line to type.
  Role role;            ///< The role under which it sends.
};

/** Reads a task file. @return the options of its bus, which stay with the caller. @throws BadInput. */
using LoadTask = std::function<BusOptions&(const std::string& path)>;
using MakeNode = std::function<std::unique_ptr<Node>(Bus& bus)>;

/** The bus of a task. Where the task has a key, it signs what this role sends and hands out authentic messages only.
@throws BusError, KeyError. */
[[nodiscard]] std::unique_ptr<Bus> OpenBus(const BusOptions& options, Role role, Clock clock = WallClockUs);
/** The same for one program that speaks as every role. */
[[nodiscard]] std::unique_ptr<Bus> OpenBusOfAllRoles(const BusOptions& options, Clock clock = WallClockUs);

/** `--lcm-url URL` and `--key PATH`, which take precedence over the task file. */
struct BusArguments {
  std::string url, key;
  void AddTo(std::vector<Option>& options);
  void Override(BusOptions& options) const;
};

/** Runs a node as a process with `--config FILE`, `--lcm-url URL` and `--key PATH` until it is done or gets SIGTERM or
SIGINT.
@param load is called once. RunProcess then sets the command line's URL and key, and the keys, in the options that it
returned. @param make_node is called after that, with the bus. @param options the process's own options, if any.
@return 0, or 2 after one line on standard error that says what is wrong with arguments, config or bus; 1 on any other
error. */
int RunProcess(int argc, char** argv, const ProcessDescription& description, const LoadTask& load,
               const MakeNode& make_node, std::vector<Option> options = {});

/** Runs `body` and turns its exceptions into exit codes, after one line: 2 for BadInput, 1 for others. */
int Guarded(const std::string& name, const std::function<int()>& body);

}  // namespace forereach
