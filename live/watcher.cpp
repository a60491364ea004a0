#include "live/watcher.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <utility>

#include <fmt/core.h>
#include <nlohmann/json.hpp>

#include "certifier/gate/candidate_message.h"
#include "certifier/gate/robot_messages.h"
#include "forereach/certified_plan_t.hpp"
#include "forereach/certifier_status_t.hpp"
#include "forereach/certify/explain.h"
#include "forereach/execution_event_t.hpp"
#include "forereach/fault_t.hpp"
#include "forereach/sets/zonogon.h"
#include "forereach/withdrawal_t.hpp"
#include "lcmtypes/candidate_batch.h"
#include "lcmtypes/names.h"
#include "lcmtypes/printable.h"
#include "lcmtypes/why_failed.h"
#include "page/detail.h"
#include "records/log_trust.h"
#include "records/outlines.h"
#include "records/status_json.h"
#include "task/json_text.h"

namespace forereach {
namespace {

using Json = nlohmann::json;

constexpr std::size_t kBytesOfATube = 400'000;
constexpr TimelineBounds kBounds{.undecided = 64, .ahead = 1024, .obstacles = 1 << 16};
constexpr std::uint64_t kReadsAgainAfterUs = 2'000'000;
constexpr std::uint64_t kForgetsAfterUs = 3'000'000;  // that a certifier was in charge
constexpr std::size_t kInATick = 2 * Watcher::kDecisions;

// Both may be any number. Their difference, taken without a sign, does not overflow.
std::uint64_t TimeApart(std::int64_t a, std::int64_t b) {
  return static_cast<std::uint64_t>(std::max(a, b)) - static_cast<std::uint64_t>(std::min(a, b));
}

// What a signature names, if the task gives the bus no name: address and port.
std::shared_ptr<const Config> Named(Config task) {
  task.bus.name = task.bus.bus_name();
  return std::make_shared<const Config>(std::move(task));
}

// Integers as text: a browser has no exact ones beyond 2^53.
std::string Text(std::int64_t number) { return std::to_string(number); }

bool IsJudged(const decision_t& decision) {
  return decision.outcome == decision_t::CERTIFIED || decision.outcome == decision_t::ABSTAIN_SAFETY ||
         decision.outcome == decision_t::ABSTAIN_DOMAIN || decision.outcome == decision_t::ABSTAIN_FALSIFIED;
}

// Whether one of the last messages was this one: it is repeated until it has been answered.
bool IsRepeated(std::deque<std::pair<std::int64_t, std::int64_t>>& last, std::int64_t a, std::int64_t b) {
  if (std::ranges::find(last, std::pair(a, b)) != last.end()) return true;
  if (last.size() == Watcher::kOthers) last.pop_front();
  last.emplace_back(a, b);
  return false;
}

}  // namespace

void LiveFeed::Add(std::string text) {
  texts_.push_back(std::move(text));
  if (texts_.size() <= most_) return;
  texts_.pop_front();
  ++first_;
}

void LiveFeed::Append(std::int64_t from, std::int64_t to, std::string& out) const {
  const std::int64_t begin = std::max(from, first_);
  for (std::int64_t i = begin; i < to; ++i) {
    if (i > begin) out += ',';
    out += texts_[static_cast<std::size_t>(i - first_)];
  }
}

// ---- What is heard.

Watcher::Watcher(Config task, std::optional<KeyRing> keys, ReadAgain read_again)
    : tasks_{Named(std::move(task))},
      keys_(std::move(keys)),
      read_again_(std::move(read_again)),
      interpreter_(this->task().bus, ""),
      timeline_(
          this->task(), [this](const Digest& config) { return Find(config); }, keys_, {this}, kBounds),
      obstacles_(kBounds.obstacles),
      tube_(std::make_unique<Tube>()) {}

// The certifier may run another task than this: the file may have been reloaded.
const Config* Watcher::Find(const Digest& config) {
  if (config == task().grounds.config) {
    other_task_.clear();
    return &task();
  }
  if (config == tried_ || (tried_us_ != 0 && TimeApart(now_us_, tried_us_) < kReadsAgainAfterUs)) return nullptr;
  tried_ = config;
  tried_us_ = now_us_;
  other_task_ =
      fmt::format("the certifier's task file is not {} as it is now: tubes and names may be wrong", task().path);
  try {
    if (tasks_.size() == kMostTasks) throw ConfigError("it was read again too often: start this program again");
    auto again = Named(read_again_());
    if (again->grounds.config != config || again->bus != task().bus) return nullptr;
    tasks_.push_back(std::move(again));
    other_task_.clear();
    return &task();
  } catch (const std::exception& error) {
    other_task_ += fmt::format(" ({})", WhyFailed(error));
    return nullptr;
  }
}

void Watcher::OnEvent(const LogEvent& event) {
  now_us_ = event.utime;
  ++counts_.messages;
  TakeRows(event);
  if (!TakeMessage(event)) ++counts_.undecodable;
}

void Watcher::TakeRows(const LogEvent& event) {
  Rows rows;
  interpreter_.Observe(event, rows);
  for (DecisionRow& row : rows.decisions) {
    ++counts_.decisions;
    ++counts_.by_outcome[row.outcome];
    if (row.cause != CauseName(decision_t::CAUSE_NONE)) ++counts_.by_cause[row.cause];
    if (decided_.size() == kInATick) SkipFirst();
    decided_.push_back({std::move(row)});
  }
  for (const EventRow& row : rows.events)
    Add(kEventFeed, {{"utime", row.utime},
                     {"plan", Text(row.plan_id)},
                     {"kind", row.kind},
                     {"step", row.step},
                     {"message", row.message}});
  for (const GapRow& row : rows.gaps) {
    ++counts_.gaps;
    if (row.lost < INT64_MAX - counts_.lost) counts_.lost += row.lost;
    Add(kGapFeed, {{"utime", row.utime},
                   {"channel", Printable(row.channel)},
                   {"source", row.source},
                   {"reason", row.reason},
                   {"lost", Text(row.lost)}});
  }
}

// False: no message of its channel's type.
bool Watcher::TakeMessage(const LogEvent& event) {
  const BusOptions& channels = task().bus;
  if (event.channel == channels.robot_state) return TakeState(event);
  if (event.channel == channels.status) return TakeStatus(event);
  if (event.channel == channels.fault) return TakeFault(event);
  if (event.channel == channels.logger_status) {
    const auto status = Decoded<logger_status_t>(event.message());
    if (status) logger_.emplace(event.utime, *status);
    return status.has_value();
  }
  return event.channel == channels.command || interpreter_.Identify(event.channel, event.message()).second;
}

void Watcher::SkipFirst() {
  if (const auto& obstacles = decided_.front().recorded.basis.obstacles) obstacles_.Remove(*obstacles);
  decided_.erase(decided_.begin());
  ++skipped_;
}

void Watcher::OnDecision(const RecordedDecision& recorded) {
  Decided& decided = decided_.back();  // its row was made just now
  decided.recorded = recorded;
  decided.certificate = certificates_.Take(GetDigest(recorded.decision.plan_digest)).value_or(nullptr);
  obstacles_.Add(*recorded.basis.obstacles);
  while (obstacles_.AreTooMany() && decided_.size() > 1) SkipFirst();
}

void Watcher::OnCertified(const RecordedPlan& recorded) {
  certificates_.Add(GetDigest(recorded.certified.plan_digest),
                    std::make_shared<const certified_plan_t>(recorded.certified));
}

bool Watcher::TakeState(const LogEvent& event) {
  const auto state = Decoded<robot_state_t>(event.message());
  if (!state || !FaultOf(*state, task().problem->model->num_states()).empty()) return false;
  state_.emplace(event.utime, *state);
  if (task().problem->projection.rows() != 2) return true;
  const Eigen::Vector2d at =
      task().problem->projection * Eigen::Map<const Eigen::VectorXd>(state->state, state->num_states);
  if (Svg::CanBeDrawn(at)) Add(kPlaceFeed, {at.x(), at.y(), Text(state->executing_plan_id), state->executing_step});
  return true;
}

bool Watcher::TakeStatus(const LogEvent& event) {
  const auto status = Decoded<certifier_status_t>(event.message());
  if (!status) return false;
  const bool keeps = status_ && IsInCharge(status_->second) && TimeApart(event.utime, status_->first) < kForgetsAfterUs;
  if (!IsInCharge(*status) && keeps) return true;  // another one stands by
  status_.emplace(event.utime, *status);
  if (IsInCharge(*status)) static_cast<void>(Find(GetDigest(status->config_digest)));
  return true;
}

// As they are now, and where they will be.
std::string Watcher::ObstaclesSvg(std::int64_t now_us) const {
  const auto now = static_cast<double>(now_us);
  const std::vector<Obstacle>& obstacles = timeline_.logged_obstacles();
  Eigen::AlignedBox2d frame = frame_;
  if (!Svg::CanBeDrawn(frame))
    for (const Obstacle& obstacle : obstacles)
      if (const auto place = PlaceOf(obstacle, now); place && obstacle.dim() == 2)
        for (const Eigen::Vector2d& point : place->points)
          if (Svg::CanBeDrawn(point)) frame.extend(point);
  Svg svg(frame.isEmpty() ? Eigen::AlignedBox2d(Eigen::Vector2d(-1, -1), Eigen::Vector2d(1, 1)) : frame);
  DrawObstacles(obstacles, {now}, frame, -1, false, svg);
  for (const Obstacle& obstacle : obstacles)
    if (obstacle.dim() == 2)
      for (const Svg::Points& outline : PredictionOf(obstacle, now_us)) svg.Polygon(outline, "class=\"prediction\"");
  return svg.Done();
}

bool Watcher::TakeFault(const LogEvent& event) {
  const auto fault = Decoded<fault_t>(event.message());
  if (!fault) return false;
  if (IsRepeated(faults_, fault->utime, fault->cause)) return true;
  Add(kFaultFeed, {{"utime", fault->utime},
                   {"plan", Text(fault->plan_id)},
                   {"kind", FaultName(fault->cause)},
                   {"message", GetText(fault->message)}});
  return true;
}

void Watcher::OnWithdrawn(const RecordedWithdrawal& recorded) {
  const withdrawal_t& withdrawal = recorded.withdrawal;
  Add(kWithdrawalFeed, {{"utime", withdrawal.utime},
                        {"plan", Text(withdrawal.plan_id)},
                        {"kind", WithdrawalName(withdrawal.cause)},
                        {"steps", withdrawal.valid_steps},
                        {"message", GetText(withdrawal.message)}});
}

void Watcher::Add(Feed feed, const Json& record) {
  std::string text = JsonText(record);
  const std::lock_guard lock(mutex_);
  feeds_[feed].Add(std::move(text));
}

// ---- What is drawn.

// The newest certificates, then the newest abstentions.
std::vector<bool> Watcher::ChooseDrawn() const {
  std::vector<bool> chosen(decided_.size());
  int room = kTubesInATick;
  for (const bool wants_certified : {true, false})
    for (std::size_t i = decided_.size(); i-- > 0 && room > 0;) {
      const decision_t& decision = decided_[i].recorded.decision;
      const bool is_certified = decision.outcome == decision_t::CERTIFIED;
      if (is_certified != wants_certified || !IsJudged(decision)) continue;
      chosen[i] = true;
      --room;
    }
  return chosen;
}

void Watcher::Draw(const Decided& decided, PageDetail& detail) {
  const auto& [decision, event, sent, is_of_known_task, basis] = decided.recorded;
  if (!is_of_known_task) {
    detail.missing = "it was decided under another task file";
    return;
  }
  const auto candidate = sent ? Decoded<candidate_plan_t>(sent->bytes) : std::nullopt;
  if (!candidate) {
    detail.missing = "its candidate did not arrive here";
    return;
  }
  const GateOptions& gate = basis.task->gate;
  detail.missing = WhyNotJudged(*candidate, *basis.task);
  if (!detail.missing.empty()) return;
  try {
    const JudgedCandidate judged{*candidate, ScheduleOf(*candidate, gate), decision.outcome, decision.step};
    const Plan plan = PlanOf(judged.candidate, judged.schedule);
    const Zonotope initial_set = InitialSetOf(*candidate);
    const Certifier& certifier = certifier_.At(basis);
    certifier.Require(plan, initial_set, *basis.obstacles);
    const Decision again =
        CertifyInPieces(certifier, plan, initial_set, *basis.obstacles, MostPieces(decision.outcome, gate), *tube_);
    Describe(certifier, judged, again, *tube_, *basis.obstacles, detail);
  } catch (const std::invalid_argument& error) {
    detail.missing = fmt::format("it cannot be judged again: {}", error.what());
  }
}

// The interval hulls of a certificate, in the plane.
void Watcher::DrawBoxes(const Decided& decided, PageDetail& detail) const {
  const certified_plan_t* const certified = decided.certificate.get();
  const Problem& problem = *decided.recorded.basis.task->problem;
  const Eigen::MatrixXd& projection = problem.projection;
  if (!certified || projection.rows() != 2 || !HasSizes(certified->plan, *problem.model)) return;
  std::vector<std::vector<Svg::Points>> units;
  const Eigen::Index n = projection.cols();
  for (int t = 0; t <= certified->plan.num_steps; ++t) {
    const Eigen::Map<const Eigen::VectorXd> lower(certified->slice_lower[t], n), upper(certified->slice_upper[t], n);
    const Eigen::VectorXd half = (upper - lower) / 2;
    if (!lower.allFinite() || !upper.allFinite() || half.minCoeff() < 0) return;
    units.push_back({Outline(Zonotope(projection * (lower + half), projection * half.asDiagonal()))});
  }
  detail.start_utime = certified->plan.start_utime;
  detail.step_us = certified->plan.step_us;
  detail.steps = certified->plan.num_steps;
  if (DrawTube(units, {}, *decided.recorded.basis.obstacles, -1, detail))
    detail.missing = fmt::format("the boxes of its certificate, without the body; {}", detail.missing);
}

Json Watcher::DecisionJson(const Decided& decided, bool is_drawn) {
  const DecisionRow& row = decided.row;
  Json json{{"utime", row.utime},        {"plan", Text(row.plan_id)}, {"source", row.source},
            {"outcome", row.outcome},    {"cause", row.cause},        {"step", row.step},
            {"obstacle", row.obstacle},  {"margin", row.margin},      {"threshold", row.threshold},
            {"elapsed", row.elapsed_us}, {"latency", row.latency_us}, {"message", row.message},
            {"digest", row.plan_digest}};
  PageDetail detail;
  if (is_drawn)
    Draw(decided, detail);
  else
    detail.missing = IsJudged(decided.recorded.decision) ? "more was decided at this time than this page draws"
                                                         : "it was answered without a tube";
  if (decided.recorded.decision.outcome == decision_t::CERTIFIED && !detail.missing.empty()) DrawBoxes(decided, detail);
  if (detail.svg.size() > kBytesOfATube) {
    detail.svg.clear();
    detail.missing = "its drawing is too large for this page";
  }
  if (!detail.svg.empty()) frame_ = detail.frame;
  json["detail"] = ToJson(detail);
  json["detail"]["svg"] = std::move(detail.svg);
  return json;
}

// ---- What is told.

void Watcher::Tick(std::int64_t now_us, const LiveLosses& losses) {
  const std::vector<bool> drawn = ChooseDrawn();
  for (std::size_t i = 0; i < decided_.size(); ++i) Add(kDecisionFeed, DecisionJson(decided_[i], drawn[i]));
  decided_.clear();
  obstacles_ = KeptObstacles(kBounds.obstacles);
  std::string now = JsonText(NowJson(now_us, losses)), obstacles = JsonText(Json(ObstaclesSvg(now_us)));
  const std::lock_guard lock(mutex_);
  now_ = std::move(now);
  if (set_ != obstacles) ++obstacles_number_;
  set_ = std::move(obstacles);
  std::ranges::transform(feeds_, ends_.begin(), &LiveFeed::end);
  ++tick_;
}

Json Watcher::Beginning() const {
  const NominalModel& model = *task().problem->model;
  return {{"task", Printable(task().path)},
          {"model", Printable(model.name())},
          {"digest", ToHex(task().grounds.config)},
          {"url", Printable(task().bus.url)},
          {"robot", keys_ ? Json(keys_->robot()) : Json()},
          {"holds", HoldsName(*task().problem)},
          {"states", model.state_names()},
          {"planar", task().problem->projection.rows() == 2}};
}

Json Watcher::RobotJson() const {
  if (!state_) return {};
  const robot_state_t& state = state_->second;
  const Eigen::Map<const Eigen::VectorXd> x(state.state, state.num_states);
  Json json{{"utime", state.utime},
            {"heard", state_->first},
            {"plan", Text(state.executing_plan_id)},
            {"step", state.executing_step},
            {"mode", state.mode == robot_state_t::EXECUTING  ? "executing"
                     : state.mode == robot_state_t::STANDING ? "standing"
                                                             : "finished"},
            {"state", std::vector<double>(x.begin(), x.end())}};
  if (task().problem->projection.rows() != 2 || x.size() != task().problem->projection.cols()) return json;
  const Eigen::Vector2d at = task().problem->projection * x;
  const std::vector<Svg::Points> body = BodyAt(*task().problem, x);
  Eigen::AlignedBox2d frame(at);
  for (const Svg::Points& part : body)
    for (const Eigen::Vector2d& corner : part) frame.extend(corner);
  if (!Svg::CanBeDrawn(frame)) return json;
  Svg svg(frame);
  for (const Svg::Points& part : body) svg.Polygon(part, "class=\"robot\"");
  svg.Dot(at, "class=\"dot now\"");
  json["at"] = {at.x(), at.y()};
  json["svg"] = svg.Done();
  return json;
}

Json Watcher::NowJson(std::int64_t now_us, const LiveLosses& losses) const {
  Json json{{"utime", now_us},
            {"signed", keys_.has_value()},
            {"note", Printable(other_task_)},
            {"robot", RobotJson()},
            {"counts",
             {{"messages", counts_.messages},
              {"undecodable", counts_.undecodable},
              {"decisions", counts_.decisions},
              {"not_shown", skipped_},
              {"by_outcome", counts_.by_outcome},
              {"by_cause", counts_.by_cause},
              {"lost", counts_.lost},
              {"gaps", counts_.gaps},
              {"dropped", losses.dropped},
              {"datagrams_refused", losses.datagrams_refused}}},
            {"refused", forereach::ToJson(timeline_.passed_over().not_authentic)},
            {"certifier", Json()},
            {"logger", Json()}};
  if (status_) {
    json["certifier"] = Json::parse(JsonText(ToJson(status_->second, keys_.has_value())));
    json["certifier"]["heard"] = status_->first;
  }
  if (logger_) {
    const logger_status_t& logger = logger_->second;
    json["logger"] = {{"heard", logger_->first},
                      {"level", LevelName(logger.state)},
                      {"lost", logger.events_lost},
                      {"written", logger.events_written},
                      {"message", GetText(logger.message)}};
  }
  return json;
}

std::string Watcher::Since(Cursor& cursor) const {
  static constexpr std::array kNames{"decisions", "faults", "withdrawals", "events", "gaps", "places"};
  const std::lock_guard lock(mutex_);
  if (cursor.tick == tick_) return "";
  cursor.tick = tick_;
  std::string text = "{\"now\":" + now_;
  if (cursor.obstacles != obstacles_number_) text += ",\"obstacles\":" + set_;
  cursor.obstacles = obstacles_number_;
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    if (cursor.of_feed[i] == ends_[i]) continue;
    text.append(",\"").append(kNames[i]).append("\":[");
    feeds_[i].Append(cursor.of_feed[i], ends_[i], text);
    cursor.of_feed[i] = ends_[i];
    text += ']';
  }
  return text + '}';
}

}  // namespace forereach
