#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <iostream>
#include <numbers>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include <fmt/core.h>

#include "cli/commands.h"
#include "forereach/dynamics/expression.h"
#include "forereach/numerics/limits.h"
#include "forereach/numerics/size.h"
#include "forereach/numerics/text.h"
#include "identify/declare_data.h"
#include "records/output_file.h"
#include "task/config.h"
#include "task/csv.h"
#include "task/files.h"
#include "task/model_file.h"
#include "task/task_template.h"

namespace forereach {
namespace {

namespace fs = std::filesystem;

constexpr const char* kNextEnding = "_next";
constexpr std::size_t kLongestName = 64;  // that task files take

bool IsNullOfYaml(const std::string& name) { return name == "null" || name == "Null" || name == "NULL"; }

// A path stands in comments and texts of the task.
void RequireOneLine(const char* option, const std::string& path) {
  if (std::ranges::any_of(path, [](unsigned char c) { return std::iscntrl(c) != 0; }))
    throw ConfigError("{}: the path has a control character, as a line break, which no task file can name", option);
}

struct InitArguments {
  std::string model, transitions, out;
  std::optional<double> dt;
  bool force = false;
};

// What stands behind `name:` in a model file's parameters, if it is a comment: what it means.
std::string CommentOf(const std::string& file, const std::string& name) {
  std::istringstream lines(file);
  bool here = false;
  for (std::string line; std::getline(lines, line);) {
    const std::size_t begin = line.find_first_not_of(' ');
    if (begin == std::string::npos) continue;
    here = here ? begin > 2 : line.starts_with("  parameters:");
    if (!here || line.compare(begin, name.size() + 1, name + ":") != 0) continue;
    const std::size_t comment = line.find(" #");
    return comment == std::string::npos ? "" : " " + line.substr(comment);
  }
  return "";
}

std::string ValueOf(const ModelText::Parameter& parameter) {
  return parameter.lower == parameter.upper ? ToText(parameter.lower)
                                            : fmt::format("[{}, {}]", ToText(parameter.lower), ToText(parameter.upper));
}

// An angle that is reported in [-pi, pi] turns on in a plan.
TemplateVariable PlaceholderRange(const ModelText::Variable& variable, bool turns) {
  const double most = variable.unit == "rad" ? (turns ? 2 : 1) * std::numbers::pi : 10;
  return {variable.name, variable.unit, -most, most, false};
}

// The lines of the map `planner` of a task file of the library that have its laws, each with the comment above it.
std::string LawLines(const std::string& file) {
  constexpr std::array kKeys{"let", "speed", "stop", "emergency_stop", "hints", "at_rest"};
  std::istringstream lines(file);
  std::string laws, comments;
  bool in_planner = false, is_law = false;
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("  ")) in_planner = line == "planner:";
    if (!in_planner || line == "planner:") continue;
    line += "\n";
    if (line.starts_with("  #")) {
      comments += line;
    } else if (line.starts_with("   ")) {
      if (is_law) laws += line;
    } else {
      is_law = std::ranges::find(kKeys, line.substr(2, line.find(':') - 2)) != kKeys.end();
      if (is_law) laws += comments + line;
      comments.clear();
    }
  }
  return laws;
}

// The task drive/NAME.yaml in the directory that has models/NAME.yaml, if it is a task of this model file.
std::optional<Config> DriveOf(const std::string& model_file) {
  const fs::path path(model_file);
  const fs::path drive = path.parent_path() / ".." / "drive" / path.filename();
  if (!fs::exists(drive) || !fs::equivalent(FilesNamedBy(drive).model, path)) return std::nullopt;
  return LoadConfig(drive, TransitionsFile::kIgnore);
}

std::optional<KnownLaws> LawsOf(const Config& config) {
  if (config.laws.stop.empty()) return std::nullopt;
  KnownLaws laws;
  laws.task = fs::path(config.path).lexically_normal().string();
  laws.lines = LawLines(ReadWhole(config.path, kLargestTaskFile));
  laws.has_at_rest = ("\n" + laws.lines).find("\n  at_rest:") != std::string::npos;
  const std::vector<std::string>& states = config.problem->model->state_names();
  for (const RestBound& bound : config.problem->rest)
    laws.rest.emplace_back(states[ToSize(bound.coordinate)], bound.tolerance);
  for (const int k : HeldStates(config)) laws.held.push_back(states[ToSize(k)]);
  return laws;
}

