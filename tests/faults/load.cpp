#include "tests/faults/load.h"

#include <algorithm>
#include <chrono>
#include <stdexcept>

#include "bus/process.h"
#include "forereach/decision_t.hpp"

namespace forereach {
namespace {

constexpr std::int64_t kMostBehindUs = 50'000, kPatienceUs = 30'000'000, kQuietUs = 1'000'000;
constexpr int kClosingAtMost = 50;

}  // namespace

Load::Load(const Config& config, Make make)
    : config_(config), make_(std::move(make)), bus_(OpenBus(config.bus, Role::kPlanner)), base_id_(WallClockUs()) {
  bus_->Subscribe(config_.bus.decision, [this](const Received& r) { OnDecision(r); });
  bus_->Subscribe(config_.bus.status, [this](const Received& r) {
    if (const auto status = Decoded<certifier_status_t>(r.bytes)) status_ = *status;
  });
}

Load::~Load() {
  stop_ = true;
  if (sender_.joinable()) sender_.join();
}

void Load::Send() {
  candidate_plan_t candidate = make_(sent_);
  candidate.sequence = sent_;
  candidate.plan_id = base_id_ + sent_++;
  const std::int64_t lead = candidate.start_utime - candidate.utime;
  candidate.utime = WallClockUs();
  candidate.start_utime = candidate.utime + lead;
  bus_->Publish(config_.bus.candidate, candidate);
}

void Load::SendUntilStopped(double rate) {
  const auto period = static_cast<std::int64_t>(1e6 / rate);
  for (std::int64_t due = SteadyClockUs(); !stop_; due += period) {
    const std::int64_t now = SteadyClockUs();
    if (now - due > kMostBehindUs) due = now;
    if (now < due) {
      std::this_thread::sleep_for(std::chrono::microseconds(due - now));
      const std::scoped_lock lock(lateness_mutex_);
      lateness_.push_back(static_cast<double>(SteadyClockUs() - due));
    }
    Send();
  }
}

std::vector<double> Load::TakeLateness() {
  const std::scoped_lock lock(lateness_mutex_);
  return std::exchange(lateness_, {});
}

void Load::OnDecision(const Received& received) {
  const auto decision = Decoded<decision_t>(received.bytes);
  if (!decision) return;
  const std::int64_t number = decision->plan_id - base_id_;
  if (number < 0 || number >= sent_) return;
  if (decisions_++ == 0) first_decision_ = decision->sequence;
  last_decision_ = decision->sequence;
  if (IsAnswered(number)) {
    ++answered_again_;
    return;
  }
  const auto at = static_cast<std::size_t>(number);
  if (is_answered_.size() <= at) is_answered_.resize(2 * at + 1024);
  is_answered_[at] = true;
  ++answered_;
  latencies_.push_back(static_cast<double>(received.utime - decision->candidate_utime));
}

bool Load::IsAnswered(std::int64_t number) const {
  return static_cast<std::size_t>(number) < is_answered_.size() && is_answered_[static_cast<std::size_t>(number)];
}

void Load::Begin() {
  const std::int64_t end = SteadyClockUs() + kPatienceUs;
  for (; answered_ == 0; ListenUntil(SteadyClockUs() + kQuietUs)) {
    if (SteadyClockUs() > end) throw std::runtime_error("no candidate is answered");
    Send();
  }
  while (!IsAnswered(first_)) ++first_;
  static_cast<void>(TakeLatencies());
}

void Load::Start(double rate) {
  sender_ = std::thread([this, rate] { SendUntilStopped(rate); });
}

void Load::ListenUntil(std::int64_t steady_us) {
  for (std::int64_t now = SteadyClockUs(); now < steady_us; now = SteadyClockUs())
    bus_->Dispatch(static_cast<int>(std::clamp<std::int64_t>((steady_us - now) / 1000, 1, 100)));
}

void Load::Finish() {
  stop_ = true;
  sender_.join();
  const std::int64_t end = SteadyClockUs() + kPatienceUs;
  const auto listen_until_quiet = [&] {
    for (std::int64_t before = -1; answered_ != before && SteadyClockUs() < end;) {
      before = answered_;
      ListenUntil(SteadyClockUs() + kQuietUs);
    }
  };
  listen_until_quiet();
  for (int i = 0; i < kClosingAtMost && !IsAnswered(sent_ - 1); ++i) {  // a loss shows by what comes behind it
    Send();
    listen_until_quiet();
  }
  const std::int64_t heard = status_.sequence;
  while (status_.sequence < heard + 2 && SteadyClockUs() < end + kPatienceUs)
    ListenUntil(SteadyClockUs() + kQuietUs / 10);
}

double Percentile(std::vector<double>& values, double fraction) {
  if (values.empty()) return 0;
  std::ranges::sort(values);
  return values[static_cast<std::size_t>(fraction * static_cast<double>(values.size() - 1))];
}

}  // namespace forereach
