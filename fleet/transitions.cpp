#include "fleet/transitions.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "certifier/gate/robot_messages.h"
#include "forereach/certify/certifier.h"
#include "forereach/numerics/text.h"
#include "forereach/residual/observations.h"

namespace forereach {
namespace {

constexpr int kTransitionsAtOnce = 20'000;
constexpr int kDigits = 4;

// Where a transition was recorded.
struct Place {
  const std::string *robot, *log_file;  // of Reading::names_
  std::int64_t event;

  [[nodiscard]] std::vector<std::string> Cells() const { return {*robot, *log_file, std::to_string(event)}; }
};

std::string DayOf(std::int64_t utime) {
  const std::chrono::sys_days day = std::chrono::floor<std::chrono::days>(
      std::chrono::sys_time<std::chrono::microseconds>(std::chrono::microseconds(utime)));
  const std::chrono::year_month_day date(day);
  return fmt::format("{:04}-{:02}-{:02}", static_cast<int>(date.year()), static_cast<unsigned>(date.month()),
                     static_cast<unsigned>(date.day()));
}

// The message of a row; none if it has other sizes than a message's: a robot may have put any rows there.
std::optional<transition_t> MessageOf(const TransitionRow& row) {
  transition_t message{};
  if (row.state.size() > std::size(message.state) || row.input.size() > std::size(message.input) ||
      row.next_state.size() != row.state.size())
    return std::nullopt;
  message.utime = row.utime;
  message.duration_us = row.duration_us;
  message.num_states = static_cast<std::int16_t>(row.state.size());
  message.num_inputs = static_cast<std::int16_t>(row.input.size());
  std::ranges::copy(row.state, message.state);
  std::ranges::copy(row.input, message.input);
  std::ranges::copy(row.next_state, message.next_state);
  return message;
}

// The kind of a refusal, without the numbers of one transition.
std::string KindOf(const std::string& refusal) {
  const std::size_t digit = refusal.find_first_of("0123456789");
  return digit == 0
             ? refusal
             : refusal.substr(0, refusal.find_last_not_of(" -", digit == std::string::npos ? digit : digit - 1) + 1);
}

class Reading final {
 public:
  Reading(const Config& task, TransitionsBy by) : problem_(*task.problem), options_(task.gate), by_(by) {}

  void Take(const Store::OfRobot& of_robot) {
    const auto& [robot, row] = of_robot;
    const std::string group = by_ == TransitionsBy::kRobot ? robot : DayOf(row.event.utime);
    const Place place{&*names_.insert(robot).first, &*names_.insert(row.event.log_file).first, row.event.event_number};
    Group& of_group = groups_[group];
    const std::optional<transition_t> message = MessageOf(row);
    ExecutedTransition executed;
    if (message)
      executed = Examine(*message, problem_, options_);
    else
      executed.refusal = "the row has other sizes than a message of a step";
    if (!executed.refusal.empty()) {
      ++of_group.refused;
      ++refused_.try_emplace(KindOf(executed.refusal), 0, place).first->second.first;
      return;
    }
    of_group.rows.push_back(std::ssize(places_));
    places_.push_back(place);
    z_.insert(z_.end(), executed.z.begin(), executed.z.end());
    next_.insert(next_.end(), executed.next.begin(), executed.next.end());
    longer_.push_back(executed.longer);
    longest_ = std::max(longest_, executed.by_clock);
  }

  FleetTransitions Finish() {
    FleetTransitions found;
    found.transitions = Of([](const Place&) { return true; });
    found.longer = longest_;
    found.residuals = Residuals(found.transitions);
    found.refused = {"Refused", {"transitions", "why", "robot", "log", "event"}, {}};
    for (const auto& [why, count] : refused_) {
      auto& cells = found.refused.rows.emplace_back(std::vector{std::to_string(count.first), why});
      std::ranges::move(count.second.Cells(), std::back_inserter(cells));
    }
    found.contradictions = Contradictions();
    return found;
  }

 private:
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  struct Group {
    std::vector<std::ptrdiff_t> rows;
    std::int64_t refused = 0;
  };

  // Those of some places.
  template <class IsWanted>
  Transitions Of(const IsWanted& is_wanted) {
    kept_.clear();
    for (std::ptrdiff_t i = 0; i < std::ssize(places_); ++i)
      if (is_wanted(places_[static_cast<std::size_t>(i)])) kept_.push_back(i);
    const Eigen::Index n = problem_.model->num_states(), d = problem_.model->num_variables();
    const Eigen::Index count = std::ssize(places_);
    const Eigen::Map<const RowMajor> z(z_.data(), count, d), next(next_.data(), count, n);
    Transitions some{z(kept_, Eigen::all), next(kept_, Eigen::all)};
    // As what a robot has learned: the errors that are declared of these count.
    some.num_learned = some.size();
    some.longer = Eigen::Map<const Eigen::VectorXd>(longer_.data(), count)(kept_);
    return some;
  }

