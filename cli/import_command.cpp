#include <algorithm>
#include <array>
#include <cmath>
#include <iostream>
#include <map>
#include <optional>
#include <stdexcept>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "command_line/nearest.h"
#include "command_line/progress.h"
#include "forereach/certify/learned.h"
#include "forereach/numerics/size.h"
#include "forereach/numerics/text.h"
#include "identify/channel_table.h"
#include "identify/command_delay.h"
#include "identify/import.h"
#include "identify/joined_logs.h"
#include "identify/lcm_table.h"
#include "identify/mcap_table.h"
#include "identify/units.h"
#include "lcmtypes/printable.h"
#include "task/config.h"
#include "task/json_text.h"
#include "task/number.h"

namespace forereach {
namespace {

using Json = nlohmann::json;

struct ImportArguments {
  std::string config, out, inputs_from, inputs_time, time, time_unit = "s", delimiter = "auto", comment = "#", header,
                                                           decimal = "point";
  std::vector<std::string> logs, lcm_types, states, inputs, held, units, input_tolerances, unwrapped;
  std::string command_delay = "none";
  std::optional<double> rate, from, until;
  double tolerance_ms = 0.001;
  bool input_mean = false, overlapping = false, keep_few = false, json = false;
};

// ---- NAME=VALUE options

[[noreturn]] void Refuse(const std::string& option, const std::string& what) {
  throw ConfigError("--{}: {}", option, what);
}

// The values by names that the model has. @throws ConfigError for another name, one that is given twice, or no '='.
std::map<std::string, std::string> Assignments(const std::string& option, const std::vector<std::string>& texts,
                                               const std::vector<std::string>& known) {
  std::map<std::string, std::string> values;
  for (const std::string& text : texts) {
    const std::size_t at = text.find('=');
    const std::string name = text.substr(0, at);
    if (at == std::string::npos) Refuse(option, fmt::format("'{}' is not NAME=VALUE", text));
    if (std::ranges::find(known, name) == known.end())
      Refuse(option, fmt::format("the model has no '{}'; {}", name, Suggestion(name, known)));
    if (!values.emplace(name, text.substr(at + 1)).second) Refuse(option, fmt::format("{} is given twice", name));
  }
  return values;
}

// The unit of a state or an input in a model's text; empty if the model is compiled.
std::string UnitOf(const NominalModel& model, std::size_t variable) {
  if (!model.text()) return "";
  const std::size_t n = model.text()->states.size();
  return variable < n ? model.text()->states[variable].unit : model.text()->inputs[variable - n].unit;
}

// ---- what is asked

LogFormat FormatOf(const ImportArguments& options) {
  LogFormat format{.delimiter = {},
                   .decimal_comma = options.decimal == "comma",
                   .comment = options.comment,
                   .header = SplitAtCommas(options.header)};
  if (options.delimiter != "auto")
    format.delimiter = options.delimiter == "comma"       ? ','
                       : options.delimiter == "semicolon" ? ';'
                       : options.delimiter == "tab"       ? '\t'
                                                          : ' ';
  return format;
}

// The states of --held, each with the input that it holds.
std::vector<std::pair<int, int>> HeldOf(const ImportArguments& options, const NominalModel& model) {
  std::vector<std::pair<int, int>> held;
  const auto &states = model.state_names(), &inputs = model.input_names();
  for (const auto& [state, input] : Assignments("held", options.held, states)) {
    const auto at = std::ranges::find(inputs, input);
    if (at == inputs.end())
      Refuse("held", fmt::format("the model has no input '{}'; {}", input, Suggestion(input, inputs)));
    held.emplace_back(std::ranges::find(states, state) - states.begin(), at - inputs.begin());
  }
  return held;
}

// The columns of a log: of states, and of inputs, each after its stamp. A variable without an option has the column of
// its name.
struct Columns {
  std::vector<std::string> states, inputs;

