#include "bus/inbox.h"

#include <algorithm>
#include <chrono>
#include <exception>
#include <functional>
#include <optional>
#include <stdexcept>
#include <utility>

#include <malloc.h>

namespace forereach {
namespace {

constexpr std::size_t kBurstBytes = std::size_t{1} << 20;

// The offset of `part` in `whole`.
std::size_t OffsetIn(Bytes whole, Bytes part) {
  const std::less_equal<const std::uint8_t*> in_order;
  if (!in_order(whole.data(), part.data()) || !in_order(part.data() + part.size(), whole.data() + whole.size()))
    throw std::invalid_argument("Screen::Admit: the returned bytes are not a part of the message");
  return static_cast<std::size_t>(part.data() - whole.data());
}

}  // namespace

void Inbox::Subscribe(const std::string& channel, Bus::Handler handler, bool unchecked) {
  const std::lock_guard lock(mutex_);
  subscriptions_.push_back({channel, std::move(handler), unchecked});
}

Inbox::Subscriptions Inbox::Wanting(std::string_view channel) {
  const std::lock_guard lock(mutex_);
  Subscriptions wanting;
  for (const Subscription& subscription : subscriptions_)
    if (subscription.channel == channel || subscription.channel == Bus::kEveryChannel) wanting.push_back(&subscription);
  return wanting;
}

void Inbox::Put(std::string_view channel, Bytes raw, std::int64_t utime) noexcept try {
  Subscriptions wanting = Wanting(channel);
  if (wanting.empty()) return;
  Stored stored{0, std::string(channel), {}, 0, 0, utime, {}, {}};
  const std::optional<Bytes> message = screen_ ? screen_->Admit(stored.channel, raw) : raw;
  if (message && !message->empty()) {
    stored.message_begin = OffsetIn(raw, *message);
    stored.message_bytes = message->size();
    if (message->size() < raw.size()) stored.sender = SenderOf(raw);  // otherwise no signature was looked at
  }
  if (!message) std::erase_if(wanting, [](const Subscription* subscription) { return !subscription->unchecked; });
  if (wanting.empty()) return;
  stored.raw.assign(raw.begin(), raw.end());
  stored.for_whom = std::move(wanting);
  {
    const std::lock_guard lock(mutex_);
    stored.number = next_number_++;
    (message ? admitted_ : refused_).Push(std::move(stored));
  }
  arrived_.notify_one();
} catch (...) {  // out of memory: the receive thread goes on without this message
  ++admitted_.dropped;
}

// Discards the oldest messages if the queue is full.
void Inbox::Queue::Push(Stored stored) {
  bytes += stored.raw.size();
  messages.push_back(std::move(stored));
  while (messages.size() > max_messages || bytes > max_bytes) {
    bytes -= messages.front().raw.size();
    messages.pop_front();
    ++dropped;
  }
}

int Inbox::HandOut(int timeout_ms) {
  std::deque<Stored> admitted, refused;
  std::size_t bytes = 0;
  {
    std::unique_lock lock(mutex_);
    if (timeout_ms > 0)  // a wait of no time costs a switch of threads
      arrived_.wait_for(lock, std::chrono::milliseconds(timeout_ms),
                        [this] { return !admitted_.messages.empty() || !refused_.messages.empty(); });
    admitted.swap(admitted_.messages);
    refused.swap(refused_.messages);
    bytes = std::exchange(admitted_.bytes, 0) + std::exchange(refused_.bytes, 0);
  }
  // Handlers run without the lock, so they may send, and messages may arrive. Both queues are merged by arrival.
  int calls = 0;
  std::exception_ptr failure;
  for (auto a = admitted.begin(), r = refused.begin(); a != admitted.end() || r != refused.end();) {
    const bool next_is_admitted = r == refused.end() || (a != admitted.end() && a->number < r->number);
    const Stored& stored = next_is_admitted ? *a++ : *r++;
    const Bytes raw(stored.raw);
    for (const Subscription* subscription : stored.for_whom) {
      ++calls;
      try {
        subscription->handler({stored.channel, raw.subspan(stored.message_begin, stored.message_bytes), stored.utime,
                               raw, stored.sender});
      } catch (...) {
        // One handler's failure must not cost the others their messages. The last one is thrown at the end.
        failure = std::current_exception();
      }
    }
  }
  is_in_burst_ = bytes > kBurstBytes;
  was_in_burst_ = was_in_burst_ || is_in_burst_;
  if (failure) std::rethrow_exception(failure);
  return calls;
}

bool Inbox::has_waiting() const {
  const std::lock_guard lock(mutex_);
  return !admitted_.messages.empty();
}

void Inbox::GiveBack() {
  if (!is_in_burst_ && std::exchange(was_in_burst_, false)) ::malloc_trim(0);
}

}  // namespace forereach
