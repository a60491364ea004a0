#include "page/gather.h"

#include <algorithm>
#include <filesystem>
#include <memory>
#include <set>
#include <thread>
#include <utility>

#include "certifier/certify/batch.h"
#include "forereach/fault_t.hpp"
#include "forereach/robot_state_t.hpp"
#include "lcmtypes/names.h"
#include "page/detail.h"
#include "records/database.h"
#include "records/interpreter.h"
#include "records/log_directory.h"
#include "records/log_survey.h"
#include "records/log_tasks.h"
#include "records/timeline.h"

namespace forereach {
namespace {

using Logs = std::vector<std::string>;

std::string FileName(const std::string& path) { return std::filesystem::path(path).filename().string(); }

std::string EventName(const LogReference& event) {
  return event.log_file + " event " + std::to_string(event.event_number);
}

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

using Wanted = std::map<std::string, std::size_t>;  // by the name of a decision's event: its place

bool IsJudged(const DecisionRow& row) {
  return row.outcome == OutcomeName(decision_t::ABSTAIN_FALSIFIED) ||
         row.outcome == OutcomeName(decision_t::ABSTAIN_DOMAIN) ||
         row.outcome == OutcomeName(decision_t::ABSTAIN_SAFETY);
}

Wanted Choose(const std::vector<DecisionRow>& decisions, const DetailBounds& bounds) {
  Wanted wanted;
  std::size_t certified = 0, abstained = 0;
  for (std::size_t i = decisions.size(); i-- > 0;) {
    const bool is_certified = decisions[i].outcome == OutcomeName(decision_t::CERTIFIED);
    if (is_certified ? certified++ < bounds.certified : IsJudged(decisions[i]) && abstained++ < bounds.abstained)
      wanted.emplace(EventName(decisions[i].event), i);
  }
  return wanted;
}

// Certifies the wanted candidates of logs again.
class DetailMaker final : public TimelineUser {
 public:
  DetailMaker(const Wanted& wanted, const BusOptions& channels, std::size_t numbers, PageRun& run)
      : wanted_(wanted), channels_(channels), numbers_(numbers), run_(run) {}

  void OnStart(const Config& task) override {
    CertifyAgain();
    certifier_ = std::make_unique<Certifier>(task.problem);
  }
  void OnReload(const Config& task) override { OnStart(task); }
  void OnObstacles(Bytes, std::int64_t) override { CertifyAgain(); }
  void OnTransition(const ExecutedTransition& transition, Bytes) override {
    CertifyAgain();
    static_cast<void>(certifier_->Learn(transition.z, transition.next));
  }

  void OnDecision(const RecordedDecision& recorded) override {
    const auto found = wanted_.find(recorded.event);
    if (found == wanted_.end()) return;
    const std::size_t place = run_.details.size();
    PageDetail& detail = run_.details.emplace_back();
    detail.decision = found->second;
    if (!recorded.candidate) return Miss(detail, "its candidate is not in the log");
    const auto candidate = Decoded<candidate_plan_t>(recorded.candidate->bytes);
    if (!candidate) return Miss(detail, "its candidate cannot be read");
    if (!recorded.is_of_known_task) return Miss(detail, "its task is not kept next to the log");
    const Config& task = *recorded.basis.task;
    if (const std::string why = WhyNotJudged(*candidate, task); !why.empty()) return Miss(detail, why);
    detail.task = TaskIndex(task);
    detail.obstacles = ObstaclesIndex(recorded.basis);
    if (recorded.decision.outcome == decision_t::CERTIFIED) executing_[candidate->plan_id] = {place, &task};
    obstacles_ = recorded.basis.obstacles;
    pending_.push_back(
        {{*candidate, ScheduleOf(*candidate, task.gate), recorded.decision.outcome, recorded.decision.step}, place});
    if (pending_.size() >= kBatch) CertifyAgain();
  }

  void OnEvent(const LogEvent& event) override {
    if (event.channel != channels_.robot_state || executing_.empty()) return;
    const auto state = Decoded<robot_state_t>(event.message());
    if (!state) return;
    const auto found = executing_.find(state->executing_plan_id);
    if (found == executing_.end()) return;
    const auto& [place, task] = found->second;
    const Eigen::MatrixXd& projection = task->problem->projection;
    if (state->num_states != projection.cols() || projection.rows() != 2 ||
        !steps_.insert({place, state->executing_step}).second)
      return;
    const Eigen::Vector2d at = projection * Eigen::Map<const Eigen::VectorXd>(state->state, state->num_states);
    if (at.allFinite() && 0 <= state->executing_step && state->executing_step <= kMaxSteps)
      run_.details[place].executed.push_back({state->executing_step, at.x(), at.y()});
  }