  // Of the table that is made of both.
  [[nodiscard]] std::vector<std::string> All(bool has_time) const {
    std::vector<std::string> all = states;
    all.insert(all.end(), inputs.begin() + (has_time ? 1 : 0), inputs.end());
    return all;
  }
};

Columns ColumnsOf(const ImportArguments& options, const ImportOptions& import, const NominalModel& model) {
  Columns columns;
  const auto take = [&](const char* option, const auto& texts, const std::vector<std::string>& names,
                        std::vector<std::string>& into) {
    const auto given = Assignments(option, texts, names);
    for (const std::string& name : names) {
      const auto at = given.find(name);
      into.push_back(at == given.end() ? name : at->second);
    }
  };
  if (!options.rate) {
    columns.states.push_back(options.time);
    columns.inputs.push_back(options.inputs_time.empty() ? options.time : options.inputs_time);
  }
  take("state", options.states, model.state_names(), columns.states);
  take("input", options.inputs, model.input_names(), columns.inputs);
  const std::size_t first = options.rate ? 0 : 1;
  for (const auto& [state, input] : import.held)
    columns.states[first + ToSize(state)] = columns.inputs[first + ToSize(input)];
  return columns;
}

bool IsMcap(const ImportArguments& options) { return options.logs.front().ends_with(".mcap"); }

// Of messages on channels.
bool IsRecording(const ImportArguments& options) {
  return IsMcap(options) || !options.lcm_types.empty() || options.logs.front().ends_with(".lcmlog");
}

// States and inputs of one channel, or of two that are joined by their stamps.
LogTable TableOfChannels(const std::string& path, const Columns& columns, const ImportArguments& options) {
  LcmTypes types;
  for (const std::string& file : options.lcm_types) types.Add(file);
  const auto read = [&](const std::string& from, const std::vector<std::string>& wanted) {
    return IsMcap(options) ? ReadMcapLog(from, wanted) : ReadLcmLog(from, wanted, types);
  };
  const std::vector<std::string> inputs(columns.inputs.begin() + 1, columns.inputs.end());
  const std::vector<std::string> states(columns.states.begin() + 1, columns.states.end());
  if (inputs.empty() || ChannelOf(inputs) == ChannelOf(states)) return read(path, columns.All(true));
  const std::string& from = options.inputs_from.empty() ? path : options.inputs_from;
  return Joined(read(path, columns.states), read(from, columns.inputs));
}

LogTable TableOf(const std::string& path, const Columns& columns, const ImportArguments& options) {
  const LogFormat format = FormatOf(options);
  if (IsRecording(options)) return TableOfChannels(path, columns, options);
  if (options.inputs_from.empty()) return ReadLog(path, columns.All(!options.rate), format);
  return Joined(ReadLog(path, columns.states, format), ReadLog(options.inputs_from, columns.inputs, format));
}

// Rows of two logs are joined by their stamps, and a delay in rows of both is none.
void CheckJoin(const ImportArguments& options) {
  if (!options.held.empty() && (IsRecording(options) || !options.inputs_from.empty()))
    Refuse("held", "the log has to be one table with its inputs");
  if (IsRecording(options) || (options.inputs_from.empty() && options.inputs_time.empty())) return;
  if (options.inputs_from.empty()) Refuse("inputs-time", "needs --inputs-from");
  if (options.rate) Refuse("inputs-from", "needs stamps, and --rate says that there are none");
  if (options.logs.size() != 1) Refuse("inputs-from", "belongs to one log of states");
  if (options.command_delay != "none")
    Refuse("inputs-from", "has no rows to count --command-delay in; move its stamps");
}

std::vector<long double> FactorsOf(const ImportArguments& options, const NominalModel& model) {
  const std::vector<std::string> names = model.variable_names();
  const auto given = Assignments("unit", options.units, names);
  std::vector<long double> factors(names.size(), 1);
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto at = given.find(names[i]);
    if (at == given.end()) continue;
    try {
      factors[i] = FactorOf(at->second, UnitOf(model, i));
    } catch (const std::invalid_argument& error) {
      Refuse("unit", fmt::format("{}={}", names[i], error.what()));
    }
  }
  return factors;
}

Eigen::VectorXd InputTolerances(const ImportArguments& options, const NominalModel& model) {
  const std::vector<std::string>& names = model.input_names();
  Eigen::VectorXd tolerances = Eigen::VectorXd::Zero(model.num_inputs());
  for (const auto& [name, text] : Assignments("input-tolerance", options.input_tolerances, names)) {
    const auto [value, problem] = ParseNumber(text);
    if (!problem.empty() || value < 0)
      Refuse("input-tolerance", fmt::format("{}: '{}' is no number from 0 up", name, text));
    tolerances[std::ranges::find(names, name) - names.begin()] = value;
  }
  return tolerances;
}

ImportOptions ImportOptionsOf(const ImportArguments& options, const Config& config) {
  const NominalModel& model = *config.problem->model;
  ImportOptions import;
  import.period = config.period;
  import.tolerance = options.tolerance_ms / 1000;
  // Beyond that, the row for t + dt could be nearer to another step.
  if (!(import.tolerance < config.period / 2))
    Refuse("tolerance-ms", fmt::format("{} has to be below half a step of the task, {} ms",
                                       ToText(options.tolerance_ms), ToText(config.period * 500)));
  try {
    import.time_unit = options.rate ? 0 : FactorOf(options.time_unit, "s");
  } catch (const std::invalid_argument& error) {
    Refuse("time-unit", error.what());
  }
  import.row_spacing = options.rate ? 1 / *options.rate : 0;
  import.factors = FactorsOf(options, model);
  import.input_tolerance = InputTolerances(options, model);
  import.input_mean = options.input_mean;
  import.overlapping = options.overlapping;
  import.held = HeldOf(options, model);
  import.counts_durations = KnowsDurations(*config.problem);
  for (const std::string& name : options.unwrapped) {
    const auto at = std::ranges::find(model.state_names(), name);
    if (at == model.state_names().end())
      Refuse("unwrap", fmt::format("the model has no state '{}'; {}", name, Suggestion(name, model.state_names())));
    import.unwrapped.push_back(static_cast<int>(at - model.state_names().begin()));
  }
  import.from = options.from.value_or(-kInfinity);
  import.until = options.until.value_or(kInfinity);
  return import;
}

// ---- what was found

struct Source {
  LogTable table;
  ImportedLog log;
};

Json ToJson(const Finding& finding) {
  return {{"count", finding.count}, {"first_line", finding.first_line}, {"first", finding.first}};
}

Json ToJson(const Source& source, const std::vector<std::string>& columns) {
  Json document{{"log", source.table.path},
                {"rows", source.table.num_rows()},
                {"samples", source.log.samples},
                {"spacing_s", source.log.typical_spacing},
                {"transitions", source.log.transitions.size()},
                {"blank_lines", source.table.blank.count},
                {"comments", source.table.comments.count},
                {"repeated_headers", source.table.headers.count},
                {"decimal_commas", source.table.decimal_commas.count},
                {"dropped", Json::object()},
                {"not_a_number", Json::object()},
                {"largest_offset_s", source.log.largest_offset},
                {"largest_rate", source.log.largest_rate},
                {"input_deviation", source.log.input_deviation}};
  for (std::size_t cause = 0; cause < source.log.dropped.size(); ++cause)
    if (source.log.dropped[cause].count > 0)
      document["dropped"][WordsOf(static_cast<Dropped>(cause)).word] = ToJson(source.log.dropped[cause]);
  if (source.log.At(Dropped::kGap).count > 0) {
    document["dropped"]["gap"]["median_distance_s"] = source.log.median_gap;
    document["dropped"]["gap"]["largest_distance_s"] = source.log.largest_gap;
  }
  for (std::size_t j = 0; j < columns.size(); ++j)
    if (source.table.not_a_number[j].count > 0)
      document["not_a_number"][columns[j]] = ToJson(source.table.not_a_number[j]);
  return document;
}

std::string Line(const Finding& finding, const std::string& what) {
  return fmt::format("  {:>9}  {}; first in line {}{}\n", finding.count, what, finding.first_line,
                     finding.first.empty() ? "" : fmt::format(" ({})", Printable(finding.first)));
}

std::string Milliseconds(double seconds) { return fmt::format("{} ms", RoundedUp(seconds * 1000, 3)); }

// How far the nearest stamps are, for the starts that have none near enough.
void PrintGaps(const ImportedLog& log, const ImportArguments& options) {
  std::cout << "             the nearest is " << Milliseconds(log.median_gap) << " from t + dt in the median, "
            << Milliseconds(log.largest_gap) << " at most; --tolerance-ms is " << ToText(options.tolerance_ms) << "\n";
}

void PrintForPeople(const Source& source, const std::vector<std::string>& columns, const ImportArguments& options) {
  const auto& [table, log] = source;
  std::cout << table.path << ": " << log.transitions.size() << " transitions from " << table.num_rows() << " rows";
  if (log.typical_spacing > 0) std::cout << fmt::format(", typically {:.6g} s apart", log.typical_spacing);
  if (table.blank.count + table.comments.count > 0)
    std::cout << "; " << table.blank.count << " blank lines, " << table.comments.count << " comments";
  std::cout << "\n";
  for (std::size_t j = 0; j < columns.size(); ++j)
    if (const Finding& finding = table.not_a_number[j]; finding.count > 0)
      std::cout << Line({finding.count, finding.first_line, "'" + finding.first + "'"},
                        fmt::format("fields of '{}' that are no number", columns[j]));
  if (const Finding& commas = table.decimal_commas; commas.count > 0)
    std::cout << Line({commas.count, commas.first_line, "'" + commas.first + "'"},
                      "numbers with a decimal comma: give --decimal comma");
  if (table.headers.count > 0) std::cout << Line(table.headers, "lines that repeat the header");
  for (std::size_t cause = 0; cause < log.dropped.size(); ++cause)
    if (log.dropped[cause].count > 0) {
      std::cout << Line(log.dropped[cause], WordsOf(static_cast<Dropped>(cause)).line);
      if (static_cast<Dropped>(cause) == Dropped::kGap) PrintGaps(log, options);
    }
}

// "x 0.0012, y 0.001", of those that are not zero; empty if all are.
std::string Listed(const std::vector<std::string>& names, const Eigen::VectorXd& values) {
  return Joined(names, [&](const std::string& name) {
    const double value = values[&name - names.data()];
    return value > 0 ? fmt::format("{} {}", name, RoundedUp(value, 3)) : "";
  });
}

// What the transitions cannot know, from the largest of all logs.
void PrintErrors(const std::vector<Source>& sources, const ImportArguments& options, const ImportOptions& import,
                 const NominalModel& model) {
  double offset = 0;
  Eigen::VectorXd rate = Eigen::VectorXd::Zero(model.num_states()), input = Eigen::VectorXd::Zero(model.num_inputs());
  for (const Source& source : sources) {
    offset = std::max(offset, source.log.largest_offset);
    rate = rate.cwiseMax(source.log.largest_rate);
    input = input.cwiseMax(source.log.input_deviation);
  }
  if (const std::string moved = Listed(model.state_names(), offset * rate); !moved.empty())
    std::cout << "Stamps are up to " << RoundedUp(offset * 1000, 3)
              << " ms off t + dt. At the largest mean rates seen, the states move in that time by up to\n  " << moved
              << (import.counts_durations
                      ? "\nColumn dt_error says it of each step, so it counts.\n"
                      : "\nThat is an error of the successor: declaration.noise_bound has to include it, since "
                        "neither the equations\nnor model.rate_bound say how each state moves with time.\n");
  if (const std::string differs = Listed(model.input_names(), input); !differs.empty())
    std::cout << "The logged inputs differ from the transition's input, "
              << (options.input_mean ? "their mean over the step" : "the one that the step began with")
              << ", by up to\n  " << differs
              << "\nWhat that does to the robot is part of the residual's error: declaration.disturbance has to "
                 "include it.\n";
}

// Of the rows of all logs, those that lie in a transition.
struct Share {
  std::int64_t rows = 0, used = 0;
  Dropped main_cause = Dropped::kCount;
  double gap = 0;  // s, the largest median distance of a log's starts without a stamp near t + dt

