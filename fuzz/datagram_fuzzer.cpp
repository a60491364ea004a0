// A datagram of a stranger between two good ones, from the socket's buffer to the handlers. A datagram is a message
// exactly if LCM's format says so, written down here once more; what it is split into are its own bytes, all of them.
// Handlers get what the screen admits of messages on their channel, whole, once and in order, and the good messages
// whatever came between them. At most one of the causes is counted for each datagram.
#include <memory>
#include <optional>
#include <string>

#include "bus/datagram.h"
#include "bus/inbox.h"
#include "fuzz/fuzz.h"

namespace forereach {
namespace {

constexpr char kChannel[] = "ROBOT_STATE";
constexpr std::uint8_t kRefusedByScreen = 0xff;

// Cuts the last byte off, as if it were a signature; refuses by the first.
class CutScreen final : public Screen {
 public:
  std::optional<Bytes> Admit(const std::string&, Bytes raw) override {
    if (raw.empty() || raw.front() == kRefusedByScreen) return std::nullopt;
    return raw.first(raw.size() - 1);
  }
};

std::string TextOf(Bytes bytes) { return {bytes.begin(), bytes.end()}; }

// LCM's format once more: the channel and the payload, if it is a message.
std::optional<std::pair<std::string, std::string>> ByFormat(const std::string& datagram) {
  if (datagram.size() < 8 || datagram.substr(0, 4) != "LC02") return std::nullopt;
  const std::string rest = datagram.substr(8);
  const std::size_t zero = rest.find('\0');
  if (zero == std::string::npos || zero == 0 || zero > 63) return std::nullopt;
  for (std::size_t i = 0; i < zero; ++i)
    if (static_cast<unsigned char>(rest[i]) < 0x20 || static_cast<unsigned char>(rest[i]) > 0x7e) return std::nullopt;
  return {{rest.substr(0, zero), rest.substr(zero + 1)}};
}

class Receiver final {
 public:
  Receiver() {
    inbox_.Subscribe(
        kChannel, [this](const Received& r) { checked.push_back(TextOf(r.bytes)); }, false);
    inbox_.Subscribe(
        Bus::kEveryChannel, [this](const Received& r) { unchecked.push_back(TextOf(r.raw)); }, true);
  }

  Datagram Take(Bytes bytes) {
    const Datagram datagram = ParseDatagram(bytes);
    counts_.Count(datagram.kind);
    if (datagram.kind == DatagramKind::kMessage) inbox_.Put(datagram.channel, datagram.payload, 0);
    return datagram;
  }
  void HandOut() {
    inbox_.HandOut(0);
    Require(inbox_.dropped() == 0 && inbox_.refused_dropped() == 0);
  }
  [[nodiscard]] const DatagramCounts& counts() const { return counts_; }

  std::vector<std::string> checked, unchecked;

 private:
  Inbox inbox_{std::make_shared<CutScreen>()};
  DatagramCounts counts_;
};

}  // namespace

bool Try(Bytes data) {
  static const std::string good = std::string("LC02\0\0\0\7ROBOT_STATE\0good!", 25);
  const Bytes good_bytes(reinterpret_cast<const std::uint8_t*>(good.data()), good.size());
  const auto expected = ByFormat(TextOf(data));
  Receiver receiver;
  receiver.Take(good_bytes);
  const Datagram datagram = receiver.Take(data);
  receiver.Take(good_bytes);
  receiver.HandOut();

  Require((datagram.kind == DatagramKind::kMessage) == expected.has_value());
  Require(receiver.counts().messages == (expected ? 3 : 2) && receiver.counts().refused() == (expected ? 0 : 1));
  std::vector<std::string> checked{"good"}, unchecked{"good!"};
  if (expected) {
    const auto& [channel, payload] = *expected;
    Require(datagram.channel == channel && TextOf(datagram.payload) == payload);
    Require(datagram.payload.data() + datagram.payload.size() == data.data() + data.size());
    unchecked.push_back(payload);
    const bool admitted = !payload.empty() && static_cast<std::uint8_t>(payload[0]) != kRefusedByScreen;
    if (admitted && channel == kChannel) checked.push_back(payload.substr(0, payload.size() - 1));
  } else {
    Require(datagram.channel.empty() && datagram.payload.empty());
  }
  checked.push_back("good");
  unchecked.push_back("good!");
  Require(receiver.checked == checked && receiver.unchecked == unchecked);
  return expected.has_value();
}

}  // namespace forereach
