/** The air around a receiver with keys, on a simulated clock: it hands over what was signed by anyone, as it came. */
#pragma once

#include <cstdint>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "bus/authentic_bus.h"
#include "bus/bus_options.h"
#include "tests/keys.h"

namespace forereach {

/** What the receiver sends is not signed; what arrives goes through its screen. */
class ReceivingScreen final : public Screen {
 public:
  explicit ReceivingScreen(std::shared_ptr<Screen> screen) : screen_(std::move(screen)) {}

  std::optional<Bytes> Admit(const std::string& channel, Bytes raw) override {
    if (answers_.contains(channel)) return raw;
    return screen_->Admit(channel, raw);
  }
  [[nodiscard]] Refusals refusals() const override { return screen_->refusals(); }

  /** Channels of the receiver's own, for the test to hear. */
  std::set<std::string> answers_;

 private:
  const std::shared_ptr<Screen> screen_;
};

inline const std::string kAirName = "the air";

/** A bus of a receiver with the test's keys. @param answers channels on which the receiver speaks itself. */
inline std::unique_ptr<Bus> OpenAir(const Clock& clock, const std::vector<std::string>& answers) {
  auto screen = std::make_shared<ReceivingScreen>(MakeKeyScreen(TestKeys(), kAirName, BusOptions{}.speakers(), clock));
  screen->answers_ = {answers.begin(), answers.end()};
  return OpenBus("memq://", clock, screen);
}

/** A process that signs, with a sender id of its own. */
class Speaking final {
 public:
  Speaking(Bus& air, Role role, std::uint64_t id) : air_(&air), role_(role), signer_(TestKeys(), kAirName, id) {}

  /** Signs and sends it. @return the bytes as they were sent. */
  template <class Message>
  std::vector<std::uint8_t> Say(const std::string& channel, const Message& message, std::int64_t now_us) {
    std::vector<std::uint8_t> bytes = signer_.Sign(role_, channel, Encode(message), now_us);
    air_->Publish(channel, Bytes(bytes));
    return bytes;
  }

 private:
  Bus* air_;
  Role role_;
  Signer signer_;
};

}  // namespace forereach
