// The rows of residuals: `residual`, which `forereach declare` bounds, and `robot.residual`.
#include <numbers>

#include <fmt/core.h>

#include "forereach/dynamics/angles.h"
#include "forereach/dynamics/expression.h"
#include "forereach/dynamics/models/named_residuals.h"
#include "forereach/dynamics/text_program.h"
#include "forereach/numerics/text.h"
#include "task/draft.h"
#include "task/key_rows.h"
#include "task/row_readers.h"
#include "task/schema_parts.h"

namespace forereach::key_rows {
namespace {

constexpr const char* kNone = "none";

// A parameter of a residual of the library.
struct ParameterRow {
  const char *residual, *name, *unit;
  Range range;
  const char* meaning;
};

constexpr ParameterRow kParameters[] = {
    {"heading_saturation", "understeer", "", kReal, "Fraction of the heading rate lost in full saturation."},
    {"heading_saturation", "friction", "", kNotNegative,
     "Friction coefficient; saturation begins at friction times gravity."},
    {"heading_saturation", "gravity", "m/s^2", kPositive, "Gravity."},
    {"heading_saturation", "gate_temperature", "s^2/m", kPositive, "How fast the saturation begins."},
    {"velocity_knee", "damping", "1/s", kReal, "Drag along the velocity."},
    {"velocity_knee", "cross", "1/s", kReal, "Force across the velocity."},
    {"velocity_knee", "knee", "m/s", kNotNegative, "The speed above which drag and lateral force act."},
    {"velocity_knee", "softplus_temperature", "m/s", kPositive, "How fast drag and lateral force begin."},
    {"velocity_knee", "regularizer", "m/s", kPositive, "Keeps the gain finite at rest."},
    {"velocity_knee", "smoothing", "m^2/s^2", kPositive, "Makes the speed differentiable at rest."},
};

std::vector<std::string_view> Names() {
  std::vector<std::string_view> names;
  for (const ResidualText& residual : NamedResiduals()) names.push_back(residual.name);
  return names;
}

ModelText::Parameter& ParameterNamed(ResidualText& residual, std::string_view name) {
  const auto found = std::ranges::find(residual.parameters, name, &ModelText::Parameter::name);
  if (found == residual.parameters.end())
    throw std::logic_error(fmt::format("{} has no parameter {}", residual.name, name));
  return *found;
}

// The map `path` as a residual: of the library, or as text. Its parameters may be intervals.
ResidualText ReadText(const Field& at) {
  const bool has_name = at.Has("name");
  if (has_name == at.Has("add"))
    at.Fail(has_name ? "has both name and add; delete one of them"
                     : "has neither add, what the next states have beyond the model's, nor name");
  if (!has_name) {
    ResidualText text{"the residual", {}, {}, {}};
    for (const Field& parameter : at.Entries("parameters")) text.parameters.push_back(ReadParameter(parameter));
    for (const Field& let : at.Entries("let")) text.definitions.push_back({let.name(), let.Expression()});
    for (const Field& value : at.Entries("add")) text.values.emplace(value.name(), value.Expression());
    return text;
  }
  ResidualText text = ResidualNamed(at["name"].Text());
  for (const Field& value : at.Entries()) {
    if (value.name() == "name") continue;
    if (value.name() == "parameters" || value.name() == "let")
      value.Fail("is for a residual as text, this one has a name");
    ParameterNamed(text, value.name()) = ReadParameter(value);
  }
  return text;
}

// The simulated robot turns its angles into [-pi, pi]; where a domain goes beyond, the residual has to be the same
// after a turn. @throws ExpressionError
void RequireNoJump(const NominalModel& model, const Box& states, const ParametricResidual& residual,
                   const Program& program) {
  std::vector<int> turning;
  for (const int angle : model.angles())
    if (!(-std::numbers::pi <= states.lower()[angle] && states.upper()[angle] <= std::numbers::pi))
      turning.push_back(angle);
  for (std::size_t k = 0; k < residual.values.size(); ++k)
    RequireSameAfterTurns(program, static_cast<int>(k), residual.values[k],
                          fmt::format("the residual of {}", model.state_names()[k]), turning, model.state_names());
}

// The residual at `path`. Its expressions are parsed here for the first time.
ParametricResidual ReadResidual(const Field& at, const Problem& problem) {
  const NominalModel& model = *problem.model;
  const bool is_named = at.Has("name");
  const ResidualText text = ReadText(at);
  try {
    const ParametricResidual residual = ResidualOf(model, text);
    const ProgramDraft program = MakeProgram(residual.names, residual.values);
    RequireNoJump(model, problem.domain.state, residual, program.View());
    return residual;
  } catch (const ExpressionError& error) {
    if (!is_named) FailAt(at.file(), error);
    if (error.word().empty()) at.Fail("name", error.what());
    at.Fail("name", fmt::format("{} uses {}, which {} does not have", text.name, error.word(), model.name()));
  } catch (const std::invalid_argument& error) {
    (is_named ? at["name"] : at).Fail(error.what());
  }
}

// Rows for the map `path`, each parameter a number or, if `with_ranges`, an interval.
std::vector<Key> Rows(const std::string& path, std::vector<std::string_view> names, bool with_ranges) {
  const auto meaning_of = [&](const std::string& key, const std::string& meaning) {
    return with_ranges ? meaning : fmt::format("As `residual.{}`.", key);
  };
  std::vector<Key> keys{Word(path + ".name", std::move(names),
                             meaning_of("name",
                                        "A residual of the library, for each model that has its names: those of the "
                                        "paper's car for heading_saturation, of its point mass for velocity_knee."))};
  const auto add = [&](const Key& number) {
    keys.push_back(number);
    if (!with_ranges) return;
    Key range = Vector(number.path, number.unit, number.range, Key::Size::kAny, "Its smallest and largest value.");
    range.count = Between(2, 2);
    range.only = number.only;
    keys.push_back(std::move(range));
  };
  for (const auto& [residual, name, unit, range, meaning] : kParameters) {
    ResidualText text = ResidualNamed(residual);
    add(OnlyFor(residual, Optional(Number(path + "." + name, unit, range, meaning_of(name, meaning)),
                                   ToText(ParameterNamed(text, name).lower))));
  }
  keys.push_back(
      Map(path + ".parameters", meaning_of("parameters", "Of a residual as text, in the units of its expressions.")));
  add(Number(path + ".parameters.<name>", "", kReal, "The value."));
  keys.push_back(Map(path + ".let", meaning_of("let", "Definitions, which later expressions may use.")));
  keys.push_back(
      Expression(path + ".let.<name>",
                 meaning_of("let.<name>",
                            "It may use states, inputs, parameters and definitions of the model, these parameters, and "
                            "the definitions before it ([docs/expressions.md](../docs/expressions.md)).")));
  keys.push_back(Map(path + ".add",
                     meaning_of("add", "A residual as text: what the states have beyond the model's after a step.")));
  keys.push_back(
      Expression(path + ".add.<state>", meaning_of("add.<state>", "What is added to it; zero if it is left out.")));
  return keys;
}

}  // namespace

// What is assumed of the residual, each parameter a number or an interval.
std::vector<Key> ResidualKeys() {
  std::vector<Key> keys = Rows("residual", Names(), true);
  keys.insert(
      keys.begin(),
      Map("residual",
          "The residual's equations, as text or by name, for `forereach declare`. The certifier does not use them.",
          [](const Field& at, TaskDraft& draft) { draft.config.residual = ReadResidual(at, draft.problem); }));
  return keys;
}

std::vector<Key> RobotResidualKeys() {
  std::vector<std::string_view> names = Names();
  names.insert(names.begin(), kNone);
  std::vector<Key> keys = Rows("robot.residual", std::move(names), false);
  keys.insert(keys.begin(),
              {Optional(Word("robot.residual", {kNone}, "The robot is the nominal model."), kNone),
               Optional(Map("robot.residual", "What the real robot has beyond the nominal model, as text or by name.",
                            [](const Field& at, TaskDraft& draft) {
                              if (at.Has("name") && at["name"].Text() == kNone) return;
                              draft.config.robot_residual = ReadResidual(at, draft.problem);
                            }),
                        kNone)});
  return keys;
}

}  // namespace forereach::key_rows
