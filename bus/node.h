/** The main part of a process: it receives messages from a bus and acts as time passes. Each process runs one node on
the wall clock. A test or a one-process run drives several nodes on a simulated clock. */
#pragma once

#include <cstdint>
#include <string>

#include "bus/bus.h"

namespace forereach {

class Node {
 public:
  virtual ~Node() = default;

  /** Called after each wait for messages, at most every `kTickMs` milliseconds.
  @param now_us microseconds since the Unix epoch, or the time of a simulated clock. */
  virtual void Tick(std::int64_t now_us) = 0;

  /** True while work is pending; Tick is then called again at once. */
  [[nodiscard]] virtual bool busy() const { return false; }

  /** Called after SIGHUP: reads the configuration again. */
  virtual void Reload() {}

  /** True once the node has finished; its process then ends. */
  [[nodiscard]] virtual bool done() const { return false; }

  /** Called once before the process ends: flushes, closes, prints a summary. */
  virtual void Stop() {}

  /** Called after Stop. True if the process has to end with exit status 1, for example because data were lost. */
  [[nodiscard]] virtual bool failed() const { return false; }
};

/** Sends a node's messages and counts those that the bus refused. */
class Sender final {
 public:
  explicit Sender(Bus& bus) : bus_(bus) {}

  /** Sends a message. False if the bus refused it; the message is then lost. */
  template <class Message>
  bool Send(const std::string& channel, const Message& message) {
    const bool sent = bus_.Publish(channel, message);
    if (!sent) ++refused_;
    return sent;
  }

  [[nodiscard]] std::int64_t refused() const { return refused_; }

 private:
  Bus& bus_;
  std::int64_t refused_ = 0;
};

inline constexpr int kTickMs = 2;

/** Installs signal handlers: SIGTERM and SIGINT end RunNode instead of the process, and SIGHUP reloads. RunNode calls
it; a process that calls it earlier also ends cleanly if a signal arrives during its start. */
void CatchStopSignals();

/** Runs `node` on `bus` until it is done or the process gets SIGTERM or SIGINT, then stops it. Tells systemd, where it
started the process, when the node is ready and stops, and that its loop turns (sd_notify(3), WatchdogSec=). */
void RunNode(Node& node, Bus& bus);

}  // namespace forereach
