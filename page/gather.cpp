#include "page/gather.h"

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "forereach/certify/explain.h"
#include "forereach/fault_t.hpp"
#include "forereach/robot_state_t.hpp"
#include "lcmtypes/names.h"
#include "page/detail.h"
#include "page/document.h"
#include "records/database.h"
#include "records/interpreter.h"
#include "records/log_survey.h"
#include "records/shadow.h"

namespace forereach {
namespace {

using Logs = std::vector<std::string>;

std::string FileName(const std::string& path) { return std::filesystem::path(path).filename().string(); }

// As a shell takes it for one word.
std::string Quoted(const std::string& text) {
  const bool is_plain = !text.empty() && text.find_first_not_of(
                                             "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789"
                                             "_./:=@%+,-") == std::string::npos;
  if (is_plain) return text;
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

std::string ReplayCommandOf(const Logs& logs, const std::string& config, const LogKey& key) {
  std::string command = "forereach replay";
  for (const std::string& log : logs) command += " " + Quoted(log);
  if (!config.empty()) command += fmt::format(" --config {}", Quoted(config));
  if (!key.file.empty()) command += fmt::format(" --key {}", Quoted(key.file));
  return command + (key.none ? " --no-key" : "");
}

// ---- Rows.

void TakeRows(const Rows& rows, const PageBounds& bounds, PageRun& run) {
  run.decisions.insert(run.decisions.end(), rows.decisions.begin(), rows.decisions.end());
  for (const EventRow& row : rows.events) run.events.push_back({row.utime, row.plan_id, row.kind});
  for (const GapRow& row : rows.gaps) run.gaps.push_back({row.utime, row.lost, row.reason, row.channel, row.source});
  run.decisions.KeepLast(bounds.decisions);
  run.events.KeepLast(bounds.events);
  run.gaps.KeepLast(bounds.others);
}

// Takes the rows of a log and what no row tells.
class RowReader final : public TimelineUser {
 public:
  /** @param makes_rows false: they are known already. */
  RowReader(const BusOptions& channels, bool makes_rows, const PageBounds& bounds, PageRun& run)
      : channels_(channels), makes_rows_(makes_rows), bounds_(bounds), interpreter_(channels, ""), run_(run) {}

  void Continue(const std::string& log_file) { interpreter_.Continue(log_file); }

  void OnEvent(const LogEvent& event) override {
    if (makes_rows_) {
      Rows rows;
      interpreter_.Observe(event, rows);
      TakeRows(rows, bounds_, run_);
    }
    if (event.channel != channels_.fault) return;
    const auto fault = Decoded<fault_t>(event.message());
    if (!fault || std::exchange(fault_, std::pair(fault->utime, fault->cause)) == std::pair(fault->utime, fault->cause))
      return;  // it is repeated until a reset
    run_.faults.push_back(
        {fault->utime, fault->plan_id, std::string(FaultName(fault->cause)), GetText(fault->message)});
    run_.faults.KeepLast(bounds_.others);
  }

  void OnWithdrawn(const RecordedWithdrawal& recorded) override {
    const withdrawal_t& withdrawal = recorded.withdrawal;
    run_.withdrawals.push_back({withdrawal.utime, withdrawal.plan_id, GetText(withdrawal.source),
                                std::string(WithdrawalName(withdrawal.cause)), GetText(withdrawal.message),
                                withdrawal.valid_steps});
    run_.withdrawals.KeepLast(bounds_.others);
  }

 private:
  const BusOptions channels_;
  const bool makes_rows_;
  const PageBounds& bounds_;
  Interpreter interpreter_;                                     // the timeline has looked at the key
  std::optional<std::pair<std::int64_t, std::int16_t>> fault_;  // the last one
  PageRun& run_;
};

// ---- Tubes.

// As far as there is room.
void TakeRoom(PageDetail& detail, std::size_t& bytes) {
  if (detail.svg.size() <= bytes) {
    bytes -= detail.svg.size();
    return;
  }
  detail.svg.clear();
  detail.missing = "the drawings of this page have reached their bound";
}

bool IsCertified(const PageDecision& row) { return row.outcome == OutcomeName(decision_t::CERTIFIED); }

bool IsJudgedAbstention(const PageDecision& row) {
  return row.outcome == OutcomeName(decision_t::ABSTAIN_FALSIFIED) ||
         row.outcome == OutcomeName(decision_t::ABSTAIN_DOMAIN) ||
         row.outcome == OutcomeName(decision_t::ABSTAIN_SAFETY);
}

// Of each part the places of the last decisions by time that are wanted, `most` of the page.
template <class IsWanted>
std::vector<std::vector<std::size_t>> LastDecisions(const PageRun& page, std::size_t most, const IsWanted& is_wanted) {
  std::vector<std::size_t> part_of, places(page.decisions.size());
  for (std::size_t k = 0; k < page.parts.size(); ++k) part_of.insert(part_of.end(), page.parts[k].decisions, k);
  std::iota(places.begin(), places.end(), std::size_t{0});
  if (page.parts.size() > 1)
    std::ranges::stable_sort(places, {}, [&](std::size_t i) { return page.decisions[i].utime; });
  std::vector<std::vector<std::size_t>> chosen(page.parts.size());
  std::size_t count = 0;
  std::ranges::reverse(places);
  for (const std::size_t i : places)
    if (count < most && is_wanted(page.decisions[i])) {
      chosen[part_of.at(i)].push_back(i);
      ++count;
    }
  return chosen;
}

// Certifies candidates again, and describes what was found.
class DetailMaker final : CaseJudge {
 public:
  /** @param run receives details, and has the tasks. */
  DetailMaker(std::size_t bytes, unsigned threads, PageRun& run) : CaseJudge(threads), bytes_(bytes), run_(run) {}

  void Add(LastCases::Entry entry, std::size_t decision) {
    const RecordedCase& recorded = entry.recorded;
    PageDetail& detail = run_.details.emplace_back();
    detail.decision = decision;
    obstacles_.push_back(recorded.basis.obstacles);
    detail.missing = recorded.missing;
    if (!detail.missing.empty()) return;
    detail.executed = std::move(entry.executed);
    detail.task = TaskIndex(*recorded.basis.task);
    Put(recorded, run_.details.size() - 1);
  }
  void Finish() { CertifyAgain(); }

 private:
  int TaskIndex(const Config& task) {
    const std::string digest = ToHex(task.grounds.config);
    const auto found = std::ranges::find(run_.tasks, digest, &PageTask::config_digest);
    return found == run_.tasks.end() ? -1 : static_cast<int>(found - run_.tasks.begin());
  }

  void Refuse(const JudgedCandidate& judged, const std::string& why) override {
    run_.details[judged.place].missing = fmt::format("it cannot be judged again: {}", why);
  }
  void Look(const JudgedCandidate& judged, const Certifier& certifier, const Decision& again,
            const Tube& tube) override {
    Describe(certifier, judged, again, tube, *obstacles_[judged.place], run_.details[judged.place]);
  }
  void Take(const JudgedCandidate& judged) override { TakeRoom(run_.details[judged.place], bytes_); }

  std::size_t bytes_;  // for which there is room
  PageRun& run_;
  std::vector<decltype(Basis::obstacles)> obstacles_;  // of each detail
};

// ---- Inputs.

void AddTasks(const LogTasks& tasks, PageRun& run) {
  for (const auto& task : tasks.found()) {
    const std::string digest = ToHex(task->grounds.config);
    if (std::ranges::find(run.tasks, digest, &PageTask::config_digest) != run.tasks.end()) continue;
    const NominalModel& model = *task->problem->model;
    run.tasks.push_back({digest, model.name(), model.state_names(), model.input_names(), HoldsName(*task->problem),
                         task->problem->body.parts.size()});
  }
}

// @param makes_rows false: they are known already.
void ReadLogs(const Logs& logs, LogTasks tasks, bool makes_rows, const PageBounds& bounds, unsigned threads,
              PagePass& pass) {
  if (!tasks.has_decisions() && !makes_rows) return;
  PageRun& run = pass.rows;
  RowReader reader(tasks.first().bus, makes_rows, bounds, run);
  ShadowTally shadow(threads);
  std::vector<TimelineUser*> users{&reader, &pass.cases, &shadow};
  users.insert(users.end(), pass.others.begin(), pass.others.end());
  Timeline timeline(tasks, users);
  for (const std::string& log : logs) {
    reader.Continue(FileName(log));
    timeline.Read({log}, true);
  }
  run.damage += timeline.damage();
  run.shadow = ToSentence(shadow.Finish());
  if (const std::string passed_over = DescribePassedOver(timeline.passed_over()); !passed_over.empty())
    run.notes.push_back(fmt::format("Messages were passed over{}.", passed_over));
  AddTasks(tasks, run);
  pass.tasks = tasks.found();
}

void ReadDatabase(const RunLogs& run, const PageBounds& bounds, PageRun& page) {
  Database database(run.database);
  const auto read = [&](const std::string& file) {
    database.ReadInBlocks(file, [&](const Rows& rows) { TakeRows(rows, bounds, page); });
  };
  for (const RunRow& row : run.missing) read(row.log_file);
  for (const std::string& log : run.logs) read(FileName(log));
}

}  // namespace

PageDecision::PageDecision(const DecisionRow& row)
    : log_file(row.event.log_file),
      event_number(row.event.event_number),
      utime(row.utime),
      sequence(row.sequence),
      plan_id(row.plan_id),
      source(row.source),
      outcome(row.outcome),
      cause(row.cause),
      message(row.message),
      step(row.step),
      coordinate(row.coordinate),
      obstacle(row.obstacle),
      first_observation(row.first_observation),
      second_observation(row.second_observation),
      margin(row.margin),
      threshold(row.threshold),
      elapsed_us(static_cast<float>(row.elapsed_us)),
      latency_us(static_cast<float>(row.latency_us)),
      plan_digest(DigestOfHex(row.plan_digest)) {
  std::ranges::transform(row.grounds, grounds.begin(), DigestOfHex);
}

void LastCases::OnStart(const Config& task) { channels_ = task.bus; }

void LastCases::OnDecision(const RecordedDecision& recorded) {
  const auto outcome = recorded.decision.outcome;
  const bool is_certified = outcome == decision_t::CERTIFIED;
  if (!is_certified && outcome != decision_t::ABSTAIN_FALSIFIED && outcome != decision_t::ABSTAIN_DOMAIN &&
      outcome != decision_t::ABSTAIN_SAFETY)
    return;
  std::deque<std::int64_t>& kind = is_certified ? certified_ : abstained_;
  kind.push_back(next_);
  // The oldest one's place is used again: rows that lie between freed places would keep the memory from being used.
  decltype(entries_)::node_type oldest;
  while (kind.size() > (is_certified ? bounds_.certified : bounds_.abstained) ||
         (obstacles_.AreTooMany() && kind.size() > 1)) {
    if ((oldest = entries_.extract(kind.front()))) obstacles_.Remove(*oldest.mapped().recorded.basis.obstacles);
    kind.pop_front();
  }
  if (kind.empty()) return;
  if (oldest) {
    oldest.key() = next_;
    oldest.mapped() = {};
    entries_.insert(std::move(oldest));
  }
  obstacles_.Add(*recorded.basis.obstacles);
  Entry& entry = entries_[next_++];
  entry.recorded = CaseOf(recorded);
  // A later plan of the same number is the one that states name.
  if (is_certified && entry.recorded.missing.empty()) executing_[entry.recorded.candidate->plan_id] = next_ - 1;
}

void LastCases::OnEvent(const LogEvent& event) {
  if (event.channel != channels_.robot_state || executing_.empty()) return;
  const auto state = Decoded<robot_state_t>(event.message());
  if (!state) return;
  const auto place = executing_.find(state->executing_plan_id);
  if (place == executing_.end()) return;
  const auto found = entries_.find(place->second);
  if (found == entries_.end()) return static_cast<void>(executing_.erase(place));
  Entry& entry = found->second;
  const Eigen::MatrixXd& projection = entry.recorded.basis.task->problem->projection;
  if (state->num_states != projection.cols() || projection.rows() != 2 ||
      !entry.steps.insert(state->executing_step).second)
    return;
  const Eigen::Vector2d at = projection * Eigen::Map<const Eigen::VectorXd>(state->state, state->num_states);
  if (at.allFinite() && 0 <= state->executing_step && state->executing_step <= kMaxSteps)
    entry.executed.push_back({state->executing_step, at.x(), at.y()});
}

void ReadPass(const RunLogs& run, const PageTasks& tasks, const PageBounds& bounds, unsigned threads, PagePass& pass) {
  PageRun& page = pass.rows;
  const bool has_database = !run.database.empty();
  if (has_database) ReadDatabase(run, bounds, page);
  try {
    if (!run.logs.empty()) ReadLogs(run.logs, tasks.of_run.Of(run.logs), !has_database, bounds, threads, pass);
  } catch (const BadInput& error) {
    if (!has_database) throw;
    page.notes.push_back(fmt::format("No tubes, faults and withdrawals: {}", error.what()));
  }
  const auto shadows = std::ranges::count(page.decisions, "shadow", &PageDecision::cause);
  if (page.shadow.empty() && shadows > 0)
    page.shadow = fmt::format("Shadow mode: the gate certified nothing. It would have certified {} plans.", shadows);
  PagePart& part = page.parts.emplace_back();
  part.robot = run.robot;
  for (const std::string& log : run.logs)
    part.replays[FileName(log)] = ReplayCommandOf(run.logs, tasks.config, tasks.key);
}

std::int64_t BeginOfLast(std::vector<std::int64_t> times, std::size_t most) {
  if (times.size() <= most) return std::numeric_limits<std::int64_t>::min();
  const auto first = times.end() - static_cast<std::ptrdiff_t>(most);
  if (first == times.end()) return std::numeric_limits<std::int64_t>::max();
  std::ranges::nth_element(times, first);
  return *first;
}

std::int64_t BeginOfKept(std::vector<DatedSet> sets, std::size_t most) {
  std::ranges::sort(sets, std::ranges::greater{}, &DatedSet::first);
  KeptObstacles kept(most);
  for (const auto& [time, set] : sets) {
    kept.Add(*set);
    if (kept.AreTooMany()) return time + 1;
  }
  return std::numeric_limits<std::int64_t>::min();
}

namespace {

// Erases all that is older than the last `most` of all runs. @param of what a pass has, and a time of it.
template <class Of, class TimeOf>
void KeepLastOf(const std::vector<PagePass*>& passes, std::size_t most, const Of& of, const TimeOf& time_of) {
  std::vector<std::int64_t> times;
  for (PagePass* pass : passes)
    if (pass)
      for (const auto& row : of(*pass))
        if (const std::optional<std::int64_t> time = time_of(row)) times.push_back(*time);
  const std::int64_t begin = BeginOfLast(std::move(times), most);
  if (begin == std::numeric_limits<std::int64_t>::min()) return;
  for (PagePass* pass : passes) {
    if (!pass) continue;
    auto& rows = of(*pass);
    const auto erased = std::erase_if(rows, [&](const auto& row) { return time_of(row).value_or(begin) < begin; });
    if constexpr (requires { rows.left_out; }) rows.left_out += static_cast<std::int64_t>(erased);
  }
}

}  // namespace

void KeepLast(const std::vector<PagePass*>& passes, const PageBounds& bounds) {
  const auto rows = [&](auto member, std::size_t most) {
    KeepLastOf(
        passes, most, [member](PagePass & pass) -> auto& { return pass.rows.*member; },
        [](const auto& row) { return std::optional(row.utime); });
  };
  rows(&PageRun::decisions, bounds.decisions);
  rows(&PageRun::events, bounds.events);
  rows(&PageRun::gaps, bounds.others);
  rows(&PageRun::faults, bounds.others);
  rows(&PageRun::withdrawals, bounds.others);
  for (const auto& [is_certified, most] : {std::pair(true, bounds.certified), {false, bounds.abstained}})
    KeepLastOf(
        passes, most, [](PagePass & pass) -> auto& { return pass.cases.entries(); },
        [is_certified = is_certified](const auto& entry) {
          const decision_t& decision = entry.second.recorded.decision;
          return (decision.outcome == decision_t::CERTIFIED) == is_certified ? std::optional(decision.utime)
                                                                             : std::nullopt;
        });
}

void AddRows(PageRun& page, PageRun&& run) {
  const auto move = [](auto& from, auto& to) { std::ranges::move(from, std::back_inserter(to)); };
  PagePart& part = run.parts.at(0);
  const auto move_rows = [&](auto member, std::size_t PagePart::*count) {
    part.*count = (run.*member).size();
    (page.*member).left_out += (run.*member).left_out;
    move(run.*member, page.*member);
    (run.*member).clear();
  };
  move_rows(&PageRun::decisions, &PagePart::decisions);
  move_rows(&PageRun::events, &PagePart::events);
  move_rows(&PageRun::gaps, &PagePart::gaps);
  move_rows(&PageRun::faults, &PagePart::faults);
  move_rows(&PageRun::withdrawals, &PagePart::withdrawals);
  move(run.parts, page.parts);
  move(run.notes, page.notes);
  for (PageTask& task : run.tasks)
    if (std::ranges::find(page.tasks, task.config_digest, &PageTask::config_digest) == page.tasks.end())
      page.tasks.push_back(std::move(task));
  if (!run.shadow.empty()) page.shadow += (page.shadow.empty() ? "" : " ") + run.shadow;
  page.damage += run.damage;
}

std::vector<std::vector<std::size_t>> ChooseDetails(const PageRun& page, const PageBounds& bounds) {
  auto chosen = LastDecisions(page, bounds.certified, IsCertified);
  const auto abstained = LastDecisions(page, bounds.abstained, IsJudgedAbstention);
  for (std::size_t k = 0; k < chosen.size(); ++k) std::ranges::copy(abstained[k], std::back_inserter(chosen[k]));
  return chosen;
}

std::vector<std::vector<std::size_t>> ChooseAdvised(const PageRun& page, std::size_t most) {
  return LastDecisions(page, most, [](const PageDecision& row) { return !IsCertified(row); });
}

std::string EventNameOf(const PageDecision& decision) {
  return fmt::format("{} event {}", decision.log_file, decision.event_number);
}

PageRun GatherDetails(PagePass& pass, const PageRun& page, const std::vector<std::size_t>& decisions, std::size_t bytes,
                      unsigned threads) {
  PageRun made;
  made.tasks = page.tasks;  // so that their places are the page's
  std::map<std::string, std::size_t> wanted;
  for (const std::size_t i : decisions) wanted.emplace(EventNameOf(page.decisions[i]), i);
  DetailMaker maker(bytes, threads, made);
  auto& entries = pass.cases.entries();
  for (auto entry = entries.begin(); entry != entries.end(); entry = entries.erase(entry))
    if (const auto found = wanted.find(entry->second.recorded.event); found != wanted.end())
      maker.Add(std::move(entry->second), found->second);
  maker.Finish();
  return made;
}

void AddDetails(PageRun& page, PageRun&& details, std::size_t& bytes) {
  for (PageDetail& detail : details.details) {
    TakeRoom(detail, bytes);
    page.details.push_back(std::move(detail));
  }
}

void AddMissing(PageRun& page, const NamedRuns& named) {
  for (const std::string& missing : named.missing) page.notes.push_back(fmt::format("Not read: {}.", missing));
}

PageRun EmptyPage(const std::vector<std::string>& inputs) {
  PageRun page;
  const FileKind kind = KindOf(inputs[0]);
  const bool is_log = kind != FileKind::kDirectory && kind != FileKind::kDatabase;
  const std::string name = is_log ? FileName(inputs[0]) : inputs[0];
  page.name = inputs.size() == 1 ? name : fmt::format("{} and {} more", name, inputs.size() - 1);
  return page;
}

}  // namespace forereach