  void Finish() { CertifyAgain(); }

 private:
  static constexpr std::size_t kBatch = 256;
  static constexpr std::size_t kNumbersOfObstacle = 10;
  static constexpr const char* kFull = "the drawings of this page have reached their bound";

  struct Pending : JudgedCandidate {
    std::size_t place;  // in PageRun::details
  };

  static void Miss(PageDetail& detail, std::string why) { detail.missing = std::move(why); }

  int TaskIndex(const Config& task) {
    const std::string digest = ToHex(task.grounds.config);
    const auto found = std::ranges::find(run_.tasks, digest, &PageTask::config_digest);
    return found == run_.tasks.end() ? -1 : static_cast<int>(found - run_.tasks.begin());
  }

  // -1: there is no room for them.
  int ObstaclesIndex(const Basis& basis) {
    const auto [found, is_new] = sets_.try_emplace(basis.grounds.obstacles, -1);
    if (!is_new || !TakeRoom(kNumbersOfObstacle * basis.obstacles->size())) return found->second;
    found->second = static_cast<int>(run_.obstacle_sets.size());
    run_.obstacle_sets.push_back(*basis.obstacles);
    return found->second;
  }

  bool TakeRoom(std::size_t numbers) {
    if (numbers > numbers_) return false;
    numbers_ -= numbers;
    return true;
  }

  // All that were decided on under the same obstacles and observations.
  void CertifyAgain() {
    if (pending_.empty()) return;
    std::vector<Plan> plans;
    std::vector<Zonotope> initial_sets;
    std::vector<const Pending*> asked;
    for (const Pending& each : pending_) try {
        const Zonotope initial_set = InitialSetOf(each.candidate);
        const Plan plan = PlanOf(each.candidate, each.schedule);
        certifier_->Require(plan, initial_set, *obstacles_);
        plans.push_back(plan);
        initial_sets.push_back(initial_set);
        asked.push_back(&each);
      } catch (const std::invalid_argument& error) {
        run_.details[each.place].missing = std::string("it cannot be judged again: ") + error.what();
      }
    const auto describe = [&](std::size_t i, const Decision& again, const Tube& tube) {
      Describe(*certifier_, *asked[i], again, tube, run_.details[asked[i]->place]);
    };
    const unsigned threads = std::max(1u, std::thread::hardware_concurrency());
    static_cast<void>(CertifyAll(*certifier_, plans, initial_sets, *obstacles_, threads, describe));
    for (const Pending* each : asked) {
      PageDetail& detail = run_.details[each->place];
      if (TakeRoom(detail.sketch.points.size() + detail.bodies.points.size())) continue;
      detail.sketch = detail.bodies = {};
      detail.missing = kFull;
    }
    pending_.clear();
  }

