#include "certifier/process/status_reporter.h"

#include <algorithm>
#include <utility>

#include <fmt/core.h>
#include <nlohmann/json.hpp>

#include "forereach/decision_t.hpp"
#include "lcmtypes/names.h"
#include "task/json_text.h"

namespace forereach {

void StatusReporter::HurryToOthers() { next_us_ = std::min(next_us_, last_us_ + kToOthersUs); }

void StatusReporter::Restart() {
  reports_ = 0;
  decided_ = 0;
}

bool StatusReporter::IsContradicted(const Gate& gate) const {
  return gate.certifier().violation() || parts_.contradictions.ContradictInForce();
}

std::int16_t StatusReporter::State() const {
  switch (parts_.charge.state()) {
    case Charge::State::kListening: return certifier_status_t::LISTENING;
    case Charge::State::kStandingBy: return certifier_status_t::STANDBY;
    case Charge::State::kInCharge: break;
  }
  return static_cast<std::int16_t>(parts_.watch.state());
}

std::int16_t StatusReporter::Level(const Gate& gate) const {
  if (IsInCharge() && (parts_.watch.fault() || IsContradicted(gate) || !parts_.latch.ready()))
    return certifier_status_t::ERROR;
  return State() == certifier_status_t::ARMED ? certifier_status_t::OK : certifier_status_t::STALE;
}

std::string StatusReporter::WhyNotOk(const Gate& gate) const {
  const Watch& watch = parts_.watch;
  if (!IsInCharge()) return watch.Lacks(Watch::Need::kCharge);
  if (watch.fault())
    return fmt::format("{}: {}{}", FaultName(watch.fault()->cause),
                       parts_.latch.ready() ? "" : "not stored, lost by a restart! ", watch.fault()->why);
  if (!parts_.latch.ready()) return watch.WhyNot()->why;
  if (IsContradicted(gate))
    return "the observations contradict the declaration: every candidate is F until a larger bound is reloaded; a "
           "reset does not help";
  if (!parts_.reload.error().empty()) return fmt::format("the last reload failed: {}", parts_.reload.error());
  if (const auto refusal = watch.WhyNot()) return refusal->why;
  if (const auto& other = parts_.charge.other())
    return fmt::format("another certifier, instance {:016x}, is on this bus and decides nothing", other->instance);
  if (gate.options().obstacles == ObstaclesSource::kBus) return "";
  return fmt::format("gate.obstacles is task: the {} of the task file are all there are{}", gate.obstacles().size(),
                     counts.obstacles_refused ? fmt::format("; {} is refused", parts_.channels.obstacles) : "");
}

void StatusReporter::AddBusCounts(certifier_status_t& status) const {
  status.messages_refused = counts.refused;
  status.messages_not_sent = parts_.sender.refused();
  status.bus_dropped = parts_.bus.dropped();
  status.datagrams_refused = parts_.bus.datagrams().refused();
  const Refusals refusals = parts_.bus.refusals();
  status.refused_unsigned = refusals.unsigned_ones;
  status.refused_forged = refusals.forged;
  status.refused_foreign = refusals.foreign;
  status.is_unsigned = parts_.channels.keys ? 0 : 1;
  status.refused_replayed = refusals.replayed + refusals.old + refusals.ahead;
}

certifier_status_t StatusReporter::Report(const Gate& gate, std::int64_t now_us, std::int64_t steady_us) {
  last_us_ = steady_us;
  next_us_ = last_us_ + (parts_.charge.state() == Charge::State::kListening ? kToOthersUs : kPeriodUs);
  certifier_status_t status = gate.Status(now_us);
  status.sequence = IsInCharge() ? reports_++ : reports_aside_++;
  status.instance = parts_.charge.self().instance;
  status.started_utime = parts_.charge.self().started_utime;
  status.other_instance = parts_.charge.other() ? parts_.charge.other()->instance : 0;
  status.state = State();
  status.level = Level(gate);
  status.by_cause[decision_t::CAUSE_SECOND_CERTIFIER] += counts.left_to_other;
  status.latch = parts_.latch.status();
  if (const auto& fault = parts_.watch.fault()) {
    status.fault = fault->cause;
    status.fault_utime = fault->utime;
  }
  status.version = parts_.reload.version();
  status.failed_reloads = parts_.reload.failed();
  AddBusCounts(status);
  status.page_faults = page_faults_;
  status.queue_depth = static_cast<std::int32_t>(parts_.queue.size());
  status.queue_high_water = static_cast<std::int32_t>(parts_.queue.TakeHighWater());
  status.elapsed_p50_us = ElapsedPercentile(0.5);
  status.elapsed_p99_us = ElapsedPercentile(0.99);
  status.elapsed_max_us = ElapsedPercentile(1);
  const Refusals refusals = parts_.bus.refusals();
  const std::string clocks = DescribeClocks(refusals, std::exchange(refused_before_, refusals));
  const std::string why = WhyNotOk(gate);
  std::string message = gate.options().shadow ? kShadowWarning : "";
  for (const std::string& clause : {clocks, why})
    if (!clause.empty()) message += (message.empty() ? "" : "; ") + clause;
  SetText(status.message, message);
  // Said once: by the next report another message may have been taken.
  counts.obstacles_refused = false;
  return status;
}

double StatusReporter::ElapsedPercentile(double fraction) const {
  const std::size_t count = std::min(decided_, elapsed_us_.size());
  if (count == 0) return 0;
  auto sorted = elapsed_us_;
  const auto at = sorted.begin() + static_cast<std::ptrdiff_t>(fraction * static_cast<double>(count - 1));
  std::nth_element(sorted.begin(), at, sorted.begin() + static_cast<std::ptrdiff_t>(count));
  return *at;
}

std::string StatusReporter::Summary(const Gate& gate) const {
  const certifier_status_t status = gate.Status(0);
  const auto count = [&](std::int16_t outcome) { return status.by_outcome[outcome]; };
  return JsonText({{"candidates", status.candidates},
                   {"certified", count(decision_t::CERTIFIED)},
                   {"abstained",
                    {{"falsified", count(decision_t::ABSTAIN_FALSIFIED)},
                     {"domain", count(decision_t::ABSTAIN_DOMAIN)},
                     {"safety", count(decision_t::ABSTAIN_SAFETY)},
                     {"deadline", count(decision_t::ABSTAIN_DEADLINE)},
                     {"obstacles", count(decision_t::ABSTAIN_OBSTACLES)}}},
                   {"rejected", count(decision_t::REJECTED)},
                   {"observations", status.observations},
                   {"learned", status.learned},
                   {"left_to_another_certifier", counts.left_to_other},
                   {"faults", counts.faults},
                   {"withdrawals", counts.withdrawals},
                   {"messages_refused", counts.refused},
                   {"messages_not_sent", parts_.sender.refused()},
                   {"elapsed_us", {{"p50", ElapsedPercentile(0.5)}, {"p99", ElapsedPercentile(0.99)}}}});
}

}  // namespace forereach
