#include "lcmtypes/authentic_bus.h"

#include <deque>
#include <utility>

namespace forereach {
namespace {

class AuthenticBus final : public Bus {
 public:
  AuthenticBus(std::unique_ptr<Bus> bus, const Key256& key, const std::string& name, std::set<std::string> channels,
               Clock clock)
      : bus_(std::move(bus)),
        channels_(std::move(channels)),
        clock_(std::move(clock)),
        key_(key),
        begun_us_(clock_()),
        signer_(key, name, begun_us_) {}

  void Subscribe(const std::string& channel, Handler handler) override {
    if (!channels_.contains(channel)) return bus_->Subscribe(channel, std::move(handler));
    // Of its own, since each handler is to get the message once.
    Authenticator& authenticator = authenticators_.emplace_back(key_, begun_us_);
    bus_->Subscribe(channel, [&authenticator, handler = std::move(handler)](const Received& received) {
      const auto [authenticity, message] = authenticator.Check(received.channel, received.bytes);
      if (authenticity == Authenticity::kAuthentic) handler({received.channel, message, received.utime, received.bytes});
    });
  }

  void SubscribeUnchecked(const std::string& channel, Handler handler) override {
    bus_->SubscribeUnchecked(channel, std::move(handler));
  }

  bool Publish(const std::string& channel, Bytes bytes) override {
    if (!channels_.contains(channel)) return bus_->Publish(channel, bytes);
    return bus_->Publish(channel, Bytes(signer_.Sign(channel, bytes, clock_())));
  }

  int Dispatch(int timeout_ms) override { return bus_->Dispatch(timeout_ms); }
  [[nodiscard]] std::int64_t dropped() const override { return bus_->dropped(); }
  [[nodiscard]] DatagramCounts datagrams() const override { return bus_->datagrams(); }
  [[nodiscard]] Refusals refusals() const override {
    Refusals sum;
    for (const Authenticator& authenticator : authenticators_) sum += authenticator.refusals();
    return sum;
  }

 private:
  const std::unique_ptr<Bus> bus_;
  const std::set<std::string> channels_;
  const Clock clock_;
  const Key256 key_;
  const std::int64_t begun_us_;
  Signer signer_;
  std::deque<Authenticator> authenticators_;  // one for each subscription
};

}  // namespace

std::unique_ptr<Bus> Authenticate(std::unique_ptr<Bus> bus, const Key256& key, const std::string& name,
                                  std::set<std::string> protected_channels, Clock clock) {
  return std::make_unique<AuthenticBus>(std::move(bus), key, name, std::move(protected_channels), std::move(clock));
}

}  // namespace forereach