  FleetTable Residuals(const Transitions& all) {
    FleetTable table{"Residuals", {by_ == TransitionsBy::kRobot ? "robot" : "day", "transitions", "refused"}, {}};
    for (const std::string& state : problem_.model->state_names())
      for (const char* what : {" mean", " deviation", " largest"}) table.columns.push_back(state + what);
    Eigen::MatrixXd middle(0, problem_.model->num_states());
    if (all.size() > 0) {
      const Observations observed = Observe(*problem_.model, problem_.declaration, all, problem_.timing);
      middle = (observed.lower + observed.upper) / 2;
    }
    for (const auto& [name, group] : groups_) {
      std::vector<std::string>& cells =
          table.rows.emplace_back(std::vector{name, std::to_string(group.rows.size()), std::to_string(group.refused)});
      for (Eigen::Index k = 0; k < middle.cols(); ++k) {
        if (group.rows.empty()) continue;
        const Eigen::VectorXd r = middle.col(k)(group.rows);
        const double mean = r.mean();
        cells.push_back(RoundedDown(mean, kDigits));
        cells.push_back(RoundedUp(std::sqrt((r.array() - mean).square().mean()), kDigits));
        cells.push_back(RoundedUp(r.cwiseAbs().maxCoeff(), kDigits));
      }
      cells.resize(table.columns.size());
    }
    return table;
  }

  FleetTable Contradictions() {
    FleetTable table{"Contradictions of the declaration",
                     {"state", "differs by", "allowed", "robot", "log", "event", "and robot", "log", "event"},
                     {}};
    std::set<const std::string*> named;
    std::map<std::string, const std::string*> robots;
    for (const Place& place : places_) robots.emplace(*place.robot, place.robot);
    // Each robot by itself first. Only of those that agree with themselves it is asked whether they agree with each
    // other.
    for (const auto& [name, robot] : robots)
      static_cast<void>(
          FindContradiction([of = robot](const Place& place) { return place.robot == of; }, named, table));
    while (FindContradiction([&](const Place& place) { return !named.contains(place.robot); }, named, table)) {
    }
    return table;
  }

  // Of some places. Its robots are named from now on.
  template <class IsWanted>
  bool FindContradiction(const IsWanted& is_wanted, std::set<const std::string*>& named, FleetTable& table) {
    Problem pooled = problem_;
    pooled.transitions = Of(is_wanted);
    if (kept_.empty()) return false;
    const Certifier certifier(std::make_shared<const Problem>(std::move(pooled)));
    const std::optional<Violation>& found = certifier.violation();
    if (!found) return false;
    std::vector<std::string>& cells =
        table.rows.emplace_back(std::vector{problem_.model->state_names()[static_cast<std::size_t>(found->coordinate)],
                                            RoundedDown(found->difference, kDigits), RoundedUp(found->bound, kDigits)});
    for (const int row : {found->first, found->second}) {
      if (row < 0) continue;
      const Place& place = places_[static_cast<std::size_t>(kept_[static_cast<std::size_t>(row)])];
      std::ranges::move(place.Cells(), std::back_inserter(cells));
      named.insert(place.robot);
    }
    cells.resize(table.columns.size());
    return true;
  }

  const Problem& problem_;
  const GateOptions& options_;
  const TransitionsBy by_;
  std::set<std::string> names_;
  std::vector<Place> places_;
  std::vector<double> z_, next_, longer_;  // of each
  double longest_ = 0;
  std::map<std::string, Group> groups_;
  std::map<std::string, std::pair<std::int64_t, Place>> refused_;
  std::vector<std::ptrdiff_t> kept_;  // of places_: those of the last Of
};

}  // namespace

FleetTransitions ReadTransitions(Store& store, const Config& task, const Store::WhichTransitions& which,
                                 TransitionsBy by) {
  Reading reading(task, by);
  std::vector<Store::OfRobot> rows;
  std::optional<Store::OfRobot> last;
  do {
    rows = store.ReadTransitions(which, last ? &*last : nullptr, kTransitionsAtOnce);
    for (const Store::OfRobot& row : rows) reading.Take(row);
    if (!rows.empty()) last = rows.back();
  } while (std::ssize(rows) == kTransitionsAtOnce);
  return reading.Finish();
}

}  // namespace forereach
