#include "page/gather.h"

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <map>
#include <memory>
#include <numeric>
#include <ranges>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "forereach/certify/explain.h"
#include "forereach/fault_t.hpp"
#include "forereach/robot_state_t.hpp"
#include "lcmtypes/names.h"
#include "page/detail.h"
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
  if (!config.empty()) command += " --config " + Quoted(config);
  if (!key.file.empty()) command += " --key " + Quoted(key.file);
  return command + (key.none ? " --no-key" : "");
}

// ---- Rows.

// Takes the rows of a log and what no row tells.
class RowReader final : public TimelineUser {
 public:
  /** @param makes_rows false: they are known already. */
  RowReader(const BusOptions& channels, bool makes_rows, PageRun& run)
      : channels_(channels), makes_rows_(makes_rows), interpreter_(channels, ""), run_(run) {}

  void Continue(const std::string& log_file) { interpreter_.Continue(log_file); }

  void OnEvent(const LogEvent& event) override {
    if (makes_rows_) {
      Rows rows;
      interpreter_.Observe(event, rows);
      std::ranges::move(rows.decisions, std::back_inserter(run_.decisions));
      std::ranges::move(rows.events, std::back_inserter(run_.events));
      std::ranges::move(rows.gaps, std::back_inserter(run_.gaps));
    }
    if (event.channel != channels_.fault) return;
    const auto fault = Decoded<fault_t>(event.message());
    if (!fault || !faults_.emplace(fault->utime, fault->cause).second) return;  // it is repeated until a reset
    run_.faults.push_back(
        {fault->utime, fault->plan_id, std::string(FaultName(fault->cause)), GetText(fault->message)});
  }

  void OnWithdrawn(const RecordedWithdrawal& recorded) override {
    const withdrawal_t& withdrawal = recorded.withdrawal;
    run_.withdrawals.push_back({withdrawal.utime, withdrawal.plan_id, GetText(withdrawal.source),
                                std::string(WithdrawalName(withdrawal.cause)), GetText(withdrawal.message),
                                withdrawal.valid_steps});
  }

