#include "records/summary.h"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <numeric>
#include <utility>

#include <fmt/chrono.h>
#include <fmt/core.h>
#include <nlohmann/json.hpp>

#include "forereach/certify/explain.h"
#include "forereach/fault_t.hpp"
#include "forereach/robot_state_t.hpp"
#include "lcmtypes/names.h"
#include "lcmtypes/printable.h"

namespace forereach {
namespace {

constexpr std::int64_t kBackUs = 1'000'000, kAheadUs = 3'600'000'000;  // a step of the clock, and no passing of time
constexpr std::size_t kRepeated = 256;  // answers to withdrawals that may be repeated at one time

// UTC; a log's time may be any number.
std::string DayAndTime(std::int64_t utime) {
  constexpr std::int64_t kMost = 253'402'300'800'000'000;  // the year 10000
  return 0 <= utime && utime < kMost ? fmt::format("{:%F %T}", fmt::gmtime(static_cast<std::time_t>(utime / 1'000'000)))
                                     : fmt::format("at {} us", utime);
}

double NearestRank(std::vector<double>& values, double fraction) {
  if (values.empty()) return kNoNumber;
  const auto rank = static_cast<std::ptrdiff_t>(std::ceil(fraction * static_cast<double>(values.size()))) - 1;
  std::nth_element(values.begin(), values.begin() + rank, values.end());
  return values[static_cast<std::size_t>(rank)];
}

std::int64_t Total(const std::map<std::string, std::int64_t>& counts) {
  return std::accumulate(counts.begin(), counts.end(), std::int64_t{0},
                         [](std::int64_t sum, const auto& entry) { return sum + entry.second; });
}

std::string Listed(const std::map<std::string, std::int64_t>& counts) {
  std::string text;
  for (const auto& [name, count] : counts)
    text += fmt::format("{}{} {}", text.empty() ? " (" : ", ", Printable(name), count);
  return text.empty() ? text : text + ")";
}

std::string Microseconds(const Quantiles& quantiles) {
  if (!quantiles.WasMeasured()) return "not measured";
  return fmt::format("p50 {:.1f} us, p99 {:.1f} us", quantiles.p50, quantiles.p99);
}

// A robot that has been at the goal may have driven on.
std::string DistanceToGoal(const Summary& summary) {
  const double distance = *summary.distance_to_goal_m;
  if (!summary.goal_reached) return fmt::format("{:.2f} m (goal not reached)", distance);
  if (distance <= summary.goal_radius_m) return fmt::format("{:.2f} m (goal reached)", distance);
  return fmt::format("{:.2f} m at the end (the goal was reached before, within {:g} m)", distance,
                     summary.goal_radius_m);
}

nlohmann::json ToJson(const Quantiles& quantiles) {
  if (!quantiles.WasMeasured()) return {{"p50", nullptr}, {"p99", nullptr}};
  return {{"p50", quantiles.p50}, {"p99", quantiles.p99}};
}

}  // namespace

std::string ToText(const Summary& summary) {
  std::string text;
  const auto line = [&text](std::string_view name, const std::string& value) {
    text += fmt::format("{:<26}{}\n", name, value);
  };
  line("plans proposed", std::to_string(summary.proposed));
  line("  certified", fmt::format("{} ({}if the declaration is true)", summary.certified,
                                  summary.holds.empty()          ? ""
                                  : summary.holds == "all_times" ? "at all times, "
                                                                 : "at the sample instants only, "));
  line("  abstained", std::to_string(Total(summary.abstained)) + Listed(summary.abstained));
  line("  rejected", std::to_string(Total(summary.rejected)) + Listed(summary.rejected));
  line("decision latency", Microseconds(summary.latency_us));
  line("certify step", Microseconds(summary.certify_us));
  if (summary.distance_to_goal_m) line("distance to goal", DistanceToGoal(summary));
  line("contacts", std::to_string(summary.contacts));
  if (summary.has_limits || summary.limits_exceeded > 0)
    line("limits exceeded", std::to_string(summary.limits_exceeded));
  line("steps in certified slice",
       fmt::format("{} of {}", summary.steps_inside,
                   summary.steps_inside + summary.steps_consistent + summary.steps_outside) +
           (summary.steps_consistent == 0
                ? ""
                : fmt::format(", {} consistent (within the state error)", summary.steps_consistent)));
  line("stops", fmt::format("{} ({} braking tails begun)", summary.stops, summary.tails));
  if (summary.withdrawals > 0)
    line("withdrawals",
         fmt::format("{} ({} emergency stops, not certified)", summary.withdrawals, summary.emergency_stops));
  line("refused by the guard", std::to_string(summary.refused));
  if (!summary.faults.empty()) line("faults latched", std::to_string(Total(summary.faults)) + Listed(summary.faults));
  line("messages", std::to_string(Total(summary.messages)) + Listed(summary.messages));
  line("messages lost", std::to_string(Total(summary.lost)) + Listed(summary.lost));
  if (summary.backlog > 0) line("discarded by the bus", std::to_string(summary.backlog));
  line("senders restarted", std::to_string(summary.restarts));
  if (summary.damage.places > 0)
    line("damage in the log", fmt::format("{} places, {} bytes skipped", summary.damage.places, summary.damage.bytes));
  if (const std::string refused = DescribeRefusals(summary.passed_over.not_authentic); !refused.empty())
    line("not authentic", fmt::format("{}, passed over", refused));
  if (summary.clock_steps > 0)
    line("clock stepped", fmt::format("{} times, first {} at event {} by {:+.3f} s; times across it are left out",
                                      summary.clock_steps, DayAndTime(summary.first_step_utime),
                                      summary.first_step_event, static_cast<double>(summary.first_step_us) * 1e-6));
  line("duration", fmt::format("{:.1f} s", summary.duration_s));
  return text;
}

nlohmann::json ToJson(const Summary& summary) {
  nlohmann::json json;
  json["plans"] = {{"proposed", summary.proposed},
                   {"decided", summary.decided},
                   {"certified", summary.certified},
                   {"holds", summary.holds.empty() ? nlohmann::json(nullptr) : nlohmann::json(summary.holds)},
                   {"abstained", summary.abstained},
                   {"rejected", summary.rejected}};
  json["decision_latency_us"] = ToJson(summary.latency_us);
  json["certify_us"] = ToJson(summary.certify_us);
  json["distance_to_goal_m"] = nullptr;
  if (summary.distance_to_goal_m) json["distance_to_goal_m"] = *summary.distance_to_goal_m;
  json["goal_reached"] = summary.goal_reached;
  json["contacts"] = summary.contacts;
  json["limits_exceeded"] = summary.limits_exceeded;
  json["steps"] = {
      {"inside", summary.steps_inside}, {"consistent", summary.steps_consistent}, {"outside", summary.steps_outside}};
  json["tails"] = summary.tails;
  json["stops"] = summary.stops;
  json["withdrawals"] = summary.withdrawals;
  json["emergency_stops"] = summary.emergency_stops;
  json["refused"] = summary.refused;
  json["faults"] = summary.faults;
  json["messages"] = summary.messages;
  json["lost"] = summary.lost;
  json["backlog"] = summary.backlog;
  json["restarts"] = summary.restarts;
  json["damage"] = {{"places", summary.damage.places}, {"bytes", summary.damage.bytes}};
  json["passed_over"] = ToJson(summary.passed_over);
  json["duration_s"] = summary.duration_s;
  json["clock_steps"] = {{"count", summary.clock_steps},
                         {"first_event", summary.clock_steps > 0 ? nlohmann::json(summary.first_step_event) : nullptr},
                         {"first_utime", summary.first_step_utime},
                         {"first_us", summary.first_step_us}};
  return json;
}

SummaryBuilder::SummaryBuilder(const Config& config) : channels_(config.bus) {
  latency_.values.reserve(kMaxSamples);
  certify_.values.reserve(kMaxSamples);
  SetTask(config);
}

void SummaryBuilder::SetTask(const Config& config) {
  goal_ = config.planner.goal;
  goal_radius_m_ = config.planner.goal_radius;
  if (!config.problem) return;
  projection_ = config.problem->projection;
  summary_.has_limits = !config.problem->limits.empty();
  summary_.holds = HoldsName(*config.problem);
}

void SummaryBuilder::Samples::Add(double value) {
  if (std::isnan(value)) return;
  if (values.size() < kMaxSamples) {
    values.push_back(value);
  } else {
    values[next++ % kMaxSamples] = value;
  }
}

Quantiles SummaryBuilder::Samples::Get() const {
  std::vector<double> copy = values;
  return {NearestRank(copy, 0.5), NearestRank(copy, 0.99)};
}

void SummaryBuilder::Add(const LogEvent& event) {
  TakeTime(event);
  auto& messages = summary_.messages;
  ++messages[messages.size() < Summary::kMaxChannels || messages.contains(event.channel) ? event.channel : "*"];
  if (event.channel == channels_.candidate) ++summary_.proposed;
  if (event.channel == channels_.fault) {
    const auto fault = Decoded<fault_t>(event.message());
    const std::pair latched(fault ? fault->utime : 0, fault ? fault->cause : std::int16_t{0});
    if (fault && std::exchange(fault_, latched) != latched)  // it is repeated until a reset
      ++summary_.faults[std::string(FaultName(fault->cause))];
  }
  if (event.channel != channels_.robot_state) return;
  if (const auto state = Decoded<robot_state_t>(event.message()))
    state_.assign(state->state, state->state + std::clamp<int>(state->num_states, 0, 16));
}

// Where the clock was set back or ahead, or a log of before follows, no time passes.
void SummaryBuilder::TakeTime(const LogEvent& event) {
  const std::int64_t before = std::exchange(last_utime_, event.utime).value_or(event.utime);
  const std::int64_t passed = event.utime - before;
  if (-kBackUs < passed && passed < kAheadUs) {
    elapsed_us_ += std::max<std::int64_t>(passed, 0);
    return;
  }
  if (summary_.clock_steps++ > 0) return;
  summary_.first_step_event = event.number;
  summary_.first_step_utime = before;
  summary_.first_step_us = passed;
}

void SummaryBuilder::Add(const DecisionRow& row) {
  ++summary_.decided;
  if (row.outcome == "certified") {
    ++summary_.certified;
  } else {
    ++(row.outcome == "rejected" ? summary_.rejected : summary_.abstained)[row.cause];
  }
  if (0 <= row.latency_us && row.latency_us < static_cast<double>(kAheadUs)) latency_.Add(row.latency_us);
  if (row.outcome != "rejected") certify_.Add(row.elapsed_us);
}

void SummaryBuilder::Add(const EventRow& row) {
  if (row.kind == "refused") ++summary_.refused;
  if (row.kind == "step_inside") ++summary_.steps_inside;
  if (row.kind == "step_consistent") ++summary_.steps_consistent;
  if (row.kind == "step_outside") ++summary_.steps_outside;
  if (row.kind == "goal_reached") summary_.goal_reached = true;
  if (!summary_.goal_reached) {
    if (row.kind == "tail_begun") ++summary_.tails;
    if (row.kind == "standing" || row.kind == "step_outside" || row.kind == "emergency_stop" ||
        (row.kind == "error_stop" && row.plan_id >= 0))
      ++summary_.stops;
  }
  if (row.kind == "emergency_stop") ++summary_.emergency_stops;
  const std::pair left(row.plan_id, static_cast<int>(row.step));
  if (row.kind == "withdrawn" && std::ranges::find(withdrawn_, left) == withdrawn_.end()) {
    ++summary_.withdrawals;
    withdrawn_.push_back(left);
    if (withdrawn_.size() > kRepeated) withdrawn_.pop_front();
  }
  if (row.kind == "contact") ++summary_.contacts;
  if (row.kind == "limit_exceeded") ++summary_.limits_exceeded;
  if (!row.state.empty()) state_ = row.state;
}

void SummaryBuilder::Add(const GapRow& row) {
  if (row.reason == "backlog") {
    summary_.backlog = SumOfLost(summary_.backlog, row.lost);
  } else if (row.lost > 0) {
    std::int64_t& sum = summary_.lost[row.reason];
    sum = SumOfLost(sum, row.lost);
  }
  if (row.reason == "restart") ++summary_.restarts;
}

void SummaryBuilder::Add(const Rows& rows) {
  for (const DecisionRow& row : rows.decisions) Add(row);
  for (const EventRow& row : rows.events) Add(row);
  for (const GapRow& row : rows.gaps) Add(row);
}

Summary SummaryBuilder::Finish() const {
  Summary summary = summary_;
  if (summary.proposed == 0) summary.proposed = summary.decided;
  summary.goal_radius_m = goal_radius_m_;
  summary.latency_us = latency_.Get();
  summary.certify_us = certify_.Get();
  summary.duration_s = static_cast<double>(elapsed_us_) * 1e-6;
  const auto states = static_cast<Eigen::Index>(state_.size()), goals = static_cast<Eigen::Index>(goal_.size());
  if (goals > 0 && projection_.rows() == goals && projection_.cols() == states)
    summary.distance_to_goal_m = (projection_ * Eigen::Map<const Eigen::VectorXd>(state_.data(), states) -
                                  Eigen::Map<const Eigen::VectorXd>(goal_.data(), goals))
                                     .norm();
  return summary;
}

void Summarizer::OnEvent(const LogEvent& event) {
  Rows rows;
  interpreter_.Observe(event, rows);
  builder_.Add(event);
  builder_.Add(rows);
}

Summary Summarizer::Finish(const Timeline& timeline, const Config& last) {
  builder_.SetTask(last);
  Summary summary = builder_.Finish();
  summary.damage = timeline.damage();
  summary.passed_over = timeline.passed_over();
  return summary;
}

}  // namespace forereach