  [[nodiscard]] bool IsFew() const { return 2 * used < rows; }
};

Share ShareOf(const std::vector<Source>& sources) {
  Share share;
  std::array<std::int64_t, static_cast<std::size_t>(Dropped::kCount)> counts{};
  for (const Source& source : sources) {
    share.rows += source.log.rows;
    share.used += source.log.rows_used;
    share.gap = std::max(share.gap, source.log.median_gap);
    for (std::size_t cause = 0; cause < counts.size(); ++cause)
      // A reason that nothing helps against is not named.
      if (*WordsOf(static_cast<Dropped>(cause)).remedy != '\0') counts[cause] += source.log.dropped[cause].count;
  }
  // Of rows whose stamps go backwards, each is a piece that ends at once.
  const auto of = [&](Dropped cause) -> std::int64_t& { return counts[static_cast<std::size_t>(cause)]; };
  if (2 * of(Dropped::kBackwards) > of(Dropped::kEnd)) of(Dropped::kEnd) = 0;
  share.main_cause = static_cast<Dropped>(std::ranges::max_element(counts) - counts.begin());
  return share;
}

// Which part of the rows is in no transition, and what helps.
void PrintShare(const Share& share, double period) {
  if (share.used == share.rows) return;
  const std::int64_t dropped = share.rows - share.used;
  const bool tolerable = share.main_cause == Dropped::kGap && share.gap < period / 2;
  std::cout << fmt::format(
      "import: {} of {} rows ({:.3g} %) are in no transition; the most frequent reason: {} ({})\n", dropped, share.rows,
      100.0 * static_cast<double>(dropped) / static_cast<double>(share.rows), WordsOf(share.main_cause).line,
      tolerable ? fmt::format("--tolerance-ms {} takes half of these starts", RoundedUp(share.gap * 1000, 3))
                : WordsOf(share.main_cause).remedy);
}

// ---- How late commands act

constexpr int kMostDelay = 30;    // rows
constexpr double kMostSteps = 3;  // of dt

CommandDelay DelayOf(const std::vector<Source>& sources, const Problem& problem, const ImportOptions& import) {
  std::vector<const LogTable*> tables;
  double spacing = import.period;
  for (const Source& source : sources) {
    tables.push_back(&source.table);
    if (source.log.typical_spacing > 0) spacing = std::min(spacing, source.log.typical_spacing);
  }
  const double most = std::min<double>(kMostDelay, std::ceil(kMostSteps * import.period / spacing));
  try {
    return EstimateDelay(tables, problem, import, static_cast<int>(most));
  } catch (const ConfigError&) {
    return {};  // the logs begin too coarsely
  }
}

std::string NumberOfRows(int count) { return fmt::format("{} row{}", count, count == 1 ? "" : "s"); }

// What is known of the delay, in a sentence.
std::string Sentence(const CommandDelay& delay) {
  if (delay.error.empty() || (delay.least == 0 && delay.largest + 1 == std::ssize(delay.error)))
    return "how late commands act cannot be told: the inputs vary too little, or the model is off by more than they do";
  if (delay.IsKnown())
    return delay.best == 0 ? "commands act at once" : fmt::format("commands act {} late", NumberOfRows(delay.best));
  return fmt::format("commands act {} to {} late: which of them cannot be told", delay.least,
                     NumberOfRows(delay.largest));
}

void PrintDelay(const CommandDelay& delay, const NominalModel& model) {
  std::cout << "Commands: by the model's error, " << Sentence(delay) << ".\n";
  if (delay.error.empty() || delay.largest == 0) return;
  for (std::size_t d = 0; d < delay.error.size(); ++d)
    std::cout << fmt::format("  {:>3} rows late: {}\n", d, Listed(model.state_names(), delay.error[d]));
  if (delay.least > 0)
    std::cout << "Shift them with --command-delay " << delay.best
              << ": a certificate then is about inputs as they act, and whoever sends plans has to send each command "
                 "so much earlier.\nOr model it: for a delay of one dt, a state `held` with `held: u` in model.next, "
                 "`held` for u in the other equations, and --held held=u.\n";
}

Json ToJson(const CommandDelay& delay) {
  Json errors = Json::array();
  for (const Eigen::VectorXd& error : delay.error) errors.push_back(error);
  return {{"rows", delay.IsKnown() ? Json(delay.best) : Json(nullptr)},
          {"least", delay.least},
          {"largest", delay.largest},
          {"model_error", errors}};
}

// The rows of --command-delay N; of auto what the logs say.
int ShiftBy(const ImportArguments& options, const std::optional<CommandDelay>& delay) {
  if (!delay) {
    const auto [value, problem] = ParseNumber(options.command_delay);
    if (options.command_delay != "none" &&
        (!problem.empty() || !(value >= 0 && value <= 1e6) || std::floor(value) != value))
      Refuse("command-delay", fmt::format("'{}' is no whole number of rows, nor auto", options.command_delay));
    return options.command_delay == "none" ? 0 : static_cast<int>(value);
  }
  if (options.command_delay != "auto") return 0;
  if (!delay->IsKnown()) Refuse("command-delay", fmt::format("auto: {}; give a number of rows", Sentence(*delay)));
  return delay->best;
}

// Without --time and --rate, a column of this name has the stamps.
void FindTime(ImportArguments& options) {
  constexpr const char* kUsual = "time";
  if (IsMcap(options) && !options.lcm_types.empty()) Refuse("lcm-types", "is for LCM logs, not for MCAP files");
  if (IsRecording(options)) {
    if (options.rate) Refuse("rate", "recorded messages have stamps");
    if (options.time.empty()) options.time = "recorded";
    return;
  }
  const bool has_time = !options.time.empty(), has_rate = options.rate.has_value();
  if (has_time != has_rate) return;
  std::vector<std::string> columns;
  if (!has_time) columns = LogColumns(options.logs.front(), FormatOf(options));
  if (std::ranges::find(columns, kUsual) == columns.end())
    throw ConfigError("give either --time, the column of the stamps, or --rate, the rows in a second{}",
                      columns.empty() ? "" : fmt::format("; the columns are {}", Joined(columns)));
  options.time = kUsual;
}

int RunImport(ImportArguments options) {
  FindTime(options);
  const Config config = LoadConfig(options.config, TransitionsFile::kIgnore);
  const NominalModel& model = *config.problem->model;
  CheckJoin(options);
  ImportOptions import = ImportOptionsOf(options, config);
  const Columns wanted = ColumnsOf(options, import, model);
  const std::vector<std::string> columns = wanted.All(!options.rate);
  std::vector<Source> sources;
  Transitions all{Eigen::MatrixXd(0, model.num_variables()), Eigen::MatrixXd(0, model.num_states())};
  std::optional<Progress> progress(std::in_place, "logs read", options.logs.size());
  for (const std::string& path : options.logs) {
    Source& source = sources.emplace_back();
    source.table = TableOf(path, wanted, options);
    if (source.table.dates.count > 0 && import.time_unit > 0 && options.time_unit != "s")
      Refuse("time-unit", "the stamps are dates, whose unit is s");
    source.log = Import(source.table, *config.problem, import);
    progress->Advance();
  }
  progress.reset();
  std::optional<CommandDelay> delay;
  if (options.inputs_from.empty() && (options.command_delay == "none" || options.command_delay == "auto"))
    if (model.num_inputs() > 0 && sources.front().table.is_command.empty())
      delay = DelayOf(sources, *config.problem, import);
  import.command_delay = ShiftBy(options, delay);
  for (Source& source : sources) {
    if (import.command_delay > 0) source.log = Import(source.table, *config.problem, import);
    const Transitions& found = source.log.transitions;
    const Eigen::Index before = all.z.rows();
    all.z.conservativeResize(before + found.z.rows(), Eigen::NoChange);
    all.x_next.conservativeResize(before + found.z.rows(), Eigen::NoChange);
    all.z.bottomRows(found.z.rows()) = found.z;
    all.x_next.bottomRows(found.z.rows()) = found.x_next;
    if (!import.counts_durations) continue;
    all.longer.conservativeResize(all.z.rows());
    all.longer.tail(found.z.rows()) = found.longer;
  }
  const Share share = ShareOf(sources);
  const bool writes = all.size() > 0 && (options.keep_few || !share.IsFew());
  if (writes) SaveTransitions(options.out, model, all);
  if (options.json) {
    Json document{{"transitions", all.size()},
                  {"period_s", config.period},
                  {"rows", share.rows},
                  {"rows_used", share.used},
                  {"logs", Json::array()}};
    document["command_delay"] = delay ? ToJson(*delay) : Json(nullptr);
    document["shifted_by"] = import.command_delay;
    document["out"] = writes ? Json(options.out) : Json(nullptr);
    for (const Source& source : sources) document["logs"].push_back(ToJson(source, columns));
    std::cout << JsonText(document) << std::endl;
  } else {
    for (const Source& source : sources) PrintForPeople(source, columns, options);
    PrintErrors(sources, options, import, model);
    if (delay) PrintDelay(*delay, model);
    if (import.command_delay > 0)
      std::cout << "Each command counts " << NumberOfRows(import.command_delay) << " later.\n";
    std::cout << "import: " << all.size() << " transitions of " << ToText(config.period) << " s"
              << (writes ? fmt::format(" in {}", options.out) : fmt::format("; {} is not written", options.out))
              << std::endl;
    PrintShare(share, config.period);
  }
  if (all.size() > 0 && !writes)
    std::cerr << "forereach: less than half of the rows lie in a transition, and which half may be no matter of "
                 "chance: nothing is written. --keep-few writes it.\n";
  return writes ? 0 : 1;
}

}  // namespace

