#include "tests/faults/relay.h"

#include <algorithm>

namespace forereach {

Relay::Relay(const std::string& from, const std::string& to, std::set<std::string> there, unsigned seed)
    : from_(OpenBus(from)), to_(OpenBus(to)), there_(std::move(there)), random_(seed) {
  from_->Subscribe(".*", [this](const Received& r) {
    if (there_.contains(r.channel)) Take(*to_, r);
  });
  to_->Subscribe(".*", [this](const Received& r) {
    if (!there_.contains(r.channel)) Take(*from_, r);
  });
}

void Relay::Take(Bus& to, const Received& received) {
  std::vector<std::uint8_t> bytes(received.bytes.begin(), received.bytes.end());
  std::int64_t due = 0;
  int times = 1;
  if (Happens(weather_.drop)) times = 0;
  if (Happens(weather_.repeat)) times = 2;
  if (Happens(weather_.corrupt) && !bytes.empty())
    bytes[random_() % bytes.size()] ^= static_cast<std::uint8_t>(1u << random_() % 8);
  if (Happens(weather_.delay)) due = SteadyClockUs() + weather_.delay_ms * 1000;
  if (Happens(weather_.swap)) due = SteadyClockUs() + 5000;  // what comes next overtakes it
  if (times != 1 || due != 0 || !std::ranges::equal(bytes, received.bytes)) ++spoiled_;
  for (; times > 0; --times) {
    if (due == 0)
      to.Publish(received.channel, Bytes(bytes));
    else
      late_.push_back({&to, received.channel, bytes, due});
  }
}

void Relay::Pass() {
  from_->Dispatch(0);
  to_->Dispatch(0);
  const std::int64_t now = SteadyClockUs();
  for (std::size_t i = 0; i < late_.size();) {
    if (late_[i].due_us > now) {
      ++i;
      continue;
    }
    late_[i].to->Publish(late_[i].channel, Bytes(late_[i].bytes));
    late_.erase(late_.begin() + static_cast<std::ptrdiff_t>(i));
  }
}

}  // namespace forereach
