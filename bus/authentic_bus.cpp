#include "bus/authentic_bus.h"

#include <mutex>
#include <utility>

namespace forereach {
namespace {

// The receive thread calls Admit; other threads send and read the counts.
class KeyScreen final : public Screen {
 public:
  KeyScreen(const KeyRing& keys, const std::string& bus_name, const Speakers& speakers, Clock clock)
      : keys_(keys),
        speakers_(speakers),
        clock_(std::move(clock)),
        signer_(keys, bus_name),
        authenticator_(keys, bus_name, speakers, clock_() - 1) {}  // its first message may have this microsecond

  std::optional<Bytes> Admit(const std::string& channel, Bytes raw) override {
    const std::scoped_lock lock(mutex_);
    if (!authenticator_.IsSpoken(channel)) return raw;
    const auto [authenticity, message] = authenticator_.Check(channel, raw, clock_());
    return authenticity == Authenticity::kAuthentic ? std::optional(message) : std::nullopt;
  }
  std::optional<std::vector<std::uint8_t>> ToSend(const std::string& channel, Bytes message) override {
    const auto speaker = speakers_.find(channel);
    if (speaker == speakers_.end()) return Screen::ToSend(channel, message);
    if (!keys_.Holds(speaker->second)) return std::nullopt;
    return signer_.Sign(speaker->second, channel, message, clock_());
  }
  [[nodiscard]] Refusals refusals() const override {
    const std::scoped_lock lock(mutex_);
    return authenticator_.refusals();
  }

 private:
  const KeyRing keys_;
  const Speakers speakers_;
  const Clock clock_;
  Signer signer_;
  mutable std::mutex mutex_;  // of the next
  Authenticator authenticator_;
};

}  // namespace

std::shared_ptr<Screen> MakeKeyScreen(const KeyRing& keys, const std::string& bus_name, const Speakers& speakers,
                                      Clock clock) {
  return std::make_shared<KeyScreen>(keys, bus_name, speakers, std::move(clock));
}

std::unique_ptr<Bus> OpenSignedBus(const std::string& url, const KeyRing& keys, const std::string& bus_name,
                                   const Speakers& speakers, Clock clock) {
  const auto screen = MakeKeyScreen(keys, bus_name, speakers, clock);
  return OpenBus(url, std::move(clock), screen);
}

}  // namespace forereach
