#include "task/task_template.h"

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <limits>

#include <fmt/format.h>

#include "forereach/numerics/text.h"

namespace forereach {
namespace {

std::string ToThreeDigits(double x) { return fmt::format("{:.3g}", x); }

std::string List(const std::vector<std::string>& entries) {
  std::string text = "[";
  for (const std::string& entry : entries) text += (text.size() > 1 ? ", " : "") + entry;
  return text + "]";
}

std::string NamesWithUnits(const std::vector<TemplateVariable>& variables) {
  std::string text;
  for (const TemplateVariable& variable : variables)
    text += fmt::format("{}{}{}", text.empty() ? "" : ", ", variable.name,
                        variable.unit.empty() ? "" : fmt::format(" ({})", variable.unit));
  return text.empty() ? "none" : text;
}

template <class Of>
std::string Numbers(const std::vector<TemplateVariable>& variables, const Of& of) {
  std::vector<std::string> entries;
  for (const TemplateVariable& variable : variables) entries.push_back(ToText(of(variable)));
  return List(entries);
}

bool Has(const std::vector<TemplateVariable>& variables, const std::string& name) {
  return std::ranges::find(variables, name, &TemplateVariable::name) != variables.end();
}

// While a robot stands, its velocities are zero; they are told by their units.
std::vector<std::string> Velocities(const std::vector<TemplateVariable>& states) {
  std::vector<std::string> names;
  for (const TemplateVariable& state : states)
    if (state.unit == "m/s" || state.unit == "rad/s") names.push_back(state.name);
  return names;
}

std::string DomainKey(const TaskTemplate& task) {
  const bool from_data = std::ranges::all_of(task.states, &TemplateVariable::from_data);
  std::string text =
      "# The domain: where the model and the declaration hold. A plan that may leave it is not certified, and every "
      "recorded\n"
      "# transition has to begin in it. ";
  text += from_data ? "Proposed: the ranges of the data, a tenth wider at each end.\n"
                    : "PLACEHOLDER: put in what your robot does.\n";
  text += "domain:\n";
  const auto box = [&](const char* map, const std::vector<TemplateVariable>& variables) {
    text += fmt::format("  {}:  # {}\n", map, NamesWithUnits(variables));
    text += fmt::format("    lower: {}  # the least value of each\n",
                        Numbers(variables, [](const auto& v) { return v.lower; }));
    text += fmt::format("    upper: {}  # the largest value of each\n",
                        Numbers(variables, [](const auto& v) { return v.upper; }));
  };
  box("state", task.states);
  box("input", task.inputs);
  return text;
}

std::string DeclarationKey(const TaskTemplate& task) {
  std::vector<std::string> columns;
  for (const auto* variables : {&task.states, &task.inputs})
    for (const TemplateVariable& variable : *variables) columns.push_back(variable.name);
  std::string text = fmt::format(
      "# The declaration: how much the robot's error of one step (true next state minus that of the model) can change "
      "from one\n"
      "# place to another. Every certificate rests on it; nothing here can prove it for you. One row for each state, "
      "one number\n"
      "# for each of {}; {}:\n"
      "# the change of the row's error for a change of 1 in that column.\n"
      "# PLACEHOLDER: all ones. They allow so much that hardly any plan can be certified; with your numbers it becomes "
      "possible.\n"
      "declaration:\n"
      "  lipschitz:\n",
      NamesWithUnits(task.states), NamesWithUnits(task.inputs));
  for (const TemplateVariable& state : task.states)
    text += fmt::format("    - {}  # {}\n", List(std::vector<std::string>(columns.size(), "1")), state.name);
  text += fmt::format(
      "  # The largest error of each successor in the data. PLACEHOLDER. If sensors err by up to e, add the line\n"
      "  # state_error: [e, ...]. It counts for the states before the steps, too.\n"
      "  noise_bound: {}\n"
      "  # How far the true state may be from the one that the robot measures while it drives, by names, such as {{{}: "
      "0.01}}.\n"
      "  # PLACEHOLDER: exact, as the simulated robot measures it.\n"
      "  state_error: {{}}\n",
      List(std::vector<std::string>(task.states.size(), "0.01")), task.states.front().name);
  return text;
}

std::string TransitionsKey(const TaskTemplate& task) {
  std::string text =
      "# Recorded steps of the robot: a CSV file with the state and the input at a sample, and the state one step "
      "later, in\n"
      "# columns that end in _next. They are what the certifier knows of the robot beside the declaration.\n";
  if (!task.transitions_exist)
    text += fmt::format(
        "# This file is not there yet. Record it, or make it with the simulated robot, which is the model itself "
        "unless\n"
        "# robot.residual says more:\n"
        "#   forereach-robot-sim --config {} --make-transitions {} --seed 1 --count 400\n",
        task.path, task.transitions);
  return fmt::format("{}transitions: {}\n", text, YamlText(task.transitions));
}

std::string Bounds(const std::vector<std::pair<std::string, double>>& bounds) {
  std::string text;
  for (const auto& [name, bound] : bounds)
    text += fmt::format("{}{}: {}", text.empty() ? "" : ", ", name, ToText(bound));
  return "{" + text + "}";
}

// What standing is: that of the task which drives the model, or the states that are velocities.
std::vector<std::pair<std::string, double>> Rest(const TaskTemplate& task) {
  if (task.laws) return task.laws->rest;
  std::vector<std::pair<std::string, double>> rest;
  for (const std::string& name : Velocities(task.states)) rest.emplace_back(name, 0.05);
  return rest;
}

std::string RestKey(const TaskTemplate& task) {
  if (const auto rest = Rest(task); !rest.empty())
    return fmt::format(
        "  # What standing is: each plan that is certified on the bus has to end with no more than this. PLACEHOLDER.\n"
        "  rest: {}\n",
        Bounds(rest));
  if (task.laws)
    return fmt::format(
        "  # There is no `rest`: this robot cannot stand, and plans end in motion. {}\n"
        "  # says what that means.\n",
        task.laws->task);
  return fmt::format(
      "  # What standing is. Name the velocities; each plan that is certified on the bus then has to end with no "
      "more:\n"
      "  # rest: {{{}: 0.05}}\n",
      task.states.back().name);
}

// A place along the domain, given by its share.
std::string PlaceAt(double share, const TaskTemplate& task, const std::vector<std::string>& positions) {
  std::vector<std::string> place;
  for (const std::string& name : positions) {
    const auto state = std::ranges::find(task.states, name, &TemplateVariable::name);
    place.push_back(ToThreeDigits(state->lower + share * (state->upper - state->lower)));
  }
  return List(place);
}

// Towards the upper corner of the domain, of a fortieth of its width.
std::string ExampleObstacle(const TaskTemplate& task, const std::vector<std::string>& positions) {
  constexpr double kShare = 0.0125;
  constexpr int kTemplateDigits = 3;
  std::vector<std::string> center, lower, upper;
  for (const std::string& name : positions) {
    const auto state = std::ranges::find(task.states, name, &TemplateVariable::name);
    const double width = state->upper - state->lower, middle = state->lower + 0.8 * width;
    center.push_back(RoundedDown(middle, kTemplateDigits));
    lower.push_back(RoundedDown(middle - kShare * width, kTemplateDigits));
    upper.push_back(RoundedUp(middle + kShare * width, kTemplateDigits));
  }
  const auto first = std::ranges::find(task.states, positions.front(), &TemplateVariable::name);
  if (positions.size() == 2)
    return fmt::format("circle: {{center: {}, radius: {}}}", List(center),
                       RoundedUp(kShare * (first->upper - first->lower), kTemplateDigits));
  return fmt::format("box: {{lower: {}, upper: {}}}", List(lower), List(upper));
}

std::string TaskKey(const TaskTemplate& task, const std::vector<std::string>& positions) {
  std::vector<std::string> center, half_width;
  for (std::size_t k = 0; k < task.states.size(); ++k) {
    center.push_back(ToText(task.center[k]));
    half_width.push_back("0.01");
  }
  std::string text = fmt::format(
      "# What `forereach certify` is asked.\n"
      "task:\n"
      "  # Where the robot may be when a plan begins: the estimate, and how far off it may be. PLACEHOLDER.\n"
      "  initial_set:  # {}\n"
      "    center: {}\n"
      "    half_width: {}\n"
      "  # The states that are the robot's position: obstacles are given in these coordinates. The robot is a point "
      "there; give\n"
      "  # it a shape with `body` (config/README.md).\n"
      "  projection: {}\n"
      "  # A certificate holds at the samples only. For all times between them declare how sharply the motion bends "
      "there,\n"
      "  # `between: {{acceleration: [...]}}`.\n"
      "  between: samples\n",
      NamesWithUnits(task.states), List(center), List(half_width), List(positions));
  text += RestKey(task);
  text += fmt::format(
      "  # What the robot must not touch. PLACEHOLDER: one obstacle, as an example.\n"
      "  obstacles:\n"
      "    - {}\n",
      ExampleObstacle(task, positions));
  return text;
}

// Of the states that are velocities: what the others do while the robot brakes is not a matter of a rate.
std::string EmergencyStop(const TaskTemplate& task, const std::vector<std::string>& held) {
  std::vector<std::pair<std::string, double>> rates;
  for (const std::string& name : Velocities(task.states))
    if (std::ranges::find(held, name) != held.end()) rates.emplace_back(name, 1);
  if (rates.empty()) return "";
  return fmt::format(
      "  # How fast its brakes take each of them to zero whatever happens, in its unit per second. PLACEHOLDER: what "
      "your robot\n"
      "  # surely does. Stops begin the earlier the less it is.\n"
      "  emergency_stop: {}\n",
      Bounds(rates));
}

std::string RobotKey(const TaskTemplate& task) {
  std::vector<std::string> held = task.laws ? task.laws->held : Velocities(task.states);
  std::string text = "# The robot, and the simulated one: the states that are zero while it stands.\n";
  text +=
      "robot:\n"
      "  # How far its steps are from their times, ms; `forereach doctor` measures it. PLACEHOLDER: nobody looks.\n"
      "  step_error_ms: any\n";
  if (task.laws || !held.empty()) return fmt::format("{}  hold: {}\n{}", text, List(held), EmergencyStop(task, held));
  held = {task.states.back().name};
  return fmt::format(
      "{}#   hold: {}\n"
      "#   emergency_stop: {}  # how fast its brakes take it to zero, in its unit per second\n",
      text, List(held), Bounds({{held[0], 1}}));
}

std::string PlannerKey(const TaskTemplate& task, const std::vector<std::string>& positions) {
  const std::string goal = fmt::format("goal: {}", PlaceAt(0.65, task, positions));
  const std::vector<std::pair<std::string, double>> rest = Rest(task);
  if (!task.laws)
    return fmt::format(
        "# The planner: how the robot stops, an expression of the state for each input, clipped to domain.input, and "
        "where it is\n"
        "# at rest. docs/planner.md explains them. The planner starts when these lines are there.\n"
        "# planner:\n"
        "#   {}\n"
        "#   stop: {{{}: -{}/dt}}  # and each other input\n"
        "#   at_rest: {{{}: 0.005}}\n",
        goal, task.inputs.front().name, rest.empty() ? task.states.back().name : rest.front().first,
        rest.empty() ? task.states.back().name : rest.front().first);
  std::string text = fmt::format(
      "# The planner: how the robot stops and is steered. These laws are those of\n"
      "#   {}\n"
      "# docs/planner.md explains them.\n"
      "planner:\n"
      "  # Where to go, in the coordinates of task.projection. The planner plans once there is a goal.\n"
      "  # {}\n"
      "{}",
      task.laws->task, goal, task.laws->lines);
  if (task.laws->has_at_rest) return text;
  std::string at_rest;
  for (const auto& [name, bound] : rest)
    at_rest += fmt::format("{}{}: {}", at_rest.empty() ? "" : ", ", name, ToThreeDigits(bound / 10));
  return fmt::format(
      "{}  # Where a plan ends, by the model. Less than task.rest, since what is not known of the robot comes on top.\n"
      "  at_rest: {{{}}}\n",
      text, at_rest);
}

std::string Processes(const TaskTemplate& task, const std::vector<std::string>& positions) {
  return fmt::format(
      "# The certifier on the bus: where the obstacles come from. bus: those above and those that a sender repeats; "
      "nothing is\n"
      "# certified while none is heard, and plans under way are withdrawn once they have been unknown for\n"
      "# obstacles_lost_ms. task: those above are all there are.\n"
      "gate: {{obstacles: bus, obstacles_lost_ms: 2000}}\n"
      "\n"
      "{}\n"
      "{}\n"
      "# The directory of recorded runs.\n"
      "logger: {{directory: log}}\n",
      PlannerKey(task, positions), RobotKey(task));
}

constexpr double kLargest = std::numeric_limits<double>::max();

}  // namespace

std::vector<std::string> PositionStates(const std::vector<TemplateVariable>& states) {
  std::vector<std::string> lengths;
  for (const TemplateVariable& state : states)
    if (state.unit == "m" && lengths.size() < 3) lengths.push_back(state.name);
  if (!lengths.empty()) return lengths;
  for (const std::vector<std::string>& names : {std::vector<std::string>{"x", "y"}, {"px", "py"}, {"x", "z"}})
    if (std::ranges::all_of(names, [&](const std::string& name) { return Has(states, name); })) return names;
  for (const TemplateVariable& state : states)
    if (lengths.size() < 2) lengths.push_back(state.name);
  return lengths;
}

TemplateVariable RangeAround(const std::string& name, double least, double largest) {
  constexpr int kTemplateDigits = 3;
  const double more = largest > least ? (largest - least) / 10 : 0.1;
  const auto number = [](const std::string& text) { return std::strtod(text.c_str(), nullptr); };
  // The nearest decimal, unless the data are outside it.
  const double near_lower = number(ToThreeDigits(least - more)), near_upper = number(ToThreeDigits(largest + more));
  const double lower = near_lower <= least ? near_lower : number(RoundedDown(least - more, kTemplateDigits));
  const double upper = near_upper >= largest ? near_upper : number(RoundedUp(largest + more, kTemplateDigits));
  return {name, "", std::max(lower, -kLargest), std::min(upper, kLargest), true};
}

std::string YamlText(const std::string& text) {
  constexpr const char* kPlain = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-./";
  if (!text.empty() && text.find_first_not_of(kPlain) == std::string::npos && text[0] != '-') return text;
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? std::string("''") : std::string(1, c);
  return quoted + "'";
}

std::string TaskText(const TaskTemplate& task) {
  const std::vector<std::string> positions = PositionStates(task.states);
  return fmt::format(
      "{}# The task of a robot, begun by\n"
      "#   {}\n"
      "# config/README.md describes every key. Go through the lines that say PLACEHOLDER, then let\n"
      "#   forereach check {}\n"
      "# say what is still missing.\n"
      "\n"
      "{}\n"
      "{}\n"
      "{}\n"
      "{}\n"
      "{}\n"
      "{}",
      task.schema.empty() ? "" : fmt::format("# yaml-language-server: $schema={}\n", task.schema), task.command,
      task.path, task.model, DomainKey(task), DeclarationKey(task), TransitionsKey(task), TaskKey(task, positions),
      Processes(task, positions));
}

}  // namespace forereach