Command ImportCommand() {
  const auto options = std::make_shared<ImportArguments>();
  return {
      .name = "import",
      .footer = fmt::format(
          "A transition is (state at t, input held from t to t + dt, state at t + dt), with dt and the names of the "
          "task's model.\n"
          "A row's input holds until the next row. No state is interpolated, and no transition spans a lost row.\n"
          "docs/data.md says what else counts, and what of it is an error that the declaration has to allow for.\n"
          "\n"
          "Units beside those of the model: {}.\n"
          "\n"
          "Examples:\n"
          "  forereach import --config my_robot.yaml --time stamp --out transitions.csv log.csv\n"
          "  forereach import --config my_robot.yaml --time 'mocap time' --time-unit ms --tolerance-ms 2 \\\n"
          "    --state x='mocap x' --state theta='mocap yaw' --unit theta=deg --unwrap theta \\\n"
          "    --input a=cmd.accel --input-mean --out transitions.csv monday.csv tuesday.csv\n"
          "  forereach import --config my_robot.yaml --state x=/odom.pose.pose.position.x \\\n"
          "    --state v=/odom.twist.twist.linear.x --input u=/cmd_vel.linear.x --out transitions.csv run.mcap",
          Joined(KnownUnits(), [](const Unit& unit) { return unit.name; })),
      .options =
          {ConfigOption(options->config, "Task file (YAML): its model, dt and domain; its transitions are not read"),
           Required({"--out", &options->out, "FILE.csv", "The transitions, for the key `transitions`"}),
           {"--time", &options->time, "COLUMN",
            "The column of the stamps, numbers or dates of ISO 8601, or seconds_of(SECONDS,NANOSECONDS); by default "
            "`time`, if there is such a column and no --rate"},
           {"--time-unit", &options->time_unit, "UNIT", "Unit of the stamps: s, ms, us, ns, min, h"},
           {"--rate", &options->rate, "", "There are no stamps: so many rows are recorded in a second",
            NumberRange{1e-6, 1e9}},
           {"--state", &options->states, "NAME=COLUMN",
            "The column of a state, or yaw_of(QX,QY,QZ,QW) of a quaternion's four, yaw_of(QZ,QW) of a turn about z "
            "alone; by default the one of its name. May be repeated"},
           {"--input", &options->inputs, "NAME=COLUMN", "The same for an input"},
           {"--inputs-from", &options->inputs_from, "LOG.csv",
            "The inputs are in this log: each holds from its stamp until the next one's"},
           {"--inputs-time", &options->inputs_time, "COLUMN", "Its column of stamps; by default that of --time"},
           {"--lcm-types", &options->lcm_types, "FILE.lcm",
            "LOG is an LCM event log with messages of these types. Of it, and of an MCAP file (.mcap), columns are "
            "CHANNEL.field; `recorded`, the default of --time, is when a message was recorded. Inputs may be of "
            "another channel. May be repeated"},
           {"--unit", &options->units, "NAME=UNIT",
            "The unit of a state's or an input's column, or a factor: model's value = factor * value"},
           {"--unwrap", &options->unwrapped, "STATE",
            "An angle in rad: turns are added to the successor until it is within half a turn of the state"},
           {"--tolerance-ms", &options->tolerance_ms, "",
            "A stamp may be so far from t + dt; what the state moves in that time is part of its error",
            NumberRange{0, 1e6}},
           {"--input-tolerance", &options->input_tolerances, "NAME=VALUE",
            "An input may differ by so much during a step from the one that the step began with"},
           Excluding("--input-tolerance", {"--input-mean", &options->input_mean, "",
                                           "Take the mean of each input over the step, however it changes"}),
           {"--command-delay", &options->command_delay, "auto|N",
            "Commands act so many rows after theirs; auto: as many as the model's error says"},
           {"--held", &options->held, "STATE=INPUT",
            "This state has no column: it holds the input of the step before, for a robot that obeys one step late. "
            "May be repeated"},
           {"--overlapping", &options->overlapping, "",
            "Start a transition at each sample; by default where the one before it ended"},
           {"--keep-few", &options->keep_few, "",
            "Write the transitions also if less than half of the rows are in one"},
           {"--from", &options->from, "", "Leave out samples before so many seconds after a log's first stamp",
            NumberRange{0, 1e12}},
           {"--until", &options->until, "", "Leave out samples after so many seconds", NumberRange{0, 1e12}},
           OneOf({"auto", "comma", "semicolon", "tab", "blank"},
                 {"--delimiter", &options->delimiter, "",
                  "What stands between two fields; by default the one that the header contains"}),
           OneOf({"point", "comma"},
                 {"--decimal", &options->decimal, "", "What stands before the decimals of a number"}),
           {"--comment", &options->comment, "TEXT", "A line that begins with this text is a comment"},
           {"--header", &options->header, "NAMES",
            "The names of the columns, with commas between, of a log that does not begin with them"},
           JsonFlag(options->json),
           Required({"logs", &options->logs, "LOG.csv", "Logs; no transition goes from one to the next"})},
      .run = [options] { return RunImport(*options); }};
}

}  // namespace forereach
