// The rows of the nominal model: one of the library, or equations as text, in the task file or in a model file.
#include <algorithm>
#include <cctype>
#include <cstddef>
#include <filesystem>
#include <iterator>
#include <map>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "command_line/nearest.h"
#include "forereach/dynamics/expression.h"
#include "forereach/dynamics/models/named_models.h"
#include "forereach/dynamics/text_model.h"
#include "forereach/numerics/text.h"
#include "task/document.h"
#include "task/draft.h"
#include "task/key_rows.h"
#include "task/model_file.h"
#include "task/named_values.h"
#include "task/row_readers.h"
#include "task/schema_parts.h"

namespace forereach::key_rows {
namespace {

using Integrator = ModelText::Integrator;

constexpr Range kStep = UpTo(60);
constexpr int kMostNames = 1000;  // of parameters, and of definitions
constexpr std::size_t kLongestUnit = 64;
constexpr const char *kStepName = "dt", *kNextEnding = "_next";

std::vector<std::string> ReadAngles(const Field& model) {
  return model.Has("angles") ? model["angles"].Names() : std::vector<std::string>{};
}

// @throws ConfigError if one of the angles of `model` is no state.
void RequireStates(const Field& model, const std::vector<std::string>& states) {
  for (const std::string& name : ReadAngles(model))
    if (std::ranges::find(states, name) == states.end())
      model.Fail("angles", fmt::format("{} is no state; {}", name, Suggestion(name, states)));
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
ModelText::Parameter ReadModelParameter(const Field& at) {
  ModelText::Parameter parameter = ReadParameter(at);
  if (at.name() != kStepName) return parameter;
  if (at.Count() != 0) at.Fail("is a list, has to be one number: the step is exact");
  if (!kStep.Contains(parameter.lower))
    at.Fail(fmt::format("{} is outside {}, its unit is s", ToText(parameter.lower), kStep.text()));
  return parameter;
}

// Reads the map `model` of a document as text. The document is a task file or a model file.
class TextReader final {
 public:
  explicit TextReader(const Field& model) : model_(model) {}

  ModelText Read() {
    text_.file = model_.file();
    ReadVariables("states", kMaxStates, text_.states);
    ReadVariables("inputs", kMaxInputs, text_.inputs);
    ReadParameters();
    for (const Field& let : EntriesOf("let", 0, kMostNames))
      text_.definitions.push_back({let.name(), let.Expression()});
    ReadEquations();
    text_.angles = ReadAngles(model_);
    return std::move(text_);
  }

 private:
  // The values of a map of the model, whose names get their meaning.
  std::vector<Field> EntriesOf(const std::string& map, int least, int most) {
    std::vector<Field> entries = model_.Entries(map);
    if (const Range count = Between(least, most); !count.Contains(static_cast<double>(entries.size())))
      model_.Fail(map, fmt::format("has {} entries, which is outside {}", entries.size(), count.text()));
    for (const Field& entry : entries) Take(map, entry);
    return entries;
  }

  // No name has two meanings.
  void Take(const std::string& map, const Field& entry) {
    const std::string& name = entry.name();
    if (IsReserved(name))
      entry.Fail(fmt::format("{}{} of the language; choose another name", name,
                             name == "pi" ? " is a number" : " is a function"));
    const auto [other, is_new] = meanings_.emplace(name, map);
    if (!is_new) entry.Fail(fmt::format("is a name of model.{} already; choose another name", other->second));
  }

  void ReadVariables(const std::string& map, int most, std::vector<ModelText::Variable>& variables) {
    if (!model_.Has(map)) model_.Fail(map, "missing: a model as text needs this key");
    for (const Field& variable : EntriesOf(map, 1, most)) {
      const std::string unit = variable.Text();
      if (unit.size() > kLongestUnit || std::ranges::any_of(unit, [](unsigned char c) { return std::iscntrl(c) != 0; }))
        variable.Fail(fmt::format("a unit has at most {} bytes and no control characters", kLongestUnit));
      variables.push_back({variable.name(), unit});
    }
    if (&variables == &text_.states) return;
    for (const ModelText::Variable& state : text_.states)  // a column of transitions
      if (const std::string next = state.name + kNextEnding; meanings_.contains(next))
        model_[meanings_[next]].Fail(
            next, fmt::format("is the column of the state {} after a step; choose another name", state.name));
  }

  void ReadParameters() {
    if (!model_.Has("parameters")) model_.Fail("parameters.dt", "missing: the step of the model, in s");
    for (const Field& parameter : EntriesOf("parameters", 1, kMostNames))
      text_.parameters.push_back(ReadModelParameter(parameter));
    if (!model_["parameters"].Has(kStepName))
      model_["parameters"].Fail(kStepName, "missing: the step of the model, in s");
  }

  void ReadEquations() {
    const bool is_rate = model_.Has("rate"), has_integrator = model_.Has("integrator");
    if (is_rate == model_.Has("next"))
      model_.Fail(is_rate ? "has both next and rate; delete one of them"
                          : "has neither next, the states after a step, nor rate, their derivatives");
    if (is_rate != has_integrator)
      model_.Fail("integrator", is_rate ? "missing: how the rates give the next state, one of euler, midpoint, rk4"
                                        : "is for model.rate; model.next is the next state itself");
    if (is_rate) text_.integrator = ValueNamed(Integrators(), model_["integrator"].Text());
    const Field map = model_[is_rate ? "rate" : "next"];
    for (const ModelText::Variable& state : text_.states) {
      if (!map.Has(state.name)) map.Fail(state.name, "missing: each state needs its equation");
      text_.equations.push_back(map[state.name].Expression());
    }
  }

  const Field model_;
  ModelText text_;
  std::map<std::string, std::string> meanings_;  // of each name the map that has it
};

// The parameters of a task file replace those of the model file that it includes.
void Override(const Field& model, ModelText& text) {
  std::vector<std::string> known;
  for (const ModelText::Parameter& parameter : text.parameters) known.push_back(parameter.name);
  for (const Field& at : model.Entries("parameters")) {
    const auto parameter = std::ranges::find(text.parameters, at.name(), &ModelText::Parameter::name);
    if (parameter == text.parameters.end())
      at.Fail(fmt::format("is not a parameter of {}; {}", text.file, Suggestion(at.name(), known)));
    *parameter = ReadModelParameter(at);
  }
}

// The names that equations may use are those of the map `model` so far.
void ReadStates(const Field& at, TaskDraft& draft) { draft.scope.states = at.Keys(); }

ModelText ReadModelFile(const Field& model, TaskDraft& draft) {
  const std::string name = model["file"].Text(), place = model["file"].Place();
  std::string& path = draft.model_file.path;
  if (path.empty()) path = FindModelFile(model.file(), name, place);
  ModelText text = LoadModelFile(path, place, &draft.model_file.bytes);
  text.name = std::filesystem::path(name).stem().string();
  Override(model, text);
  if (model.Has("angles")) {
    std::vector<std::string> states;
    for (const ModelText::Variable& state : text.states) states.push_back(state.name);
    text.angles = ReadAngles(model);
    RequireStates(model, states);
  }
  return text;
}

// Beside what says which model it is, `model` has only what belongs to it.
void RequireOnly(const Field& model, const std::vector<std::string>& allowed, const std::string& why) {
  for (const Field& at : model.Entries())
    if (std::ranges::find(allowed, at.name()) == allowed.end()) at.Fail(why);
}

std::shared_ptr<const NominalModel> MakeFromText(const ModelText& text) {
  try {
    return CompiledFor(MakeTextModel(text));
  } catch (const ExpressionError& error) {
    FailAt(text.file, error);
  }
}

std::shared_ptr<const NominalModel> ReadNamedModel(const Field& at) {
  std::vector<std::string> keys{"name", kStepName, "angles", "set_at_steps", "rate_bound"};
  for (const NamedModel& model : NamedModels())
    for (const NamedModel::Parameter& parameter : model.parameters) keys.emplace_back(parameter.name);
  RequireOnly(at, keys, "is for a model as text, this one has a name");
  if (!at.Has(kStepName)) at.Fail(kStepName, "missing: The time from one control to the next.");
  const NamedModel& model = *ValueNamed(Models(), at["name"].Text());
  std::vector<double> parameters{at[kStepName].Number()};
  for (const NamedModel::Parameter& parameter : model.parameters) parameters.push_back(at[parameter.name].Number());
  const std::vector<std::string> states(model.states.begin(), model.states.end());
  RequireStates(at, states);
  std::vector<int> angles;
  for (const std::string& name : ReadAngles(at)) angles.push_back(IndexOf(states, name));
  std::ranges::sort(angles);
  try {
    return model.make(parameters, std::move(angles));
  } catch (const std::invalid_argument& error) {  // the parameters are in their ranges
    at.Fail("angles", error.what());
  }
}

std::shared_ptr<const NominalModel> ReadTextModel(const Field& at, TaskDraft& draft) {
  if (at.Has("file")) {
    RequireOnly(at, {"file", "parameters", "angles", "set_at_steps", "rate_bound"},
                "stands in the model file, not beside its name");
    return MakeFromText(ReadModelFile(at, draft));
  }
  if (at.Has(kStepName)) at.Fail(kStepName, "is model.parameters.dt of a model as text");
  ModelText text = TextReader(at).Read();
  text.name = "equations";
  return MakeFromText(text);
}

// How states move with time where the equations do not say it.
void ReadTiming(const Field& at, TaskDraft& draft) {
  const std::vector<std::string>& states = draft.problem.model->state_names();
  StepTiming& timing = draft.problem.timing;
  const auto index = [&](const Field& of, const std::string& name) {
    const auto found = std::ranges::find(states, name);
    if (found == states.end()) of.Fail(fmt::format("{} is no state; {}", name, Suggestion(name, states)));
    return static_cast<int>(found - states.begin());
  };
  if (at.Has("set_at_steps"))
    for (const std::string& name : at["set_at_steps"].Names())
      timing.set_at_steps.push_back(index(at["set_at_steps"], name));
  for (const Field& bound : at.Entries("rate_bound")) {
    if (timing.rate_bound.size() == 0)
      timing.rate_bound.setConstant(static_cast<Eigen::Index>(states.size()), kInfinity);
    timing.rate_bound[index(bound, bound.name())] = bound.Number();
  }
}

void ReadModel(const Field& at, TaskDraft& draft) {
  const bool has_kind = at.Has("name") || at.Has("file") || at.Has("states");
  if (!has_kind) at.Fail("has no model: write name, file, or states with their equations");
  draft.problem.model = at.Has("name") ? ReadNamedModel(at) : ReadTextModel(at, draft);
  const NominalModel& model = *draft.problem.model;
  draft.scope = {model.state_names(), model.input_names(), model.variable_names()};
  ReadTiming(at, draft);
  draft.config.period = StepOf(model);
  draft.config.gate.longest_step_ms = draft.config.period * 1e3;
  draft.config.robot.step_period_ms = draft.config.period * 1e3;
}

Key ParameterRange() {
  Key key = Vector("model.parameters.<name>", "", kReal, Key::Size::kAny,
                   "The least and the largest value; it is the same at all times.");
  key.count = Between(2, 2);
  return key;
}

Key AnglesKey() {
  return Optional(
      Names("model.angles", Between(0, kMaxStates), Key::Size::kStates,
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
  keys.push_back(Optional(Names("model.set_at_steps", Between(0, kMaxStates), Key::Size::kStates,
                                "The states that the robot's software sets at the boundaries of steps, whatever a step "
                                "lasts: what robot.step_error_ms adds leaves them out."),
                          "none"));
  keys.push_back(Map("model.rate_bound",
                     "Where equations in `next` do not use dt, how fast the true state moves: robot.step_error_ms "
                     "needs it of each such state."));
  keys.push_back(Number("model.rate_bound.<state>", "of the state, per second", kNotNegative,
                        "The largest absolute derivative of the state in true motions."));
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
  file.Read(draft, ModelFileSchema());
  if (bytes != nullptr) *bytes = file.text();
  ModelText text = key_rows::TextReader(file.root()["model"]).Read();
  text.name = std::filesystem::path(path).stem().string();
  return text;
}

}  // namespace forereach
