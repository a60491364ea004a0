#include "bus/authentic_bus.h"

#include <mutex>
#include <utility>

namespace forereach {
namespace {

// The receive thread calls Admit; another thread reads the counts.
class KeyScreen final : public Screen {
 public:
  explicit KeyScreen(Authenticator authenticator) : authenticator_(std::move(authenticator)) {}

  std::optional<Bytes> Admit(const std::string& channel, Bytes raw) override {
    const std::scoped_lock lock(mutex_);
    if (!authenticator_.IsSpoken(channel)) return raw;
    const auto [authenticity, message] = authenticator_.Check(channel, raw);
    return authenticity == Authenticity::kAuthentic ? std::optional(message) : std::nullopt;
  }
  [[nodiscard]] Refusals refusals() const {
    const std::scoped_lock lock(mutex_);
    return authenticator_.refusals();
  }

 private:
  mutable std::mutex mutex_;
  Authenticator authenticator_;
};

class SignedBus final : public Bus {
 public:
  SignedBus(const std::string& url, const KeyRing& keys, const std::string& bus_name, const Speakers& speakers,
            Clock clock)
      : keys_(keys),
        speakers_(speakers),
        clock_(std::move(clock)),
        signer_(keys, bus_name),
        // Its own first message may have the microsecond of its start.
        screen_(std::make_shared<KeyScreen>(Authenticator(keys, bus_name, speakers, clock_() - 1))),
        bus_(OpenBus(url, clock_, screen_)) {}

  void Subscribe(const std::string& channel, Handler handler) override { bus_->Subscribe(channel, std::move(handler)); }
  void SubscribeUnchecked(const std::string& channel, Handler handler) override {
    bus_->SubscribeUnchecked(channel, std::move(handler));
  }

  bool Publish(const std::string& channel, Bytes bytes) override {
    const auto speaker = speakers_.find(channel);
    if (speaker == speakers_.end()) return bus_->Publish(channel, bytes);
    if (!keys_.Holds(speaker->second)) return false;
    return bus_->Publish(channel, Bytes(signer_.Sign(speaker->second, channel, bytes, clock_())));
  }

  int Dispatch(int timeout_ms) override { return bus_->Dispatch(timeout_ms); }
  [[nodiscard]] std::int64_t dropped() const override { return bus_->dropped(); }
  [[nodiscard]] std::int64_t refused_dropped() const override { return bus_->refused_dropped(); }
  [[nodiscard]] Refusals refusals() const override { return screen_->refusals(); }
  [[nodiscard]] DatagramCounts datagrams() const override { return bus_->datagrams(); }

 private:
  const KeyRing keys_;
  const Speakers speakers_;
  const Clock clock_;
  Signer signer_;
  const std::shared_ptr<KeyScreen> screen_;
  const std::unique_ptr<Bus> bus_;
};

}  // namespace

std::unique_ptr<Bus> OpenSignedBus(const std::string& url, const KeyRing& keys, const std::string& bus_name,
                                   const Speakers& speakers, Clock clock) {
  return std::make_unique<SignedBus>(url, keys, bus_name, speakers, std::move(clock));
}

}  // namespace forereach
