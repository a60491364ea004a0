#include "page/rows_json.h"

#include <bit>
#include <cstdint>

#include <nlohmann/json.hpp>

#include "lcmtypes/printable.h"
#include "records/result_json.h"

namespace forereach {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(LogReference, log_file, event_number, digest)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(PageTask, config_digest, name, states, inputs, holds, parts)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(PageFault, utime, plan_id, cause, message)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(PageWithdrawal, utime, plan_id, source, cause, message, valid_steps)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(PagePart, robot, replays, decisions, events, gaps, faults, withdrawals)

namespace {

// Fields of a row in an array, since their names would be most of the text.
class Put final {
 public:
  void operator()(double value) { array_.push_back(std::bit_cast<std::int64_t>(value)); }
  void operator()(const std::string& text) { array_.push_back(Printable(text)); }  // as the page shows it
  void operator()(const std::vector<double>& values) {
    Put each;
    for (const double value : values) each(value);
    array_.push_back(std::move(each.array_));
  }
  void operator()(const auto& value) { array_.push_back(value); }
  nlohmann::json Finish() { return std::move(array_); }

 private:
  nlohmann::json array_ = nlohmann::json::array();
};

class Get final {
 public:
  explicit Get(const nlohmann::json& array) : array_(array) {}
  void operator()(double& value) { value = std::bit_cast<double>(Next().get<std::int64_t>()); }
  void operator()(std::vector<double>& values) {
    const nlohmann::json& next = Next();
    Get each(next);
    values.resize(next.size());
    for (double& value : values) each(value);
  }
  void operator()(auto& value) { Next().get_to(value); }

 private:
  const nlohmann::json& Next() { return array_.at(next_++); }
  const nlohmann::json& array_;
  std::size_t next_ = 0;
};

template <class Row, class Visit>
requires(std::same_as<std::remove_const_t<Row>, DecisionRow>) void VisitFields(Row& row, Visit& visit) {
  visit(row.event);
  visit(row.utime);
  visit(row.candidate_utime);
  visit(row.sequence);
  visit(row.plan_id);
  visit(row.source);
  visit(row.outcome);
  visit(row.cause);
  visit(row.message);
  visit(row.step);
  visit(row.coordinate);
  visit(row.obstacle);
  visit(row.first_observation);
  visit(row.second_observation);
  visit(row.margin);
  visit(row.threshold);
  visit(row.elapsed_us);
  visit(row.latency_us);
  visit(row.plan_digest);
  visit(row.grounds);
}

template <class Row, class Visit>
requires(std::same_as<std::remove_const_t<Row>, EventRow>) void VisitFields(Row& row, Visit& visit) {
  visit(row.event);
  visit(row.utime);
  visit(row.sequence);
  visit(row.plan_id);
  visit(row.kind);
  visit(row.message);
  visit(row.step);
  visit(row.coordinate);
  visit(row.state);
  visit(row.value);
}

template <class Row, class Visit>
requires(std::same_as<std::remove_const_t<Row>, GapRow>) void VisitFields(Row& row, Visit& visit) {
  visit(row.event);
  visit(row.channel);
  visit(row.source);
  visit(row.expected);
  visit(row.got);
  visit(row.lost);
  visit(row.utime);
  visit(row.reason);
}

template <class Row>
nlohmann::json ToArray(const std::vector<Row>& rows) {
  nlohmann::json all = nlohmann::json::array();
  for (const Row& row : rows) {
    Put put;
    VisitFields(row, put);
    all.push_back(put.Finish());
  }
  return all;
}

template <class Row>
std::vector<Row> FromArray(const nlohmann::json& all) {
  std::vector<Row> rows;
  for (const nlohmann::json& fields : all) {
    Get get(fields);
    VisitFields(rows.emplace_back(), get);
  }
  return rows;
}

}  // namespace

void to_json(nlohmann::json& json, const PageRun& rows) {
  json = {{"decisions", ToArray(rows.decisions)},
          {"events", ToArray(rows.events)},
          {"gaps", ToArray(rows.gaps)},
          {"faults", rows.faults},
          {"withdrawals", rows.withdrawals},
          {"tasks", rows.tasks},
          {"parts", rows.parts},
          {"damage", rows.damage},
          {"notes", rows.notes}};
}

void from_json(const nlohmann::json& json, PageRun& rows) {
  rows.decisions = FromArray<DecisionRow>(json.at("decisions"));
  rows.events = FromArray<EventRow>(json.at("events"));
  rows.gaps = FromArray<GapRow>(json.at("gaps"));
  json.at("faults").get_to(rows.faults);
  json.at("withdrawals").get_to(rows.withdrawals);
  json.at("tasks").get_to(rows.tasks);
  json.at("parts").get_to(rows.parts);
  json.at("damage").get_to(rows.damage);
  json.at("notes").get_to(rows.notes);
}

}  // namespace forereach
