// The rows of the nominal model: one of the library, or equations as text, in the task file or in a model file.
#include <algorithm>
#include <cctype>
#include <cstddef>
#include <filesystem>
#include <iterator>
#include <map>
#include <stdexcept>
#include <utility>

#include "command_line/nearest.h"
#include "forereach/dynamics/compiled_models.h"
#include "forereach/dynamics/expression.h"
#include "forereach/dynamics/models/named_models.h"
#include "forereach/dynamics/text_model.h"
#include "forereach/numerics/size.h"
#include "task/config_error.h"
#include "task/key_rows.h"
#include "task/model_file.h"

namespace forereach::key_rows {
namespace {

using Integrator = ModelText::Integrator;

constexpr Range kStep = UpTo(60);
constexpr int kMostNames = 1000;  // of parameters, and of definitions
constexpr std::size_t kLongestUnit = 64;
constexpr const char *kStepName = "dt", *kNextEnding = "_next";

constexpr const char* kAngles = "model.angles";

std::vector<std::string> ReadAngles(const Document& file) {
  return Has(file, "model", "angles") ? file.Names(kAngles) : std::vector<std::string>{};
}

// @throws ConfigError if one is no state.
void RequireStates(const Document& file, const std::vector<std::string>& angles,
                   const std::vector<std::string>& states) {
  for (const std::string& name : angles)
    if (std::ranges::find(states, name) == states.end())
      file.Fail(kAngles, name + " is no state; " + Suggestion(name, states));
}

const std::vector<Named<const NamedModel*>>& Models() {
  static const std::vector<Named<const NamedModel*>> models = [] {
    std::vector<Named<const NamedModel*>> rows;
    for (const NamedModel& model : NamedModels()) rows.push_back({model.name, &model});
    return rows;
  }();
  return models;
}

const std::vector<Named<Integrator>>& Integrators() {
  static const std::vector<Named<Integrator>> integrators{
      {"euler", Integrator::kEuler}, {"midpoint", Integrator::kMidpoint}, {"rk4", Integrator::kRk4}};
  return integrators;
}

// The step is a number in its range.
ModelText::Parameter ReadModelParameter(const Document& file, const std::string& key, const std::string& name) {
  ModelText::Parameter parameter = ReadParameter(file, key, name);
  if (name != kStepName) return parameter;
  if (file.Count(key) != 0) file.Fail(key, "is a list, has to be one number: the step is exact");
  if (!kStep.Contains(parameter.lower))
    file.Fail(key, ToText(parameter.lower) + " is outside " + kStep.text() + ", its unit is s");
  return parameter;
}

// Reads the map `model` of a document as text. The document is a task file or a model file.
class TextReader final {
 public:
  explicit TextReader(const Document& file) : file_(file) {}

  ModelText Read() {
    text_.file = file_.path();
    ReadVariables("states", kMaxStates, text_.states);
    ReadVariables("inputs", kMaxInputs, text_.inputs);
    ReadParameters();
    ReadDefinitions();
    ReadEquations();
    text_.angles = ReadAngles(file_);
    return std::move(text_);
  }

 private:
  // The names of a map that is there.
  std::vector<std::string> NamesOf(const std::string& map, int least, int most) {
    const std::string key = "model." + map;
    const std::vector<std::string> names = file_.KeysOf(key);
    if (const Range count = Between(least, most); !count.Contains(static_cast<double>(names.size())))
      file_.Fail(key, "has " + std::to_string(names.size()) + " entries, which is outside " + count.text());
    for (const std::string& name : names) Take(map, name);
    return names;
  }

  // No name has two meanings.
  void Take(const std::string& map, const std::string& name) {
    const std::string key = "model." + map + "." + name;
    if (IsReserved(name))
      file_.Fail(key,
                 name + (name == "pi" ? " is a number" : " is a function") + " of the language; choose another name");
    const auto [other, is_new] = meanings_.emplace(name, map);
    if (!is_new) file_.Fail(key, "is a name of model." + other->second + " already; choose another name");
  }

  void ReadVariables(const std::string& map, int most, std::vector<ModelText::Variable>& variables) {
    if (!Has(file_, "model", map)) file_.Fail("model." + map, "missing: a model as text needs this key");
    for (const std::string& name : NamesOf(map, 1, most)) {
      const std::string key = "model." + map + "." + name, unit = file_.Text(key);
      if (unit.size() > kLongestUnit || std::ranges::any_of(unit, [](unsigned char c) { return std::iscntrl(c) != 0; }))
        file_.Fail(key, "a unit has at most " + std::to_string(kLongestUnit) + " bytes and no control characters");
      variables.push_back({name, unit});
    }
    if (&variables == &text_.states) return;
    for (const ModelText::Variable& state : text_.states)  // a column of transitions
      if (const std::string next = state.name + kNextEnding; meanings_.contains(next))
        file_.Fail("model." + meanings_[next] + "." + next,
                   "is the column of the state " + state.name + " after a step; choose another name");
  }

