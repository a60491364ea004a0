#include "logger/logger_node.h"

#include <algorithm>
#include <ostream>
#include <utility>

#include <fmt/core.h>

#include "forereach/logger_status_t.hpp"
#include "records/log_trust.h"

namespace forereach {
namespace {

constexpr std::size_t kMaxStreamsInOverflow = 256;

}  // namespace

LoggerNode::LoggerNode(const Config& config, Bus& bus, std::ostream& out, FreeSpace free_space)
    : channels_(config.bus),
      queue_size_(static_cast<std::size_t>(std::max(config.logger.queue, 1))),
      bus_(bus),
      out_(out),
      recorder_(config, std::move(free_space)),
      bus_dropped_(bus.dropped()),
      speakers_(recorder_.has_keys() ? channels_.speakers() : Speakers()),
      unsigned_bytes_per_us_(config.logger.unsigned_kb_per_s * 1e-3) {
  bus.SubscribeUnchecked(".*", [this](const Received& received) { Receive(received); });
}

void LoggerNode::Receive(const Received& received) {
  if (!speakers_.empty()) {
    const bool is_ours = speakers_.contains(received.channel),
               is_refused = received.bytes.empty() && !received.raw.empty();
    // Readers take the bus of a log from its first authentic message, so no refused message is recorded before it.
    if (is_ours && !is_refused) authentic_heard_ = true;
    if (is_refused && !authentic_heard_) return;
    if ((!is_ours || is_refused) && !MayTakeUnsigned(received.raw.size())) {
      if (!is_ours) ++unsigned_lost_;
      return;
    }
  }
  // Its own heartbeat is no sign that others are heard.
  if (received.channel != channels_.logger_status) last_heard_us_ = now_us_;
  if (queue_.size() < queue_size_) {
    queue_.push_back({-1, received.utime, received.channel, {received.raw.begin(), received.raw.end()}});
    return;
  }
  Stream stream = recorder_.interpreter().Identify(received.channel, WithoutSignature(received.raw)).first;
  // Anybody may invent streams; those beyond are counted together.
  if (overflow_.size() >= kMaxStreamsInOverflow && !overflow_.contains(stream)) stream = {"*", ""};
  ++overflow_[stream];
}

// The allowance grows with time, up to that of one second. If the clock is set back, it does not grow until the next
// message.
bool LoggerNode::MayTakeUnsigned(std::size_t bytes) {
  constexpr double kSecondUs = 1e6, kOverheadBytes = 1000;
  const auto elapsed = static_cast<double>(now_us_ - std::exchange(allowance_us_, now_us_));
  unsigned_allowance_ += std::clamp(elapsed, 0.0, kSecondUs) * unsigned_bytes_per_us_;
  unsigned_allowance_ = std::min(unsigned_allowance_, kSecondUs * unsigned_bytes_per_us_);
  const double cost = static_cast<double>(bytes) + kOverheadBytes;
  if (unsigned_allowance_ < cost) return false;
  unsigned_allowance_ -= cost;
  return true;
}

// The refusals of a signed bus; otherwise those found in the log.
Refusals LoggerNode::refusals() const {
  const Refusals refused = bus_.refusals();
  return refused.all() > 0 ? refused : recorder_.interpreter().refusals();
}

void LoggerNode::Tick(std::int64_t now_us) {
  now_us_ = now_us;
  if (!recorder_.begun()) {
    recorder_.Begin(now_us);
    last_heard_us_ = now_us;
  }
  const auto depth = static_cast<std::int64_t>(queue_.size());
  high_water_ = std::max(high_water_, queue_.size());
  Drain(now_us);
  recorder_.Tick(now_us);
  if (heartbeat_.IsOver(now_us)) SendStatus(now_us, depth);
}

void LoggerNode::Drain(std::int64_t now_us) {
  // Before the losses: what was queued had come before what found no room.
  for (; !queue_.empty(); queue_.pop_front()) recorder_.Take(std::move(queue_.front()), now_us);
  for (const auto& [stream, lost] : std::exchange(overflow_, {})) recorder_.Lose(stream, lost, now_us, "queue");
  if (unsigned_lost_ > 0) recorder_.Lose({"*", ""}, std::exchange(unsigned_lost_, 0), now_us, "unsigned");
  const std::int64_t dropped = bus_.dropped();
  if (dropped != bus_dropped_) recorder_.Lose({"*", ""}, dropped - bus_dropped_, now_us, "backlog");
  bus_dropped_ = dropped;
}

void LoggerNode::SendStatus(std::int64_t now_us, std::int64_t queue_depth) {
  heartbeat_.Start(now_us);
  const std::string trouble = recorder_.trouble(), silence = Silence(now_us);
  const std::string refused = DescribeRefusals(refusals());
  logger_status_t status{};
  status.utime = now_us;
  status.sequence = heartbeats_++;
  status.events_written = recorder_.written();
  status.events_lost = recorder_.lost();
  status.queue_depth = queue_depth;
  status.queue_high_water = static_cast<std::int64_t>(std::exchange(high_water_, 0));
  status.file_bytes = recorder_.file_bytes();
  status.log_bytes = recorder_.log_bytes();
  status.free_bytes = recorder_.free_bytes();
  status.flush_us = recorder_.flush_us();
  status.flush_worst_us = recorder_.TakeWorstFlushUs();
  status.state = !recorder_.recording()               ? logger_status_t::ERROR
                 : trouble.empty() && silence.empty() ? logger_status_t::OK
                                                      : logger_status_t::STALE;
  status.failed_flushes = static_cast<std::int16_t>(recorder_.failed_flushes());
  SetText(status.message, !trouble.empty()            ? trouble
                          : !silence.empty()          ? silence
                          : !recorder_.gone().empty() ? fmt::format("recording; {}", recorder_.gone())
                          : !refused.empty()          ? fmt::format("recording; not authentic: {}", refused)
                                                      : "recording");
  bus_.Publish(channels_.logger_status, status);
}

std::string LoggerNode::Silence(std::int64_t now_us) const {
  if (now_us - last_heard_us_ < kSilenceUs) return "";
  return fmt::format("recording, but nothing was heard for {:.1f} s",
                     static_cast<double>(now_us - last_heard_us_) * 1e-6);
}

void LoggerNode::Stop() {
  if (!recorder_.begun()) return;
  Drain(now_us_);
  recorder_.End(now_us_);
  out_ << "log                       " << recorder_.log_path();
  if (recorder_.files() > 1) out_ << ", the last of " << recorder_.files();
  out_ << "\ndatabase                  " << recorder_.database_path() << "\n" << ToText(recorder_.summary());
  if (!recorder_.gone().empty()) out_ << "gone                      " << recorder_.gone() << "\n";
  const std::string refused = DescribeRefusals(refusals());
  if (!refused.empty()) out_ << "not authentic             " << refused << "\n";
  out_ << std::flush;
}

}  // namespace forereach
