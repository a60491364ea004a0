#include "certifier/process/certifier_node.h"

#include <algorithm>
#include <chrono>
#include <iostream>

#include <nlohmann/json.hpp>
#include <spdlog/spdlog.h>

namespace forereach {

CertifierNode::CertifierNode(const Config& config, Bus& bus)
    : channels_(config.bus), queue_size_(static_cast<std::size_t>(config.gate.queue)), sender_(bus), gate_(config) {
  if (const auto& violation = gate_.certifier().violation())
    spdlog::warn("observations {} and {} contradict the declaration: every candidate will be abstained from (F)",
                 violation->first, violation->second);
  if (gate_.certifier().uses_hull_distance())
    spdlog::warn("a row of the declaration has more than {} columns: set-to-sample distances are bounded over hulls",
                 LipschitzEnvelope::kMaxExactColumns);
  bus.Subscribe(channels_.candidate, [this](const Received& received) {
    queue_.push_back({true, {received.bytes.begin(), received.bytes.end()}});
    ++waiting_candidates_;
  });
  bus.Subscribe(channels_.obstacles, [this](const Received& received) {
    queue_.push_back({false, {received.bytes.begin(), received.bytes.end()}});
  });
}

void CertifierNode::Tick(std::int64_t now_us) {
  while (!queue_.empty()) {
    const Pending pending = std::move(queue_.front());
    queue_.pop_front();
    Work(pending, now_us, waiting_candidates_ > queue_size_);
    if (pending.is_candidate) --waiting_candidates_;
  }
  if (now_us >= next_heartbeat_us_) Heartbeat(now_us);
}

void CertifierNode::Work(const Pending& pending, std::int64_t now_us, bool displaced) {
  if (!pending.is_candidate) {
    const std::string error = gate_.UpdateObstacles(pending.bytes, now_us);
    if (!error.empty()) {
      ++refused_obstacles_;
      spdlog::warn("{}: refused, the obstacles in force stay: {}", channels_.obstacles, error);
    }
    return;
  }
  const auto begin = std::chrono::steady_clock::now();
  GateAnswer answer = displaced ? gate_.Displace(pending.bytes, now_us) : gate_.Decide(pending.bytes, now_us);
  const std::chrono::duration<double, std::micro> elapsed = std::chrono::steady_clock::now() - begin;
  answer.decision.elapsed_us = elapsed.count();

  if (answer.certified) sender_.Send(channels_.certified, *answer.certified);
  sender_.Send(channels_.decision, answer.decision);
  elapsed_us_[decided_++ % elapsed_us_.size()] = elapsed.count();
}

void CertifierNode::Heartbeat(std::int64_t now_us) {
  next_heartbeat_us_ = now_us + kHeartbeatUs;
  certifier_status_t status = gate_.Status(now_us);
  status.sequence = heartbeats_++;
  status.elapsed_p50_us = ElapsedPercentile(0.5);
  status.elapsed_p99_us = ElapsedPercentile(0.99);
  sender_.Send(channels_.status, status);
}

double CertifierNode::ElapsedPercentile(double fraction) const {
  const std::size_t count = std::min(decided_, elapsed_us_.size());
  if (count == 0) return 0;
  auto sorted = elapsed_us_;
  const auto at = sorted.begin() + static_cast<std::ptrdiff_t>(fraction * static_cast<double>(count - 1));
  std::nth_element(sorted.begin(), at, sorted.begin() + static_cast<std::ptrdiff_t>(count));
  return *at;
}

void CertifierNode::Stop() {
  const certifier_status_t status = gate_.Status(0);
  std::cout << nlohmann::json{{"candidates", status.candidates},
                              {"certified", status.certified},
                              {"abstained", {{"falsified", status.abstained_falsified},
                                             {"domain", status.abstained_domain},
                                             {"safety", status.abstained_safety}}},
                              {"rejected", status.rejected},
                              {"refused_obstacles", refused_obstacles_},
                              {"messages_not_sent", sender_.refused()},
                              {"elapsed_us", {{"p50", ElapsedPercentile(0.5)}, {"p99", ElapsedPercentile(0.99)}}}}
            << std::endl;
}

}  // namespace forereach
