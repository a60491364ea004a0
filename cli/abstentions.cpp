#include "cli/abstentions.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <span>
#include <stdexcept>
#include <tuple>

#include <nlohmann/json.hpp>

#include "certifier/gate/candidate_message.h"
#include "lcmtypes/names.h"
#include "records/decision_json.h"
#include "records/decision_record.h"
#include "records/log_survey.h"
#include "records/log_tasks.h"
#include "records/run_logs.h"
#include "records/timeline.h"
#include "task/files.h"
#include "task/json_field.h"
#include "task/json_text.h"

namespace forereach {
namespace {

// Collects what was not certified. Problems with learned transitions are made at the end, when all of them are known.
class AbstentionReader final : public TimelineUser {
 public:
  AbstentionReader(const BusOptions& channels, std::function<bool(const std::string&)> wanted)
      : channels_(channels), wanted_(std::move(wanted)) {}

  void OnEvent(const LogEvent& event) override {
    if (event.channel == channels_.candidate) ++waiting_;
    if (event.channel != channels_.obstacles) return;
    const Bytes message = event.message();
    last_obstacles_ = std::make_shared<const Message>(std::vector(message.begin(), message.end()), event.utime);
  }

  void OnStart(const Config&) override {
    waiting_ = 0;
    last_obstacles_.reset();
  }

  void OnDecision(const RecordedDecision& recorded) override {
    const decision_t& decision = recorded.decision;
    const std::size_t waiting = recorded.candidate && waiting_ > 0 ? waiting_-- : 0;
    if (decision.outcome == decision_t::CERTIFIED) {
      ++certified_;
      return;
    }
    if (wanted_ && !wanted_(recorded.event)) return;
    RecordedAbstention& abstention = all_.emplace_back();
    bases_.push_back(recorded.basis);
    abstention.event = recorded.event;
    abstention.name = recorded.event + ", plan " + std::to_string(decision.plan_id) + " of " + GetText(decision.source);
    abstention.message = GetText(decision.message);
    abstention.outcome = decision.outcome;
    abstention.cause = decision.cause;
    abstention.task = recorded.basis.task;
    abstention.decision = decision;
    abstention.waiting = waiting;
    if (decision.cause == decision_t::CAUSE_NO_OBSTACLES) abstention.last_obstacles = last_obstacles_;
    if (!recorded.candidate) {
      abstention.missing = "its candidate is not in the log";
      return;
    }
    const auto candidate = Decoded<candidate_plan_t>(recorded.candidate->bytes);
    if (!candidate) return;
    abstention.candidate = *candidate;
    if (decision.outcome == decision_t::REJECTED || decision.outcome == decision_t::ABSTAIN_DEADLINE ||
        decision.outcome == decision_t::ABSTAIN_OBSTACLES)
      return;
    if (!recorded.is_of_known_task) {
      abstention.missing = "it was decided under a task that is not kept next to the log";
      return;
    }
    const Config& task = *recorded.basis.task;
    if (!HasSizes(*candidate, *task.problem->model)) {  // a log may hold anything
      abstention.missing = "its candidate is not of this task's sizes";
      return;
    }
    for (const std::string& why : {WhyNoSchedule(*candidate, task.gate), WhyNoStep(*candidate, task.gate)})
      if (abstention.missing.empty()) abstention.missing = why;
    if (!abstention.missing.empty()) return;
    Case& judged = abstention.judged;
    try {
      judged.initial_set = InitialSetOf(*candidate);
    } catch (const std::invalid_argument& error) {
      abstention.missing = std::string("its initial set: ") + error.what();
      return;
    }
    judged.schedule = ScheduleOf(*candidate, task.gate);
    const Plan plan = PlanOf(*candidate, judged.schedule);
    judged.controls.resize(plan.num_inputs, plan.num_steps);
    for (int t = 0; t < plan.num_steps; ++t)
      judged.controls.col(t) = Eigen::Map<const Eigen::VectorXd>(plan.input(t).data(), plan.num_inputs);
    judged.obstacles = *recorded.basis.obstacles;
    judged.progress_steps = candidate->progress_steps;
  }