  void ReadParameters() {
    if (!Has(file_, "model", "parameters")) file_.Fail("model.parameters.dt", "missing: the step of the model, in s");
    for (const std::string& name : NamesOf("parameters", 1, kMostNames))
      text_.parameters.push_back(ReadModelParameter(file_, "model.parameters." + name, name));
    if (!meanings_.contains(kStepName) || meanings_[kStepName] != "parameters")
      file_.Fail("model.parameters.dt", "missing: the step of the model, in s");
  }

  void ReadDefinitions() {
    for (const std::string& name : NamesOf("let", 0, kMostNames))
      text_.definitions.push_back({name, file_.Expression("model.let." + name)});
  }

  void ReadEquations() {
    const bool is_rate = Has(file_, "model", "rate"), has_integrator = Has(file_, "model", "integrator");
    if (is_rate == Has(file_, "model", "next"))
      file_.Fail("model", is_rate ? "has both next and rate; delete one of them"
                                  : "has neither next, the states after a step, nor rate, their derivatives");
    if (is_rate != has_integrator)
      file_.Fail("model.integrator", is_rate ? "missing: how the rates give the next state, one of euler, midpoint, rk4"
                                             : "is for model.rate; model.next is the next state itself");
    if (is_rate) text_.integrator = ValueNamed(Integrators(), file_.Text("model.integrator"));
    const std::string map = is_rate ? "model.rate" : "model.next";
    for (const ModelText::Variable& state : text_.states) {
      if (!Has(file_, map, state.name)) file_.Fail(map + "." + state.name, "missing: each state needs its equation");
      text_.equations.push_back(file_.Expression(map + "." + state.name));
    }
  }