 private:
  const BusOptions channels_;
  const bool makes_rows_;
  Interpreter interpreter_;  // the timeline has looked at the key
  std::set<std::pair<std::int64_t, std::int16_t>> faults_;
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

bool IsCertified(const DecisionRow& row) { return row.outcome == OutcomeName(decision_t::CERTIFIED); }

bool IsJudgedAbstention(const DecisionRow& row) {
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

  void Add(const LastCases::Entry& entry, std::size_t decision) {
    const RecordedCase& recorded = entry.recorded;
    PageDetail& detail = run_.details.emplace_back();
    detail.decision = decision;
    obstacles_.push_back(recorded.basis.obstacles);
    detail.missing = recorded.missing;
    if (!detail.missing.empty()) return;
    detail.executed = entry.executed;
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
    run_.details[judged.place].missing = "it cannot be judged again: " + why;
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
void ReadRows(const Logs& logs, LogTasks& tasks, bool makes_rows, PageRun& run, PagePass& pass) {
  RowReader reader(tasks.first().bus, makes_rows, run);
  ShadowTally shadow(1);
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
    run.notes.push_back("Messages were passed over" + passed_over + ".");
}

void ReadLogs(const Logs& logs, LogTasks tasks, bool makes_rows, PageRun& page, PagePass& pass) {
  pass.was_read = true;
  if (!tasks.has_decisions() && !makes_rows) return;
  ReadRows(logs, tasks, makes_rows, page, pass);
  AddTasks(tasks, page);
  pass.tasks = tasks.found();
}

void ReadDatabase(const RunLogs& run, PageRun& page) {
  Database database(run.database);
  std::vector<std::string> files;
  for (const RunRow& row : run.missing) files.push_back(row.log_file);
  for (const std::string& log : run.logs) files.push_back(FileName(log));
  for (const std::string& file : files) {
    Rows rows = database.Read(file);
    std::ranges::move(rows.decisions, std::back_inserter(page.decisions));
    std::ranges::move(rows.events, std::back_inserter(page.events));
    std::ranges::move(rows.gaps, std::back_inserter(page.gaps));
  }
}

// The numbers of new rows are noted when all of them are there.
void AddPart(const RunLogs& run, const PageTasks& tasks, PageRun& page) {
  PagePart& part = page.parts.emplace_back();
  part.robot = run.robot;
  for (const std::string& log : run.logs)
    part.replays[FileName(log)] = ReplayCommandOf(run.logs, tasks.config, tasks.key);
  part.decisions = page.decisions.size();
  part.events = page.events.size();
  part.gaps = page.gaps.size();
  part.faults = page.faults.size();
  part.withdrawals = page.withdrawals.size();
}

}  // namespace

void LastCases::OnStart(const Config& task) { channels_ = task.bus; }

void LastCases::OnDecision(const RecordedDecision& recorded) {
  const auto outcome = recorded.decision.outcome;
  const bool is_certified = outcome == decision_t::CERTIFIED;
  if (!is_certified && outcome != decision_t::ABSTAIN_FALSIFIED && outcome != decision_t::ABSTAIN_DOMAIN &&
      outcome != decision_t::ABSTAIN_SAFETY)
    return;
  std::deque<std::int64_t>& kind = is_certified ? certified_ : abstained_;
  kind.push_back(next_);
  Entry& entry = entries_[next_++];
  entry.recorded = CaseOf(recorded);
  if (is_certified && entry.recorded.missing.empty()) executing_[entry.recorded.candidate->plan_id] = next_ - 1;
  if (kind.size() <= (is_certified ? bounds_.certified : bounds_.abstained)) return;
  entries_.erase(kind.front());
  kind.pop_front();
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

PageRun GatherRows(const RunLogs& run, const PageTasks& tasks, PagePass& pass) {
  PageRun page;
  const bool has_database = !run.database.empty();
  if (has_database) ReadDatabase(run, page);
  try {
    if (!run.logs.empty()) ReadLogs(run.logs, tasks.of_run.Of(run.logs), !has_database, page, pass);
  } catch (const BadInput& error) {
    if (!has_database) throw;
    page.notes.push_back(std::string("No tubes, faults and withdrawals: ") + error.what());
  }
  const auto shadows = std::ranges::count(page.decisions, "shadow", &DecisionRow::cause);
  if (page.shadow.empty() && shadows > 0)
    page.shadow = fmt::format("Shadow mode: the gate certified nothing. It would have certified {} plans.", shadows);
  AddPart(run, tasks, page);
  return page;
}

void AddRows(PageRun& page, PageRun&& run) {
  const auto move = [](auto& from, auto& to) { std::ranges::move(from, std::back_inserter(to)); };
  move(run.decisions, page.decisions);
  move(run.events, page.events);
  move(run.gaps, page.gaps);
  move(run.faults, page.faults);
  move(run.withdrawals, page.withdrawals);
  move(run.parts, page.parts);
  move(run.notes, page.notes);
  for (PageTask& task : run.tasks)
    if (std::ranges::find(page.tasks, task.config_digest, &PageTask::config_digest) == page.tasks.end())
      page.tasks.push_back(std::move(task));
  if (!run.shadow.empty()) page.shadow += (page.shadow.empty() ? "" : " ") + run.shadow;
  page.damage += run.damage;
}

std::vector<std::vector<std::size_t>> ChooseDetails(const PageRun& page, const DetailBounds& bounds) {
  auto chosen = LastDecisions(page, bounds.certified, IsCertified);
  const auto abstained = LastDecisions(page, bounds.abstained, IsJudgedAbstention);
  for (std::size_t k = 0; k < chosen.size(); ++k) std::ranges::copy(abstained[k], std::back_inserter(chosen[k]));
  return chosen;
}

std::vector<std::vector<std::size_t>> ChooseAdvised(const PageRun& page, std::size_t most) {
  return LastDecisions(page, most, [](const DecisionRow& row) { return !IsCertified(row); });
}

std::string EventName(const LogReference& event) {
  return fmt::format("{} event {}", event.log_file, event.event_number);
}

void ReadAgain(const RunLogs& run, const PageTasks& tasks, PagePass& pass) try {
  PageRun known;
  if (!run.logs.empty()) ReadLogs(run.logs, tasks.of_run.Of(run.logs), false, known, pass);
} catch (const BadInput&) {  // noted when the rows were read
}

PageRun GatherDetails(const PagePass& pass, const PageRun& page, const std::vector<std::size_t>& decisions,
                      std::size_t bytes, unsigned threads) {
  PageRun made;
  made.tasks = page.tasks;  // so that their places are the page's
  std::map<std::string, std::size_t> wanted;
  for (const std::size_t i : decisions) wanted.emplace(EventName(page.decisions[i].event), i);
  DetailMaker maker(bytes, threads, made);
  for (const auto& [place, entry] : pass.cases.entries())
    if (const auto found = wanted.find(entry.recorded.event); found != wanted.end()) maker.Add(entry, found->second);
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
  for (const std::string& missing : named.missing) page.notes.push_back("Not read: " + missing + ".");
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