// What is never zero in the task that drives the model is not zero in the new one: the model may have no bound there,
// as tyres and wings have none at a standstill.
void KeepFromZero(const Config& drive, TaskTemplate& task) {
  const auto keep = [](const Box& box, std::vector<TemplateVariable>& variables, const auto& use) {
    for (std::size_t l = 0; l < variables.size(); ++l) {
      const auto k = static_cast<Eigen::Index>(l);
      if (box.lower()[k] <= 0 && 0 <= box.upper()[k]) continue;
      variables[l].lower = box.lower()[k], variables[l].upper = box.upper()[k];
      use(l);
    }
  };
  const Domain& domain = drive.problem->domain;
  keep(domain.state, task.states, [&](std::size_t l) { task.center[l] = drive.robot.start[l]; });
  keep(domain.input, task.inputs, [](std::size_t) {});
}

TaskTemplate FromModel(const InitArguments& options) {
  const std::string name = options.model.ends_with(".yaml") ? options.model : "models/" + options.model + ".yaml";
  const std::string path = FindModelFile(options.out, name, "--model: ");
  const ModelText text = LoadModelFile(path);
  const std::string file = ReadWhole(path, kLargestTaskFile);
  TaskTemplate task;
  for (const ModelText::Variable& state : text.states)
    task.states.push_back(PlaceholderRange(state, std::ranges::find(text.angles, state.name) != text.angles.end()));
  for (const ModelText::Variable& input : text.inputs) task.inputs.push_back(PlaceholderRange(input, false));
  task.center.assign(text.states.size(), 0);
  task.model = fmt::format(
      "# The nominal model: the equations of a file that comes with ForeReach, with the parameters of your robot. To "
      "change\n"
      "# the equations, copy {} and name your copy.\n"
      "model:\n"
      "  file: {}\n"
      "  parameters:\n",
      path, YamlText(name));
  for (const ModelText::Parameter& parameter : text.parameters) {
    const bool is_given = parameter.name == "dt" && options.dt;
    task.model +=
        fmt::format("    {}: {}{}\n", parameter.name, is_given ? ToText(*options.dt) : ValueOf(parameter),
                    parameter.name == "dt" ? "  # s, from one control to the next" : CommentOf(file, parameter.name));
  }
  if (!text.angles.empty()) {
    task.model += "  # Values that differ by 2 pi are the same, in the data and of the measured state.\n  angles: [";
    for (const std::string& angle : text.angles) task.model += (&angle == text.angles.data() ? "" : ", ") + angle;
    task.model += "]\n";
  }
  if (const std::optional<Config> drive = DriveOf(path)) {
    task.laws = LawsOf(*drive);
    KeepFromZero(*drive, task);
  }
  task.transitions = fs::path(options.out).stem().string() + "_steps.csv";
  task.command = fmt::format("forereach init --model {}", options.model);
  return task;
}

// The states and inputs that a header of transitions names, in its order.
struct Header {
  std::vector<std::string> states, inputs;
};

void RequireCount(const std::string& path, const char* what, const std::vector<std::string>& names, int most) {
  if (names.size() > static_cast<std::size_t>(most))
    throw ConfigError("{}:1: {} {} are outside [0, {}]", path, names.size(), what, most);
}

Header ReadHeader(const std::string& path) {
  const std::vector<std::string> columns = CsvColumns(path);
  Header header;
  for (const std::string& column : columns) {
    if (column.ends_with(kNextEnding)) continue;
    // The columns become names of the task's expressions.
    if (!IsName(column) || IsReserved(column) || column == "dt" || IsNullOfYaml(column) || column.size() > kLongestName)
      throw ConfigError(
          "{}:1: '{}' cannot be the name of a state or an input: that is a letter, then letters, digits "
          "and underscores, {} at most, and no function, pi, dt or null; rename the column",
          path, column.substr(0, kLongestName), kLongestName);
    const bool is_state = std::ranges::find(columns, column + kNextEnding) != columns.end();
    (is_state ? header.states : header.inputs).push_back(column);
  }
  for (const std::string& column : columns)
    if (const std::string name = column.substr(0, column.size() - std::min<std::size_t>(column.size(), 5));
        column.ends_with(kNextEnding) && std::ranges::find(header.states, name) == header.states.end())
      throw ConfigError("{}:1: {} is the state after a step, and there is no column {} with the state before it", path,
                        column, name);
  if (header.states.empty())
    throw ConfigError(
        "{}:1: no column is a state: a state x has the columns x, before a step, and x_next, after it. A "
        "log of states and inputs over time is made into such a file first",
        path);
  RequireCount(path, "states", header.states, kMaxStates);
  if (header.inputs.empty())
    throw ConfigError("{}:1: no column is an input: every column has one with _next, and a model needs an input", path);
  RequireCount(path, "inputs", header.inputs, kMaxInputs);
  return header;
}

