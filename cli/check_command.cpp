#include <algorithm>
#include <iostream>
#include <memory>
#include <vector>

#include <fmt/core.h>
#include <nlohmann/json.hpp>

#include "advise/task_check.h"
#include "cli/commands.h"
#include "forereach/numerics/limits.h"
#include "forereach/numerics/text.h"
#include "identify/declare_data.h"
#include "task/json_text.h"

namespace forereach {
namespace {

using Json = nlohmann::json;

struct CheckArguments {
  TaskCheckOptions check;
  std::string picture;
  bool json = false;
};

// The steps for which widths are shown: about ten, among them the first and the last.
std::vector<std::size_t> ShownSteps(std::size_t last) {
  std::vector<std::size_t> steps;
  const std::size_t stride = std::max<std::size_t>(1, (last + 9) / 10);
  for (std::size_t t = 0; t < last; t += stride) steps.push_back(t);
  steps.push_back(last);
  return steps;
}

void PrintData(const TaskCheck& check, std::ostream& out) {
  out << fmt::format("data: {}, {} transitions\n", check.data, check.transitions);
  if (check.coordinates.empty()) return;
  const auto line = [&](const auto&... cells) { out << fmt::format("  {:<20}{:<24}{:<24}{}\n", cells...); };
  line("coordinate", "domain", "data", "the declared error depends on it");
  constexpr std::size_t kShort = 8;  // characters of a number that is shown as it is
  const auto number = [](double x, const std::string& rounded) {
    const std::string text = ToText(x);
    return text.size() <= kShort ? text : rounded;
  };
  const auto range = [&](double lower, double upper) {
    return fmt::format("[{}, {}]", number(lower, RoundedDown(lower, 4)), number(upper, RoundedUp(upper, 4)));
  };
  for (const TaskCheck::Coordinate& coordinate : check.coordinates)
    line(coordinate.name, range(coordinate.lower, coordinate.upper), range(coordinate.least, coordinate.largest),
         coordinate.matters ? "yes" : "no");
  if (check.rows.empty()) return;
  std::string used, undeclared;
  for (const TaskCheck::Row& row : check.rows)
    if (row.is_declared)
      used += fmt::format("  {} {} %", row.name, RoundedUp(100 * row.used, 3));
    else
      undeclared += (undeclared.empty() ? "" : ", ") + row.name;
  if (!used.empty())
    out << "declaration: of what it allows, two transitions differ by at most\n"
        << used << (check.all_pairs ? "" : "  (a sample of them)") << "\n";
  if (!undeclared.empty()) out << "declaration: nothing is declared for " << undeclared << "\n";
}

void PrintTube(const TaskCheck& check, const CheckArguments& options, std::ostream& out) {
  if (check.half_widths.empty()) return;
  out << fmt::format("tube without obstacles, {} steps of {}: half-width of each slice\n  {:<6}{:<8}",
                     check.planned_steps,
                     options.check.plan.empty() ? "the inputs closest to zero" : options.check.plan, "step", "s");
  for (const std::string& state : check.states) out << fmt::format("{:<12}", state);
  out << "\n";
  for (const std::size_t t : ShownSteps(check.half_widths.size() - 1)) {
    out << fmt::format("  {:<6}{:<8}", t, RoundedDown(static_cast<double>(t) * check.period, 4));
    for (const double width : check.half_widths[t]) out << fmt::format("{:<12}", RoundedUp(width, 4));
    out << "\n";
  }
}

void PrintFindings(const TaskCheck& check, std::ostream& out) {
  const auto remarks = std::ranges::count_if(check.findings, &TaskFinding::is_remark);
  const auto findings = std::ssize(check.findings) - remarks;
  out << (findings == 0 ? "a plan could be certified" : fmt::format("{} finding{}", findings, findings == 1 ? "" : "s"))
      << (remarks == 0 ? "" : fmt::format(", {}{}", remarks, remarks == 1 ? " remark" : " remarks")) << "\n";
  for (const TaskFinding& finding : check.findings)
    out << finding.place << (finding.is_remark ? "remark: " : "") << finding.what << "\n    " << finding.advice << "\n";
}

void PrintHypotheses(const std::vector<Hypothesis>& hypotheses, std::ostream& out) {
  out << "a certificate of this task rests on this:\n";
  for (const Hypothesis& each : hypotheses) out << "  " << each.what << "\n    upheld by: " << each.upheld_by << "\n";
}

Json ToJson(const TaskCheck& check, const std::vector<Hypothesis>& rests_on, const HeldOutSteps& held_out) {
  Json hypotheses = Json::array();
  for (const Hypothesis& each : rests_on) hypotheses.push_back({{"what", each.what}, {"upheld_by", each.upheld_by}});
  Json findings = Json::array(), coordinates = Json::array(), rows = Json::array();
  for (const TaskFinding& finding : check.findings)
    findings.push_back(
        {{"place", finding.place}, {"what", finding.what}, {"advice", finding.advice}, {"remark", finding.is_remark}});
  for (const TaskCheck::Coordinate& c : check.coordinates)
    coordinates.push_back(
        {{"name", c.name}, {"domain", {c.lower, c.upper}}, {"data", {c.least, c.largest}}, {"matters", c.matters}});
  for (const TaskCheck::Row& row : check.rows)
    rows.push_back({{"name", row.name},
                    {"declared", row.is_declared},
                    {"used", row.is_declared ? Json(row.used) : Json()},
                    {"lines", {row.first, row.second}}});
  return {{"findings", findings},
          {"data", check.data},
          {"transitions", check.transitions},
          {"coordinates", coordinates},
          {"declaration", rows},
          {"held_out", ToJson(held_out)},
          {"states", check.states},
          {"half_widths", check.half_widths},
          {"tube", check.tube},
          {"hypotheses", hypotheses},
          {"good", !check.HasFindings()}};
}

int Check(const CheckArguments& options) {
  std::vector<std::string> files = options.picture.empty() ? std::vector<std::string>{} : PictureFiles(options.picture);
  TaskCheck check = CheckTask(options.check);
  const HeldOutSteps held_out = JudgeTask(options.check.config);
  if (const std::string warning = WarningOf(held_out); !warning.empty())
    check.findings.push_back({.place = fmt::format("{}: declaration: ", options.check.config),
                              .what = warning,
                              .advice = "declare more: `forereach declare --from-data` proposes a disturbance"});
  const bool lacks_picture = !files.empty() && !check.is_planar;
  if (lacks_picture) files.clear();
  for (const std::string& file : files) DrawPicture(check.picture, file);
  const std::vector<Hypothesis>& rests_on = check.rests_on;
  if (options.json) {
    std::cout << JsonText(ToJson(check, rests_on, held_out)) << std::endl;
  } else {
    std::ostream& out = std::cout;
    PrintData(check, out);
    if (held_out.slices() > 0) out << "held out, by the other half of the data: " << TextOf(held_out) << "\n";
    PrintTube(check, options, out);
    PrintHypotheses(rests_on, out);
    PrintFindings(check, out);
    for (const std::string& file : files) out << "picture: " << file << "\n";
    out << std::flush;
  }
  if (lacks_picture) throw PictureError("picture: the task's safety coordinates are not two, so there is no picture");
  return check.HasFindings() ? 1 : 0;
}

}  // namespace

Command CheckCommand() {
  const auto options = std::make_shared<CheckArguments>();
  return {.name = "check",
          .footer =
              "It compares the domain and the declaration with the data, looks at the start, the goal, the obstacles "
              "and the\n"
              "length of a step, and propagates the tube of one plan without obstacles. Each finding has file, line "
              "and key,\n"
              "the value and its bound, and what to do. A remark costs width or time, and keeps nothing from being "
              "certified.\n"
              "A tube that ends after the planner's progress_steps is a remark, unless --plan is given.\n\n"
              "What it cannot tell: whether the declaration is true.\n\n"
              "Example:\n  forereach check config/bicycle.yaml --picture check.svg",
          .options = {TaskOption(options->check.config),
                      {"--plan", &options->check.plan, "FILE.csv",
                       "The plan for the tube; by default the inputs closest to zero"},
                      {"--steps", &options->check.steps, "",
                       "Steps of the plan without a file; by default planner.progress_steps + planner.tail_steps",
                       NumberRange{1, kMaxSteps}},
                      {"--picture", &options->picture, "NAME",
                       "Draws data, tube, obstacles and goal into NAME.svg and NAME.png, or into one of them"},
                      JsonFlag(options->json)},
          .run = [options] { return Check(*options); }};
}

}  // namespace forereach
