#include "advise/abstentions.h"

#include <algorithm>
#include <iterator>
#include <stdexcept>

#include <fmt/core.h>
#include <nlohmann/json.hpp>

#include "lcmtypes/names.h"
#include "records/decision_json.h"
#include "records/decision_record.h"
#include "records/recorded_case.h"
#include "task/files.h"
#include "task/json_field.h"
#include "task/json_text.h"

namespace forereach {

namespace {

// What the candidate was judged by, but for what was learned.
void Fill(const RecordedCase& recorded, RecordedAbstention& abstention) try {
  Case& judged = abstention.judged;
  judged.initial_set = InitialSetOf(*recorded.candidate);
  judged.schedule = ScheduleOf(*recorded.candidate, recorded.basis.task->gate);
  const Plan plan = PlanOf(*recorded.candidate, judged.schedule);
  judged.controls.resize(plan.num_inputs, plan.num_steps);
  for (int t = 0; t < plan.num_steps; ++t)
    judged.controls.col(t) = Eigen::Map<const Eigen::VectorXd>(plan.input(t).data(), plan.num_inputs);
  judged.progress_steps = recorded.candidate->progress_steps;
} catch (const std::invalid_argument& error) {
  abstention.missing = fmt::format("its initial set: {}", error.what());
}

}  // namespace

void AbstentionReader::OnEvent(const LogEvent& event) {
  if (event.channel == channels_.candidate) ++waiting_;
  if (event.channel != channels_.obstacles) return;
  const Bytes message = event.message();
  last_obstacles_ = std::make_shared<const std::pair<std::vector<std::uint8_t>, std::int64_t>>(
      std::vector(message.begin(), message.end()), event.utime);
}

void AbstentionReader::OnStart(const Config& task) {
  channels_ = task.bus;
  waiting_ = 0;
  last_obstacles_.reset();
}

void AbstentionReader::OnDecision(const RecordedDecision& recorded) {
  const decision_t& decision = recorded.decision;
  const std::size_t waiting = recorded.candidate && waiting_ > 0 ? waiting_-- : 0;
  if (decision.outcome == decision_t::CERTIFIED) {
    ++read_.certified;
    return;
  }
  std::list<RecordedAbstention> place;  // of the oldest, which is used again
  while (!all_.empty() && (all_.size() >= most_ || obstacles_.AreTooMany())) {
    obstacles_.Remove(*all_.front().basis.obstacles);
    place.clear();
    place.splice(place.end(), all_, all_.begin());
    ++read_.left_out;
  }
  place.resize(1);
  place.back() = {};
  all_.splice(all_.end(), place);
  obstacles_.Add(*recorded.basis.obstacles);
  RecordedAbstention& abstention = all_.back();
  abstention.basis = recorded.basis;
  abstention.event = recorded.event;
  abstention.name = fmt::format("{}, plan {} of {}", recorded.event, decision.plan_id, GetText(decision.source));
  abstention.message = GetText(decision.message);
  abstention.outcome = decision.outcome;
  abstention.cause = decision.cause;
  abstention.task = recorded.basis.task;
  abstention.decision = decision;
  abstention.waiting = waiting;
  if (decision.cause == decision_t::CAUSE_NO_OBSTACLES) abstention.last_obstacles = last_obstacles_;
  const RecordedCase judged = CaseOf(recorded);
  if (!recorded.candidate) abstention.missing = judged.missing;
  if (!judged.candidate) return;
  abstention.candidate = *judged.candidate;
  // None of these was judged by its numbers.
  if (decision.outcome == decision_t::REJECTED || decision.outcome == decision_t::ABSTAIN_DEADLINE ||
      decision.outcome == decision_t::ABSTAIN_OBSTACLES)
    return;
  abstention.missing = judged.missing;
  if (abstention.missing.empty()) Fill(judged, abstention);
}

Abstentions AbstentionReader::Finish(std::vector<std::shared_ptr<const Config>> tasks) {
  read_.tasks = std::move(tasks);
  std::ranges::move(all_, std::back_inserter(read_.all));
  all_.clear();
  return std::move(read_);
}

Case RecordedAbstention::Judged() const {
  Case made = judged;
  if (!basis.task) return made;
  made.problem = basis.problem();
  made.obstacles = *basis.obstacles;
  return made;
}

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
  throw ConfigError("{}: it {}", path, DescribeJsonError(error));
}

Abstentions ReadAbstentions(const RunLogs& run, const RunTasks& tasks, bool names_files, std::size_t most) {
  LogTasks of_run = tasks.Of(run.logs);
  if (!of_run.has_decisions() && tasks.is_many()) return {};
  of_run.RequirePlans();
  AbstentionReader reader(most);
  Timeline timeline(of_run, {&reader});
  timeline.Read(run.logs, names_files);
  Abstentions read = reader.Finish(of_run.found());
  read.passed_over = timeline.passed_over();
  return read;
}

}  // namespace forereach
