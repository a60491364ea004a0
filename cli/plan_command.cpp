#include <cstdint>
#include <iostream>
#include <limits>

#include <fmt/core.h>

#include "advise/task_check.h"
#include "cli/commands.h"
#include "forereach/certify/explain.h"
#include "lcmtypes/printable.h"
#include "planner_bridge/certified_plan.h"
#include "records/decision_json.h"
#include "task/config.h"

namespace forereach {
namespace {

struct PlanArguments {
  std::string config, out;
  std::uint32_t seed = 1;
};

// Quoted for a shell.
std::string Quoted(const std::string& word) {
  constexpr const char* kPlain = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-./=:,+@%";
  if (!word.empty() && word.find_first_not_of(kPlain) == std::string::npos) return word;
  std::string quoted = "'";
  for (const char c : word) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

std::string PositionText(const Eigen::VectorXd& position) {
  std::string text;
  for (Eigen::Index k = 0; k < position.size(); ++k) text += fmt::format("{}{:.4g}", k == 0 ? "(" : ", ", position(k));
  return text + ")";
}

// What keeps every plan from being certified, by the examination of the task.
std::string FindingsOf(const PlanArguments& options) {
  std::string text;
  for (const TaskFinding& finding : CheckTask({options.config, "", 0}).findings)
    if (!finding.is_remark) text += fmt::format("\n{}{}\n    {}", finding.place, finding.what, finding.advice);
  return text;
}

int ReportFailure(const PlanArguments& options, const Config& config, const CertifiedPlan& plan) {
  const std::string findings = FindingsOf(options);
  std::cerr << "forereach plan: no certified plan from task.initial_set with seed " << options.seed << ": ";
  if (plan.candidates == 0)
    std::cerr << "none of " << config.planner.candidates << " searches found a candidate"
              << (findings.empty() ? "; a smaller planner.clearance or a larger planner.time_limit_ms may help" : "");
  else
    std::cerr << plan.candidates << (plan.candidates == 1 ? " candidate was" : " candidates were")
              << " not certified, the last: " << Explain(plan.decision, *config.problem, config.obstacles);
  std::cerr << "; " << options.out << " is not written" << PrintableLines(findings) << std::endl;
  return 1;
}

int MakePlan(const PlanArguments& options) {
  const Config config = LoadConfig(options.config);
  RequireForCertifying(config);
  const auto proposer = MakeProposer(config);
  const Certifier certifier(config.problem);
  const CertifiedPlan plan =
      FindCertifiedPlan(*proposer, certifier, config, options.seed, ScheduleFromZero(config, kMaxSteps));
  if (plan.controls.cols() == 0) return ReportFailure(options, config, plan);
  SavePlan(options.out, *config.problem->model, plan.controls);
  const auto& goal = config.planner.goal;
  const double away = (plan.end - Eigen::Map<const Eigen::VectorXd>(goal.data(), std::ssize(goal))).norm();
  std::cout << options.out << ": " << plan.controls.cols() << " steps, the last "
            << plan.controls.cols() - plan.progress_steps << " brake to a stop at about " << PositionText(plan.end)
            << "\n  " << Explain(plan.decision, *config.problem, config.obstacles) << "\n";
  if (!plan.reaches_goal)
    std::cout << "  The goal is " << away
              << " m further. This is as far as a single plan was certified; `forereach run "
              << "--config " << Quoted(options.config) << "` drives on with a new plan every few steps.\n";
  std::cout << "  now: forereach certify --config " << Quoted(options.config) << " --plan " << Quoted(options.out)
            << std::endl;
  return 0;
}

}  // namespace

Command PlanCommand() {
  const auto options = std::make_shared<PlanArguments>();
  return {.name = "plan",
          .footer =
              "The task's planner proposes, and the task's certifier decides on each candidate. The written plan is "
              "certified\n"
              "and ends in a stop. It is the longest plan towards the goal that could be certified.\n\n"
              "Example:\n  forereach plan --config config/demo.yaml --out plan.csv",
          .options = {TaskOption(options->config),
                      Required({"--out", &options->out, "FILE.csv", "The file for the controls"}),
                      {"--seed", &options->seed, "", "Equal seeds give equal plans",
                       NumberRange{0, std::numeric_limits<std::uint32_t>::max()}}},
          .run = [options] { return MakePlan(*options); }};
}

}  // namespace forereach
