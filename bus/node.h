/** A process's inside: something that listens on a bus and acts as time passes. Each process runs one node on the
wall clock; a test or a one-process run drives several on a clock of its own. */
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "bus/bus.h"

namespace forereach {

class Node {
 public:
  virtual ~Node() = default;

  /** Called after each wait for messages, which lasts `kTickMs` milliseconds at most. `now_us`: microseconds since the
  Unix epoch, or a simulated clock. */
  virtual void Tick(std::int64_t now_us) = 0;

  /** True while work waits: Tick is then called again at once. */
  [[nodiscard]] virtual bool busy() const { return false; }

  /** The process got SIGHUP: read again what can change while it runs. */
  virtual void Reload() {}

  /** True once the node has nothing left to do; its process then ends. */
  [[nodiscard]] virtual bool done() const { return false; }

  /** Called once before the process ends: flush, close, print a summary. */
  virtual void Stop() {}

  /** Asked after Stop: whether its process ends with exit status 1, because something that it was there to keep is
  lost. */
  [[nodiscard]] virtual bool failed() const { return false; }
};

/** A node's way out: sends, and counts what the bus refused. */
class Sender final {
 public:
  explicit Sender(Bus& bus) : bus_(bus) {}

  /** False if the bus refused the message; it is then lost. */
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

/** From here on SIGTERM and SIGINT end RunNode instead of the process, and SIGHUP reloads. RunNode does it too; a
process that calls it first also ends cleanly if the signal comes while it starts. */
void CatchStopSignals();

/** Runs `node` on `bus` until it is done or the process gets SIGTERM or SIGINT, then stops it. */
void RunNode(Node& node, Bus& bus);

}  // namespace forereach