  const Wanted& wanted_;
  const BusOptions channels_;
  std::size_t numbers_;  // for which there is room
  PageRun& run_;
  std::unique_ptr<Certifier> certifier_;  // as the one of the log was when it decided on those below
  std::vector<Pending> pending_;          // under the obstacles below, and not yet certified again
  std::shared_ptr<const std::vector<Obstacle>> obstacles_;
  std::map<Digest, int> sets_;
  std::map<std::int64_t, std::pair<std::size_t, const Config*>> executing_;  // by plan
  std::set<std::pair<std::size_t, int>> steps_;                              // that have an executed state
};

// ---- Inputs.

void AddTasks(const std::vector<Config>& tasks, PageRun& run) {
  for (const Config& task : tasks) {
    const std::string digest = ToHex(task.grounds.config);
    if (std::ranges::find(run.tasks, digest, &PageTask::config_digest) != run.tasks.end()) continue;
    const NominalModel& model = *task.problem->model;
    run.tasks.push_back({digest, model.name(), model.state_names(), model.input_names(), HoldsName(*task.problem),
                         task.problem->body.parts.size()});
  }
}

void ReadRows(const Logs& logs, const std::vector<Config>& tasks, bool makes_rows, PageRun& run) {
  RowReader reader(tasks.front().bus, makes_rows, run);
  Timeline timeline(PointersTo(tasks), reader);
  for (const std::string& log : logs) {
    reader.Continue(FileName(log));
    timeline.Read({log}, true);
  }
  run.damage += timeline.damage();
  if (const std::string passed_over = DescribePassedOver(timeline.passed_over()); !passed_over.empty())
    run.notes.push_back("Messages were passed over" + passed_over + ".");
}

void AddDetails(const Logs& logs, const std::vector<Config>& tasks, const Wanted& wanted, std::size_t& numbers,
                PageRun& run) {
  if (wanted.empty()) return;
  DetailMaker maker(wanted, tasks.front().bus, numbers, run);
  Timeline timeline(PointersTo(tasks), maker);
  for (const std::string& log : logs) timeline.Read({log}, true);
  maker.Finish();
}

void AddReplays(const Logs& logs, const std::string& config, const LogKey& key, PageRun& run) {
  for (const std::string& log : logs) run.replays[FileName(log)] = ReplayCommandOf(logs, config, key);
}

PageRun FromLogs(const Logs& logs, const std::string& config, const LogKey& key, const DetailBounds& bounds) {
  const std::vector<Config> tasks = TasksOf(logs, config, key);
  PageRun run;
  run.name =
      logs.size() == 1 ? FileName(logs[0]) : FileName(logs[0]) + " and " + std::to_string(logs.size() - 1) + " more";
  run.files = logs;
  AddTasks(tasks, run);
  ReadRows(logs, tasks, true, run);
  AddReplays(logs, config, key, run);
  std::size_t numbers = bounds.numbers;
  AddDetails(logs, tasks, Choose(run.decisions, bounds), numbers, run);
  return run;
}

// The logs beside a database, those of a run together. Notes those that are missing.
std::vector<Logs> LogsOf(Database& database, PageRun& run) {
  std::vector<Logs> runs;
  std::string before;
  for (const RunRow& row : database.Runs()) {
    if (row.continues.empty() || row.continues != before || runs.empty()) runs.emplace_back();
    before = row.log_file;
    const std::string log = (std::filesystem::path(database.path()).parent_path() / row.log_file).string();
    if (std::filesystem::exists(log))
      runs.back().push_back(log);
    else
      run.notes.push_back(row.log_file + (row.log_deleted_utime
                                              ? " was deleted for the quota: its decisions are shown without tubes."
                                              : " is not beside the database: its decisions are shown without tubes."));
  }
  std::erase_if(runs, [](const Logs& logs) { return logs.empty(); });
  return runs;
}

PageRun FromDatabase(const std::string& path, const std::string& config, const LogKey& key,
                     const DetailBounds& bounds) {
  Database database(path);
  Rows rows = database.Read();
  PageRun run;
  run.name = path;
  run.files = {path};
  run.decisions = std::move(rows.decisions);
  run.events = std::move(rows.events);
  run.gaps = std::move(rows.gaps);
  const Wanted wanted = Choose(run.decisions, bounds);
  std::size_t numbers = bounds.numbers;
  for (const Logs& logs : LogsOf(database, run)) try {
      const LogSurvey survey = Survey(logs, LogOrder::kAny);
      if (survey.order.empty()) continue;
      std::vector<Config> tasks =
          TasksOf(survey, logs.front(), std::filesystem::path(path).parent_path().string(), config);
      key.Override(tasks, config);
      AddTasks(tasks, run);
      ReadRows(logs, tasks, false, run);
      AddReplays(logs, config, key, run);
      AddDetails(logs, tasks, wanted, numbers, run);
    } catch (const BadInput& error) {
      run.notes.push_back(std::string("No tubes, faults and withdrawals: ") + error.what());
    }
  return run;
}

}  // namespace

PageRun GatherPage(const Logs& inputs, const std::string& config, const LogKey& key, const DetailBounds& bounds) {
  if (inputs.size() != 1) return FromLogs(inputs, config, key, bounds);
  const std::string& input = inputs.front();
  const FileKind kind = KindOf(input);
  if (kind == FileKind::kDatabase) return FromDatabase(input, config, key, bounds);
  if (kind != FileKind::kDirectory) return FromLogs(inputs, config, key, bounds);
  const std::string database = (std::filesystem::path(input) / LogDirectory::kDatabase).string();
  if (std::filesystem::exists(database)) return FromDatabase(database, config, key, bounds);
  const LogDirectory directory(input);
  Logs logs;
  for (const std::string& log : directory.Logs()) logs.push_back(directory.PathOf(log));
  if (logs.empty()) throw ConfigError(input + ": neither a decision database nor logs in this directory");
  return FromLogs(logs, config, key, bounds);
}

}  // namespace forereach
