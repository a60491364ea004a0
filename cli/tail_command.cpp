#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include <fmt/format.h>

#include <unistd.h>

#include "bus/authentic.h"
#include "bus/bus_options.h"
#include "bus/node.h"
#include "bus/process.h"
#include "cli/commands.h"
#include "forereach/decision_t.hpp"
#include "lcmtypes/names.h"
#include "lcmtypes/printable.h"
#include "task/config.h"

namespace forereach {
namespace {

struct TailArguments {
  std::string config;
  BusArguments bus;
  std::int64_t count = 0;
};

// https://no-color.org
bool HasColor() {
  const char* const no_color = std::getenv("NO_COLOR");
  const char* const terminal = std::getenv("TERM");
  return isatty(STDOUT_FILENO) != 0 && !(no_color && *no_color) && !(terminal && std::string(terminal) == "dumb");
}

const char* ColorOf(std::int16_t outcome) {
  switch (outcome) {
    case decision_t::CERTIFIED: return "\x1b[32m";          // green
    case decision_t::ABSTAIN_SAFETY: return "\x1b[31m";     // red
    case decision_t::ABSTAIN_DOMAIN: return "\x1b[33m";     // yellow
    case decision_t::ABSTAIN_FALSIFIED: return "\x1b[35m";  // magenta
    default: return "\x1b[36m";                             // cyan: late, without obstacles, rejected
  }
}

// In UTC, with milliseconds.
std::string TimeOfDay(std::int64_t utime) {
  const std::int64_t ms = utime / 1000, of_day = (ms % 86'400'000 + 86'400'000) % 86'400'000;
  return fmt::format("{:02}:{:02}:{:02}.{:03}", of_day / 3'600'000, of_day / 60'000 % 60, of_day / 1000 % 60,
                     of_day % 1000);
}

// Prints decisions as they come. It sends nothing.
class Tail final : public Node {
 public:
  Tail(const BusOptions& channels, Bus& bus, std::int64_t count) : count_(count), has_color_(HasColor()) {
    const bool checks = channels.keys.has_value();
    bus.Subscribe(channels.decision, [this, checks](const Received& received) {
      const auto decision = Decoded<decision_t>(checks ? received.bytes : WithoutSignature(received.raw));
      if (!decision)
        ++undecodable_;
      else if (!done())
        Print(*decision, received.utime);
    });
  }

  void Tick(std::int64_t) override {}
  [[nodiscard]] bool done() const override { return count_ > 0 && decisions_ >= count_; }
  void Stop() override {
    std::cout << "tail: " << decisions_ << " decisions";
    const char* separator = ": ";
    for (const auto& [outcome, count] : by_outcome_) {
      std::cout << separator << count << " " << outcome;
      separator = ", ";
    }
    if (missed_ > 0) std::cout << "; " << missed_ << " missed";
    if (undecodable_ > 0) std::cout << "; " << undecodable_ << " messages on the channel were no decisions";
    std::cout << std::endl;
  }

 private:
  void Print(const decision_t& decision, std::int64_t utime) {
    if (last_sequence_ && decision.sequence > *last_sequence_)  // otherwise the certifier restarted
      missed_ += static_cast<std::uint64_t>(decision.sequence) - static_cast<std::uint64_t>(*last_sequence_) - 1;
    last_sequence_ = decision.sequence;
    ++decisions_;
    std::string outcome(OutcomeName(decision.outcome));
    const std::int64_t of_outcome = ++by_outcome_[outcome];
    outcome.resize(std::max<std::size_t>(outcome.size(), 17), ' ');
    std::cout << TimeOfDay(utime) << "  " << (has_color_ ? ColorOf(decision.outcome) : "") << outcome
              << (has_color_ ? "\x1b[0m" : "") << "  " << of_outcome << " of " << decisions_ << "  plan "
              << decision.plan_id << " of " << Printable(GetText(decision.source)) << "  "
              << Printable(GetText(decision.message)) << std::endl;
  }

  const std::int64_t count_;
  const bool has_color_;
  std::int64_t decisions_ = 0, undecodable_ = 0;
  std::uint64_t missed_ = 0;
  std::optional<std::int64_t> last_sequence_;
  std::map<std::string, std::int64_t> by_outcome_;
};

int RunTail(const TailArguments& options) {
  BusOptions channels;
  if (!options.config.empty()) channels = LoadConfig(options.config, TransitionsFile::kIgnore).bus;
  options.bus.Override(channels);
  channels.keys = PublicKeysOf(channels);
  if (!channels.keys) std::cerr << "forereach: warning: " << kUnsignedWarning << std::endl;
  CatchStopSignals();
  const std::unique_ptr<Bus> bus = OpenBus(channels, Role::kOperator);
  Tail tail(channels, *bus, options.count);
  std::cerr << "forereach: listening on " << channels.url << " (" << Printable(channels.decision) << ")" << std::endl;
  RunNode(tail, *bus);
  return 0;
}

}  // namespace

Command TailCommand() {
  const auto options = std::make_shared<TailArguments>();
  Command command{
      .name = "tail",
      .purpose = "Print each decision of the certifier as it comes, with running counts, until Ctrl-C; it only listens",
      .footer =
          "A line has the time (UTC), the outcome, how many of the decisions so far had it, the plan, and the "
          "sentence.\n"
          "Outcomes are coloured on a terminal, unless NO_COLOR is set. With a key only authentic decisions are shown; "
          "verify.pub is enough.\n\n"
          "Examples:\n  forereach tail\n  forereach tail --config config/demo.yaml",
      .options = {{"--config", &options->config, "FILE",
                   "The task file of the certifier, for its bus; by default the usual bus and channel"},
                  {"--count", &options->count, "", "End after this many decisions; 0: never", NumberRange{0, 1e15}}},
      .run = [options] { return RunTail(*options); }};
  options->bus.AddTo(command.options);
  return command;
}

}  // namespace forereach