  const Document& file_;
  ModelText text_;
  std::map<std::string, std::string> meanings_;  // of each name the map that has it
};

// The parameters of a task file replace those of the model file that it includes.
void Override(const Document& task, ModelText& text) {
  const std::string map = "model.parameters";
  std::vector<std::string> known;
  for (const ModelText::Parameter& parameter : text.parameters) known.push_back(parameter.name);
  for (const std::string& name : task.KeysOf(map)) {
    const std::string key = map + "." + name;
    const auto parameter = std::ranges::find(text.parameters, name, &ModelText::Parameter::name);
    if (parameter == text.parameters.end())
      task.Fail(key, "is not a parameter of " + text.file + "; " + Suggestion(name, known));
    *parameter = ReadModelParameter(task, key, name);
  }
}

// The names that equations may use are those of the map `model` so far.
void ReadStates(const Document& file, const std::string& key, TaskDraft& draft) {
  draft.scope.states = file.KeysOf(key);
}

ModelText ReadModelFile(const Document& task, TaskDraft& draft) {
  const std::string key = "model.file", name = task.Text(key), place = task.Place(key);
  std::string& path = draft.model_file.path;
  if (path.empty()) path = FindModelFile(task.path(), name, place);
  ModelText text = LoadModelFile(path, place, &draft.model_file.bytes);
  text.name = std::filesystem::path(name).stem().string();
  Override(task, text);
  if (Has(task, "model", "angles")) {
    std::vector<std::string> states;
    for (const ModelText::Variable& state : text.states) states.push_back(state.name);
    text.angles = ReadAngles(task);
    RequireStates(task, text.angles, states);
  }
  return text;
}

// Beside what says which model it is, `model` has only what belongs to it.
void RequireOnly(const Document& file, const std::vector<std::string>& allowed, const std::string& why) {
  for (const std::string& name : file.KeysOf("model"))
    if (std::ranges::find(allowed, name) == allowed.end()) file.Fail("model." + name, why);
}

std::shared_ptr<const NominalModel> MakeFromText(const ModelText& text) {
  try {
    return CompiledFor(MakeTextModel(text));
  } catch (const ExpressionError& error) {
    FailAt(text.file, error);
  }
}

std::shared_ptr<const NominalModel> ReadNamedModel(const Document& file) {
  std::vector<std::string> keys{"name", kStepName, "angles"};
  for (const NamedModel& model : NamedModels())
    for (const NamedModel::Parameter& parameter : model.parameters) keys.emplace_back(parameter.name);
  RequireOnly(file, keys, "is for a model as text, this one has a name");
  if (!Has(file, "model", kStepName)) file.Fail("model.dt", "missing: The time from one control to the next.");
  const NamedModel& model = *ValueNamed(Models(), file.Text("model.name"));
  std::vector<double> parameters{file.Number("model.dt")};
  for (const NamedModel::Parameter& parameter : model.parameters)
    parameters.push_back(file.Number("model." + std::string(parameter.name)));
  const std::vector<std::string> states(model.states.begin(), model.states.end());
  RequireStates(file, ReadAngles(file), states);
  std::vector<int> angles;
  for (const std::string& name : ReadAngles(file))
    angles.push_back(static_cast<int>(std::ranges::find(states, name) - states.begin()));
  std::ranges::sort(angles);
  try {
    return model.make(parameters, std::move(angles));
  } catch (const std::invalid_argument& error) {  // the parameters are in their ranges
    file.Fail(kAngles, error.what());
  }
}

std::shared_ptr<const NominalModel> ReadTextModel(const Document& file, TaskDraft& draft) {
  if (Has(file, "model", "file")) {
    RequireOnly(file, {"file", "parameters", "angles"}, "stands in the model file, not beside its name");
    return MakeFromText(ReadModelFile(file, draft));
  }
  if (Has(file, "model", kStepName)) file.Fail("model.dt", "is model.parameters.dt of a model as text");
  ModelText text = TextReader(file).Read();
  text.name = "equations";
  return MakeFromText(text);
}

void ReadModel(const Document& file, const std::string& key, TaskDraft& draft) {
  const bool has_kind = Has(file, key, "name") || Has(file, key, "file") || Has(file, key, "states");
  if (!has_kind) file.Fail(key, "has no model: write name, file, or states with their equations");
  draft.problem.model = Has(file, key, "name") ? ReadNamedModel(file) : ReadTextModel(file, draft);
  const NominalModel& model = *draft.problem.model;
  draft.scope = {model.state_names(), model.input_names(), model.variable_names()};
  draft.config.period = StepOf(model);
  draft.config.gate.longest_step_ms = draft.config.period * 1e3;
}

Key ParameterRange() {
  Key key = Vector("model.parameters.<name>", "", kReal, Key::Size::kAny,
                   "The least and the largest value; it is the same at all times.");
  key.count = Between(2, 2);
  return key;
}

Key AnglesKey() {
  return Optional(
      Names(kAngles, Between(0, kMaxStates), Key::Size::kStates,
            "The states that are angles, which may come wrapped or not. The equations must not tell turns apart, and "
            "no step may turn one by three quarters of a turn or more beyond the model "
            "([docs/expressions.md](../docs/expressions.md#angles)). Beside `model.file`: instead of the file's."),
      "none");
}

// Of a model as text.
std::vector<Key> TextKeys() {
  return {
      Map("model.states", "1 to 16 names with their units, in this order.", ReadStates),
      Text("model.states.<name>", "Its unit, for people: `m`, `rad/s`; `1` for a pure number."),
      Map("model.inputs", "1 to 8 names with their units, in this order."),
      Text("model.inputs.<name>", "Its unit."),
      Map("model.parameters",
          "In the units of the equations. `dt`, the time from one control to the next, is required, in (0, 60] s. "
          "Beside `model.file`: those whose values differ."),
      Number("model.parameters.<name>", "", kReal, "The value, the same at all times."),
      ParameterRange(),
      Map("model.let", "Definitions, which later expressions may use."),
      Expression("model.let.<name>",
                 "It may use states, inputs, parameters and the definitions before it "
                 "([docs/expressions.md](../docs/expressions.md))."),
      Map("model.next", "The states after a step. A model as text has this or `model.rate`."),
      Expression("model.next.<state>", "It may use all definitions."),
      Map("model.rate", "The derivatives of the states."),
      Expression("model.rate.<state>", "In the state's unit per second."),
      Word("model.integrator", NamesIn(Integrators()),
           "How the rates give the next state. The model is this formula; its error belongs to the residual. Required "
           "with `model.rate`."),
      AnglesKey(),
  };
}

}  // namespace

void FailAt(const std::string& file, const ExpressionError& error) {
  throw ConfigError(file + ":" + std::to_string(error.line()) + ":" + std::to_string(error.column()) + ": " +
                    error.what() + (error.word().empty() ? "" : "; " + Suggestion(error.word(), error.known())));
}

std::vector<Key> ModelKeys() {
  std::vector<Key> keys{
      Required(Map("model", "The nominal model f0: `name`, `file`, or `states` with their equations.", ReadModel)),
      Word("model.name", NamesIn(Models()), "A compiled model."),
      Number("model.dt", "s", kStep, "The time from one control to the next. Required with `model.name`."),
  };
  for (const NamedModel& model : NamedModels())
    for (const NamedModel::Parameter& parameter : model.parameters)
      keys.push_back(OnlyFor(std::string(model.name),
                             Required(Number("model." + std::string(parameter.name), std::string(parameter.unit),
                                             UpTo(parameter.most), std::string(parameter.meaning)))));
  keys.push_back(Text("model.file",
                      "A model file, relative to this file or to the installed config directory: "
                      "`models/unicycle.yaml`. It has one map, `model`, with a model as text."));
  std::ranges::move(TextKeys(), std::back_inserter(keys));
  return keys;
}

std::vector<Key> ModelFileKeys() {
  std::vector<Key> keys{Required(Map("model", "A model as text."))};
  std::ranges::move(TextKeys(), std::back_inserter(keys));
  return keys;
}

}  // namespace forereach::key_rows

namespace forereach {

ModelText LoadModelFile(const std::string& path, const std::string& named_by, std::string* bytes) {
  Document file(path, named_by);
  TaskDraft draft;
  file.Check(
      draft.scope,
      [&](const Key& row, const std::string& at) {
        if (row.read) row.read(file, at, draft);
      },
      ModelFileSchema());
  if (bytes != nullptr) *bytes = file.text();
  ModelText text = key_rows::TextReader(file).Read();
  text.name = std::filesystem::path(path).stem().string();
  return text;
}

}  // namespace forereach
