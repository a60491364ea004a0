/** A gate that knows what the recorded one knew, for what is decided on recorded candidates again. */
#pragma once

#include <cstdint>
#include <memory>
#include <utility>

#include "certifier/gate/gate.h"
#include "records/timeline.h"

namespace forereach {

class GateFollower : public TimelineUser {
 public:
  void OnStart(const Config& task) override { gate_ = std::make_unique<Gate>(task); }
  void OnReload(const Config& task) override {
    const std::unique_ptr<Gate> before = std::exchange(gate_, std::make_unique<Gate>(task));
    gate_->Inherit(*before);
  }
  void OnObstacles(Bytes message, std::int64_t utime, SenderId sender) override {
    static_cast<void>(gate_->UpdateObstacles(message, utime, sender));
  }
  void OnTransition(const ExecutedTransition&, Bytes message) override { static_cast<void>(gate_->Learn(message)); }

 protected:
  /** @pre OnStart was called. */
  [[nodiscard]] Gate& gate() { return *gate_; }

 private:
  std::unique_ptr<Gate> gate_;
};

}  // namespace forereach
