// The rows of the planner's laws: how the robot brakes and steers, as expressions.
#include <iterator>

#include "task/key_rows.h"
#include "task/row_readers.h"
#include "task/schema_parts.h"

namespace forereach::key_rows {
namespace {

constexpr int kMostWays = 16;  // to stop

Law ReadLaw(const Field& at, const TaskDraft& draft) {
  Law law;
  for (const std::string& input : draft.problem.model->input_names()) {
    if (!at.Has(input)) at.Fail(input, "missing: a law has an expression for each input");
    law.push_back(at[input].Expression());
  }
  return law;
}

// A law, or a list of laws.
std::vector<Key> WaysToStop(const std::string& path, std::vector<Law> Laws::*ways, std::string meaning,
                            std::string meaning_of_list) {
  const Key::Reader read = [ways](const Field& at, TaskDraft& draft) {
    (draft.config.laws.*ways).push_back(ReadLaw(at, draft));
  };
  const std::string of_control = "The control, clipped to domain.input.";
  return {Map(path, std::move(meaning), read), Expression(path + ".<input>", of_control),
          List(path, Between(1, kMostWays), std::move(meaning_of_list)), Map(path + "[]", "One way to stop.", read),
          Expression(path + "[].<input>", of_control)};
}

void ReadDefinitions(const Field& at, TaskDraft& draft) {
  for (const Field& let : at.Entries()) draft.config.laws.definitions.push_back({let.name(), let.Expression()});
}

void ReadAtRest(const Field& at, TaskDraft& draft) {
  const std::vector<std::string> states = draft.problem.model->state_names();
  std::vector<RestBound> at_rest;
  for (const Field& bound : at.Entries()) at_rest.push_back({IndexOf(states, bound.name()), bound.Number()});
  draft.config.laws.at_rest = std::move(at_rest);
}

}  // namespace

void CheckLaws(const std::string& file, const TaskDraft& draft) {
  const NominalModel& model = *draft.problem.model;
  const Laws& laws = draft.config.laws;
  try {
    for (const auto* ways : {&laws.stop, &laws.emergency_stop})
      for (const Law& law : *ways) static_cast<void>(MakeStopLaw(model, laws, law));
    if (!laws.back_off.empty()) static_cast<void>(MakeStopLaw(model, laws, laws.back_off));
    if (laws.speed) static_cast<void>(MakeSpeed(model, laws));
    static_cast<void>(MakeHints(model, laws));  // checks the definitions, too
  } catch (const ExpressionError& error) {
    FailAt(file, error);
  }
}

std::vector<Key> LawKeys() {
  std::vector<Key> keys{
      Map("planner.let", "Definitions for these expressions, which later ones may use.", ReadDefinitions),
      Expression("planner.let.<name>",
                 "It may use states, parameters, definitions of the model, and what `planner.hints` may use. "
                 "Expressions that may not use what it uses do not see it."),
  };
  std::ranges::move(WaysToStop("planner.stop", &Laws::stop,
                               "How the robot brakes: a braking tail is what the nominal model does under this law, up "
                               "to planner.at_rest. One expression an input, of states, parameters and definitions. "
                               "The planner requires it ([docs/planner.md](../docs/planner.md)).",
                               "Several ways. A plan ends with the first whose tail is allowed."),
                    std::back_inserter(keys));
  std::ranges::move(WaysToStop("planner.emergency_stop", &Laws::emergency_stop,
                               "How the robot brakes when a plan is withdrawn. Default: planner.stop.",
                               "Several ways. Each is sent until one is certified."),
                    std::back_inserter(keys));
  std::ranges::move(
      std::vector<Key>{
          Map("planner.back_off",
              "How the robot leaves a dead end, as a car in reverse. If it stands and finds no plan for some time, it "
              "moves under this law and stops by planner.stop, further each time near the same place. One expression "
              "an input, of what planner.stop may use. Without it the robot stays where it is.",
              [](const Field& at, TaskDraft& draft) { draft.config.laws.back_off = ReadLaw(at, draft); }),
          Expression("planner.back_off.<input>", "The control, clipped to domain.input."),
          Map("planner.hints",
              "A good control for driving in a direction. Where there is room a plan follows it "
              "(planner.clearance_step); a search tries it more often than others. One expression an input, of what "
              "planner.stop may use and of `desired_heading` (rad, the direction of travel in the first two safety "
              "coordinates; 0 or pi if there is one), `desired_speed` (m/s, there) and `desired_climb` (m/s, in the "
              "third). Without it the search finds controls by chance.",
              [](const Field& at, TaskDraft& draft) { draft.config.laws.hints = ReadLaw(at, draft); }),
          Expression("planner.hints.<input>", "The control, clipped to domain.input."),
          Optional(Key(Of(Key::Type::kExpression, "planner.speed",
                          "In m/s, negative in reverse, of what planner.stop may use. Plans neither reverse nor exceed "
                          "planner.cruise_speed by more than a few percent.",
                          [](const Field& at, TaskDraft& draft) { draft.config.laws.speed = at.Expression(); })),
                   "that of the safety coordinates, whatever its direction"),
          Optional(Map("planner.at_rest",
                       "Where a braking tail ends: each state named here is at most its bound in absolute value. `{}`, "
                       "for robots that cannot stand: a tail has planner.tail_steps steps.",
                       ReadAtRest),
                   "a tenth of each bound of task.rest"),
          Number("planner.at_rest.<state>", "of the state", kPositive, "Its bound."),
      },
      std::back_inserter(keys));
  return keys;
}

}  // namespace forereach::key_rows