  void Finish(Timeline& timeline, Abstentions& read) {
    std::map<std::tuple<const Config*, std::size_t, std::size_t>, std::shared_ptr<const Problem>> problems;
    for (std::size_t i = 0; i < all_.size(); ++i) {
      const Basis& basis = bases_[i];
      if (all_[i].judged.controls.size() == 0) continue;
      auto& problem = problems[{basis.task, basis.learned_begin, basis.learned_end}];
      if (!problem)
        problem = WithLearned(basis.task->problem,
                              std::span(timeline.learned(*basis.task))
                                  .subspan(basis.learned_begin, basis.learned_end - basis.learned_begin));
      all_[i].judged.problem = problem;
    }
    read.all = std::move(all_);
    read.certified = certified_;
    read.passed_over = timeline.passed_over();
  }

 private:
  using Message = std::pair<std::vector<std::uint8_t>, std::int64_t>;

  const BusOptions channels_;
  const std::function<bool(const std::string&)> wanted_;
  std::size_t waiting_ = 0;
  std::shared_ptr<const Message> last_obstacles_;
  std::vector<RecordedAbstention> all_;
  std::vector<Basis> bases_;  // of each
  std::int64_t certified_ = 0;
};

}  // namespace

Abstentions AbstentionOf(const std::string& path, const std::string& config_path) try {
  const nlohmann::json json = ParseJson(ReadWhole(path, kLargestJsonFile));
  Abstentions read;
  read.tasks.push_back(
      std::make_shared<const Config>(LoadConfig(config_path.empty() ? TaskOf(path, json) : config_path)));
  const Config& task = *read.tasks.front();
  if (IsCertificate(path, json)) {
    read.certified = 1;
    return read;
  }
  const JsonField document(path, json), steps = document["inputs"]["controls"], set = document["inputs"]["initial_set"];
  const auto n = static_cast<std::size_t>(task.problem->model->num_states());
  const auto m = static_cast<std::size_t>(task.problem->model->num_inputs());
  RecordedAbstention& abstention = read.all.emplace_back();
  abstention.name = path;
  abstention.message = document["message"].Text();
  abstention.task = &task;
  for (const std::int16_t outcome :
       {decision_t::ABSTAIN_FALSIFIED, decision_t::ABSTAIN_DOMAIN, decision_t::ABSTAIN_SAFETY})
    if (document["outcome"].Text() == OutcomeName(outcome)) abstention.outcome = outcome;
  Case& judged = abstention.judged;
  judged.problem = task.problem;
  judged.controls.resize(static_cast<Eigen::Index>(m), static_cast<Eigen::Index>(steps.Count()));
  for (std::size_t t = 0; t < steps.Count(); ++t)
    judged.controls.col(static_cast<Eigen::Index>(t)) = steps[t].Numbers(m);
  judged.schedule = ScheduleFromZero(task, static_cast<int>(steps.Count()));
  const Eigen::VectorXd lower = set["lower"].Numbers(n), upper = set["upper"].Numbers(n);
  if (!(lower.array() <= upper.array()).all()) set.Fail("a lower bound is above its upper one");
  judged.initial_set = Zonotope::Enclose(Box(lower, upper));
  judged.obstacles = task.obstacles;
  return read;
} catch (const nlohmann::json::exception& error) {
  throw ConfigError(path + ": it " + DescribeJsonError(error));
}

Abstentions ReadAbstentions(const RunLogs& run, const RunTasks& tasks, bool names_files,
                            const std::function<bool(const std::string& event)>& wanted) {
  Abstentions read;
  LogTasks of_run = tasks.Of(run.logs);
  if (!of_run.has_decisions() && tasks.is_many()) return read;
  of_run.RequirePlans();
  AbstentionReader reader(of_run.first().bus, wanted);
  Timeline timeline(of_run, {&reader});
  timeline.Read(run.logs, names_files);
  reader.Finish(timeline, read);
  read.tasks = of_run.found();
  return read;
}

}  // namespace forereach