TaskTemplate FromTransitions(const InitArguments& options) {
  if (!options.dt)
    throw ConfigError(
        "--transitions: needs --dt, the time from one sample of the data to the next in s: the file does not have it");
  const std::string& path = options.transitions;
  const Header header = ReadHeader(path);
  std::vector<std::string> columns = header.states;
  columns.insert(columns.end(), header.inputs.begin(), header.inputs.end());
  const auto n = header.states.size();
  for (const std::string& state : header.states) columns.push_back(state + kNextEnding);
  const Eigen::MatrixXd rows = ReadCsv(path, columns);
  if (rows.rows() == 0) throw ConfigError("{}:2: no transitions; at least one is needed", path);

  TaskTemplate task;
  for (std::size_t l = 0; l < n + header.inputs.size(); ++l) {
    const auto column = rows.col(static_cast<Eigen::Index>(l));
    (l < n ? task.states : task.inputs).push_back(RangeAround(columns[l], column.minCoeff(), column.maxCoeff()));
    if (l < n) task.center.push_back(column[0]);
  }
  task.model =
      "# The nominal model. What follows is only a frame for your equations: as it stands, the state does not change, "
      "and the\n"
      "# whole motion of the robot is the model's error. docs/expressions.md describes the language; `forereach init "
      "--model`\n"
      "# begins with a model of the library.\n"
      "model:\n"
      "  states:  # with their units, which are for people; 1 where you have not put one in\n";
  for (const std::string& state : header.states) task.model += fmt::format("    {}: \"1\"\n", state);
  task.model += "  inputs:  # likewise\n";
  for (const std::string& input : header.inputs) task.model += fmt::format("    {}: \"1\"\n", input);
  task.model += fmt::format(
      "  # The states that are angles, if there are any: values that differ by 2 pi are the same.\n"
      "  # angles: [{}]\n"
      "  parameters:\n"
      "    dt: {}  # s, from one sample of the data to the next\n"
      "  next:  # the state after one step, or `rate` and `integrator`. PLACEHOLDER\n",
      header.states.back(), ToText(*options.dt));
  for (const std::string& state : header.states) task.model += fmt::format("    {}: {}\n", state, state);
  const fs::path directory = fs::absolute(options.out).parent_path();
  task.transitions = fs::absolute(path).lexically_normal().lexically_proximate(directory.lexically_normal()).string();
  task.transitions_exist = true;
  task.command = fmt::format("forereach init --transitions {} --dt {}", path, ToText(*options.dt));
  return task;
}

int Init(const InitArguments& options) {
  if (options.model.empty() == options.transitions.empty())
    throw ConfigError(
        "init: needs one of --model, a model of the library, and --transitions, a file of recorded steps");
  RequireOneLine("--model", options.model);
  RequireOneLine("--transitions", options.transitions);
  RequireOneLine("--out", options.out);
  TaskTemplate task = options.model.empty() ? FromTransitions(options) : FromModel(options);
  task.path = options.out;
  task.schema = InstalledSchema();
  WriteNewFile(options.out, TaskText(task), options.force);
  std::cout << options.out << ": a task to begin with, " << task.states.size() << " states, " << task.inputs.size()
            << " inputs\n  now: put in what your robot is where a line says PLACEHOLDER";
  if (!task.transitions_exist) std::cout << ", record " << task.transitions;
  std::cout << ", and run\n  forereach check " << options.out << std::endl;
  if (const std::string warning = WarningOf(JudgeTask(options.out)); !warning.empty())
    std::cerr << "forereach: warning: " << warning << std::endl;
  return 0;
}

}  // namespace

Command InitCommand() {
  const auto options = std::make_shared<InitArguments>();
  return {
      .name = "init",
      .footer =
          "With --model, states, inputs, parameters and units are those of a file in config/models, and the ranges "
          "are\n"
          "placeholders; the laws by which it stops and is steered are those of its task in config/drive, and so is "
          "the\n"
          "range of what is never zero there, as the speed of an aeroplane.\n"
          "With --transitions, a column x with a column x_next is a state, the others are inputs, and the\n"
          "domain is the range of the data, a tenth wider at each end.\n"
          "The file can be used as it is. Its placeholders keep plans from being certified until you replace them.\n\n"
          "Examples:\n  forereach init --model differential_drive --out robot.yaml\n"
          "  forereach init --transitions log.csv --dt 0.1 --out robot.yaml",
      .options = {{"--model", &options->model, "NAME",
                   "A model of the library, for example unicycle, or a path of a model file, relative to the new file"},
                  {"--transitions", &options->transitions, "FILE.csv", "Recorded steps"},
                  {"--dt", &options->dt, "", "The time of one step, s", NumberRange{1e-6, 60}},
                  Required({"-o,--out", &options->out, "FILE.yaml", "The new task file"}),
                  {"--force", &options->force, "", "Overwrite the file if it exists"}},
      .run = [options] { return Init(*options); }};
}

}  // namespace forereach
